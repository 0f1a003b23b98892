//! What a campaign does to cover more cells, how it confirms what it finds, and when it has done enough.

use super::words::{Count, Name, Quantity, Range};
use crate::span::Span;

#[derive(Debug, Clone)]
pub(crate) struct Coverage {
    pub(crate) span: Span,
    pub(crate) axes: Vec<CoverageAxis>,
    pub(crate) hits: Vec<(Span, Count)>,
    pub(crate) stops: Vec<(Span, Quantity)>,
    pub(crate) failsafes: Vec<(Span, Count)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug, Clone)]
pub(crate) struct CoverageAxis {
    pub(crate) dimension: Name,
    pub(crate) range: Range,
    pub(crate) cells: Count,
}

/// `boost fixed { … }`, `boost linear { … }`, `construct { … }`, `predict { … }` or `novelty { … }`, with the settings
/// as written.
#[derive(Debug, Clone)]
pub(crate) struct Exploration {
    pub(crate) span: Span,
    pub(crate) kind: ExplorationKind,
    pub(crate) generations: Vec<(Span, Count)>,
    pub(crate) iterations: Vec<(Span, Count)>,
    pub(crate) tries: Vec<(Span, Count)>,
    /// How many children at the beginning, and at the end.
    pub(crate) children: Vec<(Span, [Count; 2])>,
    pub(crate) drops: Vec<(Span, Count)>,
    pub(crate) shares: Vec<(Span, Quantity)>,
    pub(crate) untils: Vec<(Span, Quantity)>,
    pub(crate) candidates: Vec<(Span, Count)>,
    pub(crate) neighbours: Vec<(Span, Count)>,
    /// Dimensions.
    pub(crate) overs: Vec<(Span, Vec<Name>)>,
    pub(crate) has_errors: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExplorationKind {
    BoostFixed,
    BoostLinear,
    Construct,
    Predict,
    Novelty,
}

/// `confirm 5 times { … }` with its settings as written.
#[derive(Debug, Clone)]
pub(crate) struct Confirm {
    pub(crate) span: Span,
    pub(crate) times: Count,
    pub(crate) by: Vec<(Span, Typical)>,
    /// Where `violations` is written.
    pub(crate) violations: Vec<(Span, ())>,
}

/// What the values of several runs are taken for.
#[derive(Debug, Clone)]
pub(crate) enum Typical {
    Mean,
    Median,
    Quantile(Quantity),
}

/// `stop { … }` with its rules as written.
#[derive(Debug, Clone)]
pub(crate) struct Stop {
    pub(crate) span: Span,
    pub(crate) times: Vec<(Span, Quantity)>,
    pub(crate) stagnations: Vec<(Span, (Count, Quantity))>,
    pub(crate) discoveries: Vec<(Span, Quantity)>,
    pub(crate) completenesses: Vec<(Span, Quantity)>,
    pub(crate) causes: Vec<(Span, Count)>,
    pub(crate) pairs: Vec<(Span, ())>,
    pub(crate) has_errors: bool,
}
