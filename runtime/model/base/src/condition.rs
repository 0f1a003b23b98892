//! Conditions over metrics, which switch operations ([SESAME 2023, §3.9.2]): whether they hold, and whether they are
//! constant.
//!
//! The plan defines them ([`sesame_plan::condition`]); here are the functions over them.

pub mod constant;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

use sesame_plan::MetricId;
use sesame_plan::condition::{Condition, Operand};

/// Whether a condition holds, given the value of each metric at this moment. A comparison with a metric that has no
/// value is false.
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

/// The number of levels of a condition's tree; a single comparison has one.
pub fn depth(condition: &Condition) -> u32 {
    match condition {
        Condition::Compare { .. } => 1,
        Condition::And(a, b) | Condition::Or(a, b) => 1 + depth(a).max(depth(b)),
    }
}

/// Whether a condition contains an operand with this property.
pub fn mentions(condition: &Condition, is_it: &impl Fn(Operand) -> bool) -> bool {
    match condition {
        Condition::Compare { left, right, .. } => is_it(*left) || is_it(*right),
        Condition::And(a, b) | Condition::Or(a, b) => mentions(a, is_it) || mentions(b, is_it),
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::condition::Comparison;

    use super::testing::{above, and, below, compare, or, variable};
    use super::*;

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
        assert!(
            mentions(&condition, &|metric| metric == variable(1))
                && !mentions(&condition, &|metric| metric == variable(2))
        );
    }
}
