//! Fuzzing operations and the known tests that apply them.

use super::{Bound, Declaration, FieldPath, MetricId, OperationId, Range, TopicId};
use crate::units::Unit;

/// A fuzzing operation with its permitted ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct Operation {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// What it disturbs. Operations on whole messages have no fields.
    pub target: FieldPath,
    /// What it does.
    pub kind: OperationKind,
    /// The time outside of which it is never active, in seconds; `None` is the whole test, from 0 to the campaign's end.
    pub within: Option<Range>,
    /// Operations of a higher priority come first on a message; equal ones in declaration order. Default 0.
    pub priority: i32,
    /// Probability that a fresh test includes it. Default 1.
    pub inclusion: f64,
    /// Whether its active time counts in `fuzzing_time()`. Default true.
    pub timed: bool,
}

impl Operation {
    /// The topic whose messages it disturbs.
    pub fn topic(&self) -> TopicId {
        self.target.topic
    }

    /// The parameter a test chooses; `None` for a kind without parameters.
    pub fn parameter(&self) -> Option<Parameter> {
        match &self.kind {
            OperationKind::RandomValue { mode, range, integer, unit } => Some(Parameter {
                name: match mode {
                    ValueMode::Absolute => "value",
                    ValueMode::Offset => "offset",
                },
                unit: unit.clone(),
                range: *range,
                shape: Shape::Range,
                integer: *integer,
            }),
            OperationKind::PacketLoss { loss } => {
                Some(Parameter { name: "loss", unit: None, range: *loss, shape: Shape::Value, integer: false })
            }
            OperationKind::Latency { delay, distribution, .. } => Some(Parameter {
                name: "delay",
                unit: Some(Unit::seconds()),
                range: *delay,
                shape: match distribution {
                    Distribution::Fixed => Shape::Value,
                    Distribution::Uniform => Shape::Range,
                },
                integer: false,
            }),
            OperationKind::Blackhole => None,
        }
    }
}

/// What an operation does to the messages of its topic.
#[derive(Debug, Clone, PartialEq)]
pub enum OperationKind {
    /// Replaces or shifts a number by a fresh uniform draw per message.
    RandomValue {
        /// Whether the draw replaces the value or is added to it.
        mode: ValueMode,
        /// What is permitted, in the field's unit.
        range: Range,
        /// The field's unit.
        unit: Option<Unit>,
        /// Whether the field is a whole number; the ends of the range then are whole as well.
        integer: bool,
    },
    /// Drops each message independently.
    PacketLoss {
        /// Permitted probabilities to drop, within `0..=1`.
        loss: Range,
    },
    /// Delays each message, order kept.
    Latency {
        /// Permitted delays in seconds, not negative.
        delay: Range,
        /// How each message's delay is drawn.
        distribution: Distribution,
        /// What becomes of held messages when the window ends.
        drain: Drain,
    },
    /// Drops every message.
    Blackhole,
}

/// Whether a random value replaces or shifts the original.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueMode {
    /// The draw replaces the value.
    Absolute,
    /// The draw is added to the value.
    Offset,
}

/// How the delay of each message is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distribution {
    /// The same for every message.
    Fixed,
    /// Uniform over the test's sub-range, drawn anew per message.
    Uniform,
}

/// What becomes of held messages when an operation's window ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drain {
    /// Held ones go out on time, later ones queue behind them. The default.
    Finish,
    /// Held ones go out at once.
    Flush,
    /// Held ones are lost.
    Drop,
}

/// A parameter of an operation: its permitted range, and what a test makes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in a test.
    pub name: &'static str,
    /// Its unit; `None` for probabilities and plain numbers.
    pub unit: Option<Unit>,
    /// What is permitted.
    pub range: Range,
    /// What a test chooses.
    pub shape: Shape,
    /// Whether only whole numbers are permitted.
    pub integer: bool,
}

/// What a test chooses of a permitted range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// One value of it.
    Value,
    /// A sub-range of it.
    Range,
}

/// A known test: fixed operations, and what is expected of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its operations, in written order; at least one.
    pub operations: Vec<TestOperation>,
    /// What must come out.
    pub expectations: Vec<Expectation>,
}

/// An operation as a known test applies it.
#[derive(Debug, Clone, PartialEq)]
pub struct TestOperation {
    /// Which.
    pub operation: OperationId,
    /// The choice for the operation's parameter: `Some` exactly if it has one, and inside its permitted range.
    pub choice: Option<Choice>,
    /// When it is active, in seconds: from `low` up to, not including, `high`; inside the operation's `within`, not empty.
    pub window: Range,
    /// Seed of its draws: as written, else [`draw_seed`].
    pub draw_seed: u64,
}

/// What a test chose for a parameter, in the parameter's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// One value.
    Value(f64),
    /// A sub-range.
    Range(Range),
}

/// What must come out of a known test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The metric.
    pub metric: MetricId,
    /// The bound, in the metric's unit.
    pub bound: Bound,
}

/// The draw seed of a known test's operation that names none: FNV-1a (64 bits) over the test's name and the operation's
/// position in it, from 0, as eight little-endian bytes. So it depends on nothing else in the file, and never changes
/// between versions.
pub fn draw_seed(test: &str, position: usize) -> u64 {
    let position = (position as u64).to_le_bytes();
    test.bytes()
        .chain(position)
        .fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3))
}

#[cfg(test)]
mod tests {
    use super::draw_seed;

    #[test]
    fn draw_seeds_never_change() {
        assert_eq!(draw_seed("known_jitter", 0), 12_995_400_615_631_193_215);
        assert_ne!(draw_seed("known_jitter", 1), draw_seed("known_jitter", 0));
    }
}
