//! When conditions switch operations, compared with a model that looks at every nanosecond; what depends on it and what
//! does not: copies of an operation, the tail of a delay, and who hears a message.

use std::cell::RefCell;
use std::collections::BTreeMap;

use proptest::prelude::*;

use sesame_base::condition::holds;
use sesame_base::observation::{Counters, OperationEffect};
use sesame_base::time::SimTime;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::testing::{latency, operation, plan, test_of, use_of};
use sesame_plan::{
    Activation, Aggregate, CampaignPlan, Choice, Condition as Holds, Copies, Distribution, Drain, FieldRef, Formula,
    Input, Members, MetricId, MetricSource, Operation, OperationKind, Side, Span, TestOperation, TopicId,
};

use crate::metric::MetricTable;
use crate::relay::{Delivery, Exchange as _, Finished, Listener, OperationEvent, Relay};
use crate::value::{Fields, Record, Value};
use crate::wire::{Wire, WireTable};

const COMMAND: &str = "arm/command";
const ZONE: &str = "zones/Z1";

/// A whole number of nanoseconds in seconds: what times, values and numbers in conditions are here.
fn nanos(n: i64) -> f64 {
    SimTime::from_nanos(n).seconds()
}

fn in_nanos(spans: &[Span]) -> Vec<(i64, i64)> {
    let nanos = |seconds| SimTime::from_seconds(seconds).nanos();
    spans.iter().map(|span| (nanos(span.start), nanos(span.end))).collect()
}

/// The fuzzing time, the last command and the last level of a zone, which is 3 before the first.
fn watched(operations: Vec<Operation>) -> CampaignPlan {
    let mut plan = plan(operations);
    let level = FieldRef { topic: TopicId(1), path: vec!["level".to_owned()] };
    let source = MetricSource::Last { input: level };
    plan.metrics.push(sesame_plan::Metric { source, initial: Some(nanos(3)), ..plan.metrics[1].clone() });
    plan
}

fn zone(level: f64) -> Value {
    Record::new(&Fields::new(["level", "count"]), vec![level.into(), 1i64.into()]).into()
}

/// What happens in a run, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    Command(i64, i64),
    Zone(i64, i64),
    Step(i64),
}

impl Event {
    fn time(self) -> i64 {
        match self {
            Event::Command(time, _) | Event::Zone(time, _) | Event::Step(time) => time,
        }
    }
}

fn run(plan: &CampaignPlan, test: Vec<TestOperation>, events: &[Event], end: i64) -> (Vec<(i64, f64)>, Finished) {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(plan, &wires, &test_of(test), metrics.start(), &[]).unwrap().received_everywhere();
    let (command, level) = (wires.find(COMMAND).unwrap(), wires.find(ZONE).unwrap());
    let mut commands = Vec::new();
    for &event in events.iter().chain([&Event::Step(end)]) {
        let (now, mut out) = (SimTime::from_nanos(event.time()), Vec::new());
        match event {
            Event::Command(_, value) => relay.message(now, command, Value::Real(nanos(value)), &mut out),
            Event::Zone(_, value) => relay.message(now, level, zone(nanos(value)), &mut out),
            Event::Step(_) => relay.advance(now, &mut out),
        }
        let sent = out.into_iter().filter(|delivery| delivery.wire == command);
        commands.extend(sent.map(|Delivery { value, .. }| (event.time(), value.number_at::<&str>(&[]).unwrap())));
    }
    (commands, relay.finish(SimTime::from_nanos(end)))
}

/// What happens in a run, with its time in nanoseconds.
type Log = RefCell<Vec<(i64, String)>>;

/// A listener that writes a log.
struct Logger<'a>(&'a Log);

impl Logger<'_> {
    fn log(&self, now: SimTime, what: String) {
        self.0.borrow_mut().push((now.nanos(), what));
    }
}

impl Listener for Logger<'_> {
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.log(now, format!("published {index} on {}: {value:?}", wire.index()));
    }
    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.log(now, format!("delivered {index} on {}: {value:?}", wire.index()));
    }
    fn operated(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        self.log(now, format!("{operation}: {event:?}"));
    }
}

/// The log of a run until `END`. Time advances to each moment that is due, or to every nanosecond; in that case `None`
/// if anything happened at a nanosecond that was not due.
fn logged(plan: &CampaignPlan, test: Vec<TestOperation>, events: &[Event], every: bool) -> Option<Vec<(i64, String)>> {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let log = Log::default();
    let mut logger = Logger(&log);
    let relay = Relay::new(plan, &wires, &test_of(test), metrics.start(), &[]).unwrap();
    let mut relay = relay.received_everywhere().tapped(&mut logger);
    let (command, level) = (wires.find(COMMAND).unwrap(), wires.find(ZONE).unwrap());
    let mut now = -1;
    for &event in events.iter().chain([&Event::Step(END)]) {
        while now < event.time() {
            let due = relay.next_due().map(SimTime::nanos);
            now = if every { now + 1 } else { due.map_or(event.time(), |due| due.min(event.time())) };
            let before = log.borrow().len();
            relay.advance(SimTime::from_nanos(now), &mut Vec::new());
            let happened = log.borrow().len() > before;
            if happened && due != Some(now) || relay.next_due().is_some_and(|due| due.nanos() <= now) {
                return None;
            }
        }
        match event {
            Event::Command(_, value) => {
                relay.message(SimTime::from_nanos(now), command, Value::Real(nanos(value)), &mut Vec::new());
            }
            Event::Zone(_, value) => {
                relay.message(SimTime::from_nanos(now), level, zone(nanos(value)), &mut Vec::new());
            }
            Event::Step(_) => {}
        }
    }
    drop(relay);
    Some(log.into_inner())
}

fn events(numbers: &[(i64, i64, u8)]) -> Vec<Event> {
    let mut time = 0;
    let event = |&(gap, value, kind): &(i64, i64, u8)| {
        time += gap;
        match kind {
            0 => Event::Command(time, value),
            1 => Event::Zone(time, value),
            _ => Event::Step(time),
        }
    };
    numbers.iter().map(event).collect()
}

fn any_events() -> impl Strategy<Value = Vec<Event>> {
    prop::collection::vec((0i64..4, 0i64..8, 0u8..3), 0..50).prop_map(|numbers| events(&numbers))
}

/// Conditions over these metrics, all of which are a few nanoseconds.
fn any_condition(metrics: Vec<u32>) -> impl Strategy<Value = Condition> {
    let by = prop::sample::select(vec![Comparison::Below, Comparison::Above, Comparison::Equal]);
    let variable = prop::sample::select(metrics).prop_map(|metric| Operand::Variable(MetricId(metric)));
    let operand = prop_oneof![variable.clone(), (0i64..8).prop_map(|n| Operand::Number(nanos(n)))];
    let leaf = (variable, by, operand, any::<bool>()).prop_map(|(one, by, other, turned)| {
        let (left, right) = if turned { (other, one) } else { (one, other) };
        Condition::Compare { left, by, right }
    });
    leaf.prop_recursive(2, 4, 2, |inner| {
        (inner.clone(), inner, any::<bool>()).prop_map(|(a, b, both)| {
            let (a, b) = (Box::new(a), Box::new(b));
            if both { Condition::And(a, b) } else { Condition::Or(a, b) }
        })
    })
}

fn any_activation(metrics: Vec<u32>) -> impl Strategy<Value = Activation> {
    let length = prop::option::of(1i64..12);
    (any_condition(metrics.clone()), any_condition(metrics), length, 1u32..4).prop_map(|(start, end, length, times)| {
        match length {
            Some(length) => Activation::ConditionFor { start, length: nanos(length), times },
            None => Activation::Condition { start, end, times },
        }
    })
}

const END: i64 = 90;

/// One operation in the model.
#[derive(Default)]
struct Plain {
    on: Option<i64>,
    switched: Option<i64>,
    /// Per moment, from the last one at which it was active: whether what begins it holds.
    history: Vec<bool>,
    intervals: Vec<(i64, i64)>,
}

/// The rules of activation, said plainly: every nanosecond is looked at, before its messages and after each of them.
fn plainly(plan: &CampaignPlan, test: &[TestOperation], events: &[Event]) -> Vec<Vec<(i64, i64)>> {
    let mut plain: Vec<Plain> = test.iter().map(|_| Plain { history: vec![false], ..Plain::default() }).collect();
    let mut values = BTreeMap::from([(MetricId(2), nanos(3))]);
    for t in 0..END {
        let here = events.iter().filter(|event| event.time() == t).map(Some);
        for event in std::iter::once(None).chain(here) {
            match event {
                Some(&Event::Command(_, value)) => drop(values.insert(MetricId(1), nanos(value))),
                Some(&Event::Zone(_, value)) => drop(values.insert(MetricId(2), nanos(value))),
                Some(Event::Step(_)) | None => {}
            }
            let active: i64 = plain
                .iter()
                .flat_map(|operation| operation.intervals.iter().copied().chain(operation.on.map(|on| (on, t))))
                .map(|(a, b)| b - a)
                .sum();
            values.insert(MetricId(0), nanos(active));
            let true_now = |condition: &Condition| holds(condition, &|metric| values.get(&metric).copied());
            for (operation, used) in plain.iter_mut().zip(test) {
                let Some(since) = operation.on else { continue };
                let within = in_nanos(&[plan.operation(used.operation).within])[0];
                let over = t >= within.1
                    || match &used.activation {
                        Activation::Condition { end, .. } => true_now(end),
                        Activation::ConditionFor { length, .. } => t >= since + SimTime::from_seconds(*length).nanos(),
                        other => panic!("{other:?} is not by condition"),
                    };
                if over && operation.switched != Some(t) {
                    operation.intervals.push((since, t));
                    (operation.on, operation.switched) = (None, Some(t));
                    operation.history.drain(..operation.history.len() - 1);
                }
            }
            for at in 0..test.len() {
                let within = in_nanos(&[plan.operation(test[at].operation).within])[0];
                if t < within.0 {
                    continue;
                }
                let (begins, times) = match &test[at].activation {
                    Activation::Condition { start, end, times } => (true_now(start) && !true_now(end), *times),
                    Activation::ConditionFor { start, times, .. } => (true_now(start), *times),
                    other => panic!("{other:?} is not by condition"),
                };
                let blocked = plan.campaign.copies == Copies::Apart
                    && (0..test.len()).any(|other| {
                        other != at && test[other].operation == test[at].operation && plain[other].on.is_some()
                    });
                let operation = &mut plain[at];
                operation.history.push(begins);
                let stretch = operation.history.iter().rev().take_while(|begins| **begins).count();
                let became = stretch > 0 && stretch < operation.history.len();
                let left = u32::try_from(operation.intervals.len()).unwrap() < times;
                if became && operation.on.is_none() && operation.switched != Some(t) && left && t < within.1 && !blocked
                {
                    (operation.on, operation.switched) = (Some(t), Some(t));
                }
            }
        }
    }
    let spans = plain
        .into_iter()
        .map(|operation| operation.intervals.into_iter().chain(operation.on.map(|on| (on, END))).collect());
    spans.collect()
}

fn hole(within: (i64, i64)) -> Operation {
    let within = Span { start: nanos(within.0), end: nanos(within.1) };
    Operation { within, ..operation(0, OperationKind::Blackhole) }
}

fn used(operation: u32, activation: Activation, parameters: Vec<Choice>) -> TestOperation {
    TestOperation { activation, ..use_of(operation, 0.0, 0.0, parameters, 1) }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]
    #[test]
    fn activations_are_those_of_a_model_that_looks_at_every_nanosecond(
        events in any_events(),
        activations in prop::collection::vec((0u32..2, any_activation(vec![0, 1, 2])), 1..4),
        apart: bool,
    ) {
        let mut plan = watched(vec![hole((0, 80)), hole((7, 60))]);
        plan.campaign.copies = if apart { Copies::Apart } else { Copies::MayOverlap };
        let test: Vec<TestOperation> =
            activations.into_iter().map(|(operation, activation)| used(operation, activation, vec![])).collect();
        let expected = plainly(&plan, &test, &events);
        let events: Vec<Event> = events.into_iter().filter(|event| event.time() < END).collect();
        let (_, finished) = run(&plan, test, &events, END);
        for (effect, expected) in finished.operations.iter().zip(expected) {
            prop_assert!(effect.intervals.iter().all(|span| span.start < span.end));
            prop_assert_eq!(in_nanos(&effect.intervals), expected);
        }
    }

    #[test]
    fn between_messages_something_happens_exactly_when_it_is_due(
        events in any_events(),
        activations in prop::collection::vec((0u32..3, any_activation(vec![0, 1, 2])), 1..4),
        delay in 0i64..20,
    ) {
        let lag = |drain| Operation { within: Span { start: 0.0, end: nanos(80) }, ..operation(0, latency(Distribution::Fixed, drain)) };
        let plan = watched(vec![hole((0, 80)), lag(Drain::Finish), lag(Drain::Flush)]);
        let test: Vec<TestOperation> = activations.into_iter().map(|(operation, activation)| {
            let parameters = if operation == 0 { vec![] } else { vec![Choice::Value { value: nanos(delay) }] };
            used(operation, activation, parameters)
        }).collect();
        let events: Vec<Event> = events.into_iter().filter(|event| event.time() < END).collect();
        let always = logged(&plan, test.clone(), &events, true);
        prop_assert!(always.is_some(), "something happened at a nanosecond that was not due");
        prop_assert_eq!(logged(&plan, test, &events, false), always);
    }

    #[test]
    fn messages_and_steps_that_no_condition_reads_change_nothing(
        events in any_events(),
        more in any_events(),
        activations in prop::collection::vec((0u32..3, any_activation(vec![0, 1])), 1..4),
        delay in 0i64..20,
    ) {
        let lag = |drain| Operation { within: Span { start: 0.0, end: nanos(80) }, ..operation(0, latency(Distribution::Fixed, drain)) };
        let plan = watched(vec![hole((0, 80)), lag(Drain::Finish), lag(Drain::Flush)]);
        let test: Vec<TestOperation> = activations.into_iter().map(|(operation, activation)| {
            let parameters = if operation == 0 { vec![] } else { vec![Choice::Value { value: nanos(delay) }] };
            used(operation, activation, parameters)
        }).collect();
        let commands = |event: &Event| matches!(event, Event::Command(..)) && event.time() < END;
        let alone: Vec<Event> = events.into_iter().filter(commands).collect();
        let others = more.into_iter().filter(|event| !commands(event) && event.time() < END);
        let mut together: Vec<Event> = alone.iter().copied().chain(others).collect();
        together.sort_by_key(|event| event.time());
        let (heard, one) = run(&plan, test.clone(), &alone, END);
        let (heard_among_others, other) = run(&plan, test, &together, END);
        prop_assert_eq!(&one.operations, &other.operations);
        prop_assert_eq!(&one.metrics[0], &other.metrics[0]);
        let values = |heard: &[(i64, f64)]| heard.iter().map(|(_, value)| *value).collect::<Vec<f64>>();
        prop_assert_eq!(values(&heard), values(&heard_among_others));
        // What is counted and how long it took add up.
        let mut total = 0;
        for OperationEffect { intervals, tails, counters, .. } in &one.operations {
            prop_assert!(counters.delayed + counters.dropped <= counters.seen, "{counters:?}");
            let mut spans = in_nanos(intervals);
            spans.extend(in_nanos(tails));
            spans.sort_unstable();
            prop_assert!(spans.windows(2).all(|two| two[0].1 <= two[1].0), "{spans:?}");
            prop_assert!(spans.iter().all(|(start, end)| start < end), "{spans:?}");
            total += spans.iter().map(|(start, end)| end - start).sum::<i64>();
        }
        prop_assert_eq!(one.metrics[0].value, Some(nanos(total)), "the fuzzing time");
    }
}

fn above(metric: u32, number: f64) -> Condition {
    let (left, right) = (Operand::Variable(MetricId(metric)), Operand::Number(number));
    Condition::Compare { left, by: Comparison::Above, right }
}

/// A command of 0, 1, 2, … each tenth of a second until 10 s, to a simulator that subscribes from some moment on.
fn commanded(plan: &CampaignPlan, test: Vec<TestOperation>, subscribes: Option<u32>) -> Finished {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(plan, &wires, &test_of(test), metrics.start(), &[]).unwrap();
    let command = wires.find(COMMAND).unwrap();
    for tenth in 0..=100 {
        if subscribes == Some(tenth) {
            relay.subscribed(command);
        }
        let now = SimTime::from_nanos(i64::from(tenth) * 100_000_000);
        relay.advance(now, &mut Vec::new());
        relay.message(now, command, Value::Real(f64::from(tenth)), &mut Vec::new());
    }
    relay.finish(SimTime::from_seconds(10.0))
}

fn seconds(spans: &[Span]) -> Vec<(f64, f64)> {
    spans.iter().map(|span| (span.start, span.end)).collect()
}

#[test]
fn a_copy_begins_when_the_other_ends_if_its_condition_still_holds_and_is_lost_otherwise() {
    let copies = |copies, second: Condition| {
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        plan.campaign.copies = copies;
        let first = Activation::Condition { start: above(1, 2.5), end: above(1, 6.5), times: 1 };
        let second = Activation::Condition { start: second, end: above(1, 9.5), times: 1 };
        let finished = commanded(&plan, vec![used(0, second, vec![]), used(0, first, vec![])], Some(0));
        finished.operations.iter().map(|effect| seconds(&effect.intervals)).collect::<Vec<_>>()
    };
    let first = vec![(0.3, 0.7)];
    assert_eq!(copies(Copies::Apart, above(1, 3.5)), [vec![(0.7, 1.0)], first.clone()]);
    assert_eq!(copies(Copies::MayOverlap, above(1, 3.5)), [vec![(0.4, 1.0)], first.clone()]);
    let below =
        Condition::Compare { left: Operand::Variable(MetricId(1)), by: Comparison::Below, right: Operand::Number(5.5) };
    let briefly = Condition::And(Box::new(above(1, 3.5)), Box::new(below));
    assert_eq!(copies(Copies::Apart, briefly.clone()), [vec![], first.clone()], "by then it holds no more");
    assert_eq!(copies(Copies::MayOverlap, briefly), [vec![(0.4, 1.0)], first]);
}

#[test]
fn a_short_window_with_a_long_delay_is_charged_for_its_tail() {
    let plan = plan(vec![operation(0, latency(Distribution::Fixed, Drain::Finish))]);
    let test = vec![use_of(0, 1.0, 1.1, vec![Choice::Value { value: 5.0 }], 1)];
    let finished = commanded(&plan, test, Some(0));
    let OperationEffect { intervals, tails, counters, first_touch, last_touch } = &finished.operations[0];
    assert_eq!((seconds(intervals), seconds(tails)), (vec![(1.0, 1.1)], vec![(1.1, 6.0)]));
    assert_eq!(*counters, Counters { seen: 1, delayed: 1, queued: 49, ..Counters::default() });
    assert_eq!((*first_touch, *last_touch), (Some(1.0), Some(5.9)));
    assert_eq!(finished.metrics[0].value, Some(5.0), "fuzzing time");
}

#[test]
fn a_condition_over_the_fuzzing_time_sees_the_tail() {
    let plan =
        plan(vec![operation(0, latency(Distribution::Fixed, Drain::Finish)), operation(1, OperationKind::Blackhole)]);
    let lag = use_of(0, 1.0, 1.1, vec![Choice::Value { value: 5.0 }], 1);
    let after = Activation::ConditionFor { start: above(0, 2.0), length: 0.5, times: 1 };
    let finished = commanded(&plan, vec![lag, used(1, after, vec![])], Some(0));
    assert_eq!(seconds(&finished.operations[1].intervals), [(3.000_000_001, 3.500_000_001)]);
}

#[test]
fn times_that_grow_are_compared_where_they_meet_and_not_at_every_nanosecond() {
    let always = Formula {
        inputs: vec![Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)],
        aggregate: Aggregate::Duration { of: Holds::Constant(true) },
        when: None,
        every: None,
        per: None,
        side: Side::Inbound,
    };
    let mut plan = plan((0..3).map(|_| operation(1, OperationKind::Blackhole)).collect());
    plan.metrics[1].source = MetricSource::Formula { formula: always };
    plan.operations[2].timed = false;
    // The fuzzing time is beyond the time of the run.
    let [fuzzing_time, duration] = [0, 1].map(|metric| Operand::Variable(MetricId(metric)));
    let start = Condition::Compare { left: fuzzing_time, by: Comparison::Above, right: duration };
    let after = used(2, Activation::ConditionFor { start, length: 0.5, times: 1 }, vec![]);
    let twice = [0, 1].map(|operation| use_of(operation, 1.0, 4.0, vec![], 1));
    let faster = commanded(&plan, twice.into_iter().chain([after.clone()]).collect(), None);
    assert_eq!(seconds(&faster.operations[2].intervals), [(2.000_000_001, 2.500_000_001)]);
    let alike = commanded(&plan, vec![use_of(0, 0.0, 10.0, vec![], 1), after], None);
    assert!(alike.operations[1].intervals.is_empty());
}

#[test]
fn what_an_operation_makes_of_a_copy_does_not_depend_on_other_operations() {
    let loss = || operation(0, OperationKind::PacketLoss);
    let plan = plan(vec![operation(0, OperationKind::Duplicate), loss(), operation(1, OperationKind::Blackhole)]);
    let doubled = || use_of(0, 0.0, 10.0, vec![Choice::Value { value: 1.0 }], 7);
    let lost = || use_of(1, 0.0, 10.0, vec![Choice::Value { value: 0.5 }], 8);
    let alone = commanded(&plan, vec![doubled(), lost()], Some(0));
    let beside = commanded(&plan, vec![use_of(2, 0.0, 10.0, vec![], 9), doubled(), lost()], Some(0));
    assert_eq!(alone.operations[..], beside.operations[1..]);
}

#[test]
fn what_nobody_hears_is_no_effect() {
    let plan = plan(vec![operation(0, OperationKind::Blackhole), operation(1, OperationKind::Blackhole)]);
    let cut = || vec![use_of(0, 1.0, 2.0, vec![], 1)];
    let deaf = commanded(&plan, cut(), None);
    let effect = &deaf.operations[0];
    assert_eq!(effect.counters, Counters { seen: 10, unheard: 10, ..Counters::default() });
    assert!(!effect.counters.any_effect());
    assert_eq!((effect.first_touch, effect.last_touch), (None, None));
    assert_eq!(deaf.unheard, [COMMAND, "zones/Z1", "zones/Z2"], "whether this test disturbs them or not");

    let late = commanded(&plan, cut(), Some(15));
    let effect = &late.operations[0];
    assert_eq!(effect.counters, Counters { seen: 10, dropped: 5, unheard: 5, ..Counters::default() });
    assert_eq!(effect.first_touch, Some(1.5), "it is heard from then on");
    assert_eq!(late.unheard, ["zones/Z1", "zones/Z2"]);
}

#[test]
fn what_is_held_where_nobody_listens_is_never_counted_as_delayed_or_dropped() {
    for drain in [Drain::Finish, Drain::Flush, Drain::Drop] {
        let plan = plan(vec![operation(0, latency(Distribution::Fixed, drain))]);
        let test = vec![use_of(0, 1.0, 2.0, vec![Choice::Value { value: 0.35 }], 1)];
        let counters = commanded(&plan, test, None).operations[0].counters;
        assert!(!counters.any_effect() && counters.unheard >= 10, "{drain:?}: {counters:?}");
    }
}

#[test]
fn an_outbound_metric_hears_its_topic() {
    let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
    plan.metrics[1].source = MetricSource::Formula {
        formula: Formula {
            inputs: vec![Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)],
            aggregate: Aggregate::Count { of: Holds::Constant(true) },
            when: None,
            every: None,
            per: None,
            side: Side::Outbound,
        },
    };
    let finished = commanded(&plan, vec![use_of(0, 1.0, 2.0, vec![], 1)], None);
    assert_eq!(finished.operations[0].counters.dropped, 10);
    assert!(finished.unheard.is_empty());
}
