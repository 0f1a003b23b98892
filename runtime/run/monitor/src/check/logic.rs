//! Formulas as nodes of one graph: an atom, or at least so many of some literals. Equal nodes are one node.

use std::collections::BTreeMap;
use std::ops::Not;

/// A node, or its negation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Literal(u32);

impl Literal {
    pub(super) const TRUE: Literal = Literal(0);
    pub(super) const FALSE: Literal = Literal(1);

    pub(super) fn node(self) -> usize {
        (self.0 / 2) as usize
    }

    /// That a node is true.
    pub(super) fn of(node: usize) -> Literal {
        Literal(2 * u32::try_from(node).expect("a plan has fewer than 2^31 conditions"))
    }

    /// Whether it holds if its node is true.
    pub(super) fn is_positive(self) -> bool {
        self.0.is_multiple_of(2)
    }
}

impl Not for Literal {
    type Output = Literal;
    fn not(self) -> Literal {
        Literal(self.0 ^ 1)
    }
}

/// What a node is.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LogicNode {
    /// The constant, or something that may be true or false.
    Atom,
    /// It is true if at least `need` of the parts are, from 1 to all of two or more.
    AtLeast { need: usize, parts: Vec<Literal> },
}

/// All nodes. Parts come before what they are part of.
#[derive(Debug, Clone)]
pub(super) struct Logic {
    nodes: Vec<LogicNode>,
    known: BTreeMap<LogicNode, Literal>,
    users: Vec<Vec<(u32, bool)>>,
}

impl Logic {
    pub(super) fn new() -> Self {
        Logic { nodes: vec![LogicNode::Atom], known: BTreeMap::new(), users: vec![Vec::new()] }
    }

    pub(super) fn nodes(&self) -> &[LogicNode] {
        &self.nodes
    }

    /// The nodes of which a node is a part, as often as it is, and whether as it is or negated.
    pub(super) fn users(&self, node: usize) -> &[(u32, bool)] {
        &self.users[node]
    }

    fn add(&mut self, node: LogicNode) -> Literal {
        let literal = Literal::of(self.nodes.len());
        let at = literal.0 / 2;
        if let LogicNode::AtLeast { parts, .. } = &node {
            for part in parts {
                self.users[part.node()].push((at, part.is_positive()));
            }
        }
        self.nodes.push(node);
        self.users.push(Vec::new());
        literal
    }

    /// Something new that may be true or false.
    pub(super) fn atom(&mut self) -> Literal {
        self.add(LogicNode::Atom)
    }

    /// Whether at least so many of these hold.
    pub(super) fn at_least(&mut self, need: usize, parts: impl IntoIterator<Item = Literal>) -> Literal {
        let mut need = need;
        let mut open: Vec<Literal> = Vec::new();
        for part in parts {
            match part {
                Literal::TRUE => need = need.saturating_sub(1),
                Literal::FALSE => {}
                other => open.push(other),
            }
        }
        if need == 0 {
            return Literal::TRUE;
        }
        if need > open.len() {
            return Literal::FALSE;
        }
        open.sort_unstable();
        if need == 1 || need == open.len() {
            open.dedup();
            need = need.min(open.len());
            if open.windows(2).any(|pair| pair[0] == !pair[1]) {
                return if need == 1 { Literal::TRUE } else { Literal::FALSE };
            }
        }
        if let [only] = open[..] {
            return only;
        }
        let node = LogicNode::AtLeast { need, parts: open };
        if let Some(&known) = self.known.get(&node) {
            return known;
        }
        let literal = self.add(node.clone());
        self.known.insert(node, literal);
        literal
    }

    pub(super) fn all(&mut self, parts: impl IntoIterator<Item = Literal>) -> Literal {
        let parts: Vec<Literal> = parts.into_iter().collect();
        self.at_least(parts.len(), parts)
    }

    pub(super) fn any(&mut self, parts: impl IntoIterator<Item = Literal>) -> Literal {
        self.at_least(1, parts)
    }
}
