//! When a stronger guarantee holds without a weaker one, in words.

use std::collections::BTreeSet;

use sesame_base::time::SimTime;
use sesame_monitor::Network;
use sesame_monitor::check::{Value, When, Witness};
use sesame_monitor::gate::Leaf;
use sesame_monitor::truth::Truth;
use sesame_monitor::why::Moment;
use sesame_notation as notation;
use sesame_plan::{Members, MonitorId, Side};

use super::group::{Group, leaves};

/// More values than these are not listed.
const MOST: usize = 6;

/// For example: ``for example, if `pressure` is 5bar: `brakes_ok` is true and `sees` is false``.
pub(super) fn in_words(group: &Group<'_>, monitor: MonitorId, guarantees: [u32; 2], witness: &Witness) -> String {
    let read: BTreeSet<_> = guarantees.into_iter().flat_map(|at| group.evidence_of(monitor, at)).collect();
    let evidence = |&(of, at): &(MonitorId, u32)| &group.monitors[of.index()].evidence[at as usize];
    let inputs = witness.inputs.iter().filter(|(side, input, _)| {
        let same = |read: &sesame_plan::Input| read.field == input.field && read.members == input.members;
        read.iter().map(evidence).any(|evidence| evidence.side == *side && evidence.inputs.iter().any(same))
    });
    let inputs: Vec<String> = inputs
        .map(|(side, input, value)| {
            let (name, unit) = group.input_text(input);
            let heard = if *side == Side::Inbound { " before operations" } else { "" };
            let name = match value {
                Value::Flag(true) if input.members == Members::Min => name.replacen("the least", "every", 1),
                Value::Flag(false) if input.members == Members::Min => name.replacen("the least", "some", 1),
                _ => name,
            };
            let value = match value {
                Value::Number(number) => {
                    notation::Unit::named(unit.as_ref().map(crate::units::Unit::text)).number(*number)
                }
                Value::Flag(flag) => flag.to_string(),
                Value::Text(text) => notation::quoted(text),
            };
            format!("{name}{heard} is {value}")
        })
        .collect();
    let inputs = and(&inputs);
    let when = match (witness.when, inputs.is_empty()) {
        (When::Settled, false) => format!("for example, if {inputs}"),
        (When::Settled, true) => "for example".to_owned(),
        (When::Started(SimTime::ZERO), false) => format!("for example, right after first messages in which {inputs}"),
        (When::Started(SimTime::ZERO), true) => "for example, right after the first messages".to_owned(),
        (When::Started(after), false) => {
            format!("for example, {} after first messages in which {inputs}", time(after))
        }
        (When::Started(after), true) => format!("for example, {} after the first messages", time(after)),
        (When::Silent, false) => format!("for example, if all topics fall silent while {inputs}"),
        (When::Silent, true) => "for example, when all topics are silent".to_owned(),
    };
    format!("{when}: {}", and(&parts(group, monitor, guarantees, witness)))
}

fn time(of: SimTime) -> String {
    notation::Unit::SECONDS.number(of.seconds())
}

/// What the evidence and the demands of both guarantees are then.
fn parts(group: &Group<'_>, monitor: MonitorId, guarantees: [u32; 2], witness: &Witness) -> Vec<String> {
    let declared = &group.monitors[monitor.index()];
    let mut of_both: Vec<Leaf> = Vec::new();
    for at in guarantees {
        let more = leaves(&declared.guarantees[at as usize].gate);
        of_both.extend(more.into_iter().filter(|leaf| !of_both.contains(leaf)).collect::<Vec<_>>());
    }
    let Ok(network) = Network::new(&group.monitors) else { return Vec::new() };
    let moment = Moment::new(&network, |evidence| witness.evidence[evidence.index()]);
    let said = of_both.into_iter().filter_map(|leaf| {
        let (name, truth) = match leaf {
            Leaf::Evidence(at) => {
                (&declared.evidence[at as usize].name, moment.evidence(network.evidence(monitor, at)))
            }
            Leaf::Demand(at) => (&declared.demands[at as usize].name, moment.demand(monitor, at)),
        };
        (truth != Truth::Unknown).then(|| format!("`{name}` is {truth}"))
    });
    said.collect()
}

/// Sentences joined to one.
fn and(parts: &[String]) -> String {
    match parts.split_last() {
        _ if parts.len() > MOST => format!("{}, …", parts[..MOST].join(", ")),
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}
