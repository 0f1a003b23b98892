//! Positions in the model as ids of the plan.

use sesame_dsl::model::{self, Id as _};
use sesame_plan as plan;

pub(super) fn topic_id(id: model::TopicId) -> plan::TopicId {
    plan::TopicId(raw(id.index()))
}

pub(super) fn node_id(id: model::NodeId) -> plan::NodeId {
    plan::NodeId(raw(id.index()))
}

pub(super) fn raw(index: usize) -> u32 {
    u32::try_from(index).expect("a file holds fewer than 2^32 declarations")
}
