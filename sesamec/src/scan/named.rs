//! The names in the space that stand for what was found.

use std::collections::{BTreeMap, BTreeSet};

use heck::ToUpperCamelCase as _;
use sesame_legacy::Names;
use sesame_notation::quoted;
use sesame_plan::action;
use sesame_scan::{Facts, FoundAction, FoundService, FoundTopic};

use super::comments::LeftOut;
use super::expressible::is_ros_name;
use super::grouped_nodes::{Lists, Node, fold_nodes, lists_of_nodes};
use super::groups::{Line, fold, fold_actions, fold_services};
use super::simulator::words_of_topic;

/// All names.
pub(super) struct Named<'a> {
    pub(super) simulator: String,
    /// Messages by their types.
    pub(super) messages: BTreeMap<&'a str, String>,
    /// Topics as the space has them.
    pub(super) topics: Vec<(String, Line<&'a FoundTopic>)>,
    pub(super) services: Vec<(String, Line<&'a FoundService>)>,
    pub(super) actions: Vec<(String, Line<&'a FoundAction>)>,
    pub(super) nodes: Vec<(String, Line<Node<'a>>)>,
}

/// Names all that the space can say; nodes that it cannot become comments. What nodes list is kept in `lists`.
pub(super) fn name_all<'a>(
    facts: &'a Facts,
    needed: &[&'a str],
    topics: &[&'a FoundTopic],
    (services, actions): (&[&'a FoundService], &[&'a FoundAction]),
    lists: &'a mut Vec<Lists>,
    left_out: &mut LeftOut,
) -> Named<'a> {
    let mut names = Names::default();
    let system = &facts.system;
    let last = |path: &str| {
        let last = path.rsplit('/').next().unwrap_or_default();
        if system.is_ros() { last.to_owned() } else { last.to_upper_camel_case() }
    };
    let topics = fold(topics).into_iter();
    let topics: Vec<_> = topics.map(|line| (names.take(&words_of_topic(system, &line.name), "topic"), line)).collect();
    let services = fold_services(services).into_iter();
    let services: Vec<_> =
        services.map(|line| (name_with(&mut names, &line.name, "service", &["request", "reply"]), line)).collect();
    let parts = action::PARTS.map(|part| part.name);
    let actions = fold_actions(actions).into_iter();
    let actions: Vec<_> = actions.map(|line| (name_with(&mut names, &line.name, "action", &parts), line)).collect();
    let mut expressible = Vec::new();
    for node in &facts.nodes {
        if !system.is_ros() || is_ros_name(&node.name) {
            expressible.push(node);
        } else {
            left_out.decide(&format!("node {} has no name of ROS", quoted(&node.name)));
        }
    }
    *lists = lists_of_nodes(&expressible, &topics, &services, &actions);
    let nodes = fold_nodes(system, &expressible, lists).into_iter();
    let nodes: Vec<_> = nodes.map(|line| (names.take(&line.name, "node"), line)).collect();
    let simulator = names.take("robots", "simulator");
    // Messages differ from each other in more than case, but from all else only as texts.
    let others: BTreeSet<&str> = topics
        .iter()
        .map(|(name, _)| name.as_str())
        .chain(services.iter().map(|(name, _)| name.as_str()))
        .chain(actions.iter().map(|(name, _)| name.as_str()))
        .chain(nodes.iter().map(|(name, _)| name.as_str()))
        .chain([simulator.as_str()])
        .collect();
    let mut of_messages = Names::default();
    let mut message = |ty: &str| loop {
        let name = of_messages.take(&last(ty), "Message");
        if !others.contains(name.as_str()) {
            return name;
        }
    };
    let messages = needed.iter().map(|ty| (*ty, message(ty))).collect();
    Named { simulator, messages, topics, services, actions, nodes }
}

/// A name for a service or an action, whose topics have names that begin with it and have these ends.
fn name_with(names: &mut Names, path: &str, what: &str, ends: &[&str]) -> String {
    let path: String = path.chars().take(40).collect();
    loop {
        let name = names.take(&path, what);
        // Each is taken, so that the next name is another one.
        let free = ends.iter().filter(|end| {
            let wanted = format!("{name}_{end}");
            names.take(&wanted, what) == wanted
        });
        if free.count() == ends.len() {
            return name;
        }
    }
}
