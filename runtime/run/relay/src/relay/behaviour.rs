//! What single operations do beyond the table of `matrix`: on groups, in lists, in several activations, together, and
//! in the long run.

use std::sync::Arc;

use proptest::prelude::*;

use sesame_base::time::SimTime;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::testing::{at, latency, operation, plan, test_of, use_of};
use sesame_plan::{
    Activation, Choice, Distribution, Drain, MetricId, Operation, OperationKind, Step, Target, TestOperation, TopicId,
};

use crate::fuzz::{Action, Disturbance, KeyedRng, MessageContext, OnWire};
use crate::metric::MetricTable;
use crate::relay::{COPIES_LIMIT, Exchange as _, Finished, Relay};
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

const COMMAND: &str = "arm/command";

fn choices(values: &[f64]) -> Vec<Choice> {
    values.iter().map(|&value| Choice::Value { value }).collect()
}

fn range(low: f64, high: f64) -> Vec<Choice> {
    vec![Choice::Range { low, high }]
}

/// Publishes a message `(tenths of a second, topic, value)` at its time, up to ten seconds, with a tick each tenth.
fn relayed(
    operations: Vec<Operation>,
    test: Vec<TestOperation>,
    messages: &[(u32, &str, Value)],
) -> (Vec<(u32, String, Value)>, Finished) {
    let plan = plan(operations);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(&plan, &wires, &test_of(test), metrics.start(), &[]).unwrap().received_everywhere();
    let mut delivered = Vec::new();
    for tenth in 0..=100 {
        let now = SimTime::from_nanos(i64::from(tenth) * 100_000_000);
        let mut out = Vec::new();
        relay.advance(now, &mut out);
        for (_, path, value) in messages.iter().filter(|(time, ..)| *time == tenth) {
            relay.message(now, wires.find(path).unwrap(), value.clone(), &mut out);
        }
        delivered.extend(out.into_iter().map(|delivery| (tenth, wires.path(delivery.wire).to_owned(), delivery.value)));
    }
    (delivered, relay.finish(SimTime::from_seconds(10.0)))
}

fn commands(count: u32) -> Vec<(u32, &'static str, Value)> {
    (0..count).map(|n| (n, COMMAND, Value::Real(f64::from(n)))).collect()
}

fn numbers(delivered: &[(u32, String, Value)]) -> Vec<f64> {
    delivered.iter().map(|(_, _, value)| value.number_at::<&str>(&[]).unwrap()).collect()
}

/// The actions and results of an operation on real numbers, message by message, a tenth of a second apart.
fn run(operation: &Operation, choices: Vec<Choice>, seed: u64, messages: u64) -> Vec<(Action, f64)> {
    let mut disturbance = Disturbance::new(operation, &use_of(0, 0.0, 10.0, choices, seed), &[]).unwrap();
    disturbance.begin();
    let one = |n: u64| {
        let now = SimTime::from_nanos(i64::try_from(n).unwrap() * 100_000_000);
        let mut message = Value::Real(0.0);
        let context = MessageContext { now, active: now, on: OnWire::default(), draws: KeyedRng::new(seed, 0, n) };
        let action = disturbance.apply(context, &mut message);
        (action, message.number_at::<&str>(&[]).unwrap())
    };
    (0..messages).map(one).collect()
}

fn moments(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64;
    (mean, variance.sqrt())
}

#[test]
fn burst_loss_drops_its_share_in_bursts_of_its_length() {
    for (enter, leave, loss) in [(0.1, 0.3, 1.0), (0.02, 0.5, 1.0), (0.3, 0.2, 0.6)] {
        let fates = run(&operation(0, OperationKind::BurstLoss), choices(&[enter, leave, loss]), 5, 200_000);
        let lost: Vec<bool> = fates.iter().map(|(action, _)| *action == Action::Dropped).collect();
        let share = lost.iter().filter(|&&lost| lost).count() as f64 / lost.len() as f64;
        let expected = loss * enter / (enter + leave);
        assert!((share - expected).abs() < 0.01, "{share}, not {expected}");
        if loss == 1.0 {
            let bursts = lost.windows(2).filter(|pair| !pair[0] && pair[1]).count() as f64;
            let length = lost.iter().filter(|&&lost| lost).count() as f64 / bursts;
            assert!((length - 1.0 / leave).abs() < 0.1, "{length}, not {}", 1.0 / leave);
        }
    }
}

#[test]
fn burst_loss_at_its_ends_is_no_loss_and_a_blackhole() {
    let lost = |enter, leave| {
        let fates = run(&operation(0, OperationKind::BurstLoss), choices(&[enter, leave, 1.0]), 5, 1_000);
        fates.iter().filter(|(action, _)| *action == Action::Dropped).count()
    };
    assert_eq!((lost(0.0, 0.5), lost(1.0, 0.0), lost(1.0, 1.0)), (0, 1_000, 500));
}

#[test]
fn noise_is_normal_around_zero() {
    let noise: Vec<f64> =
        run(&operation(0, OperationKind::Noise), choices(&[2.0]), 9, 100_000).iter().map(|(_, x)| *x).collect();
    let (mean, deviation) = moments(&noise);
    assert!(mean.abs() < 0.03 && (deviation - 2.0).abs() < 0.03, "{mean} {deviation}");
    // 68.3 % lie within one standard deviation, 95.4 % within two.
    for (deviations, expected) in [(1.0, 0.6827), (2.0, 0.9545)] {
        let within = noise.iter().filter(|x| x.abs() < 2.0 * deviations).count() as f64 / noise.len() as f64;
        assert!((within - expected).abs() < 0.01, "{within}, not {expected}");
    }
}

#[test]
fn a_normal_latency_stays_in_its_range_around_the_middle() {
    let lag = operation(0, latency(Distribution::Normal, Drain::Finish));
    let delays = run(&lag, range(0.1, 0.5), 4, 50_000);
    let delays: Vec<f64> = delays
        .iter()
        .map(|(action, _)| match action {
            Action::Delayed(by) => by.seconds(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(delays.iter().all(|delay| (0.1..=0.5).contains(delay)));
    // A normal distribution cut at two standard deviations keeps 0.8796 of its standard deviation.
    let (mean, deviation) = moments(&delays);
    assert!((mean - 0.3).abs() < 0.002 && (deviation - 0.08796).abs() < 0.001, "{mean} {deviation}");
}

proptest! {
    #[test]
    fn reordering_delivers_every_message_once_and_none_later_than_its_window(
        seed: u64, window in 0.0..3.0f64, flush: bool, end in 1.0..9.0f64,
    ) {
        let drain = if flush { Drain::Flush } else { Drain::Finish };
        let mix = vec![operation(0, OperationKind::Reorder { drain })];
        let (delivered, finished) = relayed(mix, vec![use_of(0, 0.0, end, choices(&[window]), seed)], &commands(60));
        let mut order: Vec<f64> = numbers(&delivered);
        for (tenth, _, value) in &delivered {
            let sent = value.number_at::<&str>(&[]).unwrap();
            prop_assert!((f64::from(*tenth) - sent) / 10.0 < window + 0.1, "{sent} came at {tenth}");
        }
        order.sort_by(f64::total_cmp);
        prop_assert_eq!(order, (0..60).map(f64::from).collect::<Vec<_>>());
        let counters = finished.operations[0].counters;
        prop_assert_eq!((counters.dropped, counters.injected), (0, 0));
    }

    #[test]
    fn draws_for_an_element_do_not_depend_on_how_long_its_list_is(seed: u64, short in 1usize..5, more in 0usize..5) {
        let mut noise = operation(0, OperationKind::Noise);
        noise.places = vec![vec![Step::Each]];
        let drawn = |length: usize| {
            let disturbance = Disturbance::new(&noise, &use_of(0, 0.0, 1.0, choices(&[1.0]), seed), &[]);
            let mut message = Value::List(vec![Value::Real(0.0); length]);
            let draws = KeyedRng::new(seed, 0, 0);
            let at = MessageContext { now: SimTime::ZERO, active: SimTime::ZERO, on: OnWire::default(), draws };
            disturbance.unwrap().apply(at, &mut message);
            let Value::List(items) = message else { panic!("a list stays one") };
            items
        };
        prop_assert_eq!(&drawn(short + more)[..short], &drawn(short)[..]);
    }
}

#[test]
fn reordering_lets_later_messages_overtake() {
    let mix = vec![operation(0, OperationKind::Reorder { drain: Drain::Finish })];
    let (delivered, _) = relayed(mix, vec![use_of(0, 0.0, 9.0, choices(&[1.0]), 3)], &commands(60));
    assert!(numbers(&delivered).windows(2).any(|pair| pair[0] > pair[1]));
}

/// A message of each member of the group, with a level and a count.
fn zones(n: u32) -> [(u32, &'static str, Value); 2] {
    let fields = Fields::new(["level", "count"]);
    let zone = |level: f64| Value::from(Record::new(&fields, vec![level.into(), i64::from(n).into()]));
    [(n, "zones/Z1", zone(f64::from(n))), (n, "zones/Z2", zone(1000.0 - f64::from(n)))]
}

fn levels(delivered: &[(u32, String, Value)], path: &str) -> Vec<f64> {
    let of_path = delivered.iter().filter(|(_, on, _)| on == path);
    of_path.map(|(_, _, value)| value.number_at(&["level"]).unwrap()).collect()
}

#[test]
fn each_member_of_a_group_is_disturbed_as_if_it_were_alone() {
    let of_kind = |kind| at(&["level"], operation(1, kind));
    let messages: Vec<_> = (0..80).flat_map(zones).collect();
    let cases = [
        (of_kind(OperationKind::Freeze), vec![]),
        (of_kind(OperationKind::Stale), choices(&[0.7])),
        (of_kind(OperationKind::Noise), choices(&[1.0])),
        (of_kind(OperationKind::RandomWalk), choices(&[1.0])),
        (operation(1, OperationKind::BurstLoss), choices(&[0.3, 0.3, 1.0])),
        (operation(1, OperationKind::RateLimit), choices(&[3.0])),
    ];
    for (operation, choices) in cases {
        let test = || vec![use_of(0, 2.0, 6.0, choices.clone(), 8)];
        let (both, _) = relayed(vec![operation.clone()], test(), &messages);
        for path in ["zones/Z1", "zones/Z2"] {
            let only: Vec<_> = messages.iter().filter(|(_, on, _)| *on == path).cloned().collect();
            let (alone, _) = relayed(vec![operation.clone()], test(), &only);
            assert_eq!(levels(&both, path), levels(&alone, path), "{:?} on {path}", operation.kind);
        }
    }
    let (frozen, _) = relayed(vec![of_kind(OperationKind::Freeze)], vec![use_of(0, 2.0, 6.0, vec![], 8)], &messages);
    assert_eq!((levels(&frozen, "zones/Z1")[30], levels(&frozen, "zones/Z2")[30]), (19.0, 981.0));
    let count = |value: &Value| value.number_at(&["count"]);
    assert_eq!(count(&frozen[60].2), Some(30.0), "what is beside the frozen field goes on");
}

/// Commands, every other of which is not of its declared type.
fn every_other_is_opaque(count: u32) -> Vec<(u32, &'static str, Value)> {
    let opaque = |n: u32| Value::Opaque(Arc::from(format!("{{\"speed\": {n}").into_bytes()));
    (0..count).map(|n| (n, COMMAND, if n % 2 == 0 { Value::Real(f64::from(n)) } else { opaque(n) })).collect()
}

#[test]
fn a_message_of_any_content_is_lost_late_or_repeated_and_no_value_in_it_is_changed() {
    let counted = |kind: OperationKind, choices: Vec<Choice>| {
        let test = vec![use_of(0, 2.0, 4.0, choices, 3)];
        let (delivered, finished) = relayed(vec![operation(0, kind)], test, &every_other_is_opaque(80));
        let opaque = delivered.iter().filter(|(_, _, value)| matches!(value, Value::Opaque(_))).count();
        (opaque, finished.operations[0].counters)
    };
    let (left, counters) = counted(OperationKind::Blackhole, vec![]);
    assert_eq!((left, counters.dropped), (30, 20));
    let fixed = OperationKind::Latency { distribution: Distribution::Fixed, drain: Drain::Finish };
    let (left, counters) = counted(fixed, vec![Choice::Range { low: 0.3, high: 0.3 }]);
    assert_eq!((left, counters.delayed), (40, 20));
    let (left, counters) = counted(OperationKind::Duplicate, choices(&[2.0]));
    assert_eq!((left, counters.seen), (40 + 2 * 10, 20));
    let (left, counters) = counted(OperationKind::Bias, choices(&[5.0]));
    assert_eq!((left, counters.changed), (40, 10), "only numbers have one");
    let (left, counters) = counted(OperationKind::Freeze, vec![]);
    assert!(left > 40 && counters.changed > 0, "the last one before the window is repeated, whatever it is");
}

#[test]
fn one_operation_acts_on_several_topics_at_once_on_each_as_if_it_were_alone() {
    let with = |kind: OperationKind, whole: bool| {
        let places = if whole { Vec::new() } else { vec![vec![Step::Field("level".to_owned())]] };
        let further = vec![Target { topic: TopicId(1), members: None, places }];
        Operation { further, ..operation(0, kind) }
    };
    let on_zones = |kind: OperationKind, whole: bool| {
        if whole { operation(1, kind) } else { at(&["level"], operation(1, kind)) }
    };
    let messages: Vec<_> =
        commands(80).into_iter().zip((0..80).map(zones)).flat_map(|(one, two)| [one].into_iter().chain(two)).collect();
    let fixed = || OperationKind::Latency { distribution: Distribution::Fixed, drain: Drain::Finish };
    let delay = vec![Choice::Range { low: 0.35, high: 0.35 }];
    let cases = [
        (OperationKind::Bias, choices(&[3.0]), false),
        (OperationKind::Drift, choices(&[3.0]), false),
        (OperationKind::Freeze, vec![], false),
        (OperationKind::Stale, choices(&[0.7]), false),
        (OperationKind::Blackhole, vec![], true),
        (OperationKind::RateLimit, choices(&[3.0]), true),
        (fixed(), delay, true),
    ];
    for (kind, choices, whole) in cases {
        let test = || vec![use_of(0, 2.0, 6.0, choices.clone(), 8)];
        let (all, finished) = relayed(vec![with(kind.clone(), whole)], test(), &messages);
        let mut seen = 0;
        for (path, alone) in [("command", operation(0, kind.clone())), ("zones/Z1", on_zones(kind.clone(), whole))] {
            let (expected, of_one) = relayed(vec![alone], test(), &messages);
            let on = |delivered: &[(u32, String, Value)]| {
                let of_path = delivered.iter().filter(|(_, on, _)| on == path);
                of_path.map(|(at, _, value)| (*at, format!("{value:?}"))).collect::<Vec<_>>()
            };
            assert_eq!(on(&all), on(&expected), "{kind:?} on {path}");
            seen += of_one.operations[0].counters.seen;
        }
        assert_eq!(finished.operations[0].counters.seen, seen, "{kind:?}");
        assert_eq!(finished.operations[0].intervals.len(), 1, "{kind:?}");
    }
}

/// Active from 2 s to 3 s and from 6 s to 7 s, by the command itself.
fn twice(kind: OperationKind, values: &[f64]) -> (Vec<f64>, Finished) {
    let command =
        |by, number| Condition::Compare { left: Operand::Variable(MetricId(1)), by, right: Operand::Number(number) };
    let between =
        |low, high| Condition::And(command(Comparison::Above, low).into(), command(Comparison::Below, high).into());
    let start = Condition::Or(between(19.5, 29.5).into(), between(59.5, 69.5).into());
    let end = Condition::Or(between(29.5, 59.5).into(), command(Comparison::Above, 69.5).into());
    let mut used = use_of(0, 0.0, 10.0, choices(values), 1);
    used.activation = Activation::Condition { start, end, times: 2 };
    let (delivered, finished) = relayed(vec![operation(0, kind)], vec![used], &commands(80));
    assert_eq!(finished.operations[0].intervals.len(), 2);
    (numbers(&delivered), finished)
}

#[test]
fn each_activation_begins_afresh() {
    let (frozen, _) = twice(OperationKind::Freeze, &[]);
    assert_eq!((frozen[25], frozen[35], frozen[65], frozen[75]), (19.0, 35.0, 59.0, 75.0));
    let (drifted, _) = twice(OperationKind::Drift, &[5.0]);
    assert_eq!((drifted[20], drifted[29], drifted[60], drifted[62]), (20.0, 33.5, 60.0, 63.0));
    let (walked, _) = twice(OperationKind::RandomWalk, &[5.0]);
    assert_eq!((walked[20], walked[60]), (20.0, 60.0), "a walk starts at 0");
    assert!((21..29).chain(61..69).all(|n| walked[n] != n as f64), "{walked:?}");
    let (limited, _) = twice(OperationKind::RateLimit, &[1.0]);
    assert!(limited.contains(&20.0) && limited.contains(&60.0), "the first message of an activation passes");
    assert_eq!(limited.len(), 80 - 18);
}

#[test]
fn where_nothing_passed_before_the_first_message_is_what_freezes_or_grows_old() {
    let first = |kind, values: &[f64]| {
        let (delivered, finished) =
            relayed(vec![operation(0, kind)], vec![use_of(0, 0.0, 5.0, choices(values), 1)], &commands(20));
        (numbers(&delivered)[..8].to_vec(), finished.operations[0].counters.changed)
    };
    assert_eq!(first(OperationKind::Freeze, &[]), (vec![0.0; 8], 19));
    assert_eq!(first(OperationKind::Stale, &[0.5]), (vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0], 19));
    assert_eq!(first(OperationKind::Stale, &[0.0]), ((0..8).map(f64::from).collect(), 0), "no age changes nothing");
}

#[test]
fn a_rate_limit_passes_what_comes_at_its_rate_and_no_faster() {
    let passed = |rate| {
        let limit = vec![operation(0, OperationKind::RateLimit)];
        let (delivered, _) = relayed(limit, vec![use_of(0, 0.0, 10.0, choices(&[rate]), 1)], &commands(50));
        numbers(&delivered)
    };
    assert_eq!(passed(10.0).len(), 50);
    assert_eq!(passed(5.0), (0..50).step_by(2).map(f64::from).collect::<Vec<_>>());
    assert_eq!(passed(4.0), (0..50).step_by(3).map(f64::from).collect::<Vec<_>>(), "never sooner than 0.25 s");
}

#[test]
fn operations_see_what_those_of_higher_priority_made() {
    let result = |bias_first: bool| {
        let mut operations = [operation(0, OperationKind::Bias), operation(0, OperationKind::Scale)];
        operations[usize::from(!bias_first)].priority = 1;
        let test = vec![use_of(0, 0.0, 9.0, choices(&[3.0]), 1), use_of(1, 0.0, 9.0, choices(&[2.0]), 1)];
        let (delivered, _) = relayed(operations.to_vec(), test, &commands(5));
        numbers(&delivered)[4]
    };
    assert_eq!((result(true), result(false)), (14.0, 11.0));
}

#[test]
fn copies_are_disturbed_apart_by_later_operations_and_follow_their_message() {
    let operations = vec![operation(0, OperationKind::Duplicate), operation(0, OperationKind::Noise)];
    let test = vec![use_of(0, 0.0, 5.0, choices(&[2.0]), 1), use_of(1, 0.0, 5.0, choices(&[0.01]), 2)];
    let (delivered, finished) = relayed(operations, test, &commands(10));
    let values = numbers(&delivered);
    assert_eq!(values.len(), 30);
    for (n, copies) in values.chunks(3).enumerate() {
        assert!(copies.iter().all(|x| (x - n as f64).abs() < 0.1), "{copies:?}");
        assert!(copies[0] != copies[1] && copies[1] != copies[2], "{copies:?}");
    }
    let [duplicated, noisy] = [0, 1].map(|at| finished.operations[at].counters);
    assert_eq!((duplicated.seen, duplicated.injected, noisy.seen, noisy.changed), (10, 20, 30, 30));
}

#[test]
fn copies_of_copies_are_bounded_and_the_run_is_warned() {
    let test = (0..4).map(|_| use_of(0, 0.0, 5.0, choices(&[100.0]), 1)).collect();
    let (delivered, finished) = relayed(vec![operation(0, OperationKind::Duplicate)], test, &commands(1));
    assert_eq!(delivered.len(), 1 + COPIES_LIMIT as usize);
    assert_eq!(finished.warnings, ["copies of copies: more than 10000 in one event are not made"]);
}

#[test]
fn a_disturbance_that_lacks_a_parameter_is_refused() {
    let mut stripped = operation(0, OperationKind::BurstLoss);
    stripped.parameters.remove(0);
    let refused = Disturbance::new(&stripped, &use_of(0, 0.0, 1.0, choices(&[0.5, 0.5]), 1), &[]).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "operation `burst_loss` has no parameter `enter` of the expected kind: run `sesamec generate` again"
    );
}
