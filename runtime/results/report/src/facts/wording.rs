//! Tests and values in words, as several facts have them.

use sesame_plan::{Bound, CampaignPlan, MetricId, Requirement};
use sesame_present::number;
use sesame_record::{Judge, MetricValue, TestRow, Verdict, not_imported};

/// Names of the requirements a test violates.
pub(crate) fn violated(plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow) -> Vec<String> {
    plan.requirements
        .iter()
        .filter(|requirement| judge.verdict(row, requirement) == Verdict::Violated)
        .map(|requirement| requirement.name.clone())
        .collect()
}

/// A test's operations with their counts, in the space's order, and those that had no effect after the others, as in
/// `jitter_link0 ×2, lose_link0 (no effect)`. Those that could not be imported are counted behind them.
pub(crate) fn operations(plan: &CampaignPlan, row: &TestRow) -> String {
    let of = |idle: bool| {
        plan.operations.iter().enumerate().filter_map(move |(id, operation)| {
            let used = row.test.operations.iter().enumerate().filter(|(_, used)| used.operation.index() == id);
            let used = used.filter(|(at, _)| row.idle.get(*at).copied().unwrap_or(false) == idle);
            let times = used.count();
            (times > 0)
                .then(|| format!("{}{}", repeated(&operation.name, times), if idle { " (no effect)" } else { "" }))
        })
    };
    let named: Vec<String> = of(false).chain(of(true)).chain(not_imported(row.left_out)).collect();
    if named.is_empty() { "without disturbance".to_owned() } else { named.join(", ") }
}

/// Names in the order in which they first occur, with their counts, as in `jitter_link0 ×4`.
pub(crate) fn counted<'n>(names: impl IntoIterator<Item = &'n str>) -> Vec<String> {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for name in names {
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, times)) => *times += 1,
            None => counts.push((name, 1)),
        }
    }
    counts.into_iter().map(|(name, times)| repeated(name, times)).collect()
}

fn repeated(name: &str, times: usize) -> String {
    if times == 1 { name.to_owned() } else { format!("{name} ×{times}") }
}

/// A sentence about tests with operations that could not be imported.
pub(crate) fn tests_not_imported(rows: &[TestRow]) -> Option<String> {
    let tests = rows.iter().filter(|row| row.left_out > 0).count();
    let held = match tests {
        0 => return None,
        1 => "1 test held operations".to_owned(),
        tests => format!("{tests} tests held operations"),
    };
    Some(format!("{held} that were not imported: more was disturbed than is shown, and such a test has no point"))
}

/// A metric's value with its unit, next to bounds to which it is compared. The name of the constant that it is follows,
/// if there is one, and `(never set)` where it is the default.
pub(crate) fn value_text(shown: MetricValue, unit: Option<&str>, constant: Option<&str>, bounds: &[Bound]) -> String {
    let Some(value) = shown.value else { return "unmeasured".to_owned() };
    let named = constant.map(|constant| format!(" ({constant})")).unwrap_or_default();
    let unset = if shown.set { "" } else { " (never set)" };
    format!("{}{named}{unset}", number::beside(value, bounds, unit))
}

/// As [`value_text`], of a metric of a plan.
pub(crate) fn value_of(plan: &CampaignPlan, metric: MetricId, shown: MetricValue, bounds: &[Bound]) -> String {
    value_text(shown, plan.metric(metric).unit.as_deref(), constant_of(plan, metric, shown), bounds)
}

/// The name of the constant that a metric's value is, if there is one. A default was never observed, so it has none.
pub(crate) fn constant_of(plan: &CampaignPlan, metric: MetricId, shown: MetricValue) -> Option<&str> {
    shown.value.filter(|_| shown.set).and_then(|value| plan.constant_of(metric, value))
}

/// The bound of a requirement with its unit. The name of the constant that it is follows, if there is one.
pub(crate) fn bound_of(plan: &CampaignPlan, requirement: &Requirement) -> String {
    let text = number::bound(requirement.bound, plan.metric(requirement.metric).unit.as_deref());
    let constant = requirement.bound.number().and_then(|number| plan.constant_of(requirement.metric, number));
    match constant {
        Some(constant) => format!("{text} ({constant})"),
        None => text,
    }
}

/// The bounds of a plan's requirements on a metric.
pub(crate) fn bounds_on(plan: &CampaignPlan, metric: MetricId) -> Vec<Bound> {
    let requirements = plan.requirements.iter().filter(|requirement| requirement.metric == metric);
    requirements.map(|requirement| requirement.bound).collect()
}

/// The word of an outcome as prose has it.
pub(crate) fn outcome_words(word: &str) -> String {
    word.replace('_', " ")
}
