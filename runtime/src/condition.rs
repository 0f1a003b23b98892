//! Conditions over metrics, which switch operations on and off (paper §3.9.2): whether they hold, whether their truth can
//! change at all, and how they are written.
//!
//! The plan has their shape ([`sesame_plan::condition`]); here is what can be done with them without a search.

pub mod constant;
pub mod text;

use sesame_plan::MetricId;
use sesame_plan::condition::{Condition, Operand};

/// Whether a condition holds, given the value of each metric at this moment. A comparison with a metric that has no value
/// does not hold, and `and` and `or` go on with that.
pub fn holds(condition: &Condition, value: &impl Fn(MetricId) -> Option<f64>) -> bool {
    match condition {
        Condition::Compare { left, by, right } => {
            let number = |operand: &Operand| match *operand {
                Operand::Variable(metric) => value(metric),
                Operand::Number(number) => Some(number),
            };
            matches!((number(left), number(right)), (Some(left), Some(right)) if by.holds(left, right))
        }
        Condition::And(a, b) => holds(a, value) && holds(b, value),
        Condition::Or(a, b) => holds(a, value) || holds(b, value),
    }
}

/// Levels of a condition's tree; a comparison alone is one.
pub fn depth(condition: &Condition) -> u32 {
    match condition {
        Condition::Compare { .. } => 1,
        Condition::And(a, b) | Condition::Or(a, b) => 1 + depth(a).max(depth(b)),
    }
}

/// Whether an operand with some property occurs in a condition.
pub fn mentions(condition: &Condition, is_it: &impl Fn(Operand) -> bool) -> bool {
    match condition {
        Condition::Compare { left, right, .. } => is_it(*left) || is_it(*right),
        Condition::And(a, b) | Condition::Or(a, b) => mentions(a, is_it) || mentions(b, is_it),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;
    use sesame_plan::condition::Comparison;

    use super::*;

    /// A comparison of two operands.
    pub(crate) fn compare(left: Operand, by: Comparison, right: Operand) -> Condition {
        Condition::Compare { left, by, right }
    }

    /// The metric of a position.
    pub(crate) fn variable(metric: u32) -> Operand {
        Operand::Variable(MetricId(metric))
    }

    /// A metric above a number.
    pub(crate) fn above(metric: u32, number: f64) -> Condition {
        compare(variable(metric), Comparison::Above, Operand::Number(number))
    }

    /// A metric below a number.
    pub(crate) fn below(metric: u32, number: f64) -> Condition {
        compare(variable(metric), Comparison::Below, Operand::Number(number))
    }

    pub(crate) fn and(a: Condition, b: Condition) -> Condition {
        Condition::And(Box::new(a), Box::new(b))
    }

    pub(crate) fn or(a: Condition, b: Condition) -> Condition {
        Condition::Or(Box::new(a), Box::new(b))
    }

    /// Conditions of up to four levels over the first `metrics` metrics and small whole numbers.
    pub(crate) fn any_condition(metrics: u32) -> impl Strategy<Value = Condition> {
        let by = || prop::sample::select(vec![Comparison::Below, Comparison::Above, Comparison::Equal]);
        let number = || (0i32..6).prop_map(|n| Operand::Number(f64::from(n)));
        let variable = move || (0..metrics).prop_map(variable);
        let leaf = prop_oneof![
            2 => (variable(), by(), number()),
            1 => (number(), by(), variable()),
            1 => (variable(), by(), variable()),
        ]
        .prop_map(|(left, by, right)| compare(left, by, right));
        leaf.prop_recursive(3, 8, 2, |inner| {
            (inner.clone(), inner, any::<bool>()).prop_map(|(a, b, both)| if both { and(a, b) } else { or(a, b) })
        })
    }

    #[test]
    fn a_comparison_without_a_value_is_false_and_the_rest_goes_on() {
        let value = |metric: MetricId| (metric.0 == 0).then_some(3.0);
        assert!(holds(&above(0, 2.0), &value) && !holds(&below(0, 3.0), &value));
        assert!(!holds(&above(1, 2.0), &value) && !holds(&below(1, 2.0), &value));
        assert!(!holds(&compare(variable(1), Comparison::Equal, variable(1)), &value));
        assert!(holds(&or(above(1, 2.0), above(0, 2.0)), &value));
        assert!(!holds(&and(above(1, 2.0), above(0, 2.0)), &value));
    }

    #[test]
    fn a_comparison_is_one_level() {
        let condition = and(above(0, 1.0), or(above(1, 1.0), and(below(0, 1.0), below(1, 1.0))));
        assert_eq!((depth(&above(0, 1.0)), depth(&condition)), (1, 4));
        assert!(mentions(&condition, &|it| it == variable(1)) && !mentions(&condition, &|it| it == variable(2)));
    }
}
