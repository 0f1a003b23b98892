//! A test on the page: its heading, its timeline, and everything on it as tables.

use std::path::Path;

use sesame_base::gathered::gathered;
use sesame_present::markup::Markup;
use sesame_record::{RecordError, Repository, TRACES, Verdict};

use crate::export::{Expected, ExportError, export};
use crate::facts::show::{TestReport, report_on};
use crate::facts::summary::Summary;
use crate::html::command;
use crate::html::timeline::timeline;
use crate::sentences::{beyond_sentence, outcome_sentence};
use crate::tables;

/// Rows of a table that may be very long.
const ROWS: usize = 50;

/// Draws a test of these results; `folder` is the path of the run's folder relative to the page.
pub(super) fn test(
    body: &mut Markup,
    repository: &Repository,
    summary: &Summary,
    number: u32,
    folder: &Path,
) -> Result<(), RecordError> {
    let record = repository.test(number)?;
    let ran = record.duplicate_of.unwrap_or(number);
    let on_front = summary.front.iter().any(|test| test.number == number);
    let report = report_on(repository.plan(), repository.task(), &record, repository.judge()?.runs(ran), on_front);
    body.open("article", &[("class", "test"), ("id", &report.test.to_string())]);
    heading(body, summary, &report);
    timeline(body, repository.plan(), &record, &report);
    let (before, after) = command::show(repository.plan(), repository.folder());
    let block = match export(repository, &report.test.to_string(), None, Expected::Requirements) {
        Ok(exported) => Some(exported.block),
        Err(ExportError::NotWhole(_) | ExportError::Undisturbed(_)) => None,
        Err(ExportError::Record(error)) => return Err(error),
    };
    figures(body, &report, block.as_deref(), &format!("{before}{}{after}", report.test));
    if let Some(name) = repository.trace(number, record.duplicate_of).as_deref().and_then(Path::file_name) {
        trace_link(body, &folder.join(TRACES).join(name));
    }
    body.close();
    Ok(())
}

fn heading(body: &mut Markup, summary: &Summary, report: &TestReport) {
    body.open("h3", &[]);
    body.text(&report.test.to_string());
    if report.origin != "search" || report.repeats.is_some() {
        body.element("span", &[("class", "quiet")], &format!(" {}", report.repeats.unwrap_or(&report.origin)));
    }
    for requirement in report.requirements.iter().filter(|requirement| requirement.verdict == Verdict::Violated) {
        body.element("span", &[("class", "chip"), ("title", &requirement.text)], &requirement.requirement);
    }
    for monitor in &report.monitors {
        for hazard in monitor.missed() {
            let title = format!(
                "{} had not foreseen the hazard of {} at {:.3} s",
                monitor.monitor, hazard.requirement, hazard.at
            );
            let words = format!("hazard of {} missed by {}", hazard.requirement, monitor.monitor);
            body.element("span", &[("class", "chip missed"), ("title", &title)], &words);
        }
    }
    body.close();
    let values: Vec<String> = summary
        .objectives
        .iter()
        .filter_map(|objective| {
            let metric = report.metrics.iter().find(|metric| metric.metric == objective.metric)?;
            Some(format!("{} {}", metric.metric, metric.value_text()))
        })
        .collect();
    body.element("p", &[("class", "values")], &values.join(" · "));
}

/// Everything on a test as tables, folded away, with the test in the words of the language, and the command that prints
/// it.
fn figures(body: &mut Markup, report: &TestReport, block: Option<&str>, command: &str) {
    body.open("details", &[]);
    body.element("summary", &[], "Figures");
    body.element(
        "p",
        &[("class", "quiet")],
        &format!("{}. Simulator seed {}.", outcome_sentence(report), report.simulator_seed),
    );
    if !report.operations.is_empty() {
        tables::operations(&report.operations).html(body, &[]);
    }
    for stacked in &report.stacked {
        body.element("p", &[("class", "quiet")], &stacked.words());
    }
    tables::metrics(&report.metrics).html(body, &[]);
    if !report.requirements.is_empty() {
        tables::verdicts(&report.requirements).html(body, &[]);
        if let Some(sentence) = beyond_sentence(&report.requirements) {
            body.element("p", &[("class", "quiet")], sentence);
        }
    }
    for mut table in [
        tables::monitors::hazards_of_test(&report.monitors),
        tables::monitors::decisions(&report.monitors),
        tables::monitors::evidence(&report.monitors),
    ] {
        let more = table.truncate(ROWS);
        if !table.is_empty() {
            table.html(body, &[]);
        }
        if more > 0 {
            body.element("p", &[("class", "quiet")], &format!("And {more} more; the test in JSON has all."));
        }
    }
    for warning in gathered(&report.warnings) {
        body.open("p", &[("class", "warning")]);
        body.prose(&format!("Warning: {warning}"));
        body.close();
    }
    if let Some(block) = block {
        body.element("p", &[("class", "quiet")], "As a regression test, for the space:");
        body.element("pre", &[], block);
    }
    body.open("p", &[("class", "quiet command")]);
    body.text("In a terminal: ");
    body.element("code", &[], command);
    body.close();
    body.close();
}

/// A link to a trace, for tools that read MCAP.
fn trace_link(body: &mut Markup, file: &Path) {
    let what = if file.extension().is_some_and(|ending| ending == "mcap") { "Trace (MCAP)" } else { "Recording" };
    body.open("p", &[("class", "quiet")]);
    body.element("a", &[("href", &file.display().to_string())], what);
    body.close();
}
