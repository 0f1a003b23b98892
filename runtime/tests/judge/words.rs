//! A case in words, for whoever has to find out why it fails.

use std::fmt::Write as _;

use sesame_plan::Metric;

use crate::case::Case;
use crate::ledger::{Ledger, Message};

/// The whole case.
pub(crate) fn case(case: &Case) -> String {
    let mut text = format!("case {}, ends after {} s\n", case.number, case.plan.campaign.end_after);
    for (topic, carries) in case.plan.topics.iter().zip(&case.carries) {
        writeln!(text, "  topic {} {carries:?} {:?}", topic.name, topic.paths).unwrap();
    }
    for line in &case.script.lines {
        writeln!(text, "  robot: {line:?}").unwrap();
    }
    let script = &case.script;
    writeln!(text, "  crash {:?}, over after {:?}, blanks {:?}", script.crash, script.over, script.blanks).unwrap();
    for metric in &case.plan.metrics {
        writeln!(text, "  metric {}", self::metric(metric)).unwrap();
    }
    for requirement in &case.plan.requirements {
        let metric = &case.plan.metric(requirement.metric).name;
        writeln!(text, "  requirement {} {metric} {:?}", requirement.name, requirement.bound).unwrap();
    }
    for operation in &case.plan.operations {
        writeln!(text, "  operation {}", json(operation)).unwrap();
    }
    for monitor in &case.plan.monitors {
        writeln!(text, "  monitor {}", json(monitor)).unwrap();
    }
    writeln!(text, "  copies {:?}", case.plan.campaign.copies).unwrap();
    for used in &case.test.operations {
        writeln!(text, "  test: {}", json(used)).unwrap();
    }
    text
}

/// A metric in a line.
pub(crate) fn metric(metric: &Metric) -> String {
    let (default, initial) = (metric.default, metric.initial);
    format!("{} default {default:?} initial {initial:?} = {}", metric.name, json(&metric.source))
}

/// The messages of a run, one to a line, those published next to those delivered.
pub(crate) fn ledger(ledger: &Ledger) -> String {
    let mut text = String::new();
    let list = |text: &mut String, messages: &[Message]| {
        for Message { time, path, value } in messages {
            writeln!(text, "    {:.3} s {path} {value:?}", *time as f64 / 1e9).unwrap();
        }
    };
    writeln!(text, "  published, until {:.3} s:", ledger.end as f64 / 1e9).unwrap();
    list(&mut text, &ledger.published);
    writeln!(text, "  delivered:").unwrap();
    list(&mut text, &ledger.delivered);
    for (time, operation, event) in &ledger.deeds {
        writeln!(text, "    {:.3} s operation {operation} {event:?}", *time as f64 / 1e9).unwrap();
    }
    text
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap()
}
