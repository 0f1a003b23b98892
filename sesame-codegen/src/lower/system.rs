//! Messages, topics and nodes, from the model to the plan.

use sesame_dsl::model::{self, Id as _};
use sesame_dsl::units::Unit;
use sesame_plan as plan;

use super::id::{raw, topic_id};

pub(super) fn message(message: &model::Message) -> plan::MessageType {
    let fields = message.fields.iter().map(|field| plan::Field {
        name: field.declaration.name.clone(),
        doc: field.declaration.doc.clone(),
        ty: ty(&field.ty),
    });
    plan::MessageType {
        name: message.declaration.name.clone(),
        doc: message.declaration.doc.clone(),
        fields: fields.collect(),
    }
}

fn ty(of: &model::Type) -> plan::Type {
    match of {
        model::Type::Bool => plan::Type::Bool,
        model::Type::Int(it) => plan::Type::Int { unit: unit(it.as_ref()) },
        model::Type::Real(it) => plan::Type::Real { unit: unit(it.as_ref()) },
        model::Type::Text => plan::Type::Text,
        model::Type::Point(it) => plan::Type::Point { unit: unit(it.as_ref()) },
        model::Type::List(of) => plan::Type::List { of: Box::new(ty(of)) },
        model::Type::Message(id) => plan::Type::Message { id: plan::MessageId(raw(id.index())) },
    }
}

pub(super) fn topic(topic: &model::Topic) -> plan::Topic {
    plan::Topic {
        name: topic.declaration.name.clone(),
        doc: topic.declaration.doc.clone(),
        paths: topic.paths.clone(),
        ty: ty(&topic.ty),
    }
}

pub(super) fn node(node: &model::Node) -> plan::Node {
    plan::Node {
        name: node.declaration.name.clone(),
        doc: node.declaration.doc.clone(),
        publishes: node.publishes.iter().map(|&id| topic_id(id)).collect(),
        subscribes: node.subscribes.iter().map(|&id| topic_id(id)).collect(),
    }
}

pub(super) fn unit(unit: Option<&Unit>) -> Option<String> {
    unit.map(|unit| unit.text().to_owned())
}
