//! Known tests.

use super::formula::Expression;
use super::operation::Moment;
use super::words::{Bound, Count, Head, Name, Point, Quantity, Range, Text};
use crate::span::Span;

#[derive(Debug)]
pub(crate) struct Test {
    pub(crate) head: Head,
    pub(crate) operations: Vec<TestOperation>,
    pub(crate) expectations: Vec<Expectation>,
    pub(crate) simulator_seeds: Vec<(Span, Count)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug)]
pub(crate) struct TestOperation {
    pub(crate) operation: Name,
    pub(crate) choices: Vec<(Name, Choice)>,
    pub(crate) activation: Activation,
    pub(crate) seed: Option<Count>,
    pub(crate) messages: Vec<ListedRun>,
}

/// Messages that follow each other, of those that an operation of a test alters only.
#[derive(Debug)]
pub(crate) struct ListedRun {
    pub(crate) span: Span,
    pub(crate) first: Count,
    pub(crate) last: Option<Count>,
    /// Which wire of the operation, from 1.
    pub(crate) wire: Option<Count>,
}

/// When an operation of a test is active.
#[derive(Debug)]
pub(crate) enum Activation {
    Window(Range),
    Trigger(Box<Trigger>),
    /// In the place of a window.
    Moment(Span, Moment),
}

/// Activation by condition. What the conditions may hold, is for resolution to say.
#[derive(Debug)]
pub(crate) struct Trigger {
    pub(crate) start: Expression,
    pub(crate) end: TriggerEnd,
    pub(crate) times: Option<Count>,
}

#[derive(Debug)]
pub(crate) enum TriggerEnd {
    Until(Expression),
    For(Quantity),
}

#[derive(Debug)]
pub(crate) enum Choice {
    Value(Quantity),
    Range(Range),
    Point(Point),
    Text(Text),
}

impl Choice {
    pub(crate) fn span(&self) -> Span {
        match self {
            Choice::Value(quantity) => quantity.span,
            Choice::Range(range) => range.span,
            Choice::Point(point) => point.span,
            Choice::Text(text) => text.span,
        }
    }
}

/// What a test is expected to come to.
#[derive(Debug)]
pub(crate) enum Expectation {
    Metric {
        metric: Name,
        bound: Bound,
    },
    /// It satisfies this requirement.
    Requirement(Name),
}
