//! Operations on nodes and their parameters instead of messages: the relay says what is to be done, and the transport
//! does it.

use sesame_plan::{NewValue, NodeId, Transition};

/// What an operation does to a node while it is active.
#[derive(Debug, Clone, PartialEq)]
pub enum Resource {
    /// A parameter has this value.
    Set {
        /// The node.
        node: NodeId,
        /// The name of the parameter.
        parameter: String,
        /// Its value meanwhile.
        value: NewValue,
    },
    /// It has gone through a transition of its lifecycle.
    Transition {
        /// The node.
        node: NodeId,
        /// Which.
        transition: Transition,
    },
    /// It is stopped.
    Pause {
        /// The node.
        node: NodeId,
    },
    /// It has only this share of the time.
    Slow {
        /// The node.
        node: NodeId,
        /// From 0 to 1.
        share: f64,
    },
    /// It is dead; afterwards it is started again.
    Kill {
        /// The node.
        node: NodeId,
    },
}

/// What the transport has to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// The position of the operation in the test.
    pub operation: usize,
    /// What its operation does.
    pub resource: Resource,
    /// Whether it begins; otherwise it ends, and everything is to be as before.
    pub begins: bool,
}
