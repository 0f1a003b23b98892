//! Systems of ROS, from the model to the plan: their layouts, and how topics are cut.

use std::collections::BTreeSet;

use sesame_dsl::model::{self, NodeId, Space, TopicId};
use sesame_plan as plan;
use sesame_plan::WireType;

use super::id::node_id;

/// How the topics of a space are cut, in their order: if one of an action is, all of them are.
pub(super) fn wirings(space: &Space, stepped: bool) -> Vec<plan::Wiring> {
    let mut wirings: Vec<plan::Wiring> = space.topics.iter().map(|(topic, _)| wiring(space, topic, stepped)).collect();
    // What is disturbed would otherwise be overtaken by the rest of its action, which nobody disturbs: a status by the
    // result, for example.
    let actions = || space.topics.values().map(|topic| topic.action.as_deref());
    let cut: BTreeSet<&str> =
        actions().zip(&wirings).filter(|(_, wiring)| wiring.cut).filter_map(|(action, _)| action).collect();
    for (action, wiring) in actions().zip(&mut wirings) {
        wiring.cut |= action.is_some_and(|action| cut.contains(action));
    }
    wirings
}

/// Whether a monitor of the runner publishes on a topic: its state, or what is to bring the system into a safe state.
pub(super) fn by_monitor(space: &Space, topic: TopicId) -> bool {
    space.eddis.values().any(|eddi| {
        let mitigation = eddi.otherwise.mitigation.as_ref();
        eddi.publishes == Some(topic) || mitigation.is_some_and(|mitigation| mitigation.field.topic == topic)
    })
}

/// The layouts of all topics and what these contain, each after those it contains.
pub(super) fn interfaces(space: &Space) -> Vec<plan::Interface> {
    let mut used: BTreeSet<&str> = BTreeSet::new();
    for topic in space.topics.values() {
        if let model::Type::Message(id) = topic.ty {
            used.extend(space.messages[id].interface.as_deref());
        }
    }
    // What contains others comes after them, so going backwards each has been mentioned by all that contain it.
    let mut kept: Vec<plan::Interface> = Vec::new();
    for interface in space.interfaces.iter().rev() {
        if !used.contains(interface.name.as_str()) {
            continue;
        }
        used.extend(interface.fields.iter().filter_map(|field| contained(&field.ty)));
        kept.push(interface.clone());
    }
    kept.reverse();
    kept
}

/// The interface that values of a type are or hold.
fn contained(ty: &WireType) -> Option<&str> {
    match ty {
        WireType::Interface { name } => Some(name),
        WireType::Array { of, .. } | WireType::Sequence { of, .. } => contained(of),
        WireType::Primitive { .. } | WireType::String { .. } | WireType::WString { .. } => None,
    }
}

/// How a topic is cut: by all operations of the space, so that its campaigns need the same remappings. What monitors
/// publish takes the same way as what nodes do, so these topics are cut, too.
///
/// In lock-step, what a node answers to, whatever else it hears, and its answers pass through the relay too: only then
/// does the relay decide in which order a node hears its messages, and that an answer has arrived before the next step.
fn wiring(space: &Space, topic: TopicId, stepped: bool) -> plan::Wiring {
    let on_it = || space.operations.values().filter(|operation| operation.disturbs(topic));
    let distinguished = |nodes: fn(&model::Operation) -> &Vec<NodeId>| {
        let nodes: BTreeSet<NodeId> = on_it().flat_map(nodes).copied().collect();
        nodes.into_iter().map(node_id).collect()
    };
    let in_step = |node: &model::Node| {
        let answers = node.answers.iter().any(|&(_, with)| with == topic);
        answers || !node.answers.is_empty() && node.subscribes.iter().any(|used| used.topic == topic)
    };
    plan::Wiring {
        cut: on_it().next().is_some() || by_monitor(space, topic) || stepped && space.nodes.values().any(in_step),
        publishers: distinguished(|operation| &operation.from),
        subscribers: distinguished(|operation| &operation.to),
        joined: false,
    }
}
