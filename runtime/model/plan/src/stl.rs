//! Formulas of signal temporal logic over the input signals of a metric.
//!
//! Only what they are; what they mean, down to jumps and the end of a trace, is defined in the runtime's room `stl`.

use serde::{Deserialize, Serialize};

use crate::{Comparison, Expression, Input, Side};

/// By how much a run keeps a formula (positive) or breaks it (negative).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Robustness {
    /// What the signals refer to by position; at least one. Those that are [`crate::Members::Each`] are all of groups
    /// of one size: then the formula is that of each member, with those at the same position of the other groups.
    /// Those that are of pairs are all of one group: then it is that of each pair. The least robustness counts.
    pub inputs: Vec<Input>,
    /// The signals of the formula, all in one unit; each refers to an input or to the time.
    pub signals: Vec<Expression>,
    /// What is to hold.
    pub formula: Formula,
    /// Where it listens.
    pub side: Side,
    /// Whether only windows of operators count that lie in the run as a whole; otherwise the end of the run cuts them.
    /// Default false, and then not written.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub whole_windows: bool,
}

/// A formula. Guarantees of a plan written by the generator: signals are in range, constants are finite, intervals
/// are sound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Formula {
    /// A signal compared with a constant.
    Predicate {
        /// Position in the metric's list of input signals.
        signal: u32,
        /// How they compare, the signal on the left.
        comparison: Comparison,
        /// The constant, in the signal's unit; finite.
        constant: f64,
    },
    /// It does not hold.
    Not {
        /// What does not.
        of: Box<Formula>,
    },
    /// Both hold.
    And {
        /// One.
        left: Box<Formula>,
        /// The other.
        right: Box<Formula>,
    },
    /// At least one holds.
    Or {
        /// One.
        left: Box<Formula>,
        /// The other.
        right: Box<Formula>,
    },
    /// The right one holds, or the left one does not.
    Implies {
        /// The premise.
        left: Box<Formula>,
        /// The conclusion.
        right: Box<Formula>,
    },
    /// It holds all through the interval.
    Always {
        /// From now.
        interval: Interval,
        /// What holds.
        of: Box<Formula>,
    },
    /// It holds at some time in the interval.
    Eventually {
        /// From now.
        interval: Interval,
        /// What holds.
        of: Box<Formula>,
    },
    /// The right one holds at some time in the interval, and the left one from now up to that time, both included.
    Until {
        /// From now.
        interval: Interval,
        /// Whether it is also enough that the left one holds from now to the end of the interval. Default false, and
        /// then not written.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        weak: bool,
        /// What holds until then.
        left: Box<Formula>,
        /// What then holds.
        right: Box<Formula>,
    },
}

/// A stretch of time counted from the time at which a formula is evaluated, in seconds; both ends belong to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Where it begins; finite and at least 0.
    pub from: f64,
    /// Where it ends, finite and at least `from`; `None` for an interval without end.
    pub to: Option<f64>,
}

impl Interval {
    /// From now on: what an operator without an interval has.
    pub const UNBOUNDED: Interval = Interval { from: 0.0, to: None };
}
