//! Metrics that are the robustness of a formula of signal temporal logic, with units resolved.

use sesame_plan::stl::Interval;
use sesame_plan::{Comparison, Expression};

use super::formula::Input;

/// By how much a test keeps a temporal formula (positive) or breaks it (negative), in the unit of its comparisons.
#[derive(Debug, Clone, PartialEq)]
pub struct Robustness {
    /// What its signals refer to by position; each once, at least one. Those that are `each of` are all of groups with
    /// the same members: then the formula is that of each member. Those that are of pairs are all of one group: then it
    /// is that of each pair. The least counts.
    pub inputs: Vec<Input>,
    /// What its comparisons refer to by position, all in one unit; each has an input or the time.
    pub signals: Vec<Expression>,
    /// What is to hold.
    pub formula: Temporal,
    /// Whether it hears messages after operations, as they are delivered, and not as they were published.
    pub outbound: bool,
    /// Whether what has a window that the end of the run would cut is left out.
    pub whole_windows: bool,
}

/// What holds of signals over time, or does not.
#[derive(Debug, Clone, PartialEq)]
pub enum Temporal {
    /// A signal compared with a constant, which is finite.
    Predicate(usize, Comparison, f64),
    /// It does not hold.
    Not(Box<Temporal>),
    /// All of two or more hold.
    All(Vec<Temporal>),
    /// At least one of two or more holds.
    Any(Vec<Temporal>),
    /// The second holds, or the first does not.
    Implies(Box<Temporal>, Box<Temporal>),
    /// It holds all through the interval.
    Always(Interval, Box<Temporal>),
    /// It holds at some time in the interval.
    Eventually(Interval, Box<Temporal>),
    /// The second holds at some time in the interval, and the first up to that time and at it.
    Until(Interval, Box<Temporal>, Box<Temporal>),
    /// The same, or the first holds to the end of the interval.
    WeakUntil(Interval, Box<Temporal>, Box<Temporal>),
}

impl Temporal {
    /// How many formulas are inside of each other, this one included.
    pub fn depth(&self) -> usize {
        1 + match self {
            Temporal::Predicate(..) => 0,
            Temporal::Not(of) | Temporal::Always(_, of) | Temporal::Eventually(_, of) => of.depth(),
            Temporal::All(of) | Temporal::Any(of) => of.iter().map(Temporal::depth).max().unwrap_or(0),
            Temporal::Implies(left, right) | Temporal::Until(_, left, right) | Temporal::WeakUntil(_, left, right) => {
                left.depth().max(right.depth())
            }
        }
    }
}
