//! Whether the system of a plan is sound: its simulator, its nodes, and what launches them.

use std::collections::BTreeSet;

use super::check::{Checked, at, each, id, name, positive, require};
use crate::{
    CampaignPlan, Channel, Interface, Launch, Lifecycle, Node, NodeId, ReadyWhen, Ros, Ros2, Simlog, SimlogVersion,
    Simulator, TopicId, TopicMembers, Transport, WireType, Wiring,
};

/// The highest domain of ROS whose ports exist on every system.
const MOST_DOMAIN: u16 = 232;

/// In nanoseconds.
const MILLISECOND: u64 = 1_000_000;

impl CampaignPlan {
    pub(super) fn sound_simulator(&self, simulator: &Simulator) -> Checked {
        at("name", name(&simulator.name))?;
        at("transport.step_ns", require(simulator.step_ns() != Some(0), || "must be positive".to_owned()))?;
        at("transport", self.sound_transport(&simulator.transport))?;
        at("transport", each("addresses", &simulator.addresses(), |address| name(address)))?;
        at("transport", self.sound_proxies(simulator))?;
        at("transport", sound_ros(simulator))?;
        at("transport", self.sound_wiring(simulator))?;
        let Lifecycle { launch, terminate: _, relay_budget } = &simulator.lifecycle;
        at("lifecycle.launch", launch.as_ref().map_or(Ok(()), |launch| self.sound_launch(launch)))?;
        let Some(budget) = relay_budget else { return Ok(()) };
        at("lifecycle.relay_budget.latency", budget.latency.map_or(Ok(()), positive))?;
        at("lifecycle.relay_budget.jitter", budget.jitter.map_or(Ok(()), positive))
    }

    /// The settings that are those of one kind.
    fn sound_transport(&self, transport: &Transport) -> Checked {
        match transport {
            Transport::Ros2(Ros2 { domain }) => {
                let beyond = || format!("is {domain}, more than {MOST_DOMAIN}");
                at("domain", require(*domain <= MOST_DOMAIN, beyond))
            }
            Transport::Mqtt(mqtt) => each("brokers", &mqtt.brokers, |(node, _)| self.has_node(*node)),
            Transport::Simlog(simlog) => self.sound_simlog(simlog),
            // Addresses are those of all kinds, and the generator checks programs and types, since these become code.
            _ => Ok(()),
        }
    }

    /// Where clients connect that are one node each, of a simulator whose kind has such addresses.
    fn sound_proxies(&self, simulator: &Simulator) -> Checked {
        let Simulator { proxies, .. } = simulator;
        require(proxies.is_empty() || simulator.properties().proxies, || without(simulator, "`proxies`"))?;
        each("proxies", proxies, |proxy| at("node", self.has_node(proxy.node)))
    }

    /// How topics are cut, of a system on a bus: each of them is.
    fn sound_wiring(&self, simulator: &Simulator) -> Checked {
        let on_a_bus = simulator.properties().bus.is_some();
        let (topics, wiring) = (if on_a_bus { self.topics.len() } else { 0 }, simulator.wiring.len());
        at("wiring", require(topics == wiring, || format!("there are {wiring} for {topics} topics")))?;
        each("wiring", &simulator.wiring, |Wiring { cut, publishers, subscribers, joined }| {
            each("publishers", publishers, |&id| self.has_node(id))?;
            each("subscribers", subscribers, |&id| self.has_node(id))?;
            let distinguishes = !publishers.is_empty() || !subscribers.is_empty();
            require(*cut || !distinguishes, || "distinguishes nodes of a topic that is not cut".to_owned())?;
            require(!(*cut && *joined), || "cuts a topic on which the runner publishes beside nodes".to_owned())
        })
    }

    fn sound_simlog(&self, simlog: &Simlog) -> Checked {
        let Simlog { url, topics_url, step_ns, protocol, names, marker, cut, settle_ns: _, ca: _ } = simlog;
        let is_url = |url: &str| {
            let host = url.strip_prefix("http://").or_else(|| url.strip_prefix("https://"));
            let named = host.is_some_and(|host| !host.is_empty());
            require(named, || format!("is `{url}`, not `http://HOST:PORT` or `https://HOST:PORT`"))
        };
        at("url", is_url(url))?;
        at("topics_url", topics_url.as_deref().map_or(Ok(()), is_url))?;
        let whole = step_ns.is_multiple_of(MILLISECOND);
        at("step_ns", require(whole, || format!("is {step_ns}, which is not a whole number of milliseconds")))?;
        // Else whoever publishes what is injected would hear it again.
        let apart = names.cut != names.injected && !names.injected.is_empty();
        at("names.injected", require(apart, || "names the same topic as what it replaces".to_owned()))?;
        each("names.bare", &names.bare, |part| require(!part.is_empty(), || "is in every name".to_owned()))?;
        let of_3 = |named: &Option<String>| {
            let known = *protocol == SimlogVersion::V3 || named.is_none();
            require(known, || "is there, but version 2 of the protocol has none".to_owned())
        };
        at("topics_url", of_3(topics_url))?;
        at("marker", of_3(marker))?;
        each("cut", cut, |&id| self.has_topic(id))?;
        let service = self.topics.iter().find(|topic| topic.channel != Channel::Topic);
        require(service.is_none(), || {
            let name = service.map_or("", |topic| topic.name.as_str());
            format!("has no services, and `{name}` is one")
        })
    }

    pub(super) fn sound_node(&self, node: &Node) -> Checked {
        at("name", name(&node.name))?;
        each("publishes", &node.publishes, |published| self.has_members(published))?;
        each("subscribes", &node.subscribes, |subscribed| self.has_members(subscribed))?;
        at("named", node.named.as_ref().map_or(Ok(()), |named| name(named)))?;
        at("launch", node.launch.as_ref().map_or(Ok(()), |launch| self.sound_launch(launch)))?;
        // A promise about anything else would be kept by nobody, and a step would end without its messages.
        let published = |&id: &TopicId| {
            self.has_topic(id)?;
            require(node.publishes(id), || "is not a topic that the node publishes".to_owned())
        };
        let subscribed = |&id: &TopicId| {
            self.has_topic(id)?;
            require(node.subscribes(id), || "is not a topic that the node subscribes to".to_owned())
        };
        each("every_step", &node.every_step, published)?;
        each("answers", &node.answers, |answer| {
            at("to", subscribed(&answer.to))?;
            at("with", published(&answer.with))
        })
    }

    fn has_members(&self, of: &TopicMembers) -> Checked {
        let TopicMembers::Only { topic, members } = of else { return self.has_topic(of.topic()) };
        at("topic", self.has_topic(*topic))?;
        let count = self.topic(*topic).paths.len();
        each("members", members, |&member| id("member", member as usize, count))?;
        let some = (1..count).contains(&members.len()) && members.is_sorted_by(|one, other| one < other);
        at("members", require(some, || "are not some of a group, in ascending order".to_owned()))
    }

    fn sound_launch(&self, launch: &Launch) -> Checked {
        let Some(ready) = &launch.ready else { return Ok(()) };
        let when = match &ready.when {
            ReadyWhen::Topic { topic } => self.has_topic(*topic),
            ReadyWhen::Clock => require(self.simulator.has_a_clock(), || "the simulator has no clock".to_owned()),
            ReadyWhen::Port { .. } | ReadyWhen::Line { .. } => Ok(()),
        };
        at("ready.when", when)?;
        at("ready.within", positive(ready.within))
    }

    pub(super) fn has_node(&self, node: NodeId) -> Checked {
        id("node", node.index(), self.nodes.len())
    }

    /// A topic of ROS has a layout.
    pub(super) fn has_interface(&self, interface: Option<&str>) -> Checked {
        // In other systems it may be for a lab.
        let Some(ros) = &self.simulator.ros else { return interface.map_or(Ok(()), name) };
        let Some(wanted) = interface else { return require(false, || "there is none".to_owned()) };
        let known = ros.interfaces.iter().any(|Interface { name, .. }| name == wanted);
        require(known, || format!("there is no interface `{wanted}`"))
    }
}

/// What systems of ROS have, and no others.
fn sound_ros(simulator: &Simulator) -> Checked {
    let properties = simulator.properties();
    let Some(Ros { clock: _, step, reset: _, interfaces }) = &simulator.ros else {
        return require(properties.ros.is_none(), || "has no `clock`, or no `interfaces`".to_owned());
    };
    require(properties.ros.is_some(), || without(simulator, "`clock` and no `interfaces`"))?;
    require(step.is_none() || properties.reaches_nodes, || without(simulator, "`step`"))?;
    sound_interfaces(interfaces)
}

/// That simulators of a kind do not have something.
fn without(simulator: &Simulator, part: &str) -> String {
    format!("a simulator of kind `{}` has no {part}", simulator.properties().keyword)
}

/// Each interface is there once, after those that it contains.
fn sound_interfaces(interfaces: &[Interface]) -> Checked {
    let mut known: BTreeSet<&str> = BTreeSet::new();
    each("interfaces", interfaces, |interface| {
        let contained = |ty: &WireType| match ty.interface() {
            Some(inner) => require(known.contains(inner), || format!("`{inner}` is not before it")),
            None => Ok(()),
        };
        at("name", name(&interface.name))?;
        each("fields", &interface.fields, |field| {
            at("name", name(&field.name))?;
            at("type", contained(&field.ty))
        })?;
        let new = known.insert(&interface.name);
        at("name", require(new, || format!("`{}` is there twice", interface.name)))
    })
}
