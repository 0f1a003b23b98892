//! Monitors in the relay: when they hear and decide, what becomes of what they publish, and their scores.

mod trace;

use std::cell::RefCell;

use sesame_base::observation::{CHANGES_KEPT, ChangeCause, Reach};
use sesame_base::time::SimTime;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::stl::{Formula as Temporal, Interval, Robustness};
use sesame_plan::testing::{
    demand, evidence_above, field, guarantee, message, metric, minimal, monitor, operation, requirement, score,
    test_of, topic, use_of,
};
use sesame_plan::{
    Activation, Bound, CampaignPlan, Choice, Evidence, Expression, FieldRef, Gate, Input, Members, MessageId, Metric,
    MetricId, MetricSource, Mitigation, MitigationValue, Monitor, MonitorPart, MonitorState, Operation, OperationKind,
    RequirementId, SafeState, Score, Side, Stale, StaleIs, Test, TestOperation, TopicId, Trend, Type,
};

use crate::metric::MetricTable;
use crate::relay::{Exchange as _, Finished, Listener, Relay};
use crate::value::{Record, Value};
use crate::wire::{Wire, WireTable};

const SECOND: i64 = 1_000_000_000;

/// The topics `a` and `b`, which are numbers; `state`, which is whole; `word`, a text; `drive`, a message of `speed`
/// and `gear`; `gap`, the number that a requirement is about.
fn watched(monitors: Vec<Monitor>) -> CampaignPlan {
    let (real, int) = (|| Type::Real { unit: None }, Type::Int { unit: None });
    let last = MetricSource::Last { input: FieldRef { topic: TopicId(5), path: Vec::new() } };
    CampaignPlan {
        messages: vec![message("Drive", vec![field("speed", real()), field("gear", int.clone())])],
        topics: vec![
            topic("a", &["a"], real()),
            topic("b", &["b"], real()),
            topic("state", &["state"], int),
            topic("word", &["word"], Type::Text),
            topic("drive", &["drive"], Type::Message { id: MessageId(0) }),
            topic("gap", &["gap"], real()),
        ],
        metrics: vec![Metric { trend: Some(Trend::Falling), ..metric("gap", last) }],
        requirements: vec![requirement("apart", 0, Bound::AtLeast { value: 1.0 })],
        monitors,
        ..minimal()
    }
}

/// `safe` holds while `a` is above zero; otherwise `drive.speed` is set to zero.
fn cell(evidence: Evidence) -> Monitor {
    let speed = FieldRef { topic: TopicId(4), path: vec!["speed".to_owned()] };
    let stop = Mitigation { field: speed, value: MitigationValue::Real(0.0) };
    let otherwise = SafeState { name: "unsafe".to_owned(), doc: String::new(), mitigation: Some(stop) };
    Monitor { otherwise, ..monitor("cell", 2, vec![evidence], vec![guarantee("safe", 2, Gate::Evidence(0))]) }
}

fn ok() -> Evidence {
    evidence_above("ok", 0, 0.0)
}

fn drive(speed: f64, gear: i64) -> Value {
    let fields = crate::value::Fields::new(["speed", "gear"]);
    Record::new(&fields, vec![speed.into(), gear.into()]).into()
}

/// What listeners are told of messages.
#[derive(Debug, Clone, PartialEq)]
struct Told {
    at: i64,
    delivered: bool,
    wire: Wire,
    index: u64,
    value: Value,
}

struct Log<'a>(&'a RefCell<Vec<Told>>);

impl Listener for Log<'_> {
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.0.borrow_mut().push(Told { at: now.nanos(), delivered: false, wire, index, value: value.clone() });
    }
    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.0.borrow_mut().push(Told { at: now.nanos(), delivered: true, wire, index, value: value.clone() });
    }
}

struct Ran {
    told: Vec<Told>,
    wires: WireTable,
    finished: Finished,
}

impl Ran {
    /// What was delivered on a topic: times in nanoseconds, and values.
    fn delivered(&self, path: &str) -> Vec<(i64, Value)> {
        let of = |told: &&Told| told.delivered && self.wires.path(told.wire) == path;
        self.told.iter().filter(of).map(|told| (told.at, told.value.clone())).collect()
    }

    fn states(&self, path: &str) -> Vec<(i64, f64)> {
        let number = |value: Value| value.number_at::<&str>(&[]).unwrap();
        self.delivered(path).into_iter().map(|(at, value)| (at, number(value))).collect()
    }

    fn value(&self, metric: usize) -> Option<f64> {
        self.finished.metrics[metric].value
    }

    /// The decisions of a monitor: times in nanoseconds, and the position of the guarantee.
    fn decisions(&self, monitor: usize) -> Vec<(i64, Option<u32>)> {
        let state = |state| match state {
            MonitorState::Guarantee(at) => Some(at),
            MonitorState::Otherwise => None,
        };
        let decisions = &self.finished.monitors[monitor].decisions;
        decisions.iter().map(|decision| (SimTime::from_seconds(decision.time).nanos(), state(decision.state))).collect()
    }
}

/// Publishes messages at times in nanoseconds; time advances to each of them and to the end, in steps of a second.
fn run(plan: &CampaignPlan, test: Vec<TestOperation>, messages: &[(i64, &str, Value)], end: i64) -> Ran {
    run_test(plan, &test_of(test), messages, end)
}

fn run_test(plan: &CampaignPlan, test: &Test, messages: &[(i64, &str, Value)], end: i64) -> Ran {
    plan.validate().unwrap();
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let told = RefCell::default();
    let mut log = Log(&told);
    let mut relay = Relay::new(plan, &wires, test, metrics.start(), &[]).unwrap().tapped(&mut log);
    relay.subscribed(wires.find("state").unwrap());
    let mut out = Vec::new();
    relay.begin();
    let mut step = 0;
    for (at, path, value) in messages {
        while step <= *at {
            relay.advance(SimTime::from_nanos(step), &mut out);
            step += SECOND;
        }
        relay.message(SimTime::from_nanos(*at), wires.find(path).unwrap(), value.clone(), &mut out);
    }
    while step <= end {
        relay.advance(SimTime::from_nanos(step), &mut out);
        step += SECOND;
    }
    relay.advance(SimTime::from_nanos(end), &mut out);
    relay.end(SimTime::from_nanos(end));
    let finished = relay.finish(SimTime::from_nanos(end));
    Ran { told: told.into_inner(), wires, finished }
}

fn a(at: i64, value: f64) -> (i64, &'static str, Value) {
    (at, "a", Value::Real(value))
}

#[test]
fn a_monitor_publishes_its_state_at_time_zero_and_at_each_change() {
    let plan = watched(vec![cell(ok())]);
    let ran = run(&plan, vec![], &[a(0, 1.0), a(10, 2.0), a(20, -1.0), a(30, -2.0), a(40, 1.0)], SECOND);
    assert_eq!(ran.states("state"), [(0, 0.0), (0, 2.0), (20, 0.0), (40, 2.0)]);
    assert_eq!(ran.decisions(0), [(0, None), (0, Some(0)), (20, None), (40, Some(0))]);
    let of = |index| ChangeCause::Message { topic: "a".to_owned(), index };
    let changes: Vec<_> =
        ran.finished.monitors[0].evidence.iter().map(|change| (change.holds, change.cause.clone())).collect();
    assert_eq!(changes, [(Some(true), of(0)), (Some(false), of(2)), (Some(true), of(4))]);
    assert_eq!(ran.finished.messages, 5 + 4 + 1, "with the states and one mitigation");
}

#[test]
fn timers_are_exact_between_two_steps_and_come_before_messages_of_the_same_instant() {
    let held = Evidence { held: 0.3, stale: Some(Stale { after: 0.5, is: StaleIs::False, all: false }), ..ok() };
    let plan = watched(vec![cell(held)]);
    let ms = SECOND / 1000;
    let sent = [a(100 * ms, 1.0), a(400 * ms, -1.0), a(1100 * ms, 1.0), a(1200 * ms, 1.0)];
    let ran = run(&plan, vec![], &sent, 3 * SECOND);
    // At 400 ms it has been held for 300 ms, and ends at once.
    let expected = [(0, None), (400 * ms, Some(0)), (400 * ms, None), (1400 * ms, Some(0)), (1700 * ms + 1, None)];
    assert_eq!(ran.decisions(0), expected);
    assert_eq!(ran.states("state")[1..], [(400 * ms, 2.0), (400 * ms, 0.0), (1400 * ms, 2.0), (1700 * ms + 1, 0.0)]);
    let causes: Vec<_> = ran.finished.monitors[0].evidence.iter().map(|change| change.cause.word()).collect();
    assert_eq!(causes, ["message", "held", "message", "held", "stale"]);
}

#[test]
fn evidence_is_unknown_until_each_topic_had_a_message_and_while_a_number_is_not_finite() {
    let both = Evidence { inputs: [ok().inputs, evidence_above("b", 1, 0.0).inputs].concat(), ..ok() };
    let plan = watched(vec![cell(both)]);
    let b = |at, value| (at, "b", Value::Real(value));
    let ran = run(&plan, vec![], &[a(10, 1.0), b(20, 5.0), b(30, f64::NAN), b(40, 5.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (20, Some(0)), (30, None), (40, Some(0))]);
    assert_eq!(ran.finished.monitors[0].evidence[1].holds, None);
}

/// `a` and `b` are of two robots that keep a distance, and whose messages of one instant come one after the other.
#[test]
fn evidence_over_several_topics_sees_no_state_that_never_was() {
    let apart = Evidence { inputs: [ok().inputs, evidence_above("b", 1, 0.0).inputs].concat(), ..ok() };
    let distance = Expression::Sum(vec![Expression::Input(1), Expression::Negate(Box::new(Expression::Input(0)))]);
    let condition = sesame_plan::Condition::Compare {
        left: distance,
        by: sesame_plan::Comparison::Above,
        right: Expression::Constant(0.5),
    };
    let plan = watched(vec![cell(Evidence { condition, ..apart })]);
    let b = |at, value| (at, "b", Value::Real(value));
    let moved = |at: i64, to: f64| [a(at, to), b(at, to + 1.0)];
    let ran = run(&plan, vec![], &[moved(10, 0.0), moved(20, 5.0), moved(30, 9.0)].concat(), SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0))]);
    assert_eq!(ran.delivered("drive"), [], "nothing is mitigated");
    let close = [moved(10, 0.0).to_vec(), vec![a(20, 0.8), b(20, 1.0)], moved(30, 9.0).to_vec()].concat();
    let ran = run(&plan, vec![], &close, SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0)), (20, None), (30, Some(0))], "in the instant itself");
    assert_eq!(ran.states("state"), [(0, 0.0), (10, 2.0), (20, 0.0), (30, 2.0)]);
    assert_eq!(ran.delivered("drive"), [(20, drive(0.0, 0))]);
    let of = |index| ChangeCause::Message { topic: "b".to_owned(), index };
    let changes: Vec<_> =
        ran.finished.monitors[0].evidence.iter().map(|change| (change.holds, change.cause.clone())).collect();
    assert_eq!(changes, [(Some(true), of(0)), (Some(false), of(1)), (Some(true), of(2))]);
}

#[test]
fn evidence_is_stale_when_one_of_its_topics_is_silent_or_with_all_when_each_is() {
    let both = |all| Evidence {
        inputs: [ok().inputs, evidence_above("b", 1, 0.0).inputs].concat(),
        stale: Some(Stale { after: 2.0, is: StaleIs::False, all }),
        ..ok()
    };
    let b = |second: i64| (second * SECOND, "b", Value::Real(1.0));
    let messages: Vec<_> = [b(1)].into_iter().chain((1..7).map(|second| a(second * SECOND, 1.0))).collect();
    let of = |all| run(&watched(vec![cell(both(all))]), vec![], &messages, 10 * SECOND).decisions(0);
    assert_eq!(of(false), [(0, None), (SECOND, Some(0)), (3 * SECOND + 1, None)]);
    assert_eq!(of(true), [(0, None), (SECOND, Some(0)), (8 * SECOND + 1, None)]);
}

#[test]
fn evidence_over_a_group_is_unknown_until_each_member_has_spoken() {
    let mut plan = watched(vec![cell(ok())]);
    plan.topics[0].paths.push("second".to_owned());
    let second = |at, value| (at, "second", Value::Real(value));
    let ran = run(&plan, vec![], &[a(10, 1.0), a(20, 1.0), second(30, 1.0), second(40, -1.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (30, Some(0)), (40, None)]);
}

#[test]
fn a_mitigation_is_sent_with_the_other_fields_of_the_last_message_or_zeros() {
    let plan = watched(vec![cell(ok())]);
    let ran = run(&plan, vec![], &[a(10, 1.0), a(20, -1.0)], SECOND);
    assert_eq!(ran.delivered("drive"), [(20, drive(0.0, 0))]);
    let ran = run(&plan, vec![], &[a(10, 1.0), (15, "drive", drive(3.0, 4)), a(20, -1.0)], SECOND);
    assert_eq!(ran.delivered("drive"), [(15, drive(3.0, 4)), (20, drive(0.0, 4))]);
}

#[test]
fn a_state_may_be_the_only_field_of_a_message() {
    let mut plan = watched(vec![cell(ok())]);
    plan.messages.push(message("Flag", vec![field("data", Type::Bool)]));
    plan.topics[2].ty = Type::Message { id: MessageId(1) };
    let ran = run(&plan, vec![], &[a(10, 1.0)], SECOND);
    let flag = |is: bool| Value::from(Record::new(&crate::value::Fields::new(["data"]), vec![Value::Bool(is)]));
    assert_eq!(ran.delivered("state"), [(0, flag(false)), (10, flag(true))]);
}

#[test]
fn a_monitor_hears_what_is_delivered_and_inbound_evidence_what_was_published() {
    let lose = operation(0, OperationKind::Blackhole);
    let test = || vec![use_of(0, 0.0, 10.0, vec![], 1)];
    let heard = Evidence { name: "heard".to_owned(), ..ok() };
    let true_one = Evidence { side: Side::Inbound, ..ok() };
    let plan = CampaignPlan { operations: vec![lose.clone()], ..watched(vec![cell(heard)]) };
    let ran = run(&plan, test(), &[a(10, 1.0), a(20, -1.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None)]);
    assert!(ran.finished.operations[0].counters.any_effect(), "the monitor hears its evidence");
    let plan = CampaignPlan { operations: vec![lose], ..watched(vec![cell(true_one)]) };
    let ran = run(&plan, test(), &[a(10, 1.0), a(20, -1.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0)), (20, None)]);
    assert!(!ran.finished.operations[0].counters.any_effect(), "what a monitor knows anyway is not an effect");
    assert_eq!(ran.finished.unheard, ["a"]);
}

/// Published and delivered are one event of a monitor that hears both.
#[test]
fn a_message_that_is_delivered_at_once_is_one_event() {
    let above = Evidence { name: "above".to_owned(), side: Side::Inbound, ..ok() };
    let below =
        Evidence { name: "below".to_owned(), condition: sesame_plan::Condition::Not(Box::new(ok().condition)), ..ok() };
    let either = guarantee("either", 1, Gate::Any(vec![Gate::Evidence(0), Gate::Evidence(1)]));
    let plan = watched(vec![monitor("cell", 2, vec![above, below], vec![either])]);
    let ran = run(&plan, vec![], &[a(10, 1.0), a(20, -1.0), a(30, 1.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0))], "one of them always holds");
}

#[test]
fn what_a_monitor_publishes_is_attacked_and_its_state_is_not() {
    let stuck = Operation { name: "lie".to_owned(), ..operation(2, OperationKind::StuckAt { truth: None }) };
    let plan = CampaignPlan { operations: vec![stuck], ..watched(vec![cell(ok())]) };
    let lie = use_of(0, 0.0, 10.0, vec![Choice::Value { value: 7.0 }], 1);
    let ran = run(&plan, vec![lie], &[a(10, 1.0), a(20, -1.0)], SECOND);
    assert_eq!(ran.states("state"), [(0, 7.0), (10, 7.0), (20, 7.0)]);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0)), (20, None)]);
    assert_eq!(ran.finished.operations[0].counters.changed, 3);
}

#[test]
fn conditions_see_a_new_state_from_the_next_event_on() {
    let lose = operation(2, OperationKind::Blackhole);
    let holds = score("holds", 0, Score::Holds { part: MonitorPart::Evidence(0) });
    let mut plan = CampaignPlan { operations: vec![lose], ..watched(vec![cell(ok())]) };
    plan.metrics.push(holds);
    let is = |number| Condition::Compare {
        left: Operand::Variable(MetricId(1)),
        by: Comparison::Equal,
        right: Operand::Number(number),
    };
    let activation = Activation::Condition { start: is(0.0), end: is(1.0), times: 9 };
    let when_blind = TestOperation { activation, ..use_of(0, 0.0, 1.0, vec![], 1) };
    let ran = run(&plan, vec![when_blind], &[a(10, 1.0), a(20, -1.0), a(20, 1.0), a(30, 2.0)], SECOND);
    // The message that tells of the loss passes; that of the recovery does not, although it is of the same instant.
    assert_eq!(ran.states("state"), [(0, 0.0), (10, 2.0), (20, 0.0)]);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0)), (20, None), (20, Some(0))]);
    assert_eq!(ran.finished.operations[0].counters.dropped, 1);
}

#[test]
fn composed_monitors_decide_in_one_event_in_the_order_of_their_demands() {
    let mut first = monitor("first", 3, vec![ok()], vec![guarantee("still", 1, Gate::Evidence(0))]);
    first.otherwise.name = "moves".to_owned();
    let both = Gate::All(vec![Gate::Evidence(0), Gate::Demand(0)]);
    let second = Monitor { demands: vec![demand("still", 1, 0)], ..cell(ok()) };
    let second = Monitor { guarantees: vec![guarantee("safe", 2, both)], ..second };
    let plan = watched(vec![second, first]);
    let ran = run(&plan, vec![], &[a(10, 1.0), a(20, -1.0)], SECOND);
    assert_eq!(ran.decisions(0), [(0, None), (10, Some(0)), (20, None)]);
    let published = ran.told.iter().filter(|told| !told.delivered && ran.wires.path(told.wire) != "a");
    let published: Vec<_> = published.map(|told| (told.at, ran.wires.path(told.wire))).collect();
    let expected = [(0, "word"), (0, "state"), (10, "word"), (10, "state"), (20, "word"), (20, "state"), (20, "drive")];
    assert_eq!(published, expected);
}

#[test]
fn monitors_that_cause_each_others_messages_without_end_are_stopped() {
    let set = |value| Mitigation {
        field: FieldRef { topic: TopicId(0), path: Vec::new() },
        value: MitigationValue::Real(value),
    };
    let safe = |value| SafeState { name: "unsafe".to_owned(), doc: String::new(), mitigation: Some(set(value)) };
    let on = Monitor { otherwise: safe(1.0), ..cell(ok()) };
    let off = Evidence { condition: sesame_plan::Condition::Not(Box::new(ok().condition)), ..ok() };
    let off = Monitor { otherwise: safe(0.0), name: "off".to_owned(), publishes: Some(TopicId(3)), ..cell(off) };
    let ran = run(&watched(vec![on, off]), vec![], &[a(10, 1.0), a(20, 0.0), a(30, 1.0)], SECOND);
    assert!(ran.finished.messages > 1_000 && ran.finished.messages < 5_000, "{}", ran.finished.messages);
    let warning = "monitors cause each other's messages without end: more than 1000 in one event are not sent";
    assert_eq!(ran.finished.warnings, [warning]);
}

/// The scores of a monitor in addition to the gap, in this order.
fn scored(evidence: Evidence, scores: &[Score]) -> CampaignPlan {
    let mut plan = watched(vec![cell(evidence)]);
    plan.metrics.extend(scores.iter().map(|&scored| score(scored.name(), 0, scored)));
    plan
}

#[test]
fn scores_are_metrics_during_the_run_and_at_its_end() {
    let requirement = RequirementId(0);
    let scores = [
        Score::MissedHazards { requirement },
        Score::ForeseenHazards { requirement },
        Score::LeadTime { requirement },
        Score::FalseAlarms { requirement, within: None },
        Score::TimeIn { state: MonitorState::Otherwise },
        Score::Changes,
        Score::ShortestStay,
        Score::Mitigations,
        Score::Integrity,
        Score::Holds { part: MonitorPart::Otherwise },
    ];
    let gap = |at, value| (at, "gap", Value::Real(value));
    let plan = scored(ok(), &scores);
    let values = |messages: &[(i64, &str, Value)]| {
        let ran = run(&plan, vec![], messages, 8 * SECOND);
        (1..=scores.len()).map(|at| ran.value(at)).collect::<Vec<_>>()
    };
    let at = |second: f64, value| a(SimTime::from_seconds(second).nanos(), value);
    let foreseen = values(&[gap(0, 5.0), at(1.0, 1.0), at(2.5, -1.0), gap(4 * SECOND, 0.5), at(6.0, 1.0)]);
    let some = |values: [f64; 10]| values.map(Some).to_vec();
    assert_eq!(foreseen, some([0.0, 1.0, 1.5, 0.0, 1.0 + 3.5, 3.0, 1.5, 1.0, 2.0, 0.0]));
    let mut missed = values(&[gap(0, 5.0), at(1.0, 1.0), gap(4 * SECOND, 0.5), at(4.5, -1.0), at(7.0, 1.0)]);
    assert_eq!(missed.remove(2), None, "no hazard was foreseen");
    let expected: Vec<Option<f64>> = [1.0, 0.0, 1.0, 1.0 + 2.5, 3.0, 2.5, 1.0, 2.0, 0.0].map(Some).to_vec();
    assert_eq!(missed, expected);
    let ran = run(&plan, vec![], &[gap(0, 5.0), at(1.0, 1.0), gap(4 * SECOND, 0.5)], 8 * SECOND);
    assert_eq!(ran.finished.metrics[1].series, [(0.0, 0.0), (4.0, 1.0)], "from the hazard on");
    assert_eq!(ran.finished.metrics[9].series, [(0.0, 0.0), (1.0, 2.0)]);
}

/// The hazards that are recorded: monitor, requirement, time, lead.
fn hazards(ran: &Ran) -> Vec<(usize, u32, f64, Option<f64>)> {
    let monitors = ran.finished.monitors.iter().enumerate();
    monitors
        .flat_map(|(at, monitor)| {
            monitor.hazards.iter().map(move |hazard| (at, hazard.requirement.0, hazard.time, hazard.lead))
        })
        .collect()
}

#[test]
fn hazards_are_recorded_whether_or_not_a_metric_scores_them() {
    let gap = |at, value| (at, "gap", Value::Real(value));
    let second = |second: i64| second * SECOND;
    let foreseen = [gap(0, 5.0), a(second(1), 1.0), a(second(2), -1.0), gap(second(4), 0.5), a(second(6), 1.0)];
    let missed = [gap(0, 5.0), a(second(1), 1.0), gap(second(4), 0.5), a(second(5), -1.0), gap(second(6), 0.2)];
    let with = scored(ok(), &[Score::MissedHazards { requirement: RequirementId(0) }]);
    let without = watched(vec![cell(ok())]);
    for plan in [&with, &without] {
        assert_eq!(hazards(&run(plan, vec![], &foreseen, second(8))), [(0, 0, 4.0, Some(2.0))]);
        assert_eq!(hazards(&run(plan, vec![], &missed, second(8))), [(0, 0, 4.0, None)]);
        assert_eq!(hazards(&run(plan, vec![], &missed[..2], second(8))), []);
    }
    // A metric that grows with time crosses its bound between two changes of its series.
    let mut growing = scored(ok(), &[Score::TimeIn { state: MonitorState::Guarantee(0) }]);
    growing.requirements.push(requirement("R2", 1, Bound::AtMost { value: 2.0 }));
    growing.metrics.push(score("missed", 0, Score::MissedHazards { requirement: RequirementId(1) }));
    let ran = run(&growing, vec![], &missed, second(8));
    assert_eq!((hazards(&ran), ran.value(2)), (vec![(0, 1, 3.000_000_001, None)], Some(1.0)));
}

#[test]
fn where_a_metric_may_recover_only_the_end_decides_whether_there_was_a_hazard() {
    let mut plan = scored(ok(), &[Score::MissedHazards { requirement: RequirementId(0) }]);
    plan.metrics[0].trend = None;
    let gap = |at, value| (at, "gap", Value::Real(value));
    let of = |messages: &[(i64, &str, Value)]| {
        let ran = run(&plan, vec![], messages, 8 * SECOND);
        (hazards(&ran), ran.value(1))
    };
    assert_eq!(of(&[a(1, 1.0), gap(5, 0.0), gap(6, 2.0)]), (vec![], Some(0.0)), "it is satisfied");
    assert_eq!(of(&[a(1, 1.0), gap(5, 2.0), gap(6, 0.0)]), (vec![(0, 0, 8.0, None)], Some(1.0)));
}

#[test]
fn of_a_requirement_that_is_inconclusive_hazards_have_no_score() {
    let plan = scored(ok(), &[Score::MissedHazards { requirement: RequirementId(0) }]);
    let gap = |at, value| (at, "gap", Value::Real(value));
    let blind = run(&plan, vec![], &[a(1, 1.0), gap(5, 2.0), gap(6, f64::NAN)], 8 * SECOND);
    let observed = &blind.finished.metrics[1];
    assert_eq!((observed.value, observed.set, observed.reach), (None, false, Reach::ANY));
    let too_late = run(&plan, vec![], &[a(1, 1.0), gap(5, 0.5), gap(6, f64::NAN)], 8 * SECOND);
    assert_eq!(too_late.value(1), Some(1.0), "what was known before is known");
}

#[test]
fn a_violation_between_two_messages_of_an_instant_is_no_hazard() {
    let plan = scored(ok(), &[Score::MissedHazards { requirement: RequirementId(0) }]);
    let gap = |at, value| (at, "gap", Value::Real(value));
    let brief = run(&plan, vec![], &[a(1, 1.0), gap(5, 0.0), gap(5, 2.0)], SECOND);
    assert_eq!(brief.value(1), Some(0.0));
    // The monitor goes to its safe state in the instant of the hazard.
    let just = run(&plan, vec![], &[a(1, 1.0), gap(5, 0.0), a(5, -1.0)], SECOND);
    assert_eq!(just.value(1), Some(0.0));
    let late = run(&plan, vec![], &[a(1, 1.0), gap(5, 0.0), a(6, -1.0)], SECOND);
    assert_eq!(late.value(1), Some(1.0));
}

#[test]
fn the_hazard_of_a_temporal_formula_is_when_its_signal_lost_the_bound() {
    let requirement = RequirementId(0);
    let mut plan = scored(ok(), &[Score::MissedHazards { requirement }, Score::LeadTime { requirement }]);
    let gap = FieldRef { topic: TopicId(5), path: Vec::new() };
    let formula = Temporal::Always {
        interval: Interval { from: 0.0, to: None },
        of: Box::new(Temporal::Predicate { signal: 0, comparison: sesame_plan::Comparison::AtLeast, constant: 0.0 }),
    };
    plan.metrics[0].source = MetricSource::Robustness {
        robustness: Robustness {
            inputs: vec![Input::new(gap, Members::Min)],
            signals: vec![Expression::Input(0)],
            formula,
            side: Side::Inbound,
            whole_windows: false,
        },
    };
    let gap = |second: i64, value| (second * SECOND, "gap", Value::Real(value));
    let foreseen = [gap(0, 5.0), a(SECOND, 1.0), a(2 * SECOND, -1.0), gap(4, 0.5), a(5 * SECOND, 1.0)];
    let ran = run(&plan, vec![], &foreseen, 8 * SECOND);
    assert_eq!((ran.value(1), ran.value(2)), (Some(0.0), Some(2.0)));
    assert_eq!(hazards(&ran), [(0, 0, 4.0, Some(2.0))]);
    let ran = run(&plan, vec![], &[gap(0, 5.0), a(SECOND, 1.0), gap(4, 0.5), a(5 * SECOND, -1.0)], 8 * SECOND);
    assert_eq!((ran.value(1), ran.value(2)), (Some(1.0), None));
    assert_eq!(hazards(&ran), [(0, 0, 4.0, None)]);
    assert_eq!(ran.finished.metrics[1].series, [(0.0, 0.0), (4.0, 1.0)]);
    let ran = run(&plan, vec![], &[gap(0, 5.0), a(SECOND, 1.0)], 8 * SECOND);
    assert_eq!((ran.value(1), ran.value(2)), (Some(0.0), None));
}

#[test]
fn a_condition_over_the_time_in_a_state_switches_to_the_nanosecond() {
    let mut plan = scored(ok(), &[Score::TimeIn { state: MonitorState::Guarantee(0) }]);
    plan.operations = vec![operation(2, OperationKind::Blackhole)];
    let start = Condition::Compare {
        left: Operand::Variable(MetricId(1)),
        by: Comparison::Above,
        right: Operand::Number(1.25),
    };
    let activation = Activation::ConditionFor { start, length: 1.0, times: 1 };
    let late = TestOperation { activation, ..use_of(0, 0.0, 1.0, vec![], 1) };
    let ran = run(&plan, vec![late], &[a(SECOND / 2, 1.0)], 5 * SECOND);
    let interval = ran.finished.operations[0].intervals[0];
    assert_eq!(SimTime::from_seconds(interval.start).nanos(), SECOND / 2 + SECOND / 4 * 5 + 1);
    assert_eq!(ran.value(1), Some(4.5));
}

#[test]
fn of_very_many_decisions_the_first_are_kept() {
    let plan = scored(ok(), &[Score::Changes]);
    let sent: Vec<_> = (1..=6_000).map(|at| a(at, if at % 2 == 0 { -1.0 } else { 1.0 })).collect();
    let ran = run(&plan, vec![], &sent, SECOND);
    let monitor = &ran.finished.monitors[0];
    assert_eq!(monitor.decisions.len() + monitor.evidence.len(), CHANGES_KEPT);
    assert_eq!(monitor.omitted, 2 * 6_000 + 1 - CHANGES_KEPT as u64);
    assert_eq!(ran.value(1), Some(6_000.0), "scores are of all");
    assert!(ran.finished.warnings[0].contains("the last 2001 times are not kept"), "{:?}", ran.finished.warnings);
}
