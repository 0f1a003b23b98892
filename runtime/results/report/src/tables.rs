//! The tables of reports: each is put together once, and text and HTML render it.

pub(super) mod monitors;

use sesame_analysis::causes::Fewer;
use sesame_analysis::confirmed::{ConfirmedTest, FindingAgain, tally_words};
use sesame_analysis::pairs::Untried;
use sesame_analysis::regions::Rule;
use sesame_present::number::{self, plural, titled};
use sesame_present::table::{Cell, Column, Datum, Table};
use sesame_record::{Difference, MetricValue, Verdict};

use crate::facts::causes::CausesSummary;
use crate::facts::disturbances::{choices_text, disturbances_text, planned_text, spans_text};
use crate::facts::pairs::PairsSummary;
use crate::facts::readable::short_numbers;
use crate::facts::recording::{FedMetric, Sameness};
use crate::facts::repetition::ViolationRate;
use crate::facts::show::{MetricReport, OperationReport, TestList, VerdictReport};
use crate::facts::shrinking::{NamedValue, ShrinkStep, Shrinking, TestSize};
use crate::facts::stacked::Stacked;
use crate::facts::summary::{
    ExpectationSummary, Failure, NotFinite, Objective, Quarantined, RequirementSummary, Spread, Summary,
};
use crate::facts::wording::outcome_words;
use crate::facts::wording::value_text;
use crate::sentences::{as_expected, beyond_text, effect_text, rate_text, verdict_value_text};

/// The time of a failure, in seconds.
fn at(time: f64) -> Datum {
    Datum::text(number::with_unit(number::fixed(time, 2), Some("s")))
}

/// The requirements of a campaign, and what its tests say about each.
pub(super) fn requirements(summary: &Summary) -> Table {
    let again = !summary.confirmed.is_empty();
    let mut columns = vec![Column::heading("name"), Column::line("bound"), Column::picture("tests")];
    columns.extend(["violated", "satisfied", "inconclusive"].map(Column::number));
    columns.extend(again.then(|| Column::words("run again")));
    columns.extend([Column::words("reference run"), Column::line("worst"), Column::sentence("sentence")]);
    let mut table = Table::with(columns);
    for requirement in &summary.requirements {
        let RequirementSummary { violated, satisfied, inconclusive, reference, worst, .. } = requirement;
        let shares = vec![(*violated, "violated"), (*satisfied, "satisfied"), (*inconclusive, "inconclusive")];
        let mut cells: Vec<Cell> = vec![
            Datum::text(&requirement.requirement).into(),
            Datum::text(format!("{} {}", requirement.metric, requirement.bound)).into(),
            Datum::Shares(shares).into(),
            Datum::count(*violated).bad_if(*violated > 0),
            Datum::count(*satisfied).into(),
            Datum::count(*inconclusive).into(),
        ];
        cells.extend(again.then(|| Datum::text(requirement.standings()).into()));
        let of_reference = Datum::maybe(reference.map(|verdict| verdict.word().to_owned()));
        let worst = worst.as_ref().map_or(Datum::Missing, |worst| Datum::OfTest(worst.test, worst.text.clone()));
        cells.extend([
            if *reference == Some(Verdict::Violated) { of_reference.bad_if(true) } else { of_reference.quiet() },
            worst.into(),
            Datum::text(&requirement.text).into(),
        ]);
        table.row(cells);
    }
    table
}

/// The causes of violations: a row each.
pub(super) fn causes(found: &CausesSummary) -> Table {
    let again = found.causes.iter().any(|cause| cause.again.is_some());
    let several = found.causes.iter().any(|cause| cause.fewer != Fewer::Single);
    let mut columns = vec![Column::heading("requirement"), Column::line("cause")];
    columns.extend([Column::line("violating"), Column::line("first")]);
    columns.extend(several.then(|| Column::line("with fewer")));
    columns.push(Column::words("smallest test"));
    columns.extend(again.then(|| Column::line("fresh runs")));
    columns.push(Column::sentence("what it does"));
    let mut table = Table::with(columns);
    for cause in &found.causes {
        let mut cells: Vec<Cell> = vec![
            Datum::text(&cause.requirement).bad_if(true),
            Datum::text(cause.name()).into(),
            Datum::text(format!("{} of {} with it", cause.violating, cause.held)).into(),
            Datum::Test(cause.first).into(),
        ];
        let with_fewer = (cause.fewer != Fewer::Single).then(|| cause.fewer.word().to_owned());
        cells.extend(several.then(|| Datum::maybe(with_fewer).into()));
        cells.push(Datum::Test(cause.test).into());
        cells.extend(again.then(|| Datum::maybe(cause.again.as_ref().map(FindingAgain::words)).into()));
        let what = disturbances_text(&cause.acting);
        cells.push(Datum::text(format!("{what}: {} is {}", cause.metric, cause.value)).into());
        table.row(cells);
    }
    table
}

/// The tests on the front.
pub(super) fn front(summary: &Summary) -> Table {
    let of = |number: u32| summary.confirmed.iter().find(|test| test.number == number);
    let again = summary.front.iter().any(|test| of(test.number).is_some());
    let stacked = summary.front.iter().any(|test| !test.stacked.is_empty());
    let mut columns = vec![Column::heading("test")];
    let metric = |objective: &Objective| Column::metric(&objective.metric, objective.unit.as_deref());
    columns.extend(summary.objectives.iter().map(metric));
    columns.push(Column::line("violates"));
    columns.extend(again.then(|| Column::line("confirmed")));
    columns.extend(stacked.then(|| Column::sentence("at once")));
    columns.push(Column::sentence("operations"));
    let mut table = Table::with(columns);
    for test in &summary.front {
        let mut cells: Vec<Cell> = vec![Datum::Test(test.test).into()];
        cells.extend(test.values.iter().map(|&value| Cell::from(Datum::real(value))));
        cells.push(Datum::text(test.violates.join(" ")).bad_if(true));
        cells.extend(again.then(|| Datum::maybe(of(test.number).map(ConfirmedTest::words)).into()));
        let words = || test.stacked.iter().map(Stacked::words).collect::<Vec<_>>().join("; ");
        cells.extend(stacked.then(|| Datum::Text(words()).into()));
        cells.push(Datum::text(&test.operations).into());
        table.row(cells);
    }
    table
}

/// The values of metrics: how many, between what, and how they vary.
pub(super) fn spreads(spreads: &[Spread]) -> Table {
    let mut columns = vec![Column::heading("metric")];
    columns.extend(["tests", "least", "median", "most", "mean", "deviation"].map(Column::number));
    columns.push(Column::words("unit"));
    let mut table = Table::with(columns);
    for Spread { metric, unit, count, min, median, max, mean, deviation } in spreads {
        let decimals = number::decimals([*min, *median, *max]);
        let [min, median, max] = [min, median, max].map(|value| Datum::Rounded(*value, decimals));
        // These say more than any single value does.
        let finer = |value: f64| Datum::Rounded(value, decimals + 1);
        let (mean, deviation) = (finer(*mean), deviation.map_or(Datum::Missing, finer));
        let unit = Datum::text(unit.clone().unwrap_or_default());
        table.row([Datum::text(metric), Datum::count(*count), min, median, max, mean, deviation, unit]);
    }
    table
}

/// What regression tests expect, and whether it is so.
pub(super) fn expectations(expectations: &[ExpectationSummary]) -> Table {
    let mut table = Table::with([
        Column::heading("regression test"),
        Column::words("test"),
        Column::words("metric"),
        Column::number("value"),
        Column::words("expected"),
        Column::words("as expected"),
    ]);
    for ExpectationSummary { test, known_test, metric, bound, value, verdict } in expectations {
        let mut value_text = value.map_or("unmeasured".to_owned(), number::number);
        let mut bound_text = short_numbers(bound);
        // All digits where the short ones do not show why the value is not as expected.
        if let Some(value) = value.filter(|_| *verdict == Verdict::Violated && bound_text.contains(&value_text)) {
            value_text = number::exact(value);
            bound_text.clone_from(bound);
        }
        table.row([
            Datum::text(known_test).into(),
            Datum::Test(*test).into(),
            Datum::text(metric).into(),
            Cell::from(Datum::Text(value_text)),
            Datum::Text(bound_text).into(),
            Datum::text(as_expected(*verdict)).bad_if(*verdict != Verdict::Satisfied),
        ]);
    }
    table
}

/// How often a repeated test violates each requirement.
pub(super) fn violation_rates(rates: &[ViolationRate]) -> Table {
    let columns = [Column::heading("requirement"), Column::words("violated"), Column::sentence("sentence")];
    let mut table = Table::with(columns);
    for rate in rates {
        table.row([
            Cell::from(Datum::text(&rate.requirement)),
            Datum::Text(rate_text(rate)).bad_if(rate.violated > 0),
            Datum::text(&rate.text).into(),
        ]);
    }
    table
}

/// What the table of failures is called.
pub(super) fn failures_title(failures: &[Failure]) -> &'static str {
    if failures.iter().any(Failure::is_of_environment) {
        "Crashes, timeouts, and runs that the environment broke off"
    } else {
        "Crashes and timeouts"
    }
}

/// Crashes and timeouts, and runs that the environment broke off.
pub(super) fn failures(failures: &[Failure]) -> Table {
    let again = failures.iter().any(|failure| failure.again.is_some());
    let mut columns = vec![Column::heading("test"), Column::words("outcome"), Column::number("at")];
    columns.extend(again.then(|| Column::words("seen again")));
    columns.push(Column::sentence("cause"));
    let mut table = Table::with(columns);
    for failure in failures {
        let mut cells: Vec<Cell> = vec![
            Datum::Test(failure.test).into(),
            Datum::text(outcome_words(&failure.outcome)).bad_if(!failure.is_of_environment()),
            at(failure.at).into(),
        ];
        cells.extend(again.then(|| Datum::maybe(failure.again.as_ref().map(FindingAgain::words)).into()));
        cells.push(Datum::text(&failure.detail).into());
        table.row(cells);
    }
    table
}

/// Tests that are not run again.
pub(super) fn quarantined(found: &[Quarantined]) -> Table {
    let mut table = Table::with([Column::heading("test"), Column::sentence("cause")]);
    for found in found {
        table.row([Datum::Test(found.test), Datum::text(&found.detail)]);
    }
    table
}

/// Tests in which metrics read numbers that are not finite.
pub(super) fn not_finite(found: &[NotFinite]) -> Table {
    let mut table = Table::with([Column::heading("test"), Column::number("at"), Column::sentence("read by")]);
    for found in found {
        table.row([Datum::Test(found.test), at(found.at), Datum::Text(found.metrics.join(", "))]);
    }
    table
}

/// All tests of a campaign.
pub(super) fn list(list: &TestList) -> Table {
    let mut columns =
        vec![Column::heading("test"), Column::words("origin"), Column::number("gen"), Column::words("outcome")];
    columns.extend(
        list.metrics
            .iter()
            .zip(&list.units)
            .map(|(metric, unit)| Column::metric(&titled(metric, unit.as_deref()), None)),
    );
    columns.push(Column::line("violates"));
    columns.extend(list.monitors.then(|| Column::line("missed")));
    columns.push(Column::sentence("operations"));
    let mut table = Table::with(columns);
    for test in &list.tests {
        let outcome = match test.duplicate_of {
            Some(original) => format!("as {original}"),
            None => outcome_words(&test.outcome),
        };
        let generation = test.generation.filter(|_| test.repeats.is_none());
        let mut cells = vec![
            Datum::Text(format!("{}{}", test.test, if test.front { "*" } else { "" })),
            Datum::text(test.repeats.unwrap_or(&test.origin)),
            Datum::Text(generation.map_or(String::new(), |generation| generation.to_string())),
            Datum::Text(outcome),
        ];
        let value = |at: usize| Datum::real(test.values.get(at).and_then(|shown| shown.value));
        cells.extend((0..list.metrics.len()).map(value));
        cells.push(Datum::Text(test.violates.join(" ")));
        cells.extend(list.monitors.then(|| Datum::Text(test.missed.join(", "))));
        cells.push(Datum::text(&test.operations));
        table.row(cells);
    }
    table
}

/// The operations of a test.
pub(super) fn operations(operations: &[OperationReport]) -> Table {
    let mut table = Table::with([
        Column::heading("operation"),
        Column::words("kind"),
        Column::words("acts on"),
        Column::words("planned"),
        Column::words("observed"),
        Column::words("choices"),
        Column::words("effect"),
    ]);
    for operation in operations {
        table.row([
            Datum::text(&operation.operation),
            Datum::text(&operation.kind),
            Datum::Text(operation.target_in_words()),
            Datum::Text(planned_text(operation)),
            Datum::Text(operation.observed.as_deref().map_or("unknown".to_owned(), spans_text)),
            Datum::Text(choices_text(operation)),
            Datum::Text(effect_text(operation)),
        ]);
    }
    table
}

/// The metrics of a test.
pub(super) fn metrics(metrics: &[MetricReport]) -> Table {
    let mut table = Table::with([Column::heading("metric"), Column::words("value"), Column::number("changes")]);
    for metric in metrics {
        let value = Datum::Text(metric.value_text());
        table.row([Datum::text(&metric.metric), value, Datum::count(metric.changes)]);
    }
    table
}

/// The verdicts of a test.
pub(super) fn verdicts(requirements: &[VerdictReport]) -> Table {
    let again = requirements.iter().any(|requirement| requirement.fresh.is_some());
    let mut columns = vec![Column::heading("name"), Column::words("verdict"), Column::words("bound")];
    if again {
        columns.extend(["violated in fresh runs", "in the first run"].map(Column::words));
    }
    columns.extend([Column::words("value"), Column::words("beyond bound"), Column::sentence("sentence")]);
    let mut table = Table::with(columns);
    for requirement in requirements {
        let mut cells = vec![
            Datum::text(&requirement.requirement),
            Datum::text(requirement.verdict.word()),
            Datum::Text(format!("{} {}", requirement.metric, requirement.bound)),
        ];
        if let Some(fresh) = &requirement.fresh {
            cells.extend([Datum::Text(tally_words(fresh.tally)), Datum::text(requirement.first.word())]);
        }
        cells.extend([
            Datum::Text(verdict_value_text(requirement)),
            Datum::Text(beyond_text(requirement)),
            Datum::text(&requirement.text),
        ]);
        table.row(cells);
    }
    table
}

/// The findings of a test that was run again: what each is, and how often it was seen again.
fn findings_of(confirmed: &ConfirmedTest) -> Vec<[Datum; 2]> {
    if confirmed.findings.is_empty() {
        return vec![[Datum::text("nothing"), Datum::Text(plural(confirmed.repetitions, "run", "runs"))]];
    }
    confirmed.findings.iter().map(|finding| [Datum::text(&finding.finding), Datum::Text(finding.words())]).collect()
}

/// The findings of a test that was run again.
pub(super) fn findings(confirmed: &ConfirmedTest) -> Table {
    let mut table = Table::with([Column::heading("finding"), Column::words("seen again")]);
    for row in findings_of(confirmed) {
        table.row(row);
    }
    table
}

/// The findings of all tests that were run again.
pub(super) fn confirmed(tests: &[ConfirmedTest]) -> Table {
    let mut table = Table::with([Column::heading("test"), Column::words("finding"), Column::words("seen again")]);
    for test in tests {
        for row in findings_of(test) {
            table.row([Datum::Test(test.test)].into_iter().chain(row));
        }
    }
    table
}

/// A test before and after it was shrunk.
pub(super) fn sizes(shrinking: &Shrinking) -> Table {
    let first = shrinking.before.as_ref();
    let metrics: &[NamedValue] = first.map_or(&[], |size| &size.values);
    let mut columns = vec![Column::heading(""), Column::words("test")];
    columns.extend(["operations", "active", "intensity P1", "strength"].map(Column::number));
    columns.extend(metrics.iter().map(|value| Column::metric(&value.metric, None)));
    columns.push(Column::words("which"));
    let mut table = Table::with(columns);
    let before = shrinking.before.iter().map(|size| ("before", size));
    let after = shrinking.after.iter().map(|size| ("after", size));
    for (when, size) in before.chain(after) {
        let TestSize { test, operations, operations_text, active_time, intensity, strength, values, number: _ } = size;
        let active = active_time.map(|time| number::with_unit(number::fixed(time, 2), Some("s")));
        let mut cells = vec![
            Datum::text(when),
            Datum::Test(*test),
            Datum::count(*operations),
            Datum::Text(active.unwrap_or_else(|| "unknown".to_owned())),
            intensity.map_or(Datum::Missing, |share| Datum::Rounded(share, 3)),
            Datum::Rounded(*strength, 3),
        ];
        cells.extend(values.iter().map(|value| Datum::text(&value.text)));
        cells.push(Datum::text(operations_text));
        table.row(cells);
    }
    table
}

/// Where parameters of a smallest test begin to matter.
pub(super) fn thresholds(shrinking: &Shrinking) -> Table {
    let mut table =
        Table::with([Column::heading("operation"), Column::words("still fails"), Column::words("does not fail")]);
    for threshold in &shrinking.thresholds {
        table.row([&threshold.operation, &threshold.fails_text, &threshold.passes_text].map(Datum::text));
    }
    table
}

/// The steps by which a test was shrunk.
pub(super) fn accepted_steps(shrinking: &Shrinking) -> Table {
    let mut table = Table::with([Column::heading("test"), Column::words("tried"), Column::sentence("change")]);
    for step in shrinking.steps.iter().filter(|step| step.kept) {
        table.row([Datum::Test(step.test), Datum::text(&step.tried), Datum::text(&step.change)]);
    }
    table
}

/// Every test that was tried while a test was shrunk.
pub(super) fn all_steps(shrinking: &Shrinking) -> Table {
    let metrics: &[NamedValue] = shrinking.steps.first().map_or(&[], |step| &step.values);
    let mut columns = vec![
        Column::heading("test"),
        Column::words("of"),
        Column::words("tried"),
        Column::sentence("change"),
        Column::words("failed"),
        Column::words("accepted"),
    ];
    columns.extend(metrics.iter().map(|value| Column::metric(&value.metric, None)));
    let mut table = Table::with(columns);
    for ShrinkStep { test, base, tried, change, failed, kept, values } in &shrinking.steps {
        let times = match shrinking.runs {
            1 => if *failed == 1 { "yes" } else { "no" }.to_owned(),
            runs => format!("{failed} of {runs}"),
        };
        let mut cells: Vec<Cell> = vec![
            Datum::Test(*test).into(),
            base.map_or(Datum::Missing, Datum::Test).into(),
            Datum::text(tried).into(),
            Datum::text(change).into(),
            Datum::Text(times).bad_if(*failed == shrinking.runs),
            if *kept { Datum::text("yes") } else { Datum::Missing }.into(),
        ];
        cells.extend(values.iter().map(|value| Cell::from(Datum::text(&value.text))));
        table.row(cells);
    }
    table
}

/// Regions of tests, and how many of each fail.
pub(super) fn regions(rules: &[Rule]) -> Table {
    let mut columns = ["fail", "tests", "share", "95 %"].map(Column::number).to_vec();
    columns.push(Column::sentence("region"));
    let mut table = Table::with(columns);
    for rule in rules {
        let percent = |share: f64| format!("{} %", number::fixed(100.0 * share, 0));
        let share = rule.tally.share();
        let interval = share.map(|(_, [low, high])| format!("{} to {}", percent(low), percent(high)));
        table.row([
            Datum::count(rule.tally.failing).bad_if(rule.tally.failing > 0),
            Datum::count(rule.tally.tests).into(),
            Datum::maybe(share.map(|(share, _)| percent(share))).into(),
            Datum::maybe(interval).into(),
            Cell::from(Datum::Text(rule.sentence())),
        ]);
    }
    table
}

/// The pairs of operations that did not act together in each quarter of the run in which they may.
pub(super) fn untried_pairs(pairs: &PairsSummary) -> Table {
    let columns = [Column::heading("operations"), Column::number("tests"), Column::words("quarters without both")];
    let mut table = Table::with(columns);
    for Untried { pair: (first, second), tests, parts } in pairs.found.untried() {
        let open = (1..).zip(parts).filter(|(_, open)| *open).map(|(quarter, _): (u32, bool)| quarter.to_string());
        let quarters = open.collect::<Vec<_>>();
        table.row([
            Datum::text(format!("{} + {}", pairs.operations[first], pairs.operations[second])),
            Datum::Whole(i64::from(tests)),
            Datum::maybe((!quarters.is_empty()).then(|| quarters.join(", "))),
        ]);
    }
    table
}

/// How two runs of a test differ.
pub(super) fn differences(differences: &[Difference]) -> Table {
    let mut table = Table::with(["", "recorded", "replayed"].map(Column::words));
    for Difference { what, before, after } in differences {
        table.row([what, before, after].map(Datum::text));
    }
    table
}

/// Metrics that a recording was fed to, compared with what was recorded.
pub(super) fn fed_metrics(metrics: &[FedMetric]) -> Table {
    let mut table = Table::with(["metric", "value", "recorded", ""].map(Column::words));
    for FedMetric { metric, unit, now, recorded, sameness } in metrics {
        let value = |value: MetricValue| Datum::Text(value_text(value, unit.as_deref(), None, &[]));
        let recorded = || value(MetricValue::whole(*recorded, true));
        let (recorded, word) = match sameness {
            Sameness::Equal => (recorded(), "equal"),
            Sameness::Differs => (recorded(), "differs"),
            Sameness::NotRecorded => (Datum::text(""), "not recorded"),
        };
        table.row([Datum::text(metric), value(*now), recorded, Datum::text(word)]);
    }
    table
}
