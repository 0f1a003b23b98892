//! A system on a bus, from the model to the plan.

use sesame_dsl::model::{self, NodeId, Space};
use sesame_plan as plan;

use super::id::node_id;
use super::ros2::{interfaces, wirings};

/// The transport to the simulator of a space, if it is on a bus.
pub(super) fn bus(space: &Space) -> Option<plan::Transport> {
    let wiring = wirings(space, false);
    Some(match space.simulator.transport.clone() {
        model::Transport::InProcess { .. } | model::Transport::Process { .. } | model::Transport::Ros2 { .. } => {
            return None;
        }
        model::Transport::Rosbridge { remote, domain, dialect, compression, clock, reset } => {
            let interfaces = interfaces(space);
            plan::Transport::Rosbridge(plan::Rosbridge {
                remote,
                domain,
                dialect,
                compression,
                clock,
                reset,
                interfaces,
                wiring,
            })
        }
        model::Transport::Ros1 { master, clock, reset } => {
            plan::Transport::Ros1(plan::Ros1 { master, clock, reset, interfaces: interfaces(space), wiring })
        }
        model::Transport::Mqtt { broker, quality } => {
            let of_node = |(id, node): (NodeId, &model::Node)| {
                let url = node.broker.clone()?;
                let remote = plan::Remote { url, ..broker.remote.clone() };
                Some((node_id(id), plan::Broker { remote, user: broker.user.clone() }))
            };
            let brokers = space.nodes.iter().filter_map(of_node).collect();
            plan::Transport::Mqtt(plan::Mqtt { broker, brokers, quality, wiring })
        }
    })
}
