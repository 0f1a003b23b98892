//! Who is remapped, so that the messages of topics that are cut pass through the relay.

use crate::brokers::BrokerAt;
use crate::{CampaignPlan, Channel, Dialect, Node, NodeId, Operation, Proxy, Topic, TopicId, Wiring};

/// A name of a topic or service that a node knows under another name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remapping {
    /// The name in the node.
    pub from: String,
    /// The name that it stands for.
    pub to: String,
}

impl Remapping {
    /// As a rule of ROS: `/joints:=/joints/undisturbed`.
    pub fn rule(&self) -> String {
        format!("{}:={}", self.from, self.to)
    }
}

/// The names that differ between the clients of a proxy and the server behind it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Renamed {
    /// The topics that they publish on.
    pub publishes: Vec<Remapping>,
    /// The topics that they subscribe to.
    pub subscribes: Vec<Remapping>,
    /// The services that they offer.
    pub serves: Vec<Remapping>,
}

impl CampaignPlan {
    /// What a node is remapped to: what it publishes, and what it subscribes to where operations distinguish it. Of a
    /// service that is cut, the server is remapped. Each name once; where a node both publishes a topic and
    /// subscribes to it, that of a publisher counts. A node behind a proxy needs none: the proxy
    /// [changes its names](CampaignPlan::renamed). Nor does any node where the
    /// kind of the simulator [has no second names](crate::SimulatorProperties::renames).
    pub fn remappings(&self, id: NodeId) -> Vec<Remapping> {
        let node = &self.nodes[id.index()];
        let mut remappings: Vec<Remapping> = Vec::new();
        if self.proxy_of(id).is_some() || !self.simulator.properties().renames {
            return remappings;
        }
        for (topic, declared, wiring) in self.cut() {
            for (member, path) in declared.paths.iter().enumerate() {
                let Some(end) = end(node, id, (topic, member), declared.channel, wiring) else { continue };
                if end == "undisturbed" && !self.shares_broker(self.broker_of(id), topic) {
                    continue;
                }
                let new = Remapping { from: path.clone(), to: format!("{path}/{end}") };
                if remappings.iter().all(|known| known.from != new.from) {
                    remappings.push(new);
                }
            }
        }
        remappings
    }

    /// The paths on which a node of ROS hears nothing that operations do: it publishes and subscribes there, and one
    /// rule renames both.
    pub fn heard_undisturbed(&self, id: NodeId) -> Vec<String> {
        let node = &self.nodes[id.index()];
        if self.simulator.properties().ros.is_none() {
            return Vec::new();
        }
        let subscribes = |path: &String| {
            let mut topics = (0..).map(TopicId).zip(&self.topics);
            topics.any(|(id, topic)| {
                let member = topic.paths.iter().position(|own| own == path);
                topic.channel == Channel::Topic
                    && member.is_some_and(|member| node.publishes_on(id, member) && node.subscribes_to(id, member))
            })
        };
        self.remappings(id).into_iter().map(|remapping| remapping.from).filter(subscribes).collect()
    }

    /// The names of the wires that an operation may act on, in the order of the plan's topics: those of its topics, or
    /// of the ways to the subscribers that it names. Each with its topic.
    pub fn wires_of(&self, operation: &Operation) -> Vec<(TopicId, String)> {
        let topics = (0..).map(TopicId).zip(&self.topics);
        let paths = topics.flat_map(|(id, topic)| topic.paths.iter().enumerate().map(move |path| (id, path)));
        let paths = paths.filter(|(id, (member, _))| operation.may_act_on(*id, *member));
        if operation.to.is_empty() {
            return paths.map(|(id, (_, path))| (id, path.clone())).collect();
        }
        let to_members = |(id, (member, path)): (TopicId, (usize, &String))| {
            let named = self.told_apart(id, member).filter(|subscriber| operation.to.contains(subscriber));
            let named = named.map(|to| (id, format!("{path}/to/{}", self.node(to).name_in_paths())));
            named.collect::<Vec<_>>()
        };
        paths.flat_map(to_members).collect()
    }

    /// The subscribers of one path of a topic that operations tell apart from the others.
    pub fn told_apart(&self, topic: TopicId, member: usize) -> impl Iterator<Item = NodeId> {
        let distinguished = self.simulator.wiring.get(topic.index()).map_or(&[][..], |wiring| &wiring.subscribers);
        distinguished.iter().copied().filter(move |&to| self.node(to).subscribes_to(topic, member))
    }

    /// The proxy at which the programs of a node connect, if there is one.
    pub fn proxy_of(&self, id: NodeId) -> Option<&Proxy> {
        self.simulator.proxies.iter().find(|proxy| proxy.node == id)
    }

    /// What a proxy changes in the names that clients use who are this node. A node is told apart as a publisher and as
    /// a subscriber. What it publishes without having declared it passes through the relay too, as long as operations
    /// do not tell the publishers of that topic apart.
    pub fn renamed(&self, id: NodeId) -> Renamed {
        let node = &self.nodes[id.index()];
        let mut renamed = Renamed::default();
        for (topic, declared, wiring) in self.cut() {
            for (member, path) in declared.paths.iter().enumerate() {
                let named = |end: &str| Remapping { from: path.clone(), to: format!("{path}/{end}") };
                if declared.channel != Channel::Topic {
                    renamed.serves.push(named("undisturbed"));
                    continue;
                }
                let publishes = node.publishes_on(topic, member);
                if publishes && wiring.publishers.contains(&id) {
                    renamed.publishes.push(named(&format!("from/{}", node.name_in_paths())));
                } else if publishes || wiring.publishers.is_empty() {
                    renamed.publishes.push(named("undisturbed"));
                }
                if self.told_apart(topic, member).any(|subscriber| subscriber == id) {
                    renamed.subscribes.push(named(&format!("to/{}", node.name_in_paths())));
                }
            }
        }
        renamed
    }

    /// The arguments that remap a node, or for `None` all nodes of a program that starts several: none if nothing is
    /// cut.
    ///
    /// In ROS 2 they are rules behind `--ros-args -r`, in ROS 1 they are the rules alone. There, no rule is of one node
    /// of a program only, so that a program that starts several gets none: its nodes are remapped where it starts them.
    pub fn ros_args(&self, node: Option<NodeId>) -> Vec<String> {
        if self.simulator.dialect() == Some(Dialect::Ros1) {
            let rules = node.map(|node| self.remappings(node)).unwrap_or_default();
            return rules.iter().map(Remapping::rule).collect();
        }
        let rules: Vec<String> = match node {
            Some(node) => self.remappings(node).iter().map(Remapping::rule).collect(),
            None => (0..)
                .map(NodeId)
                .zip(&self.nodes)
                .flat_map(|(id, node)| {
                    let name = node.name_in_ros();
                    self.remappings(id).into_iter().map(move |remapping| format!("{name}:{}", remapping.rule()))
                })
                .collect(),
        };
        if rules.is_empty() {
            return Vec::new();
        }
        let rules = rules.into_iter().flat_map(|rule| ["-r".to_owned(), rule]);
        std::iter::once("--ros-args".to_owned()).chain(rules).collect()
    }

    /// What is to be remapped in programs that the plan does not know: topics that are cut, and which no node
    /// publishes, and services that are cut, and which no node offers. Each name once.
    pub fn unclaimed(&self) -> Vec<(Channel, Remapping)> {
        let mut unclaimed: Vec<(Channel, Remapping)> = Vec::new();
        if !self.simulator.properties().renames {
            return unclaimed;
        }
        for (topic, declared, _) in self.cut() {
            let by_a_node = |topic: TopicId, member: usize, channel: Channel| {
                self.nodes.iter().any(|node| is_source(node, (topic, member), channel))
            };
            if self.is_published_by_monitor(topic) || !self.shares_broker(0, topic) {
                continue;
            }
            for (member, path) in declared.paths.iter().enumerate() {
                // The server may be known by the other direction of its service.
                let served = declared.channel != Channel::Topic
                    && (0..).map(TopicId).zip(&self.topics).any(|(other, topic)| {
                        topic.channel != Channel::Topic
                            && topic.paths == declared.paths
                            && by_a_node(other, member, topic.channel)
                    });
                if served || by_a_node(topic, member, declared.channel) {
                    continue;
                }
                let kind = if declared.channel == Channel::Topic { Channel::Topic } else { Channel::Request };
                let new = (kind, Remapping { from: path.clone(), to: format!("{path}/undisturbed") });
                if !unclaimed.contains(&new) {
                    unclaimed.push(new);
                }
            }
        }
        unclaimed
    }

    /// Whether a topic passes through the relay in any case: in lock-step, nodes of ROS 2 hear what they answer, and
    /// answer, through it, so that a step ends when all answers have come.
    pub fn needed_in_step(&self, id: TopicId) -> bool {
        let needs = |node: &Node| {
            let answers = node.answers.iter().any(|answer| answer.with == id);
            answers || !node.answers.is_empty() && node.subscribes(id)
        };
        self.simulator.stepping().is_some() && self.nodes.iter().any(needs)
    }

    /// The topics that operations can act on, in declaration order; the two directions of a service are one. Of a
    /// system of ROS 2 nodes they are the topics that are cut, for all operations of the space, without those that are
    /// [needed in each step](CampaignPlan::needed_in_step).
    pub fn relayable(&self) -> Vec<Vec<TopicId>> {
        let acted_on = |id: TopicId| match self.simulator.wiring.as_slice() {
            [] => self.operations.iter().any(|operation| operation.disturbs(id)),
            wiring => wiring.get(id.index()).is_some_and(|wiring| wiring.cut) && !self.needed_in_step(id),
        };
        let mut found: Vec<Vec<TopicId>> = Vec::new();
        for (id, topic) in (0..).map(TopicId).zip(&self.topics).filter(|(id, _)| acted_on(*id)) {
            let other_direction = |of: &&mut Vec<TopicId>| {
                let first = self.topic(of[0]);
                topic.channel != Channel::Topic && first.channel != Channel::Topic && first.paths == topic.paths
            };
            match found.iter_mut().find(other_direction) {
                Some(service) => service.push(id),
                None => found.push(vec![id]),
            }
        }
        found
    }

    /// The same plan with only the first so many of the [topics that operations can act on](CampaignPlan::relayable)
    /// passing through the relay. Of nodes in a middleware the others are not cut, so nothing is remapped for them,
    /// except for those that are [needed in each step](CampaignPlan::needed_in_step); a simulator of another kind has
    /// no way for its messages but the runner.
    #[must_use]
    pub fn relaying(&self, first: u32) -> CampaignPlan {
        let relayed: Vec<TopicId> =
            self.relayable().into_iter().take(usize::try_from(first).unwrap_or(usize::MAX)).flatten().collect();
        let mut plan = self.clone();
        for (id, wiring) in (0..).map(TopicId).zip(&mut plan.simulator.wiring) {
            if !relayed.contains(&id) && !self.needed_in_step(id) {
                *wiring = Wiring::default();
            }
        }
        plan
    }

    fn broker_of(&self, id: NodeId) -> BrokerAt {
        self.simulator.brokers().map_or(0, |mqtt| mqtt.of(id))
    }

    /// Whether subscribers of a topic are at this broker, so that its publishers there need another name. Only systems
    /// of MQTT have more places than one.
    fn shares_broker(&self, broker: BrokerAt, topic: TopicId) -> bool {
        self.simulator.brokers().is_none_or(|mqtt| mqtt.subscribers(self, topic).contains(&broker))
    }

    /// The topics that are cut.
    fn cut(&self) -> impl Iterator<Item = (TopicId, &Topic, &Wiring)> {
        let topics = (0..).map(TopicId).zip(&self.topics).zip(&self.simulator.wiring);
        topics.filter(|(_, wiring)| wiring.cut).map(|((id, topic), wiring)| (id, topic, wiring))
    }
}

impl Node {
    /// The name that rules of remapping know it by: that in the middleware, without its namespace.
    pub fn name_in_ros(&self) -> &str {
        let name = self.named.as_deref().unwrap_or(&self.name);
        name.rsplit('/').next().unwrap_or(name)
    }
}

/// A path of a topic, by its position.
type At = (TopicId, usize);

/// What is written after a name for a node, if the node is remapped.
fn end(node: &Node, id: NodeId, (topic, member): At, channel: Channel, wiring: &Wiring) -> Option<String> {
    if is_source(node, (topic, member), channel) {
        let distinguished = channel == Channel::Topic && wiring.publishers.contains(&id);
        return Some(if distinguished { format!("from/{}", node.name_in_paths()) } else { "undisturbed".to_owned() });
    }
    let distinguished = channel == Channel::Topic && wiring.subscribers.contains(&id);
    (distinguished && node.subscribes_to(topic, member)).then(|| format!("to/{}", node.name_in_paths()))
}

/// Whether a node publishes on a path, or is the server of a service.
fn is_source(node: &Node, (topic, member): At, channel: Channel) -> bool {
    match channel {
        Channel::Topic | Channel::Reply => node.publishes_on(topic, member),
        Channel::Request => node.subscribes_to(topic, member),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, minimal, topic, topics};
    use crate::{Ros, Type};

    fn plan() -> CampaignPlan {
        let mut plan = minimal();
        let of = |name, paths: &[&str], channel| Topic { channel, ..topic(name, paths, Type::Bool) };
        let node = |name, publishes: &[u32], subscribes: &[u32]| Node {
            publishes: topics(publishes),
            subscribes: topics(subscribes),
            ..testing::node(name)
        };
        plan.topics = vec![
            of("joints", &["/a/joints", "/b/joints"], Channel::Topic),
            of("commands", &["/commands"], Channel::Topic),
            of("free", &["/free"], Channel::Topic),
            of("grip_request", &["/grip"], Channel::Request),
            of("grip_reply", &["/grip"], Channel::Reply),
        ];
        plan.nodes = vec![
            Node { named: Some("/ns/arm_ctrl".to_owned()), ..node("arm", &[1, 3], &[0, 4]) },
            node("drive", &[0, 2], &[1]),
            node("gripper", &[4], &[3]),
        ];
        let cut = |publishers: &[u32], subscribers: &[u32]| Wiring {
            cut: true,
            publishers: publishers.iter().copied().map(NodeId).collect(),
            subscribers: subscribers.iter().copied().map(NodeId).collect(),
            joined: false,
        };
        let wiring = vec![cut(&[], &[0]), cut(&[0], &[]), Wiring::default(), cut(&[], &[]), cut(&[], &[])];
        plan.simulator = testing::ros2(0, wiring);
        plan
    }

    fn rules(plan: &CampaignPlan, node: u32) -> Vec<String> {
        plan.remappings(NodeId(node)).iter().map(Remapping::rule).collect()
    }

    #[test]
    fn publishers_distinguished_nodes_and_servers_are_remapped() {
        let plan = plan();
        assert_eq!(
            rules(&plan, 0),
            ["/a/joints:=/a/joints/to/arm", "/b/joints:=/b/joints/to/arm", "/commands:=/commands/from/arm"]
        );
        assert_eq!(rules(&plan, 1), ["/a/joints:=/a/joints/undisturbed", "/b/joints:=/b/joints/undisturbed"]);
        assert_eq!(rules(&plan, 2), ["/grip:=/grip/undisturbed"], "once, although both directions are cut");
    }

    #[test]
    fn a_program_with_several_nodes_gets_the_rules_of_each() {
        let plan = plan();
        let all = plan.ros_args(None);
        assert_eq!(&all[..3], ["--ros-args", "-r", "arm_ctrl:/a/joints:=/a/joints/to/arm"]);
        assert_eq!(all.len(), 1 + 2 * 6);
        assert_eq!(plan.ros_args(Some(NodeId(2))), ["--ros-args", "-r", "/grip:=/grip/undisturbed"]);
        assert!(minimal().ros_args(None).is_empty());
    }

    #[test]
    fn a_node_behind_a_proxy_is_renamed_there_and_not_remapped() {
        let mut plan = plan();
        let proxy = |node: u32| Proxy {
            node: NodeId(node),
            url: format!("ws://127.0.0.1:919{node}"),
            token: None,
            identity: None,
            public: false,
        };
        plan.simulator = testing::rosbridge("ws://127.0.0.1:9090", plan.simulator.wiring);
        plan.simulator.proxies = vec![proxy(0), proxy(1)];
        assert!(rules(&plan, 0).is_empty() && rules(&plan, 1).is_empty());
        assert_eq!(rules(&plan, 2), ["/grip:=/grip/undisturbed"], "it is not behind a proxy");
        assert_eq!(plan.simulator.shared_address(), Some("ws://127.0.0.1:9090"));
        let of = |remappings: &[Remapping]| remappings.iter().map(Remapping::rule).collect::<Vec<_>>();
        let arm = plan.renamed(NodeId(0));
        let joints = ["/a/joints:=/a/joints/undisturbed", "/b/joints:=/b/joints/undisturbed"];
        assert_eq!(of(&arm.publishes), [joints[0], joints[1], "/commands:=/commands/from/arm"]);
        assert_eq!(of(&arm.subscribes), ["/a/joints:=/a/joints/to/arm", "/b/joints:=/b/joints/to/arm"]);
        let drive = plan.renamed(NodeId(1));
        assert_eq!(of(&drive.publishes), joints, "who publishes commands is told apart, and it is not declared to");
        assert!(drive.subscribes.is_empty());
        assert_eq!(drive.serves[0].rule(), "/grip:=/grip/undisturbed");
    }

    #[test]
    fn in_ros_1_the_rules_alone_are_the_arguments_of_a_node() {
        let mut plan = plan();
        plan.simulator = testing::ros1("http://127.0.0.1:{port}", plan.simulator.wiring);
        assert_eq!(plan.ros_args(Some(NodeId(2))), ["/grip:=/grip/undisturbed"]);
        assert_eq!(plan.ros_args(Some(NodeId(0))).len(), 3);
        assert!(plan.ros_args(None).is_empty(), "a rule would be of all nodes of the program");
        let wiring = plan.simulator.wiring;
        plan.simulator = testing::rosbridge("ws://127.0.0.1:9090", wiring);
        assert_eq!(plan.ros_args(Some(NodeId(2))).len(), 3);
        let crate::Transport::Rosbridge(settings) = &mut plan.simulator.transport else {
            unreachable!("it is a bridge")
        };
        settings.dialect = Dialect::Ros1;
        assert_eq!(plan.ros_args(Some(NodeId(2))), ["/grip:=/grip/undisturbed"], "behind a bridge, too");
    }

    #[test]
    fn topics_are_relayed_one_after_another_and_both_directions_of_a_service_at_once() {
        let plan = plan();
        let ids = |ids: &[u32]| ids.iter().copied().map(TopicId).collect::<Vec<_>>();
        assert_eq!(plan.relayable(), [ids(&[0]), ids(&[1]), ids(&[3, 4])]);
        let cut = |first: u32| -> Vec<TopicId> { plan.relaying(first).cut().map(|(id, ..)| id).collect() };
        assert_eq!([cut(0), cut(1), cut(2), cut(3)], [ids(&[]), ids(&[0]), ids(&[0, 1]), ids(&[0, 1, 3, 4])]);
        assert!(plan.relaying(0).ros_args(None).is_empty(), "no remapping is asked for");
        assert_eq!(plan.relaying(9), plan);
        // In lock-step, what is answered and the answers pass through the relay in any case.
        let mut stepped = plan.clone();
        stepped.nodes[1].answers = vec![crate::Answer { to: TopicId(1), with: TopicId(0) }];
        let step = crate::Stepping { step_ns: 1, by: crate::StepBy::Topic { path: "/step".to_owned() } };
        stepped.simulator.ros = Some(Ros { step: Some(step), ..Ros::default() });
        assert_eq!(stepped.relayable(), [ids(&[3, 4])]);
        let cut: Vec<TopicId> = stepped.relaying(0).cut().map(|(id, ..)| id).collect();
        assert_eq!(cut, ids(&[0, 1]));
        // With another simulator, the topics of operations can be relayed.
        let plan = testing::plan(vec![testing::operation(1, crate::OperationKind::Blackhole)]);
        assert_eq!(plan.relayable(), [ids(&[1])]);
        assert_eq!(plan.relaying(0), plan);
    }

    #[test]
    fn what_no_node_publishes_is_said() {
        let mut plan = plan();
        assert_eq!(plan.unclaimed(), []);
        plan.nodes.truncate(1);
        let said: Vec<(Channel, String)> =
            plan.unclaimed().into_iter().map(|(kind, remapping)| (kind, remapping.rule())).collect();
        let said: Vec<(Channel, &str)> = said.iter().map(|(kind, rule)| (*kind, rule.as_str())).collect();
        assert_eq!(
            said,
            [
                (Channel::Topic, "/a/joints:=/a/joints/undisturbed"),
                (Channel::Topic, "/b/joints:=/b/joints/undisturbed"),
                (Channel::Request, "/grip:=/grip/undisturbed"),
            ]
        );
    }
}
