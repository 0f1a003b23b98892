//! All gates of a network as one circuit of thresholds, and its values, kept up to date as leaves change.
//!
//! A node is a leaf, or holds if so many of its parts do. All gates are monotone, so a change of one leaf moves every
//! node in one direction, at most twice (false, unknown, true): what a change costs is bounded by the edges that it
//! reaches, and nodes that it does not reach cost nothing.

use crate::truth::{Truth, at_least_of};

/// The position of a node.
pub(crate) type NodeIndex = u32;

/// Thresholds over leaves.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Circuit {
    /// Per node: how many parts must hold; 0 for a leaf.
    need: Vec<u32>,
    /// Per node: its parts, in order. A part may occur more than once.
    parts: Vec<Vec<NodeIndex>>,
    /// Per node: the nodes of which it is a part, as often as it is.
    users: Vec<Vec<NodeIndex>>,
    /// All nodes with parts, each after its parts.
    order: Vec<NodeIndex>,
}

impl Circuit {
    /// Adds a leaf, or a node that is defined later.
    pub(crate) fn add(&mut self) -> NodeIndex {
        let node = u32::try_from(self.need.len()).expect("a plan has fewer gates than 2^32");
        self.need.push(0);
        self.parts.push(Vec::new());
        self.users.push(Vec::new());
        node
    }

    /// Says when a node holds: if `need` of its parts do, from 1 to all of them. All of them were defined before.
    pub(crate) fn define(&mut self, node: NodeIndex, need: usize, parts: Vec<NodeIndex>) {
        self.need[node as usize] = u32::try_from(need).expect("a gate has fewer parts than 2^32");
        for &part in &parts {
            self.users[part as usize].push(node);
        }
        self.parts[node as usize] = parts;
        self.order.push(node);
    }

    /// How many nodes there are.
    pub(crate) fn size(&self) -> usize {
        self.need.len()
    }

    /// How many parts of a node must hold, and its parts; `None` for a leaf.
    pub(crate) fn threshold(&self, node: NodeIndex) -> Option<(usize, &[NodeIndex])> {
        let parts = &self.parts[node as usize];
        (!parts.is_empty()).then(|| (self.need[node as usize] as usize, parts.as_slice()))
    }

    /// All nodes with parts, each after its parts.
    pub(crate) fn order(&self) -> &[NodeIndex] {
        &self.order
    }
}

/// A value for each node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Values {
    truth: Vec<Truth>,
    /// Per node: how many of its parts are true. While a change spreads it may lag behind, so it has a sign.
    certain: Vec<i32>,
    /// Per node: how many of its parts are not false.
    possible: Vec<i32>,
    /// Changes of nodes that their users have not taken yet.
    open: Vec<(NodeIndex, Truth, Truth)>,
}

impl Values {
    /// All leaves are unknown, and so is everything else.
    pub(crate) fn new(circuit: &Circuit) -> Self {
        let count = |parts: &Vec<NodeIndex>| i32::try_from(parts.len()).expect("a gate has fewer parts than 2^31");
        Values {
            truth: vec![Truth::Unknown; circuit.size()],
            certain: vec![0; circuit.size()],
            possible: circuit.parts.iter().map(count).collect(),
            open: Vec::with_capacity(circuit.size()),
        }
    }

    /// The value of a node.
    #[inline]
    pub(crate) fn get(&self, node: NodeIndex) -> Truth {
        self.truth[node as usize]
    }

    /// Sets a leaf, and all that follows. `changed` is told each change of a node other than the leaf, which may change
    /// twice.
    #[inline]
    pub(crate) fn set(
        &mut self,
        circuit: &Circuit,
        leaf: NodeIndex,
        truth: Truth,
        mut changed: impl FnMut(NodeIndex, Truth, Truth),
    ) {
        let before = std::mem::replace(&mut self.truth[leaf as usize], truth);
        if before == truth {
            return;
        }
        self.open.push((leaf, before, truth));
        while let Some((node, before, after)) = self.open.pop() {
            let certain = i32::from(after == Truth::True) - i32::from(before == Truth::True);
            let possible = i32::from(after != Truth::False) - i32::from(before != Truth::False);
            for &user in &circuit.users[node as usize] {
                let at = user as usize;
                self.certain[at] += certain;
                self.possible[at] += possible;
                let count = |of: i32| usize::try_from(of).unwrap_or(0);
                let now = at_least_of(circuit.need[at] as usize, count(self.certain[at]), count(self.possible[at]));
                let was = self.truth[at];
                if now != was {
                    self.truth[at] = now;
                    changed(user, was, now);
                    self.open.push((user, was, now));
                }
            }
        }
    }
}
