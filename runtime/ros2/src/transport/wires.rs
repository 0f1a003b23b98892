//! The wires of a run: from which topics of the middleware their messages come, and to which they go.

use sesame_plan::{CampaignPlan, Channel, NodeId, Ros2};
use sesame_relay::wire::{Wire, WireTable};

use crate::names;

/// A topic that the transport reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Source {
    pub(super) wire: Wire,
    /// Its name in ROS.
    pub(super) path: String,
    /// The only node that publishes there; `None` for all that are not told apart.
    pub(super) publisher: Option<NodeId>,
}

/// A topic that the transport writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sink {
    /// The wire whose deliveries go there: a wire of a topic, or a link.
    pub(super) wire: Wire,
    /// Its name in ROS.
    pub(super) path: String,
    /// The only node that subscribes there; `None` for all that are not told apart.
    pub(super) subscriber: Option<NodeId>,
}

/// A wire with what it is in the middleware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Line {
    pub(super) wire: Wire,
    /// The name of its topic in ROS.
    pub(super) path: String,
    /// The name of its type in DDS.
    pub(super) type_name: String,
    /// The interface of its messages.
    pub(super) interface: String,
    /// Whether its messages pass through the relay, or are only listened to.
    pub(super) cut: bool,
    pub(super) sources: Vec<Source>,
    pub(super) sinks: Vec<Sink>,
}

/// The lines of a plan's topics, in the order of the wires.
pub(super) fn lines(plan: &CampaignPlan, ros2: &Ros2, wires: &WireTable) -> Vec<Line> {
    let lines = wires.iter().filter_map(|wire| {
        let topic = plan.topic(wires.topic(wire));
        if topic.channel != Channel::Topic {
            return None;
        }
        let interface = topic.interface.clone()?;
        let wiring = ros2.wiring.get(wires.topic(wire).index()).cloned().unwrap_or_default();
        let path = absolute(wires.path(wire));
        let source = |path: String, publisher| Source { wire, path, publisher };
        let mut sources = Vec::new();
        let mut sinks = Vec::new();
        if wiring.cut {
            for &node in &wiring.publishers {
                sources.push(source(format!("{path}/from/{}", plan.node(node).name), Some(node)));
            }
            let topic = wires.topic(wire);
            let distinguished =
                |node: &NodeId| wiring.publishers.contains(node) || !plan.node(*node).publishes.contains(&topic);
            let nodes = (0u32..).map(NodeId).take(plan.nodes.len());
            // Whoever is not named, if only because no node is declared to publish it.
            if wiring.publishers.is_empty() || !nodes.clone().all(|node| distinguished(&node)) {
                sources.push(source(format!("{path}/undisturbed"), None));
            }
            sinks.push(Sink { wire, path: path.clone(), subscriber: None });
            for link in wires.links().iter().filter(|link| link.of == wire) {
                sinks.push(Sink { wire: link.wire, path: absolute(wires.path(link.wire)), subscriber: Some(link.to) });
            }
        } else {
            sources.push(source(path.clone(), None));
        }
        Some(Line { wire, path, type_name: names::type_name(&interface), interface, cut: wiring.cut, sources, sinks })
    });
    lines.collect()
}

/// A name of ROS with the slash that it has in the middleware.
pub(super) fn absolute(path: &str) -> String {
    if path.starts_with('/') { path.to_owned() } else { format!("/{path}") }
}
