//! What running tests again says of what was found: how often each finding came again, and how sure that is.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use sesame_plan::{CampaignPlan, Confirmation, Direction, Typical};

use crate::observation::Outcome;
use crate::record::{RecordError, Repetition, Repository, TestRow, Verdict, confirmed_fitness, verdict};
use crate::report::number::{self, fixed, join_words, plural};
use crate::report::repetition::wilson;

/// What the repetitions of a test say. The run that selected it is none of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfirmedTest {
    /// Its name.
    pub test: String,
    /// Its number.
    pub number: u32,
    /// Whether it is on the front.
    pub front: bool,
    /// How often it was run again.
    pub repetitions: usize,
    /// Of these, crashes and timeouts.
    pub failures: usize,
    /// A value per objective by which the front takes the test, where the campaign confirms; `None` where too few
    /// repetitions have one.
    pub values: Option<Vec<f64>>,
    /// What was found in its first run; none for a test that violates no requirement and came to its end.
    pub findings: Vec<FindingAgain>,
    /// Repetitions in which all of that came again.
    pub again: usize,
    /// The 95 % Wilson interval of the probability that a run shows all of it; `None` where nothing was found.
    pub interval: Option<[f64; 2]>,
    /// Whether what was found is to be believed; `None` where nothing was found.
    pub standing: Option<Standing>,
}

/// A finding, and how often it came again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FindingAgain {
    /// The name of the violated requirement, or `crash` or `timeout`.
    pub finding: String,
    /// Repetitions in which it came again.
    pub again: usize,
}

/// Whether a finding is to be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// It came again in every repetition.
    Confirmed,
    /// It came again in some.
    Flaky,
    /// It came again in none.
    NotConfirmed,
}

impl Standing {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Standing::Confirmed => "confirmed",
            Standing::Flaky => "flaky",
            Standing::NotConfirmed => "not confirmed",
        }
    }
}

/// All tests that were run again, by number.
pub(crate) fn confirmed_tests(
    repository: &Repository,
    rows: &[TestRow],
    front: &[u32],
) -> Result<Vec<ConfirmedTest>, RecordError> {
    let repetitions = repository.repetitions()?;
    Ok(confirmed(repository.plan(), &repetitions, rows, front))
}

/// One test, if it was run again.
pub(crate) fn confirmed_test(
    repository: &Repository,
    number: u32,
    front: bool,
) -> Result<Option<ConfirmedTest>, RecordError> {
    let Some(runs) = repository.repetitions()?.remove(&number) else { return Ok(None) };
    let row = repository.row(number)?;
    let members = if front { vec![number] } else { Vec::new() };
    Ok(confirmed(repository.plan(), &BTreeMap::from([(number, runs)]), &[row], &members).pop())
}

fn confirmed(
    plan: &CampaignPlan,
    repetitions: &BTreeMap<u32, Vec<Repetition>>,
    rows: &[TestRow],
    front: &[u32],
) -> Vec<ConfirmedTest> {
    let of = |row: &TestRow| {
        let runs = repetitions.get(&row.number)?;
        let shown =
            |it: &Shown<'_>, outcome: &Outcome, value: &dyn Fn(sesame_plan::MetricId) -> crate::record::MetricValue| {
                match it {
                    Shown::Requirement(it) => verdict(it.bound, outcome, value(it.metric)) == Verdict::Violated,
                    Shown::Failure(word) => outcome.word() == *word,
                }
            };
        let requirements = plan.requirements.iter().map(Shown::Requirement);
        let failed = matches!(row.outcome, Outcome::Crash { .. } | Outcome::Timeout { .. });
        let failure = failed.then(|| Shown::Failure(row.outcome.word()));
        let found: Vec<Shown<'_>> =
            requirements.chain(failure).filter(|it| shown(it, &row.outcome, &|metric| row.value(metric))).collect();
        let came_again = |it: &Shown<'_>, run: &Repetition| shown(it, &run.outcome, &|metric| run.value(metric));
        let again = runs.iter().filter(|run| found.iter().all(|it| came_again(it, run))).count();
        let anything = !found.is_empty();
        Some(ConfirmedTest {
            test: format!("T{}", row.number),
            number: row.number,
            front: front.contains(&row.number),
            repetitions: runs.len(),
            failures: runs
                .iter()
                .filter(|run| matches!(run.outcome, Outcome::Crash { .. } | Outcome::Timeout { .. }))
                .count(),
            values: confirmed_values(plan, runs),
            findings: found
                .iter()
                .map(|it| FindingAgain {
                    finding: it.name().to_owned(),
                    again: runs.iter().filter(|run| came_again(it, run)).count(),
                })
                .collect(),
            again: if anything { again } else { 0 },
            interval: wilson(again, runs.len()).filter(|_| anything),
            standing: anything.then_some(match again {
                0 => Standing::NotConfirmed,
                again if again == runs.len() => Standing::Confirmed,
                _ => Standing::Flaky,
            }),
        })
    };
    rows.iter().filter_map(of).collect()
}

/// Something that a run can show.
enum Shown<'p> {
    Requirement(&'p sesame_plan::Requirement),
    /// The word of its outcome.
    Failure(&'static str),
}

impl Shown<'_> {
    fn name(&self) -> &str {
        match self {
            Shown::Requirement(requirement) => &requirement.name,
            Shown::Failure(word) => word,
        }
    }
}

/// The objective values by which a campaign's front takes a test that was run again, as its metrics have them.
pub(crate) fn confirmed_values(plan: &CampaignPlan, runs: &[Repetition]) -> Option<Vec<f64>> {
    let fitness = confirmed_fitness(plan, runs)?;
    let values =
        fitness.objectives()?.iter().zip(&plan.campaign.objectives).map(|(value, &id)| {
            if plan.metric(id).direction == Some(Direction::Maximise) { 0.0 - value } else { *value }
        });
    Some(values.collect())
}

impl ConfirmedTest {
    /// How often what was found came again, as in `4 of 5 (0.38–0.96) flaky`.
    pub(crate) fn words(&self) -> String {
        let failures = match self.failures {
            0 => String::new(),
            count => format!(", {}", plural(count, "run failed", "runs failed")),
        };
        let (Some([low, high]), Some(standing)) = (self.interval, self.standing) else {
            return format!("{}{failures}", plural(self.repetitions, "run", "runs"));
        };
        let mark = if standing == Standing::Confirmed { String::new() } else { format!(" {}", standing.words()) };
        format!("{} of {} ({}–{}){mark}{failures}", self.again, self.repetitions, fixed(low, 2), fixed(high, 2))
    }
}

/// How many of these tests' findings are how much to be believed, as in `4 confirmed, 1 flaky`; nothing for tests without
/// findings.
pub(crate) fn standings(tests: &[&ConfirmedTest]) -> String {
    let words = [Standing::Confirmed, Standing::Flaky, Standing::NotConfirmed].into_iter().filter_map(|standing| {
        let count = tests.iter().filter(|test| test.standing == Some(standing)).count();
        (count > 0).then(|| format!("{count} {}", standing.words()))
    });
    join_words(&words.collect::<Vec<_>>())
}

/// How many runs confirmed what, in a sentence; nothing where no test was run again.
pub(crate) fn confirmation_sentence(tests: &[ConfirmedTest]) -> Option<String> {
    let runs: usize = tests.iter().map(|test| test.repetitions).sum();
    if tests.is_empty() {
        return None;
    }
    let mut sentence =
        format!("{} of {}", plural(runs, "further run", "further runs"), plural(tests.len(), "test", "tests"));
    let front = standings(&tests.iter().filter(|test| test.front).collect::<Vec<_>>());
    let all = standings(&tests.iter().collect::<Vec<_>>());
    if !all.is_empty() {
        let _ = write!(sentence, " to confirm them: {all}");
        if front.is_empty() {
            sentence.push_str("; none of these on the front");
        } else if front != all {
            let _ = write!(sentence, "; on the front {front}");
        }
    }
    Some(sentence)
}

/// What the values of a front of confirmed tests are, in a sentence.
pub(crate) fn values_sentence(confirmation: Confirmation) -> String {
    let runs = plural(confirmation.times as usize, "fresh run", "fresh runs");
    match confirmation.by {
        Typical::Mean => format!("Values are means of {runs} of each test."),
        Typical::Median => format!("Values are medians of {runs} of each test."),
        Typical::Quantile { share } => {
            format!("Values are what {} % of {runs} of each test reach or go beyond.", number::number(100.0 * share))
        }
    }
}
