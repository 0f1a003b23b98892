//! The prose of reports, which text and HTML share.

use std::fmt::Write as _;

use sesame_analysis::confirmed::ConfirmedTest;
use sesame_analysis::trigger::Agreement;
use sesame_base::observation::Counters;
use sesame_base::test_number::TestNumber;
use sesame_plan::{Confirmation, Statistic};
use sesame_present::number::{self, fixed, join_words, plural};
use sesame_record::{Standing, Verdict};

use crate::facts::causes::CausesSummary;
use crate::facts::certificate::before_after::Mend;
use crate::facts::certificate::campaign::MonitorsSummary;
use crate::facts::coverage::CoverageSummary;
use crate::facts::disturbances::spans_text;
use crate::facts::repetition::ViolationRate;
use crate::facts::show::{OperationReport, TestReport, VerdictReport};
use crate::facts::shrinking::{ShrinkTrigger, Shrinking, ShrunkMessages};
use crate::facts::summary::Summary;
use crate::facts::wording::outcome_words;
use sesame_base::visible::visible;

/// The whole in one sentence, dangers first: `2 requirements violated (R1 by 31 tests, R4 by 3), 5 causes, front of 6
/// tests`.
pub fn headline(summary: &Summary) -> String {
    let mut violated: Vec<String> = Vec::new();
    for requirement in summary.requirements.iter().filter(|requirement| requirement.violated > 0) {
        let count = match violated.len() {
            0 => plural(requirement.violated, "test", "tests"),
            _ => requirement.violated.to_string(),
        };
        violated.push(format!("{} by {count}", requirement.requirement));
    }
    let mut parts = Vec::new();
    let untested = summary.counts.evaluations == 0 && !summary.undisturbed;
    if untested {
        parts.push("nothing was tested".to_owned());
    }
    let judged = summary.requirements.iter().any(|requirement| requirement.satisfied > 0);
    let open = summary.requirements.iter().any(|requirement| requirement.inconclusive > 0);
    parts.extend(match violated.len() {
        0 if untested => None,
        0 if summary.requirements.is_empty() => Some("no requirements".to_owned()),
        0 if open && !judged => Some("no test is conclusive about any requirement".to_owned()),
        0 => Some("no requirement violated".to_owned()),
        n => Some(format!("{} violated ({})", plural(n, "requirement", "requirements"), violated.join(", "))),
    });
    let causes = summary.causes.as_ref().map_or(0, |found| found.causes.len());
    parts.extend((causes > 0).then(|| plural(causes, "cause", "causes")));
    if let Some(monitors) = &summary.monitors {
        parts.extend(missed_words(monitors));
    }
    for (word, one, several) in [
        ("crash", "crash", "crashes"),
        ("timeout", "timeout", "timeouts"),
        ("launch_failed", "failed launch", "failed launches"),
        ("disconnect", "disconnect", "disconnects"),
        ("wrong_clock", "wrong clock", "wrong clocks"),
    ] {
        let count = summary.failures.iter().filter(|failure| failure.outcome == word && failure.stands()).count();
        if count > 0 {
            parts.push(plural(count, one, several));
        }
    }
    let satisfied = summary.expectations.iter().filter(|expectation| expectation.verdict == Verdict::Satisfied).count();
    match summary.expectations.len() {
        0 => {}
        all if satisfied == all => parts.push(plural(all, "expectation satisfied", "expectations satisfied")),
        all => parts.push(format!("{satisfied} of {} satisfied", plural(all, "expectation", "expectations"))),
    }
    if !untested && !summary.objectives.is_empty() {
        parts.push(format!("front of {}", plural(summary.front.len(), "test", "tests")));
    }
    let mut sentence = parts.join(", ");
    if let Some(first) = sentence.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    sentence
}

/// In how many tests monitors missed hazards, unless in none.
fn missed_words(monitors: &MonitorsSummary) -> Option<String> {
    let mut tests: Vec<TestNumber> = monitors.missed.iter().map(|missed| missed.test).collect();
    tests.dedup();
    (!tests.is_empty()).then(|| format!("hazards missed in {}", plural(tests.len(), "test", "tests")))
}

/// How many causes are known, and what is known of others, in sentences.
pub(crate) fn causes_sentence(found: &CausesSummary) -> Option<String> {
    let unseen = found.unseen?;
    let known = plural(found.causes.len(), "cause is known", "causes are known");
    let once = match (found.causes.len(), unseen.once) {
        (1, 0) => "several violating tests show it".to_owned(),
        (1, _) => "a single violating test shows it".to_owned(),
        (_, 0) => "each of them explains several violating tests on its own".to_owned(),
        (_, 1) => "one of them explains only one violating test on its own".to_owned(),
        (_, once) => format!("{once} of them each explain only one violating test on their own"),
    };
    let guide = if unseen.independent {
        ""
    } else {
        " The figure is a rough guide, because this search does not draw its tests independently."
    };
    Some(format!(
        "{known}; {once}. A further test like these shows a new cause with a probability of at most {} % (Good–Turing \
         estimate at 99 % confidence, from {}).{guide}",
        fixed(100.0 * unseen.at_most, 1),
        plural(unseen.tests as usize, "test", "tests"),
    ))
}

/// What the monitors of a campaign did, in a sentence.
pub(crate) fn monitors_sentence(monitors: &MonitorsSummary) -> String {
    let foreseen: usize = monitors.hazards.iter().map(|pair| pair.foreseen).sum();
    let missed: usize = monitors.hazards.iter().map(|pair| pair.missed).sum();
    let detected: usize = monitors.hazards.iter().map(|pair| pair.detected).sum();
    let of = plural(monitors.tests, "test", "tests");
    let known = match foreseen + detected + missed {
        0 if monitors.unknown == monitors.tests && monitors.tests > 0 => {
            return format!("In {of} nobody can tell whether there was a hazard: requirements are inconclusive");
        }
        0 => format!("In {of} there was no hazard that a monitor was to foresee"),
        all => {
            let all = plural(all, "hazard", "hazards");
            match detected {
                0 => format!("In {of} monitors foresaw {foreseen} of {all} and missed {missed}"),
                _ => format!(
                    "In {of} monitors foresaw {foreseen} of {all}, detected {detected} as it happened and missed {missed}"
                ),
            }
        }
    };
    match monitors.unknown {
        0 => known,
        unknown => format!("{known}; in {unknown} nobody can tell about a requirement, as it is inconclusive"),
    }
}

/// What monitors did in which runs, if tests were run again.
pub(crate) fn monitors_run_again(monitors: &MonitorsSummary) -> Option<String> {
    let of = plural(monitors.run_again, "test that was run again", "tests that were run again");
    (monitors.run_again > 0).then(|| {
        format!(
            "The hazards of {of} are those of their fresh runs; alarms, changes and times in states are of first runs"
        )
    })
}

/// What a mend changed, in a sentence.
pub(crate) fn mend_sentence(mend: &Mend) -> String {
    let Mend { tests, missed_before, missed_after, .. } = mend;
    match tests {
        0 => "No test is in both results; `export` writes a test for the `.sesame` file, and `known` runs it under \
              either certificate"
            .to_owned(),
        _ => format!(
            "Of {} in both results, hazards were missed in {missed_before} before and in {missed_after} after",
            plural(*tests, "test", "tests")
        ),
    }
}

/// What hazards, lead times and alarms are.
pub(crate) const MONITORS_CAPTION: &str = "A hazard is the first moment of a test from which nothing could satisfy a requirement any more. It is foreseen if the monitor was in its safe state before; \
     the lead time is for how long. It is detected if the monitor went into its safe state in that instant, and missed if it was not in it. An alarm is the loss of the last guarantee; it is \
     false if no hazard follows in it, for which mitigation may be the reason. A monitor that never vouched for anything in a test was in its safe state all the time.";

/// What the table of quarantined tests is called.
pub(crate) const QUARANTINED: &str = "Quarantined: crashed in three runs, and not run again";

/// How many tests ran, and how many of these say nothing about the system.
pub(crate) fn counts_sentence(summary: &Summary) -> String {
    let counts = &summary.counts;
    let mut left_out = Vec::new();
    if counts.no_effect > 0 {
        let share = 100.0 * counts.no_effect as f64 / counts.evaluations as f64;
        left_out.push(format!("{} with no effect ({share:.0} %)", counts.no_effect));
    }
    if counts.unmeasured > 0 {
        left_out.push(format!("{} unmeasured (a metric without value)", counts.unmeasured));
    }
    if counts.duplicates > 0 {
        left_out.push(plural(counts.duplicates, "duplicate (not simulated again)", "duplicates (not simulated again)"));
    }
    let mut sentence = plural(counts.evaluations, "evaluation", "evaluations");
    if !left_out.is_empty() {
        let _ = write!(sentence, ", of these {}", join_words(&left_out));
    }
    if summary.stop.is_none() {
        sentence.push_str("; the run is unfinished");
    }
    sentence
}

/// Which operations did nothing, in a sentence; `None` if there is none.
pub(crate) fn without_effect_sentence(summary: &Summary) -> Option<String> {
    let operations: Vec<String> = summary
        .without_effect
        .iter()
        .map(|operation| format!("`{}` in none of its {} uses", operation.operation, operation.uses))
        .collect();
    (!operations.is_empty())
        .then(|| format!("without effect: {}; these tests say nothing about what it would do", join_words(&operations)))
}

/// The coverage in words: `54 of 108 cells covered (50 %), 56 % of the 96 that can be reached`.
pub(crate) fn coverage_sentence(coverage: &CoverageSummary) -> String {
    let CoverageSummary { covered, cells, feasible, .. } = *coverage;
    let percent = |share: f64| fixed(100.0 * share, usize::from(share < 0.1));
    let known = if coverage.feasible_exact { "" } else { ", as far as known" };
    format!(
        "{covered} of {cells} cells covered ({} %), {} % of the {feasible} that can be reached{known}",
        percent(coverage.coverage),
        percent(coverage.feasible_coverage),
    )
}

/// How many runs confirmed findings of how many tests, in a sentence; `None` if no test was run again.
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
    let surprises = tests.iter().filter(|test| test.findings.iter().any(|finding| !finding.first)).count();
    if surprises > 0 {
        let tests = plural(surprises, "test shows", "tests show");
        let _ = write!(sentence, "; {tests} a finding that its first run did not");
    }
    Some(sentence)
}

/// How many of these tests are confirmed, flaky and not confirmed, as in `4 confirmed, 1 flaky`; empty for tests
/// without findings.
fn standings(tests: &[&ConfirmedTest]) -> String {
    let words = [Standing::Confirmed, Standing::Flaky, Standing::NotConfirmed].into_iter().filter_map(|standing| {
        let count = tests.iter().filter(|test| test.standing == Some(standing)).count();
        (count > 0).then(|| format!("{count} {}", standing.words()))
    });
    join_words(&words.collect::<Vec<_>>())
}

/// How many tests with violations were run once only, in a sentence; `None` if there are none, and if a reader does not
/// expect that tests were run again.
pub(crate) fn once_sentence(summary: &Summary) -> Option<String> {
    let expected = summary.confirmation.is_some() || !summary.confirmed.is_empty();
    let tests = plural(summary.once, "test that violates a requirement was", "tests that violate a requirement were");
    (expected && summary.once > 0).then(|| format!("{tests} run once only"))
}

/// How the values of a confirmed front were computed, in a sentence.
pub(crate) fn values_sentence(confirmation: Confirmation) -> String {
    let runs = plural(confirmation.times as usize, "fresh run", "fresh runs");
    match confirmation.by {
        Statistic::Mean => format!("Values are means of {runs} of each test."),
        Statistic::Median => format!("Values are medians of {runs} of each test."),
        Statistic::Quantile { share } => {
            format!("Values are those that {} % of {runs} of each test reach or exceed.", number::number(100.0 * share))
        }
    }
}

/// How a test ended, in a sentence.
pub(crate) fn outcome_sentence(test: &TestReport) -> String {
    let mut sentence = match &test.detail {
        Some(detail) => format!("{} at {} s: {}", outcome_words(&test.outcome), fixed(test.end, 2), visible(detail)),
        None => format!("{} at {} s", outcome_words(&test.outcome), fixed(test.end, 2)),
    };
    let _ =
        write!(sentence, ", {}", plural(usize::try_from(test.messages).unwrap_or(usize::MAX), "message", "messages"));
    if let Some(generation) = test.generation.filter(|_| test.repeats.is_none()) {
        let _ = write!(sentence, ", generation {generation}");
    }
    if let Some(original) = &test.duplicate_of {
        let _ = write!(sentence, ", result taken from the equal test {original}");
    }
    if test.front {
        sentence.push_str(", on the front");
    }
    sentence
}

/// When a requirement that a run violates was violated in it; a dash if the run does not violate it.
pub(crate) fn beyond_text(requirement: &VerdictReport) -> String {
    match requirement.first {
        _ if requirement.unrecorded => "not recorded".to_owned(),
        Verdict::Violated => spans_text(&requirement.outside),
        Verdict::Satisfied | Verdict::Inconclusive => spans_text(&[]),
    }
}

/// What a column of [`beyond_text`] means, if it says anything.
pub(crate) fn beyond_sentence(requirements: &[VerdictReport]) -> Option<&'static str> {
    let said = requirements.iter().any(|shown| shown.first == Verdict::Violated && !shown.outside.is_empty());
    said.then_some(
        "Beyond bound: when the metric's value up to then violated the requirement (a maximum that has crossed an upper \
         bound stays beyond it); for a robustness, when its signal did.",
    )
}

/// A metric's value in a run, of a robustness with the time that decided it: `-2.25 m at 41.20 s`.
pub(crate) fn verdict_value_text(requirement: &VerdictReport) -> String {
    match requirement.decided_at {
        Some(at) => format!("{} at {at:.2} s", requirement.value),
        None => requirement.value.clone(),
    }
}

/// What an operation did, in words, as in `2450 seen, 2450 changed from 8.00 to 56.98 s`.
pub(crate) fn effect_text(operation: &OperationReport) -> String {
    let Some(counters) = operation.counters else { return "unknown".to_owned() };
    let Counters { seen, changed, dropped, delayed, queued, injected, side_effects, unheard } = counters;
    // An operation on a node sees no messages.
    let mut words = if operation.resource.is_some() { Vec::new() } else { vec![format!("{seen} seen")] };
    let named = [
        (changed, "changed"),
        (dropped, "dropped"),
        (delayed, "delayed"),
        (queued, "queued behind them after the window"),
        (injected, "injected"),
        (side_effects, "side effects"),
        (unheard, "disturbed without a receiver"),
    ];
    words.extend(named.iter().filter(|(count, _)| *count > 0).map(|(count, name)| format!("{count} {name}")));
    if !counters.any_effect() {
        words.push("no effect".to_owned());
    }
    let mut text = words.join(", ");
    if let (Some(first), Some(last)) = (operation.first_touch, operation.last_touch) {
        let _ = write!(text, " from {first:.2} to {last:.2} s");
    }
    text
}

/// How often a requirement was violated, as in `7 of 10 [40 %, 89 %]`.
pub(crate) fn rate_text(rate: &ViolationRate) -> String {
    let Some(interval) = rate.interval else { return "all runs inconclusive".to_owned() };
    let [low, high] = interval.map(|share| format!("{:.0} %", share * 100.0));
    format!("{} of {} [{low}, {high}]", rate.violated, rate.conclusive)
}

/// Whether it is as expected.
pub(crate) fn as_expected(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Satisfied => "yes",
        Verdict::Violated => "no",
        Verdict::Inconclusive => "inconclusive",
    }
}

/// The result of a shrink, in a sentence.
pub(crate) fn shrinking_sentence(shrinking: &Shrinking) -> String {
    let tried = plural(shrinking.steps.len(), "test was tried", "tests were tried");
    match (&shrinking.before, &shrinking.after) {
        (None, _) => format!("{} has not run yet", shrinking.test),
        (Some(_), None) => {
            format!("{} did not fail again, so nothing was shrunk; it {} once", shrinking.test, shrinking.fails)
        }
        (Some(_), Some(after)) if shrinking.minimal => {
            format!("{} {}; {tried}, and it cannot be shrunk by one more step", after.test, shrinking.fails)
        }
        (Some(_), Some(after)) => {
            format!("{} {}; {tried}, and more evaluations could perhaps shrink it further", after.test, shrinking.fails)
        }
    }
}

/// What a smallest test needs, in sentences: which messages, and when its operations have to act, as far as that was
/// asked for.
pub(crate) fn needs_sentences(shrinking: &Shrinking) -> Vec<String> {
    let messages = shrunk_messages_sentence(shrinking);
    messages.into_iter().chain(trigger_sentences(shrinking)).collect()
}

/// When the operations of a smallest test have to act, a sentence for each; none if that was not asked for.
fn trigger_sentences(shrinking: &Shrinking) -> Vec<String> {
    let of = |ShrinkTrigger { operation, text, fresh: Agreement { right, of }, .. }: &ShrinkTrigger| match text {
        Some(text) => format!("{operation} {text}: so it was with {right} of {of} fresh windows"),
        None if *of > 0 => format!(
            "When {operation} has to act is not described by what happens in the undisturbed run: the best description \
             holds for only {right} of {of} fresh windows"
        ),
        None => format!("When {operation} has to act is not known: too few variations were run"),
    };
    shrinking.when.iter().flatten().map(of).collect()
}

/// How far a test was reduced to single messages, in a sentence; `None` if that was not asked for.
fn shrunk_messages_sentence(shrinking: &Shrinking) -> Option<String> {
    let (after, ShrunkMessages { reduced, text, left }) = (shrinking.after.as_ref()?, shrinking.messages.as_ref()?);
    Some(match (reduced, left.len()) {
        (false, _) => format!("{} was not reduced to single messages: {text}", after.test),
        (true, 1) => format!("What it needs is {text}"),
        (true, _) if shrinking.minimal => format!("What it needs are {text}: without any single one it does not fail"),
        (true, _) => format!("What it needs are at most {text}"),
    })
}
