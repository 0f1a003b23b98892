//! Why a guarantee holds or does not: the smallest set of evidence that decided; and a certificate as a tree.
//!
//! All gates are monotone. So a set of true leaves *forces* a gate to be true if it is true with all other leaves
//! false, and a set of leaves that are not true forces it not to be true if it is not with all other leaves true.
//! Which set is smallest is found exactly, by branch and bound; see [`Why::smallest`].

mod smallest;
mod tree;

use std::collections::VecDeque;

use sesame_plan::MonitorId;

use crate::circuit::NodeIndex;
use crate::gate::Leaf;
use crate::network::{EvidenceId, Network, State};
use crate::truth::{Truth, at_least};

pub use tree::{Part, What, certificate, sentence, text};

/// The values of everything in a network at a moment.
#[derive(Debug, Clone)]
pub struct Moment<'a> {
    network: &'a Network,
    values: Vec<Truth>,
}

impl<'a> Moment<'a> {
    /// The moment at which evidence has these values.
    pub fn new(network: &'a Network, evidence: impl Fn(EvidenceId) -> Truth) -> Self {
        let circuit = network.circuit();
        let mut values = vec![Truth::Unknown; circuit.size()];
        for (id, value) in (0..).map(EvidenceId).zip(&mut values[..network.evidence_count()]) {
            *value = evidence(id);
        }
        for &node in circuit.order() {
            let (need, parts) = circuit.threshold(node).expect("nodes in the order have parts");
            values[node as usize] = at_least(need, parts.iter().map(|&part| values[part as usize]));
        }
        Moment { network, values }
    }

    /// The network.
    pub fn network(&self) -> &'a Network {
        self.network
    }

    /// The value of a piece of evidence.
    pub fn evidence(&self, evidence: EvidenceId) -> Truth {
        self.get(evidence.0)
    }

    /// The value of a guarantee's gate.
    pub fn guarantee(&self, monitor: MonitorId, position: u32) -> Truth {
        self.get(self.network.guarantee_node(monitor, position))
    }

    /// The value of a demand.
    pub fn demand(&self, monitor: MonitorId, position: u32) -> Truth {
        self.get(self.network.demand_nodes(monitor)[position as usize])
    }

    /// The state of a monitor.
    pub fn state(&self, monitor: MonitorId) -> State {
        let mut positions = 0..self.network.guarantees(monitor);
        positions.find(|&at| self.guarantee(monitor, at).holds()).map_or(State::Safe, State::Guarantee)
    }

    fn get(&self, node: NodeIndex) -> Truth {
        self.values[node as usize]
    }
}

/// How far an explanation goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// To the monitor's own evidence and demands.
    Own,
    /// Through demands to the evidence of other monitors.
    Evidence,
}

/// Why a guarantee holds, or does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Why {
    /// The monitor.
    pub monitor: MonitorId,
    /// The position of the guarantee.
    pub guarantee: u32,
    /// The value of its gate.
    pub truth: Truth,
    /// Values that force it, whatever all others were: true ones if it is true, false ones if it is false. If it is
    /// unknown, those that keep it from being true, of which at least one is unknown. In the order of evidence.
    pub because: Vec<Cause>,
    /// Whether no smaller set would do, which is so unless the search was given up: then no part of the set can be
    /// left out, but another set may be smaller. Of several smallest sets it is always the same one.
    pub smallest: bool,
}

/// One of the values that force another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cause {
    /// The monitor to which it belongs.
    pub monitor: MonitorId,
    /// Which evidence or demand of that monitor.
    pub leaf: Leaf,
    /// Its value.
    pub truth: Truth,
    /// The demands by which it came to matter, from the explained monitor on: each with the monitor that has it.
    /// Empty for what belongs to the explained monitor.
    pub through: Vec<(MonitorId, u32)>,
}

/// Why this guarantee of a monitor holds at this moment, or does not.
pub fn why(moment: &Moment<'_>, monitor: MonitorId, guarantee: u32, depth: Depth) -> Why {
    let network = moment.network;
    let root = network.guarantee_node(monitor, guarantee);
    let truth = moment.get(root);
    let own: &[NodeIndex] = match depth {
        Depth::Own => network.demand_nodes(monitor),
        Depth::Evidence => &[],
    };
    let wanted = |node: NodeIndex| match truth {
        Truth::True => moment.get(node) == Truth::True,
        Truth::False => moment.get(node) == Truth::False,
        Truth::Unknown => moment.get(node) != Truth::True,
    };
    let (set, smallest) =
        smallest::smallest(network.circuit(), root, &|node| own.contains(&node), &wanted, truth.holds());
    let ways = ways(network, monitor, root, &wanted);
    let cause = |&node: &NodeIndex| {
        let truth = moment.get(node);
        if let Some((at, _)) = (0..).zip(own).find(|&(_, &demand)| demand == node) {
            return Cause { monitor, leaf: Leaf::Demand(at), truth, through: Vec::new() };
        }
        let (owner, at) = network.owner(EvidenceId(node));
        let through = ways[node as usize].clone().unwrap_or_default();
        Cause { monitor: owner, leaf: Leaf::Evidence(at), truth, through }
    };
    Why { monitor, guarantee, truth, because: set.iter().map(cause).collect(), smallest }
}

/// Why a monitor is in its state at this moment: why the guarantee holds (unless it is in the safe state), and why no
/// stronger one does. The strongest guarantee comes first.
pub fn why_state(moment: &Moment<'_>, monitor: MonitorId, depth: Depth) -> Vec<Why> {
    let count = match moment.state(monitor) {
        State::Guarantee(at) => at + 1,
        State::Safe => moment.network.guarantees(monitor),
    };
    (0..count).map(|guarantee| why(moment, monitor, guarantee, depth)).collect()
}

/// Per node that a root reaches through nodes with the wanted values: the demands on a shortest way to it.
fn ways(
    network: &Network,
    monitor: MonitorId,
    root: NodeIndex,
    wanted: &dyn Fn(NodeIndex) -> bool,
) -> Vec<Option<Vec<(MonitorId, u32)>>> {
    let circuit = network.circuit();
    let mut ways: Vec<Option<Vec<(MonitorId, u32)>>> = vec![None; circuit.size()];
    ways[root as usize] = Some(Vec::new());
    let mut waiting = VecDeque::from([(root, monitor)]);
    while let Some((node, monitor)) = waiting.pop_front() {
        let way = ways[node as usize].clone().unwrap_or_default();
        for &part in circuit.threshold(node).map_or(&[][..], |(_, parts)| parts) {
            if ways[part as usize].is_some() || !wanted(part) {
                continue;
            }
            let demand = (0..).zip(network.demand_nodes(monitor)).find(|&(_, &demand)| demand == part);
            let step = demand.map(|(at, _)| (monitor, at));
            let first = circuit.threshold(part).map_or(part, |(_, parts)| parts[0]);
            let owner = match step {
                Some(_) => network.guarantor(part).or(network.guarantor(first)).unwrap_or(monitor),
                None => monitor,
            };
            ways[part as usize] = Some(way.iter().copied().chain(step).collect());
            waiting.push_back((part, owner));
        }
    }
    ways
}
