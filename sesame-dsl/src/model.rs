//! The resolved model: what a space means, with every name an id and every number in its unit.
//!
//! Guarantees, once [`crate::analyse`] hands a [`Space`] out: every id is in range; message types are listed after the
//! types they contain; every range has `low <= high`; times are seconds of simulation time; probabilities are in
//! `0..=1`; every other number is in the unit that its field or metric declares.

mod campaign;
pub mod condition;
mod declaration;
pub mod eddi;
mod formula;
mod fuzz;
mod ids;
mod metrics;
pub mod physical;
mod system;
mod temporal;

pub use campaign::*;
pub use declaration::Declaration;
pub use formula::*;
pub use fuzz::*;
pub use ids::*;
pub use metrics::*;
pub use system::*;
pub use temporal::*;

use std::collections::BTreeMap;

// What holds no names and no units is the same here and in a plan.
pub use sesame_plan::stl::Interval;
pub use sesame_plan::{
    Aggregate, Averaging, BinaryFunction, BoostedChildren, Bound, Channel, Choice, ChoiceKind, Clock, Comparison,
    Condition, Confirmation, Copies, Counted, Dimension, Direction, Distance, Distribution, Drain, Exploration,
    Expression, Interface, Members, MembersOf, Memory, MessageRun, Messages, Moment, NamedNumber, NewValue, NotFinite,
    OperationKind, OwnSetting, Point, Recorded, Region, Ros, Setting, SignedDistance, Statistic, Step, StepBy,
    Stepping, StopRule, Strategy, StrategyKind, StrategyProperties, TextTest, Transition, Transport, Trend, Turn,
    UnaryFunction, ValueMode,
};

use crate::span::FileId;

/// A whole space.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The simulator under test.
    pub simulator: Simulator,
    /// What the system needs in addition to it, and what a relay may cost.
    pub lifecycle: Lifecycle,
    /// Message types, each after the types it contains, otherwise in declaration order.
    pub messages: Arena<MessageId, Message>,
    /// Layouts of ROS types: those of messages with one and what they contain, each after those it contains.
    pub interfaces: Vec<Interface>,
    /// Topics, in declaration order; those of services come after them, and those of actions last.
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
    /// Runtime monitors, in declaration order.
    pub eddis: Arena<EddiId, eddi::Eddi>,
    /// Physical labs, in declaration order.
    pub physicals: Arena<PhysicalId, physical::Physical>,
    /// The names of the files it is declared in, as seen from the folder of the first.
    pub files: BTreeMap<FileId, String>,
}

impl Space {
    /// The campaign of a name.
    pub fn campaign(&self, name: &str) -> Option<CampaignId> {
        self.campaigns.iter().find(|(_, campaign)| campaign.declaration.name == name).map(|(id, _)| id)
    }

    /// Whether copies of one operation may act at the same time in the tests of all campaigns that search, of which
    /// there is one at least.
    pub fn copies_may_overlap(&self) -> bool {
        let mut searching = self.campaigns.values().filter_map(|campaign| campaign.search.template()).peekable();
        searching.peek().is_some() && searching.all(|template| template.copies == Copies::MayOverlap)
    }

    /// The file that something is declared in, as seen from the folder of the space's own file.
    pub fn file_of(&self, declaration: &Declaration) -> &str {
        self.files.get(&declaration.span.file).map_or("", String::as_str)
    }
}
