//! Conditions that switch operations on and off (paper §3.9.2, Table 1), and what a campaign grows them from.

pub use sesame_plan::condition::{Comparison, Integers};

use super::ids::MetricId;

/// A condition over metrics, at most [`Condition::MAX_DEPTH`] levels deep.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// A comparison; at least one side is a variable, and which way it goes is not known beforehand.
    Compare {
        /// The left side.
        left: Operand,
        /// How the sides are compared.
        by: Comparison,
        /// The right side.
        right: Operand,
    },
    /// Both hold.
    And(Box<Condition>, Box<Condition>),
    /// At least one of them holds.
    Or(Box<Condition>, Box<Condition>),
}

impl Condition {
    /// The most levels of a condition. A plan is JSON, whose readers limit its depth.
    pub const MAX_DEPTH: usize = 40;

    /// How many levels its tree has: a comparison alone is one.
    pub fn depth(&self) -> usize {
        match self {
            Condition::Compare { .. } => 1,
            Condition::And(left, right) | Condition::Or(left, right) => 1 + left.depth().max(right.depth()),
        }
    }

    /// Appends the metrics that it compares, from left to right.
    pub fn metrics_into(&self, found: &mut Vec<MetricId>) {
        match self {
            Condition::Compare { left, right, .. } => {
                for operand in [left, right] {
                    if let Operand::Variable(metric) = operand {
                        found.push(*metric);
                    }
                }
            }
            Condition::And(left, right) | Condition::Or(left, right) => {
                left.metrics_into(found);
                right.metrics_into(found);
            }
        }
    }
}

/// One side of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operand {
    /// The value of a metric at that moment, in its unit.
    Variable(MetricId),
    /// A number in the unit of the variable it is compared with; finite.
    Number(f64),
}

/// Between what a number is known to lie, both ends included; infinite where nothing is known. `low <= high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// The least it can be.
    pub low: f64,
    /// The greatest it can be.
    pub high: f64,
}

impl ValueRange {
    /// Nothing is known.
    pub const NOTHING: ValueRange = ValueRange { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// It is this number.
    pub fn exactly(number: f64) -> ValueRange {
        ValueRange { low: number, high: number }
    }

    /// Which way a comparison always goes, if it goes one way for all numbers that the two sides can be.
    pub fn outcome(self, by: Comparison, other: ValueRange) -> Option<bool> {
        match by {
            Comparison::Below if self.high < other.low => Some(true),
            Comparison::Below if self.low >= other.high => Some(false),
            Comparison::Above => other.outcome(Comparison::Below, self),
            Comparison::Equal if self.high < other.low || other.high < self.low => Some(false),
            // Where they meet and one is not a single number, another choice makes them differ.
            Comparison::Equal if self.low == self.high && other.low == other.high => Some(true),
            Comparison::Below | Comparison::Equal => None,
        }
    }

    /// Whether some whole number of these makes a comparison with it that may go both ways.
    pub fn meets(self, integers: Integers) -> bool {
        // The ends are whole numbers of at most 2^53, so they are exact.
        let [lowest, highest] = [integers.lowest as f64, integers.highest as f64];
        self.low < self.high && lowest.max(self.low.ceil()) <= highest.min(self.high.floor())
    }
}

/// What a search grows conditions from.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionSpace {
    /// The variables, in written order; at least one, each once.
    pub variables: Vec<Variable>,
    /// The most levels of a condition's tree, 1 to [`ConditionSpace::MAX_DEPTH`]: a comparison alone is one. Default
    /// [`ConditionSpace::DEFAULT_DEPTH`].
    pub depth: u32,
    /// The whole numbers that variables are compared with. Default [`ConditionSpace::DEFAULT_INTEGERS`].
    pub integers: Integers,
    /// How long activations last, in seconds, `0 < low <= high`; `None` for activations that a condition ends.
    pub lengths: Option<super::metrics::Range>,
    /// How often an operation may be activated in one run: at least 1, the default.
    pub times: u32,
}

impl ConditionSpace {
    /// The most levels that a campaign may permit.
    pub const MAX_DEPTH: u32 = sesame_plan::condition::ConditionSpace::MOST_DEPTH;
    /// The levels of a campaign that says nothing of them.
    pub const DEFAULT_DEPTH: u32 = 4;
    /// The whole numbers of a campaign that says nothing of them.
    pub const DEFAULT_INTEGERS: Integers = Integers { lowest: 1, highest: 20 };
}

/// A condition variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable {
    /// The metric it gets its values from.
    pub metric: MetricId,
    /// Between what it lies, in the metric's unit.
    pub known: ValueRange,
    /// How far apart the numbers are that it is compared with, all over what is known of it, which is finite then;
    /// positive. `None` for the whole numbers of the space.
    pub step: Option<f64>,
}

/// What the start condition of an operation has to contain wherever a search grows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// A comparison of this variable.
    Variable(MetricId),
    /// A comparison with one of these whole numbers.
    Integer(Integers),
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn holds(left: i64, by: Comparison, right: i64) -> bool {
        match by {
            Comparison::Below => left < right,
            Comparison::Above => left > right,
            Comparison::Equal => left == right,
        }
    }

    fn comparison() -> impl Strategy<Value = Comparison> {
        prop_oneof![Just(Comparison::Below), Just(Comparison::Above), Just(Comparison::Equal)]
    }

    /// A small range of whole numbers, in which trying each number out is exact: a comparison that goes both ways for
    /// numbers between whole ones does so for whole ones as well, unless the range is one number.
    fn small() -> impl Strategy<Value = Integers> {
        (-4i64..4, 0i64..5).prop_map(|(lowest, width)| Integers { lowest, highest: lowest + width })
    }

    fn known(integers: Integers) -> ValueRange {
        ValueRange { low: integers.lowest as f64, high: integers.highest as f64 }
    }

    proptest! {
        #[test]
        fn an_outcome_is_known_exactly_when_trying_all_numbers_gives_one(
            left in small(), by in comparison(), right in small(),
        ) {
            let tried: std::collections::BTreeSet<bool> = (left.lowest..=left.highest)
                .flat_map(|l| (right.lowest..=right.highest).map(move |r| holds(l, by, r)))
                .collect();
            let only = if tried.len() == 1 { tried.first().copied() } else { None };
            prop_assert_eq!(known(left).outcome(by, known(right)), only);
        }

        #[test]
        fn a_variable_meets_integers_exactly_when_a_comparison_with_one_goes_both_ways(
            variable in small(), integers in small(),
        ) {
            let open = (integers.lowest..=integers.highest).any(|integer| {
                [Comparison::Below, Comparison::Above, Comparison::Equal]
                    .iter()
                    .any(|&by| known(variable).outcome(by, ValueRange::exactly(integer as f64)).is_none())
            });
            prop_assert_eq!(known(variable).meets(integers), open);
        }
    }

    #[test]
    fn nothing_is_known_of_a_comparison_without_ranges() {
        let nine = ValueRange::exactly(9.0);
        assert_eq!(ValueRange::NOTHING.outcome(Comparison::Below, nine), None);
        assert_eq!(ValueRange::NOTHING.outcome(Comparison::Equal, ValueRange::NOTHING), None);
        assert_eq!(nine.outcome(Comparison::Equal, nine), Some(true));
        assert_eq!(
            ValueRange { low: 0.0, high: f64::INFINITY }.outcome(Comparison::Above, ValueRange::exactly(-1.0)),
            Some(true)
        );
    }
}
