//! Fuzzing operations and the known tests that apply them.

use super::condition::{Condition, Constraint};
use super::{Bound, Declaration, MetricId, OperationId, Range, TopicId};
use crate::units::Unit;

/// A fuzzing operation with its permitted ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct Operation {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// What it disturbs; `None` exactly for a custom one before the start or after the end.
    pub target: Option<Target>,
    /// What it does.
    pub kind: OperationKind,
    /// The parameters a test chooses, in the order in which a plan has them.
    pub parameters: Vec<Parameter>,
    /// The time outside of which it is never active, in seconds; `None` is the whole test, from 0 to the campaign's end.
    pub within: Option<Range>,
    /// Operations of a higher priority come first on a message; equal ones in declaration order. Default 0.
    pub priority: i32,
    /// Probability that a fresh test includes it. Default 1.
    pub inclusion: f64,
    /// Whether its active time counts in `fuzzing_time()`. Default true.
    pub timed: bool,
    /// What its start conditions contain in campaigns that activate by condition; in written order.
    pub constraints: Vec<Constraint>,
}

impl Operation {
    /// The topic whose messages it disturbs.
    pub fn topic(&self) -> Option<TopicId> {
        self.target.as_ref().map(|target| target.topic)
    }

    /// Whether it acts before the start or after the end: a test then chooses no window for it.
    pub fn is_offline(&self) -> bool {
        matches!(&self.kind, OperationKind::Custom { moment: Moment::BeforeStart | Moment::AfterEnd })
    }
}

/// What an operation disturbs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// The topic.
    pub topic: TopicId,
    /// The values in each message that it changes, in written order, all of one type; none exactly where it acts on whole
    /// messages.
    pub places: Vec<Vec<Step>>,
}

/// One step into a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// The field of this name.
    Field(String),
    /// The element of a list at this position, from 0.
    Element(u32),
    /// Each element of a list.
    Each,
}

/// What an operation does to the messages of its topic. What its parameters are, the plan's
/// kinds of the same names say.
#[derive(Debug, Clone, PartialEq)]
pub enum OperationKind {
    /// Replaces or shifts numbers and points by fresh uniform draws per message.
    RandomValue {
        /// Whether the draw replaces the value or is added to it.
        mode: ValueMode,
        /// Whether the values are whole numbers; the ends of the range then are whole as well.
        integer: bool,
    },
    /// Replaces texts by a fresh draw per message.
    RandomText {
        /// What is drawn from: at least one, none twice.
        texts: Vec<String>,
    },
    /// Replaces values by one and the same.
    StuckAt {
        /// The truth value, where that is what is replaced.
        truth: Option<bool>,
    },
    /// Adds one and the same.
    Bias,
    /// Adds what grows with the time since the operation went on.
    Drift,
    /// Adds a fresh normal draw per message.
    Noise,
    /// Multiplies.
    Scale,
    /// Replaces reals by what is no finite number.
    NotFinite {
        /// By what.
        number: NotFinite,
    },
    /// Repeats the values that were there last before the operation went on.
    Freeze,
    /// Replaces values by those that were there some time ago.
    Stale,
    /// Adds to time stamps.
    ClockSkew,
    /// Drops each message independently.
    PacketLoss,
    /// Drops messages in bursts.
    BurstLoss,
    /// Drops what comes sooner than a rate permits.
    RateLimit,
    /// Delays each message, order kept.
    Latency {
        /// How each message's delay is drawn.
        distribution: Distribution,
        /// What becomes of held messages when the window ends.
        drain: Drain,
    },
    /// Delays each message by a time of its own, order not kept.
    Reorder {
        /// What becomes of held messages when the window ends.
        drain: Drain,
    },
    /// Sends copies after each message.
    Duplicate,
    /// Drops every message.
    Blackhole,
    /// Calls the user's code.
    Custom {
        /// When.
        moment: Moment,
    },
}

impl OperationKind {
    /// Whether its parameters are probabilities: percentages in the language, fractions in the model.
    pub fn has_probabilities(&self) -> bool {
        matches!(self, OperationKind::PacketLoss | OperationKind::BurstLoss)
    }
}

/// What is no finite number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotFinite {
    /// Not a number.
    Nan,
    /// Larger than every number.
    Infinity,
    /// Smaller than every number.
    MinusInfinity,
}

/// When the code of a custom operation is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// With each message while the operation is active.
    OnMessage,
    /// Before the simulator starts.
    BeforeStart,
    /// After the run has come to its end.
    AfterEnd,
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
    /// Normal inside the test's sub-range, drawn anew per message.
    Normal,
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

/// A parameter of an operation: what is permitted, and what a test makes of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in a test.
    pub name: String,
    /// The doc comment of a custom operation's parameter.
    pub doc: String,
    /// Its unit; `None` for probabilities, plain numbers, texts and files.
    pub unit: Option<Unit>,
    /// What is permitted.
    pub domain: Domain,
}

/// What a test may choose for a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Domain {
    /// Numbers of a range.
    Number {
        /// What is permitted.
        range: Range,
        /// What a test chooses.
        shape: Shape,
        /// Whether only whole numbers are permitted; the ends of the range then are whole as well.
        integer: bool,
    },
    /// Points of a box, `low <= high` on each axis.
    Point {
        /// Lower corner.
        low: [f64; 3],
        /// Upper corner.
        high: [f64; 3],
    },
    /// One of these texts, at least one, none twice.
    Texts(Vec<String>),
    /// One of these files, at least one, none twice: paths relative to the folder of the `.sesame` file.
    Files(Vec<String>),
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
    /// A choice for each of the operation's parameters, in their order, and permitted.
    pub choices: Vec<Choice>,
    /// When it is active: [`Activation::Offline`] exactly for an operation that acts before the start or after the end.
    pub activation: Activation,
    /// Seed of its draws: as written, else [`draw_seed`].
    pub draw_seed: u64,
}

/// When an operation of a known test is active; inside the operation's `within` only.
#[derive(Debug, Clone, PartialEq)]
pub enum Activation {
    /// In seconds from `low` up to, not including, `high`; inside the operation's `within`, not empty.
    Window(Range),
    /// From the moment at which a condition holds.
    Condition {
        /// Switches it on.
        start: Condition,
        /// What switches it off.
        end: End,
        /// How often at most in one run, at least 1. Default 1.
        times: u32,
    },
    /// Never during the run: it acts before the start or after the end, and has no window.
    Offline,
}

/// What ends an activation by condition.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// The moment at which another condition holds.
    Condition(Condition),
    /// A length of time, in seconds; positive.
    Length(f64),
}

impl Activation {
    /// The conditions it depends on.
    pub fn conditions(&self) -> impl Iterator<Item = &Condition> {
        let (start, end) = match self {
            Activation::Window(_) | Activation::Offline => (None, None),
            Activation::Condition { start, end: End::Length(_), .. } => (Some(start), None),
            Activation::Condition { start, end: End::Condition(end), .. } => (Some(start), Some(end)),
        };
        start.into_iter().chain(end)
    }
}

/// What a test chose for a parameter, in the parameter's unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Choice {
    /// One value.
    Value(f64),
    /// A sub-range.
    Range(Range),
    /// A point.
    Point([f64; 3]),
    /// One of the texts or files.
    Text(String),
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
