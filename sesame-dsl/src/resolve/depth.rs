//! How deep formulas are nested.

use crate::model::{Aggregate, Condition, Expression};

/// How many conditions and expressions of an aggregate are inside of each other.
pub(super) fn of_aggregate(aggregate: &Aggregate) -> usize {
    match aggregate {
        Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
            of_expression(of)
        }
        Aggregate::Count { of } | Aggregate::Duration { of } => of_condition(of),
    }
}

/// How many expressions are inside of each other, this one included.
pub(super) fn of_expression(expression: &Expression) -> usize {
    1 + expression.parts().into_iter().map(of_expression).max().unwrap_or(0)
}

/// How many conditions and expressions are inside of each other, this one included.
pub(super) fn of_condition(condition: &Condition) -> usize {
    1 + match condition {
        Condition::Constant(_) | Condition::Input(_) => 0,
        Condition::Compare { left, right, .. } => of_expression(left).max(of_expression(right)),
        Condition::Not(of) => of_condition(of),
        Condition::Same { left, right } => of_condition(left).max(of_condition(right)),
        Condition::All(of) | Condition::Any(of) => of.iter().map(of_condition).max().unwrap_or(0),
    }
}
