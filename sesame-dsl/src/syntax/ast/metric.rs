//! Metrics and requirements.

use super::formula::Formula;
use super::system::Type;
use super::words::{Bound, Head, Name, Quantity, Text};
use crate::span::Span;

#[derive(Debug)]
pub(crate) struct Metric {
    pub(crate) head: Head,
    pub(crate) ty: Option<Type>,
    pub(crate) directions: Vec<(Span, Direction)>,
    pub(crate) defaults: Vec<(Span, Quantity)>,
    pub(crate) initials: Vec<(Span, Quantity)>,
    pub(crate) trends: Vec<(Span, Trend)>,
    /// `accepts non_finite`.
    pub(crate) accepts: Vec<Span>,
    pub(crate) source: MetricSource,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Direction {
    Maximise,
    Minimise,
}

/// How the value of a hook's metric changes, as its author says.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Trend {
    Rising,
    Falling,
}

#[derive(Debug)]
pub(crate) enum MetricSource {
    Hook { hooks: Vec<(Span, Vec<Name>)>, has_errors: bool },
    FuzzingTime,
    Formula(Box<Formula>),
}

#[derive(Debug)]
pub(crate) struct Requirement {
    pub(crate) head: Head,
    pub(crate) text: Text,
    pub(crate) metric: Name,
    pub(crate) bound: Bound,
}
