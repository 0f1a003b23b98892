//! Formulas over points, texts and times of groups: members of two groups, and pairs of one group's members, beside
//! naive oracles that look at the whole stream at once.

use proptest::prelude::*;

use sesame_base::observation::MetricObservation;
use sesame_base::time::SimTime;
use sesame_plan::stl::{self, Interval, Robustness};
use sesame_plan::testing::{plan, topic};
use sesame_plan::{
    Aggregate, CampaignPlan, Comparison, Condition, Distance, Expression, FieldRef, Formula, Input, Members,
    MetricSource, Point, Region, Side, SignedDistance, TextTest, TopicId, Transport, Type, UnaryFunction,
};

use crate::metric::{MetricError, MetricTable};
use crate::value::{Fields, Record, Value};
use crate::wire::WireTable;

/// A message: milliseconds, path, where it is along the x axis.
type Sent = (i64, &'static str, f64);

const POSES: TopicId = TopicId(0);
const GOALS: TopicId = TopicId(1);
const TOWER: TopicId = TopicId(2);

fn system() -> CampaignPlan {
    let mut plan = plan(Vec::new());
    plan.topics = vec![
        topic("poses", &["poses/a", "poses/b", "poses/c"], Type::Text),
        topic("goals", &["goals/a", "goals/b", "goals/c"], Type::Text),
        topic("tower", &["tower"], Type::Text),
        topic("two", &["two/a", "two/b"], Type::Text),
    ];
    plan
}

/// A place on the x axis, three above the ground; its mode is `ahead` where x is positive.
fn payload(x: f64) -> Value {
    let mode = if x > 0.0 { "ahead" } else { "behind" };
    let fields = Fields::new(["at", "mode"]);
    Record::new(&fields, vec![Value::Point([x, 0.0, 3.0]), Value::from(mode)]).into()
}

fn input(topic: TopicId, path: &[&str], members: Members) -> Input {
    let path = path.iter().map(|&name| name.to_owned()).collect();
    Input::new(FieldRef { topic, path }, members)
}

fn mode(members: Members, test: TextTest) -> Input {
    Input { text: Some(test), ..input(POSES, &["mode"], members) }
}

fn apart() -> Expression {
    Expression::Distance(Box::new(Distance { from: Point::Input(0), to: Point::Input(1), scale: 1.0 }))
}

fn pairs() -> Vec<Input> {
    vec![input(POSES, &["at"], Members::First), input(POSES, &["at"], Members::Second)]
}

fn to_goals() -> Vec<Input> {
    vec![input(POSES, &["at"], Members::Each), input(GOALS, &["at"], Members::Each)]
}

fn near(limit: f64) -> Condition {
    Condition::Compare { left: apart(), by: Comparison::Below, right: Expression::Constant(limit) }
}

fn formula(inputs: Vec<Input>, aggregate: Aggregate) -> MetricSource {
    let formula = Formula { inputs, aggregate, when: None, every: None, per: None, side: Side::Inbound };
    MetricSource::Formula { formula }
}

/// That the distance is above a limit at all times.
fn always_above(inputs: Vec<Input>, limit: f64) -> MetricSource {
    let above = stl::Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: limit };
    let formula = stl::Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(above) };
    let signals = vec![apart()];
    MetricSource::Robustness {
        robustness: Robustness { inputs, signals, formula, side: Side::Inbound, whole_windows: false },
    }
}

/// Value and warnings of a metric after a run of ten seconds.
fn measured(source: MetricSource, sent: &[Sent]) -> (Option<f64>, Vec<String>) {
    until(Some(10.0), source, sent)
}

/// Value and warnings of a metric after a run, which breaks off if it has no end.
fn until(end: Option<f64>, source: MetricSource, sent: &[Sent]) -> (Option<f64>, Vec<String>) {
    let mut plan = system();
    plan.metrics.truncate(1);
    plan.metrics[0].source = source;
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    for &(time, path, x) in sent {
        metrics.message(SimTime::from_nanos(time * 1_000_000), wires.find(path).unwrap(), &payload(x));
    }
    if let Some(end) = end {
        metrics.end(SimTime::from_seconds(end));
    }
    let (mut observed, warnings) = metrics.finish(&[]);
    (observed.remove(0).value, warnings)
}

fn value(source: MetricSource, sent: &[Sent]) -> Option<f64> {
    measured(source, sent).0
}

#[test]
fn coordinates_are_those_of_the_group_as_other_numbers_are() {
    let of = |axis: &str, members| {
        let of = Expression::Input(0);
        value(
            formula(vec![input(POSES, &["at", axis], members)], Aggregate::Last { of }),
            &[(0, "poses/a", 4.0), (0, "poses/b", -7.0)],
        )
    };
    assert_eq!(of("x", Members::Min), Some(-7.0));
    assert_eq!(of("x", Members::Max), Some(4.0));
    assert_eq!(of("y", Members::Min), Some(0.0));
    assert_eq!(of("z", Members::Sum), Some(6.0));
    let last = MetricSource::Last { input: FieldRef { topic: TOWER, path: vec!["at".into(), "z".into()] } };
    assert_eq!(value(last, &[(0, "tower", 1.0)]), Some(3.0));
}

#[test]
fn a_text_is_compared_at_all_members_at_any_or_at_the_one_of_the_message() {
    let sent = [(0, "poses/a", 1.0), (1000, "poses/b", -1.0), (3000, "poses/b", 1.0), (6000, "poses/a", -1.0)];
    let of = |members, test| {
        let of = Condition::Input(0);
        value(formula(vec![mode(members, test)], Aggregate::Duration { of }), &sent)
    };
    let ahead = || TextTest::Is("ahead".into());
    assert_eq!(of(Members::Min, ahead()), Some(1.0 + 3.0), "all are");
    assert_eq!(of(Members::Max, ahead()), Some(10.0), "any is");
    assert_eq!(of(Members::Min, TextTest::IsNot("ahead".into())), Some(0.0), "none is");
    assert_eq!(of(Members::Max, TextTest::IsNot("ahead".into())), Some(2.0 + 4.0), "any is not");
    let of_each = of(Members::Each, TextTest::IsNot("elsewhere".into()));
    assert_eq!(of_each, Some(10.0 + 9.0), "of each member since its first message");
}

#[test]
fn a_duration_over_each_member_does_not_depend_on_the_order_of_messages_in_an_instant() {
    let out =
        || Condition::Compare { left: Expression::Input(0), by: Comparison::Above, right: Expression::Constant(5.0) };
    let x = || vec![input(POSES, &["at", "x"], Members::Each)];
    let of = |sent: &[Sent]| value(formula(x(), Aggregate::Duration { of: out() }), sent);
    let outside = |paths: [&'static str; 2]| -> Vec<Sent> {
        (0..10)
            .flat_map(|second| paths.map(|path| (second * 1000, path, if path == "poses/a" { 9.0 } else { 0.0 })))
            .collect()
    };
    assert_eq!(of(&outside(["poses/a", "poses/b"])), Some(10.0));
    assert_eq!(of(&outside(["poses/b", "poses/a"])), Some(10.0));
}

#[test]
fn a_duration_over_each_member_grows_while_those_that_it_holds_of_are_silent() {
    let out =
        Condition::Compare { left: Expression::Input(0), by: Comparison::Above, right: Expression::Constant(5.0) };
    let x = || vec![input(POSES, &["at", "x"], Members::Each)];
    let source = formula(x(), Aggregate::Duration { of: out });
    let sent = [(0, "poses/a", 9.0), (1_000, "poses/b", 8.0), (3_000, "poses/c", 0.0), (4_000, "poses/c", 0.0)];
    assert_eq!(until(None, source, &sent).0, Some(4.0 + 3.0), "until the last message");
}

#[test]
fn members_that_change_in_the_same_instant_are_seen_together() {
    let x = |members| input(POSES, &["at", "x"], members);
    let spread = Expression::Sum(vec![Expression::Input(0), Expression::Negate(Box::new(Expression::Input(1)))]);
    let sent: Vec<Sent> = (0..10)
        .flat_map(|second| ["poses/a", "poses/b", "poses/c"].map(|path| (second * 1000, path, second as f64)))
        .collect();
    let both = || vec![x(Members::Max), x(Members::Min)];
    assert_eq!(value(formula(both(), Aggregate::Max { of: spread.clone() }), &sent), Some(0.0));
    let apart = Condition::Compare { left: spread, by: Comparison::Above, right: Expression::Constant(0.5) };
    assert_eq!(value(formula(both(), Aggregate::Count { of: apart }), &sent), Some(0.0));
    let total = Aggregate::Max { of: Expression::Input(0) };
    assert_eq!(value(formula(vec![x(Members::Sum)], total), &sent), Some(27.0));
}

/// A topic that falls silent at 2 s and returns at 8 s; other messages show that time passes.
fn silent_for_six_seconds() -> Vec<Sent> {
    let mut sent: Vec<Sent> = (0..100).map(|tenth| (tenth * 100, "goals/a", 0.0)).collect();
    let stamps = (0..100).filter(|tenth| !(21..80).contains(tenth));
    sent.extend(stamps.map(|tenth| (tenth * 100, "tower", tenth as f64 / 10.0)));
    sent.sort_by_key(|message| message.0);
    sent
}

#[test]
fn the_age_of_a_silent_topic_grows_until_its_next_message() {
    let age = || Expression::Sum(vec![Expression::Time, Expression::Negate(Box::new(Expression::Input(0)))]);
    let x = || vec![input(TOWER, &["at", "x"], Members::Min)];
    let sent = silent_for_six_seconds();
    let near = |found: Option<f64>, expected: f64| assert!((found.unwrap() - expected).abs() < 1e-9, "{found:?}");
    near(value(formula(x(), Aggregate::Max { of: age() }), &sent), 5.9);
    let late = || Condition::Compare { left: age(), by: Comparison::Above, right: Expression::Constant(0.95) };
    near(value(formula(x(), Aggregate::Duration { of: late() }), &sent), 5.0);
    near(value(formula(x(), Aggregate::Count { of: late() }), &sent), 0.0);
    let MetricSource::Robustness { mut robustness } = always_above(x(), 0.0) else { unreachable!("it is one") };
    robustness.signals = vec![Expression::Sum(vec![Expression::Constant(1.0), Expression::Negate(Box::new(age()))])];
    near(value(MetricSource::Robustness { robustness }, &sent), -4.9);
}

/// What a metric of a stream shows, in a system with steps of a tenth of a second or without steps, while time is
/// looked at at these moments too, in nanoseconds.
fn looked_at(source: MetricSource, steps: bool, sent: &[Sent], moments: &[i64]) -> MetricObservation {
    let mut plan = system();
    plan.metrics.truncate(1);
    plan.metrics[0].source = source;
    plan.campaign.end_after = 10.0;
    plan.simulator.transport = if steps {
        Transport::InProcess { path: "a::Cell".to_owned(), step_ns: 100_000_000 }
    } else {
        Transport::Process { program: "sim".to_owned(), arguments: Vec::new(), step_ns: None }
    };
    let wires = WireTable::new(&plan);
    let table = MetricTable::new(&plan, &wires, &[]).unwrap();
    let mut metrics = table.start();
    metrics.begin();
    let messages = sent.iter().map(|message| (message.0 * 1_000_000, Some(message)));
    let mut all: Vec<(i64, Option<&Sent>)> = moments.iter().map(|&moment| (moment, None)).chain(messages).collect();
    all.sort_by_key(|timed| timed.0);
    for (time, message) in all {
        let now = SimTime::from_nanos(time);
        metrics.advance_to(now);
        match message {
            Some((_, path, x)) => metrics.message(now, wires.find(path).unwrap(), &payload(*x)),
            None => drop(metrics.settle()),
        }
    }
    metrics.end(SimTime::from_seconds(10.0));
    metrics.finish(&[]).0.remove(0)
}

/// How old the last value of the tower is that it said of itself.
fn age() -> Expression {
    Expression::Sum(vec![Expression::Time, Expression::Negate(Box::new(Expression::Input(0)))])
}

fn older_than(seconds: f64) -> Condition {
    Condition::Compare { left: age(), by: Comparison::Above, right: Expression::Constant(seconds) }
}

#[test]
fn an_age_is_that_at_steps_or_just_before_the_next_message_whatever_else_happens() {
    let of_tower = || vec![input(TOWER, &["at", "x"], Members::Min)];
    let stamped: Vec<Sent> = (0..10).map(|second| (second * 1000, "tower", second as f64)).collect();
    let greatest = |steps, moments: &[i64]| {
        looked_at(formula(of_tower(), Aggregate::Max { of: age() }), steps, &stamped, moments).value.unwrap()
    };
    for moments in [&[][..], &[1_350_000_000, 2_999_999_999]] {
        assert!((greatest(true, moments) - 1.0).abs() < 1e-9, "at 10 s it is one second old");
        assert!((greatest(false, moments) - 1.0).abs() < 1e-8);
        let late = |steps| {
            let source = formula(of_tower(), Aggregate::Duration { of: older_than(0.25) });
            looked_at(source, steps, &stamped, moments).value.unwrap()
        };
        assert_eq!(late(true), 10.0 * 0.7, "from the third step of each second on");
        assert!((late(false) - 10.0 * 0.75).abs() < 1e-7, "{}", late(false));
    }
}

#[test]
fn each_member_has_an_age_of_its_own() {
    let age = || Expression::Sum(vec![Expression::Time, Expression::Negate(Box::new(Expression::Input(0)))]);
    let x = || vec![input(POSES, &["at", "x"], Members::Each)];
    // One is heard once, the other again and again.
    let mut sent: Vec<Sent> = vec![(0, "poses/a", 0.0)];
    sent.extend((0..80).map(|tenth| (tenth * 100, "poses/b", tenth as f64 / 10.0)));
    assert_eq!(value(formula(x(), Aggregate::Max { of: age() }), &sent), Some(10.0));
    assert_eq!(value(formula(x(), Aggregate::Min { of: age() }), &sent), Some(0.0));
}

#[test]
fn time_is_that_of_the_message_and_passes_without_one() {
    let late = Condition::Compare { left: Expression::Time, by: Comparison::Above, right: Expression::Constant(2.0) };
    let sent = [(1000, "tower", 1.0), (2000, "tower", 1.0), (2001, "tower", 1.0), (9000, "tower", 1.0)];
    let x = || vec![input(TOWER, &["at", "x"], Members::Min)];
    assert_eq!(value(formula(x(), Aggregate::Count { of: late }), &sent), Some(2.0));
    assert_eq!(value(formula(x(), Aggregate::Max { of: Expression::Time }), &sent), Some(10.0));
}

#[test]
fn a_fence_is_left_by_as_much_as_the_signed_distance_says() {
    let to = Region::Polygon { corners: vec![[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]] };
    let of = Expression::SignedDistance(Box::new(SignedDistance { from: Point::Input(0), to }));
    let at = vec![input(POSES, &["at"], Members::Each)];
    let sent = [(0, "poses/a", 4.0), (100, "poses/b", 7.5), (200, "poses/a", 0.0)];
    assert_eq!(value(formula(at, Aggregate::Max { of }), &sent), Some(2.5));
}

#[test]
fn a_function_without_a_value_is_a_warning_with_metric_and_moment_and_the_rest_counts() {
    let root = || Expression::Unary { function: UnaryFunction::Sqrt, of: Box::new(Expression::Input(0)) };
    let x = || vec![input(TOWER, &["at", "x"], Members::Min)];
    let sent = [(0, "tower", 9.0), (1500, "tower", -4.0), (2000, "tower", 4.0)];
    let warned = ["metric `fuzzing_time`: `sqrt(-4)` has no value at 1.500 s".to_owned()];
    let (found, warnings) = measured(formula(x(), Aggregate::Min { of: root() }), &sent);
    assert_eq!((found, warnings.as_slice()), (Some(2.0), warned.as_slice()));
    let above = |right| Condition::Compare { left: root(), by: Comparison::Above, right: Expression::Constant(right) };
    let (found, warnings) = measured(formula(x(), Aggregate::Count { of: above(1.0) }), &sent);
    assert_eq!((found, warnings.as_slice()), (Some(2.0), warned.as_slice()), "in a condition");
    let MetricSource::Robustness { mut robustness } = always_above(x(), 1.0) else { unreachable!("it is one") };
    robustness.signals = vec![root()];
    let (found, warnings) = measured(MetricSource::Robustness { robustness }, &sent);
    assert_eq!((found, warnings.as_slice()), (Some(1.0), warned.as_slice()), "in a robustness");
}

#[test]
fn members_of_two_groups_are_read_together_and_only_once_both_had_a_message() {
    // Each is two from its own goal and far from the others'; b has none before 2 s.
    let sent = [
        (0, "goals/a", 2.0),
        (0, "poses/a", 0.0),
        (1000, "poses/b", 100.0),
        (2000, "goals/b", 102.0),
        (3000, "poses/a", -1.0),
    ];
    assert_eq!(value(formula(to_goals(), Aggregate::Min { of: apart() }), &sent), Some(2.0));
    assert_eq!(value(formula(to_goals(), Aggregate::Max { of: apart() }), &sent), Some(3.0));
    let always = Aggregate::Count { of: Condition::Constant(true) };
    assert_eq!(value(formula(to_goals(), always), &sent), Some(3.0), "a at 0 s and 3 s, b at 2 s");
    assert_eq!(value(always_above(to_goals(), 1.0), &sent), Some(1.0));
}

#[test]
fn with_a_third_topic_every_member_that_is_known_is_read_again_and_no_mixture() {
    let inputs = || [to_goals(), vec![input(TOWER, &["at", "x"], Members::Min)]].concat();
    // The message of goals/b pairs with nothing; what the tower says then is of a.
    let sent =
        [(0, "tower", 0.0), (0, "poses/a", 0.0), (0, "goals/a", 1.0), (1000, "goals/b", 50.0), (2000, "tower", 0.0)];
    assert_eq!(value(formula(inputs(), Aggregate::Max { of: apart() }), &sent), Some(1.0));
    let all = || Aggregate::Count { of: Condition::Constant(true) };
    assert_eq!(value(formula(inputs(), all()), &sent), Some(2.0));
    let both = [&sent[..], &[(3000, "poses/b", 49.0), (4000, "tower", 0.0)]].concat();
    assert_eq!(value(formula(inputs(), all()), &both), Some(2.0 + 1.0 + 2.0));
}

/// Each pose, and the tower.
fn to_tower() -> Vec<Input> {
    vec![input(POSES, &["at"], Members::Each), input(TOWER, &["at"], Members::Min)]
}

#[test]
fn what_moves_among_members_that_stand_still_is_seen_by_all_of_them() {
    // The drones said once where they are; the crane drives through two of them.
    let mut sent: Vec<Sent> = vec![(0, "poses/a", 100.0), (0, "poses/b", 300.0), (0, "poses/c", 950.0)];
    sent.extend((0..=20).map(|step| (step * 100, "tower", 20.0 * step as f64)));
    let of = |aggregate| value(formula(to_tower(), aggregate), &sent);
    assert_eq!(of(Aggregate::Min { of: apart() }), Some(0.0));
    assert_eq!(of(Aggregate::Max { of: apart() }), Some(950.0));
    assert_eq!(of(Aggregate::Count { of: near(5.0) }), Some(2.0));
    assert_eq!(of(Aggregate::Duration { of: near(5.0) }), Some(0.2));
    assert_eq!(value(always_above(to_tower(), 3.0), &sent), Some(-3.0));
    let MetricSource::Formula { formula: limited } = formula(to_tower(), Aggregate::Count { of: near(1e6) }) else {
        unreachable!("it is one")
    };
    let limited = MetricSource::Formula { formula: Formula { every: Some(1.0), ..limited } };
    assert_eq!(value(limited, &sent), Some(3.0 * 3.0), "at 0, 1 and 2 s, each of them");
}

#[test]
fn members_of_one_key_have_states_of_their_own() {
    // Both are in the same place; one is ahead all the time, the other says once that it is not.
    let per = FieldRef { topic: POSES, path: vec!["mode".into()] };
    let ahead =
        Condition::Compare { left: Expression::Input(0), by: Comparison::Above, right: Expression::Constant(3.0) };
    let MetricSource::Formula { formula } =
        formula(vec![input(POSES, &["at", "x"], Members::Each)], Aggregate::Duration { of: ahead })
    else {
        unreachable!("it is one")
    };
    let keyed = MetricSource::Formula { formula: Formula { per: Some(per), ..formula } };
    let sent = [(0, "poses/a", 5.0), (1000, "poses/b", 1.0), (2000, "poses/b", 2.0)];
    assert_eq!(value(keyed, &sent), Some(10.0));
}

#[test]
fn groups_of_different_sizes_are_refused() {
    let mut plan = system();
    let two = input(TopicId(3), &["at"], Members::Each);
    plan.metrics[0].source = formula(vec![input(POSES, &["at"], Members::Each), two], Aggregate::Min { of: apart() });
    let table = MetricTable::new(&plan, &WireTable::new(&plan), &[]).map(|_| ());
    assert_eq!(table, Err(MetricError::UnpairedMembers("fuzzing_time".into())));
}

#[test]
fn pairs_see_an_instant_as_a_whole() {
    // All move by ten at once and stay five apart; in between, b would be five before where a was.
    let sent = [
        (0, "poses/a", 0.0),
        (0, "poses/b", 5.0),
        (0, "poses/c", 10.0),
        (50, "poses/a", 10.0),
        (50, "poses/b", 15.0),
        (50, "poses/c", 20.0),
    ];
    assert_eq!(value(formula(pairs(), Aggregate::Min { of: apart() }), &sent), Some(5.0));
    assert_eq!(value(formula(pairs(), Aggregate::Max { of: apart() }), &sent), Some(10.0));
    assert_eq!(value(always_above(pairs(), 2.0), &sent), Some(3.0));
    let all = Aggregate::Count { of: Condition::Constant(true) };
    assert_eq!(value(formula(pairs(), all), &sent), Some(6.0), "three pairs at two instants");
}

#[test]
fn each_pair_has_a_state_of_its_own() {
    let sent = [(0, "poses/a", 0.0), (0, "poses/b", 1.0), (0, "poses/c", 50.0), (4000, "poses/c", 1.5)];
    let time = || value(formula(pairs(), Aggregate::Duration { of: near(2.0) }), &sent);
    assert_eq!(time(), Some(10.0 + 6.0 + 6.0));
    let last = || value(formula(pairs(), Aggregate::Last { of: apart() }), &sent);
    assert_eq!(last(), Some(0.5));
    let MetricSource::Formula { formula: mut limited } = formula(pairs(), Aggregate::Count { of: near(2.0) }) else {
        unreachable!("it is one")
    };
    limited.every = Some(5.0);
    assert_eq!(value(MetricSource::Formula { formula: limited }, &sent), Some(3.0), "each pair once");
}

#[test]
fn of_members_that_never_spoke_there_are_no_pairs() {
    let alone = [(0, "poses/b", 1.0), (100, "poses/b", 2.0)];
    assert_eq!(value(formula(pairs(), Aggregate::Min { of: apart() }), &alone), None);
    assert_eq!(value(always_above(pairs(), 0.0), &alone), None);
    let two = [(0, "poses/b", 1.0), (100, "poses/c", 2.0)];
    assert_eq!(value(formula(pairs(), Aggregate::Min { of: apart() }), &two), Some(1.0));
    assert_eq!(value(always_above(pairs(), 0.0), &two), Some(1.0));
}

/// Where each path is after all messages up to the end of an instant, and whether it was heard in it.
fn state(sent: &[Sent], time: i64, path: &str) -> (Option<f64>, bool) {
    let own = || sent.iter().filter(|message| message.1 == path && message.0 <= time);
    (own().next_back().map(|message| message.2), own().any(|message| message.0 == time))
}

/// The oracle: all distances between two paths, with the time from which they last.
fn distances(sent: &[Sent], one: &str, other: &str) -> Vec<(i64, f64)> {
    let mut times: Vec<i64> = sent.iter().map(|message| message.0).collect();
    times.dedup();
    let at = |time: i64| {
        let ((x, heard), (y, other_heard)) = (state(sent, time, one), state(sent, time, other));
        (heard || other_heard).then_some(())?;
        Some((time, (x? - y?).abs()))
    };
    times.into_iter().filter_map(at).collect()
}

fn held(distances: &[(i64, f64)], limit: f64) -> i64 {
    let next = distances.iter().skip(1).map(|distance| distance.0).chain([10_000]);
    distances
        .iter()
        .zip(next)
        .filter(|(distance, _)| distance.1 < limit)
        .map(|(distance, next)| next - distance.0)
        .sum()
}

fn stream() -> impl Strategy<Value = Vec<Sent>> {
    const PATHS: [&str; 7] = ["poses/a", "poses/b", "poses/c", "goals/a", "goals/b", "goals/c", "tower"];
    prop::collection::vec((0i64..3, 0usize..7, -8i32..8), 0..40).prop_map(|steps| {
        let mut time = 0;
        let sent = steps.into_iter().map(|(pause, path, x)| {
            time += pause * 250;
            (time, PATHS[path], f64::from(x))
        });
        sent.collect()
    })
}

proptest! {
    #[test]
    fn moments_at_which_nothing_is_said_change_nothing(
        sent in stream(), moments in prop::collection::vec(0i64..10_000_000_000, 0..20), steps: bool,
    ) {
        let of_tower = || vec![input(TOWER, &["at", "x"], Members::Min)];
        let of_each = || vec![input(POSES, &["at", "x"], Members::Each)];
        let MetricSource::Robustness { robustness } = always_above(of_tower(), 0.0) else { unreachable!("it is one") };
        let signals = vec![Expression::Negate(Box::new(age()))];
        let sources = [
            formula(of_tower(), Aggregate::Max { of: age() }),
            formula(of_each(), Aggregate::Min { of: age() }),
            formula(of_each(), Aggregate::Duration { of: older_than(1.5) }),
            formula(to_tower(), Aggregate::Duration { of: near(3.0) }),
            MetricSource::Robustness { robustness: Robustness { signals, ..robustness } },
        ];
        for source in sources {
            let alone = looked_at(source.clone(), steps, &sent, &[]);
            prop_assert_eq!(looked_at(source, steps, &sent, &moments), alone);
        }
    }

    #[test]
    fn members_and_pairs_are_as_if_each_had_been_looked_at_alone(sent in stream()) {
        let among = [("poses/a", "poses/b"), ("poses/a", "poses/c"), ("poses/b", "poses/c")];
        let own = [("poses/a", "goals/a"), ("poses/b", "goals/b"), ("poses/c", "goals/c")];
        let outside = [("poses/a", "tower"), ("poses/b", "tower"), ("poses/c", "tower")];
        for (inputs, belong) in [(pairs as fn() -> Vec<Input>, among), (to_goals, own), (to_tower, outside)] {
            let each: Vec<Vec<(i64, f64)>> =
                belong.iter().map(|(one, other)| distances(&sent, one, other)).filter(|of| !of.is_empty()).collect();
            let all = || each.iter().flatten().map(|distance| distance.1);
            let least = value(formula(inputs(), Aggregate::Min { of: apart() }), &sent);
            prop_assert_eq!(least, all().reduce(f64::min));
            let greatest = value(formula(inputs(), Aggregate::Max { of: apart() }), &sent);
            prop_assert_eq!(greatest, all().reduce(f64::max));
            let count = value(formula(inputs(), Aggregate::Count { of: near(3.0) }), &sent);
            let counted = all().filter(|&distance| distance < 3.0).count() as f64;
            prop_assert_eq!(count, (!each.is_empty()).then_some(counted));
            prop_assert_eq!(value(always_above(inputs(), 1.0), &sent), all().map(|distance| distance - 1.0).reduce(f64::min));
            let time = value(formula(inputs(), Aggregate::Duration { of: near(3.0) }), &sent);
            let nanos: i64 = each.iter().map(|of| held(of, 3.0)).sum();
            prop_assert_eq!(time, (!each.is_empty()).then_some(nanos as f64 / 1e3));
        }
    }
}
