//! Conditions that switch operations on and off (paper §3.9.2, Table 1): comparisons between condition variables and
//! numbers, which are whole unless a variable has steps of its own, joined by `and` and `or`.
//!
//! One grammar for conditions written in a known test and for those that a search grows. A condition is a binary tree,
//! so that trees are varied node by node.

use serde::{Deserialize, Serialize};

use crate::{Lengths, MetricId};

/// A condition over metrics. A comparison with a variable that has no value yet does not hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// A comparison; at least one side is a variable.
    Compare {
        /// The left side.
        left: Operand,
        /// How the sides are compared.
        by: Comparison,
        /// The right side.
        right: Operand,
    },
    /// Both hold.
    And(Box<Condition>, Box<Condition>),
    /// At least one of them holds.
    Or(Box<Condition>, Box<Condition>),
}

/// One side of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operand {
    /// The value that a metric has at this moment, in its unit; its initial value before it has one.
    Variable(MetricId),
    /// A number in the unit of the variable it is compared with; finite. Where a search grew it, it is whole, or one of
    /// the steps of the variable.
    Number(f64),
}

/// How the sides of a comparison are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    /// `<`
    Below,
    /// `>`
    Above,
    /// `==`
    Equal,
}

impl Comparison {
    /// Whether it holds between two numbers; with a NaN none does.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Comparison::Below => left < right,
            Comparison::Above => left > right,
            Comparison::Equal => left == right,
        }
    }

    /// The sign, as the `.sesame` file has it.
    pub fn sign(self) -> &'static str {
        match self {
            Comparison::Below => "<",
            Comparison::Above => ">",
            Comparison::Equal => "==",
        }
    }
}

/// What a campaign offers for the conditions that its search grows: together with Table 1, its grammar.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionSpace {
    /// The variables; at least one.
    pub variables: Vec<Variable>,
    /// The most levels of a condition's tree, from 1 to [`ConditionSpace::MOST_DEPTH`]: a comparison alone is one
    /// level.
    pub depth: u32,
    /// The least and the greatest whole number that variables without steps of their own are compared with; `lowest <=
    /// highest`.
    pub integers: Integers,
    /// How an activation ends.
    pub end: ConditionEnd,
    /// How often an operation may be activated in one run, from 1.
    pub times: u32,
}

impl ConditionSpace {
    /// The most levels that conditions of a search may have: a tree of so many has a thousand comparisons.
    pub const MOST_DEPTH: u32 = 10;
}

/// A condition variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Variable {
    /// The metric it gets its values from.
    pub metric: MetricId,
    /// That metric's unit. Variables are compared with each other only where it is the same.
    pub unit: Option<String>,
    /// The least value it can have, if known: conditions that this makes constant are not grown.
    pub low: Option<f64>,
    /// The greatest value it can have, if known.
    pub high: Option<f64>,
    /// How far apart the numbers are that it is compared with, from its least value to its greatest, which are known
    /// then; positive. `None` for the whole numbers of the space, and then not written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
}

impl Variable {
    /// The most steps from the least to the greatest value.
    pub const MOST_STEPS: f64 = 1e6;
}

/// Whole numbers from `lowest` to `highest`, both included; neither is beyond 2^53. `lowest <= highest`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Integers {
    /// The least.
    pub lowest: i64,
    /// The greatest.
    pub highest: i64,
}

impl Integers {
    /// The numbers that are in both, if any is.
    pub fn shared(self, other: Integers) -> Option<Integers> {
        let shared = Integers { lowest: self.lowest.max(other.lowest), highest: self.highest.min(other.highest) };
        (shared.lowest <= shared.highest).then_some(shared)
    }
}

/// How activations by condition end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ConditionEnd {
    /// By a condition of their own.
    Condition,
    /// After a length of simulation time that a test chooses, in seconds; `0 < low <= high`.
    Length {
        /// The shortest.
        low: f64,
        /// The longest.
        high: f64,
    },
}

impl ConditionEnd {
    /// How long activations are of an operation whose lengths are bounded or not; `None` where the end of an activation
    /// does not depend on its length, and where no length is permitted by both.
    pub fn lengths(self, bound: Option<Lengths>) -> Option<Lengths> {
        match (self, bound) {
            (ConditionEnd::Condition, _) => None,
            (ConditionEnd::Length { low, high }, None) => Some(Lengths { low, high }),
            (ConditionEnd::Length { low, high }, Some(bound)) => Lengths { low, high }.shared(bound),
        }
    }
}

/// What the start condition of an operation has to contain, wherever a search grows it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Constraint {
    /// A variable.
    Variable {
        /// Which.
        metric: MetricId,
    },
    /// A number within bounds, both included, which are whole.
    Integer {
        /// The bounds.
        bounds: Integers,
    },
}
