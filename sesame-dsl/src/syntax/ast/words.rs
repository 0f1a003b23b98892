//! Names, texts, numbers with their units, and bounds: what all constructs are made of.

use crate::span::Span;

/// A name, where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// The head of a declaration.
#[derive(Debug, Clone)]
pub(crate) struct Head {
    pub(crate) name: Name,
    pub(crate) doc: String,
    /// All of the declaration but its doc comment.
    pub(crate) full_span: Span,
}

/// A quoted text without its quotes and escapes; the span includes the quotes.
#[derive(Debug, Clone)]
pub(crate) struct Text {
    pub(crate) text: String,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct UnitName {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// A number with its sign and unit.
#[derive(Debug, Clone)]
pub(crate) struct Quantity {
    /// Finite, or NaN for one whose digits were already reported.
    pub(crate) value: f64,
    pub(crate) unit: Option<UnitName>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct Range {
    pub(crate) low: Quantity,
    pub(crate) high: Quantity,
    pub(crate) span: Span,
}

/// A whole number as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count {
    /// `None` for one that was already reported.
    pub(crate) value: Option<u64>,
    pub(crate) span: Span,
}

/// Three numbers of one unit.
#[derive(Debug)]
pub(crate) struct Point {
    /// Each with the point's unit.
    pub(crate) coordinates: [Quantity; 3],
    pub(crate) span: Span,
}

/// A topic, and fields of its message.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub(crate) topic: Name,
    pub(crate) fields: Vec<Name>,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) enum Bound {
    Compare(Comparison, Quantity),
    Within(Range),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Comparison {
    AtMost,
    Below,
    AtLeast,
    Above,
    Equal,
}
