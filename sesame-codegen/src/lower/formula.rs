//! Formulas of metrics, from the model to the plan.

use sesame_dsl::model;
use sesame_plan as plan;

use super::id::{raw, topic_id};

pub(super) fn field(field: &model::FieldPath) -> plan::FieldRef {
    plan::FieldRef { topic: topic_id(field.topic), path: field.fields.clone() }
}

pub(super) fn formula(formula: &model::Formula) -> plan::Formula {
    plan::Formula {
        inputs: inputs(&formula.inputs),
        aggregate: match &formula.aggregate {
            model::Aggregate::Last(of) => plan::Aggregate::Last { of: expression(of) },
            model::Aggregate::Min(of) => plan::Aggregate::Min { of: expression(of) },
            model::Aggregate::Max(of) => plan::Aggregate::Max { of: expression(of) },
            model::Aggregate::Mean(of) => plan::Aggregate::Mean { of: expression(of) },
            model::Aggregate::Count(of) => plan::Aggregate::Count { of: condition(of) },
            model::Aggregate::Duration(of) => plan::Aggregate::Duration { of: condition(of) },
        },
        when: formula.when.as_ref().map(condition),
        every: formula.every,
        per: formula.per.as_ref().map(field),
        side: side(formula.outbound),
    }
}

pub(super) fn inputs(inputs: &[model::Input]) -> Vec<plan::Input> {
    let inputs = inputs.iter().map(|input| plan::Input { field: field(&input.field), members: input.members });
    inputs.collect()
}

pub(super) fn side(outbound: bool) -> plan::Side {
    if outbound { plan::Side::Outbound } else { plan::Side::Inbound }
}

pub(super) fn expression(of: &model::Expression) -> plan::Expression {
    let boxed = |of: &model::Expression| Box::new(expression(of));
    let all = |of: &[model::Expression]| of.iter().map(expression).collect();
    match of {
        model::Expression::Constant(value) => plan::Expression::Constant(*value),
        model::Expression::Input(at) => plan::Expression::Input(raw(*at)),
        model::Expression::Negate(of) => plan::Expression::Negate(boxed(of)),
        model::Expression::Sum(of) => plan::Expression::Sum(all(of)),
        model::Expression::Product(of) => plan::Expression::Product(all(of)),
        model::Expression::Divide(value, by) => plan::Expression::Divide { value: boxed(value), by: boxed(by) },
        model::Expression::Absolute(of) => plan::Expression::Absolute(boxed(of)),
        model::Expression::Min(of) => plan::Expression::Min(all(of)),
        model::Expression::Max(of) => plan::Expression::Max(all(of)),
        model::Expression::Distance(from, to, scale) => {
            plan::Expression::Distance { from: raw(*from), to: raw(*to), scale: *scale }
        }
    }
}

fn condition(of: &model::Condition) -> plan::Condition {
    match of {
        model::Condition::Constant(value) => plan::Condition::Constant(*value),
        model::Condition::Input(at) => plan::Condition::Input(raw(*at)),
        model::Condition::Compare(left, by, right) => {
            plan::Condition::Compare { left: expression(left), by: *by, right: expression(right) }
        }
        model::Condition::Same(left, right) => {
            plan::Condition::Same { left: Box::new(condition(left)), right: Box::new(condition(right)) }
        }
        model::Condition::All(of) => plan::Condition::All(of.iter().map(condition).collect()),
        model::Condition::Not(of) => plan::Condition::Not(Box::new(condition(of))),
        model::Condition::Any(of) => plan::Condition::Any(of.iter().map(condition).collect()),
    }
}
