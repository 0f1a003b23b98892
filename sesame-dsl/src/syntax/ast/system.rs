//! The system under test: simulator, messages, topics, nodes.

use super::lifecycle::{Command, Launch, RelayBudget};
use super::words::{Count, Head, Name, Quantity, Text, UnitName, WithMember};
use crate::span::Span;
use sesame_plan::{Compression, Dialect, Quality, SimulatorKind};

#[derive(Debug)]
pub(crate) struct System {
    /// The keyword.
    pub(crate) span: Span,
    pub(crate) simulators: Vec<Simulator>,
    pub(crate) messages: Vec<Message>,
    pub(crate) topics: Vec<Topic>,
    pub(crate) services: Vec<Service>,
    pub(crate) actions: Vec<Action>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) launches: Vec<(Span, Launch)>,
    pub(crate) terminates: Vec<(Span, Command)>,
    pub(crate) relay_budgets: Vec<(Span, RelayBudget)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug)]
pub(crate) struct Simulator {
    pub(crate) head: Head,
    /// `None` for a transport that is not supported yet.
    pub(crate) transport: Option<Transport>,
}

/// How a simulator is reached.
#[derive(Debug)]
pub(crate) struct Transport {
    pub(crate) kind: SimulatorKind,
    /// What stands behind the word of the kind: the path of a type, a program with its arguments, or an address;
    /// nothing behind that of ROS 2.
    pub(crate) texts: Vec<Text>,
    pub(crate) settings: Settings,
}

impl Transport {
    /// The first text behind the word of the kind.
    pub(crate) fn first_text(&self) -> &Text {
        self.texts.first().expect("the grammar puts a text behind this word")
    }
}

/// The settings of a simulator. Which there can be is the grammar's: each kind has its own.
#[derive(Debug, Default)]
pub(crate) struct Settings {
    pub(crate) crates: Vec<(Span, Text)>,
    pub(crate) steps: Vec<(Span, Quantity)>,
    /// Steps that say what takes them.
    pub(crate) steppings: Vec<(Span, Stepping)>,
    /// Where it says `free running`.
    pub(crate) free_running: Vec<(Span, ())>,
    pub(crate) domains: Vec<(Span, Count)>,
    /// Folders that hold packages with definitions of messages.
    pub(crate) types: Vec<(Span, Vec<Text>)>,
    pub(crate) clocks: Vec<(Span, Clock)>,
    /// The service that resets the simulator.
    pub(crate) resets: Vec<(Span, Text)>,
    pub(crate) dialects: Vec<(Span, Dialect)>,
    pub(crate) compressions: Vec<(Span, Compression)>,
    pub(crate) qualities: Vec<(Span, Quality)>,
    pub(crate) users: Vec<(Span, Text)>,
    /// A token or a password.
    pub(crate) secrets: Vec<(Span, Secret)>,
    pub(crate) trusts: Vec<(Span, Text)>,
    pub(crate) proxies: Vec<Proxy>,
    pub(crate) protocols: Vec<(Span, Count)>,
    /// The address of a server of topics.
    pub(crate) topics: Vec<(Span, Text)>,
    pub(crate) markers: Vec<(Span, Text)>,
    pub(crate) settles: Vec<(Span, Quantity)>,
    /// What is written around names: before them, and behind them where they are cut, heard and injected.
    pub(crate) prefixes: Vec<(Span, Text)>,
    pub(crate) cuts: Vec<(Span, Text)>,
    pub(crate) heards: Vec<(Span, Text)>,
    pub(crate) injecteds: Vec<(Span, Text)>,
    pub(crate) bares: Vec<(Span, Vec<Text>)>,
    pub(crate) has_errors: bool,
}

/// An address at which clients of a bridge are one node.
#[derive(Debug)]
pub(crate) struct Proxy {
    pub(crate) node: WithMember,
    pub(crate) address: Text,
    /// What clients have to show.
    pub(crate) secrets: Vec<(Span, Secret)>,
    pub(crate) certificates: Vec<(Span, Text)>,
    pub(crate) keys: Vec<(Span, Text)>,
    /// That it may be reached from other machines.
    pub(crate) publics: Vec<(Span, ())>,
}

/// Where a secret is kept.
#[derive(Debug)]
pub(crate) enum Secret {
    Environment(Text),
    File(Text),
}

#[derive(Debug)]
pub(crate) enum Clock {
    Wall,
    Topic(Text),
}

/// A step, and what takes it.
#[derive(Debug)]
pub(crate) struct Stepping {
    pub(crate) time: Quantity,
    /// `None` if it is not said.
    pub(crate) by: Option<StepBy>,
}

#[derive(Debug)]
pub(crate) struct StepBy {
    pub(crate) channel: StepChannel,
    pub(crate) path: Text,
    pub(crate) span: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum StepChannel {
    Service,
    Topic,
}

#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) head: Head,
    /// Its type in ROS.
    pub(crate) ros_type: Option<Text>,
    /// Whether it has a block of fields.
    pub(crate) block: bool,
    pub(crate) fields: Vec<Field>,
    pub(crate) constants: Vec<Constant>,
    pub(crate) has_errors: bool,
}

/// A number or a text with a name, which messages have in their fields.
#[derive(Debug)]
pub(crate) struct Constant {
    pub(crate) name: Name,
    pub(crate) value: ConstantValue,
}

#[derive(Debug)]
pub(crate) enum ConstantValue {
    Number(Quantity),
    Text(Text),
}

#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) head: Head,
    /// The word `optional`.
    pub(crate) optional: Option<Span>,
    pub(crate) ty: Type,
    /// Its type on the wire, as in a `.msg` file.
    pub(crate) wire: Option<Text>,
}

#[derive(Debug, Clone)]
pub(crate) struct Type {
    pub(crate) kind: TypeKind,
    pub(crate) unit: Option<UnitName>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) enum TypeKind {
    Bool,
    Int,
    Real,
    Text,
    Point,
    List(Box<Type>),
    Message(Name),
}

#[derive(Debug)]
pub(crate) struct Topic {
    pub(crate) head: Head,
    pub(crate) path: Text,
    pub(crate) ty: Type,
}

/// A service of ROS: two topics, one for each direction.
#[derive(Debug)]
pub(crate) struct Service {
    pub(crate) head: Head,
    /// The topic of its requests, whose name is not written.
    pub(crate) request: Head,
    /// The topic of its replies, whose name is not written.
    pub(crate) reply: Head,
    pub(crate) path: Text,
    pub(crate) ros_type: Text,
}

/// An action of ROS 2: a topic for each of [`sesame_plan::action::PARTS`].
#[derive(Debug)]
pub(crate) struct Action {
    pub(crate) head: Head,
    /// Its topics, whose names are not written.
    pub(crate) parts: Vec<Head>,
    pub(crate) path: Text,
    pub(crate) ros_type: Text,
}

#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) head: Head,
    /// Its name in the middleware, or those of a group of nodes.
    pub(crate) named: Option<Text>,
    pub(crate) publishes: Vec<(Span, Vec<WithMember>)>,
    pub(crate) subscribes: Vec<(Span, Vec<WithMember>)>,
    /// The services and actions that it offers.
    pub(crate) serves: Vec<(Span, Vec<WithMember>)>,
    /// The services and actions of others that it uses.
    pub(crate) calls: Vec<(Span, Vec<WithMember>)>,
    pub(crate) launches: Vec<(Span, Launch)>,
    pub(crate) answers: Vec<(Span, Vec<Answer>)>,
    pub(crate) every_step: Vec<(Span, Vec<Name>)>,
    /// Where it is connected, if not where the simulator is.
    pub(crate) brokers: Vec<(Span, Text)>,
}

/// What a node publishes for each message that it receives.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) to: Name,
    pub(crate) with: Name,
}
