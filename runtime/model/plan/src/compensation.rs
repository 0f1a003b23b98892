//! What brings a simulation closer to a lab [SESAME 2023, Section 4.7].

use serde::{Deserialize, Serialize};

use crate::{TopicId, ValuePath};

/// Something of a simulation that may be fitted to a lab, and the range that is permitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// What.
    pub what: Fitted,
    /// The least permitted value.
    pub low: f64,
    /// The greatest permitted value; not less.
    pub high: f64,
}

/// Something of a simulation that can be set.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Fitted {
    /// How much later messages reach their subscribers, in seconds; 0 or more.
    Delay {
        /// The topic; `None` for every topic that a node receives.
        topic: Option<TopicId>,
    },
    /// By what values are multiplied on their way to their subscribers.
    Scale(Values),
    /// What is added to values on their way to their subscribers, in their unit.
    Bias(Values),
    /// The standard deviation of the normally distributed noise that is added to values on their way to their
    /// subscribers, in their unit; 0 or more.
    Noise(Values),
    /// A parameter of the simulator; a plain number.
    Parameter {
        /// Its name, as the simulator knows it.
        name: String,
    },
}

/// Values in the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Values {
    /// The topic.
    pub topic: TopicId,
    /// Where in each message; none for the message itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ValuePath>,
}

/// What is set in a simulation so that it is closer to a lab. It acts during the whole of every run, after the
/// operations of the test, and is neither an operation of a test nor an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compensation {
    /// The name of the lab to which the simulation was fitted.
    pub lab: String,
    /// What is set, each thing once. The relay adjusts messages in this order.
    pub adjustments: Vec<Adjustment>,
}

/// Something of a simulation, and what it is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adjustment {
    /// What.
    pub what: Fitted,
    /// The values that it is set to, at least one: each run draws one of them (domain randomisation). What has one
    /// value is the same in every run.
    pub levels: Vec<f64>,
}

impl Fitted {
    /// The topic whose messages are concerned; `None` for all, or for none.
    pub fn topic(&self) -> Option<TopicId> {
        match self {
            Fitted::Delay { topic } => *topic,
            Fitted::Scale(values) | Fitted::Bias(values) | Fitted::Noise(values) => Some(values.topic),
            Fitted::Parameter { .. } => None,
        }
    }

    /// Whether no value below 0 makes sense.
    pub fn is_not_negative(&self) -> bool {
        matches!(self, Fitted::Delay { .. } | Fitted::Noise(_))
    }
}
