//! The plan as a whole: the space as far as its campaign sees it, and the campaign itself.

use serde::{Deserialize, Serialize};

use crate::{
    Campaign, Compensation, KnownTest, KnownTestId, Lab, MessageId, MessageType, Metric, MetricId, Monitor, MonitorId,
    Node, NodeId, Operation, OperationId, Requirement, RequirementId, Simulator, Topic, TopicId,
};

/// Everything a runner knows of its campaign. Deserializing one [validates](CampaignPlan::validate) it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct CampaignPlan {
    /// [`crate::SCHEMA`] of the generator that wrote the plan. It comes first, so that a plan of another schema is
    /// refused for that reason.
    #[serde(deserialize_with = "crate::validate::this_schema")]
    pub schema: u32,
    /// Name and version of the generator, for example `sesamec 0.1.0`.
    pub generator: String,
    /// File name of the `.sesame` file, without its folder.
    pub source: String,
    /// The space's name.
    pub space: String,
    /// The space's doc comment, lines joined by `\n`; empty when there is none.
    pub doc: String,
    /// The simulator under test.
    pub simulator: Simulator,
    /// Message types, each after the types it contains.
    pub messages: Vec<MessageType>,
    /// All topics of the space, in declaration order.
    pub topics: Vec<Topic>,
    /// Nodes of the system.
    pub nodes: Vec<Node>,
    /// The metrics this campaign measures, in declaration order.
    pub metrics: Vec<Metric>,
    /// All requirements of the space.
    pub requirements: Vec<Requirement>,
    /// The operations this campaign (or a known test of it) may use, in declaration order.
    pub operations: Vec<Operation>,
    /// The known tests of the space whose operations and metrics are all in this plan.
    pub tests: Vec<KnownTest>,
    /// The campaign.
    pub campaign: Campaign,
    /// All runtime monitors of the space, in declaration order. A plan without any is written as if there were no such
    /// list.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub monitors: Vec<Monitor>,
    /// All labs of the space, in declaration order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labs: Vec<Lab>,
    /// What brings the simulation closer to a lab; `None` for the simulation as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compensation: Option<Compensation>,
}

impl CampaignPlan {
    /// The message type of an id.
    pub fn message(&self, id: MessageId) -> &MessageType {
        &self.messages[id.index()]
    }
    /// The topic of an id.
    pub fn topic(&self, id: TopicId) -> &Topic {
        &self.topics[id.index()]
    }
    /// The node of an id.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.index()]
    }
    /// The metric of an id.
    pub fn metric(&self, id: MetricId) -> &Metric {
        &self.metrics[id.index()]
    }
    /// The operation of an id.
    pub fn operation(&self, id: OperationId) -> &Operation {
        &self.operations[id.index()]
    }
    /// The requirement of an id.
    pub fn requirement(&self, id: RequirementId) -> &Requirement {
        &self.requirements[id.index()]
    }
    /// The runtime monitor of an id.
    pub fn monitor(&self, id: MonitorId) -> &Monitor {
        &self.monitors[id.index()]
    }
    /// The known test of an id.
    pub fn test(&self, id: KnownTestId) -> &KnownTest {
        &self.tests[id.index()]
    }
}
