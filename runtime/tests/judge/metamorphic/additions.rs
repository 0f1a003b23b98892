//! What nothing reads changes nothing: neither what is published and delivered, nor what is said of it.

use sesame_base::observation::MetricObservation;
use sesame_plan::{Aggregate, Metric, MetricSource};

use super::{compare_ends, compare_metrics};
use crate::adapter::{self, said};
use crate::case::{Added, Case};
use crate::ledger::Message;
use crate::properties::all_hold;
use crate::words;

/// What is different about a run for topics, metrics and messages that nothing reads.
fn differences(case: &Case) -> Vec<String> {
    compared(case, Added::Metrics)
}

/// What is different about a run for all that, monitors, and operations.
fn differences_with_all(case: &Case) -> Vec<String> {
    compared(case, Added::All)
}

fn compared(case: &Case, added: Added) -> Vec<String> {
    let wider = case.with_unread(added);
    let (narrow, told) = adapter::run(&case.plan, &case.test, &case.script);
    let (wide, told_wide) = adapter::run(&wider.case.plan, &wider.case.test, &wider.case.script);
    let mut wrong = Vec::new();
    // Another operation may have an effect.
    compare_ends(&narrow, &wide, added == Added::All, &mut wrong);
    for (at, before) in narrow.operations.iter().enumerate() {
        let now = &wide.operations[wider.used[at]];
        if before != now {
            wrong.push(format!("an operation: {before:?}, now {now:?}"));
        }
    }
    for (at, before) in narrow.metrics.iter().enumerate() {
        let (metric, now) = (&case.plan.metrics[at], &wide.metrics[wider.metrics[at]]);
        compare_metrics(metric, before, &without_marks(metric, before, now), &mut wrong);
    }
    for (requirement, now) in case.plan.requirements.iter().zip(&wider.case.plan.requirements) {
        let (before, now) = (said(requirement, &narrow), said(now, &wide));
        if before != now {
            wrong.push(format!("it said {before:?} of {}, now {now:?}", requirement.name));
        }
    }
    let own = |messages: &[Message]| -> Vec<Message> {
        messages.iter().filter(|message| !message.path.starts_with("unread/")).cloned().collect()
    };
    let alike = |a: &[Message], b: &[Message]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is(b));
    if !alike(&told.published, &own(&told_wide.published)) {
        wrong.push("what is published".to_owned());
    }
    if !alike(&told.delivered, &own(&told_wide.delivered)) {
        wrong.push("what is delivered".to_owned());
    }
    if !wrong.is_empty() {
        wrong.push(format!("wider:\n{}", words::case(&wider.case)));
    }
    wrong
}

/// What was recorded of a metric, without moments at which a duration that grows reached a number: they are recorded
/// for whoever compares it with that number, which an operation that is added may do.
fn without_marks(metric: &Metric, before: &MetricObservation, now: &MetricObservation) -> MetricObservation {
    let mut now = now.clone();
    if let MetricSource::Formula { formula } = &metric.source
        && matches!(formula.aggregate, Aggregate::Duration { .. })
    {
        now.series.retain(|point| before.series.contains(point));
    }
    now
}

#[test]
fn what_nothing_reads_changes_nothing() {
    all_hold(0..400, differences);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn what_nothing_reads_changes_nothing_in_many_cases() {
    all_hold(2_000..102_000, differences);
}

#[test]
fn monitors_and_operations_that_nothing_reads_change_nothing() {
    all_hold(0..300, differences_with_all);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn monitors_and_operations_that_nothing_reads_change_nothing_in_many_cases() {
    all_hold(2_000..102_000, differences_with_all);
}

/// What is different about the recorded results of a run once all that nothing read is taken out of them.
fn recorded_differences(case: &Case) -> Vec<String> {
    let wider = case.with_unread(Added::Metrics);
    let (narrow, _) = adapter::run(&case.plan, &case.test, &case.script);
    let (wide, told) = adapter::run(&wider.case.plan, &wider.case.test, &wider.case.script);
    let folder = tempfile::tempdir().unwrap();
    let [before, now] = ["narrow", "wide"].map(|name| folder.path().join(name));
    adapter::record(&before, &case.plan, &case.test, &narrow);
    adapter::record(&now, &wider.case.plan, &wider.case.test, &wide);
    let unread = told.published.iter().filter(|message| message.path.starts_with("unread/")).count();
    adapter::leave_out_additions(&now, &before, &wider.metrics, unread);
    let (before, now) = (adapter::digest(&before), adapter::digest(&now));
    if before == now { Vec::new() } else { vec![format!("the digest was {before}, now it is {now}")] }
}

#[test]
fn what_nothing_reads_changes_no_digest_of_the_rest() {
    all_hold(0..100, recorded_differences);
}

#[test]
#[ignore = "long: 5,000 random spaces, each run twice and recorded"]
fn what_nothing_reads_changes_no_digest_of_the_rest_in_many_cases() {
    all_hold(2_000..7_000, recorded_differences);
}
