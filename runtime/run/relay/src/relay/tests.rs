//! Behaviour of the relay on small message streams, and the release queue compared with a naive model.

use proptest::prelude::*;

use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::testing::{at, latency, offset, operation, plan, test_of, use_of};
use sesame_plan::{
    Activation, Aggregate, Choice, Condition, Distribution, Drain, FieldRef, Formula, Input, Members, MetricId,
    MetricSource, Moment, Operation, OperationKind, Side, Test, TestOperation, TopicId, ValueMode, condition as switch,
};

use crate::fuzz::{MessageCall, OperationContext, OperationEntry, OperationHook};
use crate::metric::MetricTable;
use crate::relay::{Delivery, Exchange, Finished, Relay};
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

const COMMAND: &str = "arm/command";

fn one(value: f64) -> Vec<Choice> {
    vec![Choice::Value { value }]
}

fn range(low: f64, high: f64) -> Vec<Choice> {
    vec![Choice::Range { low, high }]
}

/// Publishes messages `(seconds, topic, value)` with a tick every tenth of a second in between, up to ten seconds.
/// Gives what was delivered, with the time of delivery, and what the relay left behind.
fn relayed(
    operations: Vec<Operation>,
    test: &[TestOperation],
    messages: &[(f64, &str, Value)],
) -> (Vec<(f64, String, Value)>, Finished) {
    relayed_with(&[], operations, test, messages)
}

/// The same with the code of custom operations.
fn relayed_with(
    hooks: &[OperationEntry],
    operations: Vec<Operation>,
    test: &[TestOperation],
    messages: &[(f64, &str, Value)],
) -> (Vec<(f64, String, Value)>, Finished) {
    let plan = plan(operations);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut relay =
        Relay::new(&plan, &wires, &test_of(test.to_vec()), metrics.start(), hooks).unwrap().received_everywhere();
    let mut delivered = Vec::new();
    let mut messages = messages.iter().peekable();
    for tick in 0..=100 {
        let now = SimTime::from_nanos(tick * 100_000_000);
        let mut out = Vec::new();
        relay.advance(now, &mut out);
        while let Some((_, path, value)) = messages.next_if(|(time, ..)| SimTime::from_seconds(*time) <= now) {
            relay.message(now, wires.find(path).unwrap(), value.clone(), &mut out);
        }
        delivered.extend(
            out.into_iter().map(|Delivery { wire, value, .. }| (now.seconds(), wires.path(wire).to_owned(), value)),
        );
    }
    (delivered, relay.finish(SimTime::from_seconds(10.0)))
}

/// A command of 0, 1, 2, … each tenth of a second.
fn commands(count: u32) -> Vec<(f64, &'static str, Value)> {
    (0..count).map(|n| (f64::from(n) * 0.1, COMMAND, Value::Real(f64::from(n)))).collect()
}

fn numbers(delivered: &[(f64, String, Value)]) -> Vec<(f64, f64)> {
    delivered.iter().map(|(time, _, value)| (*time, value.number_at::<&str>(&[]).unwrap())).collect()
}

#[test]
fn an_untimed_operation_acts_and_does_not_count_in_the_fuzzing_time() {
    let timed = operation(0, OperationKind::Blackhole);
    let untimed = Operation { timed: false, ..timed.clone() };
    let test = [use_of(0, 1.0, 2.0, vec![], 1), use_of(1, 4.0, 9.0, vec![], 1)];
    let (delivered, finished) = relayed(vec![timed, untimed], &test, &commands(100));
    assert_eq!(finished.metrics[0].value, Some(1.0));
    assert_eq!(delivered.len(), 100 - 10 - 50);
    assert_eq!(finished.operations[1].intervals.len(), 1, "it is observed like any other");
}

#[test]
fn without_operations_everything_passes_at_once_and_as_it_came() {
    let (delivered, finished) = relayed(vec![], &[], &commands(50));
    let sent: Vec<_> = commands(50).into_iter().map(|(t, _, v)| (SimTime::from_seconds(t).seconds(), v)).collect();
    assert_eq!(delivered.into_iter().map(|(t, _, v)| (t, v)).collect::<Vec<_>>(), sent);
    assert_eq!(finished.messages, 50);
}

#[test]
fn a_blackhole_drops_everything_while_it_is_active_and_nothing_else() {
    let hole = vec![operation(0, OperationKind::Blackhole)];
    let (delivered, finished) = relayed(hole, &[use_of(0, 1.0, 2.0, vec![], 1)], &commands(50));
    let kept: Vec<f64> = numbers(&delivered).into_iter().map(|(_, n)| n).collect();
    assert_eq!(kept, (0..50).filter(|n| !(10..20).contains(n)).map(f64::from).collect::<Vec<_>>());
    let effect = &finished.operations[0];
    assert_eq!((effect.counters.seen, effect.counters.dropped), (10, 10));
    assert_eq!((effect.first_touch, effect.last_touch), (Some(1.0), Some(1.9)));
}

#[test]
fn loss_is_the_probability_to_drop() {
    let loss = || vec![operation(0, OperationKind::PacketLoss)];
    let dropped = |p| {
        let (_, finished) = relayed(loss(), &[use_of(0, 0.0, 10.0, one(p), 3)], &commands(100));
        finished.operations[0].counters.dropped
    };
    assert_eq!(dropped(0.0), 0);
    assert_eq!(dropped(1.0), 100);
    assert!((30..=50).contains(&dropped(0.4)), "{}", dropped(0.4));
}

#[test]
fn a_shorter_window_disturbs_its_messages_just_the_same() {
    let loss = || vec![operation(0, OperationKind::PacketLoss)];
    let kept = |start| {
        let (delivered, _) = relayed(loss(), &[use_of(0, start, 8.0, one(0.5), 3)], &commands(100));
        numbers(&delivered).into_iter().filter(|(t, _)| (5.0..8.0).contains(t)).collect::<Vec<_>>()
    };
    assert_eq!(kept(0.0), kept(5.0));
}

#[test]
fn a_fixed_delay_shifts_every_message_by_it() {
    let lag = vec![operation(0, latency(Distribution::Fixed, Drain::Finish))];
    let (delivered, finished) = relayed(lag, &[use_of(0, 0.0, 10.0, one(0.3), 1)], &commands(20));
    let expected: Vec<_> = (0..20).map(|n| (f64::from(n + 3) / 10.0, f64::from(n))).collect();
    assert_eq!(numbers(&delivered), expected);
    assert_eq!(finished.operations[0].counters.delayed, 20);
}

/// Ten messages from 0 s, delayed by half a second until 0.5 s: what each drain policy makes of the tail.
fn drained(drain: Drain) -> (Vec<(f64, f64)>, Finished) {
    let lag = vec![operation(0, latency(Distribution::Fixed, drain))];
    let (delivered, finished) = relayed(lag, &[use_of(0, 0.0, 0.5, one(0.5), 1)], &commands(10));
    (numbers(&delivered), finished)
}

#[test]
fn when_the_window_ends_held_messages_finish_and_later_ones_queue_behind_them() {
    let (delivered, finished) = drained(Drain::Finish);
    let times: Vec<f64> = delivered.iter().map(|(time, _)| *time).collect();
    assert_eq!(delivered.iter().map(|(_, n)| *n).collect::<Vec<_>>(), (0..10).map(f64::from).collect::<Vec<_>>());
    assert_eq!(times, [0.5, 0.6, 0.7, 0.8, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9]);
    let Counters { seen, delayed, queued, .. } = finished.operations[0].counters;
    assert_eq!((seen, delayed, queued), (5, 5, 4), "the tail is counted apart; the last waited for nobody");
}

#[test]
fn when_the_window_ends_flushed_messages_go_at_once() {
    let (delivered, _) = drained(Drain::Flush);
    let expected: Vec<_> = (0..10).map(|n| (f64::from(n.max(5)) / 10.0, f64::from(n))).collect();
    assert_eq!(delivered, expected);
}

#[test]
fn when_the_window_ends_dropped_messages_are_gone() {
    let (delivered, finished) = drained(Drain::Drop);
    // The first was due at 0.5 s, the moment at which the window ends: it is gone too.
    assert_eq!(delivered.iter().map(|(_, n)| *n).collect::<Vec<_>>(), [5.0, 6.0, 7.0, 8.0, 9.0]);
    let counters = finished.operations[0].counters;
    assert_eq!((counters.delayed, counters.dropped), (0, 5));
}

#[test]
fn an_offset_is_drawn_anew_for_each_message_from_the_sub_range() {
    let jitter = vec![operation(0, offset(ValueMode::Offset, false))];
    let (delivered, finished) = relayed(jitter, &[use_of(0, 1.0, 9.0, range(2.0, 3.0), 7)], &commands(100));
    let shifts: Vec<f64> = numbers(&delivered).iter().zip(0..).map(|((_, n), at)| n - f64::from(at)).collect();
    assert!(shifts[..10].iter().chain(&shifts[90..]).all(|&shift| shift == 0.0));
    assert!(shifts[10..90].iter().all(|shift| (1.999..3.001).contains(shift)), "{shifts:?}");
    let mut distinct: Vec<i64> = shifts[10..90].iter().map(|shift| SimTime::from_seconds(*shift).nanos()).collect();
    distinct.dedup();
    assert_eq!(distinct.len(), 80);
    assert_eq!(finished.operations[0].counters.changed, 80);
}

fn zone(level: f64, count: i64) -> Value {
    Record::new(&Fields::new(["level", "count"]), vec![level.into(), count.into()]).into()
}

#[test]
fn a_nested_whole_number_stays_whole_and_its_neighbours_untouched() {
    let shift = vec![at(&["count"], operation(1, offset(ValueMode::Absolute, true)))];
    let messages: Vec<_> = (0..60).map(|n| (f64::from(n) * 0.1, "zones/Z1", zone(0.5, 100))).collect();
    let (delivered, _) = relayed(shift, &[use_of(0, 0.0, 10.0, range(-1.0, 1.0), 7)], &messages);
    let mut seen = std::collections::BTreeSet::new();
    for (_, _, value) in &delivered {
        let Some(&Value::Int(count)) = value.at(&["count"]) else { panic!("{value:?}") };
        seen.insert(count);
        assert_eq!(value.at(&["level"]), Some(&Value::Real(0.5)));
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), [-1, 0, 1]);
}

#[test]
fn members_of_a_group_are_disturbed_independently() {
    let jitter = vec![at(&["level"], operation(1, offset(ValueMode::Absolute, false)))];
    let messages = [(0.1, "zones/Z1", zone(0.0, 1)), (0.1, "zones/Z2", zone(0.0, 1))];
    let (delivered, _) = relayed(jitter, &[use_of(0, 0.0, 10.0, range(0.0, 1.0), 7)], &messages);
    assert_ne!(delivered[0].2, delivered[1].2);
}

#[test]
fn operations_apply_in_priority_then_declaration_order() {
    let mut replace = operation(0, offset(ValueMode::Absolute, false));
    let shift = operation(0, offset(ValueMode::Offset, false));
    let test = [use_of(1, 0.0, 10.0, range(1.0, 1.0), 1), use_of(0, 0.0, 10.0, range(5.0, 5.0), 1)];
    let (declared, _) = relayed(vec![replace.clone(), shift.clone()], &test, &commands(1));
    assert_eq!(numbers(&declared), [(0.0, 6.0)], "replaced by 5, then shifted by 1");
    replace.priority = -1;
    let (prioritised, _) = relayed(vec![replace, shift], &test, &commands(1));
    assert_eq!(numbers(&prioritised), [(0.0, 5.0)], "shifted by 1, then replaced by 5");
}

#[test]
fn a_delayed_message_goes_on_through_later_operations_when_it_is_released() {
    let chain = vec![operation(0, latency(Distribution::Fixed, Drain::Finish)), operation(0, OperationKind::Blackhole)];
    let test = [use_of(0, 0.0, 10.0, one(1.0), 1), use_of(1, 1.0, 1.5, vec![], 1)];
    let (delivered, _) = relayed(chain, &test, &commands(10));
    // Messages of 0.0 to 0.4 s come to the blackhole from 1.0 to 1.4 s, while it is active.
    assert_eq!(numbers(&delivered), (5..10).map(|n| (f64::from(n + 10) / 10.0, f64::from(n))).collect::<Vec<_>>());
}

#[test]
fn metrics_see_what_was_sent_not_what_was_made_of_it() {
    let hole = vec![operation(0, OperationKind::Blackhole)];
    let (_, finished) = relayed(hole, &[use_of(0, 0.0, 4.0, vec![], 1)], &commands(30));
    assert_eq!(finished.metrics[1].value, Some(29.0));
    assert_eq!(finished.metrics[0].value, Some(4.0), "fuzzing time");
}

#[test]
fn choices_outside_what_is_permitted_are_refused() {
    let plan = plan(vec![operation(0, OperationKind::PacketLoss)]);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test: Test = test_of(vec![use_of(0, 0.0, 1.0, one(1.5), 1)]);
    let refused = Relay::new(&plan, &wires, &test, metrics.start(), &[]).err().map(|error| error.to_string());
    assert_eq!(refused.as_deref(), Some("operation `packet_loss` `loss` permits [0, 1], not [1.5, 1.5]"));
}

/// The release rule, written as it is said: a message goes at its own time or its predecessor's, whichever is later.
fn naive_releases(sent: &[f64], delays: &[f64]) -> Vec<SimTime> {
    let mut last = SimTime::ZERO;
    sent.iter()
        .zip(delays)
        .map(|(&time, &delay)| {
            last = last.max(SimTime::from_seconds(time) + SimTime::from_seconds(delay));
            last
        })
        .collect()
}

proptest! {
    #[test]
    fn uniform_latency_keeps_order_and_follows_the_release_rule(seed: u64, low in 0.0..1.0f64, width in 0.0..3.0f64) {
        let lag = vec![operation(0, latency(Distribution::Uniform, Drain::Finish))];
        let (delivered, _) = relayed(lag, &[use_of(0, 0.0, 10.0, range(low, low + width), seed)], &commands(40));
        let delays: Vec<f64> =
            (0..40).map(|n| low + super::KeyedRng::new(seed, 0, n).unit(0) * ((low + width) - low)).collect();
        let sent: Vec<f64> = (0..40).map(|n| f64::from(n) * 0.1).collect();
        let tick = 100_000_000;
        let expected: Vec<(f64, f64)> = naive_releases(&sent, &delays)
            .into_iter()
            .zip(0..)
            .map(|(release, n)| (SimTime::from_nanos((release.nanos() + tick - 1) / tick * tick).seconds(), f64::from(n)))
            .collect();
        prop_assert_eq!(numbers(&delivered), expected);
    }

    #[test]
    fn repeating_a_test_repeats_its_disturbance(seed: u64) {
        let jitter = || vec![operation(0, offset(ValueMode::Offset, false))];
        let run = |seed| relayed(jitter(), &[use_of(0, 1.0, 9.0, range(-1.0, 1.0), seed)], &commands(90)).0;
        prop_assert_eq!(run(seed), run(seed));
        prop_assert_ne!(run(seed), run(seed.wrapping_add(1)));
    }
}

#[test]
fn an_outbound_metric_hears_what_operations_made_of_a_message_and_an_inbound_one_what_was_sent() {
    let count = |side| MetricSource::Formula {
        formula: Formula {
            inputs: vec![Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)],
            aggregate: Aggregate::Count { of: Condition::Constant(true) },
            when: None,
            every: None,
            per: None,
            side,
        },
    };
    let mut plan =
        plan(vec![operation(0, OperationKind::Blackhole), operation(0, latency(Distribution::Fixed, Drain::Finish))]);
    plan.metrics[0].source = count(Side::Inbound);
    plan.metrics[1].source = count(Side::Outbound);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    // From 1 s to 2 s all is lost; what is sent from 3 s on is delayed by 5 s, and the run ends at 8 s.
    let test = test_of(vec![use_of(0, 1.0, 2.0, vec![], 1), use_of(1, 3.0, 10.0, one(5.0), 1)]);
    let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap().received_everywhere();
    let command = wires.find(COMMAND).unwrap();
    for tenth in 0..80 {
        relay.message(SimTime::from_nanos(tenth * 100_000_000), command, Value::Real(0.0), &mut Vec::new());
    }
    let finished = relay.finish(SimTime::from_seconds(8.5));
    assert_eq!(finished.metrics[0].value, Some(80.0));
    // Ten before the loss, ten after it; nothing delayed has been delivered by the last event at 7.9 s.
    assert_eq!(finished.metrics[1].value, Some(20.0));
}

/// A metric above a number, and one below it.
fn above(metric: u32, number: f64) -> switch::Condition {
    compared(metric, switch::Comparison::Above, number)
}

fn below(metric: u32, number: f64) -> switch::Condition {
    compared(metric, switch::Comparison::Below, number)
}

fn compared(metric: u32, by: switch::Comparison, number: f64) -> switch::Condition {
    let (left, right) = (switch::Operand::Variable(MetricId(metric)), switch::Operand::Number(number));
    switch::Condition::Compare { left, by, right }
}

fn by_condition(operation: u32, activation: Activation, parameters: Vec<Choice>) -> TestOperation {
    TestOperation { activation, ..use_of(operation, 0.0, 0.0, parameters, 1) }
}

fn intervals(finished: &Finished, operation: usize) -> Vec<(f64, f64)> {
    finished.operations[operation].intervals.iter().map(|span| (span.start, span.end)).collect()
}

#[test]
fn the_message_that_makes_a_condition_hold_is_disturbed_and_the_one_that_ends_it_is_not() {
    let hole = vec![operation(0, OperationKind::Blackhole)];
    let until = Activation::Condition { start: above(1, 9.5), end: above(1, 19.5), times: 1 };
    let (delivered, finished) = relayed(hole, &[by_condition(0, until, vec![])], &commands(50));
    let kept: Vec<f64> = numbers(&delivered).into_iter().map(|(_, n)| n).collect();
    assert_eq!(kept, (0..50).filter(|n| !(10..20).contains(n)).map(f64::from).collect::<Vec<_>>());
    assert_eq!(intervals(&finished, 0), [(1.0, 2.0)]);
    assert_eq!(finished.metrics[0].value, Some(1.0), "fuzzing time");
}

/// Adds a hundred, and makes up a message besides.
struct Raise;

impl OperationHook for Raise {
    fn on_message(&mut self, message: &mut Value, call: &mut MessageCall<'_>) {
        call.typed(message, |number: &mut f64, ctx: &mut OperationContext<'_, f64>| {
            *number += 100.0;
            ctx.inject(-1.0);
        });
    }
}

fn custom(moment: Moment) -> Operation {
    operation(0, OperationKind::Custom { moment })
}

/// The code of `custom` at each moment.
fn raising() -> [OperationEntry; 3] {
    ["custom", "custom_before_start", "custom_after_end"]
        .map(|operation| OperationEntry { operation, build: |_, _| Box::new(Raise) })
}

#[test]
fn the_code_of_a_custom_operation_is_called_while_conditions_say_so() {
    let until = Activation::Condition { start: above(1, 9.5), end: above(1, 12.5), times: 1 };
    let test = [by_condition(0, until, vec![])];
    let (delivered, finished) = relayed_with(&raising(), vec![custom(Moment::OnMessage)], &test, &commands(20));
    let heard: Vec<f64> = numbers(&delivered).into_iter().map(|(_, n)| n).collect();
    let raised = [110.0, -1.0, 111.0, -1.0, 112.0, -1.0];
    let expected = (0..10).map(f64::from).chain(raised).chain((13..20).map(f64::from));
    assert_eq!(heard, expected.collect::<Vec<f64>>());
    assert_eq!(intervals(&finished, 0), [(1.0, 1.3)]);
    let Counters { seen, changed, injected, .. } = finished.operations[0].counters;
    assert_eq!((seen, changed, injected), (3, 3, 3));
}

#[test]
fn an_offline_operation_is_never_active_and_leaves_messages_alone() {
    let operations = vec![custom(Moment::BeforeStart), custom(Moment::AfterEnd)];
    let test = [0, 1].map(|operation| by_condition(operation, Activation::Offline, vec![]));
    let (delivered, finished) = relayed_with(&raising(), operations, &test, &commands(20));
    assert_eq!(delivered, relayed(vec![], &[], &commands(20)).0);
    assert!(intervals(&finished, 0).is_empty() && intervals(&finished, 1).is_empty());
    assert_eq!(finished.metrics[0].value, Some(0.0), "no time is spent fuzzing");
}

#[test]
fn only_an_offline_operation_is_offline_in_a_test() {
    let refused = |moment: Moment, activation: Activation| {
        let plan = plan(vec![custom(moment)]);
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let test = test_of(vec![by_condition(0, activation, vec![])]);
        Relay::new(&plan, &wires, &test, metrics.start(), &raising()).err().expect("it does not fit").to_string()
    };
    let window = refused(Moment::AfterEnd, Activation::Time { start: 1.0, end: 2.0 });
    assert!(window.contains("has no activation: it acts before or after the run"), "{window}");
    let offline = refused(Moment::OnMessage, Activation::Offline);
    assert!(offline.contains("lacks an activation: it acts during the run"), "{offline}");
}

#[test]
fn a_condition_that_never_holds_leaves_everything_as_it_is() {
    let hole = vec![operation(0, OperationKind::Blackhole)];
    let never = Activation::Condition { start: above(1, 100.0), end: above(1, 0.0), times: 3 };
    let (delivered, finished) = relayed(hole, &[by_condition(0, never, vec![])], &commands(50));
    assert_eq!(delivered.len(), 50);
    assert!(intervals(&finished, 0).is_empty() && !finished.operations[0].counters.any_effect());
}

#[test]
fn a_length_ends_between_two_steps_and_its_held_messages_go_then() {
    let lag = vec![operation(0, latency(Distribution::Fixed, Drain::Flush))];
    let burst = Activation::ConditionFor { start: above(1, 9.5), length: 0.25, times: 1 };
    let (delivered, finished) = relayed(lag, &[by_condition(0, burst, one(5.0))], &commands(20));
    assert_eq!(intervals(&finished, 0), [(1.0, 1.25)]);
    // The three of 1.0, 1.1 and 1.2 s are let go at 1.25 s, which the next step carries out.
    let late: Vec<(f64, f64)> = numbers(&delivered).into_iter().filter(|(t, n)| *t != n / 10.0).collect();
    assert_eq!(late, [(1.3, 10.0), (1.3, 11.0), (1.3, 12.0)]);
}

#[test]
fn an_activation_begins_with_its_window_if_its_condition_holds_by_then() {
    let mut hole = operation(0, OperationKind::Blackhole);
    hole.within.start = 1.05;
    let until = Activation::Condition { start: above(1, 3.5), end: above(1, 100.0), times: 1 };
    let (_, finished) = relayed(vec![hole.clone()], &[by_condition(0, until, vec![])], &commands(50));
    assert_eq!(intervals(&finished, 0), [(1.05, 10.0)]);
    hole.within.end = 3.0;
    let again = Activation::ConditionFor { start: above(1, 3.5), length: 0.4, times: 100 };
    let (_, finished) = relayed(vec![hole], &[by_condition(0, again, vec![])], &commands(50));
    assert_eq!(intervals(&finished, 0), [(1.05, 1.45)], "it goes on holding, so it begins nothing again");
}

#[test]
fn conditions_over_active_time_see_it_grow() {
    let hole = vec![operation(0, OperationKind::Blackhole), operation(1, OperationKind::Blackhole)];
    let until = Activation::Condition { start: above(1, 9.5), end: above(0, 0.95), times: 1 };
    let (_, finished) = relayed(hole, &[by_condition(0, until, vec![])], &commands(50));
    assert_eq!(
        intervals(&finished, 0),
        [(1.0, 1.950_000_001)],
        "to the nanosecond, for every step size of the simulator"
    );
}

#[test]
fn a_variable_has_its_initial_value_before_its_first_and_without_one_its_comparison_is_false() {
    let activations = |initial: Option<f64>| {
        let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
        plan.metrics[1].initial = initial;
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let until = Activation::Condition { start: below(1, 1.0), end: above(1, 1.0), times: 1 };
        let mut relay = Relay::new(&plan, &wires, &test_of(vec![by_condition(0, until, vec![])]), metrics.start(), &[])
            .unwrap()
            .received_everywhere();
        relay.advance(SimTime::from_seconds(1.0), &mut Vec::new());
        relay.message(SimTime::from_seconds(2.0), wires.find(COMMAND).unwrap(), Value::Real(0.0), &mut Vec::new());
        relay.message(SimTime::from_seconds(3.0), wires.find(COMMAND).unwrap(), Value::Real(2.0), &mut Vec::new());
        intervals(&relay.finish(SimTime::from_seconds(10.0)), 0)
    };
    assert_eq!(activations(None), [(2.0, 3.0)]);
    assert_eq!(activations(Some(0.0)), [(0.0, 3.0)], "it holds as soon as the window begins");
    assert_eq!(activations(Some(5.0)), [(2.0, 3.0)]);
}

#[test]
fn what_an_outbound_metric_shows_counts_once_its_message_is_through() {
    let mut plan = plan(vec![operation(0, OperationKind::Blackhole)]);
    plan.metrics[1].source = MetricSource::Formula {
        formula: Formula {
            inputs: vec![Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)],
            aggregate: Aggregate::Count { of: Condition::Constant(true) },
            when: None,
            every: None,
            per: None,
            side: Side::Outbound,
        },
    };
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let until = Activation::Condition { start: above(1, 2.5), end: above(1, 100.0), times: 1 };
    let mut relay = Relay::new(&plan, &wires, &test_of(vec![by_condition(0, until, vec![])]), metrics.start(), &[])
        .unwrap()
        .received_everywhere();
    for second in 1..=5 {
        let now = SimTime::from_seconds(f64::from(second));
        relay.message(now, wires.find(COMMAND).unwrap(), Value::Real(0.0), &mut Vec::new());
    }
    let finished = relay.finish(SimTime::from_seconds(10.0));
    assert_eq!((intervals(&finished, 0), finished.metrics[1].value), (vec![(3.0, 10.0)], Some(3.0)));
}
