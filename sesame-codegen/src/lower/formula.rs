//! Formulas of metrics, from the model to the plan.

use sesame_dsl::model;
use sesame_plan as plan;

use super::id::topic_id;

pub(super) fn field(field: &model::FieldPath) -> plan::FieldRef {
    plan::FieldRef { topic: topic_id(field.topic), path: field.fields.clone() }
}

pub(super) fn formula(formula: &model::Formula) -> plan::Formula {
    plan::Formula {
        inputs: inputs(&formula.inputs),
        aggregate: formula.aggregate.clone(),
        when: formula.when.clone(),
        every: formula.every,
        per: formula.per.as_ref().map(field),
        side: side(formula.outbound),
    }
}

pub(super) fn inputs(inputs: &[model::Input]) -> Vec<plan::Input> {
    let inputs = inputs.iter().map(|input| plan::Input {
        field: field(&input.field),
        members: input.members,
        text: input.text.clone(),
    });
    inputs.collect()
}

pub(super) fn side(outbound: bool) -> plan::Side {
    if outbound { plan::Side::Outbound } else { plan::Side::Inbound }
}
