//! From what rosapi says to what was found.

use std::collections::BTreeMap;

use sesame_interfaces::ros1::interface;
use sesame_plan::Dialect;
use sesame_scan::{Facts, FoundNode, FoundService, FoundTopic, OF_EVERY_NODE, System};

use super::rosapi::{Details, MOST_NAMES};

/// What rosapi says.
#[derive(Debug, Clone, Default)]
pub(super) struct Graph {
    /// Topics with their types; empty if nobody said it.
    pub(super) topics: Vec<(String, String)>,
    /// Services in the same way.
    pub(super) services: Vec<(String, String)>,
    pub(super) nodes: Vec<(String, Details)>,
    /// Whether there was no time to ask everything.
    pub(super) late: bool,
}

/// Topics that every node has, and those of the bridge itself.
const NOT_OF_THE_SYSTEM: [&str; 5] =
    ["/rosout", "/rosout_agg", "/parameter_events", "/client_count", "/connected_clients"];

/// The services that every node of ROS 1 has for what it logs, by their last part.
const OF_LOGGING: [&str; 2] = ["get_loggers", "set_logger_level"];

/// Whether a topic or service belongs to the system, and neither to each node nor to the bridge. Those of actions are
/// left out too: rosapi does not tell their types.
pub(super) fn is_of_the_system(path: &str) -> bool {
    let last = path.rsplit('/').next().unwrap_or_default();
    !NOT_OF_THE_SYSTEM.contains(&path)
        && !OF_EVERY_NODE.contains(&last)
        && !OF_LOGGING.contains(&last)
        && !path.starts_with("/rosapi/")
        && !path.contains("/_action/")
}

/// Whether a node belongs to the system, and neither to the bridge nor to tools.
pub(super) fn is_node_of_the_system(name: &str) -> bool {
    let last = name.rsplit('/').next().unwrap_or_default();
    !last.starts_with('_')
        && last != "rosout"
        && last != "rosapi"
        && last != "rosapi_params"
        && !last.starts_with("rosbridge")
}

impl Graph {
    /// Adds who publishes or subscribes.
    pub(super) fn add(&mut self, path: &str, names: Vec<String>, publishes: bool) {
        for name in names {
            let at = self.nodes.iter().position(|(known, _)| *known == name).unwrap_or_else(|| {
                self.nodes.push((name, Details::default()));
                self.nodes.len() - 1
            });
            let details = &mut self.nodes[at].1;
            let list = if publishes { &mut details.publishes } else { &mut details.subscribes };
            list.push(path.to_owned());
        }
    }

    /// Which ROS this is: types of ROS 1 have no `msg` in their names.
    pub(super) fn dialect(&self) -> Dialect {
        let mut types = self.topics.iter().map(|(_, ty)| ty).filter(|ty| !ty.is_empty());
        if types.any(|ty| ty.split('/').count() == 2) { Dialect::Ros1 } else { Dialect::Ros2 }
    }

    /// What was found.
    pub(super) fn facts(self, system: System) -> Facts {
        let mut topics = BTreeMap::<String, FoundTopic>::new();
        for (path, ty) in &self.topics {
            if is_of_the_system(path) {
                let ty = Some(interface(ty)).filter(|ty| !ty.is_empty());
                topics.insert(path.clone(), FoundTopic { path: path.clone(), ty, ..FoundTopic::default() });
            }
        }
        let mut services = BTreeMap::<String, FoundService>::new();
        for (path, ty) in &self.services {
            if is_of_the_system(path) {
                let ty = Some(interface(ty).replacen("/msg/", "/srv/", 1)).filter(|ty| !ty.is_empty());
                services.insert(path.clone(), FoundService { path: path.clone(), ty, ..FoundService::default() });
            }
        }
        let mut nodes = BTreeMap::<String, FoundNode>::new();
        for (name, details) in self.nodes {
            if !is_node_of_the_system(&name) {
                continue;
            }
            let new = FoundNode { name: name.clone(), ..FoundNode::default() };
            let known = nodes.entry(name.clone()).or_insert(new);
            known.count += 1;
            let mut note = |paths: Vec<String>, list: fn(&mut FoundNode) -> &mut Vec<String>| {
                let mut paths: Vec<String> = paths.into_iter().filter(|path| is_of_the_system(path)).collect();
                paths.sort_unstable();
                paths.dedup();
                list(known).extend(paths.iter().cloned());
                paths
            };
            for path in note(details.publishes, |node| &mut node.publishes) {
                topic(&mut topics, path).publishers.push(name.clone());
            }
            for path in note(details.subscribes, |node| &mut node.subscribes) {
                topic(&mut topics, path).subscribers.push(name.clone());
            }
            for path in note(details.serves, |node| &mut node.serves) {
                let service =
                    services.entry(path.clone()).or_insert_with(|| FoundService { path, ..FoundService::default() });
                service.servers.push(name.clone());
            }
        }
        let cut = self.late || topics.len() > MOST_NAMES || services.len() > MOST_NAMES;
        Facts {
            cut,
            nodes: nodes.into_values().collect(),
            topics: topics.into_values().take(MOST_NAMES).collect(),
            services: services.into_values().take(MOST_NAMES).collect(),
            ..Facts::of(system)
        }
    }
}

/// A topic that a node has; rosapi may not list one on which nobody publishes.
fn topic(topics: &mut BTreeMap<String, FoundTopic>, path: String) -> &mut FoundTopic {
    topics.entry(path.clone()).or_insert_with(|| FoundTopic { path, ..FoundTopic::default() })
}
