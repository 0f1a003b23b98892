//! Members of a group that all say the same: what is counted or added up over each of them is as many times as much,
//! and everything else is what it is for one of them.

use sesame_base::observation::MetricObservation;
use sesame_plan::{Aggregate, Input, Members, Metric, MetricSource, TopicId};
use sesame_rng::Stream;

use super::{compare_activity, compare_ends, is_condition_on, is_treated_alike};
use crate::adapter;
use crate::case::{Case, topics_of};
use crate::hooks::HookKind;
use crate::properties::all_hold;
use crate::words;

/// A case in which one topic has become a group.
struct Multiplied {
    case: Case,
    topic: TopicId,
    members: usize,
}

/// The topic that is multiplied: one with a single member that does not move the robot, on which operations treat equal
/// messages alike, and on which no condition depends.
fn multiplied(case: &Case) -> Option<Multiplied> {
    let fits = |&topic: &TopicId| {
        let paths = &case.plan.topic(topic).paths;
        let line = case.script.lines.iter().find(|line| line.path == paths[0]);
        paths.len() == 1
            && line.is_some_and(|line| !line.moves)
            && is_treated_alike(case, topic)
            && !is_condition_on(case, |metric| topics_of(case.plan.metric(metric)).contains(&topic))
            && case.plan.metrics.iter().any(|metric| topics_of(metric).contains(&topic))
    };
    let topics: Vec<TopicId> = (0..).map(TopicId).take(case.plan.topics.len()).filter(fits).collect();
    if topics.is_empty() {
        return None;
    }
    let mut stream = Stream::derive(case.number, "copies", &[]);
    let topic = topics[stream.below(topics.len())];
    let members = 2 + stream.below(3);
    let mut case = case.clone();
    let path = case.plan.topics[topic.index()].paths[0].clone();
    let paths: Vec<String> = (0..members).map(|member| format!("{path}/copy{member}")).collect();
    case.plan.topics[topic.index()].paths.clone_from(&paths);
    let at = case.script.lines.iter().position(|line| line.path == path).expect("the topic fits");
    let line = case.script.lines.remove(at);
    for path in paths.into_iter().rev() {
        case.script.lines.insert(at, crate::robot::Line { path, ..line.clone() });
    }
    multiply_blanks(&mut case, at, members);
    for metric in &mut case.plan.metrics {
        let inputs: &mut [Input] = match &mut metric.source {
            MetricSource::Formula { formula } => &mut formula.inputs,
            MetricSource::Robustness { robustness } => &mut robustness.inputs,
            _ => &mut [],
        };
        for input in inputs.iter_mut().filter(|input| input.field.topic == topic) {
            input.members = Members::Each;
        }
    }
    Some(Multiplied { case, topic, members })
}

/// Every copy has the blanks of the one line that it is a copy of, and those of other lines stay where they are.
fn multiply_blanks(case: &mut Case, at: usize, members: usize) {
    let blanks = std::mem::take(&mut case.script.blanks);
    for blank in blanks {
        let lines = match blank.line {
            line if line < at => line..line + 1,
            line if line == at => at..at + members,
            line => line + members - 1..line + members,
        };
        case.script.blanks.extend(lines.map(|line| crate::robot::Blank { line, ..blank.clone() }));
    }
}

/// How many times as much a metric is; `None` if that is not known.
fn times(metric: &Metric, topic: TopicId, members: usize) -> Option<f64> {
    let many = members as f64;
    if !topics_of(metric).contains(&topic) {
        return Some(1.0);
    }
    match &metric.source {
        MetricSource::Hook { .. } => Some(if HookKind::named(&metric.name) == HookKind::Counting { many } else { 1.0 }),
        MetricSource::Formula { formula } => {
            // A formula of each member of another group, or of its pairs, is a formula of both.
            let of_members = |input: &Input| !matches!(input.members, Members::Min | Members::Max | Members::Sum);
            if formula.inputs.iter().any(|input| input.field.topic != topic && of_members(input)) {
                return None;
            }
            let adds_up = matches!(formula.aggregate, Aggregate::Count { .. } | Aggregate::Duration { .. });
            Some(if adds_up { many } else { 1.0 })
        }
        MetricSource::Robustness { robustness } => {
            let single = |input: &Input| matches!(input.members, Members::Min | Members::Max | Members::Sum);
            robustness.inputs.iter().all(|input| input.field.topic == topic || single(input)).then_some(1.0)
        }
        MetricSource::Last { .. } | MetricSource::FuzzingTime | MetricSource::Monitor { .. } => Some(1.0),
    }
}

fn differences(case: &Case) -> Vec<String> {
    let Some(Multiplied { case: other, topic, members }) = multiplied(case) else { return Vec::new() };
    // A crash after some messages of a step would be after other ones.
    let script = crate::robot::Script { crash: None, ..case.script.clone() };
    let other_script = crate::robot::Script { crash: None, ..other.script.clone() };
    let mut plan = other.plan.clone();
    // Formulas of groups with other members have no value that could be compared, and the runtime refuses them.
    let known: Vec<Option<f64>> = case.plan.metrics.iter().map(|metric| times(metric, topic, members)).collect();
    for (metric, times) in plan.metrics.iter_mut().zip(&known) {
        if times.is_none() {
            metric.source = MetricSource::FuzzingTime;
        }
    }
    let (before, _) = adapter::run(&case.plan, &case.test, &script);
    let (now, _) = adapter::run(&plan, &case.test, &other_script);
    let mut wrong = Vec::new();
    // What is left out may have been all that heard what an operation did.
    compare_ends(&before, &now, true, &mut wrong);
    for ((used, before), now) in case.test.operations.iter().zip(&before.operations).zip(&now.operations) {
        compare_activity(&case.plan.operation(used.operation).name, before, now, &mut wrong);
    }
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        let Some(times) = known[at] else { continue };
        let (before, now) = (&before.metrics[at], &now.metrics[at]);
        // A default is no sum.
        let times = if before.set { times } else { 1.0 };
        if !is_times(before, now, times) {
            wrong.push(format!("metric {}: {before:?}, of {members} copies {now:?}", words::metric(metric)));
        }
    }
    wrong
}

/// Whether a metric has so many times the value, up to rounding.
fn is_times(before: &MetricObservation, now: &MetricObservation, times: f64) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(1.0);
    let value = match (before.value, now.value) {
        (Some(before), Some(now)) => near(before * times, now),
        (None, None) => true,
        _ => false,
    };
    value && before.set == now.set && before.not_finite == now.not_finite
}

#[test]
fn each_of_n_equal_members_counts_n_times_and_has_the_minimum_of_one() {
    all_hold(0..600, differences);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn each_of_n_equal_members_counts_n_times_and_has_the_minimum_of_one_in_many_cases() {
    all_hold(2_000..102_000, differences);
}

/// Otherwise the property would hold of nothing.
#[test]
fn many_cases_have_a_topic_that_can_be_multiplied() {
    let cases = (0..200).map(Case::of).filter(|case| multiplied(case).is_some()).count();
    assert!(cases > 50, "{cases}");
}
