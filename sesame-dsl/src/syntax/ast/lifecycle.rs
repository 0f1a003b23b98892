//! What a system says in addition to its simulator and messages: how it is launched and ended, and what a relay may
//! cost.

use super::words::{Name, Quantity, Text};
use crate::span::Span;

/// A program that the system needs in addition to its simulator.
#[derive(Debug)]
pub(crate) struct Launch {
    pub(crate) command: Command,
    pub(crate) ready: Vec<(Span, Ready)>,
}

/// A program and its arguments; at least the program.
#[derive(Debug)]
pub(crate) struct Command {
    pub(crate) program: Text,
    pub(crate) arguments: Vec<Text>,
}

/// When a launched program counts as ready.
#[derive(Debug)]
pub(crate) struct Ready {
    pub(crate) when: ReadyWhen,
    pub(crate) within: Quantity,
}

/// What shows that a launched program is ready.
#[derive(Debug)]
pub(crate) enum ReadyWhen {
    Topic(Name),
    /// The number, or a text with placeholders.
    Port(Text),
    /// The word.
    Clock(Span),
    Line(Text),
}

/// What a relay may add.
#[derive(Debug)]
pub(crate) struct RelayBudget {
    pub(crate) latency: Vec<(Span, Quantity)>,
    pub(crate) jitter: Vec<(Span, Quantity)>,
    pub(crate) has_errors: bool,
}
