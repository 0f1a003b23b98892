//! What an action of ROS 2 is on the wire: three services and two topics, whose types follow from its own.

use sesame_plan::{Primitive, WireType};

use crate::{Definition, Field};

/// The types that an action adds to its goal, result and feedback: what its goals and results are requested and
/// answered with, and the message with its feedback. The two other parts, the service that cancels goals and the topic
/// with their status, are of the package `action_msgs` for each action.
pub fn messages(package: &str, name: &str) -> [Definition; 5] {
    let of = |part: &str| WireType::Interface { name: format!("{package}/action/{name}_{part}") };
    let goal_id = || ("goal_id", WireType::Interface { name: "unique_identifier_msgs/msg/UUID".to_owned() });
    let stamp = ("stamp", WireType::Interface { name: "builtin_interfaces/msg/Time".to_owned() });
    let number = |primitive| WireType::Primitive { primitive };
    let definition = |part: &str, fields: Vec<(&str, WireType)>| Definition {
        name: format!("{package}/action/{name}_{part}"),
        fields: fields.into_iter().map(|(name, ty)| Field { name: name.to_owned(), ty }).collect(),
        constants: Vec::new(),
    };
    [
        definition("SendGoal_Request", vec![goal_id(), ("goal", of("Goal"))]),
        definition("SendGoal_Response", vec![("accepted", number(Primitive::Bool)), stamp]),
        definition("GetResult_Request", vec![goal_id()]),
        definition("GetResult_Response", vec![("status", number(Primitive::Int8)), ("result", of("Result"))]),
        definition("FeedbackMessage", vec![goal_id(), ("feedback", of("Feedback"))]),
    ]
}
