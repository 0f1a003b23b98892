//! A test: the list of disturbances applied in one run of the simulator.

use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::{Bound, Messages, MetricId, OperationId};

/// One test configuration: what a search evolves and a run applies. An empty list disturbs nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Test {
    /// Its operations. Their order is not a priority; an operation of the space may occur more than once.
    pub operations: Vec<TestOperation>,
}

/// An operation of the space as one test applies it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TestOperation {
    /// Which operation.
    pub operation: OperationId,
    /// When it is active.
    pub activation: Activation,
    /// A choice for each parameter of the operation, in the operation's order.
    pub parameters: Vec<Choice>,
    /// Seed of its draws, which are keyed by message index: repeating a test repeats its disturbance exactly.
    pub operation_seed: u64,
    /// The only messages that it alters while it is active; `None` for all. It decides on all messages as it would
    /// without the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub messages: Option<Messages>,
}

/// When an operation of a test is active. [`Activation::Offline`] is that of the operations that are
/// [offline](crate::OperationKind::is_offline), and of no others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Activation {
    /// For `start <= t < end`, in seconds of simulation time, inside the operation's `within`.
    Time {
        /// Where it starts.
        start: f64,
        /// Where it ends.
        end: f64,
    },
    /// From the moment at which a condition holds until the moment at which another does, inside the operation's
    /// `within`.
    Condition {
        /// Switches it on.
        start: Condition,
        /// Switches it off; never in the step that switched it on.
        end: Condition,
        /// How often at most in one run, from 1.
        times: u32,
    },
    /// From the moment at which a condition holds, for a length of time, inside the operation's `within`.
    ConditionFor {
        /// Switches it on.
        start: Condition,
        /// For how long, in seconds of simulation time; positive.
        length: f64,
        /// How often at most in one run, from 1.
        times: u32,
    },
    /// Never during the run: it acts before the start or after the end, and has no window.
    Offline,
}

/// What a test chose for one parameter, in the parameter's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Choice {
    /// One value ([`crate::ChoiceKind::Value`]).
    Value {
        /// The value.
        value: f64,
    },
    /// A sub-range, `low <= high` ([`crate::ChoiceKind::Range`]).
    Range {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A point ([`crate::Domain::Point`]).
    Point {
        /// Its x, y and z.
        point: [f64; 3],
    },
    /// One of the texts, or the path of one of the files ([`crate::Domain::Texts`], [`crate::Domain::Files`]).
    Text {
        /// The text or path.
        text: String,
    },
}

/// A test written by hand, with what is expected of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KnownTest {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The test.
    pub test: Test,
    /// What must come out.
    pub expectations: Vec<Expectation>,
    /// The seed of the simulator with which [`Task::Known`](crate::Task::Known) runs it; `None` for a test that is run
    /// with that of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulator_seed: Option<u64>,
}

/// What must come out of a known test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expectation {
    /// The metric.
    pub metric: MetricId,
    /// The bound on its value.
    pub bound: Bound,
}
