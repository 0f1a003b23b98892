//! A certificate as a tree with the truth at each of its nodes, as data and as text; and reasons as sentences.

use std::fmt::Write as _;

use sesame_plan::{Gate, Monitor, MonitorId};

use super::{Cause, Moment, Why};
use crate::gate::{self, Leaf};
use crate::network::State;
use crate::truth::Truth;

/// A node of a certificate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub what: What,
    /// Its value. Of a monitor: whether any guarantee holds.
    pub truth: Truth,
    /// What it depends on, in the order of the declaration. Empty for evidence and demands.
    pub parts: Vec<Part>,
}

/// What a node of a certificate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// The monitor, with its state.
    Monitor(MonitorId, State),
    /// The guarantee at this position.
    Guarantee(u32),
    /// A gate that holds if this many of its parts do.
    AtLeast(u32),
    /// The evidence at this position.
    Evidence(u32),
    /// The demand at this position.
    Demand(u32),
}

/// The certificate of a monitor at a moment. `monitors` are those of the network.
pub fn certificate(moment: &Moment<'_>, monitors: &[Monitor], monitor: MonitorId) -> Part {
    let guarantees = (0..).zip(&monitors[monitor.index()].guarantees).map(|(at, guarantee)| Part {
        what: What::Guarantee(at),
        truth: moment.guarantee(monitor, at),
        parts: vec![part(moment, monitor, &guarantee.gate)],
    });
    let parts: Vec<Part> = guarantees.collect();
    let truth = parts.iter().map(|part| part.truth).max().unwrap_or_default();
    Part { what: What::Monitor(monitor, moment.state(monitor)), truth, parts }
}

fn part(moment: &Moment<'_>, monitor: MonitorId, gate: &Gate) -> Part {
    let (what, parts) = match gate {
        Gate::Evidence(at) => (What::Evidence(*at), Vec::new()),
        Gate::Demand(at) => (What::Demand(*at), Vec::new()),
        Gate::All(_) | Gate::Any(_) | Gate::AtLeast { .. } => {
            let (need, parts) = gate::parts(gate).unwrap_or_default();
            let need = u32::try_from(need).expect("a gate has fewer parts than 2^32");
            (What::AtLeast(need), parts.iter().map(|gate| part(moment, monitor, gate)).collect())
        }
    };
    let truth = gate::value(gate, &|leaf| match leaf {
        Leaf::Evidence(at) => moment.evidence(moment.network().evidence(monitor, at)),
        Leaf::Demand(at) => moment.demand(monitor, at),
    });
    Part { what, truth, parts }
}

/// A certificate as text, one line for each node, parts indented by two blanks.
pub fn text(certificate: &Part, monitors: &[Monitor]) -> String {
    let mut text = String::new();
    let What::Monitor(id, state) = certificate.what else { return text };
    let monitor = &monitors[id.index()];
    line(&mut text, 0, &monitor.name, state_name(monitor, state));
    for guarantee in &certificate.parts {
        write_part(&mut text, 1, guarantee, monitor, monitors);
    }
    text
}

fn write_part(text: &mut String, depth: usize, part: &Part, monitor: &Monitor, monitors: &[Monitor]) {
    let truth = part.truth.to_string();
    match part.what {
        What::Guarantee(at) => {
            let guarantee = &monitor.guarantees[at as usize];
            line(text, depth, &format!("{} (integrity {})", guarantee.name, guarantee.integrity), &truth);
        }
        What::AtLeast(need) => line(text, depth, &gate_name(need as usize, part.parts.len()), &truth),
        What::Evidence(at) => line(text, depth, &monitor.evidence[at as usize].name, &truth),
        What::Demand(at) => {
            let demand = &monitor.demands[at as usize];
            let of = &monitors[demand.monitor.index()].name;
            line(text, depth, &format!("{} from {of}", demand.name), &truth);
        }
        What::Monitor(..) => {}
    }
    for inner in &part.parts {
        write_part(text, depth + 1, inner, monitor, monitors);
    }
}

fn line(text: &mut String, depth: usize, name: &str, is: &str) {
    writeln!(text, "{:width$}{name}: {is}", "", width = 2 * depth).expect("text grows as needed");
}

fn gate_name(need: usize, of: usize) -> String {
    match need {
        _ if need == of => "and".to_owned(),
        1 => "or".to_owned(),
        _ => format!("{need} of {of}"),
    }
}

/// The name of a state of a monitor.
fn state_name(monitor: &Monitor, state: State) -> &str {
    match state {
        State::Guarantee(at) => &monitor.guarantees[at as usize].name,
        State::Safe => &monitor.otherwise.name,
    }
}

/// A reason as a sentence, such as `` `safe` does not hold because `brakes_ok` is false ``.
pub fn sentence(why: &Why, monitors: &[Monitor]) -> String {
    let guarantee = &monitors[why.monitor.index()].guarantees[why.guarantee as usize].name;
    let is = match why.truth {
        Truth::True => "holds",
        Truth::False => "does not hold",
        Truth::Unknown => "is not known to hold",
    };
    let causes: Vec<String> = why.because.iter().map(|cause| phrase(cause, why.monitor, monitors)).collect();
    let causes = match causes.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, first)) => format!("{} and {last}", first.join(", ")),
        None => "of nothing".to_owned(),
    };
    format!("`{guarantee}` {is} because {causes}")
}

fn phrase(cause: &Cause, explained: MonitorId, monitors: &[Monitor]) -> String {
    let monitor = &monitors[cause.monitor.index()];
    let name = match cause.leaf {
        Leaf::Evidence(at) => &monitor.evidence[at as usize].name,
        Leaf::Demand(at) => &monitor.demands[at as usize].name,
    };
    if cause.monitor == explained {
        format!("`{name}` is {}", cause.truth)
    } else {
        format!("`{name}` of `{}` is {}", monitor.name, cause.truth)
    }
}
