//! What is measured, and what must hold of it.

use sesame_plan::{Bound, Direction, Score, Trend};

use super::declaration::Declaration;
use super::formula::Formula;
use super::ids::{EddiId, MetricId, TopicId};
use super::system::FieldPath;
use super::temporal::Robustness;
use crate::units::Unit;

/// A number computed from the messages of a test.
#[derive(Debug, Clone, PartialEq)]
pub struct Metric {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The unit of its value; `None` for a plain number.
    pub unit: Option<Unit>,
    /// Which way an objective on it goes; a metric that is an objective of some campaign has one.
    pub direction: Option<Direction>,
    /// The value of a test in which it was never set, in its unit.
    pub default: Option<f64>,
    /// Its value for conditions before it is first set, in its unit; `None` when it is unknown then.
    pub initial: Option<f64>,
    /// The only way in which its hook says that its value changes during a run; none of a formula, whose kind says it.
    pub trend: Option<Trend>,
    /// Whether infinity and NaN are ordinary values of what its hook reads.
    pub accepts_not_finite: bool,
    /// Where its value comes from.
    pub source: MetricSource,
}

impl Metric {
    /// Whether nobody declared it: whether a part of a monitor holds, named by both with a dot between them.
    pub fn is_of_part(&self) -> bool {
        self.declaration.name.contains('.')
    }
}

/// Where a metric's value comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MetricSource {
    /// The user's Rust code, called with each message of these topics; at least one, each once.
    Hook(Vec<TopicId>),
    /// `fuzzing_time()`: the sum over operations of observed active time, in seconds.
    FuzzingTime,
    /// `last(…)` of one field of one topic, as published: the last value received.
    Last(FieldPath),
    /// By how much a temporal formula is kept: its robustness over the whole test.
    Robustness(Robustness),
    /// What there is to say of a monitor. The requirement of a score is a position in [`super::Space::requirements`].
    Monitor(EddiId, Score),
    /// Any other formula.
    Formula(Formula),
}

/// What must hold in every test.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its sentence.
    pub text: String,
    /// The metric it bounds.
    pub metric: MetricId,
    /// The bound, in the metric's unit.
    pub bound: Bound,
}

/// A range of numbers, `low <= high`, both ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Range {
    /// Whether all of another range lies in this one.
    pub fn contains(self, other: Range) -> bool {
        self.low <= other.low && other.high <= self.high
    }
}
