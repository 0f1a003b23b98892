//! What a campaign found, at a glance.

use std::collections::BTreeSet;

use serde::Serialize;
use sesame_plan::{Bound, CampaignPlan, Confirmation, Copies, Direction, MetricId, Requirement};

use crate::observation::Outcome;
use crate::record::{EventKind, MetricValue, Origin, RecordError, Repository, TestRow, Verdict, verdict};
use crate::report::confirmed::{ConfirmedTest, confirmed_tests};
use crate::report::coverage::{CoverageSummary, coverage};
use crate::report::number;
use crate::report::repetition::{Repetition, repetition};
use crate::report::show::stacked_in;
use crate::report::shrinking::{Shrinking, shrinking};
use crate::report::stacked::Stacked;

/// What a campaign found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The space's name.
    pub space: String,
    /// The campaign's name.
    pub campaign: String,
    /// The one seed that decided everything.
    pub seed: u64,
    /// Why the run ended; `None` while it is unfinished.
    pub stop: Option<String>,
    /// How many tests there are of what kind.
    pub counts: Counts,
    /// What the search optimised, in the campaign's order.
    pub objectives: Vec<Objective>,
    /// The tests no other is better than: most dangerous first, see [`summary`].
    pub front: Vec<FrontTest>,
    /// How the campaign confirms the tests of its front, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirmation: Option<Confirmation>,
    /// Tests that were run again, by number.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub confirmed: Vec<ConfirmedTest>,
    /// All requirements of the space, in its order.
    pub requirements: Vec<RequirementSummary>,
    /// Expectations of known tests, in the order of the tests.
    pub expectations: Vec<ExpectationSummary>,
    /// Crashes and timeouts, by test.
    pub failures: Vec<Failure>,
    /// Tests in which a metric read a number that was not finite, by test.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_finite: Vec<NotFinite>,
    /// What repeating says, where the campaign repeats one test.
    pub repetition: Option<Repetition>,
    /// How a test was made smaller, where the campaign does that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shrinking: Option<Shrinking>,
    /// How far each metric went, in the plan's order; what a campaign without objectives is about.
    pub spreads: Vec<Spread>,
    /// How much of the space was looked at, where the campaign counts it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageSummary>,
    /// What should be brought to the user's attention.
    pub warnings: Vec<String>,
}

/// How many tests there are of what kind. The reference run is no part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    /// Tests that ended, those the search asked for and known ones.
    pub evaluations: usize,
    /// Of these, exact duplicates, which were not simulated again.
    pub duplicates: usize,
    /// Of these, those in which no operation had any effect.
    pub void: usize,
    /// Of these, completed ones in which an objective or requirement has neither value nor default.
    pub unmeasured: usize,
    /// Of these, crashes.
    pub crashes: usize,
    /// Of these, timeouts.
    pub timeouts: usize,
}

/// What the search optimised.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Objective {
    /// The metric's name.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Which way it goes.
    pub direction: Option<Direction>,
    #[serde(skip)]
    pub(crate) id: MetricId,
}

/// A test on the front.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrontTest {
    /// Its name.
    pub test: String,
    /// Its number.
    pub number: u32,
    /// A value per objective: that by which it is on the front, of its repetitions where the campaign confirms.
    pub values: Vec<Option<f64>>,
    /// Its operations, as in `jitter_link0 ×2, lose_link0`.
    pub operations: String,
    /// The operations whose copies acted at the same time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stacked: Vec<Stacked>,
    /// Names of the requirements it violates.
    pub violates: Vec<String>,
}

/// What the campaign says about a requirement. Duplicates and the reference run are not counted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RequirementSummary {
    /// Its name.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// The metric it bounds.
    pub metric: String,
    /// The bound in words, as in `≤ 70 s`.
    pub bound: String,
    /// Tests that keep it.
    pub kept: usize,
    /// Tests that violate it.
    pub violated: usize,
    /// Tests that say nothing about it.
    pub unsaid: usize,
    /// What the undisturbed run says; `None` where there was none.
    pub reference: Option<Verdict>,
    /// The test farthest outside the bound; of equal ones the one with the smallest number.
    pub worst: Option<Worst>,
}

/// The worst violation of a requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// The test.
    pub test: String,
    /// The metric's value in it.
    pub value: f64,
    /// The value and its unit; says so where the metric was never set.
    pub text: String,
}

/// Whether a known test came out as expected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExpectationSummary {
    /// The test's name in the results.
    pub test: String,
    /// The known test's name in the space.
    pub known_test: String,
    /// The metric.
    pub metric: String,
    /// The bound in words, with all digits.
    pub bound: String,
    /// The metric's value.
    pub value: Option<f64>,
    /// Whether it came out.
    pub verdict: Verdict,
}

/// A run that broke off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// The test.
    pub test: String,
    /// `crash` or `timeout`.
    pub outcome: String,
    /// Simulation time at which it broke off, in seconds.
    pub at: f64,
    /// What is known of the cause.
    pub detail: String,
}

/// A run in which metrics read numbers that were not finite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotFinite {
    /// The test.
    pub test: String,
    /// Simulation time of the first such number, in seconds.
    pub at: f64,
    /// The metrics that read one.
    pub metrics: Vec<String>,
}

/// How far a metric went over all tests that have a value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// The metric.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Tests that have a value.
    pub count: usize,
    /// The smallest value.
    pub min: f64,
    /// The median; the mean of the two in the middle of an even number.
    pub median: f64,
    /// The largest value.
    pub max: f64,
}

/// What a campaign found, from its results.
///
/// The front is the final result set, or the latest one of an unfinished run. It is sorted by the first objective that
/// a requirement bounds (else the first objective), most dangerous first; equal tests by number.
pub fn summary(repository: &Repository) -> Result<Summary, RecordError> {
    let members = repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members);
    summarise(repository, &repository.tests()?, &members)
}

pub(crate) fn summarise(repository: &Repository, rows: &[TestRow], members: &[u32]) -> Result<Summary, RecordError> {
    let facts = repository.campaign();
    let plan = &facts.plan;
    let objectives: Vec<Objective> = plan
        .campaign
        .objectives
        .iter()
        .map(|&id| {
            let metric = plan.metric(id);
            Objective { metric: metric.name.clone(), unit: metric.unit.clone(), direction: metric.direction, id }
        })
        .collect();
    let warnings = repository.events()?.into_iter().filter(|event| event.kind == EventKind::Warning).map(|event| {
        match event.test {
            Some(test) => format!("T{test}: {}", event.text),
            None => event.text,
        }
    });
    let confirmed = confirmed_tests(repository, rows, members)?;
    Ok(Summary {
        space: plan.space.clone(),
        campaign: plan.campaign.name.clone(),
        seed: facts.seed,
        stop: facts.stop.clone(),
        counts: counts(plan, rows),
        front: front(repository, &objectives, rows, members, &confirmed)?,
        requirements: plan
            .requirements
            .iter()
            .map(|requirement| summarise_requirement(plan, requirement, rows))
            .collect(),
        expectations: expectations(plan, rows),
        repetition: repetition(plan, rows),
        shrinking: shrinking(repository, rows)?,
        failures: rows.iter().filter_map(failure).collect(),
        not_finite: rows.iter().filter_map(|row| not_finite(plan, row)).collect(),
        spreads: spreads(plan, rows),
        coverage: coverage(repository)?,
        warnings: warnings.collect(),
        confirmation: plan.campaign.confirm,
        confirmed,
        objectives,
    })
}

fn counts(plan: &CampaignPlan, rows: &[TestRow]) -> Counts {
    let needed: Vec<MetricId> =
        plan.campaign.objectives.iter().copied().chain(plan.requirements.iter().map(|r| r.metric)).collect();
    let mut counts = Counts::default();
    for row in rows.iter().filter(|row| row.origin != Origin::Reference) {
        counts.evaluations += 1;
        counts.duplicates += usize::from(row.duplicate_of.is_some());
        match row.outcome {
            Outcome::Completed | Outcome::Unknown => {
                counts.unmeasured += usize::from(needed.iter().any(|&id| row.value(id).value.is_none()));
            }
            Outcome::Void => counts.void += 1,
            Outcome::Crash { .. } => counts.crashes += 1,
            Outcome::Timeout { .. } => counts.timeouts += 1,
        }
    }
    counts
}

fn front(
    repository: &Repository,
    objectives: &[Objective],
    rows: &[TestRow],
    members: &[u32],
    confirmed: &[ConfirmedTest],
) -> Result<Vec<FrontTest>, RecordError> {
    let plan = repository.plan();
    let repeated = |number: u32| confirmed.iter().find(|test| test.number == number);
    let values = |row: &TestRow| -> Vec<Option<f64>> {
        match repeated(row.number).and_then(|test| test.values.as_ref()) {
            Some(values) => values.iter().copied().map(Some).collect(),
            None => objectives.iter().map(|objective| row.value(objective.id).value).collect(),
        }
    };
    let bounded =
        |objective: &&Objective| plan.requirements.iter().any(|requirement| requirement.metric == objective.id);
    let key = objectives.iter().position(|objective| bounded(&objective)).unwrap_or(0);
    let danger = |row: &TestRow| -> f64 {
        let value = values(row).get(key).copied().flatten().unwrap_or(f64::NAN);
        let minimise = objectives.get(key).is_some_and(|it| it.direction == Some(Direction::Minimise));
        if minimise { -value } else { value }
    };
    let members: BTreeSet<u32> = members.iter().copied().collect();
    let mut sorted: Vec<&TestRow> = rows.iter().filter(|row| members.contains(&row.number)).collect();
    sorted.sort_by(|a, b| danger(b).total_cmp(&danger(a)).then(a.number.cmp(&b.number)));
    let on_front = sorted.into_iter().map(|row| {
        Ok(FrontTest {
            test: format!("T{}", row.number),
            number: row.number,
            values: values(row),
            operations: operations(plan, row),
            stacked: stacked_of(repository, row)?,
            violates: violated(plan, row),
        })
    });
    on_front.collect()
}

/// The operations whose copies acted at the same time. A test is read whole only where there can be any.
fn stacked_of(repository: &Repository, row: &TestRow) -> Result<Vec<Stacked>, RecordError> {
    let plan = repository.plan();
    let apart = plan.campaign.copies != Copies::MayOverlap && row.origin == Origin::Search;
    let kinds: BTreeSet<_> = row.test.operations.iter().map(|used| used.operation).collect();
    if apart || kinds.len() == row.test.operations.len() {
        return Ok(Vec::new());
    }
    Ok(stacked_in(plan, &repository.test(row.number)?))
}

/// Names of the requirements a test violates.
pub(crate) fn violated(plan: &CampaignPlan, row: &TestRow) -> Vec<String> {
    plan.requirements
        .iter()
        .filter(|r| verdict(r.bound, &row.outcome, row.value(r.metric)) == Verdict::Violated)
        .map(|r| r.name.clone())
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
    if named.is_empty() { "undisturbed".to_owned() } else { named.join(", ") }
}

fn summarise_requirement(plan: &CampaignPlan, requirement: &Requirement, rows: &[TestRow]) -> RequirementSummary {
    let metric = plan.metric(requirement.metric);
    let unit = metric.unit.as_deref();
    let said = |row: &TestRow| verdict(requirement.bound, &row.outcome, row.value(requirement.metric));
    let counted = || rows.iter().filter(|row| row.origin != Origin::Reference && row.duplicate_of.is_none());
    let count = |verdict| counted().filter(|row| said(row) == verdict).count();
    let mut worst: Option<(f64, &TestRow)> = None;
    for row in counted().filter(|row| said(row) == Verdict::Violated) {
        let outside =
            row.value(requirement.metric).value.map_or(0.0, |value| distance_outside(requirement.bound, value));
        if worst.is_none_or(|(farthest, _)| outside > farthest) {
            worst = Some((outside, row));
        }
    }
    RequirementSummary {
        requirement: requirement.name.clone(),
        text: requirement.text.clone(),
        metric: metric.name.clone(),
        bound: number::bound(requirement.bound, unit),
        kept: count(Verdict::Kept),
        violated: count(Verdict::Violated),
        unsaid: count(Verdict::Unsaid),
        reference: rows.iter().find(|row| row.origin == Origin::Reference).map(said),
        worst: worst.and_then(|(_, row)| {
            let shown = row.value(requirement.metric);
            let value = shown.value?;
            Some(Worst { test: format!("T{}", row.number), value, text: value_text(shown, unit) })
        }),
    }
}

/// A metric's value with its unit; says so where it was never set.
pub(crate) fn value_text(shown: MetricValue, unit: Option<&str>) -> String {
    match shown.value {
        None => "unmeasured".to_owned(),
        Some(value) if shown.set => number::quantity(value, unit),
        Some(value) => format!("{} (never set)", number::quantity(value, unit)),
    }
}

/// How far a value lies outside a bound, in the metric's unit; zero inside and on its edge.
fn distance_outside(bound: Bound, value: f64) -> f64 {
    let (low, _, high, _) = crate::record::ends(bound);
    let below = low.map_or(0.0, |low| low - value);
    let above = high.map_or(0.0, |high| value - high);
    below.max(above).max(0.0)
}

fn expectations(plan: &CampaignPlan, rows: &[TestRow]) -> Vec<ExpectationSummary> {
    let mut found = Vec::new();
    for row in rows {
        let Origin::Known(id) = row.origin else { continue };
        let known = plan.test(id);
        for expectation in &known.expectations {
            let metric = plan.metric(expectation.metric);
            let shown = row.value(expectation.metric);
            found.push(ExpectationSummary {
                test: format!("T{}", row.number),
                known_test: known.name.clone(),
                metric: metric.name.clone(),
                bound: number::exact_bound(expectation.bound, metric.unit.as_deref()),
                value: shown.value,
                verdict: verdict(expectation.bound, &row.outcome, shown),
            });
        }
    }
    found
}

fn failure(row: &TestRow) -> Option<Failure> {
    let failed = matches!(row.outcome, Outcome::Crash { .. } | Outcome::Timeout { .. }) && row.duplicate_of.is_none();
    failed.then(|| Failure {
        test: format!("T{}", row.number),
        outcome: row.outcome.word().to_owned(),
        at: row.end,
        detail: row.outcome.detail().unwrap_or_default(),
    })
}

fn not_finite(plan: &CampaignPlan, row: &TestRow) -> Option<NotFinite> {
    let read = || row.values.iter().zip(&plan.metrics).filter(|(shown, _)| shown.not_finite.is_some());
    let at = read().filter_map(|(shown, _)| shown.not_finite).min_by(f64::total_cmp)?;
    let metrics = read().map(|(_, metric)| metric.name.clone()).collect();
    row.duplicate_of.is_none().then(|| NotFinite { test: format!("T{}", row.number), at, metrics })
}

fn spreads(plan: &CampaignPlan, rows: &[TestRow]) -> Vec<Spread> {
    (0u32..)
        .zip(&plan.metrics)
        .filter_map(|(id, metric)| {
            let mut values: Vec<f64> = rows
                .iter()
                .filter(|row| row.origin != Origin::Reference && row.duplicate_of.is_none())
                .filter_map(|row| row.value(MetricId(id)).value)
                .collect();
            values.sort_by(f64::total_cmp);
            let (min, max) = (*values.first()?, *values.last()?);
            let upper = values[values.len() / 2];
            let lower = values[(values.len() - 1) / 2];
            let median = f64::midpoint(lower, upper);
            Some(Spread {
                metric: metric.name.clone(),
                unit: metric.unit.clone(),
                count: values.len(),
                min,
                median,
                max,
            })
        })
        .collect()
}
