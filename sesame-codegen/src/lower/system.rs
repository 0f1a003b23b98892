//! Messages, topics, nodes and what starts them, from the model to the plan.

use sesame_dsl::interfaces::{Constant, ConstantValue};
use sesame_dsl::model::{self, Id as _, Space};
use sesame_dsl::units::Unit;
use sesame_plan as plan;

use super::id::{raw, topic_id};

pub(super) fn message(message: &model::Message) -> plan::MessageType {
    let fields = message.fields.iter().map(|field| plan::Field {
        optional: field.optional,
        name: field.declaration.name.clone(),
        doc: field.declaration.doc.clone(),
        ty: ty(&field.ty),
    });
    let number = |constant: &Constant| match constant.value {
        ConstantValue::Number(number) => Some(plan::NamedNumber { name: constant.name.clone(), number }),
        ConstantValue::Text(_) => None,
    };
    plan::MessageType {
        constants: message.constants.iter().filter_map(number).collect(),
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

pub(super) fn topic(space: &Space, topic: &model::Topic) -> plan::Topic {
    let interface = match topic.ty {
        model::Type::Message(id) => space.messages[id].interface.clone(),
        _ => None,
    };
    plan::Topic {
        name: topic.declaration.name.clone(),
        doc: topic.declaration.doc.clone(),
        paths: topic.paths.clone(),
        members: topic.members.clone(),
        ty: ty(&topic.ty),
        interface,
        channel: topic.channel,
    }
}

pub(super) fn node(node: &model::Node) -> plan::Node {
    plan::Node {
        name: node.declaration.name.clone(),
        doc: node.declaration.doc.clone(),
        publishes: node.publishes.iter().map(topic_members).collect(),
        subscribes: node.subscribes.iter().map(topic_members).collect(),
        named: node.named.clone(),
        launch: node.launch.as_ref().map(launch),
        answers: node
            .answers
            .iter()
            .map(|&(to, with)| plan::Answer { to: topic_id(to), with: topic_id(with) })
            .collect(),
        every_step: node.every_step.iter().map(|&id| topic_id(id)).collect(),
    }
}

fn topic_members(of: &model::TopicMembers) -> plan::TopicMembers {
    let topic = topic_id(of.topic);
    match &of.members {
        None => plan::TopicMembers::All(topic),
        Some(members) => plan::TopicMembers::Only { topic, members: members.clone() },
    }
}

pub(super) fn lifecycle(lifecycle: &model::Lifecycle) -> plan::Lifecycle {
    let model::Lifecycle { launch: launched, terminate, relay_budget } = lifecycle;
    plan::Lifecycle {
        launch: launched.as_ref().map(launch),
        terminate: terminate.as_ref().map(command),
        relay_budget: relay_budget.map(|budget| plan::RelayBudget { latency: budget.latency, jitter: budget.jitter }),
    }
}

fn launch(launch: &model::Launch) -> plan::Launch {
    let ready = |ready: &model::Ready| plan::Ready {
        when: match &ready.when {
            model::ReadyWhen::Topic(topic) => plan::ReadyWhen::Topic { topic: topic_id(*topic) },
            model::ReadyWhen::Port(port) => plan::ReadyWhen::Port { port: port.clone() },
            model::ReadyWhen::Clock => plan::ReadyWhen::Clock,
            model::ReadyWhen::Line(text) => plan::ReadyWhen::Line { text: text.clone() },
        },
        within: ready.within,
    };
    plan::Launch { command: command(&launch.command), ready: launch.ready.as_ref().map(ready) }
}

fn command(command: &model::Command) -> plan::Command {
    plan::Command { program: command.program.clone(), arguments: command.arguments.clone() }
}

pub(super) fn unit(unit: Option<&Unit>) -> Option<String> {
    unit.map(|unit| unit.text().to_owned())
}
