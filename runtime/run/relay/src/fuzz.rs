//! Fuzzing operations: what an active operation does to one message.
//!
//! Random numbers are keyed by the operation seed and by the message's index on its wire, so they do not depend on what
//! happened before: repeating a test repeats its disturbance, and a shorter window disturbs its messages in the same
//! way. Operations that add up, such as a random walk, add up numbers of this kind.

mod action;
mod bias;
mod burst_loss;
mod change;
mod custom;
mod draws;
mod drift;
mod freeze;
mod latency;
mod noise;
mod not_finite;
mod packet_loss;
mod per_wire;
mod places;
mod probe;
mod random_value;
mod random_walk;
mod rate_limit;
mod reorder;
mod resource;
mod scale;
mod stale;
mod stuck_at;

use sesame_base::time::SimTime;
use sesame_plan::{
    Activation, Choice, ChoiceKind, Domain, Drain, NamedNumber, NewValue, NodeId, Operation, OperationKind,
    TestOperation, ValueMode,
};

use crate::value::{Text, Value};

pub use action::{Action, HELD_LIMIT, MessageContext, OnWire};
pub use bias::Bias;
pub use burst_loss::BurstLoss;
pub use change::Amount;
pub(crate) use custom::custom_operations;
pub use custom::{
    Custom, FromChoice, MessageCall, OperationContext, OperationEntry, OperationHook, RunContext, chosen,
};
pub use draws::KeyedRng;
pub use drift::Drift;
pub use freeze::Freeze;
pub use latency::Latency;
pub use noise::Noise;
pub use not_finite::MakeNotFinite;
pub use packet_loss::PacketLoss;
pub use per_wire::PerWire;
pub use places::Places;
pub use probe::unimplemented_operations;
pub use random_value::{RandomItem, RandomValue};
pub use random_walk::RandomWalk;
pub use rate_limit::RateLimit;
pub use reorder::Reorder;
pub use resource::{Order, Resource};
pub use scale::Scale;
pub use stale::Stale;
pub use stuck_at::{Stuck, StuckAt};

/// An operation with the choices of one test, and its state in one run.
#[derive(Debug)]
pub enum Disturbance {
    /// Replaces or shifts numbers and points by random numbers.
    RandomValue(RandomValue),
    /// Replaces values by random ones of a list.
    RandomItem(RandomItem),
    /// Replaces values by a constant.
    StuckAt(StuckAt),
    /// Adds a constant.
    Bias(Bias),
    /// Adds an offset that grows with time.
    Drift(Drift),
    /// Adds normally distributed noise.
    Noise(Noise),
    /// Adds a Brownian motion.
    RandomWalk(RandomWalk),
    /// Multiplies by a constant.
    Scale(Scale),
    /// Replaces numbers by NaN or infinity.
    NotFinite(MakeNotFinite),
    /// Repeats old values.
    Freeze(Freeze),
    /// Replaces values by older ones.
    Stale(Stale),
    /// Drops some messages.
    PacketLoss(PacketLoss),
    /// Drops messages in bursts.
    BurstLoss(BurstLoss),
    /// Drops messages that come too soon after the previous one.
    RateLimit(RateLimit),
    /// Delays messages and keeps their order.
    Latency(Latency),
    /// Delays messages and may change their order.
    Reorder(Reorder),
    /// Sends this many copies after each message.
    Duplicate(u32),
    /// Drops all messages.
    Blackhole,
    /// It acts on nodes instead of messages.
    Resources(Vec<Resource>),
    /// The simulator has another value of a parameter, during the whole run.
    Scene(f64),
    /// Calls the user's code.
    Custom(Custom),
}

impl Disturbance {
    /// Applies a test's choices to an operation of the space, with the user's code for custom operations. In a plan
    /// they always match; choices from elsewhere that do not match are an error.
    pub fn new(operation: &Operation, test: &TestOperation, hooks: &[OperationEntry]) -> Result<Self, ChoiceError> {
        let refuse = |reason: String| Err(ChoiceError { operation: operation.name.clone(), reason });
        if operation.parameters.len() != test.parameters.len() {
            return refuse(format!("has {} parameters, not {}", operation.parameters.len(), test.parameters.len()));
        }
        for (parameter, choice) in operation.parameters.iter().zip(&test.parameters) {
            if let Some(reason) = mismatch(&parameter.domain, choice) {
                return refuse(format!("`{}` {reason}", parameter.name));
            }
        }
        if operation.kind.is_offline() != (test.activation == Activation::Offline) {
            let (what, when) =
                if operation.kind.is_offline() { ("has no", "before or after") } else { ("lacks an", "during") };
            return refuse(format!("{what} activation: it acts {when} the run"));
        }
        let chosen = |name: &str| {
            let position = operation.parameters.iter().position(|parameter| parameter.name == name);
            position.map(|at| &test.parameters[at])
        };
        let lacks = |name: &str| ChoiceError {
            operation: operation.name.clone(),
            reason: format!("has no parameter `{name}` of the expected kind: run `sesamec generate` again"),
        };
        let on_nodes = |resource: &dyn Fn(NodeId) -> Resource| {
            Disturbance::Resources(operation.nodes_of_test(&test.parameters).into_iter().map(resource).collect())
        };
        let number = |name: &str| match chosen(name) {
            Some(Choice::Value { value }) => Ok(*value),
            _ => Err(lacks(name)),
        };
        let range = |name: &str| match chosen(name) {
            Some(choice @ (Choice::Value { .. } | Choice::Range { .. })) => Ok(bounds(choice)),
            _ => Err(lacks(name)),
        };
        let amount = |name: &str| chosen(name).and_then(Amount::from_choice).ok_or_else(|| lacks(name));
        // Which of the texts of a parameter `value` is chosen.
        let listed = || match (operation.parameters.first()?.domain.items(), chosen("value")) {
            (Some(texts), Some(Choice::Text { text })) => texts.iter().position(|listed| listed == text),
            _ => None,
        };
        let places = Places::new(operation.targets().map(|target| target.places)).within(operation.wrapped);
        Ok(match &operation.kind {
            OperationKind::RandomValue { mode, integer } => {
                let ranges = if chosen("x").is_some() {
                    [range("x")?, range("y")?, range("z")?]
                } else {
                    [range(if *mode == ValueMode::Offset { "offset" } else { "value" })?; 3]
                };
                Disturbance::RandomValue(RandomValue { places, mode: *mode, integer: *integer, ranges })
            }
            OperationKind::RandomText { texts } => {
                let items = texts.iter().map(|text| Stuck::Text(Text::from(text.as_str()))).collect();
                Disturbance::RandomItem(RandomItem { places, items })
            }
            OperationKind::RandomConstant { constants } => {
                let number = |constant: &NamedNumber| Stuck::Amount(Amount::Number(constant.number));
                Disturbance::RandomItem(RandomItem { places, items: constants.iter().map(number).collect() })
            }
            OperationKind::StuckAt { truth } => {
                let at = match (truth, chosen("value")) {
                    (Some(truth), _) => Stuck::Truth(*truth),
                    (None, Some(Choice::Text { text })) => Stuck::Text(Text::from(text.as_str())),
                    (None, _) => Stuck::Amount(amount("value")?),
                };
                Disturbance::StuckAt(StuckAt { places, at })
            }
            OperationKind::StuckAtConstant { numbers } => {
                let number = listed().and_then(|at| numbers.get(at)).ok_or_else(|| lacks("value"))?;
                Disturbance::StuckAt(StuckAt { places, at: Stuck::Amount(Amount::Number(*number)) })
            }
            OperationKind::Bias => Disturbance::Bias(Bias { places, bias: amount("bias")? }),
            OperationKind::ClockSkew => Disturbance::Bias(Bias { places, bias: amount("skew")? }),
            OperationKind::Drift => Disturbance::Drift(Drift { places, rate: amount("rate")? }),
            OperationKind::Noise => Disturbance::Noise(Noise { places, sigma: number("sigma")? }),
            OperationKind::RandomWalk => Disturbance::RandomWalk(RandomWalk::new(places, number("sigma")?)),
            OperationKind::Scale => Disturbance::Scale(Scale { places, factor: number("factor")? }),
            OperationKind::NotFinite { number } => Disturbance::NotFinite(MakeNotFinite { places, number: *number }),
            OperationKind::Freeze => Disturbance::Freeze(Freeze::new(places)),
            OperationKind::Stale => Disturbance::Stale(Stale::new(places, SimTime::from_seconds(number("age")?))),
            OperationKind::PacketLoss => Disturbance::PacketLoss(PacketLoss { loss: number("loss")? }),
            OperationKind::BurstLoss => Disturbance::BurstLoss(BurstLoss {
                enter: number("enter")?,
                leave: number("leave")?,
                loss: if chosen("loss").is_some() { number("loss")? } else { 1.0 },
                bursting: PerWire::default(),
            }),
            OperationKind::RateLimit => Disturbance::RateLimit(RateLimit {
                period: SimTime::from_seconds(1.0 / number("rate")?),
                passed: PerWire::default(),
            }),
            OperationKind::Latency { distribution, drain } => {
                Disturbance::Latency(Latency { delay: range("delay")?, distribution: *distribution, drain: *drain })
            }
            OperationKind::Reorder { drain } => {
                Disturbance::Reorder(Reorder { window: number("window")?, drain: *drain })
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` clamps")]
            OperationKind::Duplicate => Disturbance::Duplicate(number("copies")? as u32),
            OperationKind::Blackhole => Disturbance::Blackhole,
            OperationKind::Set { parameter, values, .. } => {
                let value = match values.as_slice() {
                    [] => NewValue::Number(number("value")?),
                    values => listed().and_then(|at| values.get(at)).ok_or_else(|| lacks("value"))?.clone(),
                };
                on_nodes(&|node| Resource::Set { node, parameter: parameter.clone(), value: value.clone() })
            }
            OperationKind::Transition { transition, .. } => {
                on_nodes(&|node| Resource::Transition { node, transition: *transition })
            }
            OperationKind::Pause { .. } => on_nodes(&|node| Resource::Pause { node }),
            OperationKind::Slow { .. } => {
                let share = number("share")?;
                on_nodes(&|node| Resource::Slow { node, share })
            }
            OperationKind::Kill { .. } => on_nodes(&|node| Resource::Kill { node }),
            OperationKind::Scene { .. } => Disturbance::Scene(number("value")?),
            OperationKind::Custom { moment } => match Custom::new(operation, *moment, &test.parameters, hooks) {
                Some(custom) => Disturbance::Custom(custom),
                None => return refuse("has no hook in this runner: run `sesamec generate` again".to_owned()),
            },
        })
    }

    /// The operation becomes active: its state is reset, except for what it observed while it was inactive.
    pub fn begin(&mut self) {
        match self {
            Disturbance::RandomWalk(operation) => operation.begin(),
            Disturbance::BurstLoss(operation) => operation.bursting = PerWire::default(),
            Disturbance::RateLimit(operation) => operation.passed = PerWire::default(),
            _ => {}
        }
    }

    /// Whether it observes messages that pass while it is inactive.
    pub fn observes_inactive(&self) -> bool {
        matches!(self, Disturbance::Freeze(_) | Disturbance::Stale(_))
    }

    /// A message passes while the operation is inactive.
    pub fn observe(&mut self, now: SimTime, on: OnWire, message: &Value) {
        match self {
            Disturbance::Freeze(operation) => operation.observe(on, message),
            Disturbance::Stale(operation) => operation.observe(now, on, message),
            _ => {}
        }
    }

    /// Whether messages that it holds back keep their order.
    pub fn holds_order(&self) -> bool {
        matches!(self, Disturbance::Latency(_))
    }

    /// What happens to the messages that it holds back when it becomes inactive; `None` if it never holds any.
    pub fn drain(&self) -> Option<Drain> {
        match self {
            Disturbance::Latency(operation) => Some(operation.drain),
            Disturbance::Reorder(operation) => Some(operation.drain),
            _ => None,
        }
    }

    /// Acts on a message while the operation is active; the message may be changed in place. A custom operation may do
    /// more than that, so the relay calls it itself.
    pub fn apply(&mut self, at: MessageContext, message: &mut Value) -> Action {
        match self {
            Disturbance::RandomValue(operation) => operation.apply(at, message),
            Disturbance::RandomItem(operation) => operation.apply(at, message),
            Disturbance::StuckAt(operation) => operation.apply(at, message),
            Disturbance::Bias(operation) => operation.apply(at, message),
            Disturbance::Drift(operation) => operation.apply(at, message),
            Disturbance::Noise(operation) => operation.apply(at, message),
            Disturbance::RandomWalk(operation) => operation.apply(at, message),
            Disturbance::Scale(operation) => operation.apply(at, message),
            Disturbance::NotFinite(operation) => operation.apply(at, message),
            Disturbance::Freeze(operation) => operation.apply(at.on, message),
            Disturbance::Stale(operation) => operation.apply(at.now, at.on, message),
            Disturbance::PacketLoss(operation) => operation.apply(at.draws),
            Disturbance::BurstLoss(operation) => operation.apply(at.draws, at.on.member),
            Disturbance::RateLimit(operation) => operation.apply(at.now, at.on.member),
            Disturbance::Latency(operation) => operation.apply(at.draws),
            Disturbance::Reorder(operation) => operation.apply(at.draws),
            Disturbance::Duplicate(copies) => Action::Duplicated(*copies),
            Disturbance::Blackhole => Action::Dropped,
            Disturbance::Resources(_) | Disturbance::Scene(_) | Disturbance::Custom(_) => Action::Unchanged,
        }
    }
}

/// Why a choice is not permitted; `None` if it is.
fn mismatch(domain: &Domain, choice: &Choice) -> Option<String> {
    match (domain, choice) {
        (Domain::Number { low: least, high: most, shape, integer }, Choice::Value { .. } | Choice::Range { .. }) => {
            let (low, high) = bounds(choice);
            let fits = *least <= low && low <= high && high <= *most;
            let whole = !integer || *shape == ChoiceKind::Range || libm::trunc(low) == low;
            (!(fits && whole)).then(|| format!("permits [{least}, {most}], not [{low}, {high}]"))
        }
        (Domain::Point { low, high }, Choice::Point { point }) => {
            let fits = (0..3).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis]);
            (!fits).then(|| format!("permits points from {low:?} to {high:?}, not {point:?}"))
        }
        (Domain::Texts { texts: items } | Domain::Files { files: items }, Choice::Text { text }) => {
            (!items.contains(text)).then(|| format!("permits {}, not {text:?}", items.join(", ")))
        }
        _ => Some("has a domain of another kind than the choice".to_owned()),
    }
}

fn bounds(choice: &Choice) -> (f64, f64) {
    match *choice {
        Choice::Value { value } => (value, value),
        Choice::Range { low, high } => (low, high),
        Choice::Point { .. } | Choice::Text { .. } => (0.0, 0.0),
    }
}

/// A test with choices that do not match the operation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("operation `{operation}` {reason}")]
pub struct ChoiceError {
    /// The operation.
    pub operation: String,
    /// The mismatch.
    pub reason: String,
}
