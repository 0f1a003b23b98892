//! Simulators, from the model to the plan: their own settings, with what follows from the rest of the space.

use std::collections::BTreeSet;

use sesame_dsl::model::{self, NodeId, Space, TopicId};
use sesame_plan as plan;

use super::id::{node_id, topic_id};
use super::ros2::{by_monitor, interfaces, wirings};

/// A simulator of a space, that of its system or that of a lab, without what starts and ends it.
pub fn simulator(space: &Space, simulator: &model::Simulator) -> plan::Simulator {
    let model::Simulator { declaration, transport, crate_folder: _, ros, proxies } = simulator;
    let (ros, proxies) = (ros.clone(), proxies.clone());
    let mut plan = plan::Simulator { ros, proxies, ..plan::Simulator::new(&declaration.name, transport.clone()) };
    if plan.properties().bus.is_some() {
        plan.wiring = wirings(space, plan.stepping().is_some());
    }
    if let Some(ros) = &mut plan.ros {
        ros.interfaces = interfaces(space);
    }
    if let Some(mqtt) = plan.brokers_mut() {
        mqtt.brokers = brokers_of_nodes(space, &mqtt.broker);
    }
    if let Some(simlog) = plan.simlog_mut() {
        simlog.cut = acted_on(space);
    }
    plan
}

/// The brokers of nodes that have one of their own, which is like that of the simulator but for its address.
fn brokers_of_nodes(space: &Space, broker: &plan::Broker) -> Vec<(plan::NodeId, plan::Broker)> {
    let of_node = |(id, node): (NodeId, &model::Node)| {
        let remote = plan::Remote { url: node.broker.clone()?, ..broker.remote.clone() };
        Some((node_id(id), plan::Broker { remote, user: broker.user.clone() }))
    };
    space.nodes.iter().filter_map(of_node).collect()
}

/// The topics on which any operation of the space acts, or a monitor publishes.
fn acted_on(space: &Space) -> Vec<plan::TopicId> {
    let mut acted_on: BTreeSet<TopicId> = space.operations.values().flat_map(model::Operation::topics).collect();
    acted_on.extend(space.topics.iter().map(|(topic, _)| topic).filter(|&topic| by_monitor(space, topic)));
    acted_on.into_iter().map(topic_id).collect()
}
