//! Declarative metrics: what they compute, with units resolved.
//!
//! Numbers are in the units of the wire or of a conversion that is part of the expression; so evaluating one
//! needs no units.

use sesame_plan::{Aggregate, Condition, InList, Members, Memory, TextTest};

use super::system::FieldPath;

/// A metric computed from messages without any code of the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// What its expressions refer to by position; each once, at least one.
    pub inputs: Vec<Input>,
    /// What becomes of the values over time.
    pub aggregate: Aggregate,
    /// Only messages at which it holds count.
    pub when: Option<Condition>,
    /// Shortest simulation time between two messages that count, in seconds; positive.
    pub every: Option<f64>,
    /// A text or whole number in the messages of one of the inputs' topics: one state for each of its values.
    pub per: Option<FieldPath>,
    /// Whether it hears messages after operations, as they are delivered, and not as they were published.
    pub outbound: bool,
}

/// A value held from the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Where it comes from. Its fields may end with `x`, `y` or `z` of a point.
    pub field: FieldPath,
    /// What is made of a group's members.
    pub members: Members,
    /// For a value in a list: the way from the field, which is the list, to it.
    pub list: Option<InList>,
    /// For a text: the input is whether this holds of it.
    pub text: Option<TextTest>,
    /// What is computed from the values of successive messages, the innermost first.
    pub memory: Vec<Memory>,
}

impl Input {
    /// The most that is computed from successive messages, one from the other.
    pub const DEEPEST_MEMORY: usize = sesame_plan::Input::DEEPEST_MEMORY;

    /// Whether it is an integral, which grows between messages.
    pub fn is_integral(&self) -> bool {
        self.memory.last() == Some(&Memory::Integral)
    }
}
