//! Fuzzing operations and the known tests that apply them.

use super::condition::{Condition, Constraint};
use sesame_plan::{Bound, Choice, ChoiceKind, Counted, MembersOf, Messages, OperationKind, Step, Turn};

use super::declaration::Declaration;
use super::ids::{MetricId, NodeId, OperationId, TopicId};
use super::metrics::Range;
use crate::units::Unit;

/// A fuzzing operation with its permitted ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct Operation {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// What it disturbs, each topic once, in written order; none exactly for one that acts on no messages: a custom one
    /// before the start or after the end, or one on a node or its parameters, which [`OperationKind::node`] names by
    /// its position in the space.
    pub targets: Vec<Target>,
    /// The nodes of a group on which it acts, by their positions; `None` for an operation that acts on no nodes.
    pub nodes: Option<MembersOf>,
    /// Only messages that these nodes publish, in written order; none for all messages.
    pub from: Vec<NodeId>,
    /// Only messages on their way to these nodes, in written order; none for all messages.
    pub to: Vec<NodeId>,
    /// What it does.
    pub kind: OperationKind,
    /// The parameters a test chooses, in the order in which a plan has them.
    pub parameters: Vec<Parameter>,
    /// The time outside of which it is never active, in seconds; `None` is the whole test, from 0 to the campaign's
    /// end.
    pub within: Option<Range>,
    /// How long it is active at a time, in seconds, `0 <= low <= high`, and `high` is more than 0; `None` where only
    /// `within` limits it.
    pub lengths: Option<Range>,
    /// Operations of a higher priority come first on a message; equal ones in declaration order. Default 0.
    pub priority: i32,
    /// Probability that a fresh test includes it. Default 1.
    pub inclusion: f64,
    /// Whether its active time counts in `fuzzing_time()`. Default true.
    pub timed: bool,
    /// By what a test counts out the messages that it alters: a parameter for each, behind those of the kind.
    pub counted: Vec<Counted>,
    /// The turn in which it keeps the angles that it changes, in their unit; `None` where it leaves them as they come.
    pub wrapped: Option<Turn>,
    /// What its start conditions contain in campaigns that activate by condition; in written order.
    pub constraints: Vec<Constraint>,
}

impl Operation {
    /// The topics whose messages it disturbs, each once, in written order.
    pub fn topics(&self) -> impl Iterator<Item = TopicId> {
        self.targets.iter().map(|target| target.topic)
    }

    /// Whether it disturbs a topic.
    pub fn disturbs(&self, topic: TopicId) -> bool {
        self.topics().any(|own| own == topic)
    }

    /// Whether it acts before the start or after the end: a test then chooses no window for it.
    pub fn is_offline(&self) -> bool {
        self.kind.is_offline()
    }
}

/// What an operation disturbs of one topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// The topic.
    pub topic: TopicId,
    /// The members of a group on which it acts, by their positions; `None` for all topics of a group, or for a topic
    /// that is not a group. A test chooses members of all topics, or of none.
    pub members: Option<MembersOf>,
    /// The values in each message that it changes, in written order, all of one type; none exactly where it acts on
    /// whole messages.
    pub places: Vec<Vec<Step>>,
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
        shape: ChoiceKind,
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

/// A known test: fixed operations, and what is expected of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// Its operations, in written order; at least one.
    pub operations: Vec<TestOperation>,
    /// What must come out.
    pub expectations: Vec<Expectation>,
    /// The seed of the simulator, if the test has one of its own.
    pub simulator_seed: Option<u64>,
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
    /// The only messages that it alters, on wires that it acts on; `None` for all.
    pub messages: Option<Messages>,
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
