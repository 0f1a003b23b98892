//! The results of a campaign at a glance.

use std::collections::BTreeSet;

use serde::Serialize;

use sesame_analysis::confirmed::{
    ConfirmedTest, FAILURES, FindingAgain, OF_ENVIRONMENT, confirmed_tests, failed, failed_again,
};
use sesame_analysis::statistics::Sample;
use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Confirmation, Copies, Direction, MetricId, Requirement, Task};
use sesame_present::number;
use sesame_record::{
    Event, EventKind, Judge, MetricValue, NOT_IMPORTED, Origin, RecordError, Repository, Standing, TestRow, Verdict,
    is_quarantined, verdict,
};

use crate::facts::causes::{CauseSummary, CausesSummary, causes_of_search, distance_outside};
use crate::facts::certificate::before_after::Mend;
use crate::facts::certificate::campaign::{MonitorsSummary, monitors_summary};
use crate::facts::coverage::{CoverageSummary, coverage};
use crate::facts::pairs::{PairsSummary, pairs_of_search};
use crate::facts::readable;
use crate::facts::repetition::{Repetition, repetition};
use crate::facts::show::{OperationReport, acting};
use crate::facts::shrinking::{Shrinking, shrinkings};
use crate::facts::stacked::{Stacked, stacked_in};
use crate::facts::violated::violated_requirement;
use crate::facts::wording::{bound_of, operations, tests_not_imported, value_of, violated};

/// How the warning begins that the reference run after a campaign is not like the one before it.
pub const CLOSING_RUN_DIFFERS: &str = "the reference run after the campaign differs from the one before it:";

/// An operation that was used less often may have had no effect by chance.
const FEWEST_USES: usize = 5;

/// What a campaign found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The space's name.
    pub space: String,
    /// The campaign's name.
    pub campaign: String,
    /// The one seed that determined everything.
    pub seed: u64,
    /// Why the run ended; `None` while it is unfinished.
    pub stop: Option<String>,
    /// How many tests there are of each kind.
    pub counts: Counts,
    /// What the search optimised, in the campaign's order.
    pub objectives: Vec<Objective>,
    /// The tests that no other test dominates, most dangerous first.
    pub front: Vec<FrontTest>,
    /// How the campaign confirms the tests of its front, if it does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub confirmation: Option<Confirmation>,
    /// Tests that were run again, by number.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub confirmed: Vec<ConfirmedTest>,
    /// Tests that violate a requirement and were run only once.
    pub once: usize,
    /// All requirements of the space, in its order.
    pub requirements: Vec<RequirementSummary>,
    /// The causes of violations, if the campaign searches and the space has requirements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub causes: Option<CausesSummary>,
    /// How well the monitors of the space did, if it has any and their decisions were recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monitors: Option<MonitorsSummary>,
    /// How the monitors did in the same tests before, if these results are compared with others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mend: Option<Mend>,
    /// Expectations of regression tests, in the order of the tests.
    pub expectations: Vec<ExpectationSummary>,
    /// Crashes and timeouts, and runs that the environment broke off, by test: those of its first run, and those that
    /// only fresh runs showed.
    pub failures: Vec<Failure>,
    /// Tests that crashed in each of their first three runs and are not run again, by test.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub quarantined: Vec<Quarantined>,
    /// Tests in which a metric read a number that was not finite, by test.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_finite: Vec<NotFinite>,
    /// Operations that had no effect in any of their uses, of which there were at least five, in the order of the
    /// space.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub without_effect: Vec<WithoutEffect>,
    /// How the reference run after the campaign differs from the one before it, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closing_run: Option<String>,
    /// How often requirements were violated, if the campaign repeats one test.
    pub repetition: Option<Repetition>,
    /// How a test was shrunk, if the campaign does that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shrinking: Option<Shrinking>,
    /// How the smallest test of each cause was shrunk, if the campaign does that.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub shrinkings: Vec<Shrinking>,
    /// The values of each metric, in the plan's order; the main result of a campaign without objectives.
    pub spreads: Vec<Spread>,
    /// How much of the space is covered, if the campaign counts coverage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageSummary>,
    /// Which operations acted together, if the campaign searches and its tests may hold two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<PairsSummary>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Whether all runs are without disturbance by design.
    #[serde(skip)]
    pub(crate) undisturbed: bool,
}

impl Summary {
    /// The requirements that have causes, and the names of these.
    pub(crate) fn violated_by_causes(&self) -> impl Iterator<Item = (&RequirementSummary, Vec<String>)> {
        let with_causes = self.requirements.iter().map(|requirement| (requirement, self.causes_of(requirement)));
        with_causes.filter(|(_, causes)| !causes.is_empty())
    }

    /// The names of the causes of a requirement.
    fn causes_of(&self, requirement: &RequirementSummary) -> Vec<String> {
        let causes = self.causes.iter().flat_map(|found| &found.causes);
        causes.filter(|cause| cause.requirement == requirement.requirement).map(CauseSummary::name).collect()
    }

    /// How tests were shrunk, one or several.
    pub(crate) fn shrunk(&self) -> impl Iterator<Item = &Shrinking> {
        self.shrinking.iter().chain(&self.shrinkings)
    }
}

/// How many tests there are of each kind. Reference runs are not counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    /// Tests that ended: those of the search, and regression tests.
    pub evaluations: usize,
    /// How many of these are exact duplicates, which were not simulated again.
    pub duplicates: usize,
    /// In how many of these no operation had any effect.
    pub no_effect: usize,
    /// How many of these completed, but lack a value and a default of an objective or requirement.
    pub unmeasured: usize,
    /// How many of these crashed.
    pub crashes: usize,
    /// How many of these timed out.
    pub timeouts: usize,
    /// How many of these the environment broke off each time they were run: failed launches, disconnects, wrong clocks.
    /// They show nothing about the system.
    #[serde(skip_serializing_if = "number::is_zero")]
    pub environment: usize,
}

/// What the search optimised.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Objective {
    /// The metric's name.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Which way it goes.
    pub direction: Direction,
    #[serde(skip)]
    pub(crate) id: MetricId,
}

/// A test on the front.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrontTest {
    /// Its name.
    pub test: TestNumber,
    /// Its number.
    pub number: u32,
    /// The value of each objective by which it is on the front: that of its repetitions if the campaign confirms.
    pub values: Vec<Option<f64>>,
    /// Its operations, as in `jitter_link0 ×2, lose_link0 (no effect)`.
    pub operations: String,
    /// The operations whose copies acted at the same time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stacked: Vec<Stacked>,
    /// Names of the requirements it violates.
    pub violates: Vec<String>,
}

/// The verdicts of a campaign's tests on a requirement. Duplicates and reference runs are not counted. The verdict of a
/// test that was run again is that of its fresh runs, see [`Tally::verdict`](sesame_record::Tally::verdict).
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
    /// Tests that satisfy it.
    pub satisfied: usize,
    /// Tests that violate it: those whose violation is confirmed or flaky, and those that were run only once.
    pub violated: usize,
    /// How many of these violate it in every conclusive fresh run.
    pub confirmed: usize,
    /// How many of these violate it in some fresh runs and not in others.
    pub flaky: usize,
    /// How many of these have no conclusive fresh run; most were run only once.
    pub once: usize,
    /// How many of these did not violate it in their first run.
    pub fresh_only: usize,
    /// Tests whose first run violates it, and no fresh one does. They do not count as violated.
    pub not_confirmed: usize,
    /// Tests that are inconclusive about it.
    pub inconclusive: usize,
    /// The verdict of the reference run; `None` without one.
    pub reference: Option<Verdict>,
    /// The test farthest outside the bound; among equals, the one with the smallest number.
    pub worst: Option<Worst>,
    /// What the page says of it, if tests violate it: how many, its causes, and the worst of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sentence: Option<String>,
}

/// The worst violation of a requirement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    /// The test.
    pub test: TestNumber,
    /// The metric's value in it.
    pub value: f64,
    /// The value and its unit; `(never set)` follows where it is the default.
    pub text: String,
    /// Its operations, without those that had no effect.
    pub acting: Vec<OperationReport>,
}

/// Whether a metric of a regression test is as expected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExpectationSummary {
    /// The test's name in the results.
    pub test: TestNumber,
    /// The regression test's name in the space.
    pub known_test: String,
    /// The metric.
    pub metric: String,
    /// The bound in words, with all digits.
    pub bound: String,
    /// The metric's value.
    pub value: Option<f64>,
    /// Whether it is as expected.
    pub verdict: Verdict,
}

/// A run that broke off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Failure {
    /// The test.
    pub test: TestNumber,
    /// `crash` or `timeout`; if the environment broke it off, `launch_failed`, `disconnect` or `wrong_clock`.
    pub outcome: String,
    /// Simulation time at which it broke off, in seconds.
    pub at: f64,
    /// What is known of the cause.
    pub detail: String,
    /// How often fresh runs show it, if the test was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub again: Option<FindingAgain>,
}

impl Failure {
    /// Whether the environment broke it off: it is not a finding.
    pub fn is_of_environment(&self) -> bool {
        OF_ENVIRONMENT.contains(&self.outcome.as_str())
    }

    /// Whether it counts as a finding: it does not if fresh runs never show it.
    pub fn stands(&self) -> bool {
        self.again.as_ref().is_none_or(|again| again.standing != Some(Standing::NotConfirmed))
    }
}

/// A test that is not run again, because it keeps crashing its simulator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quarantined {
    /// The test.
    pub test: TestNumber,
    /// What is known of the crash of its first run.
    pub detail: String,
}

/// A run in which metrics read numbers that were not finite.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotFinite {
    /// The test.
    pub test: TestNumber,
    /// Simulation time of the first such number, in seconds.
    pub at: f64,
    /// The metrics that read one.
    pub metrics: Vec<String>,
}

/// An operation that did nothing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct WithoutEffect {
    /// The operation's name in the space.
    pub operation: String,
    /// How many tests that ran to their end used it.
    pub uses: usize,
}

/// The values of a metric over all tests that have one.
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
    /// The median; with an even number of values, the mean of the two in the middle.
    pub median: f64,
    /// The largest value.
    pub max: f64,
    /// The mean.
    pub mean: f64,
    /// The standard deviation of a sample (with `n − 1`); `None` if one test has a value.
    pub deviation: Option<f64>,
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
        .objectives()
        .map(|sesame_plan::Objective { metric: id, direction }| {
            let metric = plan.metric(id);
            Objective { metric: metric.name.clone(), unit: metric.unit.clone(), direction, id }
        })
        .collect();
    let events = repository.events()?;
    let closing_run = events.iter().find(|event| event.text.starts_with(CLOSING_RUN_DIFFERS));
    let closing_run = closing_run.map(|event| readable::sentence(plan, &event.text));
    // A line for each such test would hide everything else: they are counted in one.
    let of_campaign = |event: &Event| {
        event.kind == EventKind::Warning && !(event.test.is_some() && event.text.starts_with(NOT_IMPORTED))
    };
    let warnings = events.into_iter().filter(of_campaign).map(|event| {
        let text = readable::sentence(plan, &event.text);
        match event.test {
            Some(test) => format!("{}: {text}", TestNumber(test)),
            None => text,
        }
    });
    let judge = repository.judge()?;
    let confirmed = confirmed_tests(plan, &judge, rows, members);
    let mut shrinkings = shrinkings(repository, rows)?;
    let shrinking = if matches!(repository.task(), Task::Shrink(_)) { shrinkings.pop() } else { None };
    let mut summary = Summary {
        space: plan.space.clone(),
        campaign: plan.campaign.name.clone(),
        seed: facts.seed,
        stop: facts.stop.clone(),
        counts: counts(plan, rows),
        front: front(repository, &judge, &objectives, rows, members, &confirmed)?,
        requirements: plan
            .requirements
            .iter()
            .map(|requirement| summarise_requirement(repository, &judge, requirement, rows))
            .collect::<Result<_, _>>()?,
        causes: causes_of_search(repository, &judge, rows)?,
        monitors: monitors_summary(repository, rows)?,
        mend: None,
        expectations: expectations(plan, rows),
        repetition: repetition(plan, repository.task(), rows),
        shrinking,
        shrinkings,
        failures: rows.iter().flat_map(|row| failures(&judge, row)).collect(),
        quarantined: rows.iter().filter_map(|row| quarantined(plan, &judge, row)).collect(),
        not_finite: rows.iter().filter_map(|row| not_finite(plan, row)).collect(),
        without_effect: without_effect(repository)?,
        closing_run,
        once: rows
            .iter()
            .filter(|row| counts_as_test(row) && judge.runs(row.number).is_empty())
            .filter(|row| plan.requirements.iter().any(|requirement| row.verdict(requirement) == Verdict::Violated))
            .count(),
        spreads: spreads(plan, rows),
        coverage: coverage(repository)?,
        pairs: pairs_of_search(repository)?,
        warnings: warnings.chain(tests_not_imported(rows)).collect(),
        undisturbed: repository.task().undisturbed().is_some(),
        confirmation: plan.campaign.confirm,
        confirmed,
        objectives,
    };
    for at in 0..summary.requirements.len() {
        let requirement = &summary.requirements[at];
        let sentence = (requirement.violated > 0)
            .then(|| violated_requirement(requirement, &summary.causes_of(requirement)).to_string());
        summary.requirements[at].sentence = sentence;
    }
    Ok(summary)
}

fn without_effect(repository: &Repository) -> Result<Vec<WithoutEffect>, RecordError> {
    let uses = repository.uses()?;
    let never = |name: &str| uses.get(name).filter(|uses| uses.effective == 0 && uses.all >= FEWEST_USES).copied();
    let operations = repository.plan().operations.iter();
    let found = operations.filter_map(|operation| {
        let uses = never(&operation.name)?;
        Some(WithoutEffect { operation: operation.name.clone(), uses: uses.all })
    });
    Ok(found.collect())
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
            Outcome::NoEffect => counts.no_effect += 1,
            Outcome::Crash { .. } => counts.crashes += 1,
            Outcome::Timeout { .. } => counts.timeouts += 1,
            Outcome::LaunchFailed { .. } | Outcome::Disconnect { .. } | Outcome::WrongClock { .. } => {
                counts.environment += 1;
            }
        }
    }
    counts
}

/// Whether a test is counted in verdicts on requirements.
fn counts_as_test(row: &TestRow) -> bool {
    row.origin != Origin::Reference && row.duplicate_of.is_none()
}

fn front(
    repository: &Repository,
    judge: &Judge<'_>,
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
        let minimise = objectives.get(key).is_some_and(|objective| objective.direction == Direction::Minimise);
        if minimise { -value } else { value }
    };
    let members: BTreeSet<u32> = members.iter().copied().collect();
    let mut sorted: Vec<&TestRow> = rows.iter().filter(|row| members.contains(&row.number)).collect();
    sorted.sort_by(|a, b| danger(b).total_cmp(&danger(a)).then(a.number.cmp(&b.number)));
    let on_front = sorted.into_iter().map(|row| {
        Ok(FrontTest {
            test: TestNumber(row.number),
            number: row.number,
            values: values(row),
            operations: operations(plan, row),
            stacked: stacked_of(repository, row)?,
            violates: violated(plan, judge, row),
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

fn summarise_requirement(
    repository: &Repository,
    judge: &Judge<'_>,
    requirement: &Requirement,
    rows: &[TestRow],
) -> Result<RequirementSummary, RecordError> {
    let plan = repository.plan();
    let metric = plan.metric(requirement.metric);
    let mut found = RequirementSummary {
        requirement: requirement.name.clone(),
        text: requirement.text.clone(),
        metric: metric.name.clone(),
        bound: bound_of(plan, requirement),
        satisfied: 0,
        violated: 0,
        confirmed: 0,
        flaky: 0,
        once: 0,
        fresh_only: 0,
        not_confirmed: 0,
        inconclusive: 0,
        reference: rows.iter().find(|row| row.origin == Origin::Reference).map(|row| row.verdict(requirement)),
        worst: None,
        sentence: None,
    };
    let mut worst: Option<(f64, &TestRow, MetricValue)> = None;
    for row in rows.iter().filter(|row| counts_as_test(row)) {
        let (first, tally) = (row.verdict(requirement), judge.tally(row.number, requirement));
        let standing = tally.standing(first);
        found.not_confirmed += usize::from(standing == Some(Standing::NotConfirmed));
        match tally.verdict(first) {
            Verdict::Satisfied => found.satisfied += 1,
            Verdict::Inconclusive => found.inconclusive += 1,
            Verdict::Violated => {
                found.violated += 1;
                found.confirmed += usize::from(standing == Some(Standing::Confirmed));
                found.flaky += usize::from(standing == Some(Standing::Flaky));
                found.once += usize::from(standing.is_none());
                found.fresh_only += usize::from(first != Verdict::Violated);
                let fresh = judge.runs(row.number).iter().filter(|run| run.verdict(requirement) == Verdict::Violated);
                let fresh = fresh.map(|run| run.value(requirement.metric));
                let own = (tally.violated == 0).then(|| row.value(requirement.metric));
                for shown in fresh.chain(own) {
                    let outside = shown.value.map_or(0.0, |value| distance_outside(requirement.bound, value));
                    if worst.is_none_or(|(farthest, ..)| outside > farthest) {
                        worst = Some((outside, row, shown));
                    }
                }
            }
        }
    }
    if let Some((_, row, shown)) = worst
        && let Some(value) = shown.value
    {
        let acting = acting(plan, &repository.test(row.number)?);
        let text = value_of(plan, requirement.metric, shown, &[requirement.bound]);
        found.worst = Some(Worst { test: TestNumber(row.number), value, text, acting });
    }
    Ok(found)
}

impl RequirementSummary {
    /// How its violations stand, as in `3 confirmed, 1 flaky, 8 run once; 2 not confirmed`; a dash without violations.
    pub(crate) fn standings(&self) -> String {
        let standing = [(self.confirmed, "confirmed"), (self.flaky, "flaky"), (self.once, "run once")];
        let words = standing.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}"));
        let mut parts = vec![words.collect::<Vec<_>>().join(", ")];
        parts.retain(|part| !part.is_empty());
        if self.not_confirmed > 0 {
            parts.push(format!("{} not confirmed", self.not_confirmed));
        }
        if parts.is_empty() { "–".to_owned() } else { parts.join("; ") }
    }
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
                test: TestNumber(row.number),
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

/// The crash and the timeout that a test's first run or a fresh one shows.
fn failures(judge: &Judge<'_>, row: &TestRow) -> Vec<Failure> {
    if row.duplicate_of.is_some() {
        return Vec::new();
    }
    let of = |word: &'static str| {
        let own = (failed(&row.outcome, word) == Verdict::Violated).then_some((row.end, &row.outcome));
        let fresh = judge.runs(row.number).iter().filter(|run| failed(&run.outcome, word) == Verdict::Violated);
        let (at, outcome) = own.or_else(|| fresh.map(|run| (run.end, &run.outcome)).next())?;
        Some(Failure {
            test: TestNumber(row.number),
            outcome: word.to_owned(),
            at,
            detail: outcome.detail().unwrap_or_default(),
            again: failed_again(judge, row, word),
        })
    };
    FAILURES.into_iter().chain(OF_ENVIRONMENT).filter_map(of).collect()
}

fn quarantined(plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow) -> Option<Quarantined> {
    let is_one = row.duplicate_of.is_none() && is_quarantined(plan, &row.outcome, judge.runs(row.number));
    is_one.then(|| Quarantined { test: TestNumber(row.number), detail: row.outcome.detail().unwrap_or_default() })
}

fn not_finite(plan: &CampaignPlan, row: &TestRow) -> Option<NotFinite> {
    let read = || row.values.iter().zip(&plan.metrics).filter(|(shown, _)| shown.not_finite.is_some());
    let at = read().filter_map(|(shown, _)| shown.not_finite).min_by(f64::total_cmp)?;
    let metrics = read().map(|(_, metric)| metric.name.clone()).collect();
    row.duplicate_of.is_none().then_some(NotFinite { test: TestNumber(row.number), at, metrics })
}

fn spreads(plan: &CampaignPlan, rows: &[TestRow]) -> Vec<Spread> {
    (0u32..)
        .zip(&plan.metrics)
        .filter_map(|(id, metric)| {
            let values = rows
                .iter()
                .filter(|row| row.origin != Origin::Reference && row.duplicate_of.is_none())
                .filter_map(|row| row.value(MetricId(id)).value);
            let Sample { count, mean, deviation, min, median, max } = Sample::of(values)?;
            let (metric, unit) = (metric.name.clone(), metric.unit.clone());
            Some(Spread { metric, unit, count, min, median, max, mean, deviation })
        })
        .collect()
}

/// The value of an objective by which a test is judged: that of its repetitions where the campaign confirmed it.
pub(crate) fn shown_value(summary: &Summary, row: &TestRow, objective: usize) -> Option<f64> {
    let repeated = summary.confirmed.iter().find(|test| test.number == row.number);
    match repeated.and_then(|test| test.values.as_ref()) {
        Some(values) => values.get(objective).copied(),
        None => row.value(summary.objectives[objective].id).value,
    }
}
