//! Reports as text for a terminal.

use std::fmt::Write as _;

use sesame_analysis::confirmed::ConfirmedTest;
use sesame_base::gathered::gathered;
use sesame_base::visible::{visible, visible_lines};
use sesame_present::number::{join_words, plural};
use sesame_present::table::{Table, TextOptions, wrap};

use crate::facts::causes::CausesSummary;
use crate::facts::certificate::campaign::MonitorsSummary;
use crate::facts::certificate::moment::MomentReport;
use crate::facts::certificate::test::MonitorReport;
use crate::facts::disturbances::disturbances_text;
use crate::facts::recording::RecordingReplay;
use crate::facts::replay::Replay;
use crate::facts::show::{TestList, TestReport};
use crate::facts::shrinking::Shrinking;
use crate::facts::summary::Summary;
use crate::facts::violated::violated_requirement;
use crate::sentences::{
    QUARANTINED, beyond_sentence, causes_sentence, confirmation_sentence, counts_sentence, coverage_sentence, headline,
    mend_sentence, monitors_run_again, monitors_sentence, needs_sentences, once_sentence, outcome_sentence,
    shrinking_sentence, values_sentence, without_effect_sentence,
};
use crate::tables;

/// Rows of a table that may be very long.
const ROWS: usize = 40;

/// What a campaign found: the front, the requirements, crashes and timeouts, and how many tests had no effect.
pub fn summary_text(summary: &Summary, options: TextOptions) -> String {
    let mut text = String::new();
    paragraph(&mut text, &headline(summary), options);
    if let Some(found) = &summary.causes {
        for (requirement, causes) in summary.violated_by_causes() {
            text.push('\n');
            paragraph(&mut text, &violated_requirement(requirement, &causes).to_string(), options);
        }
        causes(&mut text, found, options);
    }
    if !summary.front.is_empty() {
        if summary.causes.as_ref().is_some_and(|found| !found.causes.is_empty()) {
            text.push('\n');
        }
        text.push_str(&tables::front(summary).text(options));
        if let Some(confirmation) = summary.confirmation {
            paragraph(&mut text, &values_sentence(confirmation), options);
        }
    }
    if let Some(found) = &summary.shrinking {
        shrinking(&mut text, found, options);
    }
    for found in &summary.shrinkings {
        shrunk_cause(&mut text, found, options);
    }
    if summary.objectives.is_empty() && summary.shrunk().next().is_none() {
        section(&mut text, "Values", &tables::spreads(&summary.spreads), options);
    }
    section(&mut text, "Requirements", &tables::requirements(summary), options);
    if let Some(found) = &summary.monitors {
        monitors(&mut text, found, options);
    }
    if let Some(mend) = &summary.mend {
        let mut table = tables::monitors::mended(mend);
        let more = table.truncate(ROWS);
        section(&mut text, "Before and after the mend", &table, options);
        if more > 0 {
            paragraph(&mut text, &format!("and {more} more; `--format json` has all"), options);
        }
        paragraph(&mut text, &format!("{}.", mend_sentence(mend)), options);
        if let Some(difference) = &mend.difference {
            let words = format!("warning: not only the monitors differ: {}", visible(difference));
            paragraph(&mut text, &words, options);
        }
    }
    section(&mut text, "Regression tests", &tables::expectations(&summary.expectations), options);
    if let Some(repetition) = &summary.repetition {
        section(&mut text, &repetition.title, &tables::violation_rates(&repetition.requirements), options);
    }
    section(&mut text, tables::failures_title(&summary.failures), &tables::failures(&summary.failures), options);
    section(&mut text, QUARANTINED, &tables::quarantined(&summary.quarantined), options);
    section(&mut text, "Numbers that are not finite", &tables::not_finite(&summary.not_finite), options);
    text.push('\n');
    if let Some(coverage) = &summary.coverage {
        paragraph(&mut text, &coverage_sentence(coverage), options);
    }
    if let Some(sentence) = summary.pairs.as_ref().and_then(|pairs| pairs.found.sentence()) {
        paragraph(&mut text, &sentence, options);
    }
    paragraph(&mut text, &counts_sentence(summary), options);
    if let Some(sentence) = without_effect_sentence(summary) {
        paragraph(&mut text, &sentence, options);
    }
    if let Some(sentence) = confirmation_sentence(&summary.confirmed) {
        paragraph(&mut text, &sentence, options);
    }
    if let Some(sentence) = once_sentence(summary) {
        paragraph(&mut text, &sentence, options);
    }
    for warning in gathered(&summary.warnings) {
        paragraph(&mut text, &format!("warning: {}", visible(&warning)), options);
    }
    text
}

/// The causes of violations, and what is known of others.
fn causes(text: &mut String, found: &CausesSummary, options: TextOptions) {
    let mut table = tables::causes(found);
    let more = table.truncate(ROWS);
    section(text, "Causes", &table, options);
    if more > 0 {
        paragraph(text, &format!("and {more} more; `causes --format json` has all"), options);
    }
    if let Some(sentence) = causes_sentence(found) {
        paragraph(text, &sentence, options);
    }
}

/// The causes in the tests of any results.
pub fn causes_text(found: &CausesSummary, options: TextOptions) -> String {
    let mut text = String::new();
    if found.causes.is_empty() {
        paragraph(&mut text, "No test violates a requirement.", options);
    }
    causes(&mut text, found, options);
    text
}

/// What monitors were worth, missed hazards first.
fn monitors(text: &mut String, found: &MonitorsSummary, options: TextOptions) {
    let mut missed = tables::monitors::missed_hazards(found);
    let more = missed.truncate(ROWS);
    section(text, "Missed hazards", &missed, options);
    if more > 0 {
        paragraph(text, &format!("and {more} more; `list` marks them all"), options);
    }
    section(text, "Hazards", &tables::monitors::hazards(found), options);
    section(text, "Monitors", &tables::monitors::monitors(found), options);
    let sentences = [monitors_sentence(found)].into_iter().chain(monitors_run_again(found));
    let sentences = sentences.map(|sentence| format!("{sentence}.")).collect::<Vec<_>>().join(" ");
    paragraph(text, &sentences, options);
}

/// What the monitors of a test did.
fn monitors_of_test(text: &mut String, monitors: &[MonitorReport], options: TextOptions) {
    section(text, "Hazards", &tables::monitors::hazards_of_test(monitors), options);
    for (title, mut table) in [
        ("Decisions of monitors", tables::monitors::decisions(monitors)),
        ("Evidence", tables::monitors::evidence(monitors)),
    ] {
        let more = table.truncate(ROWS);
        section(text, title, &table, options);
        if more > 0 {
            paragraph(text, &format!("and {more} more; `--format json` has all"), options);
        }
    }
}

/// The certificates of a test at a moment.
pub fn moment_text(moment: &MomentReport, options: TextOptions) -> String {
    let mut text = String::new();
    let at = tables::monitors::seconds(moment.at);
    paragraph(&mut text, &options.heading(&format!("{} at {at}", moment.test)), options);
    for monitor in &moment.monitors {
        text.push('\n');
        text.push_str(&visible_lines(&monitor.text));
        let since = tables::monitors::seconds(monitor.since);
        paragraph(&mut text, &format!("`{}` since {since}", monitor.state), options);
        for why in &monitor.why {
            paragraph(&mut text, &visible(&why.sentence), options);
            for because in &why.because {
                let _ = writeln!(text, "    {}", visible(&because.words(&monitor.monitor)));
            }
        }
    }
    text
}

/// How a test was shrunk: before and after, the accepted steps, and the block.
fn shrinking(text: &mut String, shrinking: &Shrinking, options: TextOptions) {
    let sizes = tables::sizes(shrinking);
    text.push('\n');
    text.push_str(&options.heading(&format!("{} shrunk", shrinking.test)));
    text.push('\n');
    if !sizes.is_empty() {
        text.push_str(&sizes.text(options));
    }
    paragraph(text, &format!("{}.", shrinking_sentence(shrinking)), options);
    for sentence in needs_sentences(shrinking) {
        paragraph(text, &format!("{sentence}."), options);
    }
    if shrinking.steps.iter().filter(|step| step.kept).count() > 1 {
        section(text, "Accepted steps", &tables::accepted_steps(shrinking), options);
        paragraph(text, "Tests that did not fail are on the page, and in the results as JSON.", options);
    }
    section(text, "Thresholds", &tables::thresholds(shrinking), options);
    if let Some(block) = &shrinking.block {
        text.push('\n');
        text.push_str(block);
    }
}

/// How the smallest test of a cause was shrunk, in short.
fn shrunk_cause(text: &mut String, shrinking: &Shrinking, options: TextOptions) {
    text.push('\n');
    text.push_str(&options.heading(&format!("{}, which {}", shrinking.test, shrinking.fails)));
    text.push('\n');
    paragraph(text, &format!("{}.", shrinking_sentence(shrinking)), options);
    if !shrinking.operations.is_empty() {
        paragraph(text, &format!("It does: {}.", disturbances_text(&shrinking.operations)), options);
    }
    for sentence in needs_sentences(shrinking) {
        paragraph(text, &format!("{sentence}."), options);
    }
    let thresholds = tables::thresholds(shrinking);
    if !thresholds.is_empty() {
        text.push_str(&thresholds.text(options));
    }
    if let Some(block) = &shrinking.block {
        text.push('\n');
        text.push_str(block);
    }
}

/// All tests of a campaign, a line each; `*` marks those on the front.
pub fn list_text(list: &TestList, options: TextOptions) -> String {
    tables::list(list).text(options)
}

/// Everything on one test.
pub fn test_text(test: &TestReport, options: TextOptions) -> String {
    let mut text = String::new();
    paragraph(
        &mut text,
        &options.heading(&format!("{} ({})", test.test, test.repeats.unwrap_or(&test.origin))),
        options,
    );
    paragraph(&mut text, &outcome_sentence(test), options);
    if !test.parents.is_empty() {
        let parents: Vec<String> = test.parents.iter().map(ToString::to_string).collect();
        paragraph(&mut text, &format!("parents {}", join_words(&parents)), options);
    }
    paragraph(&mut text, &format!("simulator seed {}", test.simulator_seed), options);
    section(&mut text, "Operations", &tables::operations(&test.operations), options);
    for stacked in &test.stacked {
        paragraph(&mut text, &stacked.words(), options);
    }
    section(&mut text, "Metrics", &tables::metrics(&test.metrics), options);
    section(&mut text, "Requirements", &tables::verdicts(&test.requirements), options);
    if let Some(sentence) = beyond_sentence(&test.requirements) {
        paragraph(&mut text, sentence, options);
    }
    monitors_of_test(&mut text, &test.monitors, options);
    if let Some(confirmed) = &test.confirmed {
        section(&mut text, "Run again", &tables::findings(confirmed), options);
    }
    for warning in gathered(&test.warnings) {
        paragraph(&mut text, &format!("warning: {}", visible(&warning)), options);
    }
    for line in test.notes.iter().flat_map(|note| note.lines()) {
        paragraph(&mut text, &visible(line), options);
    }
    if let Some(trace) = &test.trace {
        paragraph(&mut text, &format!("trace {}", visible(&trace.display().to_string())), options);
    }
    text
}

/// Findings of tests that were run again, and how often each was seen again: a line for each finding.
pub fn confirmed_text(tests: &[ConfirmedTest], options: TextOptions) -> String {
    tables::confirmed(tests).text(options)
}

/// A replay in words.
pub fn replay_text(replay: &Replay, options: TextOptions) -> String {
    let Replay { test, simulator_seed, differences, .. } = replay;
    if replay.same {
        return format!("{test} came out the same, bit for bit (simulator seed {simulator_seed})\n");
    }
    let count = plural(differences.len(), "difference", "differences");
    let table = tables::differences(differences).text(options);
    format!("{test} came out different (simulator seed {simulator_seed}): {count}\n{table}")
}

/// What metrics make of a recording, in words.
pub fn recording_text(replay: &RecordingReplay, options: TextOptions) -> String {
    let name = replay.run.clone().unwrap_or_else(|| "a recording that no runner made".to_owned());
    let messages = usize::try_from(replay.messages).unwrap_or(usize::MAX);
    let table = tables::fed_metrics(&replay.metrics).text(options);
    format!("{name}: {} fed\n{table}", plural(messages, "message", "messages"))
}

pub(super) fn paragraph(text: &mut String, sentence: &str, options: TextOptions) {
    for line in wrap(sentence, options.width.unwrap_or(usize::MAX)) {
        text.push_str(&line);
        text.push('\n');
    }
}

/// A table under its title; nothing if it has no rows.
pub(super) fn section(text: &mut String, title: &str, table: &Table, options: TextOptions) {
    if table.is_empty() {
        return;
    }
    text.push('\n');
    text.push_str(&options.heading(title));
    text.push('\n');
    text.push_str(&table.text(options));
}

#[cfg(test)]
mod tests {
    use sesame_base::test_number::TestNumber;
    use sesame_record::{Difference, MetricValue};

    use super::*;
    use crate::facts::recording::{FedMetric, Sameness};

    #[test]
    fn a_replay_says_what_differs() {
        let options = TextOptions { width: None, colour: false };
        let same = Replay { test: TestNumber(5), simulator_seed: 7, same: true, differences: vec![] };
        assert_eq!(replay_text(&same, options), "T5 came out the same, bit for bit (simulator seed 7)\n");
        let words = |what: &str, before: &str, after: &str| Difference {
            what: what.to_owned(),
            before: before.to_owned(),
            after: after.to_owned(),
        };
        let differences = vec![
            words("the outcome", "completed", "crash: gone"),
            words("metric `cycle_time`", "68.20000000000001", "68.2"),
        ];
        insta::assert_snapshot!(replay_text(&Replay { same: false, differences, ..same }, options));
    }

    #[test]
    fn each_metric_stands_beside_what_was_recorded() {
        let metric = |name: &str, now: Option<f64>, recorded, sameness| FedMetric {
            metric: name.to_owned(),
            unit: (name == "cycle_time").then(|| "s".to_owned()),
            now: MetricValue::whole(now, now.is_some()),
            recorded,
            sameness,
        };
        let replay = RecordingReplay {
            recording: "T5.mcap".into(),
            run: Some("T5 of coverage_experiment (completed)".to_owned()),
            messages: 1_200,
            same: false,
            metrics: vec![
                metric("collisions", Some(18.0), Some(17.0), Sameness::Differs),
                metric("cycle_time", Some(68.2), Some(68.2), Sameness::Equal),
                metric("clearance", None, None, Sameness::NotRecorded),
            ],
            warnings: vec![],
        };
        insta::assert_snapshot!(recording_text(&replay, TextOptions { width: None, colour: false }));
    }
}
