//! The system under test: simulator, messages, topics, nodes.

use super::declaration::Declaration;
use super::ids::{MessageId, TopicId};
use crate::interfaces::Constant;
use crate::span::Span;
use crate::units::Unit;
use sesame_plan::{Channel, Proxy, Ros, Transport};

/// The simulator under test, or that of a lab.
///
/// It is as in a plan, with these guarantees: the path of a Rust type consists of two or more identifiers, no argument
/// is empty, domains are at most 232, names of ROS are absolute, and each node has at most one proxy; one that can be
/// reached from other machines is public, at an address of TLS, and wants a token. Empty are the parts that follow from
/// the rest of the space: the layouts of messages, which topics are cut, and which nodes are at other brokers.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulator {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// How a runner reaches it.
    pub transport: Transport,
    /// The folder of the crate of one that is a part of the runner as written, relative to the `.sesame` file; `None`
    /// when the crate comes from the space's `sesame.toml`.
    pub crate_folder: Option<String>,
    /// What systems of ROS have; `None` for others.
    pub ros: Option<Ros>,
    /// Where clients connect that are one node each.
    pub proxies: Vec<Proxy>,
}

/// What a system says in addition to its simulator.
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
    /// Its fields, in declaration order; names are unique among them. For a ROS type, they are in the order of the
    /// wire.
    pub fields: Vec<Field>,
    /// Its type in ROS, for example `sensor_msgs/msg/JointState`: that of one of [`crate::model::Space::interfaces`].
    pub interface: Option<String>,
    /// Values that its fields may have, with names: those that are declared, then those of its definition.
    pub constants: Vec<Constant>,
}

/// One field of a message type. Its name is the one on the wire, so a keyword of the language is allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its type.
    pub ty: Type,
    /// Whether messages may lack it.
    pub optional: bool,
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
    /// The names of the members of the group, in the order of the paths; none for a single topic.
    pub members: Vec<String>,
    /// What it carries; in ROS a message with an interface.
    pub ty: Type,
    /// Whether it is a topic of the middleware, or one direction of a service.
    pub channel: Channel,
    /// The name of the action that it is a part of, if it is one.
    pub action: Option<String>,
}

/// A topic, or some members of a group of topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicMembers {
    /// The topic.
    pub topic: TopicId,
    /// The positions of the members, in ascending order; `None` for all of them.
    pub members: Option<Vec<u32>>,
}

impl TopicMembers {
    /// Whether it has this member.
    pub fn has(&self, member: u32) -> bool {
        self.members.as_ref().is_none_or(|members| members.contains(&member))
    }
}

/// A node: a program that publishes and subscribes.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its name and doc comment. That of a member of a group of nodes has the member behind the name of the group, in
    /// brackets, and the place of the group.
    pub declaration: Declaration,
    /// Topics it publishes: none twice.
    pub publishes: Vec<TopicMembers>,
    /// Topics it subscribes to: none twice.
    pub subscribes: Vec<TopicMembers>,
    /// Its name in the middleware, where one is written.
    pub named: Option<String>,
    /// What starts it; `None` for a node that others start.
    pub launch: Option<Launch>,
    /// What it publishes for each message that it receives: topics that it subscribes to, with those that it publishes.
    pub answers: Vec<(TopicId, TopicId)>,
    /// The topics on which it publishes one message in every step of the simulator.
    pub every_step: Vec<TopicId>,
    /// The address of its broker, where it is not that of the simulator.
    pub broker: Option<String>,
}

/// A value inside the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldPath {
    /// The topic.
    pub topic: TopicId,
    /// Field names from the message inwards; empty for a topic that carries the value itself.
    pub fields: Vec<String>,
}
