//! The lifecycle of a node, read and changed by the services that each managed node of ROS 2 has for it.

use std::sync::Arc;

use sesame_plan::Transition;
use sesame_relay::value::{Fields, Record, Text, Value};

use crate::dds::{DdsError, Endpoint, Participant};
use crate::layouts::Layout;
use crate::node_service::{Service, Ticket};

/// The lifecycle of one node.
pub(crate) struct Lifecycle {
    get: Service,
    change: Service,
}

/// A state in which a node stays, each reached from the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum State {
    Unconfigured,
    Inactive,
    Active,
}

/// The states with their numbers in ROS and their names.
const STATES: [(State, f64, &str); 3] =
    [(State::Unconfigured, 1.0, "unconfigured"), (State::Inactive, 2.0, "inactive"), (State::Active, 3.0, "active")];

/// The transitions with their numbers in ROS: from which state to which.
const TRANSITIONS: [(Transition, i64, State, State); 4] = [
    (Transition::Configure, 1, State::Unconfigured, State::Inactive),
    (Transition::Cleanup, 2, State::Inactive, State::Unconfigured),
    (Transition::Activate, 3, State::Inactive, State::Active),
    (Transition::Deactivate, 4, State::Active, State::Inactive),
];

const STATE: &str = "lifecycle_msgs/msg/State";
const TRANSITION: &str = "lifecycle_msgs/msg/Transition";

/// The field of messages that have none.
const NO_FIELDS: &str = "structure_needs_at_least_one_member";

const LAYOUTS: &[Layout] = &[
    (STATE, &[("id", "uint8"), ("label", "string")]),
    (TRANSITION, &[("id", "uint8"), ("label", "string")]),
    ("lifecycle_msgs/srv/GetState_Request", &[(NO_FIELDS, "uint8")]),
    ("lifecycle_msgs/srv/GetState_Response", &[("current_state", STATE)]),
    ("lifecycle_msgs/srv/ChangeState_Request", &[("transition", TRANSITION)]),
    ("lifecycle_msgs/srv/ChangeState_Response", &[("success", "bool")]),
];

impl State {
    pub(crate) fn name(self) -> &'static str {
        STATES.iter().find(|(state, ..)| *state == self).map_or("", |(.., name)| name)
    }

    /// The state to which an operation with this transition takes a node that is in this state; `None` if the node is
    /// already there, or further.
    pub(crate) fn after(self, transition: Transition) -> Option<State> {
        let (.., from, to) = TRANSITIONS.into_iter().find(|(known, ..)| *known == transition)?;
        let leads = if to < from { to < self } else { self < to };
        leads.then_some(to)
    }

    /// The transitions that take a node from this state to another one.
    pub(crate) fn to(self, goal: State) -> Vec<Transition> {
        let mut way = Vec::new();
        let mut at = self;
        while at != goal {
            let nearer = |from: State, to: State| from == at && (to < from) == (goal < at);
            let Some((transition, .., to)) = TRANSITIONS.into_iter().find(|(.., from, to)| nearer(*from, *to)) else {
                break;
            };
            way.push(transition);
            at = to;
        }
        way
    }
}

impl Lifecycle {
    pub(crate) fn join(node: &str, dds: &mut Participant) -> Result<Self, DdsError> {
        Ok(Lifecycle {
            get: Service::join(node, "get_state", "lifecycle_msgs/srv/GetState", LAYOUTS, dds)?,
            change: Service::join(node, "change_state", "lifecycle_msgs/srv/ChangeState", LAYOUTS, dds)?,
        })
    }

    /// What is missing before a run, in a phrase.
    pub(crate) fn missing(&self, subscribers: &[Endpoint]) -> Option<String> {
        [&self.get, &self.change].into_iter().find_map(|service| service.missing(subscribers))
    }

    /// Asks for the state.
    pub(crate) fn ask(&self, dds: &Participant) -> Result<Ticket, DdsError> {
        self.get.call(&Record::new(&Fields::new([NO_FIELDS]), vec![Value::Int(0)]).into(), dds)
    }

    /// The state in the reply; an error for the user if the node stays in no such state.
    pub(crate) fn asked(&self, reply: Arc<[u8]>) -> Result<State, String> {
        let reply = self.get.read(reply)?;
        let number = reply.number_at(&["current_state", "id"]);
        if let Some((state, ..)) = STATES.into_iter().find(|(_, known, _)| number == Some(*known)) {
            return Ok(state);
        }
        match reply.at(&["current_state", "label"]) {
            Some(Value::Text(label)) => Err(format!("it is {label}")),
            _ => Err("it does not say its state".to_owned()),
        }
    }

    /// Asks for a transition.
    pub(crate) fn change(&self, transition: Transition, dds: &Participant) -> Result<Ticket, DdsError> {
        let number = TRANSITIONS.iter().find(|(known, ..)| *known == transition).map_or(0, |(_, number, ..)| *number);
        let label = Value::Text(Text::from(transition.word()));
        let wanted = Record::new(&Fields::new(["id", "label"]), vec![Value::Int(number), label]);
        self.change.call(&Record::new(&Fields::new(["transition"]), vec![wanted.into()]).into(), dds)
    }

    /// Whether the node made the transition, which its reply says.
    pub(crate) fn was_changed(&self, reply: Arc<[u8]>) -> Result<bool, String> {
        Ok(self.change.read(reply)?.number_at(&["success"]).is_some_and(|success| success != 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transition_takes_a_node_as_far_as_its_state_and_back_again() {
        let taken = |from: State, transition| from.after(transition).map(|to| (from.to(to), to.to(from)));
        let [up, on, off, down] =
            [Transition::Configure, Transition::Activate, Transition::Deactivate, Transition::Cleanup];
        assert_eq!(taken(State::Active, off), Some((vec![off], vec![on])));
        assert_eq!(taken(State::Active, down), Some((vec![off, down], vec![up, on])));
        assert_eq!(taken(State::Inactive, down), Some((vec![down], vec![up])));
        assert_eq!(taken(State::Inactive, on), Some((vec![on], vec![off])));
        assert_eq!(taken(State::Unconfigured, on), Some((vec![up, on], vec![off, down])));
        assert_eq!(taken(State::Unconfigured, up), Some((vec![up], vec![down])));
        for (state, transition) in [
            (State::Active, on),
            (State::Active, up),
            (State::Inactive, up),
            (State::Inactive, off),
            (State::Unconfigured, off),
            (State::Unconfigured, down),
        ] {
            assert_eq!(taken(state, transition), None, "{transition:?} of a node that is {}", state.name());
        }
    }
}
