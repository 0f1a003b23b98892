//! What operations have changed in nodes and their parameters, and what they were before.

use std::time::Instant;

use sesame_plan::NodeId;

use crate::lifecycle::State;
use crate::parameters::ParameterValue;

/// What is not as it was before the run.
#[derive(Debug)]
pub(super) struct Change {
    pub(super) operation: usize,
    pub(super) what: Changed,
}

#[derive(Debug)]
pub(super) enum Changed {
    Parameter {
        node: NodeId,
        name: String,
        before: ParameterValue,
    },
    /// A transition took a node from one state to another.
    State {
        node: NodeId,
        before: State,
        after: State,
    },
    Paused(NodeId),
    Slowed(Slowed),
    Killed(NodeId),
}

/// A node that has only a share of the time.
#[derive(Debug)]
pub(super) struct Slowed {
    pub(super) node: NodeId,
    pub(super) share: f64,
    pub(super) since: Instant,
    pub(super) paused: bool,
}
