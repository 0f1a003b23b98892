//! Nodes of the space.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use sesame_notation::quoted;
use sesame_scan::System;

use super::named::Named;

/// A block for each node: what it publishes and what it subscribes to, services included.
pub(super) fn nodes(system: &System, named: &Named<'_>) -> String {
    let mut publishes = BTreeMap::<&str, BTreeSet<String>>::new();
    let mut subscribes = BTreeMap::<&str, BTreeSet<String>>::new();
    for (name, line) in &named.topics {
        for topic in &line.topics {
            for node in &topic.publishers {
                publishes.entry(node).or_default().insert(name.clone());
            }
            for node in &topic.subscribers {
                subscribes.entry(node).or_default().insert(name.clone());
            }
        }
    }
    for (name, service) in &named.services {
        let (request, reply) = (format!("{name}_request"), format!("{name}_reply"));
        for node in &service.servers {
            publishes.entry(node).or_default().insert(reply.clone());
            subscribes.entry(node).or_default().insert(request.clone());
        }
        for node in &service.clients {
            publishes.entry(node).or_default().insert(request.clone());
            subscribes.entry(node).or_default().insert(reply.clone());
        }
    }
    let mut text = String::new();
    for (name, node) in &named.nodes {
        if node.count > 1 {
            _ = writeln!(text, "// decide: {} nodes have this name; give each its own", node.count);
        }
        if node.answers == Some(false) {
            text.push_str("// decide: it does not answer; it may have ended without a word\n");
        }
        // Only nodes of ROS have names of their own.
        let own = if system.is_ros() { format!("{} ", quoted(&node.name)) } else { String::new() };
        _ = writeln!(text, "node {name} {own}{{");
        for (word, of) in [("publishes", &publishes), ("subscribes", &subscribes)] {
            if let Some(topics) = of.get(node.name.as_str()) {
                let topics: Vec<&str> = topics.iter().map(String::as_str).collect();
                _ = writeln!(text, "{word:<10} {}", wrapped(&topics));
            }
        }
        text.push_str("}\n");
    }
    text
}

/// Names with commas between them, on lines that are not too long.
fn wrapped(names: &[&str]) -> String {
    const LONGEST: usize = 90;
    let (mut text, mut line) = (String::new(), 0);
    for name in names {
        let between = match line {
            0 => "",
            _ if line + name.len() > LONGEST => {
                line = 0;
                ",\n"
            }
            _ => ", ",
        };
        _ = write!(text, "{between}{name}");
        line += name.len() + 2;
    }
    text
}
