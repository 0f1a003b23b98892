//! A message that is published as two of the same value at one instant changes nothing but counts.

use sesame_base::observation::Observation;
use sesame_base::time::SimTime;
use sesame_plan::{Activation, Metric, TopicId};
use sesame_rng::Stream;

use super::{compare_activity, compare_ends, compare_metrics, counts_messages, is_condition_on, is_treated_alike};
use crate::adapter::{self, said};
use crate::case::{Case, topics_of};
use crate::formulas::hears_deliveries;
use crate::ledger::Ledger;
use crate::properties::all_hold;

/// The lines of a robot whose messages can be published twice: what it hears there does not move it, and no operation
/// tells equal messages apart.
fn doubled(case: &Case) -> Vec<usize> {
    let mut stream = Stream::derive(case.number, "split", &[]);
    let topic_of = |path: &String| case.plan.topics.iter().position(|topic| topic.paths.contains(path));
    let mut lines: Vec<usize> = Vec::new();
    for (at, line) in case.script.lines.iter().enumerate() {
        let alike = topic_of(&line.path).is_none_or(|topic| is_treated_alike(case, topic_id(topic)));
        if alike && !line.moves && stream.chance(0.6) {
            lines.push(at);
        }
    }
    lines
}

fn topic_id(position: usize) -> TopicId {
    TopicId(u32::try_from(position).unwrap())
}

/// The topics among these on which an operation is switched by a condition at an instant in which they have messages:
/// the first of two equal ones may be what switches it, and then only the second is disturbed.
fn switched_between(case: &Case, topics: &[TopicId], observed: &Observation, told: &Ledger) -> Vec<TopicId> {
    let mut switched = Vec::new();
    for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
        let Some(topic) = case.plan.operation(used.operation).topic.filter(|topic| topics.contains(topic)) else {
            continue;
        };
        let own = &case.plan.topic(topic).paths;
        let at = |time: f64| {
            let time = SimTime::from_seconds(time).nanos();
            told.published.iter().any(|message| message.time == time && own.contains(&message.path))
        };
        if !matches!(used.activation, Activation::Time { .. })
            && effect.intervals.iter().any(|interval| at(interval.start) || at(interval.end))
        {
            switched.push(topic);
        }
    }
    switched
}

fn differences(case: &Case) -> Vec<String> {
    let lines = doubled(case);
    let paths: Vec<&String> = lines.iter().map(|&line| &case.script.lines[line].path).collect();
    let is_doubled = |topic: &&TopicId| case.plan.topic(**topic).paths.iter().any(|path| paths.contains(&path));
    let all: Vec<TopicId> = (0..case.plan.topics.len()).map(topic_id).collect();
    let topics: Vec<TopicId> = all.iter().filter(is_doubled).copied().collect();
    let mut twice = case.clone();
    twice.script.doubled = lines;
    let (before, _) = adapter::run(&case.plan, &case.test, &case.script);
    let (now, told) = adapter::run(&twice.plan, &twice.test, &twice.script);
    let switched = switched_between(case, &topics, &now, &told);
    let differs = |metric: &Metric| {
        counts_messages(case, metric, &topics)
            || hears_deliveries(metric) && topics_of(metric).iter().any(|topic| switched.contains(topic))
    };
    if is_condition_on(case, |metric| differs(case.plan.metric(metric))) {
        return Vec::new();
    }
    let mut wrong = Vec::new();
    compare_ends(&before, &now, false, &mut wrong);
    for ((used, before), now) in case.test.operations.iter().zip(&before.operations).zip(&now.operations) {
        let operation = case.plan.operation(used.operation);
        compare_activity(&operation.name, before, now, &mut wrong);
        if operation.topic.is_some_and(|topic| !topics.contains(&topic)) && before != now {
            wrong.push(format!("operation {}: {before:?}, now {now:?}", operation.name));
        }
    }
    for ((metric, before), now) in case.plan.metrics.iter().zip(&before.metrics).zip(&now.metrics) {
        if !differs(metric) {
            compare_metrics(metric, before, now, &mut wrong);
        }
    }
    for requirement in &case.plan.requirements {
        let (before, now) = (said(requirement, &before), said(requirement, &now));
        if before != now && !differs(case.plan.metric(requirement.metric)) {
            wrong.push(format!("it said {before:?} of {}, now {now:?}", requirement.name));
        }
    }
    if !wrong.is_empty() {
        wrong.push(format!("published twice: {paths:?}"));
    }
    wrong
}

#[test]
fn a_message_split_into_two_of_one_instant_changes_nothing_but_counts() {
    all_hold(0..400, differences);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn a_message_split_into_two_of_one_instant_changes_nothing_but_counts_in_many_cases() {
    all_hold(2_000..102_000, differences);
}

/// Otherwise the property would hold of nothing.
#[test]
fn most_cases_have_messages_that_can_be_split() {
    let cases = (0..200).map(Case::of).filter(|case| !doubled(case).is_empty()).count();
    assert!(cases > 100, "{cases}");
}
