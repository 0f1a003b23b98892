//! Reports as text for a terminal.

use std::fmt::Write as _;

use sesame_base::observation::Counters;
use sesame_plan::Span;

use crate::record::{MetricValue, Verdict};
use crate::report::confirmed::{ConfirmedTest, confirmation_sentence, once_sentence, tally_words, values_sentence};
use crate::report::coverage::coverage_sentence;
use crate::report::number::{self, fixed, join_words, plural, with_unit};
use crate::report::repetition::{Repetition, ViolationRate};
use crate::report::show::{OperationReport, TestList, TestReport};
use crate::report::shrinking;
use crate::report::stacked::Stacked;
use crate::report::summary::{ExpectationSummary, FrontTest, Objective, Spread, Summary, value_text};
use crate::report::table::{Align, Table, TextOptions, visible, wrap};

pub(super) fn left(title: &str) -> (String, Align) {
    (title.to_owned(), Align::Left)
}

pub(super) fn right(title: &str) -> (String, Align) {
    (title.to_owned(), Align::Right)
}

/// The whole in one sentence: `Front of 6 tests, 2 requirements violated (R1 by 31 tests, R4 by 3)`.
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
    if !summary.objectives.is_empty() {
        parts.push(format!("front of {}", plural(summary.front.len(), "test", "tests")));
    }
    parts.push(match violated.len() {
        0 if summary.requirements.is_empty() => "no requirements".to_owned(),
        0 => "no requirement violated".to_owned(),
        n => format!("{} violated ({})", plural(n, "requirement", "requirements"), violated.join(", ")),
    });
    let satisfied = summary.expectations.iter().filter(|expectation| expectation.verdict == Verdict::Satisfied).count();
    match summary.expectations.len() {
        0 => {}
        all if satisfied == all => parts.push(plural(all, "expectation satisfied", "expectations satisfied")),
        all => parts.push(format!("{satisfied} of {} satisfied", plural(all, "expectation", "expectations"))),
    }
    for (word, several) in [("crash", "crashes"), ("timeout", "timeouts")] {
        let count = summary.failures.iter().filter(|failure| failure.outcome == word && failure.stands()).count();
        if count > 0 {
            parts.push(plural(count, word, several));
        }
    }
    let mut sentence = parts.join(", ");
    if let Some(first) = sentence.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    sentence
}

/// What a campaign found: the front, the requirements, crashes and timeouts, and how many tests had no effect.
pub fn summary_text(summary: &Summary, options: TextOptions) -> String {
    let mut text = String::new();
    paragraph(&mut text, &headline(summary), options);
    if !summary.front.is_empty() {
        text.push_str(&front(summary).render(options));
        if let Some(confirmation) = summary.confirmation {
            paragraph(&mut text, &values_sentence(confirmation), options);
        }
    }
    if let Some(shrinking) = &summary.shrinking {
        shrinking::text(&mut text, shrinking, options);
    }
    if summary.objectives.is_empty() && !summary.spreads.is_empty() && summary.shrinking.is_none() {
        section(&mut text, "Values", &spreads(&summary.spreads), options);
    }
    if !summary.requirements.is_empty() {
        section(&mut text, "Requirements", &requirements(summary), options);
    }
    if !summary.expectations.is_empty() {
        let mut table =
            Table::new([left("regression test"), left("test"), left("value"), left("expected"), left("as expected")]);
        for expectation in &summary.expectations {
            table.row([
                expectation.known_test.clone(),
                expectation.test.clone(),
                format!("{} {}", expectation.metric, expectation_value(expectation)),
                expectation.bound.clone(),
                came_out(expectation.verdict).to_owned(),
            ]);
        }
        section(&mut text, "Regression tests", &table, options);
    }
    if let Some(repetition) = &summary.repetition
        && !repetition.requirements.is_empty()
    {
        section(&mut text, &format!("{} repeated", repetition.test), &repeated(repetition), options);
    }
    if !summary.failures.is_empty() {
        let again = summary.failures.iter().any(|failure| failure.again.is_some());
        let mut columns = vec![left("test"), left("outcome"), right("at")];
        columns.extend(again.then(|| left("seen again")));
        columns.push(left("cause"));
        let mut table = Table::new(columns);
        for failure in &summary.failures {
            let at = with_unit(fixed(failure.at, 2), Some("s"));
            let mut cells = vec![failure.test.clone(), failure.outcome.clone(), at];
            cells.extend(again.then(|| failure.again_words()));
            cells.push(failure.detail.clone());
            table.row(cells);
        }
        section(&mut text, "Crashes and timeouts", &table, options);
    }
    if !summary.not_finite.is_empty() {
        let mut table = Table::new([left("test"), right("at"), left("read by")]);
        for found in &summary.not_finite {
            table.row([found.test.clone(), with_unit(fixed(found.at, 2), Some("s")), found.metrics.join(", ")]);
        }
        section(&mut text, "Numbers that are not finite", &table, options);
    }
    text.push('\n');
    if let Some(coverage) = &summary.coverage {
        paragraph(&mut text, &coverage_sentence(coverage), options);
    }
    paragraph(&mut text, &counts_sentence(summary), options);
    if let Some(sentence) = confirmation_sentence(&summary.confirmed) {
        paragraph(&mut text, &sentence, options);
    }
    if let Some(sentence) = once_sentence(summary.once, confirms(summary)) {
        paragraph(&mut text, &sentence, options);
    }
    for warning in &summary.warnings {
        paragraph(&mut text, &format!("warning: {}", visible(warning)), options);
    }
    text
}

/// Whether a reader may expect that tests were run again.
fn confirms(summary: &Summary) -> bool {
    summary.confirmation.is_some() || !summary.confirmed.is_empty()
}

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

pub(super) fn paragraph(text: &mut String, sentence: &str, options: TextOptions) {
    for line in wrap(sentence, options.width.unwrap_or(usize::MAX)) {
        text.push_str(&line);
        text.push('\n');
    }
}

pub(super) fn section(text: &mut String, title: &str, table: &Table, options: TextOptions) {
    text.push('\n');
    text.push_str(&options.heading(title));
    text.push('\n');
    text.push_str(&table.render(options));
}

fn front(summary: &Summary) -> Table {
    let mut columns = vec![left("test")];
    columns.extend(summary.objectives.iter().map(|objective| right(&objective.metric)));
    columns.push(left("violates"));
    let again = confirmed_column(summary);
    columns.extend(again.is_some().then(|| left("confirmed")));
    let stacked = stacked_column(summary);
    columns.extend(stacked.is_some().then(|| left("at once")));
    columns.push(left("operations"));
    let mut table = Table::new(columns);
    let values = objective_columns(summary);
    for (row, test) in summary.front.iter().enumerate() {
        let mut cells = vec![test.test.clone()];
        cells.extend(values.iter().map(|column| column[row].clone()));
        cells.push(test.violates.join(" "));
        cells.extend(again.as_ref().map(|column| column[row].clone()));
        cells.extend(stacked.as_ref().map(|column| column[row].clone()));
        cells.push(test.operations.clone());
        table.row(cells);
    }
    table
}

/// How often findings of the tests on the front were seen again; `None` if none of them was run again.
pub(crate) fn confirmed_column(summary: &Summary) -> Option<Vec<String>> {
    let of = |number: u32| summary.confirmed.iter().find(|test| test.number == number);
    let any = summary.front.iter().any(|test| of(test.number).is_some());
    any.then(|| summary.front.iter().map(|test| of(test.number).map_or("–".to_owned(), ConfirmedTest::words)).collect())
}

/// Which operations' copies acted at the same time, and their sum; `None` if none did.
pub(crate) fn stacked_column(summary: &Summary) -> Option<Vec<String>> {
    let words = |test: &FrontTest| test.stacked.iter().map(Stacked::words).collect::<Vec<_>>().join("; ");
    let any = summary.front.iter().any(|test| !test.stacked.is_empty());
    any.then(|| summary.front.iter().map(words).collect())
}

/// The front's values in words, a column per objective.
pub(crate) fn objective_columns(summary: &Summary) -> Vec<Vec<String>> {
    let columns = summary.objectives.iter().enumerate().map(|(at, Objective { unit, .. })| {
        let values = || summary.front.iter().map(move |test| test.values.get(at).copied().flatten());
        let decimals = number::decimals(values().flatten());
        let word =
            |value: Option<f64>| value.map_or("–".to_owned(), |x| with_unit(fixed(x, decimals), unit.as_deref()));
        values().map(word).collect()
    });
    columns.collect()
}

fn requirements(summary: &Summary) -> Table {
    let again = !summary.confirmed.is_empty();
    let mut columns = vec![left("name"), left("bound"), right("violated"), right("satisfied"), right("inconclusive")];
    columns.extend(again.then(|| left("run again")));
    columns.extend([left("reference run"), left("worst"), left("sentence")]);
    let mut table = Table::new(columns);
    for requirement in &summary.requirements {
        let mut cells = vec![
            requirement.requirement.clone(),
            format!("{} {}", requirement.metric, requirement.bound),
            requirement.violated.to_string(),
            requirement.satisfied.to_string(),
            requirement.inconclusive.to_string(),
        ];
        cells.extend(again.then(|| requirement.standings()));
        cells.extend([
            requirement.reference.map_or("–", Verdict::word).to_owned(),
            requirement.worst.as_ref().map_or("–".to_owned(), |worst| format!("{} {}", worst.test, worst.text)),
            requirement.text.clone(),
        ]);
        table.row(cells);
    }
    table
}

fn repeated(repetition: &Repetition) -> Table {
    let mut table = Table::new([left("requirement"), left("violated"), left("sentence")]);
    for requirement in &repetition.requirements {
        table.row([requirement.requirement.clone(), rate_text(requirement), requirement.text.clone()]);
    }
    table
}

/// How often a requirement was violated, as in `7 of 10 [40 %, 89 %]`.
pub(crate) fn rate_text(rate: &ViolationRate) -> String {
    let Some(interval) = rate.interval else { return "all runs inconclusive".to_owned() };
    let [low, high] = interval.map(|share| format!("{:.0} %", share * 100.0));
    format!("{} of {} [{low}, {high}]", rate.violated, rate.conclusive)
}

/// The value that is compared with the expected one, with all its digits.
pub(crate) fn expectation_value(expectation: &ExpectationSummary) -> String {
    expectation.value.map_or("unmeasured".to_owned(), number::exact)
}

/// Whether it is as expected.
pub(crate) fn came_out(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Satisfied => "yes",
        Verdict::Violated => "no",
        Verdict::Inconclusive => "inconclusive",
    }
}

fn spreads(spreads: &[Spread]) -> Table {
    let mut table =
        Table::new([left("metric"), right("tests"), right("least"), right("median"), right("most"), left("unit")]);
    for spread in spreads {
        let decimals = number::decimals([spread.min, spread.median, spread.max]);
        table.row([
            spread.metric.clone(),
            spread.count.to_string(),
            fixed(spread.min, decimals),
            fixed(spread.median, decimals),
            fixed(spread.max, decimals),
            spread.unit.clone().unwrap_or_default(),
        ]);
    }
    table
}

/// All tests of a campaign, a line each; `*` marks those on the front.
pub fn list_text(list: &TestList, options: TextOptions) -> String {
    let mut columns = vec![left("test"), left("origin"), right("gen"), left("outcome")];
    columns.extend(list.metrics.iter().zip(&list.units).map(|(metric, unit)| match unit {
        Some(unit) => right(&format!("{metric} [{unit}]")),
        None => right(metric),
    }));
    columns.extend([left("violates"), left("operations")]);
    let mut table = Table::new(columns);
    let decimals: Vec<usize> = (0..list.metrics.len())
        .map(|at| number::decimals(list.tests.iter().filter_map(|test| test.values.get(at)?.value)))
        .collect();
    for test in &list.tests {
        let mut cells = vec![
            format!("{}{}", test.test, if test.front { "*" } else { "" }),
            test.origin.clone(),
            test.generation.map_or(String::new(), |generation| generation.to_string()),
            test.duplicate_of
                .as_ref()
                .map_or_else(|| outcome_words(&test.outcome), |original| format!("as {original}")),
        ];
        cells.extend(decimals.iter().enumerate().map(|(at, &decimals)| {
            test.values.get(at).and_then(|shown| shown.value).map_or("–".to_owned(), |value| fixed(value, decimals))
        }));
        cells.extend([test.violates.join(" "), test.operations.clone()]);
        table.row(cells);
    }
    table.render(options)
}

/// Everything on one test.
pub fn test_text(test: &TestReport, options: TextOptions) -> String {
    let mut text = String::new();
    paragraph(&mut text, &options.heading(&format!("{} ({})", test.test, test.origin)), options);
    paragraph(&mut text, &outcome_sentence(test), options);
    if !test.parents.is_empty() {
        paragraph(&mut text, &format!("parents {}", join_words(&test.parents)), options);
    }
    paragraph(&mut text, &format!("simulator seed {}", test.simulator_seed), options);
    if !test.operations.is_empty() {
        let mut table = Table::new([
            left("operation"),
            left("kind"),
            left("topic"),
            left("planned"),
            left("observed"),
            left("choices"),
            left("effect"),
        ]);
        for operation in &test.operations {
            table.row([
                operation.operation.clone(),
                operation.kind.clone(),
                operation.topic.clone().unwrap_or_default(),
                planned_text(operation),
                operation.observed.as_deref().map_or("unknown".to_owned(), spans_text),
                choices_text(operation),
                effect_text(operation),
            ]);
        }
        section(&mut text, "Operations", &table, options);
    }
    for stacked in &test.stacked {
        paragraph(&mut text, &stacked.words(), options);
    }
    let mut table = Table::new([left("metric"), left("value"), right("changes")]);
    for metric in &test.metrics {
        let shown = MetricValue::whole(metric.value, metric.set);
        table.row([metric.metric.clone(), value_text(shown, metric.unit.as_deref()), metric.changes.to_string()]);
    }
    section(&mut text, "Metrics", &table, options);
    if !test.requirements.is_empty() {
        let again = test.requirements.iter().any(|requirement| requirement.fresh.is_some());
        let mut columns = vec![left("name"), left("verdict"), left("bound")];
        if again {
            columns.extend([left("violated in fresh runs"), left("in the first run")]);
        }
        columns.extend([left("value"), left("outside"), left("sentence")]);
        let mut table = Table::new(columns);
        for requirement in &test.requirements {
            let mut cells = vec![
                requirement.requirement.clone(),
                requirement.verdict.word().to_owned(),
                format!("{} {}", requirement.metric, requirement.bound),
            ];
            if let Some(fresh) = &requirement.fresh {
                cells.extend([tally_words(fresh.tally), requirement.first.word().to_owned()]);
            }
            cells.extend([requirement.value.clone(), spans_text(&requirement.outside), requirement.text.clone()]);
            table.row(cells);
        }
        section(&mut text, "Requirements", &table, options);
    }
    if let Some(confirmed) = &test.confirmed {
        section(&mut text, "Run again", &run_again(confirmed), options);
    }
    for warning in &test.warnings {
        paragraph(&mut text, &format!("warning: {}", visible(warning)), options);
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
    let mut table = Table::new([left("test"), left("finding"), left("seen again")]);
    for test in tests {
        if test.findings.is_empty() {
            table.row([test.test.clone(), "nothing".to_owned(), plural(test.repetitions, "run", "runs")]);
        }
        for finding in &test.findings {
            table.row([test.test.clone(), finding.finding.clone(), finding.words()]);
        }
    }
    table.render(options)
}

/// Findings of a test, and how often each was seen again.
fn run_again(confirmed: &ConfirmedTest) -> Table {
    let mut table = Table::new([left("finding"), left("seen again")]);
    if confirmed.findings.is_empty() {
        table.row(["nothing".to_owned(), plural(confirmed.repetitions, "run", "runs")]);
    }
    for finding in &confirmed.findings {
        table.row([finding.finding.clone(), finding.words()]);
    }
    table
}

/// The word of an outcome as prose has it.
fn outcome_words(word: &str) -> String {
    word.replace('_', " ")
}

/// How a test ended, in a sentence.
pub(crate) fn outcome_sentence(test: &TestReport) -> String {
    let mut sentence = match &test.detail {
        Some(detail) => format!("{} at {} s: {}", test.outcome, fixed(test.end, 2), visible(detail)),
        None => format!("{} at {} s", outcome_words(&test.outcome), fixed(test.end, 2)),
    };
    let _ =
        write!(sentence, ", {}", plural(usize::try_from(test.messages).unwrap_or(usize::MAX), "message", "messages"));
    if let Some(generation) = test.generation {
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

/// When an operation was to be active: its window, or the conditions that switched it; a dash for an offline one.
pub(crate) fn planned_text(operation: &OperationReport) -> String {
    match (&operation.conditions, operation.planned) {
        (Some(conditions), _) => conditions.clone(),
        (None, planned) => spans_text(planned.as_slice()),
    }
}

/// Spans in seconds, as in `8.00–57.00 s`; a dash for none.
pub(crate) fn spans_text(spans: &[Span]) -> String {
    if spans.is_empty() {
        return "–".to_owned();
    }
    let words: Vec<String> = spans.iter().take(4).map(|span| format!("{:.2}–{:.2}", span.start, span.end)).collect();
    let more = if spans.len() > 4 { format!(" and {} more", spans.len() - 4) } else { String::new() };
    format!("{} s{more}", words.join(", "))
}

/// What an operation's parameters are, in words.
pub(crate) fn choices_text(operation: &OperationReport) -> String {
    let words: Vec<&str> = operation.choices.iter().map(|choice| choice.text.as_str()).collect();
    if words.is_empty() { "–".to_owned() } else { words.join(", ") }
}

/// What an operation did, in words, as in `2450 seen, 2450 changed from 8.00 to 56.98 s`.
pub(crate) fn effect_text(operation: &OperationReport) -> String {
    let Some(counters) = operation.counters else { return "unknown".to_owned() };
    let Counters { seen, changed, dropped, delayed, queued, injected, side_effects, unheard } = counters;
    let mut words = vec![format!("{seen} seen")];
    let named = [
        (changed, "changed"),
        (dropped, "dropped"),
        (delayed, "delayed"),
        (queued, "queued behind them"),
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
