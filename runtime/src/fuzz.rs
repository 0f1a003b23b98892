//! Fuzzing operations: what an active operation does to one message.
//!
//! Draws are keyed by the operation's draw seed and the message's index on its wire, so they do not depend on what
//! happened before: repeating a test repeats its disturbance, and a shorter window disturbs its messages just the same.

mod custom;
mod latency;
mod packet_loss;
mod probe;
mod random_value;

use sesame_plan::{Activation, Choice, Domain, Operation, OperationKind, Shape, TestOperation};

use crate::rng;
use crate::time::SimTime;
use crate::value::Value;

pub(crate) use custom::custom_operations;
pub use custom::{
    Custom, FromChoice, MessageCall, OperationContext, OperationEntry, OperationHook, RunContext, chosen,
};
pub use latency::Latency;
pub use packet_loss::PacketLoss;
pub use probe::unimplemented_operations;
pub use random_value::RandomValue;

/// An operation with the choices of one test.
#[derive(Debug)]
pub enum Disturbance {
    /// Replaces or shifts a number.
    RandomValue(RandomValue),
    /// Drops some messages.
    PacketLoss(PacketLoss),
    /// Delays messages.
    Latency(Latency),
    /// Drops all messages.
    Blackhole,
    /// Calls the user's code.
    Custom(Custom),
}

/// What becomes of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// It goes on as it is.
    Unchanged,
    /// It goes on, changed.
    Changed,
    /// It is gone.
    Dropped,
    /// It goes on this much later, not before messages held earlier.
    Delayed(SimTime),
}

/// The draws of one operation for one message.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    seed: u64,
    message: u64,
}

impl Draws {
    /// The draws for the `index`th message on the `member`th wire of the operation's topic.
    pub fn new(draw_seed: u64, member: u64, index: u64) -> Self {
        let seed = if member == 0 { draw_seed } else { rng::derive_seed(draw_seed, "member", &[member]) };
        Draws { seed, message: index }
    }

    /// The `n`th draw, uniform in `[0, 1)`.
    pub fn unit(self, n: u64) -> f64 {
        rng::keyed_unit(self.seed, self.message, n)
    }
}

impl Disturbance {
    /// Applies a test's choices to an operation of the space, with the user's code for custom ones. A plan guarantees
    /// that they fit; choices read from elsewhere are refused with a reason.
    pub fn new(operation: &Operation, test: &TestOperation, hooks: &[OperationEntry]) -> Result<Self, ChoiceError> {
        let refuse = |reason: String| Err(ChoiceError { operation: operation.name.clone(), reason });
        if operation.parameters.len() != test.parameters.len() {
            return refuse(format!("has {} parameters, not {}", operation.parameters.len(), test.parameters.len()));
        }
        for (parameter, choice) in operation.parameters.iter().zip(&test.parameters) {
            if let Some(reason) = misfit(&parameter.domain, choice) {
                return refuse(format!("`{}` {reason}", parameter.name));
            }
        }
        if operation.kind.is_offline() != (test.activation == Activation::Offline) {
            let when = if operation.kind.is_offline() { "has no activation: it acts beside" } else { "acts during" };
            return refuse(format!("{when} the run"));
        }
        let range = || test.parameters.first().map_or((0.0, 0.0), bounds);
        Ok(match &operation.kind {
            OperationKind::RandomValue { path, mode, integer } => Disturbance::RandomValue(RandomValue {
                path: path.clone(),
                mode: *mode,
                integer: *integer,
                range: range(),
            }),
            OperationKind::PacketLoss => Disturbance::PacketLoss(PacketLoss { loss: range().0 }),
            OperationKind::Latency { drain, .. } => Disturbance::Latency(Latency { delay: range(), drain: *drain }),
            OperationKind::Blackhole => Disturbance::Blackhole,
            OperationKind::Custom { moment } => match Custom::new(operation, *moment, &test.parameters, hooks) {
                Some(custom) => Disturbance::Custom(custom),
                None => return refuse("has no hook in this runner: run `sesamec generate` again".to_owned()),
            },
        })
    }

    /// What becomes of a message while the operation is active; the message may be changed in place. A custom operation
    /// may do more than that, so the relay calls it itself.
    pub fn apply(&self, draws: Draws, value: &mut Value) -> Fate {
        match self {
            Disturbance::RandomValue(operation) => operation.apply(draws, value),
            Disturbance::PacketLoss(operation) => operation.apply(draws),
            Disturbance::Latency(operation) => operation.apply(draws),
            Disturbance::Blackhole => Fate::Dropped,
            Disturbance::Custom(_) => Fate::Unchanged,
        }
    }
}

/// Why a choice is not one that is permitted; `None` if it is.
fn misfit(domain: &Domain, choice: &Choice) -> Option<String> {
    match (domain, choice) {
        (Domain::Number { low: least, high: most, shape, integer }, Choice::Value { .. } | Choice::Range { .. }) => {
            let (low, high) = bounds(choice);
            let fits = *least <= low && low <= high && high <= *most;
            let whole = !integer || *shape == Shape::Range || libm::trunc(low) == low;
            (!(fits && whole)).then(|| format!("permits [{least}, {most}], not [{low}, {high}]"))
        }
        (Domain::Point { low, high }, Choice::Point { point }) => {
            let fits = (0..3).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis]);
            (!fits).then(|| format!("permits points from {low:?} to {high:?}, not {point:?}"))
        }
        (Domain::Texts { texts: items } | Domain::Files { files: items }, Choice::Text { text }) => {
            (!items.contains(text)).then(|| format!("permits {}, not {text:?}", items.join(", ")))
        }
        _ => Some("is of another kind than what is chosen".to_owned()),
    }
}

fn bounds(choice: &Choice) -> (f64, f64) {
    match *choice {
        Choice::Value { value } => (value, value),
        Choice::Range { low, high } => (low, high),
        Choice::Point { .. } | Choice::Text { .. } => (0.0, 0.0),
    }
}

/// A test whose choices do not fit the operation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("operation `{operation}` {reason}")]
pub struct ChoiceError {
    /// The operation.
    pub operation: String,
    /// What does not fit.
    pub reason: String,
}
