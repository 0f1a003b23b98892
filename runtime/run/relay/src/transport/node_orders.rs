//! What operations want done to nodes that are parts of a simulator, as orders to the simulator.

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, NodeId, OperationKind};

use crate::fuzz::{Order, Resource};
use crate::relay::Exchange;
use crate::simulator::{NodeFault, NodeOrder, Offers, OrderToNode};
use crate::transport::TransportError;

/// What operations do to nodes at this moment of a run. A node that several act on has what the gravest of them wants,
/// so the order of their ends does not matter.
#[derive(Debug, Default)]
pub struct NodeOrders {
    /// The position of each active operation in the test, and what it does to which node.
    active: Vec<(usize, NodeId, Condition)>,
}

/// How a node is, from well to grave.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Condition {
    Well,
    /// It has only this share of its time.
    Slow(f64),
    Paused,
    Dead,
}

impl NodeOrders {
    /// Refuses a simulator that does not offer what an operation of the plan needs.
    pub fn are_offered(plan: &CampaignPlan, offers: &Offers) -> Result<(), TransportError> {
        for operation in &plan.operations {
            let Some(fault) = fault(&operation.kind) else { continue };
            for node in operation.nodes() {
                let node = &plan.node(node).name;
                if !offers.get(node).is_some_and(|faults| faults.contains(&fault)) {
                    return Err(TransportError::NotOffered {
                        operation: operation.name.clone(),
                        fault: fault.word(),
                        node: node.clone(),
                        offers: offers.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    /// The orders for what operations have wanted since the last call. Tells the relay which of them a node feels.
    pub fn take(&mut self, plan: &CampaignPlan, now: SimTime, relay: &mut dyn Exchange) -> Vec<OrderToNode> {
        let mut orders = Vec::new();
        for Order { operation, resource, begins } in relay.take_orders() {
            let Some((node, wanted)) = wanted(&resource) else { continue };
            let before = self.foremost(node);
            if begins {
                self.active.push((operation, node, wanted));
            } else {
                self.active.retain(|&(active, on, _)| (active, on) != (operation, node));
            }
            let after = self.foremost(node);
            if let Some((operation, _)) = after.filter(|_| before != after) {
                relay.carried_out(now, operation);
            }
            let name = &plan.node(node).name;
            let orders_of_node = change(condition(before), condition(after));
            orders.extend(orders_of_node.map(|order| OrderToNode { node: name.clone(), order }));
        }
        orders
    }

    /// The operation that a node feels, the first of the gravest ones, and what it wants.
    fn foremost(&self, node: NodeId) -> Option<(usize, Condition)> {
        let own = self.active.iter().filter(|(_, on, _)| *on == node).map(|&(active, _, wanted)| (active, wanted));
        own.reduce(|first, next| if next.1.gravity() > first.1.gravity() { next } else { first })
    }
}

impl Condition {
    /// A graver condition has a greater one.
    fn gravity(self) -> f64 {
        match self {
            Condition::Well => 0.0,
            Condition::Slow(share) => 2.0 - share,
            Condition::Paused => 3.0,
            Condition::Dead => 4.0,
        }
    }
}

fn condition(foremost: Option<(usize, Condition)>) -> Condition {
    foremost.map_or(Condition::Well, |(_, wanted)| wanted)
}

/// The orders that lead from one condition to another.
fn change(before: Condition, after: Condition) -> impl Iterator<Item = NodeOrder> {
    let changes = before != after;
    let restart = (before == Condition::Dead && changes).then_some(NodeOrder::Restart);
    let next = match after {
        _ if !changes => None,
        // A node that is started again is well.
        Condition::Well => restart.is_none().then_some(NodeOrder::Resume),
        Condition::Slow(share) => Some(NodeOrder::Slow { share }),
        Condition::Paused => Some(NodeOrder::Pause),
        Condition::Dead => Some(NodeOrder::Kill),
    };
    restart.into_iter().chain(next)
}

/// What a kind of operation needs of the simulator.
fn fault(kind: &OperationKind) -> Option<NodeFault> {
    match kind {
        OperationKind::Pause { .. } => Some(NodeFault::Pause),
        OperationKind::Slow { .. } => Some(NodeFault::Slow),
        OperationKind::Kill { .. } => Some(NodeFault::Kill),
        _ => None,
    }
}

/// What an operation does to which node; nothing for its parameters and its lifecycle, which nodes of such a simulator
/// do not have.
fn wanted(resource: &Resource) -> Option<(NodeId, Condition)> {
    match *resource {
        Resource::Set { .. } | Resource::Transition { .. } => None,
        Resource::Pause { node } => Some((node, Condition::Paused)),
        Resource::Slow { node, share } => Some((node, Condition::Slow(share))),
        Resource::Kill { node } => Some((node, Condition::Dead)),
    }
}

#[cfg(test)]
mod tests;
