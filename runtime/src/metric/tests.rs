//! Declarative metrics on small message streams, and naive oracles that look at the whole stream at once.

use proptest::prelude::*;
use sesame_plan::{
    Aggregate, CampaignPlan, Comparison, Condition, Expression, FieldRef, Formula, Input, Members, Metric,
    MetricSource, Side, TopicId,
};

use super::MetricTable;
use crate::fixture::plan;
use crate::observation::MetricObservation;
use crate::time::SimTime;
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

/// A message: milliseconds, path, number. On a zone the number is its level, and its count is the level's sign.
type Sent = (i64, usize, f64);

const PATHS: [&str; 3] = ["arm/command", "zones/Z1", "zones/Z2"];

fn zone(level: f64, count: i64) -> Value {
    let fields = Fields::new(["level", "count"]);
    Record::new(&fields, vec![Value::Real(level), Value::Int(count)]).into()
}

fn payload(path: usize, number: f64) -> Value {
    if path == 0 { Value::Real(number) } else { zone(number, if number < 0.0 { -1 } else { 1 }) }
}

fn command() -> Input {
    Input { field: FieldRef { topic: TopicId(0), path: Vec::new() }, members: Members::Min }
}

fn level(members: Members) -> Input {
    Input { field: FieldRef { topic: TopicId(1), path: vec!["level".into()] }, members }
}

fn formula(inputs: Vec<Input>, aggregate: Aggregate) -> Formula {
    Formula { inputs, aggregate, when: None, every: None, per: None, side: Side::Inbound }
}

fn below(limit: f64) -> Condition {
    Condition::Compare { left: Expression::Input(0), by: Comparison::Below, right: Expression::Constant(limit) }
}

fn plan_with(formula: Formula) -> CampaignPlan {
    let mut plan = plan(Vec::new());
    plan.metrics = vec![Metric { source: MetricSource::Formula { formula }, ..plan.metrics[0].clone() }];
    plan
}

/// What a formula makes of a stream that ends with its last message, or at `end` milliseconds.
fn measured(formula: Formula, stream: &[Sent], end: Option<i64>) -> (MetricObservation, Vec<String>) {
    let plan = plan_with(formula);
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    for &(time, path, number) in stream {
        let wire = wires.find(PATHS[path]).unwrap();
        metrics.message(SimTime::from_nanos(time * 1_000_000), wire, &payload(path, number));
    }
    if let Some(end) = end {
        metrics.end(SimTime::from_nanos(end * 1_000_000));
    }
    let (mut observations, warnings) = metrics.finish(&[]);
    (observations.remove(0), warnings)
}

fn value(formula: Formula, stream: &[Sent]) -> Option<f64> {
    measured(formula, stream, None).0.value
}

#[test]
fn when_then_sets_the_value_only_while_the_condition_holds() {
    let rise = Expression::Sum(vec![Expression::Constant(10.0), Expression::Negate(Box::new(Expression::Input(0)))]);
    let when_then =
        || Formula { when: Some(below(3.0)), ..formula(vec![command()], Aggregate::Last { of: rise.clone() }) };
    assert_eq!(value(when_then(), &[(0, 0, 5.0), (1, 0, 4.0)]), None);
    let (observed, _) = measured(when_then(), &[(0, 0, 5.0), (1000, 0, 2.0), (2000, 0, 4.0)], Some(3000));
    assert_eq!(observed.value, Some(8.0));
    assert_eq!(observed.series, [(1.0, 8.0)]);
}

#[test]
fn two_streams_are_computed_once_both_had_a_message_and_then_at_each() {
    let sum = Expression::Sum(vec![Expression::Input(0), Expression::Input(1)]);
    let stream = [(0, 0, 1.0), (100, 0, 2.0), (200, 1, 10.0), (300, 0, 3.0), (400, 1, 20.0)];
    let (observed, _) =
        measured(formula(vec![command(), level(Members::Min)], Aggregate::Last { of: sum }), &stream, None);
    assert_eq!(observed.series, [(0.2, 12.0), (0.3, 13.0), (0.4, 23.0)]);
}

#[test]
fn a_group_is_its_minimum_unless_the_formula_says_otherwise() {
    let stream = [(0, 1, 5.0), (100, 2, 3.0), (200, 1, 4.0), (300, 2, 9.0)];
    let series = |members| {
        measured(formula(vec![level(members)], Aggregate::Last { of: Expression::Input(0) }), &stream, None).0.series
    };
    assert_eq!(series(Members::Min), [(0.0, 5.0), (0.1, 3.0), (0.3, 4.0)]);
    assert_eq!(series(Members::Max), [(0.0, 5.0), (0.2, 4.0), (0.3, 9.0)]);
    assert_eq!(series(Members::Sum), [(0.0, 5.0), (0.1, 8.0), (0.2, 7.0), (0.3, 13.0)]);
    assert_eq!(series(Members::Each), [(0.0, 5.0), (0.1, 3.0), (0.2, 4.0), (0.3, 9.0)]);
}

#[test]
fn a_count_is_zero_once_its_inputs_are_known_and_unknown_before() {
    let count = || formula(vec![command()], Aggregate::Count { of: below(0.0) });
    assert_eq!(value(count(), &[(0, 1, -1.0)]), None);
    assert_eq!(value(count(), &[(0, 0, 1.0)]), Some(0.0));
    assert_eq!(value(count(), &[(0, 0, -1.0), (1, 0, 1.0), (2, 0, -1.0)]), Some(2.0));
}

#[test]
fn a_duration_goes_on_to_the_end_of_the_run_but_not_after_a_failure() {
    let duration = || formula(vec![command()], Aggregate::Duration { of: below(0.0) });
    let stream = [(0, 0, 1.0), (1000, 0, -1.0), (1500, 0, -2.0), (2000, 0, 1.0), (3000, 0, -1.0)];
    assert_eq!(measured(duration(), &stream, Some(3250)).0.value, Some(1.25));
    assert_eq!(measured(duration(), &stream, None).0.value, Some(1.0));
}

#[test]
fn a_rate_limit_is_in_simulation_time_from_the_last_message_that_counted() {
    let limited = Formula { every: Some(0.2), ..formula(vec![command()], Aggregate::Count { of: below(0.0) }) };
    let stream = [(0, 0, -1.0), (100, 0, -1.0), (199, 0, -1.0), (200, 0, 1.0), (250, 0, -1.0), (449, 0, -1.0)];
    assert_eq!(value(limited, &stream), Some(2.0));
}

#[test]
fn each_key_has_held_values_and_a_rate_limit_of_its_own() {
    let count = FieldRef { topic: TopicId(1), path: vec!["count".into()] };
    let per = |aggregate| Formula {
        every: Some(0.2),
        per: Some(count.clone()),
        ..formula(vec![level(Members::Min), command()], aggregate)
    };
    // The keys are the signs of the levels.
    let stream = [(0, 1, -3.0), (10, 0, 0.0), (20, 2, 4.0), (30, 1, -5.0), (300, 2, 6.0)];
    let close =
        || Condition::Compare { left: Expression::Input(0), by: Comparison::Below, right: Expression::Constant(100.0) };
    // At 10 ms for the one key, at 20 and 300 ms for the other; at 30 ms the limit holds.
    assert_eq!(value(per(Aggregate::Count { of: close() }), &stream), Some(3.0));
    let mut greatest = per(Aggregate::Max { of: Expression::Input(0) });
    greatest.every = None;
    assert_eq!(value(greatest.clone(), &stream), Some(6.0), "of the least levels of each key");
    greatest.per = None;
    assert_eq!(value(greatest, &stream), Some(-3.0), "of the least levels of all");
    let mut last = per(Aggregate::Last { of: Expression::Input(0) });
    last.every = None;
    assert_eq!(value(last, &stream), Some(-5.0), "the least over keys");
}

#[test]
fn what_is_not_finite_is_refused_and_said() {
    let inverse = Expression::Divide { value: Box::new(Expression::Constant(1.0)), by: Box::new(Expression::Input(0)) };
    let (observed, warnings) =
        measured(formula(vec![command()], Aggregate::Min { of: inverse }), &[(0, 0, 2.0), (100, 0, 0.0)], None);
    assert_eq!(observed.value, Some(0.5));
    assert_eq!(warnings, ["metric `fuzzing_time`: refused the value inf at 0.100 s"]);
}

/// The least last level of the zones after the first `upto` messages.
fn least_level(stream: &[Sent], upto: usize) -> Option<f64> {
    let last = |path| stream[..upto].iter().rev().find(|sent| sent.1 == path).map(|sent| sent.2);
    [last(1), last(2)].into_iter().flatten().reduce(f64::min)
}

fn streams() -> impl Strategy<Value = Vec<Sent>> {
    prop::collection::vec((0..400i64, 0..PATHS.len(), -8..8i32), 0..60).prop_map(|steps| {
        let mut now = 0;
        let sent = steps.into_iter().map(|(after, path, number)| {
            now += after;
            (now, path, f64::from(number))
        });
        sent.collect()
    })
}

proptest! {
    #[test]
    fn aggregates_are_what_the_whole_stream_says(stream in streams()) {
        // The difference of the least level and the command, at each message since both are known.
        let inputs = || vec![level(Members::Min), command()];
        let difference =
            || Expression::Sum(vec![Expression::Input(0), Expression::Negate(Box::new(Expression::Input(1)))]);
        let seen: Vec<(i64, f64)> = (1..=stream.len())
            .filter_map(|upto| {
                let command = stream[..upto].iter().rev().find(|sent| sent.1 == 0)?.2;
                Some((stream[upto - 1].0, least_level(&stream, upto)? - command))
            })
            .collect();
        let values = || seen.iter().map(|&(_, value)| value);
        let close = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-9,
            (a, b) => a == b,
        };
        let get = |aggregate| value(formula(inputs(), aggregate), &stream);
        prop_assert_eq!(get(Aggregate::Last { of: difference() }), values().next_back());
        prop_assert_eq!(get(Aggregate::Min { of: difference() }), values().reduce(f64::min));
        prop_assert_eq!(get(Aggregate::Max { of: difference() }), values().reduce(f64::max));
        let mean = (!seen.is_empty()).then(|| values().sum::<f64>() / seen.len() as f64);
        let found = get(Aggregate::Mean { of: difference() });
        prop_assert!(close(found, mean), "{found:?} is not {mean:?}");
        let negative = || Condition::Compare {
            left: difference(),
            by: Comparison::Below,
            right: Expression::Constant(0.0),
        };
        let count = (!seen.is_empty()).then(|| values().filter(|&value| value < 0.0).count() as f64);
        prop_assert_eq!(get(Aggregate::Count { of: negative() }), count);
        let held: i64 = seen.windows(2).filter(|pair| pair[0].1 < 0.0).map(|pair| pair[1].0 - pair[0].0).sum();
        let duration = (!seen.is_empty()).then(|| held as f64 / 1e3);
        let found = get(Aggregate::Duration { of: negative() });
        prop_assert!(close(found, duration), "{found:?} is not {duration:?}");
    }

    #[test]
    fn no_two_counted_messages_are_nearer_than_the_rate_limit(stream in streams(), period in 1..900i64) {
        let mut last: Option<i64> = None;
        let mut counted = 0.0;
        for &(time, _, number) in stream.iter().filter(|sent| sent.1 == 0) {
            if number < 0.0 && last.is_none_or(|last| time >= last + period) {
                last = Some(time);
                counted += 1.0;
            }
        }
        let limited = Formula {
            every: Some(period as f64 / 1e3),
            ..formula(vec![command()], Aggregate::Count { of: below(0.0) })
        };
        prop_assert_eq!(value(limited, &stream).unwrap_or(0.0), counted);
    }

    #[test]
    fn keys_are_as_if_each_had_a_metric_of_its_own(stream in streams()) {
        let key = |number: f64| number < 0.0;
        let per = |aggregate| Formula {
            per: Some(FieldRef { topic: TopicId(1), path: vec!["count".into()] }),
            ..formula(vec![level(Members::Min)], aggregate)
        };
        let of_key = |negative: bool, aggregate: Aggregate| {
            let own: Vec<Sent> =
                stream.iter().copied().filter(|sent| sent.1 > 0 && key(sent.2) == negative).collect();
            value(formula(vec![level(Members::Min)], aggregate), &own)
        };
        let joined = |aggregate: Aggregate, join: fn(f64, f64) -> f64| {
            [of_key(true, aggregate.clone()), of_key(false, aggregate)].into_iter().flatten().reduce(join)
        };
        let count = Aggregate::Count { of: below(2.0) };
        prop_assert_eq!(value(per(count.clone()), &stream), joined(count, |a, b| a + b));
        let max = Aggregate::Max { of: Expression::Input(0) };
        prop_assert_eq!(value(per(max.clone()), &stream), joined(max, f64::max));
        let last = Aggregate::Last { of: Expression::Input(0) };
        prop_assert_eq!(value(per(last.clone()), &stream), joined(last, f64::min));
    }
}
