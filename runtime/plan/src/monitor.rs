//! Runtime monitors: conditional safety certificates as data ([SESAME 2023, §6.1.7]). A monitor watches evidence in
//! messages and publishes the strongest guarantee that holds.

use serde::{Deserialize, Serialize};

use crate::formula::Condition;
use crate::{FieldRef, Input, MonitorId, Side, TopicId};

/// A runtime monitor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Monitor {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Where it publishes its state: a topic that carries a `bool` (whether any guarantee holds), an `int` (the
    /// integrity of the strongest one that holds, 0 if none does) or a `text` (its name).
    pub publishes: TopicId,
    /// Guarantees of other monitors on which it relies. No monitor relies on itself by any chain of demands.
    pub demands: Vec<Demand>,
    /// What it watches; at least one.
    pub evidence: Vec<Evidence>,
    /// What it can guarantee, highest integrity first; at least one, and no two of one integrity.
    pub guarantees: Vec<Guarantee>,
    /// The state in which no guarantee holds.
    pub otherwise: SafeState,
    /// Line of its declaration, from 1.
    pub line: u32,
}

/// A guarantee of another monitor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Demand {
    /// Its name, which is that of the guarantee.
    pub name: String,
    /// Whose guarantee it is.
    pub monitor: MonitorId,
    /// Position in that monitor's [`Monitor::guarantees`].
    pub guarantee: u32,
}

/// A condition on messages with three values: true, false, and unknown until each of its topics has had a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What [`Evidence::condition`] refers to by position; at least one.
    pub inputs: Vec<Input>,
    /// When it is true.
    pub condition: Condition,
    /// How long the condition must have held without interruption, in seconds; 0 is at once.
    pub held: f64,
    /// When it is too old to be believed; `None` is never.
    pub stale: Option<Stale>,
    /// Where it listens: to messages as they are delivered, unless the space says `inbound`.
    pub side: Side,
}

/// When evidence is too old.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stale {
    /// The longest time since the last message of any of its topics, in seconds; positive.
    pub after: f64,
    /// Its value when that has passed.
    pub is: StaleIs,
}

/// The value of stale evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StaleIs {
    /// It does not hold.
    False,
    /// Nobody knows.
    Unknown,
}

/// Something that a monitor can guarantee.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Guarantee {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its integrity: 1 or more; larger is stronger.
    pub integrity: u32,
    /// What it needs.
    pub gate: Gate,
}

/// What a guarantee needs, in three-valued logic (Kleene's).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gate {
    /// Evidence: position in [`Monitor::evidence`].
    Evidence(u32),
    /// A demand: position in [`Monitor::demands`].
    Demand(u32),
    /// All of two or more.
    All(Vec<Gate>),
    /// At least one of two or more.
    Any(Vec<Gate>),
    /// At least so many of two or more.
    AtLeast {
        /// How many: from 1 to the number of parts.
        count: u32,
        /// The parts.
        of: Vec<Gate>,
    },
}

/// The state of a monitor in which no guarantee holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SafeState {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What is sent each time that a guarantee is lost and none is left.
    pub mitigation: Option<Mitigation>,
}

/// A message that is to bring the system into a safe state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mitigation {
    /// What is set. If it is a field, other fields are those of the last message of the topic.
    pub field: FieldRef,
    /// What it is set to: of the type of the field, and in its unit.
    pub value: MitigationValue,
}

/// A value of a field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MitigationValue {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Real(f64),
    /// A text.
    Text(String),
}
