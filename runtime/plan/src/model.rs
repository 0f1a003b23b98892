//! What is fixed for a campaign: the space as far as this campaign sees it, and the campaign itself.

use serde::{Deserialize, Serialize};

use crate::condition::{ConditionSpace, Constraint};
use crate::{Confirmation, CoverageGoal, Exploration, Formula, KnownTest, OperationKind, Search, StopRule};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The position in the plan's list of these.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// A message type: position in [`CampaignPlan::messages`].
    MessageId
);
id!(
    /// A topic, or a group of topics: position in [`CampaignPlan::topics`].
    TopicId
);
id!(
    /// A metric: position in [`CampaignPlan::metrics`].
    MetricId
);
id!(
    /// A fuzzing operation: position in [`CampaignPlan::operations`].
    OperationId
);
id!(
    /// A known test: position in [`CampaignPlan::tests`].
    KnownTestId
);
id!(
    /// A requirement: position in [`CampaignPlan::requirements`].
    RequirementId
);

/// Everything a runner knows of its campaign. Deserializing one [validates](CampaignPlan::validate) it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct CampaignPlan {
    /// [`crate::SCHEMA`] of the generator that wrote the plan. It comes first, so that a plan of another schema is
    /// refused for that reason.
    #[serde(deserialize_with = "crate::validate::this_schema")]
    pub schema: u32,
    /// Name and version of the generator, for example `sesamec 0.1.0`.
    pub generator: String,
    /// File name of the `.sesame` file, without its folder.
    pub source: String,
    /// The space's name.
    pub space: String,
    /// The space's doc comment, lines joined by `\n`; empty when there is none.
    pub doc: String,
    /// The simulator under test.
    pub simulator: Simulator,
    /// Message types, each after the types it contains.
    pub messages: Vec<MessageType>,
    /// All topics of the space, in declaration order.
    pub topics: Vec<Topic>,
    /// Nodes of the system.
    pub nodes: Vec<Node>,
    /// The metrics this campaign measures, in declaration order.
    pub metrics: Vec<Metric>,
    /// All requirements of the space.
    pub requirements: Vec<Requirement>,
    /// The operations this campaign (or a known test of it) may use, in declaration order.
    pub operations: Vec<Operation>,
    /// The known tests of the space whose operations and metrics are all in this plan.
    pub tests: Vec<KnownTest>,
    /// The campaign.
    pub campaign: Campaign,
}

impl CampaignPlan {
    /// The message type of an id.
    pub fn message(&self, id: MessageId) -> &MessageType {
        &self.messages[id.index()]
    }
    /// The topic of an id.
    pub fn topic(&self, id: TopicId) -> &Topic {
        &self.topics[id.index()]
    }
    /// The metric of an id.
    pub fn metric(&self, id: MetricId) -> &Metric {
        &self.metrics[id.index()]
    }
    /// The operation of an id.
    pub fn operation(&self, id: OperationId) -> &Operation {
        &self.operations[id.index()]
    }
    /// The requirement of an id.
    pub fn requirement(&self, id: RequirementId) -> &Requirement {
        &self.requirements[id.index()]
    }
    /// The known test of an id.
    pub fn test(&self, id: KnownTestId) -> &KnownTest {
        &self.tests[id.index()]
    }
}

/// The simulator, and how the runner reaches it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Simulator {
    /// Its name in the space.
    pub name: String,
    /// The transport and its settings.
    pub transport: Transport,
}

/// How a runner exchanges messages with a simulator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Transport {
    /// A Rust type linked into the runner, stepped in lock-step with the relay.
    InProcess {
        /// Path of the type, for example `kuka_cell_sim::Cell`.
        path: String,
        /// Simulation time of one step, in nanoseconds; positive.
        step_ns: u64,
    },
    /// A program that the runner starts and with which it exchanges lines of JSON.
    Process {
        /// The program: a name to be found on `PATH`, or a path relative to the folder of the `.sesame` file, in which
        /// the program runs. Where that folder is, generated code knows; a plan is the same wherever it lies.
        program: String,
        /// Its arguments, one by one; no shell reads them.
        arguments: Vec<String>,
        /// Simulation time of one step, in nanoseconds; positive. `None` for a simulator that runs freely: nobody steps
        /// it, so equal tests need not give equal results.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        step_ns: Option<u64>,
    },
}

/// A named message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MessageType {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its fields, in declaration order.
    pub fields: Vec<Field>,
}

/// One field of a message type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Its name, as on the wire.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: Type,
}

/// The type of a field or topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Type {
    /// True or false.
    Bool,
    /// A whole number, in a unit if one is declared.
    Int {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// A real number, in a unit if one is declared.
    Real {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Text.
    Text,
    /// A point in space: x, y, z, in a unit if one is declared.
    Point {
        /// The unit on the wire.
        unit: Option<String>,
    },
    /// Any number of values of one type.
    List {
        /// The type of each element.
        of: Box<Type>,
    },
    /// A message type.
    Message {
        /// Which.
        id: MessageId,
    },
}

/// A topic, or a group of topics of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Topic {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Names on the wire, matched exactly: one, or the written-out members of a group.
    pub paths: Vec<String>,
    /// What it carries.
    #[serde(rename = "type")]
    pub ty: Type,
}

/// A node: a program that publishes and subscribes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Topics it publishes.
    pub publishes: Vec<TopicId>,
    /// Topics it subscribes to.
    pub subscribes: Vec<TopicId>,
}

/// Which end of a metric is of interest to a tester.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Larger is more dangerous.
    Maximise,
    /// Smaller is more dangerous (or cheaper).
    Minimise,
}

/// A number computed from the messages of a test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The unit of its value; `None` for a plain number.
    pub unit: Option<String>,
    /// Which way an objective on it goes; objectives always have one.
    pub direction: Option<Direction>,
    /// The value of a test in which it was never set.
    pub default: Option<f64>,
    /// Its value for conditions before it is first set.
    pub initial: Option<f64>,
    /// Where its value comes from.
    pub source: MetricSource,
    /// The only way in which its value changes during a run, where that is known; `None` where it may go both ways.
    /// What a hook declares is checked while it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trend: Option<Trend>,
    /// Whether infinity and NaN are ordinary values of what its hook reads, as in laser scans. Default false, and then
    /// not written.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub accepts_not_finite: bool,
    /// Line of its declaration, from 1.
    pub line: u32,
}

/// The only way in which a metric's value changes during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trend {
    /// It never gets smaller.
    Rising,
    /// It never gets greater.
    Falling,
}

/// Where a metric's value comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum MetricSource {
    /// The user's Rust code, called with each message of these topics.
    Hook {
        /// Its inputs, in declaration order.
        topics: Vec<TopicId>,
    },
    /// The sum over operations of observed active time, clipped to the run, in seconds.
    FuzzingTime,
    /// The last value received.
    Last {
        /// Which value of which message.
        input: FieldRef,
    },
    /// By how much a formula of signal temporal logic is kept over the whole run; known when it is over.
    Robustness {
        /// Of what.
        robustness: crate::stl::Robustness,
    },
    /// Computed from messages as the space says.
    Formula {
        /// How.
        formula: Formula,
    },
}

/// A value inside the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldRef {
    /// The topic.
    pub topic: TopicId,
    /// Field names from the message inwards; empty for a topic that carries the value itself.
    pub path: Vec<String>,
}

/// What must hold of a metric's value. Bounds are in the metric's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Bound {
    /// `<= value`
    AtMost {
        /// The bound.
        value: f64,
    },
    /// `< value`
    Below {
        /// The bound.
        value: f64,
    },
    /// `>= value`
    AtLeast {
        /// The bound.
        value: f64,
    },
    /// `> value`
    Above {
        /// The bound.
        value: f64,
    },
    /// `== value`
    Equal {
        /// The bound.
        value: f64,
    },
    /// `in [low, high]`, both ends included
    Within {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

impl Bound {
    /// Whether a value keeps the bound. A NaN keeps none.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Bound::AtMost { value } => x <= value,
            Bound::Below { value } => x < value,
            Bound::AtLeast { value } => x >= value,
            Bound::Above { value } => x > value,
            Bound::Equal { value } => x == value,
            Bound::Within { low, high } => (low..=high).contains(&x),
        }
    }
}

/// What must hold in every test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Requirement {
    /// Its name in the space, for example `R1`.
    pub name: String,
    /// Its sentence.
    pub text: String,
    /// The metric it bounds.
    pub metric: MetricId,
    /// The bound.
    pub bound: Bound,
}

/// A fuzzing operation with its permitted ranges. A test holds instances of it, see [`crate::TestOperation`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The topic whose messages it disturbs; `None` exactly for a custom operation before the start or after the end.
    pub topic: Option<TopicId>,
    /// The values in each message that it changes, in written order; none exactly where it acts on whole messages.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<Place>,
    /// What it does to them.
    pub kind: OperationKind,
    /// The parameters a test chooses, in the order that [`OperationKind`] documents.
    pub parameters: Vec<Parameter>,
    /// The time outside of which it is never active (`within`); seconds, `start < end`. Of an offline operation, which
    /// is never active, the whole run.
    pub within: Span,
    /// Operations of a higher priority come first on a message; equal ones in declaration order. Default 0.
    pub priority: i32,
    /// Probability that a fresh test includes it. Default 1.
    pub inclusion: f64,
    /// Whether its active time counts in `fuzzing_time()`. Default true, and then not written.
    #[serde(default = "timed", skip_serializing_if = "is_timed")]
    pub timed: bool,
    /// What its start conditions contain where a search grows them.
    pub constraints: Vec<Constraint>,
}

fn timed() -> bool {
    true
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_timed(timed: &bool) -> bool {
    *timed
}

/// A stretch of simulation time in seconds, `start <= end`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Where it starts, inclusive.
    pub start: f64,
    /// Where it ends, exclusive.
    pub end: f64,
}

impl Span {
    /// Its length in seconds.
    pub fn length(self) -> f64 {
        self.end - self.start
    }
}

/// Where in a message a value is: from the message inwards; empty for the message itself.
pub type Place = Vec<Step>;

/// One step into a message.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// The field of this name.
    Field(String),
    /// The element of a list at this position, from 0; none in a list that is shorter.
    Element(u32),
    /// Each element of a list.
    Each,
}

/// A place behind a topic's name, as the `.sesame` file has it: `.level`, `[3]`, `.ranges[*]`.
pub fn place_in_words(place: &[Step]) -> String {
    let step = |step: &Step| match step {
        Step::Field(name) => format!(".{name}"),
        Step::Element(at) => format!("[{at}]"),
        Step::Each => "[*]".to_owned(),
    };
    place.iter().map(step).collect()
}

/// A parameter of an operation: what is permitted in the space, and what a test makes of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name in a test, for example `offset`, `loss`, `delay`.
    pub name: String,
    /// Its unit; `None` for probabilities, plain numbers, texts and files.
    pub unit: Option<String>,
    /// What is permitted.
    pub domain: Domain,
}

/// What a test may choose for a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Domain {
    /// Numbers of a range.
    Number {
        /// Lower end of what is permitted.
        low: f64,
        /// Upper end of what is permitted.
        high: f64,
        /// What a test chooses.
        shape: Shape,
        /// Whether only whole numbers are permitted.
        integer: bool,
    },
    /// A point of a box, both corners included; `low <= high` on each axis.
    Point {
        /// Lower corner: x, y, z.
        low: [f64; 3],
        /// Upper corner.
        high: [f64; 3],
    },
    /// One of these texts: at least one, none twice.
    Texts {
        /// The texts, in declaration order.
        texts: Vec<String>,
    },
    /// One of these files: at least one, none twice. Paths are relative to the folder of the `.sesame` file, with `/`.
    Files {
        /// The paths, in declaration order.
        files: Vec<String>,
    },
}

impl Domain {
    /// The texts or paths to choose from; `None` for numbers and points.
    pub fn items(&self) -> Option<&[String]> {
        match self {
            Domain::Texts { texts } => Some(texts),
            Domain::Files { files } => Some(files),
            Domain::Number { .. } | Domain::Point { .. } => None,
        }
    }
}

/// What a test chooses of a permitted range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// One value of it.
    Value,
    /// A sub-range of it.
    Range,
}

/// A campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What the search optimises; each has a direction. Empty for a campaign that only repeats.
    pub objectives: Vec<MetricId>,
    /// The operations a test may hold.
    pub operations: Vec<OperationId>,
    /// How many operations a test holds.
    pub count: Count,
    /// What holds of several copies of one operation in a test.
    #[serde(default, skip_serializing_if = "Copies::is_default")]
    pub copies: Copies,
    /// How tests switch their operations on and off.
    pub activation: ActivationMode,
    /// How tests are found.
    pub search: Search,
    /// How coverage of the space is counted; `None` for a campaign that does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageGoal>,
    /// What an evolution does to cover more cells; `None` for one that only counts them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// How tests that enter the front are confirmed; `None` for a campaign that believes each first run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<Confirmation>,
    /// Over how many nearest tests the search averages what it is told of each; `None` for a search that is told what
    /// came out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<u32>,
    /// What stops the search besides its number of tests and its coverage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop: Vec<StopRule>,
    /// The one seed that decides everything; `run --seed` overrides it.
    pub seed: u64,
    /// Simulation time at which a test ends, in seconds.
    pub end_after: f64,
    /// Of which tests the messages and the activity of operations are recorded; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub record: Option<Recorded>,
}

/// Of which tests the messages and the activity of operations are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recorded {
    /// Of those that violate a requirement, crash or time out, and of the reference runs to compare them with.
    Failing,
    /// Of all.
    All,
}

/// Bounds of a count, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// At least.
    pub min: u32,
    /// At most.
    pub max: u32,
}

/// What holds of several copies of one operation in a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Copies {
    /// They are never active at the same time, so that together they stay within what the operation declares. By time
    /// their windows are disjoint; by condition a copy waits while another one is active.
    #[default]
    Apart,
    /// They may be active at the same time.
    MayOverlap,
    /// There is at most one.
    Once,
}

impl Copies {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Copies::default()
    }
}

/// How tests switch their operations on and off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ActivationMode {
    /// In windows of simulation time.
    Time,
    /// By conditions grown from this space.
    Condition {
        /// What they are made of.
        space: ConditionSpace,
    },
}
