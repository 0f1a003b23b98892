//! From publishers and subscribers, as DDS has them, to what they are in ROS.

use std::collections::BTreeMap;

use sesame_plan::action::INFIX;
use sesame_scan::{Arrivals, Facts, FoundAction, FoundNode, FoundService, FoundTopic, NOBODY, OF_EVERY_NODE, System};

use crate::names::{self, Kind};

/// A publisher or subscriber.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Seen {
    pub(super) publishes: bool,
    /// The name of its topic in DDS.
    pub(super) topic: String,
    /// The name of its type in DDS.
    pub(super) type_name: String,
    /// Its node; `None` if nobody says which it is.
    pub(super) node: Option<String>,
    pub(super) reliable: bool,
    pub(super) transient_local: bool,
    pub(super) hash: Option<String>,
}

/// What these publishers and subscribers are in ROS; `heard` is by topic and type in DDS.
pub(super) fn assemble(
    system: System,
    seen: &[Seen],
    names: impl IntoIterator<Item = String>,
    heard: &BTreeMap<(String, String), Arrivals>,
) -> Facts {
    let mut topics = BTreeMap::<(&str, String), FoundTopic>::new();
    let mut services = BTreeMap::<(&str, String), FoundService>::new();
    let mut actions = BTreeMap::<&str, FoundAction>::new();
    for seen in seen {
        let Some((kind, path)) = names::in_ros(&seen.topic) else { continue };
        let ty = names::interface(&seen.type_name).unwrap_or_else(|| seen.type_name.clone());
        if let Some((action, part)) = path.rsplit_once(INFIX) {
            let ty = action_type(&ty, part);
            let found = actions
                .entry(action)
                .or_insert_with(|| FoundAction { path: action.to_owned(), ..FoundAction::default() });
            if found.ty.is_empty() {
                found.ty = ty.unwrap_or_default();
            }
            // As of a service: the requests for goals say who is there.
            let by = seen.node.clone().unwrap_or_else(|| NOBODY.to_owned());
            if kind == Kind::Request && part == "send_goal" && !hidden(&by) {
                if seen.publishes { &mut found.clients } else { &mut found.servers }.push(by);
            }
            continue;
        }
        if is_of_every_node(kind, path, &ty) {
            continue;
        }
        let by = seen.node.clone().unwrap_or_else(|| NOBODY.to_owned());
        if hidden(&by) {
            continue;
        }
        if kind == Kind::Topic {
            let key = (seen.topic.clone(), seen.type_name.clone());
            let found = topics.entry((path, ty.clone())).or_insert_with(|| topic(path, ty, heard.get(&key).copied()));
            if seen.publishes {
                // Those that do not offer it decide.
                for (all, one) in
                    [(&mut found.reliable, seen.reliable), (&mut found.transient_local, seen.transient_local)]
                {
                    *all = Some(one && all.unwrap_or(true));
                }
                found.publishers.push(by);
            } else {
                found.subscribers.push(by);
            }
            found.hash = found.hash.take().or_else(|| seen.hash.clone());
            continue;
        }
        let ty = service_type(&ty);
        let found = services.entry((path, ty.clone())).or_insert_with(|| FoundService {
            path: path.to_owned(),
            ty: Some(ty),
            ..FoundService::default()
        });
        // A server subscribes to requests, a client publishes them; replies say nothing more.
        match (kind, seen.publishes) {
            (Kind::Request, false) => found.servers.push(by),
            (Kind::Request, true) => found.clients.push(by),
            _ => {}
        }
    }
    let mut topics: Vec<FoundTopic> = topics.into_values().collect();
    for topic in &mut topics {
        topic.publishers.sort();
        topic.subscribers.sort();
    }
    let mut services: Vec<FoundService> = services.into_values().collect();
    for service in &mut services {
        service.servers.sort();
        service.clients.sort();
    }
    let mut actions: Vec<FoundAction> = actions.into_values().collect();
    for action in &mut actions {
        action.servers.sort();
        action.clients.sort();
    }
    let nodes = nodes(names, &topics, &services);
    Facts { nodes, topics, services, actions, ..Facts::of(system) }
}

fn topic(path: &str, ty: String, heard: Option<Arrivals>) -> FoundTopic {
    let heard = heard.unwrap_or_default();
    FoundTopic {
        path: path.to_owned(),
        ty: Some(ty),
        messages: heard.messages(),
        rate: heard.rate(),
        ..FoundTopic::default()
    }
}

/// All nodes with what they do.
fn nodes(names: impl IntoIterator<Item = String>, topics: &[FoundTopic], services: &[FoundService]) -> Vec<FoundNode> {
    let mut nodes = BTreeMap::<String, FoundNode>::new();
    for name in names.into_iter().filter(|name| !hidden(name)) {
        let node = nodes.entry(name.clone()).or_insert_with(|| FoundNode { name, ..FoundNode::default() });
        node.count += 1;
    }
    let mut note = |by: &[String], path: &str, list: fn(&mut FoundNode) -> &mut Vec<String>| {
        for name in by {
            let Some(node) = nodes.get_mut(name) else { continue };
            let list = list(node);
            if list.last().is_none_or(|last| last != path) {
                list.push(path.to_owned());
            }
        }
    };
    for topic in topics {
        note(&topic.publishers, &topic.path, |node| &mut node.publishes);
        note(&topic.subscribers, &topic.path, |node| &mut node.subscribes);
    }
    for service in services {
        note(&service.servers, &service.path, |node| &mut node.serves);
        note(&service.clients, &service.path, |node| &mut node.calls);
    }
    nodes.into_values().collect()
}

/// Whether a node is of a tool of ROS.
fn hidden(name: &str) -> bool {
    name.rsplit('/').next().is_some_and(|last| last.starts_with('_'))
}

fn is_of_every_node(kind: Kind, path: &str, ty: &str) -> bool {
    if kind == Kind::Topic {
        return matches!(ty, "rcl_interfaces/msg/Log" | "rcl_interfaces/msg/ParameterEvent");
    }
    let last = path.rsplit('/').next().unwrap_or_default();
    (ty.starts_with("rcl_interfaces/srv/") || ty.starts_with("type_description_interfaces/srv/"))
        && OF_EVERY_NODE.contains(&last)
}

/// The type of a service whose requests or replies have this type.
fn service_type(ty: &str) -> String {
    let without = ty.strip_suffix("_Request").or_else(|| ty.strip_suffix("_Response"));
    without.unwrap_or(ty).to_owned()
}

/// The type of an action, if its topic or service tells.
fn action_type(ty: &str, part: &str) -> Option<String> {
    let end = match part {
        "send_goal" => "_SendGoal",
        "get_result" => "_GetResult",
        "feedback" => "_FeedbackMessage",
        _ => return None,
    };
    service_type(ty).strip_suffix(end).map(str::to_owned)
}

/// The hash of a type in what a publisher or subscriber of ROS says besides: `typehash=RIHS01_…;`.
pub(super) fn type_hash(user_data: &[u8]) -> Option<String> {
    // Its length may be in front of it.
    let text = String::from_utf8_lossy(user_data);
    let (_, rest) = text.split_once("typehash=")?;
    let (hash, _) = rest.split_once(';')?;
    let fits = hash.len() <= 100 && hash.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    fits.then(|| hash.to_owned())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn seen(publishes: bool, topic: &str, type_name: &str, node: Option<&str>) -> Seen {
        Seen {
            publishes,
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            node: node.map(str::to_owned),
            reliable: true,
            transient_local: false,
            hash: None,
        }
    }

    #[test]
    fn what_every_node_has_is_left_out_and_the_rest_is_sorted_by_what_it_is() {
        let double = "std_msgs::msg::dds_::Float64_";
        let request = "std_srvs::srv::dds_::Trigger_Request_";
        let all = [
            seen(true, "rt/b", double, Some("/arm")),
            Seen { reliable: false, ..seen(true, "rt/b", double, Some("/arm")) },
            seen(false, "rt/b", double, None),
            seen(true, "rt/a", double, Some("/arm")),
            seen(true, "rt/a", double, Some("/_ros2cli_7")),
            seen(true, "rt/rosout", "rcl_interfaces::msg::dds_::Log_", Some("/arm")),
            seen(true, "ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_", None),
            seen(false, "rq/stepRequest", request, Some("/arm")),
            seen(true, "rr/stepReply", "std_srvs::srv::dds_::Trigger_Response_", Some("/arm")),
            seen(true, "rq/stepRequest", request, Some("/driver")),
            seen(
                false,
                "rq/arm/get_parametersRequest",
                "rcl_interfaces::srv::dds_::GetParameters_Request_",
                Some("/arm"),
            ),
            seen(false, "rq/go/_action/send_goalRequest", "a::action::dds_::Go_SendGoal_Request_", Some("/arm")),
            seen(true, "rt/go/_action/status", "action_msgs::msg::dds_::GoalStatusArray_", Some("/arm")),
        ];
        let names = ["/arm", "/arm", "/driver", "/_ros2cli_7"].map(str::to_owned);
        let mut arrivals = Arrivals::default();
        (0..11).for_each(|number| arrivals.add(Duration::from_millis(200 * number)));
        let heard = [(("rt/b".to_owned(), double.to_owned()), arrivals)];
        let facts = assemble(System::Ros2 { domain: 7 }, &all, names, &heard.into());
        insta::assert_debug_snapshot!(facts);
    }

    #[test]
    fn the_hash_of_a_type_is_taken_from_what_is_said_besides() {
        assert_eq!(type_hash(b"typehash=RIHS01_ab12;").as_deref(), Some("RIHS01_ab12"));
        assert_eq!(type_hash(b"\xf1\0\0\0enclave=/;typehash=RIHS01_1;\0\0").as_deref(), Some("RIHS01_1"));
        for other in [&b""[..], b"typehash=a\x1b[2J;", b"\xff", b"hash=1;"] {
            assert_eq!(type_hash(other), None);
        }
    }
}
