//! Monitors compiled together: one circuit for all gates, demands included, and where everything is in it.
//!
//! Monitors are decided in the order of their demands, those of equal rank in the order of their declaration. Which
//! decisions a run comes to does not depend on the order of declaration.

mod decide;
mod run;
mod timers;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use sesame_plan::{Gate, Monitor, MonitorId};

use crate::circuit::{Circuit, NodeIndex};
use crate::evidence::Rule;
use crate::gate;

pub(crate) use decide::Deciding;
pub use decide::{Decision, State};
pub use run::{Changes, EvidenceChange, Reading, Run};

/// A piece of evidence of a network: its monitor's position first, then its own position there, counted through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EvidenceId(pub u32);

impl EvidenceId {
    /// The position among all evidence of the network.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Monitors that are run together.
#[derive(Debug, Clone)]
pub struct Network {
    positions: Vec<MonitorPositions>,
    order: Vec<MonitorId>,
    rules: Vec<Rule>,
    /// The monitor of each piece of evidence.
    owners: Vec<MonitorId>,
    circuit: Circuit,
    /// The monitor of each guarantee. Guarantees are the nodes after the evidence.
    guarantors: Vec<MonitorId>,
}

/// Where a monitor is in a network.
#[derive(Debug, Clone, Default)]
struct MonitorPositions {
    /// Its position in the order.
    rank: u32,
    first_evidence: u32,
    first_guarantee: NodeIndex,
    guarantees: u32,
    demands: Vec<NodeIndex>,
}

/// Why monitors cannot be run: their plan is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invalid {
    /// The guarantees of this monitor are none, or not in the order of falling integrity.
    Guarantees(MonitorId),
    /// A gate of this monitor has no parts, needs none or too many of them, or reads what is not there.
    Gate(MonitorId),
    /// A demand of this monitor names a guarantee that is not there.
    Demand(MonitorId),
    /// This monitor relies on itself.
    Circle(MonitorId),
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Invalid::Guarantees(MonitorId(at)) => {
                write!(f, "monitor {at} has no guarantees, or not in the order of their integrity")
            }
            Invalid::Gate(MonitorId(at)) => write!(f, "a gate of monitor {at} reads what is not there"),
            Invalid::Demand(MonitorId(at)) => write!(f, "monitor {at} demands a guarantee that is not there"),
            Invalid::Circle(MonitorId(at)) => write!(f, "monitor {at} relies on itself"),
        }
    }
}

impl std::error::Error for Invalid {}

impl Network {
    /// Compiles monitors: the list to which [`MonitorId`]s in their demands refer.
    pub fn new(monitors: &[Monitor]) -> Result<Self, Invalid> {
        for (id, monitor) in ids(monitors) {
            let falling = monitor.guarantees.windows(2).all(|pair| pair[0].integrity > pair[1].integrity);
            if monitor.guarantees.is_empty() || !falling {
                return Err(Invalid::Guarantees(id));
            }
            for demand in &monitor.demands {
                let other = monitors.get(demand.monitor.index()).ok_or(Invalid::Demand(id))?;
                other.guarantees.get(demand.guarantee as usize).ok_or(Invalid::Demand(id))?;
            }
            if !monitor.guarantees.iter().all(|guarantee| is_sound(&guarantee.gate, monitor)) {
                return Err(Invalid::Gate(id));
            }
        }
        let order = order(monitors)?;

        let mut circuit = Circuit::default();
        let mut positions: Vec<MonitorPositions> = Vec::with_capacity(monitors.len());
        let (mut rules, mut owners, mut guarantors) = (Vec::new(), Vec::new(), Vec::new());
        for (id, monitor) in ids(monitors) {
            let first_evidence = position(rules.len());
            rules.extend(monitor.evidence.iter().map(Rule::of));
            owners.extend(monitor.evidence.iter().map(|_| id));
            monitor.evidence.iter().for_each(|_| _ = circuit.add());
            positions.push(MonitorPositions { first_evidence, ..MonitorPositions::default() });
        }
        for (id, monitor) in ids(monitors) {
            positions[id.index()].first_guarantee = position(circuit.size());
            positions[id.index()].guarantees = position(monitor.guarantees.len());
            for _ in &monitor.guarantees {
                circuit.add();
                guarantors.push(id);
            }
        }
        let mut demanded: BTreeMap<(MonitorId, u32), NodeIndex> = BTreeMap::new();
        for (rank, &id) in (0..).zip(&order) {
            let monitor = &monitors[id.index()];
            let demands = monitor.demands.iter().map(|demand| {
                let first = positions[demand.monitor.index()].first_guarantee;
                if demand.guarantee == 0 {
                    return first;
                }
                *demanded.entry((demand.monitor, demand.guarantee)).or_insert_with(|| {
                    let node = circuit.add();
                    circuit.define(node, 1, (first..=first + demand.guarantee).collect());
                    node
                })
            });
            let demands: Vec<NodeIndex> = demands.collect();
            let positions = &mut positions[id.index()];
            (positions.rank, positions.demands) = (rank, demands);
            for (node, guarantee) in (positions.first_guarantee..).zip(&monitor.guarantees) {
                let (need, parts) = match gate::parts(&guarantee.gate) {
                    Some((need, parts)) => (need, parts),
                    None => (1, std::slice::from_ref(&guarantee.gate)),
                };
                let parts = parts.iter().map(|part| node_of(part, positions, &mut circuit)).collect();
                circuit.define(node, need, parts);
            }
        }
        Ok(Network { positions, order, rules, owners, circuit, guarantors })
    }

    /// The monitors in the order in which they are decided.
    pub fn order(&self) -> &[MonitorId] {
        &self.order
    }

    /// How many pieces of evidence all monitors have together.
    pub fn evidence_count(&self) -> usize {
        self.rules.len()
    }

    /// The evidence at this position of a monitor.
    pub fn evidence(&self, monitor: MonitorId, position: u32) -> EvidenceId {
        EvidenceId(self.positions[monitor.index()].first_evidence + position)
    }

    /// The monitor of a piece of evidence, and its position there.
    pub fn owner(&self, evidence: EvidenceId) -> (MonitorId, u32) {
        let monitor = self.owners[evidence.index()];
        (monitor, evidence.0 - self.positions[monitor.index()].first_evidence)
    }

    /// How a piece of evidence follows from its condition.
    pub fn rule(&self, evidence: EvidenceId) -> &Rule {
        &self.rules[evidence.index()]
    }

    /// How many guarantees a monitor has.
    pub fn guarantees(&self, monitor: MonitorId) -> u32 {
        self.positions[monitor.index()].guarantees
    }

    pub(crate) fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    pub(crate) fn guarantee_node(&self, monitor: MonitorId, position: u32) -> NodeIndex {
        self.positions[monitor.index()].first_guarantee + position
    }

    /// The nodes of a monitor's demands, equal ones for equal demands. That of a demand for another monitor's strongest
    /// guarantee is the guarantee's.
    pub(crate) fn demand_nodes(&self, monitor: MonitorId) -> &[NodeIndex] {
        &self.positions[monitor.index()].demands
    }

    /// The monitor of a guarantee; `None` for another node.
    pub(crate) fn guarantor(&self, node: NodeIndex) -> Option<MonitorId> {
        self.guarantors.get((node as usize).checked_sub(self.rules.len())?).copied()
    }
}

/// The node of a gate, which is added with all its parts.
fn node_of(gate: &Gate, positions: &MonitorPositions, circuit: &mut Circuit) -> NodeIndex {
    match gate {
        Gate::Evidence(at) => positions.first_evidence + at,
        Gate::Demand(at) => positions.demands[*at as usize],
        Gate::All(_) | Gate::Any(_) | Gate::AtLeast { .. } => {
            let (need, parts) = gate::parts(gate).expect("a leaf was handled above");
            let parts = parts.iter().map(|part| node_of(part, positions, circuit)).collect();
            let node = circuit.add();
            circuit.define(node, need, parts);
            node
        }
    }
}

fn is_sound(gate: &Gate, monitor: &Monitor) -> bool {
    match gate {
        Gate::Evidence(at) => (*at as usize) < monitor.evidence.len(),
        Gate::Demand(at) => (*at as usize) < monitor.demands.len(),
        Gate::All(_) | Gate::Any(_) | Gate::AtLeast { .. } => gate::parts(gate).is_some_and(|(need, parts)| {
            (1..=parts.len()).contains(&need) && parts.iter().all(|part| is_sound(part, monitor))
        }),
    }
}

/// Monitors such that each comes after those on which it relies; where that leaves a choice, in the order of their
/// declaration.
fn order(monitors: &[Monitor]) -> Result<Vec<MonitorId>, Invalid> {
    let mut order: Vec<MonitorId> = Vec::with_capacity(monitors.len());
    let mut ranked = vec![false; monitors.len()];
    // For each monitor: how many demands are not met yet, and who demands of it.
    let mut open: Vec<usize> = monitors.iter().map(|monitor| monitor.demands.len()).collect();
    let mut demanding = vec![Vec::new(); monitors.len()];
    for (id, monitor) in ids(monitors) {
        for demand in &monitor.demands {
            demanding[demand.monitor.index()].push(id);
        }
    }
    let mut free: BTreeSet<MonitorId> = ids(monitors).map(|(id, _)| id).filter(|id| open[id.index()] == 0).collect();
    while let Some(id) = free.pop_first() {
        order.push(id);
        ranked[id.index()] = true;
        for &user in &demanding[id.index()] {
            open[user.index()] -= 1;
            if open[user.index()] == 0 {
                free.insert(user);
            }
        }
    }
    match ranked.iter().position(|ranked| !ranked) {
        None => Ok(order),
        // Those that are left are in a circle, or rely on one: whoever follows demands among them comes to a circle.
        Some(mut at) => {
            for _ in 0..monitors.len() {
                let next = monitors[at].demands.iter().map(|demand| demand.monitor.index()).find(|&next| !ranked[next]);
                at = next.expect("a monitor that is left has a demand that is left");
            }
            Err(Invalid::Circle(MonitorId(position(at))))
        }
    }
}

fn ids(monitors: &[Monitor]) -> impl Iterator<Item = (MonitorId, &Monitor)> {
    (0..).map(MonitorId).zip(monitors)
}

fn position(at: usize) -> u32 {
    u32::try_from(at).expect("a plan has fewer than 2^32 of anything")
}
