//! The system under test: simulator, messages, topics, nodes.

use super::lifecycle::{Command, Launch, RelayBudget};
use super::words::{Head, Name, Quantity, Text, UnitName};
use crate::span::Span;

#[derive(Debug)]
pub(crate) struct System {
    /// The keyword.
    pub(crate) span: Span,
    pub(crate) simulators: Vec<Simulator>,
    pub(crate) messages: Vec<Message>,
    pub(crate) topics: Vec<Topic>,
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

#[derive(Debug)]
pub(crate) enum Transport {
    InProcess(InProcess),
    Process(Process),
}

#[derive(Debug)]
pub(crate) struct InProcess {
    pub(crate) path: Text,
    pub(crate) crates: Vec<(Span, Text)>,
    pub(crate) steps: Vec<(Span, Quantity)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug)]
pub(crate) struct Process {
    pub(crate) program: Text,
    pub(crate) arguments: Vec<Text>,
    pub(crate) steps: Vec<(Span, Quantity)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) head: Head,
    pub(crate) fields: Vec<Field>,
    pub(crate) has_errors: bool,
}

#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) head: Head,
    pub(crate) ty: Type,
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

#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) head: Head,
    pub(crate) publishes: Vec<(Span, Vec<Name>)>,
    pub(crate) subscribes: Vec<(Span, Vec<Name>)>,
}
