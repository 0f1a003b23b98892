//! A runner between nodes, in this process: its plan, and its system driven by hand.

use std::time::Instant;

use sesame_base::time::SimTime;
use sesame_plan::testing::{minimal, node, topic};
use sesame_plan::{
    CampaignPlan, Channel, Interface, InterfaceField, Node, NodeId, Primitive, Ros, Ros1, Test, Transport, Type,
    WireType, Wiring,
};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Finished, Relay};
use sesame_relay::transport::TransportError;
use sesame_relay::wire::WireTable;

use crate::core::LIMIT;

/// A layout by names and types of fields. A type with `/` in it is an interface.
fn interface(name: &str, fields: &[(&str, &str)]) -> Interface {
    let ty = |written: &str| {
        let (of, is_list) = written.strip_suffix("[]").map_or((written, false), |of| (of, true));
        let of = match of {
            "string" => WireType::STRING,
            "float64" => WireType::Primitive { primitive: Primitive::Float64 },
            "int32" => WireType::Primitive { primitive: Primitive::Int32 },
            "uint32" => WireType::Primitive { primitive: Primitive::Uint32 },
            "bool" => WireType::Primitive { primitive: Primitive::Bool },
            "uint8" => WireType::Primitive { primitive: Primitive::Uint8 },
            name => WireType::Interface { name: name.to_owned() },
        };
        if is_list { WireType::Sequence { of: Box::new(of), bound: None } } else { of }
    };
    let fields = fields.iter().map(|(name, written)| InterfaceField { name: (*name).to_owned(), ty: ty(written) });
    Interface { name: name.to_owned(), fields: fields.collect() }
}

/// The layouts as a space has them: those of ROS 2.
fn interfaces() -> Vec<Interface> {
    vec![
        interface("std_msgs/msg/String", &[("data", "string")]),
        interface("builtin_interfaces/msg/Time", &[("sec", "int32"), ("nanosec", "uint32")]),
        interface("std_msgs/msg/Header", &[("stamp", "builtin_interfaces/msg/Time"), ("frame_id", "string")]),
        interface(
            "sensor_msgs/msg/JointState",
            &[
                ("header", "std_msgs/msg/Header"),
                ("name", "string[]"),
                ("position", "float64[]"),
                ("velocity", "float64[]"),
                ("effort", "float64[]"),
            ],
        ),
        interface("std_srvs/srv/SetBool_Request", &[("data", "bool")]),
        interface("std_srvs/srv/SetBool_Response", &[("success", "bool"), ("message", "string")]),
        interface("std_srvs/srv/Trigger_Request", &[("structure_needs_at_least_one_member", "uint8")]),
        interface("std_srvs/srv/Trigger_Response", &[("success", "bool"), ("message", "string")]),
    ]
}

/// A plan without nodes, with topics by their names, paths, interfaces and channels, all of them cut.
pub(crate) fn plan(master: &str, topics: &[(&str, &str, &str, Channel)]) -> CampaignPlan {
    let mut plan = minimal();
    plan.topics = topics
        .iter()
        .map(|(name, path, interface, channel)| sesame_plan::Topic {
            interface: Some((*interface).to_owned()),
            channel: *channel,
            // What the space says of a message does not matter to the transport.
            ..topic(name, &[path], Type::Bool)
        })
        .collect();
    plan.simulator.transport = Transport::Ros1(Ros1 { master: master.to_owned() });
    plan.simulator.ros = Some(Ros { interfaces: interfaces(), ..Ros::default() });
    plan.simulator.wiring = topics.iter().map(|_| Wiring { cut: true, ..Wiring::default() }).collect();
    plan
}

/// A plan with one topic that is cut, `/peer`, from a node `publisher` to a node `subscriber`.
pub(crate) fn peers(master: &str, interface: &str) -> CampaignPlan {
    let mut plan = plan(master, &[("peer", "/peer", interface, Channel::Topic)]);
    plan.nodes = vec![
        Node { publishes: sesame_plan::testing::topics(&[0]), ..node("publisher") },
        Node { subscribes: sesame_plan::testing::topics(&[0]), ..node("subscriber") },
    ];
    plan
}

/// What the plan says of ROS.
pub(crate) fn ros(plan: &mut CampaignPlan) -> &mut Ros {
    plan.simulator.ros.as_mut().expect("it is a system of ROS 1")
}

/// The arguments that remap a node.
pub(crate) fn remapped(plan: &CampaignPlan, node: u32) -> Vec<String> {
    plan.ros_args(Some(NodeId(node)))
}

/// A system with the runner between its nodes.
pub(crate) struct System {
    plan: CampaignPlan,
    transport: Box<dyn sesame_relay::transport::Transport>,
    /// What the transport has noted, and nobody has taken.
    noted: Vec<String>,
}

/// What the runner has seen in a run until now.
#[derive(Debug)]
pub(crate) struct Seen<'a> {
    /// How many messages there were on the first topic.
    pub(crate) messages: u64,
    pub(crate) now: SimTime,
    /// What was noted, before the run too.
    pub(crate) notes: &'a [String],
}

impl System {
    pub(crate) fn new(plan: CampaignPlan) -> Self {
        let folder = std::env::temp_dir();
        System { transport: sesame_ros1::ros1(folder).transport(&plan), plan, noted: Vec::new() }
    }

    /// A run that lasts until something holds, which is asked every 20 ms. `ready` is called when the system is
    /// complete.
    pub(crate) fn run(
        &mut self,
        test: &Test,
        ready: impl FnOnce(),
        mut done: impl FnMut() -> bool,
    ) -> Result<Finished, TransportError> {
        self.run_seeing(test, ready, |_| done())
    }

    /// The same; what holds may depend on what the runner has seen.
    pub(crate) fn run_seeing(
        &mut self,
        test: &Test,
        ready: impl FnOnce(),
        mut done: impl FnMut(&Seen<'_>) -> bool,
    ) -> Result<Finished, TransportError> {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).unwrap();
        let mut relay = Relay::new(&self.plan, &wires, test, metrics.start(), &[]).unwrap();
        relay.begin();
        self.transport.reset(1, &mut relay)?;
        ready();
        let (topic, begun) = (wires.find(&self.plan.topics[0].paths[0]).unwrap(), Instant::now());
        loop {
            self.noted.append(&mut self.transport.incidents().notes);
            let seen = Seen { messages: relay.next_index(topic), now: self.transport.now(), notes: &self.noted };
            if done(&seen) {
                break;
            }
            assert!(begun.elapsed() < 3 * LIMIT, "nothing comes of {seen:?}");
            // Not a moment away: no message is noted later than the end, even if this process looks at it later.
            self.transport.advance(SimTime::from_seconds(3_600.0), &mut relay)?;
        }
        Ok(relay.finish(self.transport.now()))
    }

    /// What the transport noted since the last call.
    pub(crate) fn notes(&mut self) -> Vec<String> {
        self.noted.append(&mut self.transport.incidents().notes);
        std::mem::take(&mut self.noted)
    }
}
