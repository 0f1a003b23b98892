//! Who is there, compared with who should be.

use sesame_plan::{Channel, NodeId};

use super::wired::Wired;
use super::{Ros1Bus, wired};
use crate::master::{State, nodes};
use crate::node::Node;

/// What is still missing before time zero, each in a phrase; empty if nothing is.
pub(super) fn missing(bus: &Ros1Bus) -> Vec<String> {
    let Some(node) = &bus.node else { return Vec::new() };
    let Some(state) = node.state() else { return vec!["the master has not yet answered".to_owned()] };
    let mut missing = Vec::new();
    for wired in &bus.lines {
        // A guest waits for nobody at its topics.
        if wired.line.channel == Channel::Topic && !bus.plan.is_guest() {
            sources(bus, node, wired, &mut missing);
            sinks(bus, node, wired, &mut missing);
        }
        missing.extend(not_cut(node, wired, &state));
    }
    for at in 0..bus.services.len() {
        let is_served = node.with_service(at, |service| service.offer.is_some());
        if !is_served {
            missing.push(node.with_service(at, |service| format!("nobody serves `{}`", service.server)));
        }
    }
    if let Some(clock) = &bus.clock
        && node.with_subscription(clock.subscription, |subscription| subscription.connected().next().is_none())
    {
        missing.push(format!("nobody publishes the clock `{}`", clock.path));
    }
    if let Some(reset) = bus.ros.reset.as_deref().map(wired::absolute)
        && nodes(&state.servers, &reset).is_empty()
    {
        missing.push(format!("nobody serves `{reset}`"));
    }
    missing
}

fn sources(bus: &Ros1Bus, node: &Node, wired: &Wired, missing: &mut Vec<String>) {
    for (source, &at) in wired.line.sources.iter().zip(&wired.sources) {
        if node.with_subscription(at, |subscription| subscription.connected().next().is_none()) {
            let who = source.publisher.map_or("nobody publishes on".to_owned(), |publisher| {
                format!("node `{}` does not publish on", bus.plan.node(publisher).name)
            });
            missing.push(format!("{who} `{}`", source.path));
        }
    }
}

fn sinks(bus: &Ros1Bus, node: &Node, wired: &Wired, missing: &mut Vec<String>) {
    let (topic, member) = (wired.line.topic, wired.line.member);
    let subscribers = (0u32..).map(NodeId).zip(&bus.plan.nodes).filter(|(_, node)| node.subscribes_to(topic, member));
    for (sink, &at) in wired.line.sinks.iter().zip(&wired.sinks) {
        let expected: Vec<String> = subscribers
            .clone()
            .filter(|(id, _)| match sink.subscriber {
                Some(subscriber) => subscriber == *id,
                None => !wired.line.sinks.iter().any(|sink| sink.subscriber == Some(*id)),
            })
            .map(|(_, node)| format!("`{}`", node.name))
            .collect();
        let there = node.with_publication(at, |publication| publication.connected().len());
        if there < expected.len() {
            let all = expected.join(", ");
            missing.push(format!("{there} of {} subscribe to `{}`: {all}", expected.len(), sink.path));
        }
    }
}

/// Where messages get past the relay: who publishes or serves directly what is cut.
fn not_cut(node: &Node, wired: &Wired, state: &State) -> Option<String> {
    let path = wired.line.path.as_str();
    let (side, what, does) = match wired.line.channel {
        Channel::Topic => (&state.publishers, "topic", "publishes on"),
        Channel::Request => (&state.servers, "service", "serves"),
        Channel::Reply => return None,
    };
    if !wired.line.cut {
        return None;
    }
    // The master knows nodes that have ended without a word, too.
    let other = nodes(side, path).iter().find(|other| **other != node.name && node.master.is_alive(other))?;
    Some(format!(
        "{what} `{path}` is not cut: `{other}` {does} it directly; start it with `{path}:={path}/undisturbed` \
         (`sesamec explain wiring` lists all remappings)"
    ))
}

/// Whether somebody listens at the sinks of a line, or to a line that is not cut.
pub(super) fn is_heard(bus: &Ros1Bus, line: usize) -> bool {
    let (Some(node), wired) = (&bus.node, &bus.lines[line]) else { return false };
    if wired.line.channel != Channel::Topic {
        return true;
    }
    if wired.line.cut {
        return wired
            .sinks
            .iter()
            .any(|&at| !node.with_publication(at, |publication| publication.connected().is_empty()));
    }
    let state = node.state().unwrap_or_default();
    nodes(&state.subscribers, &wired.line.path).iter().any(|other| *other != node.name)
}
