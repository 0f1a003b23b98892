//! Gates: what was found decides the exit code.
//!
//! Verdicts are those of the summary: if a test was run again, its fresh runs decide, and a finding that none of them
//! shows closes no gate.

use std::collections::BTreeSet;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Task};
use sesame_record::{Repository, Verdict};
use sesame_report::Summary;

use crate::cli::failure::NOT_AS_REQUIRED;
use crate::cli::terminal::say;

/// Which findings make a command end with exit code 3.
#[derive(Debug, Default, Args)]
pub(super) struct Gate {
    /// Exit with code 3 if this was found; separate several by commas, or repeat the option
    #[arg(long, value_enum, value_name = "FINDING", value_delimiter = ',')]
    fail_on: Vec<Finding>,
}

/// The findings that can close a gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Finding {
    /// A test violates a requirement, or a regression test an expectation
    Violation,
    /// A test crashes
    Crash,
    /// A test times out
    Timeout,
    /// A metric read a number that is not finite, such as NaN
    NotFinite,
    /// A test is inconclusive about a requirement, or a regression test about an expectation
    Inconclusive,
    /// Any of these
    Any,
    /// Nothing, not even insufficient results
    Nothing,
}

impl Gate {
    /// The exit code after these findings; says on standard error what closes the gate.
    pub(super) fn code(&self, summary: &Summary, repository: &Repository) -> ExitCode {
        let objections = self.objections(summary, repository.plan(), repository.task());
        for objection in &objections {
            say(format_args!("not as required: {objection}"));
        }
        if let Some(note) = seed_note(summary, repository.plan(), repository.task(), repository.campaign().seed) {
            say(format_args!("note: {note}"));
        }
        if objections.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(NOT_AS_REQUIRED) }
    }

    /// All that is not as required, a sentence each.
    fn objections(&self, summary: &Summary, plan: &CampaignPlan, task: &Task) -> Vec<String> {
        let asked = |finding| self.fail_on.contains(&finding) || self.fail_on.contains(&Finding::Any);
        let mut objections = Vec::new();
        if asked(Finding::Violation) {
            let broken = summary.requirements.iter().filter(|requirement| requirement.violated > 0);
            objections.extend(broken.map(|requirement| {
                format!("{} is violated in {}", requirement.requirement, tests(requirement.violated))
            }));
            objections.extend(expectations(summary, Verdict::Violated, "is violated"));
        }
        for (finding, word) in [(Finding::Crash, "crash"), (Finding::Timeout, "timeout")] {
            let found = broken_off(summary, &[word]).len();
            if asked(finding) && found > 0 {
                objections.push(format!("{} ended by {word}", tests(found)));
            }
        }
        if asked(Finding::NotFinite) && !summary.not_finite.is_empty() {
            objections.push(format!("metrics read numbers that are not finite in {}", tests(summary.not_finite.len())));
        }
        if asked(Finding::Inconclusive) {
            let open = summary.requirements.iter().filter(|requirement| requirement.inconclusive > 0);
            objections.extend(open.map(|requirement| {
                format!("{} is inconclusive in {}", requirement.requirement, tests(requirement.inconclusive))
            }));
            objections.extend(expectations(summary, Verdict::Inconclusive, "is inconclusive"));
        }
        if matches!(task, Task::Known { .. }) {
            objections.extend(not_as_expected(summary));
        }
        if !self.fail_on.contains(&Finding::Nothing) {
            objections.extend(insufficient(summary, plan, task));
        }
        objections.dedup();
        objections
    }
}

/// All that could close a gate.
#[cfg(test)]
pub(super) fn every_objection(summary: &Summary, repository: &Repository) -> Vec<String> {
    Gate { fail_on: vec![Finding::Any] }.objections(summary, repository.plan(), repository.task())
}

fn tests(count: usize) -> String {
    if count == 1 { "1 test".to_owned() } else { format!("{count} tests") }
}

/// Tests that ended in one of these ways, where that stands.
fn broken_off(summary: &Summary, words: &[&str]) -> BTreeSet<TestNumber> {
    let found = summary.failures.iter().filter(|failure| words.contains(&failure.outcome.as_str()) && failure.stands());
    found.map(|failure| failure.test).collect()
}

fn expectations<'a>(summary: &'a Summary, verdict: Verdict, what: &'a str) -> impl Iterator<Item = String> + 'a {
    let found = summary.expectations.iter().filter(move |expectation| expectation.verdict == verdict);
    found.map(move |expectation| {
        format!("the expectation of `{}` about {} {what}", expectation.known_test, expectation.metric)
    })
}

/// Regression tests must end, and as expected: an inconclusive expectation is not as expected.
fn not_as_expected(summary: &Summary) -> Vec<String> {
    let failed = summary.failures.iter().filter(|failure| failure.stands());
    let mut objections: Vec<String> =
        failed.map(|failure| format!("{} ended by {}", failure.test, failure.outcome)).collect();
    objections.extend(expectations(summary, Verdict::Violated, "is violated"));
    objections.extend(expectations(summary, Verdict::Inconclusive, "is inconclusive"));
    objections
}

/// The seed of regression tests that name none and are not as expected: with another seed, they may be.
fn seed_note(summary: &Summary, plan: &CampaignPlan, task: &Task, seed: u64) -> Option<String> {
    let Task::Known { .. } = task else { return None };
    let names_no_seed = |name: &str| plan.tests.iter().any(|test| test.name == name && test.simulator_seed.is_none());
    let found = summary.expectations.iter().filter(|expectation| expectation.verdict != Verdict::Satisfied);
    let mut names: Vec<String> = found
        .map(|expectation| &expectation.known_test)
        .filter(|name| names_no_seed(name))
        .map(|name| format!("`{name}`"))
        .collect();
    names.dedup();
    (!names.is_empty()).then(|| {
        format!(
            "these tests ran with the simulator's seed of seed {seed}, not with a `simulator seed` of their own: {}. Values \
             that were measured with another seed may differ: `known --seed N` runs the tests with that one, and `export` \
             writes the seed of a test into its block",
            names.join(", ")
        )
    })
}

/// Why results are insufficient: so little is known that "nothing was found" would mislead, whichever gates are set.
///
/// Shrinking and repeating are about single tests: if one crashes, so do most of their runs. What is run in a lab is
/// chosen for how dangerous it is.
fn insufficient(summary: &Summary, plan: &CampaignPlan, task: &Task) -> Vec<String> {
    let counts = summary.counts;
    let is_about_one_test = !task.shrinkings().is_empty() || task.repeated(plan).is_some() || task.of_lab().is_some();
    let disturbs_nothing = task.undisturbed().is_some();
    let ran = counts.evaluations - counts.duplicates;
    let mut objections: Vec<String> = summary.closing_run.iter().cloned().collect();
    if ran == 0 || is_about_one_test || disturbs_nothing {
        return objections;
    }
    let broken = broken_off(summary, &["crash", "timeout"]).len();
    if 2 * broken > ran {
        objections.push(format!("{broken} of {} broke off by crash or timeout, more than half", tests(ran)));
    }
    if counts.no_effect == counts.evaluations {
        objections.push(format!("no operation had an effect in any of {}", tests(ran)));
    }
    if counts.no_effect < counts.evaluations {
        objections.extend(summary.without_effect.iter().map(|operation| {
            format!("operation `{}` had no effect in any of its {} uses", operation.operation, operation.uses)
        }));
    }
    let judged = summary.requirements.iter().any(|requirement| requirement.satisfied + requirement.violated > 0);
    if !summary.requirements.is_empty() && !judged {
        objections.push(format!("none of {} is conclusive about any requirement", tests(ran)));
    }
    objections
}

#[cfg(test)]
mod tests {
    use sesame_plan::KnownTestId;
    use sesame_record::{Standing, sample};
    use sesame_report::{ExpectationSummary, Failure, FindingAgain, NotFinite, WithoutEffect, summary};

    use super::*;

    fn found() -> (Summary, CampaignPlan) {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::plan();
        let mut summary = summary(&sample::campaign(folder.path(), &plan, 12)).unwrap();
        summary.failures.clear();
        for requirement in &mut summary.requirements {
            (requirement.violated, requirement.satisfied, requirement.inconclusive) = (0, 13, 0);
        }
        (summary, plan)
    }

    fn objections(fail_on: &[Finding], summary: &Summary, plan: &CampaignPlan) -> Vec<String> {
        Gate { fail_on: fail_on.to_vec() }.objections(summary, plan, &Task::Campaign)
    }

    fn crash(number: u32) -> Failure {
        let detail = "gone".to_owned();
        Failure { test: TestNumber(number), outcome: "crash".to_owned(), at: 1.0, detail, again: None }
    }

    /// A finding, and what brings it into a summary.
    type Change = (Finding, fn(&mut Summary));

    #[test]
    fn each_finding_closes_its_own_gate_and_that_of_any_finding() {
        let (clean, plan) = found();
        assert_eq!(objections(&[Finding::Any], &clean, &plan), [""; 0]);
        let changes: [Change; 5] = [
            (Finding::Violation, |summary| summary.requirements[0].violated = 2),
            (Finding::Crash, |summary| summary.failures.push(crash(2))),
            (Finding::Timeout, |summary| summary.failures.push(Failure { outcome: "timeout".to_owned(), ..crash(3) })),
            (Finding::NotFinite, |summary| {
                summary.not_finite.push(NotFinite { test: TestNumber(4), at: 1.0, metrics: vec!["speed".to_owned()] });
            }),
            (Finding::Inconclusive, |summary| summary.requirements[1].inconclusive = 1),
        ];
        for (at, (finding, change)) in changes.iter().enumerate() {
            let mut summary = clean.clone();
            change(&mut summary);
            assert_eq!(objections(&[], &summary, &plan), [""; 0], "no gate is set");
            assert_eq!(objections(&[Finding::Any], &summary, &plan).len(), 1, "{finding:?}");
            for (other, (gate, _)) in changes.iter().enumerate() {
                assert_eq!(
                    objections(&[*gate], &summary, &plan).len(),
                    usize::from(at == other),
                    "{gate:?}, {finding:?}"
                );
            }
        }
    }

    #[test]
    fn nine_crashes_of_twelve_tests_are_not_green_by_default() {
        let (mut summary, plan) = found();
        assert_eq!(summary.counts.evaluations, 13);
        summary.failures = (1..=6).map(crash).collect();
        assert_eq!(objections(&[], &summary, &plan), [""; 0], "six of thirteen are not more than half");
        summary.failures = (1..=9).map(crash).collect();
        let said = ["9 of 13 tests broke off by crash or timeout, more than half"];
        assert_eq!(objections(&[], &summary, &plan), said);
        assert_eq!(objections(&[Finding::Violation], &summary, &plan), said);
        assert_eq!(objections(&[Finding::Nothing], &summary, &plan), [""; 0]);
    }

    #[test]
    fn a_campaign_that_judges_nothing_or_disturbs_nothing_is_not_green() {
        let (mut summary, plan) = found();
        summary.counts.no_effect = summary.counts.evaluations;
        assert_eq!(objections(&[], &summary, &plan), ["no operation had an effect in any of 13 tests"]);
        summary.counts.no_effect = 0;
        for requirement in &mut summary.requirements {
            (requirement.satisfied, requirement.inconclusive) = (0, 13);
        }
        assert_eq!(objections(&[], &summary, &plan), ["none of 13 tests is conclusive about any requirement"]);
        summary.requirements.clear();
        assert_eq!(objections(&[], &summary, &plan), [""; 0], "there was nothing to judge");
    }

    #[test]
    fn an_operation_that_never_acts_and_a_system_that_is_no_longer_what_it_was_are_not_green() {
        let (mut summary, plan) = found();
        let operation = WithoutEffect { operation: "weak_brakes".to_owned(), uses: 30 };
        summary.without_effect = vec![operation];
        assert_eq!(objections(&[], &summary, &plan), ["operation `weak_brakes` had no effect in any of its 30 uses"]);
        assert_eq!(objections(&[Finding::Nothing], &summary, &plan), [""; 0]);
        // That none has an effect says it all.
        summary.counts.no_effect = summary.counts.evaluations;
        assert_eq!(objections(&[], &summary, &plan), ["no operation had an effect in any of 13 tests"]);

        let (mut summary, plan) = found();
        let differs = "the reference run after the campaign differs from the one before it: it is silent";
        summary.closing_run = Some(differs.to_owned());
        assert_eq!(objections(&[], &summary, &plan), [differs]);
        let repeated = Task::Repeat { name: "T1".to_owned(), test: plan.tests[0].test.clone(), times: 5 };
        assert_eq!(
            Gate::default().objections(&summary, &plan, &repeated),
            [differs],
            "also where it is about one test"
        );
    }

    #[test]
    fn tests_that_name_no_seed_and_are_not_as_expected_are_told_the_seed_of_the_run() {
        let (mut summary, mut plan) = found();
        let known = Task::Known { tests: vec![KnownTestId(0)], lab: None };
        let expected = |verdict| ExpectationSummary {
            test: TestNumber(1),
            known_test: plan.tests[0].name.clone(),
            metric: "top_speed".to_owned(),
            bound: "== 1 m/s".to_owned(),
            value: Some(2.0),
            verdict,
        };
        summary.expectations = vec![expected(Verdict::Satisfied)];
        assert_eq!(seed_note(&summary, &plan, &known, 7), None);
        summary.expectations = vec![expected(Verdict::Violated), expected(Verdict::Violated)];
        let note = seed_note(&summary, &plan, &known, 7).unwrap();
        assert!(note.contains("of seed 7, ") && note.contains(": `known_jitter`. "), "{note}");
        assert_eq!(seed_note(&summary, &plan, &Task::Campaign, 7), None, "expectations are of `known`");
        plan.tests[0].simulator_seed = Some(11);
        assert_eq!(seed_note(&summary, &plan, &known, 7), None);
    }

    #[test]
    fn a_crash_that_no_fresh_run_shows_closes_no_gate() {
        let (mut summary, plan) = found();
        let mut failure = crash(2);
        failure.again = Some(FindingAgain {
            finding: "crash".to_owned(),
            first: true,
            again: 0,
            conclusive: 4,
            inconclusive: 0,
            interval: None,
            standing: Some(Standing::NotConfirmed),
        });
        summary.failures.push(failure);
        assert_eq!(objections(&[Finding::Any], &summary, &plan), [""; 0]);
        summary.failures[0].again.as_mut().unwrap().standing = Some(Standing::Flaky);
        assert_eq!(objections(&[Finding::Any], &summary, &plan), ["1 test ended by crash"]);
    }
}
