//! Declarative metrics on small message streams, and naive oracles that look at the whole stream at once.

use proptest::prelude::*;

use sesame_base::observation::{MetricObservation, Reach};
use sesame_base::time::SimTime;
use sesame_plan::testing::{plan, requirement};
use sesame_plan::{
    Aggregate, Bound, CampaignPlan, Comparison, Condition, Expression, FieldRef, Formula, Input, Members, Metric,
    MetricId, MetricSource, Side, TopicId, Transport, Trend,
};

use crate::metric::{Context, Hook, HookEntry, MetricTable};
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
    Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)
}

fn level(members: Members) -> Input {
    Input::new(FieldRef { topic: TopicId(1), path: vec!["level".into()] }, members)
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

/// What a formula makes of a stream that breaks off right after its last message, or ends at `end` milliseconds.
fn measured(formula: Formula, stream: &[Sent], end: Option<i64>) -> (MetricObservation, Vec<String>) {
    measured_by(&plan_with(formula), stream, end)
}

fn measured_by(plan: &CampaignPlan, stream: &[Sent], end: Option<i64>) -> (MetricObservation, Vec<String>) {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    for &(time, path, number) in stream {
        let wire = wires.find(PATHS[path]).unwrap();
        metrics.message(SimTime::from_nanos(time * 1_000_000), wire, &payload(path, number));
    }
    metrics.settle();
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
fn formulas_over_several_topics_see_an_instant_as_a_whole() {
    let difference = || Expression::Sum(vec![Expression::Input(1), Expression::Negate(Box::new(Expression::Input(0)))]);
    let of = |aggregate| formula(vec![command(), level(Members::Min)], aggregate);
    // Always one apart, published one after the other.
    let stream = [(0, 0, 0.0), (0, 1, 1.0), (50, 0, 0.5), (50, 1, 1.5), (100, 1, 2.0), (100, 0, 1.0)];
    let (observed, _) = measured(of(Aggregate::Min { of: difference() }), &stream, None);
    assert_eq!((observed.value, observed.series), (Some(1.0), vec![(0.0, 1.0)]));
    assert_eq!(value(of(Aggregate::Max { of: difference() }), &stream), Some(1.0));
    let counted = Aggregate::Count { of: Condition::Constant(true) };
    assert_eq!(value(of(counted), &stream), Some(3.0), "one for each instant");
}

#[test]
fn of_each_member_of_a_group_every_last_message_of_an_instant_counts_beside_other_topics() {
    let above = |input| Condition::Compare {
        left: Expression::Input(input),
        by: Comparison::Above,
        right: Expression::Input(1),
    };
    let counted = formula(vec![level(Members::Each), command()], Aggregate::Count { of: above(0) });
    // Both zones are above the command of their instant, which comes last; Z1 corrects itself.
    let stream = [(0, 1, 1.0), (0, 2, 4.0), (0, 1, 5.0), (0, 0, 3.0), (100, 0, 0.0)];
    assert_eq!(value(counted, &stream), Some(4.0), "both members, twice");
}

#[test]
fn the_last_instant_before_a_crash_counts_if_all_spoke_who_always_did() {
    let difference = || Expression::Sum(vec![Expression::Input(1), Expression::Negate(Box::new(Expression::Input(0)))]);
    let of = |aggregate| formula(vec![command(), level(Members::Each)], aggregate);
    // Two robots come closer and touch at 200 ms; the simulator dies of it.
    let apart = [(0, 0, 0.0), (0, 1, 2.0), (100, 0, 0.0), (100, 1, 1.0)];
    let broken = |aggregate, last: &[Sent]| {
        let plan = plan_with(of(aggregate));
        let wires = WireTable::new(&plan);
        let table = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut metrics = table.start();
        metrics.begin();
        for &(time, path, number) in apart.iter().chain(last) {
            metrics.message(
                SimTime::from_nanos(time * 1_000_000),
                wires.find(PATHS[path]).unwrap(),
                &payload(path, number),
            );
        }
        metrics.finish(&[]).0.remove(0)
    };
    let least = || Aggregate::Min { of: difference() };
    let touch = broken(least(), &[(200, 0, 0.0), (200, 1, -0.5)]);
    assert_eq!(touch.value, Some(-0.5));
    // Where the other was at 200 ms nobody knows.
    assert_eq!(broken(least(), &[(200, 0, 5.0)]).value, Some(1.0));
    let touching = Condition::Compare { left: difference(), by: Comparison::Below, right: Expression::Constant(0.0) };
    assert_eq!(broken(Aggregate::Count { of: touching }, &[(200, 1, -0.5), (200, 0, 0.0)]).value, Some(1.0));
}

#[test]
fn the_age_of_a_stamp_is_by_the_clock_of_stamps_and_reaches_its_bound_in_time() {
    let age = Expression::Sum(vec![Expression::Now, Expression::Negate(Box::new(Expression::Input(0)))]);
    let mut plan = plan_with(formula(vec![command()], Aggregate::Max { of: age }));
    plan.requirements = vec![requirement("young", 0, Bound::AtMost { value: 1.0 })];
    plan.simulator.transport = Transport::Process { program: "sim".to_owned(), arguments: Vec::new(), step_ns: None };
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let at = |seconds: f64| SimTime::from_seconds(seconds);
    let mut metrics = table.start();
    metrics.begin();
    // The run began when the wall clock showed 1,700,000,000 s, and a message was stamped 0.5 s later.
    metrics.clock_at_zero(1.7e9);
    metrics.message(at(0.75), wires.find(PATHS[0]).unwrap(), &payload(0, 1.7e9 + 0.5));
    metrics.advance_to(at(0.8));
    let reached = metrics.next_change().expect("the age grows").seconds();
    assert!((reached - 1.5).abs() < 1e-5, "as exact as such a number of seconds is: {reached}");
    metrics.advance_to(at(2.0));
    metrics.end(at(3.0));
    let oldest = metrics.finish(&[]).0.remove(0).value.unwrap();
    assert!((oldest - 2.5).abs() < 1e-6, "{oldest}");
}

#[test]
fn a_duration_grows_between_messages_and_its_bound_is_crossed_at_its_moment() {
    let mut plan = plan_with(formula(vec![command()], Aggregate::Duration { of: below(0.0) }));
    plan.requirements = vec![requirement("short", 0, Bound::AtMost { value: 1.0 })];
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let at = |seconds: f64| SimTime::from_seconds(seconds);
    let run = |end: Option<f64>| {
        let mut metrics = table.start();
        metrics.begin();
        metrics.message(at(0.1), wires.find(PATHS[0]).unwrap(), &payload(0, -1.0));
        metrics.advance_to(at(0.5));
        assert_eq!(metrics.value(MetricId(0), 0.0), Some(0.4), "conditions see it grow");
        assert_eq!(metrics.next_change(), Some(at(1.1)));
        metrics.advance_to(at(2.5));
        if let Some(end) = end {
            metrics.message(at(2.8), wires.find(PATHS[0]).unwrap(), &payload(0, 1.0));
            metrics.end(at(end));
        } else {
            // Something else was heard, and then nothing more.
            metrics.message(at(2.5), wires.find(PATHS[1]).unwrap(), &payload(1, 1.0));
        }
        metrics.finish(&[]).0.remove(0)
    };
    let whole = run(Some(5.0));
    assert_eq!(whole.value, Some(2.7));
    assert_eq!(&whole.series[..3], [(0.1, 0.0), (1.1, 1.0), (1.100_000_001, 1.000_000_001)]);
    assert_eq!(run(None).value, Some(2.4), "until the last instant that was observed");
}

#[test]
fn conditions_see_the_values_of_an_instant_as_soon_as_time_moves_on() {
    let sum = Expression::Sum(vec![Expression::Input(0), Expression::Input(1)]);
    let plan = plan_with(formula(vec![command(), level(Members::Min)], Aggregate::Last { of: sum }));
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    let (at, shown) = (SimTime::from_nanos, |metrics: &super::Metrics<'_>| metrics.value(MetricId(0), 0.0));
    for (path, number) in [(0, 1.0), (1, 10.0)] {
        metrics.message(at(5), wires.find(PATHS[path]).unwrap(), &payload(path, number));
    }
    metrics.advance_to(at(5));
    assert_eq!(shown(&metrics), None);
    metrics.advance_to(at(6));
    assert_eq!(shown(&metrics), Some(11.0));
    metrics.message(at(7), wires.find(PATHS[0]).unwrap(), &payload(0, 2.0));
    assert_eq!(shown(&metrics), Some(11.0));
    metrics.end(at(7));
    assert_eq!(shown(&metrics), Some(12.0), "at the end all messages are known");
}

#[test]
fn an_instant_in_which_the_run_broke_off_is_not_judged() {
    let sum = Expression::Sum(vec![Expression::Input(0), Expression::Input(1)]);
    let plan = plan_with(formula(vec![command(), level(Members::Min)], Aggregate::Last { of: sum }));
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    for (path, number) in [(0, 1.0), (1, 10.0)] {
        metrics.message(SimTime::from_nanos(5), wires.find(PATHS[path]).unwrap(), &payload(path, number));
    }
    metrics.advance_to(SimTime::from_nanos(5));
    assert_eq!(metrics.finish(&[]).0[0].value, None);
}

fn trending(formula: Formula, trend: Trend) -> CampaignPlan {
    let mut plan = plan_with(formula);
    plan.metrics[0].trend = Some(trend);
    plan
}

#[test]
fn after_a_run_that_broke_off_a_metric_can_still_reach_what_its_trend_permits() {
    let stream = [(0, 0, 2.0), (100, 0, 3.0)];
    let of = || Expression::Input(0);
    let reach = |plan: &CampaignPlan, end| measured_by(plan, &stream, end).0.reach;
    let max = trending(formula(vec![command()], Aggregate::Max { of: of() }), Trend::Rising);
    assert_eq!(reach(&max, None), Reach { low: Some(3.0), high: None });
    assert_eq!(reach(&max, Some(200)), Reach::only(3.0));
    let min = trending(formula(vec![command()], Aggregate::Min { of: of() }), Trend::Falling);
    assert_eq!(reach(&min, None), Reach { low: None, high: Some(2.0) });
    let last = plan_with(formula(vec![command()], Aggregate::Last { of: of() }));
    assert_eq!(reach(&last, None), Reach::ANY);
    let unheard = trending(formula(vec![level(Members::Min)], Aggregate::Max { of: of() }), Trend::Rising);
    assert_eq!(reach(&unheard, None), Reach::ANY, "it has no value yet");
}

#[test]
fn a_number_that_is_not_finite_is_remembered_and_the_formula_waits_for_a_finite_one() {
    let of = || Expression::Input(0);
    let max = trending(formula(vec![command()], Aggregate::Max { of: of() }), Trend::Rising);
    let stream = [(0, 0, 2.0), (100, 0, f64::NAN), (200, 0, f64::INFINITY), (300, 0, 3.0)];
    let (observed, warnings) = measured_by(&max, &stream, Some(400));
    assert_eq!((observed.value, observed.not_finite), (Some(3.0), Some(0.1)));
    assert_eq!(observed.reach, Reach { low: Some(3.0), high: None });
    assert_eq!(warnings, [""; 0], "it is a finding, not a warning");
    let below = formula(vec![command()], Aggregate::Duration { of: below(9.0) });
    let (observed, _) = measured_by(&trending(below, Trend::Rising), &stream, Some(400));
    assert_eq!(observed.value, Some(0.2), "what held until the gap and after it");
    let limited = Formula { every: Some(0.25), ..formula(vec![command()], Aggregate::Max { of: of() }) };
    let (observed, _) = measured_by(&trending(limited, Trend::Rising), &stream, Some(400));
    assert_eq!(observed.value, Some(3.0));
    assert_eq!(observed.reach, Reach { low: Some(2.0), high: None }, "the limit might have left out the 3");
}

#[test]
fn a_member_of_a_group_that_is_not_finite_is_not_hidden_by_the_others() {
    let least = formula(vec![level(Members::Min)], Aggregate::Min { of: Expression::Input(0) });
    let stream = [(0, 1, 5.0), (0, 2, 4.0), (100, 2, f64::NAN), (200, 1, 3.0), (300, 2, 4.5)];
    let (observed, _) = measured(least, &stream, Some(400));
    assert_eq!((observed.not_finite, observed.series), (Some(0.1), vec![(0.0, 4.0), (0.3, 3.0)]));
}

/// Sets each command as its value.
struct Echo;

impl Hook for Echo {
    fn on_start(&mut self, _: &mut Context) {}
    fn on_message(&mut self, _: usize, value: &Value, ctx: &mut Context) {
        if let Value::Real(x) = value
            && !x.is_infinite()
        {
            ctx.set(*x);
        }
    }
    fn on_end(&mut self, _: &mut Context) {}
}

/// What a hook that echoes commands shows, with a trend and with or without infinity being ordinary for it.
fn echoed(trend: Option<Trend>, accepts: bool, stream: &[Sent], end: Option<i64>) -> (MetricObservation, Vec<String>) {
    let mut plan = plan(Vec::new());
    plan.metrics.truncate(1);
    plan.metrics[0].source = MetricSource::Hook { topics: vec![TopicId(0)] };
    plan.metrics[0].trend = trend;
    plan.metrics[0].accepts_not_finite = accepts;
    let wires = WireTable::new(&plan);
    let hooks = [HookEntry { metric: "fuzzing_time", build: |_| Box::new(Echo) }];
    let table = MetricTable::new(&plan, &wires, &hooks).unwrap();
    let mut metrics = table.start();
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

#[test]
fn a_hook_that_breaks_its_declared_trend_is_told_so_and_decides_nothing_after_a_crash() {
    let rising = Some(Trend::Rising);
    let (kept, warnings) = echoed(rising, false, &[(0, 0, 1.0), (1, 0, 3.0)], None);
    assert_eq!((kept.reach, warnings.len()), (Reach { low: Some(3.0), high: None }, 0));
    let (turned, warnings) = echoed(rising, false, &[(0, 0, 3.0), (1, 0, 1.0), (2, 0, 4.0)], None);
    assert_eq!(turned.reach, Reach::ANY);
    let words = "metric `fuzzing_time`: it is declared `rising`, but its hook set 1 after 3 at 0.001 s";
    assert_eq!(warnings, [words]);
    let (whole, _) = echoed(rising, false, &[(0, 0, 3.0), (1, 0, 1.0)], Some(2));
    assert_eq!(whole.reach, Reach::only(1.0), "of a run that came to its end the value is known");
    let (falling, _) = echoed(Some(Trend::Falling), false, &[(0, 0, 3.0), (1, 0, 1.0)], None);
    assert_eq!(falling.reach, Reach { low: None, high: Some(1.0) });
}

#[test]
fn what_is_not_finite_counts_for_a_hook_unless_it_accepts_it() {
    let stream = [(0, 0, 1.0), (1, 0, f64::INFINITY), (2, 0, 5.0)];
    let (heard, _) = echoed(Some(Trend::Rising), false, &stream, Some(3));
    assert_eq!((heard.value, heard.not_finite), (Some(5.0), Some(0.001)));
    assert_eq!(heard.reach, Reach { low: Some(1.0), high: None }, "who knows what the hook made of it");
    let (accepted, _) = echoed(Some(Trend::Rising), true, &stream, Some(3));
    assert_eq!((accepted.reach, accepted.not_finite), (Reach::only(5.0), None));
    let (set, warnings) = echoed(None, true, &[(0, 0, 1.0), (1, 0, f64::NAN)], Some(3));
    assert_eq!((set.reach, set.not_finite), (Reach::ANY, Some(0.001)), "what it sets has to be finite all the same");
    assert_eq!(warnings, ["metric `fuzzing_time`: refused the value NaN at 0.001 s"]);
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
fn what_a_duration_is_when_a_run_breaks_off_does_not_depend_on_who_else_spoke() {
    let duration = || formula(vec![command()], Aggregate::Duration { of: below(0.0) });
    let broken_off = |others: &[Sent]| {
        let (plan, mut now) = (plan_with(duration()), SimTime::ZERO);
        let wires = WireTable::new(&plan);
        let table = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut metrics = table.start();
        metrics.begin();
        for &(time, path, number) in [(1000, 0, -1.0)].iter().chain(others) {
            now = SimTime::from_nanos(time * 1_000_000);
            metrics.message(now, wires.find(PATHS[path]).unwrap(), &payload(path, number));
        }
        metrics.advance_to(now.max(SimTime::from_nanos(2_000_000_000)));
        metrics.finish(&[]).0[0].value
    };
    assert_eq!((broken_off(&[]), broken_off(&[(2000, 1, 0.0)])), (Some(1.0), Some(1.0)));
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
fn what_arithmetic_makes_not_finite_is_refused_and_said() {
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
    prop::collection::vec((prop_oneof![1 => Just(0i64), 2 => 0..400i64], 0..PATHS.len(), -8..8i32), 0..60).prop_map(
        |steps| {
            let mut now = 0;
            let sent = steps.into_iter().map(|(after, path, number)| {
                now += after;
                (now, path, f64::from(number))
            });
            sent.collect()
        },
    )
}

proptest! {
    #[test]
    fn aggregates_are_what_the_whole_stream_says(stream in streams()) {
        // The difference of the least level and the command, at each instant with a message since both are known.
        let inputs = || vec![level(Members::Min), command()];
        let difference =
            || Expression::Sum(vec![Expression::Input(0), Expression::Negate(Box::new(Expression::Input(1)))]);
        let seen: Vec<(i64, f64)> = (1..=stream.len())
            .filter(|&upto| upto == stream.len() || stream[upto].0 > stream[upto - 1].0)
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
