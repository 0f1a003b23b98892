//! Physical labs, and how tests are chosen for them.

use sesame_grammar::Rule;

use super::operation::{Amounts, Target};
use super::system::Simulator;
use super::words::{Bound, Count, Head, Name, Point, Quantity, Range, Text};
use crate::span::Span;

/// A lab, and how tests are chosen for it.
#[derive(Debug)]
pub(crate) struct Physical {
    pub(crate) head: Head,
    pub(crate) simulators: Vec<(Span, Simulator)>,
    pub(crate) repeats: Vec<(Span, Count)>,
    /// What a test costs, and what each of its operations costs besides.
    pub(crate) costs: Vec<(Span, (Quantity, Option<Quantity>))>,
    pub(crate) excludes: Vec<(Name, Bound)>,
    /// Metrics, with which of their values come first.
    pub(crate) ranks: Vec<(Span, Vec<(Name, RankOrder)>)>,
    pub(crate) budgets: Vec<(Span, Budget)>,
    pub(crate) tolerances: Vec<(Span, Vec<(Name, Quantity)>)>,
    pub(crate) interlocks: Vec<(Span, Vec<Name>)>,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) fits: Vec<(Span, Vec<Fit>)>,
    pub(crate) has_errors: bool,
}

/// Which values come first.
#[derive(Debug)]
pub(crate) enum RankOrder {
    Ascending,
    Descending,
    ClosestTo(Quantity),
}

#[derive(Debug)]
pub(crate) struct Budget {
    pub(crate) limit: Quantity,
    pub(crate) lambda: Quantity,
    pub(crate) over: Vec<Name>,
}

#[derive(Debug)]
pub(crate) struct Shape {
    pub(crate) head: Head,
    pub(crate) form: Form,
    pub(crate) place: ShapePlace,
    pub(crate) expand: Option<Quantity>,
}

#[derive(Debug)]
pub(crate) enum Form {
    Sphere(Quantity),
    Box(Point),
}

#[derive(Debug)]
pub(crate) enum ShapePlace {
    Carried(Text),
    Fixed(Point),
}

#[derive(Debug)]
pub(crate) enum Fit {
    Delay(Vec<Target>, Range),
    /// As an operation of this rule.
    Relay {
        rule: Rule,
        targets: Vec<Target>,
        amounts: Amounts,
    },
    Parameter(Text, Range),
}
