//! The plan of a monitor that is a program of its own: a guest in the system that it watches.

use std::collections::BTreeMap;
use std::fmt;

use crate::{CampaignPlan, FieldRef, Interface, Lifecycle, MessageId, MonitorId, Side, TopicId, Type, Wiring};

/// Why a monitor cannot be a program of its own, in words with a remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NotAlone {
    /// It is a part of the system already.
    External {
        /// The monitor.
        monitor: String,
    },
    /// It hears what only a runner can.
    Inbound {
        /// The monitor: that one, or one on which it relies.
        monitor: String,
        /// Its evidence.
        evidence: String,
    },
    /// Its system has several brokers.
    Brokers {
        /// The monitor.
        monitor: String,
    },
    /// Nobody but the runner may be connected to its simulator.
    OneClient {
        /// The monitor.
        monitor: String,
        /// The kind of the simulator.
        kind: &'static str,
    },
}

impl fmt::Display for NotAlone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotAlone::External { monitor } => write!(
                f,
                "monitor `{monitor}` is external: the system runs it, so there is nothing to generate; a monitor that \
                 `publishes` can be a program of its own"
            ),
            NotAlone::Inbound { monitor, evidence } => write!(
                f,
                "evidence `{evidence}` of monitor `{monitor}` is `inbound`: what is published before operations act on \
                 it, only a runner hears; remove `inbound`"
            ),
            NotAlone::Brokers { monitor } => write!(
                f,
                "the nodes of this system are at several brokers, and monitor `{monitor}` as a program of its own \
                 connects to one; declare a space whose simulator is the broker that has all of its topics"
            ),
            NotAlone::OneClient { monitor, kind } => write!(
                f,
                "nobody but the runner may be connected to a `{kind}` simulator, so monitor `{monitor}` cannot be a program \
                 of its own; declare a space with the topics of the monitor and a `process` simulator"
            ),
        }
    }
}

impl std::error::Error for NotAlone {}

impl CampaignPlan {
    /// Whether the runner of this plan is a guest in a system that runs without it: it cuts nothing, starts nothing and
    /// waits for nobody, and publishes in addition to the nodes.
    pub fn is_guest(&self) -> bool {
        self.simulator.wiring.iter().any(|wiring| wiring.joined)
    }

    /// Whether a monitor reads the messages of a topic: as evidence, or because its mitigation sets one field of a
    /// message and keeps the others.
    pub fn is_read_by_monitor(&self, topic: TopicId) -> bool {
        let evidence = self.monitors.iter().flat_map(|monitor| &monitor.evidence);
        let mut fields = evidence.flat_map(|evidence| &evidence.inputs).map(|input| &input.field);
        let mut mitigations = self.monitors.iter().filter_map(|monitor| monitor.otherwise.mitigation.as_ref());
        fields.any(|field| field.topic == topic)
            || mitigations.any(|mitigation| mitigation.field.topic == topic && !mitigation.field.path.is_empty())
    }

    /// The plan of a monitor as a program of its own, with all that the monitor needs and nothing else: it, the
    /// monitors on which it relies, their topics and messages, and the way to the system. Only this one publishes; the
    /// others are evaluated for it. Everything else of this plan is left out: operations, metrics, nodes, launches.
    /// What remains of the campaign is a run without operations, as long as any can be.
    pub fn of_monitor_alone(&self, id: MonitorId) -> Result<CampaignPlan, NotAlone> {
        let name = || self.monitor(id).name.clone();
        if self.monitor(id).publishes.is_none() {
            return Err(NotAlone::External { monitor: name() });
        }
        if self.simulator.brokers().is_some_and(|mqtt| mqtt.all().len() > 1) {
            return Err(NotAlone::Brokers { monitor: name() });
        }
        let properties = self.simulator.properties();
        if properties.one_client {
            return Err(NotAlone::OneClient { monitor: name(), kind: properties.keyword });
        }
        let relied_on = self.relied_on_by(id);
        for monitor in relied_on.iter().map(|&monitor| self.monitor(monitor)) {
            if let Some(evidence) = monitor.evidence.iter().find(|evidence| evidence.side == Side::Inbound) {
                let (monitor, evidence) = (monitor.name.clone(), evidence.name.clone());
                return Err(NotAlone::Inbound { monitor, evidence });
            }
        }
        let mut plan = CampaignPlan {
            nodes: Vec::new(),
            metrics: Vec::new(),
            requirements: Vec::new(),
            operations: Vec::new(),
            labs: Vec::new(),
            compensation: None,
            monitors: relied_on.iter().map(|&monitor| self.monitor(monitor).clone()).collect(),
            ..self.clone()
        };
        plan.simulator.lifecycle = Lifecycle::default();
        let places: BTreeMap<MonitorId, MonitorId> = relied_on.iter().copied().zip((0..).map(MonitorId)).collect();
        for (monitor, &was) in plan.monitors.iter_mut().zip(&relied_on) {
            monitor.demands.iter_mut().for_each(|demand| demand.monitor = places[&demand.monitor]);
            if was != id {
                monitor.publishes = None;
                monitor.otherwise.mitigation = None;
            }
        }
        plan.keep_topics(|plan, topic| plan.is_read_by_monitor(topic) || plan.is_published_by_monitor(topic));
        plan.keep_messages();
        plan.join();
        Ok(plan)
    }

    /// A monitor and all on which it relies, in the order of their declarations.
    fn relied_on_by(&self, id: MonitorId) -> Vec<MonitorId> {
        let mut found = vec![id];
        let mut next = 0;
        while let Some(&monitor) = found.get(next) {
            next += 1;
            for demand in &self.monitor(monitor).demands {
                if !found.contains(&demand.monitor) {
                    found.push(demand.monitor);
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// Leaves topics out that nobody needs. Only monitors and the transport may refer to topics.
    fn keep_topics(&mut self, needs: impl Fn(&CampaignPlan, TopicId) -> bool) {
        let kept: Vec<TopicId> = (0..).map(TopicId).take(self.topics.len()).filter(|&id| needs(self, id)).collect();
        let places: BTreeMap<TopicId, TopicId> = kept.iter().copied().zip((0..).map(TopicId)).collect();
        let of = |field: &mut FieldRef| field.topic = places[&field.topic];
        for monitor in &mut self.monitors {
            monitor.publishes = monitor.publishes.map(|topic| places[&topic]);
            let inputs = monitor.evidence.iter_mut().flat_map(|evidence| &mut evidence.inputs);
            inputs.for_each(|input| of(&mut input.field));
            monitor.otherwise.mitigation.iter_mut().for_each(|mitigation| of(&mut mitigation.field));
        }
        self.topics = kept.iter().map(|&id| self.topic(id).clone()).collect();
    }

    /// Leaves message types and interfaces out that no topic carries.
    fn keep_messages(&mut self) {
        let mut used = vec![false; self.messages.len()];
        self.topics.iter().for_each(|topic| contained(&topic.ty, &mut used));
        // Each comes after those that it contains.
        for at in (0..used.len()).rev() {
            if used[at] {
                self.messages[at].fields.iter().for_each(|field| contained(&field.ty, &mut used));
            }
        }
        let kept: Vec<usize> = (0..used.len()).filter(|&at| used[at]).collect();
        let places: BTreeMap<usize, MessageId> = kept.iter().copied().zip((0..).map(MessageId)).collect();
        self.messages = kept.iter().map(|&at| self.messages[at].clone()).collect();
        let fields = self.messages.iter_mut().flat_map(|message| &mut message.fields).map(|field| &mut field.ty);
        fields.chain(self.topics.iter_mut().map(|topic| &mut topic.ty)).for_each(|ty| moved(ty, &places));
        let mut named: Vec<String> = self.topics.iter().filter_map(|topic| topic.interface.clone()).collect();
        let Some(ros) = &mut self.simulator.ros else { return };
        let mut kept: Vec<Interface> = Vec::new();
        for interface in ros.interfaces.iter().rev() {
            if named.contains(&interface.name) {
                named.extend(interface.fields.iter().filter_map(|field| field.ty.interface()).map(str::to_owned));
                kept.push(interface.clone());
            }
        }
        kept.reverse();
        ros.interfaces = kept;
    }

    /// Makes the way to the system that of a guest.
    fn join(&mut self) {
        if self.simulator.properties().bus.is_some() {
            let topics = (0..).map(TopicId).take(self.topics.len());
            let wiring =
                topics.map(|topic| Wiring { joined: self.is_published_by_monitor(topic), ..Wiring::default() });
            self.simulator.wiring = wiring.collect();
        }
        // A guest neither steps nor resets the system.
        if let Some(ros) = &mut self.simulator.ros {
            (ros.step, ros.reset) = (None, None);
        }
        self.simulator.proxies.clear();
        if let Some(mqtt) = self.simulator.brokers_mut() {
            mqtt.brokers.clear();
        }
    }
}

/// Marks the message that a type is or contains.
fn contained(ty: &Type, used: &mut [bool]) {
    match ty {
        Type::Message { id } => used[id.index()] = true,
        Type::List { of } => contained(of, used),
        Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Text | Type::Point { .. } => {}
    }
}

/// Gives the message that a type is or contains its new position.
fn moved(ty: &mut Type, places: &BTreeMap<usize, MessageId>) {
    match ty {
        Type::Message { id } => *id = places[&id.index()],
        Type::List { of } => moved(of, places),
        Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Text | Type::Point { .. } => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{demand, evidence_above, field, guarantee, message, minimal, monitor, ros2, topic};
    use crate::{Endpoint, Evidence, Gate, Mitigation, MitigationValue, Monitor, Ros, StepBy, Stepping};

    /// `fast` relies on `seen`; `other` is on its own. The first topic and the first message are nobody's.
    fn plan() -> CampaignPlan {
        let mut plan = minimal();
        let of = |id| Type::Message { id: MessageId(id) };
        plan.messages = vec![
            message("Nobody", vec![field("a", Type::Bool)]),
            message("Inner", vec![field("speed", Type::Real { unit: None })]),
            message("Drive", vec![field("inner", Type::List { of: Box::new(of(1)) }), field("on", Type::Bool)]),
        ];
        let real = || Type::Real { unit: None };
        plan.topics = vec![
            topic("nobody", &["nobody"], of(0)),
            topic("light", &["light"], real()),
            topic("gap", &["gap"], real()),
            topic("drive", &["drive"], of(2)),
            topic("state", &["state"], Type::Bool),
            topic("sight", &["sight"], Type::Bool),
            topic("heat", &["heat"], real()),
        ];
        let on = FieldRef { topic: TopicId(3), path: vec!["on".to_owned()] };
        let mut fast = Monitor {
            demands: vec![demand("ok", 2, 0)],
            ..monitor("fast", 4, vec![evidence_above("far", 2, 1.0)], vec![guarantee("runs", 1, Gate::Evidence(0))])
        };
        fast.otherwise.mitigation = Some(Mitigation { field: on, value: MitigationValue::Bool(false) });
        let watch = |name: &str, publishes, topic| {
            monitor(name, publishes, vec![evidence_above("e", topic, 1.0)], vec![guarantee("ok", 1, Gate::Evidence(0))])
        };
        plan.monitors = vec![fast, watch("other", 0, 6), watch("seen", 5, 1)];
        plan
    }

    #[test]
    fn a_monitor_alone_has_what_it_needs_and_nothing_else() {
        let mut whole = plan();
        whole.simulator = ros2(3, vec![Wiring { cut: true, ..Wiring::default() }; 7]);
        whole.simulator.ros = Some(Ros {
            step: Some(Stepping { step_ns: 1, by: StepBy::Topic { path: "/step".to_owned() } }),
            reset: Some("/reset".to_owned()),
            ..Ros::default()
        });
        let mut alone = whole.of_monitor_alone(MonitorId(0)).unwrap();
        let names = |plan: &CampaignPlan| plan.topics.iter().map(|topic| topic.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&alone), ["light", "gap", "drive", "state"], "nobody publishes what `seen` is");
        assert_eq!(alone.messages.iter().map(|message| message.name.as_str()).collect::<Vec<_>>(), ["Inner", "Drive"]);
        assert_eq!(alone.topics[2].ty, Type::Message { id: MessageId(1) });
        let [fast, seen] = alone.monitors.as_slice() else { panic!("{:?}", alone.monitors) };
        assert_eq!((fast.publishes, fast.demands[0].monitor), (Some(TopicId(3)), MonitorId(1)));
        assert_eq!(fast.otherwise.mitigation.as_ref().unwrap().field.topic, TopicId(2));
        assert_eq!((seen.publishes, seen.evidence[0].inputs[0].field.topic), (None, TopicId(0)));
        let joined: Vec<bool> = alone.simulator.wiring.iter().map(|wiring| wiring.joined).collect();
        assert_eq!((joined, alone.is_guest(), whole.is_guest()), (vec![false, false, true, true], true, false));
        assert_eq!(alone.simulator.ros, Some(Ros::default()), "a guest neither steps nor resets");
        assert_eq!(alone.simulator.endpoint(), Some(Endpoint::Domain(&mut 3)));
        let read = [0, 1, 2, 3].map(|topic| alone.is_read_by_monitor(TopicId(topic)));
        assert_eq!(read, [true, true, true, false], "other fields of a mitigation are those of the last message");
    }

    #[test]
    fn what_only_a_runner_can_do_is_refused_with_a_remedy() {
        let mut plan = plan();
        plan.monitors[1].publishes = None;
        let refused = |plan: &CampaignPlan, of| plan.of_monitor_alone(MonitorId(of)).unwrap_err().to_string();
        assert!(refused(&plan, 1).contains("monitor `other` is external"));
        let evidence = &mut plan.monitors[2].evidence[0];
        *evidence = Evidence { side: Side::Inbound, ..evidence.clone() };
        assert!(refused(&plan, 0).starts_with("evidence `e` of monitor `seen` is `inbound`"));
    }
}
