//! The system under test: its simulator, its messages and their types, its topics and nodes.

use serde::{Deserialize, Serialize};

use crate::{Launch, Lifecycle, MessageId, Mqtt, Ros1, Ros2, Rosbridge, Simlog, TopicId, Wiring};

/// The simulator, and how the runner reaches it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Simulator {
    /// Its name in the space.
    pub name: String,
    /// The transport and its settings.
    pub transport: Transport,
    /// What starts and ends the system around it.
    #[serde(default, skip_serializing_if = "Lifecycle::is_default")]
    pub lifecycle: Lifecycle,
}

/// How a runner exchanges messages with a simulator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Transport {
    /// A Rust type linked into the runner, stepped in lock-step with the relay.
    InProcess {
        /// Path of the type, for example `kuka_cell_sim::Cell`.
        path: String,
        /// Simulation time of one step, in nanoseconds; positive.
        step_ns: u64,
    },
    /// A program that the runner starts and with which it exchanges lines of JSON.
    Process {
        /// The program: a name to be found on `PATH`, or a path relative to the folder of the `.sesame` file, in which
        /// the program runs. Where that folder is, generated code knows; a plan is the same wherever it lies.
        program: String,
        /// Its arguments, one by one; no shell reads them.
        arguments: Vec<String>,
        /// Simulation time of one step, in nanoseconds; positive. `None` for a simulator that runs freely: nobody steps
        /// it, so equal tests need not give equal results.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        step_ns: Option<u64>,
    },
    /// Nodes of ROS 2.
    Ros2(Ros2),
    /// Nodes of ROS behind a server that speaks the rosbridge protocol.
    Rosbridge(Rosbridge),
    /// Nodes of ROS 1.
    Ros1(Ros1),
    /// A system whose messages go over brokers of MQTT.
    Mqtt(Mqtt),
    /// A simulator that speaks SimlogAPI.
    Simlog(Simlog),
}

impl Transport {
    /// Simulation time of one step, in nanoseconds; `None` for a system that runs freely.
    pub fn step_ns(&self) -> Option<u64> {
        match self {
            Transport::InProcess { step_ns, .. } => Some(*step_ns),
            Transport::Process { step_ns, .. } => *step_ns,
            Transport::Ros2(ros2) => ros2.step.as_ref().map(|step| step.step_ns),
            Transport::Simlog(simlog) => Some(simlog.step_ns),
            Transport::Rosbridge(_) | Transport::Ros1(_) | Transport::Mqtt(_) => None,
        }
    }

    /// The keyword of its kind.
    pub fn word(&self) -> &'static str {
        match self {
            Transport::InProcess { .. } => "in_process",
            Transport::Process { .. } => "process",
            Transport::Ros2(_) => "ros2",
            Transport::Rosbridge(_) => "rosbridge",
            Transport::Ros1(_) => "ros1",
            Transport::Mqtt(_) => "mqtt",
            Transport::Simlog(_) => "simlog",
        }
    }

    /// The same, to be changed.
    pub fn wiring_mut(&mut self) -> &mut [Wiring] {
        match self {
            Transport::InProcess { .. } | Transport::Process { .. } | Transport::Simlog(_) => &mut [],
            Transport::Ros2(ros2) => &mut ros2.wiring,
            Transport::Rosbridge(rosbridge) => &mut rosbridge.wiring,
            Transport::Ros1(ros1) => &mut ros1.wiring,
            Transport::Mqtt(mqtt) => &mut mqtt.wiring,
        }
    }

    /// How each topic of the plan is cut, in their order; empty where the simulator itself brings all messages.
    pub fn wiring(&self) -> &[Wiring] {
        match self {
            Transport::InProcess { .. } | Transport::Process { .. } | Transport::Simlog(_) => &[],
            Transport::Ros2(ros2) => &ros2.wiring,
            Transport::Rosbridge(rosbridge) => &rosbridge.wiring,
            Transport::Ros1(ros1) => &ros1.wiring,
            Transport::Mqtt(mqtt) => &mqtt.wiring,
        }
    }

    /// The address of the one system that all workers would use; `None` if each has its own, with which several can run
    /// at a time.
    pub fn shared_address(&self) -> Option<&str> {
        let addresses: Vec<&str> = match self {
            Transport::InProcess { .. } | Transport::Process { .. } | Transport::Ros2(_) => Vec::new(),
            Transport::Rosbridge(rosbridge) => rosbridge.addresses(),
            Transport::Ros1(ros1) => vec![&ros1.master],
            Transport::Mqtt(mqtt) => mqtt.all().into_iter().map(|broker| broker.remote.url.as_str()).collect(),
            Transport::Simlog(simlog) => vec![&simlog.url],
        };
        addresses.into_iter().find(|address| is_shared(address))
    }
}

/// Whether an address is the same for all workers: it has none of the placeholders for which each has a value of its
/// own.
pub fn is_shared(address: &str) -> bool {
    !["{port}", "{worker}", "{domain}"].iter().any(|own| address.contains(own))
}

/// A named message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MessageType {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its fields, in declaration order.
    pub fields: Vec<Field>,
}

/// One field of a message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its name, as on the wire.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: Type,
}

/// The type of a field or topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Type {
    /// True or false.
    Bool,
    /// A whole number, in a unit if one is declared.
    Int {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// A real number, in a unit if one is declared.
    Real {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Text.
    Text,
    /// A point in space: x, y, z, in a unit if one is declared.
    Point {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Any number of values of one type.
    List {
        /// The type of each element.
        of: Box<Type>,
    },
    /// A message type.
    Message {
        /// Which.
        id: MessageId,
    },
}

/// A topic, or a group of topics of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Topic {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Names on the wire, matched exactly: one, or the written-out members of a group.
    pub paths: Vec<String>,
    /// What it carries.
    #[serde(rename = "type")]
    pub ty: Type,
    /// The layout of its messages on the wire, by the name of an [`Interface`](crate::Interface), where the transport
    /// needs it. Of SimlogAPI it is the name of the type, which may be left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interface: Option<String>,
    /// Whether it is a topic of the middleware, or one direction of a service.
    #[serde(default, skip_serializing_if = "Channel::is_default")]
    pub channel: Channel,
}

/// What carries the messages of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// A topic.
    #[default]
    Topic,
    /// The requests of a service, whose name is the path.
    Request,
    /// The replies of a service, whose name is the path.
    Reply,
}

impl Channel {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Channel::default()
    }
}

/// A node: a program that publishes and subscribes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Topics it publishes.
    pub publishes: Vec<TopicId>,
    /// Topics it subscribes to.
    pub subscribes: Vec<TopicId>,
    /// Its name in the middleware where that differs from its name in the space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub named: Option<String>,
    /// What starts it; `None` for a node that others start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub launch: Option<Launch>,
    /// What it publishes in answer to what it receives, so that a lock-stepped run knows what to wait for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answers: Vec<Answer>,
    /// On which topics it publishes one message in every step, on each of their paths, for the same reason.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub every_step: Vec<TopicId>,
}

/// For each message that a node receives on one topic, it publishes exactly one on another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// What it receives.
    pub to: TopicId,
    /// What it publishes.
    pub with: TopicId,
}

/// A value inside the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldRef {
    /// The topic.
    pub topic: TopicId,
    /// Field names from the message inwards; empty for a topic that carries the value itself.
    pub path: Vec<String>,
}
