//! What must not change what a run says: a case and another one that differs from it in a way that has no influence, or
//! a known one. Nothing is computed here, so these properties hold whatever the right values are.

mod additions;
mod copies;
mod order;
mod scenes;
mod split;

use sesame_base::observation::{MetricObservation, Observation, OperationEffect, Outcome};
use sesame_plan::{Activation, Aggregate, Metric, MetricId, MetricSource, OperationKind, TopicId};

use crate::case::{Case, topics_of, variables};
use crate::computations::When;
use crate::hooks::HookKind;
use crate::words;

/// Whether a run ended in the same way. Whether an operation had an effect may be of no interest.
fn same_outcome(a: &Outcome, b: &Outcome, whatever_effect: bool) -> bool {
    let word = |outcome: &Outcome| match outcome {
        Outcome::NoEffect if whatever_effect => Outcome::Completed.word(),
        outcome => outcome.word(),
    };
    word(a) == word(b)
}

/// Notes if two runs did not end in the same way.
fn compare_ends(before: &Observation, now: &Observation, whatever_effect: bool, wrong: &mut Vec<String>) {
    if !same_outcome(&before.outcome, &now.outcome, whatever_effect) {
        wrong.push(format!("it ended with {:?}, now {:?}", before.outcome, now.outcome));
    }
    if before.end != now.end {
        wrong.push(format!("it ended at {}, now at {}", before.end, now.end));
    }
}

/// Notes if two metrics are not the same, with all that was recorded of them.
fn compare_metrics(metric: &Metric, before: &MetricObservation, now: &MetricObservation, wrong: &mut Vec<String>) {
    if before != now {
        wrong.push(format!("metric {}: {before:?}, now {now:?}", words::metric(metric)));
    }
}

/// Notes if an operation was not active in the same intervals.
fn compare_activity(name: &str, before: &OperationEffect, now: &OperationEffect, wrong: &mut Vec<String>) {
    let active = |effect: &OperationEffect| (effect.intervals.clone(), effect.tails.clone());
    if active(before) != active(now) {
        wrong.push(format!("operation {name}: {before:?}, now {now:?}"));
    }
}

/// Whether what an operation makes of a message depends on the time and on earlier values of its wire alone, so that
/// two equal messages of one instant become two equal messages.
fn treats_equals_alike(kind: &OperationKind) -> bool {
    use OperationKind as Kind;
    match kind {
        Kind::Bias
        | Kind::Scale
        | Kind::StuckAt { .. }
        | Kind::Blackhole
        | Kind::Drift
        | Kind::Freeze
        | Kind::Stale
        | Kind::NotFinite { .. } => true,
        Kind::Latency { distribution, .. } => *distribution == sesame_plan::Distribution::Fixed,
        _ => false,
    }
}

/// Whether every operation of the test on a topic treats equal messages alike.
fn is_treated_alike(case: &Case, topic: TopicId) -> bool {
    let mut own = case.test.operations.iter().map(|used| case.plan.operation(used.operation));
    own.all(|operation| operation.topic != Some(topic) || treats_equals_alike(&operation.kind))
}

/// Whether a condition of the test reads a metric for which this holds.
fn is_condition_on(case: &Case, holds: impl Fn(MetricId) -> bool) -> bool {
    let activations = case.test.operations.iter().map(|used| &used.activation);
    activations.flat_map(|activation: &Activation| variables(activation)).any(holds)
}

/// Whether a metric counts the messages of these topics.
fn counts_messages(case: &Case, metric: &Metric, topics: &[TopicId]) -> bool {
    if !topics_of(metric).iter().any(|topic| topics.contains(topic)) {
        return false;
    }
    match &metric.source {
        MetricSource::Hook { .. } => HookKind::named(&metric.name) == HookKind::Counting,
        MetricSource::Formula { formula } => {
            let counts = matches!(formula.aggregate, Aggregate::Count { .. } | Aggregate::Mean { .. });
            counts && formula.every.is_none() && When::of(&case.plan, formula) == When::Message
        }
        _ => false,
    }
}
