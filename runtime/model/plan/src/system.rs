//! The system under test: its messages and their types, its topics and nodes.

use serde::{Deserialize, Serialize};

use crate::{CampaignPlan, Launch, MessageId, MetricId, TopicId};

/// A named message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MessageType {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its fields, in declaration order.
    pub fields: Vec<Field>,
    /// The names of numbers that its fields may have; for people who read results.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub constants: Vec<NamedNumber>,
}

/// A number with a name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedNumber {
    /// Its name.
    pub name: String,
    /// The number; finite.
    pub number: f64,
}

/// One field of a message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its name, as on the wire.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: Type,
    /// Whether messages may lack it, or have `null` in its place. Only JSON has such fields.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub optional: bool,
}

/// The type of a field or topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Type {
    /// True or false.
    Bool,
    /// A whole number, in a unit if one is declared.
    Int {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// A real number, in a unit if one is declared.
    Real {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Text.
    Text,
    /// A point in space: x, y, z, in a unit if one is declared.
    Point {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Any number of values of one type.
    List {
        /// The type of each element.
        of: Box<Type>,
    },
    /// A message type.
    Message {
        /// Which.
        id: MessageId,
    },
}

/// A topic, or a group of topics of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Topic {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Names on the wire, matched exactly: one, or the written-out members of a group.
    pub paths: Vec<String>,
    /// What people call the members of a group, in the order of the paths; none for a single topic.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub members: Vec<String>,
    /// What it carries.
    #[serde(rename = "type")]
    pub ty: Type,
    /// The layout of its messages on the wire, by the name of an [`Interface`](crate::Interface), where the transport
    /// needs it. Of SimlogAPI it is the name of the type, which may be left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interface: Option<String>,
    /// Whether it is a topic of the middleware, or one direction of a service.
    #[serde(default, skip_serializing_if = "Channel::is_default")]
    pub channel: Channel,
}

impl Topic {
    /// A member of a group with its topic, as a `.sesame` file has it: `odom[r1]`. In a plan without names of members
    /// it is the position.
    pub fn member_in_words(&self, member: u32) -> String {
        match self.members.get(member as usize) {
            Some(name) => with_member(&self.name, name),
            None => format!("{}[{member}]", self.name),
        }
    }
}

/// A name with the member of a group behind it, as a `.sesame` file has it: `odom[r1]`, `odom["acme/1"]`.
pub fn with_member(name: &str, member: &str) -> String {
    format!("{name}[{}]", in_brackets(member))
}

/// A member of a group as a `.sesame` file has it between brackets: a name or number as it is, everything else as a
/// text.
pub fn in_brackets(member: &str) -> String {
    let plain = |rest: &str| rest.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    let is_name = !member.starts_with(|first: char| first.is_ascii_digit()) && plain(member) && !member.is_empty();
    let is_number = !member.is_empty() && member.bytes().all(|byte| byte.is_ascii_digit());
    if is_name || is_number { member.to_owned() } else { format!("\"{member}\"") }
}

/// The name before a member in brackets: `odom` of `odom[r1]`, and every other name as it is.
pub fn without_member(name: &str) -> &str {
    name.split_once('[').map_or(name, |(group, _)| group)
}

/// What carries the messages of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// A topic.
    #[default]
    Topic,
    /// The requests of a service, whose name is the path.
    Request,
    /// The replies of a service, whose name is the path.
    Reply,
}

impl Channel {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Channel::default()
    }
}

/// A node: a program that publishes and subscribes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Its name in the space; that of a member of a group of nodes has the member behind it: `vehicle[r1]`.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Topics it publishes: none twice.
    pub publishes: Vec<TopicMembers>,
    /// Topics it subscribes to: none twice.
    pub subscribes: Vec<TopicMembers>,
    /// Its name in the middleware where that differs from its name in the space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub named: Option<String>,
    /// What starts it; `None` for a node that others start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub launch: Option<Launch>,
    /// What it publishes in answer to what it receives, so that a lock-stepped run knows what to wait for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answers: Vec<Answer>,
    /// The topics on which it publishes one message in every step, on each of the paths that it publishes, for the same
    /// reason.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub every_step: Vec<TopicId>,
}

impl Node {
    /// Whether it publishes a topic, or any member of a group.
    pub fn publishes(&self, topic: TopicId) -> bool {
        self.publishes.iter().any(|published| published.topic() == topic)
    }

    /// Whether it publishes on this path of a topic, by its position.
    pub fn publishes_on(&self, topic: TopicId, member: usize) -> bool {
        self.publishes.iter().any(|published| published.topic() == topic && published.has(member))
    }

    /// Whether it subscribes to a topic, or to any member of a group.
    pub fn subscribes(&self, topic: TopicId) -> bool {
        self.subscribes.iter().any(|subscribed| subscribed.topic() == topic)
    }

    /// Whether it subscribes to this path of a topic, by its position.
    pub fn subscribes_to(&self, topic: TopicId, member: usize) -> bool {
        self.subscribes.iter().any(|subscribed| subscribed.topic() == topic && subscribed.has(member))
    }

    /// Its name as a part of a path: that of `vehicle[r1]` is `vehicle/r1`.
    pub fn name_in_paths(&self) -> String {
        self.name.replace('[', "/").replace(']', "")
    }
}

/// A topic, or some members of a group of topics.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum TopicMembers {
    /// The topic, with all members if it is a group.
    All(TopicId),
    /// Some of a group.
    Only {
        /// The group.
        topic: TopicId,
        /// Their positions among the paths of the group, in ascending order: at least one, and not all.
        members: Vec<u32>,
    },
}

impl TopicMembers {
    /// The topic.
    pub fn topic(&self) -> TopicId {
        match self {
            TopicMembers::All(topic) | TopicMembers::Only { topic, .. } => *topic,
        }
    }

    /// Whether a member, by its position among the paths of the topic, is one of them.
    pub fn has(&self, member: usize) -> bool {
        match self {
            TopicMembers::All(_) => true,
            TopicMembers::Only { members, .. } => members.iter().any(|&at| at as usize == member),
        }
    }

    /// Whether both have a path in common.
    pub fn meets(&self, other: &TopicMembers) -> bool {
        let shares = || match (self, other) {
            (TopicMembers::Only { members, .. }, TopicMembers::Only { members: others, .. }) => {
                members.iter().any(|member| others.contains(member))
            }
            _ => true,
        };
        self.topic() == other.topic() && shares()
    }
}

/// For each message that a node receives on one topic, it publishes exactly one on another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// What it receives.
    pub to: TopicId,
    /// What it publishes.
    pub with: TopicId,
}

/// A value inside the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldRef {
    /// The topic.
    pub topic: TopicId,
    /// Field names from the message inwards; empty for a topic that carries the value itself.
    pub path: Vec<String>,
}

impl CampaignPlan {
    /// The fields on the way to a value in the messages of a topic, each with its message: as far as the path has names
    /// of fields.
    fn fields_to<'a, 'p, S: AsRef<str>>(
        &'a self,
        topic: TopicId,
        path: &'p [S],
    ) -> impl Iterator<Item = (&'a MessageType, &'a Field)> + use<'a, 'p, S> {
        let mut ty = self.topics.get(topic.index()).map(|topic| &topic.ty);
        path.iter().map_while(move |name| {
            let Some(Type::Message { id }) = ty else { return None };
            let message = self.messages.get(id.index())?;
            let field = message.fields.iter().find(|field| field.name == name.as_ref())?;
            ty = Some(&field.ty);
            Some((message, field))
        })
    }

    /// The name of a number in a field of a topic's messages, if it is clear which constant of the message is meant:
    /// the only one of this number whose name begins like the field's, `MODE_AUTO` of `mode`; or the only one of this
    /// number, if the message has no other number that could be meant.
    pub fn constant<S: AsRef<str>>(&self, topic: TopicId, path: &[S], number: f64) -> Option<&str> {
        let (message, field) = self.fields_to(topic, path).nth(path.len().checked_sub(1)?)?;
        let is_number = |field: &&Field| matches!(field.ty, Type::Int { .. } | Type::Real { .. });
        if !is_number(&field) {
            return None;
        }
        let equal = || message.constants.iter().filter(|constant| constant.number == number);
        let start = format!("{}_", field.name.to_ascii_uppercase());
        let own: Vec<&NamedNumber> = equal().filter(|constant| constant.name.starts_with(&start)).collect();
        let all: Vec<&NamedNumber> =
            if message.fields.iter().filter(is_number).count() == 1 { equal().collect() } else { Vec::new() };
        match (own.as_slice(), all.as_slice()) {
            ([only], _) | ([], [only]) => Some(&only.name),
            _ => None,
        }
    }

    /// The name of a metric's value, if that is one of a field, such as the last or the greatest one, and if it is
    /// clear which constant is meant, as in [`CampaignPlan::constant`].
    pub fn constant_of(&self, metric: MetricId, value: f64) -> Option<&str> {
        let FieldRef { topic, path } = self.metric(metric).source.field()?;
        self.constant(*topic, path, value)
    }

    /// Whether a message of its type may lack a value: a field on the way to it is optional.
    pub fn may_lack(&self, value: &FieldRef) -> bool {
        self.fields_to(value.topic, &value.path).any(|(_, field)| field.optional)
    }
}

#[cfg(test)]
mod tests {
    use super::{NamedNumber, Type, in_brackets, with_member, without_member};
    use crate::testing::{field, message, metric, plan, topic};
    use crate::{
        Aggregate, Expression, FieldRef, Formula, Input, Members, MessageId, MetricId, MetricSource, Side, TopicId,
    };

    const INT: Type = Type::Int { unit: None };

    #[test]
    fn a_number_has_the_name_of_a_constant_only_where_it_is_clear_which() {
        let mut plan = plan(Vec::new());
        let named = |name: &str, number| NamedNumber { name: name.to_owned(), number };
        let constants = vec![named("STATUS_OK", 1.0), named("STATUS_BAD", 2.0), named("HEALTH_BAD", 2.0)];
        let mut battery = message("Battery", vec![field("status", INT), field("cells", INT)]);
        battery.constants = constants;
        let mut mode = message("Mode", vec![field("mode", INT), field("name", Type::Text)]);
        mode.constants = vec![named("IDLE", 0.0), named("DRIVING", 1.0)];
        plan.messages = vec![battery, mode];
        let of = |id| Type::Message { id: MessageId(id) };
        plan.topics = vec![topic("battery", &["b"], of(0)), topic("mode", &["m"], of(1))];
        let name = |topic, field, number| plan.constant(TopicId(topic), &[field], number);
        assert_eq!(name(0, "status", 2.0), Some("STATUS_BAD"), "it begins like its field");
        assert_eq!(name(0, "status", 3.0), None);
        assert_eq!(name(0, "cells", 1.0), None, "one cell is not a status");
        assert_eq!(name(1, "mode", 1.0), Some("DRIVING"), "the message has one number");
        assert_eq!(name(1, "name", 1.0), None, "a text is not a number");
        assert_eq!((name(1, "none", 1.0), plan.constant::<&str>(TopicId(1), &[], 1.0)), (None, None));

        // A metric has it if its values are those of the field.
        let status = FieldRef { topic: TopicId(0), path: vec!["status".to_owned()] };
        let formula = |aggregate| Formula {
            inputs: vec![Input::new(status.clone(), Members::Min)],
            aggregate,
            when: None,
            every: None,
            per: None,
            side: Side::Inbound,
        };
        let mut of = |source| {
            plan.metrics = vec![metric("metric", source)];
            plan.constant_of(MetricId(0), 2.0).map(str::to_owned)
        };
        assert_eq!(of(MetricSource::Last { input: status.clone() }).as_deref(), Some("STATUS_BAD"));
        let worst = formula(Aggregate::Max { of: Expression::Input(0) });
        assert_eq!(of(MetricSource::Formula { formula: worst }).as_deref(), Some("STATUS_BAD"));
        let further = Expression::Sum(vec![Expression::Input(0), Expression::Constant(1.0)]);
        let computed = formula(Aggregate::Max { of: further });
        assert_eq!(of(MetricSource::Formula { formula: computed }), None);
    }

    #[test]
    fn a_value_may_be_lacking_if_a_field_on_the_way_to_it_is_optional() {
        let mut plan = plan(Vec::new());
        let mut at = field("at", Type::Message { id: MessageId(0) });
        at.optional = true;
        plan.messages = vec![message("Place", vec![field("x", INT)]), message("State", vec![at, field("id", INT)])];
        plan.topics = vec![topic("state", &["s"], Type::Message { id: MessageId(1) })];
        let may_lack = |path: &[&str]| {
            plan.may_lack(&FieldRef { topic: TopicId(0), path: path.iter().map(|&name| name.to_owned()).collect() })
        };
        assert!(may_lack(&["at", "x"]) && may_lack(&["at"]));
        assert!(!may_lack(&["id"]) && !may_lack(&[]));
    }

    #[test]
    fn a_member_is_written_as_it_can_be_read() {
        let written = ["r1", "12", "acme/1", "1a", "two words"].map(in_brackets);
        assert_eq!(written, ["r1", "12", "\"acme/1\"", "\"1a\"", "\"two words\""]);
        assert_eq!(without_member(&with_member("odom", "acme/1")), "odom");
        assert_eq!(without_member("odom"), "odom");
    }
}
