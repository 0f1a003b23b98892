//! The tables of what runtime monitors did.

use std::fmt::Write as _;

use sesame_present::number;
use sesame_present::table::{Cell, Column, Datum, Table};

use crate::facts::certificate::before_after::Mend;
use crate::facts::certificate::campaign::MonitorsSummary;
use crate::facts::certificate::test::{HazardReport, MonitorReport};
use crate::facts::certificate::why::cause_text;

/// A time in seconds.
pub(crate) fn seconds(time: f64) -> String {
    number::time(time)
}

fn at(time: f64) -> Datum {
    Datum::text(seconds(time))
}

fn maybe_at(time: Option<f64>) -> Datum {
    time.map_or(Datum::Missing, at)
}

/// What a monitor made of a hazard.
pub(crate) fn foreseen_text(hazard: &HazardReport) -> String {
    match hazard.lead {
        Some(lead) if lead > 0.0 => format!("foreseen {} before", seconds(lead)),
        Some(_) => "detected in that instant".to_owned(),
        None => "MISSED".to_owned(),
    }
}

/// Tests in which hazards were missed.
pub(crate) fn missed_hazards(summary: &MonitorsSummary) -> Table {
    let mut columns = vec![
        Column::heading("test"),
        Column::words("missed by"),
        Column::words("hazard of"),
        Column::number("at"),
        Column::words("state then"),
    ];
    let run_again = summary.missed.iter().any(|missed| missed.again.is_some());
    columns.extend(run_again.then(|| Column::words("seen again")));
    let mut table = Table::with(columns);
    for missed in &summary.missed {
        let again = missed.again.as_ref().map_or(Datum::Missing, |again| Datum::Text(again.words()));
        let row = [
            Datum::Test(missed.test).into(),
            Datum::text(&missed.monitor).into(),
            Datum::text(&missed.requirement).bad_if(true),
            at(missed.at).into(),
            missed.state.as_ref().map_or(Datum::Missing, Datum::text).into(),
        ];
        table.row(row.into_iter().chain(run_again.then(|| Cell::from(again))));
    }
    table
}

/// Hazards foreseen, detected and missed, and alarms without one.
pub(crate) fn hazards(summary: &MonitorsSummary) -> Table {
    let unknown = summary.hazards.iter().any(|pair| pair.unknown > 0);
    let columns = [
        Column::heading("monitor"),
        Column::words("hazards of"),
        Column::number("missed"),
        Column::number("detected"),
        Column::number("foreseen"),
        Column::number("least lead"),
        Column::number("median lead"),
        Column::number("false alarms"),
    ];
    let mut table = Table::with(columns.into_iter().chain(unknown.then(|| Column::number("unknown"))));
    for pair in &summary.hazards {
        let row = [
            Datum::text(&pair.monitor).into(),
            Datum::text(&pair.requirement).into(),
            Datum::count(pair.missed).bad_if(pair.missed > 0),
            Datum::count(pair.detected).into(),
            Datum::count(pair.foreseen).into(),
            maybe_at(pair.least_lead).into(),
            maybe_at(pair.median_lead).into(),
            Cell::from(Datum::Whole(i64::from(pair.false_alarms))),
        ];
        table.row(row.into_iter().chain(unknown.then(|| Datum::count(pair.unknown).into())));
    }
    table
}

/// How monitors changed their states, and how long they were in each.
pub(crate) fn monitors(summary: &MonitorsSummary) -> Table {
    let mut table = Table::with([
        Column::heading("monitor"),
        Column::number("median changes"),
        Column::words("most changes"),
        Column::number("shortest stay"),
        Column::number("alarms"),
        Column::number("mitigations"),
        Column::number("never vouched"),
        Column::sentence("time in each state"),
    ]);
    let whole = |count: u64| i64::try_from(count).map_or(Datum::Missing, Datum::Whole);
    for monitor in &summary.monitors {
        let states = monitor.states.iter().map(|state| format!("{} {:.1} %", state.state, 100.0 * state.share));
        table.row([
            Datum::text(&monitor.monitor),
            Datum::Lone(monitor.median_changes),
            monitor.most_changes.map_or(Datum::Missing, |(test, most)| Datum::OfTest(test, format!("({most})"))),
            maybe_at(monitor.shortest_stay),
            whole(monitor.alarms),
            monitor.mitigations.map_or(Datum::Missing, whole),
            Datum::count(monitor.never_vouched),
            Datum::Text(states.collect::<Vec<_>>().join(", ")),
        ]);
    }
    table
}

/// Tests in which hazards were missed before a mend, or are after it.
pub(crate) fn mended(mend: &Mend) -> Table {
    let mut table = Table::with([
        Column::heading("test"),
        Column::words("before it was"),
        Column::words("missed before"),
        Column::words("missed after"),
    ]);
    for test in &mend.changed {
        let seed = if test.same_seed { "" } else { ", other simulator seed" };
        let words = |missed: &[String]| match missed {
            [] => Datum::text("none").quiet(),
            missed => Datum::Text(missed.join(", ")).bad_if(true),
        };
        table.row([
            Datum::Test(test.test).into(),
            Cell::from(Datum::Text(format!("{}{seed}", test.before))),
            words(&test.missed_before),
            words(&test.missed_after),
        ]);
    }
    table
}

/// The hazards of a test, missed ones first.
pub(crate) fn hazards_of_test(monitors: &[MonitorReport]) -> Table {
    let mut table = Table::with([
        Column::heading("monitor"),
        Column::words("hazard of"),
        Column::number("at"),
        Column::words("outcome"),
        Column::sentence("sentence"),
    ]);
    for missed in [true, false] {
        for monitor in monitors {
            for hazard in monitor.hazards.iter().filter(|hazard| hazard.is_missed() == missed) {
                table.row([
                    Datum::text(&monitor.monitor).into(),
                    Datum::text(&hazard.requirement).into(),
                    at(hazard.at).into(),
                    Datum::text(foreseen_text(hazard)).bad_if(missed),
                    Cell::from(Datum::text(&hazard.text)),
                ]);
            }
        }
    }
    table
}

/// The decisions of a test, with their reasons.
pub(crate) fn decisions(monitors: &[MonitorReport]) -> Table {
    let mut table = Table::with([
        Column::heading("monitor"),
        Column::number("at"),
        Column::words("state"),
        Column::number("for"),
        Column::words("caused by"),
        Column::sentence("because"),
    ]);
    for monitor in monitors {
        for decision in &monitor.decisions {
            let cause = match (&decision.cause, decision.at > 0.0) {
                (Some(_), _) => Datum::Text(decision.cause_text()),
                (None, false) => Datum::text("the beginning"),
                (None, true) => Datum::Missing,
            };
            let mut because = decision.reason();
            if let Some(mitigation) = &decision.mitigation {
                let _ = write!(because, "; sent `{mitigation}`");
            }
            table.row([
                Datum::text(&monitor.monitor),
                at(decision.at),
                Datum::text(&decision.state),
                at(decision.until - decision.at),
                cause,
                Datum::Text(because),
            ]);
        }
    }
    table
}

/// The changes of evidence in a test.
pub(crate) fn evidence(monitors: &[MonitorReport]) -> Table {
    let mut table = Table::with([
        Column::heading("monitor"),
        Column::words("evidence"),
        Column::number("at"),
        Column::words("is"),
        Column::sentence("caused by"),
    ]);
    for monitor in monitors {
        for evidence in &monitor.evidence {
            for change in &evidence.changes {
                table.row([
                    Datum::text(&monitor.monitor),
                    Datum::text(&evidence.evidence),
                    at(change.at),
                    Datum::text(&change.is),
                    Datum::Text(cause_text(&change.cause)),
                ]);
            }
        }
    }
    table
}
