//! The tables of preparatory testing, for text and page alike.

use sesame_present::number::quantity;
use sesame_present::table::{Column, Datum, Table};
use sesame_record::Verdict;

use crate::preparation::known::{ExpectationSides, KnownTesting};
use crate::preparation::mitm::{Drift, MitmTesting, milliseconds};
use crate::preparation::sides::{MetricSides, RequirementSides, Values, VerdictCounts};

fn values(values: Option<&Values>, unit: Option<&str>) -> Datum {
    values.map_or(Datum::Missing, |values| Datum::text(values.words(unit)))
}

fn amount(value: Option<f64>, unit: Option<&str>) -> Datum {
    value.map_or(Datum::Missing, |value| Datum::text(quantity(value, unit)))
}

fn time(seconds: Option<f64>) -> Datum {
    seconds.map_or(Datum::Missing, |seconds| Datum::text(milliseconds(seconds)))
}

/// Metrics side by side; without a lab, only those of the simulation. `of` names a test in front of each.
fn metric_columns(lab: Option<&str>, named: bool) -> Table {
    let mut columns = vec![];
    if named {
        columns.push(Column::heading("test"));
    }
    columns.push(if named { Column::words("metric") } else { Column::heading("metric") });
    columns.push(Column::number("simulation"));
    if let Some(lab) = lab {
        columns.extend([lab, "difference", "tolerance"].map(Column::number));
    }
    Table::with(columns)
}

fn add_metrics(table: &mut Table, lab: Option<&str>, of: Option<&str>, metrics: &[MetricSides]) {
    for metric in metrics {
        let unit = metric.unit.as_deref();
        let mut row = vec![];
        row.extend(of.map(|of| Datum::text(of).into()));
        row.push(Datum::text(&metric.metric).into());
        row.push(values(metric.simulation.as_ref(), unit).into());
        if lab.is_some() {
            row.push(values(metric.lab.as_ref(), unit).bad_if(metric.beyond));
            row.push(amount(metric.difference, unit).bad_if(metric.beyond));
            row.push(amount(metric.tolerance, unit).into());
        }
        table.row(row);
    }
}

/// Metrics side by side.
pub(super) fn metrics(lab: Option<&str>, metrics: &[MetricSides]) -> Table {
    let mut table = metric_columns(lab, false);
    add_metrics(&mut table, lab, None, metrics);
    table
}

/// The range of each metric: the least and the greatest value of each side.
pub(super) fn ranges(lab: Option<&str>, metrics: &[MetricSides]) -> Table {
    let sides = ["simulation"].into_iter().chain(lab);
    let columns =
        sides.flat_map(|side| ["runs", "least", "greatest"].map(|what| Column::number(&format!("{what}, {side}"))));
    let mut table = Table::with(std::iter::once(Column::heading("metric")).chain(columns));
    for metric in metrics {
        let unit = metric.unit.as_deref();
        let mut row = vec![Datum::text(&metric.metric)];
        let sides = std::iter::once(metric.simulation.as_ref()).chain(lab.map(|_| metric.lab.as_ref()));
        for side in sides {
            row.push(Datum::count(side.map_or(0, |values| values.runs)));
            row.push(amount(side.map(|values| values.min), unit));
            row.push(amount(side.map(|values| values.max), unit));
        }
        table.row(row);
    }
    table
}

/// Requirements side by side.
pub(super) fn requirements(lab: Option<&str>, requirements: &[RequirementSides]) -> Table {
    let columns = [Column::heading("requirement"), Column::words("metric"), Column::line("bound")];
    let sides = std::iter::once("simulation").chain(lab).map(Column::line);
    let mut table = Table::with(columns.into_iter().chain(sides));
    for requirement in requirements {
        let mut row = vec![
            Datum::text(&requirement.requirement).into(),
            Datum::text(&requirement.metric).into(),
            Datum::text(&requirement.bound).into(),
            Datum::text(requirement.simulation.words()).bad_if(requirement.simulation.violated > 0),
        ];
        row.extend(
            requirement.lab.filter(|_| lab.is_some()).map(|lab| Datum::text(lab.words()).bad_if(lab.violated > 0)),
        );
        table.row(row);
    }
    table
}

/// What the relay added, per stage and topic.
pub(super) fn added(mitm: &MitmTesting) -> Table {
    let numbers = ["messages", "every second", "one in a hundred", "longest", "jitter"].map(Column::number);
    let columns = [Column::heading("relayed"), Column::words("topic")].into_iter().chain(numbers);
    let mut table = Table::with(columns);
    for stage in &mitm.stages {
        for added in &stage.added {
            table.row([
                Datum::count(stage.relayed).into(),
                Datum::text(&added.topic).into(),
                i64::try_from(added.messages).map_or(Datum::Missing, Datum::Whole).into(),
                time(added.p50).bad_if(added.over_budget && added.p99.is_none()),
                time(added.p99).bad_if(added.over_budget),
                time(added.max).into(),
                time(added.jitter).bad_if(added.over_budget),
            ]);
        }
    }
    table
}

/// The stages: what was relayed for the first time, whether repeats were equal, and whether the stage passed.
pub(super) fn stages(mitm: &MitmTesting) -> Table {
    let mut table = Table::with([
        Column::heading("relayed"),
        Column::words("new topic"),
        Column::number("runs"),
        Column::words("violated"),
        Column::line("repeats"),
        Column::line("stage"),
    ]);
    for stage in &mitm.stages {
        let violated: Vec<String> = stage.violated.iter().map(|(name, runs)| format!("{name} ({runs})")).collect();
        let repeats = match stage.deterministic {
            Some(true) => Datum::text("equal"),
            Some(false) => Datum::text("differ"),
            None => Datum::Missing,
        };
        let passed = stage.objections.is_empty();
        table.row([
            Datum::count(stage.relayed).into(),
            Datum::maybe(stage.topic.clone()).into(),
            Datum::count(stage.runs).into(),
            if violated.is_empty() { Datum::Missing.into() } else { Datum::text(violated.join(", ")).bad_if(true) },
            repeats.into(),
            Datum::text(if passed { "passed" } else { "failed" }).bad_if(!passed),
        ]);
    }
    table
}

/// Each metric in each stage, compared with the runs in which nothing was relayed. Stages in a row in which a metric
/// has equal values share a row.
pub(super) fn drifts(mitm: &MitmTesting) -> Table {
    let columns = [Column::heading("metric"), Column::number("relayed")];
    let numbers = ["values", "drift", "spread without relay"].map(Column::number);
    let mut table = Table::with(columns.into_iter().chain(numbers));
    let metrics = mitm.stages.first().map_or(0, |stage| stage.metrics.len());
    for at in 0..metrics {
        let stages: Vec<(usize, &Drift)> =
            mitm.stages.iter().filter_map(|stage| Some((stage.relayed, stage.metrics.get(at)?))).collect();
        for equal in stages.chunk_by(|(_, one), (_, next)| one.values == next.values) {
            let (Some((from, _)), Some((to, drift))) = (equal.first(), equal.last()) else { continue };
            let unit = drift.unit.as_deref();
            table.row([
                Datum::text(&drift.metric),
                if from == to { Datum::count(*to) } else { Datum::text(format!("{from} to {to}")) },
                values(drift.values.as_ref(), unit),
                if *to == 0 { Datum::Missing } else { amount(drift.drift, unit) },
                amount(drift.spread_before, unit),
            ]);
        }
    }
    table
}

/// Expectations of regression tests, side by side.
pub(super) fn expectations(known: &KnownTesting) -> Table {
    let lab = known.lab.as_deref();
    let columns = [Column::heading("test"), Column::words("metric"), Column::line("expected")];
    let sides =
        std::iter::once("simulation").chain(lab).flat_map(|side| [Column::number(side), Column::line("verdict")]);
    let mut table = Table::with(columns.into_iter().chain(sides));
    for test in &known.tests {
        for expectation in &test.expectations {
            let ExpectationSides { metric, bound, simulation_value, simulation, lab_value, lab: in_lab } = expectation;
            let unit =
                test.metrics.iter().find(|known| known.metric == *metric).and_then(|metric| metric.unit.as_deref());
            let mut row = vec![
                Datum::text(&test.test).into(),
                Datum::text(metric).into(),
                Datum::text(bound).into(),
                amount(*simulation_value, unit).into(),
                verdict(*simulation).bad_if(*simulation != Some(Verdict::Satisfied)),
            ];
            if lab.is_some() {
                row.push(amount(*lab_value, unit).into());
                row.push(verdict(*in_lab).bad_if(*in_lab != Some(Verdict::Satisfied)));
            }
            table.row(row);
        }
    }
    table
}

fn verdict(verdict: Option<Verdict>) -> Datum {
    verdict.map_or(Datum::Missing, |verdict| {
        Datum::text(match verdict {
            Verdict::Violated => "violated",
            Verdict::Satisfied => "satisfied",
            Verdict::Inconclusive => "inconclusive",
        })
    })
}

/// Metrics of regression tests, side by side.
pub(super) fn known_metrics(known: &KnownTesting) -> Table {
    let lab = known.lab.as_deref();
    let mut table = metric_columns(lab, true);
    for test in &known.tests {
        add_metrics(&mut table, lab, Some(&test.test), &test.metrics);
    }
    table
}

/// Requirements in regression tests, side by side.
pub(super) fn known_requirements(known: &KnownTesting) -> Table {
    let lab = known.lab.as_deref();
    let columns = [Column::heading("test"), Column::words("requirement")];
    let sides = std::iter::once("simulation").chain(lab).map(Column::line);
    let mut table = Table::with(columns.into_iter().chain(sides));
    for test in &known.tests {
        for requirement in &test.requirements {
            let differs = lab.is_some() && requirement.lab != Some(requirement.simulation);
            let mut row = vec![
                Datum::text(&test.test).into(),
                Datum::text(&requirement.requirement).into(),
                Datum::text(requirement.simulation.words()).into(),
            ];
            if lab.is_some() {
                let words = requirement.lab.map_or_else(|| "–".to_owned(), VerdictCounts::words);
                row.push(Datum::text(words).bad_if(differs));
            }
            table.row(row);
        }
    }
    table
}
