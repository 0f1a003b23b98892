//! Conditions for tests: short ways to write them, and random ones.

use proptest::prelude::*;

use sesame_plan::MetricId;
use sesame_plan::condition::{Comparison, Condition, Operand};

/// A comparison of two operands.
pub fn compare(left: Operand, by: Comparison, right: Operand) -> Condition {
    Condition::Compare { left, by, right }
}

/// The metric of a position.
pub fn variable(metric: u32) -> Operand {
    Operand::Variable(MetricId(metric))
}

/// A metric above a number.
pub fn above(metric: u32, number: f64) -> Condition {
    compare(variable(metric), Comparison::Above, Operand::Number(number))
}

/// A metric below a number.
pub fn below(metric: u32, number: f64) -> Condition {
    compare(variable(metric), Comparison::Below, Operand::Number(number))
}

/// Both.
pub fn and(a: Condition, b: Condition) -> Condition {
    Condition::And(Box::new(a), Box::new(b))
}

/// One of two, or both.
pub fn or(a: Condition, b: Condition) -> Condition {
    Condition::Or(Box::new(a), Box::new(b))
}

/// Conditions of up to four levels over the first `metrics` metrics and small whole numbers.
pub fn any_condition(metrics: u32) -> impl Strategy<Value = Condition> {
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
