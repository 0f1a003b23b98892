//! Declarative metrics as data. Units are resolved: constants and factors are such that numbers are taken as they are
//! on the wire.

use serde::{Deserialize, Serialize};

use crate::FieldRef;

/// A metric computed from messages without any code of the user.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Formula {
    /// What its expressions refer to by position; at least one.
    pub inputs: Vec<Input>,
    /// What becomes of the values over time.
    pub aggregate: Aggregate,
    /// Only messages at which it holds count.
    pub when: Option<Condition>,
    /// Shortest simulation time between two messages that count, in seconds; positive.
    pub every: Option<f64>,
    /// A text or whole number in the messages of one of the inputs' topics: one state for each of its values.
    pub per: Option<FieldRef>,
    /// Where it listens.
    pub side: Side,
}

/// Where a metric listens to the messages of its topics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Before operations: messages as they were published.
    Inbound,
    /// After operations: messages as they are delivered.
    Outbound,
}

/// A value held from the messages of a topic: a number, true or false (1 or 0), or a point.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Where it comes from.
    pub field: FieldRef,
    /// What is made of a group's members; [`Members::Min`] for a single topic.
    pub members: Members,
}

/// What is made of the last values of a group's members, of those that had a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Members {
    /// The least.
    Min,
    /// The greatest.
    Max,
    /// The sum.
    Sum,
    /// The latest.
    Each,
}

/// How a formula's values become the metric's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Aggregate {
    /// The last value.
    Last {
        /// Of what.
        of: Expression,
    },
    /// The least value.
    Min {
        /// Of what.
        of: Expression,
    },
    /// The greatest value.
    Max {
        /// Of what.
        of: Expression,
    },
    /// The mean over messages.
    Mean {
        /// Of what.
        of: Expression,
    },
    /// The number of messages at which it held.
    Count {
        /// Of what.
        of: Condition,
    },
    /// The simulation time during which it held, in seconds.
    Duration {
        /// Of what.
        of: Condition,
    },
}

/// A number computed from inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Expression {
    /// A constant.
    Constant(f64),
    /// An input that is a number: position in [`Formula::inputs`].
    Input(u32),
    /// The number with its sign changed.
    Negate(Box<Expression>),
    /// The sum, from left to right.
    Sum(Vec<Expression>),
    /// The product, from left to right.
    Product(Vec<Expression>),
    /// A quotient.
    Divide {
        /// What is divided.
        value: Box<Expression>,
        /// By what.
        by: Box<Expression>,
    },
    /// The number without its sign.
    Absolute(Box<Expression>),
    /// The least.
    Min(Vec<Expression>),
    /// The greatest.
    Max(Vec<Expression>),
    /// How far two inputs that are points are from each other, in the unit of the first.
    Distance {
        /// Position of the first in [`Formula::inputs`].
        from: u32,
        /// Position of the second.
        to: u32,
        /// How many units of the first one unit of the second is.
        scale: f64,
    },
}

/// Something that holds or does not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// Always or never.
    Constant(bool),
    /// An input that is true or false: position in [`Formula::inputs`].
    Input(u32),
    /// A comparison of numbers; one with a NaN does not hold.
    Compare {
        /// The left side.
        left: Expression,
        /// How the sides are compared.
        by: Comparison,
        /// The right side.
        right: Expression,
    },
    /// Whether two conditions both hold or both do not.
    Same {
        /// The one.
        left: Box<Condition>,
        /// The other.
        right: Box<Condition>,
    },
    /// All of them hold.
    All(Vec<Condition>),
    /// At least one of them holds.
    Any(Vec<Condition>),
    /// It does not hold.
    Not(Box<Condition>),
}

/// How two numbers are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    /// `<=`
    AtMost,
    /// `<`
    Below,
    /// `>=`
    AtLeast,
    /// `>`
    Above,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
}

impl Comparison {
    /// Whether it holds between two numbers; with a NaN none does.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Comparison::AtMost => left <= right,
            Comparison::Below => left < right,
            Comparison::AtLeast => left >= right,
            Comparison::Above => left > right,
            Comparison::Equal => left == right,
            Comparison::NotEqual => left != right && !left.is_nan() && !right.is_nan(),
        }
    }
}
