//! Operations with their parameters, from the model to the plan.

use sesame_dsl::model::{self, Space};
use sesame_plan as plan;

use super::id::{node_id, topic_id};
use super::system::unit;
use crate::plan::{Called, Offline, OperationPlan};

pub(super) fn operation(
    operation: &model::Operation,
    end_after: f64,
    constraints: Vec<plan::condition::Constraint>,
) -> plan::Operation {
    let mut targets = operation.targets.iter().map(|target| plan::Target {
        topic: topic_id(target.topic),
        members: target.members.clone(),
        places: target.places.clone(),
    });
    let first = targets.next();
    plan::Operation {
        name: operation.declaration.name.clone(),
        doc: operation.declaration.doc.clone(),
        topic: first.as_ref().map(|first| first.topic),
        members: first.as_ref().map_or_else(|| operation.nodes.clone(), |first| first.members.clone()),
        from: operation.from.iter().map(|&id| node_id(id)).collect(),
        to: operation.to.iter().map(|&id| node_id(id)).collect(),
        places: first.map_or_else(Vec::new, |first| first.places),
        further: targets.collect(),
        kind: operation.kind.clone(),
        parameters: operation.parameters.iter().map(parameter).collect(),
        within: within(operation, end_after),
        lengths: operation.lengths.map(|lengths| plan::Lengths { low: lengths.low, high: lengths.high }),
        priority: operation.priority,
        inclusion: operation.inclusion,
        timed: operation.timed,
        counted: operation.counted.clone(),
        wrapped: operation.wrapped,
        constraints,
    }
}

fn parameter(parameter: &model::Parameter) -> plan::Parameter {
    plan::Parameter {
        name: parameter.name.clone(),
        unit: unit(parameter.unit.as_ref()),
        domain: match &parameter.domain {
            model::Domain::Number { range, shape, integer } => {
                plan::Domain::Number { low: range.low, high: range.high, shape: *shape, integer: *integer }
            }
            model::Domain::Point { low, high } => plan::Domain::Point { low: *low, high: *high },
            model::Domain::Texts(texts) => plan::Domain::Texts { texts: texts.clone() },
            model::Domain::Files(files) => plan::Domain::Files { files: files.clone() },
        },
    }
}

/// The window of an operation; one without `within` may be active during the whole test.
pub(super) fn within(operation: &model::Operation, end_after: f64) -> plan::Span {
    match operation.within {
        Some(window) => plan::Span { start: window.low, end: window.high },
        None => plan::Span { start: 0.0, end: end_after },
    }
}

pub(super) fn custom_operations(space: &Space) -> Vec<OperationPlan> {
    let operations = space.operations.values().filter_map(|operation| match &operation.kind {
        model::OperationKind::Custom { moment } => Some(OperationPlan {
            operation: operation.declaration.name.clone(),
            doc: operation.declaration.doc.clone(),
            source: space.file_of(&operation.declaration).to_owned(),
            line: operation.declaration.line,
            called: match (moment, operation.topics().next()) {
                (plan::Moment::BeforeStart, _) => Called::Offline(Offline::BeforeStart),
                (plan::Moment::AfterEnd, _) => Called::Offline(Offline::AfterEnd),
                (plan::Moment::OnMessage, Some(topic)) => Called::OnMessage(topic_id(topic)),
                (plan::Moment::OnMessage, None) => unreachable!("an operation that is called on messages has a topic"),
            },
            parameters: operation
                .parameters
                .iter()
                // Counted messages are counted before the code is called.
                .filter(|declared| operation.counted.iter().all(|counted| counted.name() != declared.name))
                .map(|declared| (parameter(declared), declared.doc.clone()))
                .collect(),
        }),
        _ => None,
    });
    operations.collect()
}
