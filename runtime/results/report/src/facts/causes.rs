//! The causes of violations: in how many ways the system becomes dangerous, and the smallest test of each.

use serde::Serialize;

use sesame_analysis::causes::{Cause, Causes, Fewer, Unseen, causes_in};
use sesame_analysis::confirmed::FindingAgain;
use sesame_base::test_number::TestNumber;
use sesame_plan::{Bound, CampaignPlan, Task};
use sesame_record::{Judge, RecordError, Repository, TestRow, verdict};

use crate::facts::show::{OperationReport, acting};
use crate::facts::wording;

/// What the tests of a campaign say about causes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CausesSummary {
    /// The causes, by requirement; of each requirement those with few operations first.
    pub causes: Vec<CauseSummary>,
    /// What can be said of causes that were not found; `None` before any was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unseen: Option<Unseen>,
}

/// A requirement with a smallest set of operations that violates it, as far as tests were run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseSummary {
    /// The requirement's name.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// The names of the operations, in the order of the space.
    pub operations: Vec<String>,
    /// The smallest test that violates the requirement with these operations alone.
    pub test: TestNumber,
    /// Its operations, without those that had no effect.
    pub acting: Vec<OperationReport>,
    /// The metric that the requirement bounds.
    pub metric: String,
    /// Its value in that test, in words.
    pub value: String,
    /// How far that value lies outside the bound, in the metric's unit.
    #[serde(skip)]
    pub(crate) outside: f64,
    /// The bound in words.
    pub bound: String,
    /// The first test that violates the requirement and holds these operations.
    pub first: TestNumber,
    /// How many tests that hold these operations violate the requirement.
    pub violating: usize,
    /// How many conclusive tests hold these operations.
    pub held: usize,
    /// Whether fewer of the operations would do.
    pub fewer: Fewer,
    /// How often fresh runs of the smallest test show it, if it was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub again: Option<FindingAgain>,
}

impl CauseSummary {
    /// The operations as a name: `lag_link1 + drop_link0`.
    pub(crate) fn name(&self) -> String {
        self.operations.join(" + ")
    }
}

impl CausesSummary {
    /// The cause whose smallest test lies farthest outside the bound, of those of the first requirement that has any:
    /// metrics of others have other units. Among equals, the first one.
    pub(crate) fn worst(&self) -> Option<&CauseSummary> {
        let first = self.causes.first()?;
        let of_first = self.causes.iter().filter(|cause| cause.requirement == first.requirement);
        of_first.reduce(|worst, cause| if cause.outside > worst.outside { cause } else { worst })
    }
}

/// The causes in the tests of a campaign if it searches. Other campaigns run variations of one test, so `None`.
pub(crate) fn causes_of_search(
    repository: &Repository,
    judge: &Judge<'_>,
    rows: &[TestRow],
) -> Result<Option<CausesSummary>, RecordError> {
    let searches =
        matches!(repository.task(), Task::Campaign) && repository.plan().campaign.search.strategy().is_some();
    if !searches || repository.plan().requirements.is_empty() {
        return Ok(None);
    }
    causes_summary(repository, judge, rows).map(Some)
}

/// The causes in the tests of any results.
pub fn causes(repository: &Repository) -> Result<CausesSummary, RecordError> {
    causes_summary(repository, &repository.judge()?, &repository.tests()?)
}

fn causes_summary(repository: &Repository, judge: &Judge<'_>, rows: &[TestRow]) -> Result<CausesSummary, RecordError> {
    let plan = repository.plan();
    let rows: Vec<&TestRow> = rows.iter().collect();
    let Causes { found, unseen } = causes_in(plan, judge, &rows);
    let causes = found.iter().map(|cause| summarise(repository, judge, plan, cause)).collect::<Result<_, _>>()?;
    Ok(CausesSummary { causes, unseen })
}

fn summarise(
    repository: &Repository,
    judge: &Judge<'_>,
    plan: &CampaignPlan,
    cause: &Cause,
) -> Result<CauseSummary, RecordError> {
    let requirement = plan.requirement(cause.requirement);
    let metric = plan.metric(requirement.metric);
    let record = repository.test(cause.smallest)?;
    let shown = record.observation.value(requirement.metric);
    let value = wording::value_of(plan, requirement.metric, shown, &[requirement.bound]);
    let first = verdict(requirement.bound, &record.observation.outcome, shown);
    let was_run_again = !judge.runs(cause.smallest).is_empty();
    let again = FindingAgain::of(&requirement.name, judge.tally(cause.smallest, requirement), first);
    Ok(CauseSummary {
        requirement: requirement.name.clone(),
        text: requirement.text.clone(),
        operations: cause.operations.iter().map(|act| act.name(plan)).collect(),
        test: TestNumber(cause.smallest),
        acting: acting(plan, &record),
        metric: metric.name.clone(),
        value,
        outside: shown.value.map_or(0.0, |value| distance_outside(requirement.bound, value)),
        bound: wording::bound_of(plan, requirement),
        first: TestNumber(cause.violating.first().copied().unwrap_or(cause.smallest)),
        violating: cause.violating.len(),
        held: cause.held as usize,
        fewer: cause.fewer,
        again: again.filter(|_| was_run_again),
    })
}

/// How far a value lies outside a bound, in the metric's unit; zero inside and on its edge.
pub(crate) fn distance_outside(bound: Bound, value: f64) -> f64 {
    let (low, _, high, _) = sesame_base::verdict::ends(bound);
    let below = low.map_or(0.0, |low| low - value);
    let above = high.map_or(0.0, |high| value - high);
    below.max(above).max(0.0)
}
