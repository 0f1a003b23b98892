//! Wires as they are in a middleware: from which names their messages come, and to which they go.

use sesame_plan::{CampaignPlan, Channel, NodeId, TopicId, Wiring};

use super::{Wire, WireTable};
use crate::relay::Delivery;

/// A name in the middleware on which a transport listens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The wire that its messages take.
    pub wire: Wire,
    /// Its name in the middleware.
    pub path: String,
    /// The only node that publishes there; `None` for all that are not told apart.
    pub publisher: Option<NodeId>,
}

/// A name in the middleware on which a transport publishes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sink {
    /// The wire whose deliveries go there: a wire of a topic, or a link.
    pub wire: Wire,
    /// Its name in the middleware.
    pub path: String,
    /// The only node that subscribes there; `None` for all that are not told apart.
    pub subscriber: Option<NodeId>,
}

/// A wire with its names in the middleware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Which.
    pub wire: Wire,
    /// The topic that it belongs to.
    pub topic: TopicId,
    /// The position of its name among the paths of that topic: which member of a group it is.
    pub member: usize,
    /// Whether it is a topic, or one direction of a service.
    pub channel: Channel,
    /// Its own name.
    pub path: String,
    /// Whether its messages pass through the relay, or are only listened to.
    pub cut: bool,
    /// Where its messages come from; nowhere if only the runner publishes them.
    pub sources: Vec<Source>,
    /// Where they go. If it is not cut, nothing goes on: then it has a sink only where the runner publishes beside
    /// nodes, for messages of its own.
    pub sinks: Vec<Sink>,
}

impl Line {
    /// Whether a delivery goes to the sinks: on a line that is not cut, only messages of the runner's own do.
    pub fn takes(&self, delivery: &Delivery) -> bool {
        self.cut || delivery.by_monitor
    }
}

/// The lines of a plan's topics, in the order of the wires; those of services are not among them.
///
/// Publishers of a topic that is cut are on `TOPIC/undisturbed`, or on `TOPIC/from/NODE` where operations tell them
/// apart; its subscribers are on `TOPIC`, or on `TOPIC/to/NODE`.
pub fn lines(plan: &CampaignPlan, wires: &WireTable) -> Vec<Line> {
    let topics = wires.iter().filter(|&wire| plan.topic(wires.topic(wire)).channel == Channel::Topic);
    topics.map(|wire| line(plan, wires, wire)).collect()
}

/// The lines of a plan's services that are cut, in the order of the wires: two for each service. Its clients are on
/// `SERVICE`, its server is on `SERVICE/undisturbed`. One direction is cut if the other one is.
pub fn service_lines(plan: &CampaignPlan, wires: &WireTable) -> Vec<Line> {
    let is_of_service = |&wire: &Wire| plan.topic(wires.topic(wire)).channel != Channel::Topic;
    let services: Vec<Wire> = wires.iter().filter(is_of_service).collect();
    let is_cut = |wire: Wire| {
        let both = services.iter().filter(|&&other| wires.path(other) == wires.path(wire));
        both.into_iter().any(|&other| wiring(plan, wires.topic(other)).cut)
    };
    let line = |wire: Wire| {
        let (topic, path) = (wires.topic(wire), wires.path(wire).to_owned());
        let channel = plan.topic(topic).channel;
        let server = format!("{path}/undisturbed");
        let [from, to] = if channel == Channel::Request { [&path, &server] } else { [&server, &path] };
        let sources = vec![Source { wire, path: from.clone(), publisher: None }];
        let sinks = vec![Sink { wire, path: to.clone(), subscriber: None }];
        Line { wire, topic, member: wires.member(wire), channel, path, cut: true, sources, sinks }
    };
    services.iter().copied().filter(|&wire| is_cut(wire)).map(line).collect()
}

fn wiring(plan: &CampaignPlan, topic: TopicId) -> Wiring {
    plan.simulator.wiring.get(topic.index()).cloned().unwrap_or_default()
}

fn line(plan: &CampaignPlan, wires: &WireTable, wire: Wire) -> Line {
    let (topic, member) = (wires.topic(wire), wires.member(wire));
    let (channel, path) = (Channel::Topic, wires.path(wire).to_owned());
    let Wiring { cut, publishers, joined, .. } = wiring(plan, topic);
    let source = |path: String, publisher| Source { wire, path, publisher };
    if joined {
        let heard = plan.is_read_by_monitor(topic).then(|| source(path.clone(), None));
        let sinks = vec![Sink { wire, path: path.clone(), subscriber: None }];
        return Line { wire, topic, member, channel, cut, sources: heard.into_iter().collect(), sinks, path };
    }
    if !cut {
        let sources = vec![source(path.clone(), None)];
        return Line { wire, topic, member, channel, cut, sources, sinks: Vec::new(), path };
    }
    let publishes_here = |node: &NodeId| plan.node(*node).publishes_on(topic, member);
    let from = |&node: &NodeId| source(format!("{path}/from/{}", plan.node(node).name_in_paths()), Some(node));
    let mut sources: Vec<Source> = publishers.iter().filter(|node| publishes_here(node)).map(from).collect();
    // Nobody but the runner publishes what monitors say, unless the space names who does.
    let of_runner = plan.is_published_by_monitor(topic) && !plan.nodes.iter().any(|node| node.publishes(topic));
    let mut others =
        (0u32..).map(NodeId).take(plan.nodes.len()).filter(|node| publishes_here(node) && !publishers.contains(node));
    // All publishers that are not named, if only because no node is declared to publish it.
    if !of_runner && (sources.is_empty() || others.next().is_some()) {
        sources.push(source(format!("{path}/undisturbed"), None));
    }
    let mut sinks = vec![Sink { wire, path: path.clone(), subscriber: None }];
    for link in wires.links().iter().filter(|link| link.of == wire) {
        sinks.push(Sink { wire: link.wire, path: wires.path(link.wire).to_owned(), subscriber: Some(link.to) });
    }
    Line { wire, topic, member, channel, path, cut, sources, sinks }
}

#[cfg(test)]
mod tests {
    use sesame_base::time::SimTime;
    use sesame_plan::testing::{evidence_above, guarantee, minimal, monitor, node, ros2, topic, topics};
    use sesame_plan::{FieldRef, Gate, Mitigation, MitigationValue, MonitorId, Node, Type};

    use super::*;
    use crate::value::Value;

    #[test]
    fn what_only_a_monitor_publishes_comes_from_nowhere() {
        let mut plan = minimal();
        plan.topics = vec![topic("level", &["level"], Type::Real { unit: None }), topic("safe", &["safe"], Type::Bool)];
        plan.monitors =
            vec![monitor("cell", 1, vec![evidence_above("low", 0, 1.0)], vec![guarantee("ok", 1, Gate::Evidence(0))])];
        plan.nodes = vec![node("arm")];
        plan.simulator = ros2(0, [false, true].map(|cut| Wiring { cut, ..Wiring::default() }).to_vec());
        let ends = |plan: &CampaignPlan| {
            let path = |source: &Source| source.path.clone();
            let of = |line: Line| (line.sources.iter().map(path).collect(), line.sinks.len());
            lines(plan, &WireTable::new(plan)).into_iter().map(of).collect::<Vec<(Vec<String>, usize)>>()
        };
        let level = (vec!["level".to_owned()], 0);
        assert_eq!(ends(&plan), [level.clone(), (Vec::new(), 1)]);
        plan.nodes = vec![Node { publishes: topics(&[1]), ..node("arm") }];
        assert_eq!(ends(&plan), [level.clone(), (vec!["safe/undisturbed".to_owned()], 1)]);
        // The same holds for what is to bring the system into a safe state.
        let field = FieldRef { topic: TopicId(1), path: Vec::new() };
        let mitigation = Mitigation { field, value: MitigationValue::Bool(true) };
        plan.monitors[0].publishes = None;
        plan.monitors[0].otherwise.mitigation = Some(mitigation);
        assert_eq!(ends(&plan), [level.clone(), (vec!["safe/undisturbed".to_owned()], 1)]);
        plan.nodes = vec![node("arm")];
        assert_eq!(ends(&plan), [level, (Vec::new(), 1)]);
    }

    #[test]
    fn a_guest_publishes_under_the_name_that_all_know_and_passes_nothing_on() {
        let mut plan = minimal();
        plan.topics = vec![topic("level", &["level"], Type::Real { unit: None }), topic("safe", &["safe"], Type::Bool)];
        plan.monitors =
            vec![monitor("cell", 1, vec![evidence_above("low", 0, 1.0)], vec![guarantee("ok", 1, Gate::Evidence(0))])];
        plan.simulator = ros2(0, vec![Wiring { cut: true, ..Wiring::default() }; 2]);
        let plan = plan.of_monitor_alone(MonitorId(0)).unwrap();
        let [level, safe] = &lines(&plan, &WireTable::new(&plan))[..] else { panic!("there are two topics") };
        assert_eq!((level.sources[0].path.as_str(), level.sinks.len(), level.cut), ("level", 0, false));
        assert_eq!((safe.sources.len(), safe.sinks[0].path.as_str(), safe.cut), (0, "safe", false));
        let delivery = |by_monitor| {
            let (wire, at) = (safe.wire, SimTime::ZERO);
            Delivery { wire, index: 0, at, by_monitor, value: Value::Bool(true) }
        };
        assert!(safe.takes(&delivery(true)) && !safe.takes(&delivery(false)));
    }
}
