//! How a simulator is reached, from the model to the plan.

use std::collections::BTreeSet;

use sesame_dsl::model::{self, NodeId, Space, TopicId};
use sesame_plan as plan;

use super::id::{node_id, topic_id};
use super::ros2::{by_monitor, interfaces, wirings};

/// The way to a simulator of a space: its own, or that of a lab.
pub(super) fn transport(space: &Space, transport: &model::Transport) -> plan::Transport {
    let wiring = || wirings(space, false);
    match transport.clone() {
        model::Transport::InProcess { path, crate_folder: _, step_ns } => plan::Transport::InProcess { path, step_ns },
        model::Transport::Process { program, arguments, step_ns } => {
            plan::Transport::Process { program, arguments, step_ns }
        }
        model::Transport::Ros2 { domain, clock, step, reset } => {
            let wiring = wirings(space, step.is_some());
            plan::Transport::Ros2(plan::Ros2 { domain, clock, step, reset, interfaces: interfaces(space), wiring })
        }
        model::Transport::Rosbridge { remote, domain, dialect, compression, clock, reset, proxies } => {
            let (interfaces, wiring) = (interfaces(space), wiring());
            plan::Transport::Rosbridge(plan::Rosbridge {
                remote,
                domain,
                dialect,
                compression,
                clock,
                reset,
                proxies: proxies.into_iter().map(proxy).collect(),
                interfaces,
                wiring,
            })
        }
        model::Transport::Ros1 { master, clock, reset } => {
            let (interfaces, wiring) = (interfaces(space), wiring());
            plan::Transport::Ros1(plan::Ros1 { master, clock, reset, interfaces, wiring })
        }
        model::Transport::Mqtt { broker, quality } => {
            let of_node = |(id, node): (NodeId, &model::Node)| {
                let remote = plan::Remote { url: node.broker.clone()?, ..broker.remote.clone() };
                Some((node_id(id), plan::Broker { remote, user: broker.user.clone() }))
            };
            let brokers = space.nodes.iter().filter_map(of_node).collect();
            plan::Transport::Mqtt(plan::Mqtt { broker, brokers, quality, wiring: wiring() })
        }
        model::Transport::Simlog { url, topics_url, step_ns, protocol, names, marker, settle_ns, trust: ca } => {
            let mut acted_on: BTreeSet<TopicId> =
                space.operations.values().filter_map(model::Operation::topic).collect();
            acted_on.extend(space.topics.iter().map(|(topic, _)| topic).filter(|&topic| by_monitor(space, topic)));
            let cut = acted_on.into_iter().map(topic_id).collect();
            plan::Transport::Simlog(plan::Simlog {
                url,
                topics_url,
                step_ns,
                protocol,
                names,
                marker,
                cut,
                settle_ns,
                ca,
            })
        }
    }
}

fn proxy(proxy: model::Proxy) -> plan::Proxy {
    let model::Proxy { node, url, token, identity, public } = proxy;
    plan::Proxy { node: node_id(node), url, token, identity, public }
}
