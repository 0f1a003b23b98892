//! What an action of ROS 2 is on the wire: three services and two topics, whose types follow from its own.

use crate::{Definition, Field};

/// The types that an action adds to its goal, result and feedback: what its goals and results are requested and
/// answered with, and the message with its feedback. The two other parts, the service that cancels goals and the topic
/// with their status, are of the package `action_msgs` for each action.
pub fn messages(package: &str, name: &str) -> [Definition; 5] {
    sesame_plan::action::messages(&format!("{package}/action/{name}")).map(|message| Definition {
        name: message.name,
        fields: message.fields.into_iter().map(|field| Field { name: field.name, ty: field.ty }).collect(),
        constants: Vec::new(),
    })
}
