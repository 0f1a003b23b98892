//! What monitors decide on two recordings, as tables and as text for a terminal.

use sesame_present::number::plural;
use sesame_present::table::{Column, Datum, Table, TextOptions};

use crate::facts::monitors::{
    BrokenDecision, ComparedMonitor, ComparedRecording, EvidenceDeviation, MonitorsCompared, TimedState, Tolerated,
    seconds,
};
use crate::text::{paragraph, section};
use sesame_base::visible::visible;

/// How many times in which states differ are shown of each monitor; programs get more.
const SHOWN: usize = 20;

/// What monitors decide on two recordings, in words.
pub fn monitors_text(compared: &MonitorsCompared, options: TextOptions) -> String {
    let mut text = String::new();
    for (side, recording) in [("first", &compared.first), ("second", &compared.second)] {
        paragraph(&mut text, &format!("{side:<7} {}", about(recording)), options);
    }
    section(&mut text, "Monitors", &decisions(compared), options);
    for monitor in &compared.monitors {
        if let Some(difference) = &monitor.difference {
            text.push('\n');
            paragraph(&mut text, &visible(&format!("{}: {}", monitor.monitor, difference.sentence())), options);
        }
    }
    section(&mut text, "Different states", &disagreements(compared), options);
    let omitted: usize = compared.monitors.iter().map(not_shown).sum();
    if omitted > 0 {
        paragraph(
            &mut text,
            &format!("{omitted} more are not shown; `--format json` has up to 1,000 of each monitor."),
            options,
        );
    }
    section(&mut text, "Delay tolerance", &tolerances(compared), options);
    text.push('\n');
    paragraph(&mut text, &conclusion(compared), options);
    text
}

fn about(recording: &ComparedRecording) -> String {
    let ComparedRecording { recording, run, messages, end } = recording;
    let name = run.clone().unwrap_or_else(|| "a recording that no runner made".to_owned());
    let messages = plural(*messages, "message", "messages");
    visible(&format!("{name}: {messages} heard in {}, {}", seconds(*end), recording.display()))
}

fn not_shown(monitor: &ComparedMonitor) -> usize {
    monitor.omitted + monitor.disagreements.len().saturating_sub(SHOWN)
}

/// Per monitor: how often it decides, and whether that is the same.
pub(super) fn decisions(compared: &MonitorsCompared) -> Table {
    let numbers = ["first", "second"].map(Column::number);
    let columns = [Column::heading("monitor")].into_iter().chain(numbers);
    let mut table = Table::with(columns.chain([Column::line("decisions"), Column::line("furthest apart")]));
    for monitor in &compared.monitors {
        let differs = monitor.difference.is_some();
        let apart = monitor.furthest.as_ref().map(|shifted| {
            let (late, direction) = (seconds(shifted.late.abs()), if shifted.late < 0.0 { "earlier" } else { "later" });
            format!("{late} {direction} (decision {}, `{}`)", shifted.decision, shifted.state)
        });
        let too_far =
            monitor.furthest.as_ref().zip(compared.within).is_some_and(|(shifted, within)| shifted.late.abs() > within);
        table.row([
            Datum::text(&monitor.monitor).into(),
            Datum::count(monitor.first).into(),
            Datum::count(monitor.second).into(),
            Datum::text(if differs { "differ" } else { "same" }).bad_if(differs),
            Datum::maybe(apart).bad_if(too_far),
        ]);
    }
    table
}

/// The times in which monitors are in different states, and why.
pub(super) fn disagreements(compared: &MonitorsCompared) -> Table {
    let times = ["from", "to"].map(Column::number);
    let columns = [Column::heading("monitor")].into_iter().chain(times);
    let states = ["first", "second"].map(Column::line);
    let mut table = Table::with(columns.chain(states).chain([Column::sentence("because")]));
    for monitor in &compared.monitors {
        for disagreement in monitor.disagreements.iter().take(SHOWN) {
            let because: Vec<String> = disagreement.because.iter().map(EvidenceDeviation::sentence).collect();
            table.row([
                Datum::text(&monitor.monitor),
                Datum::text(seconds(disagreement.from)),
                Datum::text(seconds(disagreement.to)),
                Datum::text(&disagreement.first),
                Datum::text(&disagreement.second),
                Datum::text(because.join("; and ")),
            ]);
        }
    }
    table
}

/// Per topic: by how much its messages may be late.
pub(super) fn tolerances(compared: &MonitorsCompared) -> Table {
    let sides = ["first", "second"].map(Column::number);
    let columns = [Column::heading("topic")].into_iter().chain(sides);
    let mut table = Table::with(columns.chain([Column::words("evidence"), Column::sentence("a longer delay changes")]));
    for topic in &compared.topics {
        let breaks = match (&topic.first.breaks, &topic.second.breaks) {
            (Some(first), Some(second)) if first != second => {
                Some(format!("{}; on the second: {}", broken(first), broken(second)))
            }
            (Some(first), _) => Some(broken(first)),
            (None, Some(second)) => Some(format!("on the second: {}", broken(second))),
            (None, None) => None,
        };
        table.row([
            Datum::text(&topic.topic),
            Datum::text(tolerated(&topic.first)),
            Datum::text(tolerated(&topic.second)),
            Datum::text(topic.evidence.join(", ")),
            Datum::maybe(breaks),
        ]);
    }
    table
}

fn tolerated(tolerated: &Tolerated) -> String {
    match tolerated.delay {
        Some(delay) if tolerated.given_up => format!("at least {}", seconds(delay)),
        Some(delay) => seconds(delay),
        None => "any".to_owned(),
    }
}

fn broken(broken: &BrokenDecision) -> String {
    let said = |state: &Option<TimedState>| match state {
        Some(TimedState { state, at }) => format!("`{state}` at {}", seconds(*at)),
        None => "none".to_owned(),
    };
    let BrokenDecision { monitor, decision, recorded, delayed } = broken;
    format!("decision {decision} of `{monitor}`: {}, not {}", said(delayed), said(recorded))
}

/// What the comparison comes to.
pub(super) fn conclusion(compared: &MonitorsCompared) -> String {
    let same = if compared.monitors.iter().all(|monitor| monitor.difference.is_none()) {
        "All monitors decide the same in the same order."
    } else {
        "Monitors decide differently."
    };
    let least = [("first", compared.least(|topic| &topic.first)), ("second", compared.least(|topic| &topic.second))];
    let tolerance = least.map(|(side, least)| match least {
        Some((topic, delay)) => format!("on the {side} up to {} (`{topic}`)", seconds(delay)),
        None => format!("on the {side} up to any delay"),
    });
    visible(&format!(
        "{same} If the messages of any one topic are late, decisions stay the same {}.",
        tolerance.join(", ")
    ))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::facts::monitors::{
        ComparedMonitor, DecisionDifference, DelayTolerance, EvidenceCause, EvidenceValue, MonitorDisagreement,
        ShiftedDecision,
    };

    /// Monitors of which one decides differently, and the other at other times.
    pub(crate) fn sample() -> MonitorsCompared {
        let cause = |at: f64, by: &str| Some(EvidenceCause { at, by: by.to_owned() });
        let deviation = |late: Option<f64>| EvidenceDeviation {
            monitor: "guard".to_owned(),
            evidence: "lit".to_owned(),
            first: EvidenceValue { value: "false".to_owned(), since: cause(2.2, "message 1 on camera/light") },
            second: EvidenceValue { value: "unknown".to_owned(), since: None },
            follows: late.and_then(|late| cause(2.2 + late, "stale")),
            late,
        };
        let state = |state: &str, at: f64| Some(TimedState { state: state.to_owned(), at });
        let recording = |name: &str, run: Option<&str>| ComparedRecording {
            recording: name.into(),
            run: run.map(str::to_owned),
            messages: 6,
            end: 3.0,
        };
        let monitor = |name: &str, difference: Option<DecisionDifference>, late: f64| ComparedMonitor {
            monitor: name.to_owned(),
            first: 4,
            second: 2,
            disagreements: vec![MonitorDisagreement {
                from: 2.22,
                to: 2.24,
                first: "halted".to_owned(),
                second: "go".to_owned(),
                because: vec![deviation(Some(late))],
            }],
            difference,
            furthest: Some(ShiftedDecision { decision: 1, state: "go".to_owned(), at: 0.1, late }),
            omitted: 7,
        };
        let because = vec![deviation(Some(0.25)), deviation(None)];
        let difference = DecisionDifference { decision: 2, first: state("halted", 2.22), second: None, because };
        let tolerated = |delay: Option<f64>, given_up: bool| Tolerated {
            delay,
            breaks: delay.filter(|_| !given_up).map(|_| BrokenDecision {
                monitor: "guard".to_owned(),
                decision: 2,
                recorded: state("halted", 2.22),
                delayed: state("go", 2.26),
            }),
            given_up,
        };
        let topic = |topic: &str, first: Tolerated, second: Tolerated| DelayTolerance {
            topic: topic.to_owned(),
            evidence: vec!["guard.lit".to_owned()],
            first,
            second,
        };
        MonitorsCompared {
            first: recording("a.mcap", Some("T1 of study (completed)")),
            second: recording("b.mcap", None),
            within: Some(0.1),
            same: false,
            monitors: vec![monitor("guard", Some(difference), 0.05), monitor("camera", None, -0.125)],
            topics: vec![
                topic("camera/light", tolerated(Some(0.02), false), tolerated(None, false)),
                topic("cell/gap", tolerated(None, false), tolerated(Some(1.5), true)),
            ],
            warnings: vec![],
        }
    }

    #[test]
    fn what_differs_is_said_with_the_evidence_the_message_and_the_delay() {
        let compared = sample();
        let options = TextOptions { width: Some(120), colour: false };
        let said = format!("{}\n{}\n", monitors_text(&compared, options), compared.objections().join("\n"));
        insta::assert_snapshot!(said);
    }
}
