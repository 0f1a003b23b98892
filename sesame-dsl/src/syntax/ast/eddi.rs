//! Runtime monitors.

use super::formula::Expression;
use super::words::{Count, Head, Name, Path, Quantity, Text};
use crate::span::Span;

/// A runtime monitor.
#[derive(Debug)]
pub(crate) struct Eddi {
    pub(crate) head: Head,
    pub(crate) state: State,
    pub(crate) demands: Vec<Demand>,
    pub(crate) evidence: Vec<Evidence>,
    pub(crate) guarantees: Vec<Guarantee>,
    pub(crate) otherwise: Vec<(Span, Otherwise)>,
    pub(crate) has_errors: bool,
}

/// Where its state is.
#[derive(Debug)]
pub(crate) enum State {
    /// The runner decides it, and publishes it on this topic.
    Published(Name),
    /// The system decides it. The span is that of `external`; a topic may say it.
    External(Span, Option<Path>),
}

#[derive(Debug)]
pub(crate) struct Demand {
    pub(crate) head: Head,
    pub(crate) eddi: Name,
}

#[derive(Debug)]
pub(crate) struct Evidence {
    pub(crate) head: Head,
    pub(crate) condition: Expression,
    pub(crate) held: Vec<(Span, Quantity)>,
    pub(crate) stale: Vec<(Span, Stale)>,
    /// Whether it hears messages before operations.
    pub(crate) inbound: Vec<Span>,
}

/// When evidence is too old.
#[derive(Debug)]
pub(crate) struct Stale {
    pub(crate) after: Quantity,
    /// Whether it is unknown then; false otherwise.
    pub(crate) unknown: bool,
    /// Whether all of its topics must be silent.
    pub(crate) all: bool,
}

#[derive(Debug)]
pub(crate) struct Guarantee {
    pub(crate) head: Head,
    pub(crate) integrity: Count,
    /// None of a monitor whose state a topic says.
    pub(crate) gate: Option<Expression>,
}

#[derive(Debug)]
pub(crate) struct Otherwise {
    pub(crate) head: Head,
    pub(crate) mitigation: Option<(Path, Mitigation)>,
}

/// What a mitigation sends.
#[derive(Debug)]
pub(crate) enum Mitigation {
    Truth(bool, Span),
    Number(Quantity),
    Text(Text),
}
