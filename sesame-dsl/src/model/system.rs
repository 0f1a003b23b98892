//! The system under test: simulator, messages, topics, nodes.

use super::declaration::Declaration;
use super::ids::{MessageId, NodeId, TopicId};
use crate::span::Span;
use crate::units::Unit;
use sesame_plan::{
    Broker, Channel, Clock, Compression, Dialect, Identity, Quality, Remote, Secret, SimlogVersion, Stepping, WireNames,
};

/// The simulator under test.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulator {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// How a runner reaches it.
    pub transport: Transport,
}

/// How a runner exchanges messages with a simulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Transport {
    /// A Rust type linked into the runner, stepped in lock-step with the relay.
    InProcess {
        /// Path of the type: two or more identifiers joined by `::`, the first being the crate's name.
        path: String,
        /// The crate's folder as written, relative to the `.sesame` file; `None` when the crate comes from the space's
        /// `sesame.toml`.
        crate_folder: Option<String>,
        /// Simulation time of one step, in nanoseconds; positive.
        step_ns: u64,
    },
    /// A program that the runner starts in the folder of the `.sesame` file.
    Process {
        /// A name to be found on `PATH`, or a path with `/` in it, relative to that folder.
        program: String,
        /// Its arguments, none empty.
        arguments: Vec<String>,
        /// Simulation time of one step, in nanoseconds; positive. `None` for a simulator that runs freely.
        step_ns: Option<u64>,
    },
    /// Nodes of ROS 2.
    Ros2 {
        /// The domain of worker 0, at most 232. Default 0.
        domain: u16,
        /// What simulation time is; its topic is absolute. Default wall time.
        clock: Clock,
        /// How it is stepped, by absolute names; `None` for one that runs freely.
        step: Option<Stepping>,
        /// The service that resets it, absolute; `None` for one that is launched again.
        reset: Option<String>,
    },
    /// Nodes of ROS behind a server that speaks the rosbridge protocol.
    Rosbridge {
        /// Where it is.
        remote: Remote,
        /// The domain of worker 1, at most 232. Default 0.
        domain: u16,
        /// Which ROS is behind it. Default ROS 2.
        dialect: Dialect,
        /// How it is asked to send messages. Default JSON.
        compression: Compression,
        /// What simulation time is; its topic is absolute. Default wall time.
        clock: Clock,
        /// The service that resets it, absolute; `None` for one that is launched again.
        reset: Option<String>,
        /// Where clients connect that are one node each. Each node has at most one.
        proxies: Vec<Proxy>,
    },
    /// Nodes of ROS 1.
    Ros1 {
        /// The address of the master.
        master: String,
        /// What simulation time is; its topic is absolute. Default wall time.
        clock: Clock,
        /// The service that resets it, absolute; `None` for one that is launched again.
        reset: Option<String>,
    },
    /// A system whose messages go over brokers of MQTT.
    Mqtt {
        /// The broker of all nodes that have none of their own.
        broker: Broker,
        /// How surely messages arrive. Default at least once.
        quality: Quality,
    },
    /// A simulator that speaks `SimlogAPI`, stepped in lock-step.
    Simlog {
        /// Where it is.
        url: String,
        /// Where its topics are, in version 3; `None` for the port after that of `url`.
        topics_url: Option<String>,
        /// Simulation time of one step, in nanoseconds; whole milliseconds.
        step_ns: u64,
        /// The version of the protocol. Default 2.
        protocol: SimlogVersion,
        /// How names on the wire follow from those of topics. Default as the original platform.
        names: WireNames,
        /// The topic that marks the end of a step, in version 3.
        marker: Option<String>,
        /// For how long nothing may come in until a step is complete that nobody declares, in nanoseconds. Default 5
        /// ms.
        settle_ns: u64,
        /// A file with the certificates of authorities that are trusted.
        trust: Option<String>,
    },
}

/// What a system says beside its simulator.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lifecycle {
    /// What starts it.
    pub launch: Option<Launch>,
    /// What ends it.
    pub terminate: Option<Command>,
    /// What the relay may add to a message's way.
    pub relay_budget: Option<RelayBudget>,
}

/// A program that starts the system, or a node.
#[derive(Debug, Clone, PartialEq)]
pub struct Launch {
    /// The program.
    pub command: Command,
    /// When it counts as ready; `None` is at once.
    pub ready: Option<Ready>,
}

/// A program to run, without a shell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    /// Its keyword in the file.
    pub span: Span,
    /// A name to be found on `PATH`, or a path with `/` in it, relative to the folder of the `.sesame` file.
    pub program: String,
    /// Its arguments, none empty.
    pub arguments: Vec<String>,
}

/// When a launched program is ready.
#[derive(Debug, Clone, PartialEq)]
pub struct Ready {
    /// What shows it.
    pub when: ReadyWhen,
    /// Wall time after which it has failed to start, in seconds; positive.
    pub within: f64,
}

/// What shows that a launched program is ready.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ReadyWhen {
    /// The first message of a topic.
    Topic(TopicId),
    /// A connection to a TCP port; a number once placeholders are replaced.
    Port(String),
    /// The clock of a simulator that has one advances.
    Clock,
    /// A line of output contains this text.
    Line(String),
}

/// What a relay may add to a message's way, in seconds of wall time; 0 or more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelayBudget {
    /// The keyword in the file.
    pub span: Span,
    /// Delay at most.
    pub latency: Option<f64>,
    /// Difference of two delays at most.
    pub jitter: Option<f64>,
}

/// A named message type.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its fields, in declaration order; names are unique among them. Of a ROS type, in the order of the wire.
    pub fields: Vec<Field>,
    /// Its type in ROS, for example `sensor_msgs/msg/JointState`: that of one of [`crate::model::Space::interfaces`].
    pub interface: Option<String>,
}

/// One field of a message type. Its name is the one on the wire, so a keyword of the language is allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its type.
    pub ty: Type,
}

/// The type of a field or topic.
#[derive(Debug, Clone, PartialEq)]
pub enum Type {
    /// True or false.
    Bool,
    /// A whole number, in a unit if one is declared.
    Int(Option<Unit>),
    /// A real number, in a unit if one is declared.
    Real(Option<Unit>),
    /// Text.
    Text,
    /// A point in space, in a unit if one is declared.
    Point(Option<Unit>),
    /// Any number of values of one type.
    List(Box<Type>),
    /// A message type.
    Message(MessageId),
}

/// A topic, or a group of topics of one type.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The path as written, for example `safetyzones/{Z1,Z2}`.
    pub written: String,
    /// Names on the wire: one, or the members of the group in written order. No other topic of this channel has any of
    /// them. In ROS they are absolute.
    pub paths: Vec<String>,
    /// What it carries; in ROS a message with an interface.
    pub ty: Type,
    /// Whether it is a topic of the middleware, or one direction of a service.
    pub channel: Channel,
}

/// A node: a program that publishes and subscribes.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Topics it publishes.
    pub publishes: Vec<TopicId>,
    /// Topics it subscribes to.
    pub subscribes: Vec<TopicId>,
    /// Its name in the middleware, where one is written.
    pub named: Option<String>,
    /// What starts it; `None` for a node that others start.
    pub launch: Option<Launch>,
    /// What it publishes for each message that it receives: topics that it subscribes to, with those that it publishes.
    pub answers: Vec<(TopicId, TopicId)>,
    /// On which topics it publishes one message in every step of the simulator.
    pub every_step: Vec<TopicId>,
    /// The address of its broker, where it is not that of the simulator.
    pub broker: Option<String>,
}

/// An address at which clients of a bridge are one node.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Proxy {
    /// The node.
    pub node: NodeId,
    /// Its address, with a port. Beyond this machine it is one of TLS, with a token, and public.
    pub url: String,
    /// What clients have to show; `None` if everybody is let in.
    pub token: Option<Secret>,
    /// What it shows to clients; there if the address is one of TLS.
    pub identity: Option<Identity>,
    /// Whether it may be reached from other machines.
    pub public: bool,
}

/// A value inside the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldPath {
    /// The topic.
    pub topic: TopicId,
    /// Field names from the message inwards; empty for a topic that carries the value itself.
    pub fields: Vec<String>,
}
