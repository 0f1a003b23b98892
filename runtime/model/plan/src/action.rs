//! What an action of ROS 2 is: three services and two topics, whose names and types follow from its own.

use crate::{Channel, Interface, InterfaceField, Primitive, WireType};

/// A topic of an action, or one direction of one of its services.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionPart {
    /// What follows the name of the action and `_` in the name that it has in a space.
    pub name: &'static str,
    /// What follows the path of the action and [`INFIX`]; equal for the two directions of a service.
    pub path: &'static str,
    /// What it is. The server publishes all but requests.
    pub channel: Channel,
    /// Its type: what follows that of the action, or the same one for all actions.
    interface: &'static str,
}

/// What stands between the path of an action and those of its topics and services.
pub const INFIX: &str = "/_action/";

/// The topics of an action, with the directions of its services.
pub const PARTS: [ActionPart; 8] = {
    const fn part(name: &'static str, path: &'static str, channel: Channel, interface: &'static str) -> ActionPart {
        ActionPart { name, path, channel, interface }
    }
    [
        part("goal_request", "send_goal", Channel::Request, "_SendGoal_Request"),
        part("goal_reply", "send_goal", Channel::Reply, "_SendGoal_Response"),
        part("cancel_request", "cancel_goal", Channel::Request, "action_msgs/srv/CancelGoal_Request"),
        part("cancel_reply", "cancel_goal", Channel::Reply, "action_msgs/srv/CancelGoal_Response"),
        part("result_request", "get_result", Channel::Request, "_GetResult_Request"),
        part("result_reply", "get_result", Channel::Reply, "_GetResult_Response"),
        part("feedback", "feedback", Channel::Topic, "_FeedbackMessage"),
        part("status", "status", Channel::Topic, "action_msgs/msg/GoalStatusArray"),
    ]
};

impl ActionPart {
    /// Its path, of the action with this one.
    pub fn path_of(&self, action: &str) -> String {
        format!("{action}{INFIX}{}", self.path)
    }

    /// Its type, of an action of this one.
    pub fn interface_of(&self, action: &str) -> String {
        if self.interface.starts_with('_') { format!("{action}{}", self.interface) } else { self.interface.to_owned() }
    }
}

/// The messages that an action of this type, such as `nav2_msgs/action/NavigateToPose`, adds to its goal, result and
/// feedback: what goals and results are requested and answered with, and the message with its feedback.
pub fn messages(action: &str) -> [Interface; 5] {
    let interface = |name: &str| WireType::Interface { name: name.to_owned() };
    let part = |end: &str| WireType::Interface { name: format!("{action}_{end}") };
    let number = |primitive| WireType::Primitive { primitive };
    let goal_id = || ("goal_id", interface("unique_identifier_msgs/msg/UUID"));
    let message = |end: &str, fields: Vec<(&str, WireType)>| Interface {
        name: format!("{action}_{end}"),
        fields: fields.into_iter().map(|(name, ty)| InterfaceField { name: name.to_owned(), ty }).collect(),
    };
    let stamp = ("stamp", interface("builtin_interfaces/msg/Time"));
    [
        message("SendGoal_Request", vec![goal_id(), ("goal", part("Goal"))]),
        message("SendGoal_Response", vec![("accepted", number(Primitive::Bool)), stamp]),
        message("GetResult_Request", vec![goal_id()]),
        message("GetResult_Response", vec![("status", number(Primitive::Int8)), ("result", part("Result"))]),
        message("FeedbackMessage", vec![goal_id(), ("feedback", part("Feedback"))]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_message_of_an_action_is_of_a_part_of_it() {
        let all: Vec<String> = PARTS.iter().map(|part| part.interface_of("cell/action/Move")).collect();
        for message in messages("cell/action/Move") {
            assert!(all.contains(&message.name), "{}", message.name);
        }
        assert_eq!(all.iter().filter(|name| name.starts_with("cell/action/Move_")).count(), 5);
        assert_eq!(PARTS[6].path_of("/r1/move"), "/r1/move/_action/feedback");
    }
}
