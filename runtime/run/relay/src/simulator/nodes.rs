//! Nodes that are parts of a simulator, and what it can do to them when the runner says so.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde::{Deserialize, Serialize};

/// A fault that a simulator can give to a node of its own, by the word that operations have for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeFault {
    /// It stands still for a while, and keeps its state.
    Pause,
    /// It has only a share of its time for a while.
    Slow,
    /// It dies, loses its state, and is started again later.
    Kill,
}

impl NodeFault {
    /// Its word.
    pub const fn word(self) -> &'static str {
        match self {
            NodeFault::Pause => "pause",
            NodeFault::Slow => "slow",
            NodeFault::Kill => "kill",
        }
    }
}

/// What a node does from now on, whatever it did before. The runner puts operations that act together into one order,
/// so a simulator has nothing to count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "order", rename_all = "snake_case")]
pub enum NodeOrder {
    /// It stands still and keeps its state.
    Pause,
    /// It has only this share of its time.
    Slow {
        /// Above 0 and below 1.
        share: f64,
    },
    /// It goes on as usual, after `Pause` or `Slow`.
    Resume,
    /// It is dead: it does nothing, and has lost its state.
    Kill,
    /// It is started again, in the state in which it starts a run.
    Restart,
}

/// An order and the node it is for, by its name in the space; of a group of nodes, `vehicle[r1]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderToNode {
    /// The node.
    pub node: String,
    /// What it does from now on.
    #[serde(flatten)]
    pub order: NodeOrder,
}

/// What a simulator offers for each of its nodes.
pub type Offers = BTreeMap<String, BTreeSet<NodeFault>>;

/// What a simulator in Rust offers, and the orders that it has not yet taken.
#[derive(Debug, Default)]
pub(crate) struct Offered {
    offers: Offers,
    orders: BTreeMap<String, VecDeque<NodeOrder>>,
}

impl Offered {
    pub(crate) fn offer(&mut self, node: &str, faults: &[NodeFault]) {
        self.offers.entry(node.to_owned()).or_default().extend(faults);
    }

    #[cfg(any(feature = "in-process", feature = "serve"))]
    pub(crate) fn offers(&self) -> &Offers {
        &self.offers
    }

    /// An order for a node. One for a node that is not offered is not kept.
    pub(crate) fn give(&mut self, OrderToNode { node, order }: OrderToNode) {
        if self.offers.contains_key(&node) {
            self.orders.entry(node).or_default().push_back(order);
        }
    }

    /// The next order for a node.
    pub(crate) fn take(&mut self, node: &str) -> Option<NodeOrder> {
        self.orders.get_mut(node)?.pop_front()
    }
}
