//! Formulas of metrics, and the conditions that switch operations.

use super::words::{Comparison, Count, Name, Path, Point, Quantity, Range, Text};
use crate::span::Span;

/// What a declarative metric is computed from, with its clauses as written.
#[derive(Debug)]
pub(crate) struct Formula {
    pub(crate) kind: FormulaKind,
    pub(crate) when: Vec<(Span, Expression)>,
    pub(crate) every: Vec<(Span, Quantity)>,
    pub(crate) per: Vec<(Span, Path)>,
    pub(crate) outbound: Vec<Span>,
    /// `whole windows`.
    pub(crate) whole: Vec<Span>,
    /// How long after the beginning of an alarm a hazard counts.
    pub(crate) within: Vec<(Span, Quantity)>,
}

#[derive(Debug)]
pub(crate) enum FormulaKind {
    /// `when condition then value`.
    WhenThen(Expression, Expression),
    /// An aggregate, if it is in order.
    Plain(Expression),
}

/// A number, a point or a condition: which, is for resolution to find out. Chains are flat, so that its depth is that
/// of its parentheses.
#[derive(Debug)]
pub(crate) struct Expression {
    pub(crate) kind: ExpressionKind,
    pub(crate) span: Span,
    /// Stands in parentheses, which are part of its span.
    pub(crate) parenthesised: bool,
}

#[derive(Debug)]
pub(crate) enum ExpressionKind {
    Number(Quantity),
    Truth(bool),
    Text(Text),
    Field(Path),
    /// `max of zones.level`; the span is that of the words before `of`.
    Members(Members, Span, Path),
    Point(Box<Point>),
    Region(Region),
    Negate(Box<Expression>),
    /// Two terms or more; true for one that is subtracted.
    Sum(Vec<(bool, Expression)>),
    /// Two factors or more; true for one that divides.
    Product(Vec<(bool, Expression)>),
    Compare(Box<Expression>, Relation, Box<Expression>),
    /// One word or more before it, the outermost first.
    Prefixed(Vec<Prefix>, Box<Expression>),
    Until(Box<Expression>, Until, Box<Expression>),
    All(Vec<Expression>),
    Any(Vec<Expression>),
    /// `2 of (…)`.
    AtLeast(Count, Vec<Expression>),
    Implies(Box<Expression>, Box<Expression>),
    Call(Name, Vec<Expression>),
}

/// How two values of a formula compare: as those of a bound do, or by being different.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Relation {
    Comparison(Comparison),
    NotEqual,
}

/// A word before a condition.
#[derive(Debug)]
pub(crate) struct Prefix {
    pub(crate) word: PrefixWord,
    pub(crate) span: Span,
    pub(crate) interval: Option<Range>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PrefixWord {
    Not,
    Always,
    Eventually,
}

/// The word between two sides, and its interval.
#[derive(Debug)]
pub(crate) struct Until {
    /// With the word before it.
    pub(crate) span: Span,
    /// Whether the left side may hold to the end instead.
    pub(crate) weak: bool,
    pub(crate) interval: Option<Range>,
}

/// What the values of a list, or those of a group's topics, are reduced to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Members {
    Min,
    Max,
    Sum,
    Mean,
    Count,
    Length,
    Each,
    EachPair,
}

/// A part of space, given by its corners.
#[derive(Debug)]
pub(crate) struct Region {
    pub(crate) kind: RegionKind,
    /// At least one.
    pub(crate) corners: Vec<Corner>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RegionKind {
    Box,
    Polygon,
}

/// Numbers of one unit.
#[derive(Debug)]
pub(crate) struct Corner {
    /// At least one, each with the region's unit.
    pub(crate) coordinates: Vec<Quantity>,
    pub(crate) span: Span,
}
