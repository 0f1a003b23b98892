//! Topics, services and actions of the space, each with what was seen of it.

use sesame_notation::quoted;
use sesame_scan::{FoundTopic, NOBODY, System};

use super::blocks::topic_type;
use super::comments::{counted, rate};
use super::named::Named;
use super::simulator::knows_nodes;
use super::types::Types;

/// A line for each topic or group of topics.
pub(super) fn topic_lines(system: &System, types: &Types, named: &Named<'_>) -> String {
    let lines = named.topics.iter().map(|(name, line)| {
        let ty = topic_type(types, &named.messages, line.of[0].ty.as_deref().unwrap_or_default());
        format!("topic {name} = {} : {ty}  // {}\n", quoted(&line.path), topic_comment(system, &line.of))
    });
    lines.collect()
}

/// Who uses a topic, its quality, and how many messages it had.
fn topic_comment(system: &System, topics: &[&FoundTopic]) -> String {
    let first = topics[0];
    let mut words = Vec::new();
    if knows_nodes(system) && system.is_ros() {
        words.push(counted(first.publishers.len() as u64, "publisher"));
        words.push(counted(first.subscribers.len() as u64, "subscriber"));
    }
    if !knows_nodes(system) || !first.publishers.is_empty() {
        let said = [
            (first.reliable == Some(true), "reliable"),
            (first.reliable == Some(false), "best effort"),
            (first.transient_local == Some(true), "transient local"),
            (first.latching == Some(true), "latched"),
            (first.retained == Some(true), "retained"),
            (first.can_be_cut == Some(false), "cannot be cut"),
        ];
        words.extend(said.into_iter().filter(|(holds, _)| *holds).map(|(_, word)| word.to_owned()));
        words.extend(first.quality.map(|quality| format!("quality {quality}")));
        let rates: Vec<f64> = topics.iter().filter_map(|topic| topic.rate).collect();
        let [least, most] = [f64::min, f64::max].map(|of| rates.iter().copied().reduce(of).map(rate));
        words.push(match (least, most) {
            (Some(least), Some(most)) if least == most => format!("{least} Hz"),
            (Some(least), Some(most)) => format!("{least} to {most} Hz"),
            _ => counted(topics.iter().map(|topic| topic.messages).sum(), "message"),
        });
    }
    if first.publishers.iter().chain(&first.subscribers).any(|by| by == NOBODY) {
        words.push("some of no known node".to_owned());
    }
    words.join(", ")
}

/// A line for each service.
pub(super) fn service_lines(system: &System, named: &Named<'_>) -> String {
    let lines = named.services.iter().map(|(name, line)| {
        let Some(service) = line.of.first() else { return String::new() };
        let mut who = vec![counted(service.servers.len() as u64, "server")];
        // Only ROS 2 knows the clients of a service.
        if matches!(system, System::Ros2 { .. }) {
            who.push(counted(service.clients.len() as u64, "client"));
        }
        let ty = service.ty.as_deref().unwrap_or_default();
        format!("service {name} = {} : {}  // {}\n", quoted(&line.path), quoted(ty), who.join(", "))
    });
    lines.collect()
}

/// A line for each action.
pub(super) fn action_lines(named: &Named<'_>) -> String {
    let lines = named.actions.iter().map(|(name, line)| {
        let Some(action) = line.of.first() else { return String::new() };
        let who = [(&action.servers, "server"), (&action.clients, "client")];
        let who = who.map(|(nodes, what)| counted(nodes.len() as u64, what)).join(", ");
        format!("action {name} = {} : {}  // {who}\n", quoted(&line.path), quoted(&action.ty))
    });
    lines.collect()
}
