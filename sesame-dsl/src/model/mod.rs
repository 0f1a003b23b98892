//! The resolved model: what a space means, with every name an id and every number in its unit.
//!
//! Guarantees, once [`crate::analyse`] hands a [`Space`] out: every id is in range; message types are listed after the
//! types they contain; every range has `low <= high`; times are seconds of simulation time; probabilities are in
//! `0..=1`; every other number is in the unit that its field or metric declares.

mod campaign;
pub mod condition;
mod exploration;
mod formula;
mod fuzz;
mod ids;
mod measure;
mod system;
mod temporal;

pub use campaign::*;
pub use exploration::*;
pub use formula::*;
pub use fuzz::*;
pub use ids::*;
pub use measure::*;
pub use system::*;
pub use temporal::*;

use crate::span::Span;

/// A whole space.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The simulator under test.
    pub simulator: Simulator,
    /// Message types, each after the types it contains, otherwise in declaration order.
    pub messages: Arena<MessageId, Message>,
    /// Topics, in declaration order.
    pub topics: Arena<TopicId, Topic>,
    /// Nodes, in declaration order.
    pub nodes: Arena<NodeId, Node>,
    /// Metrics, in declaration order.
    pub metrics: Arena<MetricId, Metric>,
    /// Requirements, in declaration order.
    pub requirements: Arena<RequirementId, Requirement>,
    /// Operations, in declaration order.
    pub operations: Arena<OperationId, Operation>,
    /// Known tests, in declaration order.
    pub tests: Arena<TestId, Test>,
    /// Campaigns, in declaration order.
    pub campaigns: Arena<CampaignId, Campaign>,
}

impl Space {
    /// The campaign of a name.
    pub fn campaign(&self, name: &str) -> Option<CampaignId> {
        self.campaigns.iter().find(|(_, campaign)| campaign.declaration.name == name).map(|(id, _)| id)
    }
}

/// What every declaration has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declaration {
    /// Its name: ASCII letters, digits and `_`; unique in the space.
    pub name: String,
    /// Where the name stands.
    pub span: Span,
    /// Line of the name, from 1.
    pub line: u32,
    /// Its doc comment, lines joined by `\n`, without the slashes and one space after them; empty when there is none.
    pub doc: String,
}
