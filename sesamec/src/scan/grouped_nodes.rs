//! Nodes that are found, as groups where they are the robots of a fleet.

use std::collections::BTreeMap;

use sesame_dsl::groups::{expand, own_members};
use sesame_plan::with_member;
use sesame_scan::{FoundAction, FoundNode, FoundService, FoundTopic, System};

use super::groups::{Line, fold_by};

/// A node as the space has it, or the member of a group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node<'a> {
    pub(super) found: &'a FoundNode,
    /// What it lists, by the words of [`WORDS`].
    pub(super) lists: &'a Lists,
}

/// What a node publishes, subscribes to, serves and calls, as it lists it.
pub(super) type Lists = [Vec<String>; 4];

/// The words of these lists.
pub(super) const WORDS: [&str; 4] = ["publishes", "subscribes", "serves", "calls"];

/// What each node lists.
pub(super) fn lists_of_nodes(
    nodes: &[&FoundNode],
    topics: &[(String, Line<&FoundTopic>)],
    services: &[(String, Line<&FoundService>)],
    actions: &[(String, Line<&FoundAction>)],
) -> Vec<Lists> {
    let mut lists: BTreeMap<&str, [BTreeMap<&str, Vec<u32>>; 4]> = BTreeMap::new();
    // The path that each name in the lists stands for.
    let mut paths: BTreeMap<&str, &str> = BTreeMap::new();
    for (name, line) in topics {
        paths.insert(name, &line.path);
        for (member, topic) in (0u32..).zip(&line.of) {
            for (side, nodes) in [&topic.publishers, &topic.subscribers].into_iter().enumerate() {
                for node in nodes {
                    lists.entry(node).or_default()[side].entry(name).or_default().push(member);
                }
            }
        }
    }
    let of_services = services.iter().flat_map(|(name, line)| {
        line.of.iter().map(move |service| (name, &line.path, [&service.servers, &service.clients])).zip(0u32..)
    });
    let of_actions = actions.iter().flat_map(|(name, line)| {
        line.of.iter().map(move |action| (name, &line.path, [&action.servers, &action.clients])).zip(0u32..)
    });
    for ((name, path, ends), member) in of_services.chain(of_actions) {
        paths.insert(name, path);
        for (side, nodes) in (2..).zip(ends) {
            for node in nodes {
                lists.entry(node).or_default()[side].entry(name).or_default().push(member);
            }
        }
    }
    let none = std::array::from_fn(|_| BTreeMap::new());
    let listed = |node: &&FoundNode| {
        let of_node = lists.get(node.name.as_str()).unwrap_or(&none);
        of_node
            .each_ref()
            .map(|side| side.iter().flat_map(|(name, members)| words(name, paths[name], members, &node.name)).collect())
    };
    nodes.iter().map(listed).collect()
}

/// How a node lists a topic or group of which it uses these members.
fn words(name: &str, path: &str, used: &[u32], node: &str) -> Vec<String> {
    let members = expand(path).unwrap_or_default();
    let all = used.len() == members.len();
    match own_members(&members, node) {
        _ if members.len() < 2 => vec![name.to_owned()],
        Some(own) if own == used => vec![name.to_owned()],
        None if all => vec![name.to_owned()],
        Some(_) if all => vec![format!("{name}[*]")],
        _ => used.iter().map(|&at| with_member(name, &members[at as usize].name)).collect(),
    }
}

/// Folds nodes of ROS into groups: if they list the same, and differ in their namespaces.
pub(super) fn fold_nodes<'a>(system: &System, nodes: &[&'a FoundNode], lists: &'a [Lists]) -> Vec<Line<Node<'a>>> {
    let nodes: Vec<Node<'a>> = nodes.iter().zip(lists).map(|(found, lists)| Node { found, lists }).collect();
    if !system.is_ros() {
        let alone = |node: Node<'a>| {
            let path = node.found.name.clone();
            Line { name: path.clone(), path, of: vec![node] }
        };
        return nodes.into_iter().map(alone).collect();
    }
    fold_by(
        &nodes,
        |node| node.found.name.clone(),
        |node, _| {
            let FoundNode { name, count, answers, .. } = node.found;
            // A group says the same of all its members, and nothing of one.
            let names_a_member =
                node.lists.iter().flatten().any(|listed| listed.contains('[') && !listed.ends_with("[*]"));
            (node.lists, *count, *answers, names_a_member.then_some(name))
        },
    )
}
