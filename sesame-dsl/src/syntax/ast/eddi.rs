//! Runtime monitors.

use super::formula::Expression;
use super::words::{Count, Head, Name, Path, Quantity, Text};
use crate::span::Span;

/// A runtime monitor.
#[derive(Debug)]
pub(crate) struct Eddi {
    pub(crate) head: Head,
    pub(crate) publishes: Name,
    pub(crate) demands: Vec<Demand>,
    pub(crate) evidence: Vec<Evidence>,
    pub(crate) guarantees: Vec<Guarantee>,
    pub(crate) otherwise: Vec<(Span, Otherwise)>,
    pub(crate) has_errors: bool,
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
    /// When it is stale, and whether it is unknown then; false otherwise.
    pub(crate) stale: Vec<(Span, (Quantity, bool))>,
}

#[derive(Debug)]
pub(crate) struct Guarantee {
    pub(crate) head: Head,
    pub(crate) integrity: Count,
    pub(crate) gate: Expression,
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
