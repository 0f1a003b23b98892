//! Findings of tests that were run again: how often each was seen again, and how sure that is.

use std::fmt::Write as _;

use serde::Serialize;

use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_gap::proportion::wilson;
use sesame_plan::CampaignPlan;
use sesame_present::number::{fixed, plural};
use sesame_record::{Judge, RecordError, Repetition, Repository, Standing, Tally, TestRow, Verdict, confirmed_fitness};

/// The findings of a test that was run again. The run that selected the test is not one of its repetitions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfirmedTest {
    /// Its name.
    pub test: TestNumber,
    /// Its number.
    pub number: u32,
    /// Whether it is on the front.
    pub front: bool,
    /// How often it was run again.
    pub repetitions: usize,
    /// How many of these crashed or timed out.
    pub failures: usize,
    /// The value of each objective that the front uses, if the campaign confirms; `None` if too few repetitions have
    /// one.
    pub values: Option<Vec<f64>>,
    /// Everything that its first run or a fresh one shows: violated requirements in the space's order, then a crash and
    /// a timeout.
    pub findings: Vec<FindingAgain>,
    /// The standing of its surest finding; `None` without findings, and if all fresh runs are inconclusive.
    pub standing: Option<Standing>,
}

/// A finding, and how often it was seen again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FindingAgain {
    /// The name of the violated requirement, or `crash` or `timeout`.
    pub finding: String,
    /// Whether the first run shows it; otherwise it was first seen in a fresh one.
    pub first: bool,
    /// Fresh runs that show it.
    pub again: usize,
    /// Fresh runs that are conclusive about it: those that show it, and those that show that it is absent.
    pub conclusive: usize,
    /// Fresh runs that are inconclusive: they broke off too early, or a value is missing.
    pub inconclusive: usize,
    /// The 95 % Wilson interval of the probability that a run shows it; `None` if all fresh runs are
    /// inconclusive.
    pub interval: Option<[f64; 2]>,
    /// Whether fresh runs confirm it; `None` if all of them are inconclusive.
    pub standing: Option<Standing>,
}

impl FindingAgain {
    /// A finding according to fresh runs; `None` if neither they nor the first run show it.
    pub fn of(finding: &str, tally: Tally, first: Verdict) -> Option<FindingAgain> {
        (first == Verdict::Violated || tally.violated > 0).then(|| FindingAgain {
            finding: finding.to_owned(),
            first: first == Verdict::Violated,
            again: tally.violated,
            conclusive: tally.conclusive(),
            inconclusive: tally.inconclusive,
            interval: wilson(tally.violated, tally.conclusive()),
            standing: tally.standing(first),
        })
    }

    /// How often it was seen again, as in `4 of 5 (0.38–0.96) flaky`.
    pub fn words(&self) -> String {
        let silent = plural(self.inconclusive, "run inconclusive", "runs inconclusive");
        let Some(interval) = self.interval else { return silent };
        let mut words = rate(self.again, self.conclusive, interval);
        if let Some(standing) = self.standing.filter(|&standing| standing != Standing::Confirmed) {
            let _ = write!(words, " {}", standing.words());
        }
        if !self.first {
            words.push_str(", not in its first run");
        }
        if self.inconclusive > 0 {
            let _ = write!(words, ", {silent}");
        }
        words
    }
}

/// How often something was seen, as in `4 of 5 (0.38–0.96)`.
fn rate(shown: usize, said: usize, [low, high]: [f64; 2]) -> String {
    format!("{shown} of {said} ({}–{})", fixed(low, 2), fixed(high, 2))
}

/// How many fresh runs violate a requirement, as in `0 of 5 (0.00–0.43)`.
pub fn tally_words(tally: Tally) -> String {
    let silent = plural(tally.inconclusive, "run inconclusive", "runs inconclusive");
    match wilson(tally.violated, tally.conclusive()) {
        None => silent,
        Some(interval) if tally.inconclusive == 0 => rate(tally.violated, tally.conclusive(), interval),
        Some(interval) => format!("{}, {silent}", rate(tally.violated, tally.conclusive(), interval)),
    }
}

/// The outcomes that are findings themselves, by their words.
pub const FAILURES: [&str; 2] = ["crash", "timeout"];

/// The outcomes that say nothing about the system, by their words. They are not findings, but listed.
pub const OF_ENVIRONMENT: [&str; 3] = ["launch_failed", "disconnect", "wrong_clock"];

/// Whether a run ended with this outcome, as a verdict: violated if it did. No run is inconclusive about it.
pub fn failed(outcome: &Outcome, word: &str) -> Verdict {
    if outcome.word() == word { Verdict::Violated } else { Verdict::Satisfied }
}

/// How many runs ended with a crash or a timeout.
pub(crate) fn failed_tally(runs: &[Repetition], word: &str) -> Tally {
    Tally::of(runs.iter().map(|run| failed(&run.outcome, word)))
}

/// How often a crash or a timeout was seen again; `None` if the test was run once only, or no run shows it.
pub fn failed_again(judge: &Judge<'_>, row: &TestRow, word: &str) -> Option<FindingAgain> {
    let runs = judge.runs(row.number);
    let tally = failed_tally(runs, word);
    FindingAgain::of(word, tally, failed(&row.outcome, word)).filter(|_| !runs.is_empty())
}

/// All tests that were run again, by number.
pub fn confirmed_tests(plan: &CampaignPlan, judge: &Judge<'_>, rows: &[TestRow], front: &[u32]) -> Vec<ConfirmedTest> {
    rows.iter().filter_map(|row| confirmed(plan, judge, row, front.contains(&row.number))).collect()
}

/// One test, if it was run again.
pub fn confirmed_test(repository: &Repository, number: u32, front: bool) -> Result<Option<ConfirmedTest>, RecordError> {
    Ok(confirmed(repository.plan(), &repository.judge()?, &repository.row(number)?, front))
}

fn confirmed(plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow, front: bool) -> Option<ConfirmedTest> {
    let runs = judge.runs(row.number);
    if runs.is_empty() {
        return None;
    }
    let requirements = plan.requirements.iter().filter_map(|requirement| {
        FindingAgain::of(&requirement.name, judge.tally(row.number, requirement), row.verdict(requirement))
    });
    let failures = FAILURES.into_iter().filter_map(|word| failed_again(judge, row, word));
    let findings: Vec<FindingAgain> = requirements.chain(failures).collect();
    Some(ConfirmedTest {
        test: TestNumber(row.number),
        number: row.number,
        front,
        repetitions: runs.len(),
        failures: runs
            .iter()
            .filter(|run| matches!(run.outcome, Outcome::Crash { .. } | Outcome::Timeout { .. }))
            .count(),
        values: confirmed_values(plan, runs),
        standing: findings.iter().filter_map(|finding| finding.standing).min(),
        findings,
    })
}

/// The objective values by which a campaign's front takes a test that was run again, as its metrics have them.
pub(crate) fn confirmed_values(plan: &CampaignPlan, runs: &[Repetition]) -> Option<Vec<f64>> {
    let fitness = confirmed_fitness(plan, runs)?;
    let values = plan.objectives().zip(fitness.objectives()?).map(|(objective, &value)| objective.in_unit(value));
    Some(values.collect())
}

impl ConfirmedTest {
    /// How often each finding was seen again, as in `R1 4 of 5 (0.38–0.96) flaky`.
    pub fn words(&self) -> String {
        if self.findings.is_empty() {
            return format!("nothing in {}", plural(self.repetitions, "run", "runs"));
        }
        let words = self.findings.iter().map(|finding| format!("{} {}", finding.finding, finding.words()));
        words.collect::<Vec<_>>().join("; ")
    }

    /// The finding that fresh runs show most often; of equal ones the first.
    pub(crate) fn surest(&self) -> Option<&FindingAgain> {
        let share = |finding: &FindingAgain| finding.again as f64 / finding.conclusive as f64;
        let said = self.findings.iter().filter(|finding| finding.conclusive > 0);
        said.reduce(|best, finding| if share(finding) > share(best) { finding } else { best })
    }
}
