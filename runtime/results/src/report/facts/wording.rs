//! Tests and values in words, as several facts have them.

use sesame_plan::CampaignPlan;

use crate::present::number;
use crate::record::{Judge, MetricValue, TestRow, Verdict};

/// Names of the requirements a test violates.
pub(crate) fn violated(plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow) -> Vec<String> {
    plan.requirements
        .iter()
        .filter(|requirement| judge.verdict(row, requirement) == Verdict::Violated)
        .map(|requirement| requirement.name.clone())
        .collect()
}

/// A test's operations with their counts, in the space's order, as in `jitter_link0 ×2, lose_link0`.
pub(crate) fn operations(plan: &CampaignPlan, row: &TestRow) -> String {
    let named: Vec<String> = plan
        .operations
        .iter()
        .enumerate()
        .filter_map(|(id, operation)| {
            match row.test.operations.iter().filter(|used| used.operation.index() == id).count() {
                0 => None,
                1 => Some(operation.name.clone()),
                n => Some(format!("{} ×{n}", operation.name)),
            }
        })
        .collect();
    if named.is_empty() { "without disturbance".to_owned() } else { named.join(", ") }
}

/// A metric's value with its unit; `(never set)` follows where it is the default.
pub(crate) fn value_text(shown: MetricValue, unit: Option<&str>) -> String {
    match shown.value {
        None => "unmeasured".to_owned(),
        Some(value) if shown.set => number::quantity(value, unit),
        Some(value) => format!("{} (never set)", number::quantity(value, unit)),
    }
}

/// The word of an outcome as prose has it.
pub(crate) fn outcome_words(word: &str) -> String {
    word.replace('_', " ")
}
