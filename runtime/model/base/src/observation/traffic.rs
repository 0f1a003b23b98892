//! What was published on the wires of a system in a run.

use serde::{Deserialize, Serialize};

use sesame_plan::{OperationId, Span};

/// What was published on a wire in a run, before any operation touched it. Wires are the paths of topics in the order
/// of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Traffic {
    /// The position of the wire.
    pub wire: u32,
    /// The number of messages, at least one.
    pub messages: u64,
    /// Simulation time of the first one, in seconds.
    pub first: f64,
    /// Simulation time of the last one, in seconds.
    pub last: f64,
    /// The longest time without a message between the first and the last one. Empty if all came in one instant.
    pub gap: Span,
    /// The median of the times between successive instants with messages, in seconds; in a long run, of an even sample
    /// of them.
    pub median_gap: f64,
}

/// An operation whose topic had no message inside of its `within` in the reference run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Unreached {
    /// The operation.
    pub operation: OperationId,
    /// When its topic had the message that is nearest to its `within`, in seconds; `None` if it had none at all.
    pub nearest: Option<f64>,
}
