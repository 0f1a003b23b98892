//! A testing space of the original platform, as data: what its files hold, in the names of its last metamodel.
//!
//! A reference is a number that stands for the text in the file; [`Original::metric`] and its like say what it leads
//! to.

use std::collections::HashMap;

use crate::dialect::Dialect;

/// A whole file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Original {
    /// The space's name.
    pub name: String,
    /// What is measured.
    pub metrics: Vec<Metric>,
    /// Operations that tests may hold, with all they permit.
    pub operations: Vec<Operation>,
    /// Campaigns, with what they performed.
    pub campaigns: Vec<Campaign>,
    /// What is tested.
    pub system: System,
    /// How the file speaks.
    pub dialect: Dialect,
    pub(crate) references: References,
}

/// A reference to something in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Reference(pub(crate) u32);

/// What a reference leads to: positions in the lists of [`Original`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    Metric(usize),
    Operation(usize),
    Test(usize, usize),
    Variable(usize),
    Type(usize),
}

/// The texts of references, and what they lead to.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct References {
    known: HashMap<Box<str>, u32>,
    targets: Vec<Option<Target>>,
}

impl References {
    /// The reference of a text: an id, or a path from the root.
    pub(crate) fn of(&mut self, text: &str) -> Reference {
        if let Some(&known) = self.known.get(text) {
            return Reference(known);
        }
        let number = u32::try_from(self.targets.len()).expect("a file has fewer than 2^32 references");
        self.known.insert(text.into(), number);
        self.targets.push(if text.starts_with('/') { target_of_path(text) } else { None });
        Reference(number)
    }

    /// Says what an id leads to.
    pub(crate) fn define(&mut self, id: &str, target: Target) {
        let Reference(number) = self.of(id);
        self.targets[number as usize] = Some(target);
    }

    /// The reference of a metric's name, which leads nowhere before [`References::name_metrics`].
    pub(crate) fn of_name(&mut self, name: &str) -> Reference {
        // No id or path holds a blank.
        self.of(&format!("name {name}"))
    }

    /// Says what the names of these metrics lead to: of each metric whose name no other has.
    pub(crate) fn name_metrics(&mut self, metrics: &[Metric]) {
        let mut named: HashMap<&str, Option<usize>> = HashMap::new();
        for (at, metric) in metrics.iter().enumerate() {
            named.entry(&metric.name).and_modify(|found| *found = None).or_insert(Some(at));
        }
        for (name, at) in named.into_iter().filter_map(|(name, at)| Some((name, at?))) {
            let Reference(number) = self.of_name(name);
            self.targets[number as usize] = Some(Target::Metric(at));
        }
    }
}

/// What a path from the root leads to, `//@campaigns.0/@performedTests.3`.
fn target_of_path(path: &str) -> Option<Target> {
    let step = |step: &str| -> Option<(String, usize)> {
        let step = step.strip_prefix('@')?;
        match step.rsplit_once('.') {
            Some((feature, at)) => Some((feature.to_owned(), at.parse().ok()?)),
            None => Some((step.to_owned(), 0)),
        }
    };
    let steps: Vec<(String, usize)> = path.trim_start_matches('/').split('/').map(step).collect::<Option<_>>()?;
    let named: Vec<(&str, usize)> = steps.iter().map(|(feature, at)| (feature.as_str(), *at)).collect();
    match named[..] {
        [("metrics", at)] => Some(Target::Metric(at)),
        [("possibleFuzzingOperations" | "possibleAttacks", at)] => Some(Target::Operation(at)),
        [("campaigns", campaign), ("performedTests", at)] => Some(Target::Test(campaign, at)),
        [("mrs", _), ("variables" | "topics", at)] => Some(Target::Variable(at)),
        [("mrs", _), ("propertyType", at)] => Some(Target::Type(at)),
        _ => None,
    }
}

impl Original {
    fn target(&self, reference: Reference) -> Option<Target> {
        self.references.targets[reference.0 as usize]
    }

    /// The position of a metric.
    pub fn metric(&self, reference: Reference) -> Option<usize> {
        match self.target(reference)? {
            Target::Metric(at) if at < self.metrics.len() => Some(at),
            _ => None,
        }
    }

    /// The position of the metric that a value is of: the one that it refers to, or else the one of its name.
    pub fn measured(&self, value: &Measured) -> Option<usize> {
        value.metric.and_then(|metric| self.metric(metric)).or_else(|| self.metric(value.name?))
    }

    /// Whether a value refers to no metric and is known by its name alone.
    pub(crate) fn is_named_only(&self, value: &Measured) -> bool {
        value.metric.and_then(|metric| self.metric(metric)).is_none()
    }

    /// The position of an operation that tests may hold.
    pub fn operation(&self, reference: Reference) -> Option<usize> {
        match self.target(reference)? {
            Target::Operation(at) if at < self.operations.len() => Some(at),
            _ => None,
        }
    }

    /// The positions of a campaign and of a test it performed.
    pub fn test(&self, reference: Reference) -> Option<(usize, usize)> {
        match self.target(reference)? {
            Target::Test(campaign, at) if at < self.campaigns.get(campaign)?.tests.len() => Some((campaign, at)),
            _ => None,
        }
    }

    /// The position of a variable.
    pub fn variable(&self, reference: Reference) -> Option<usize> {
        match self.target(reference)? {
            Target::Variable(at) if at < self.system.variables.len() => Some(at),
            _ => None,
        }
    }

    /// A type.
    pub fn ty(&self, reference: Reference) -> Option<&TypeOfValue> {
        match self.target(reference)? {
            Target::Type(at) => self.system.types.get(at),
            _ => None,
        }
    }
}

/// A metric.
#[derive(Debug, Clone, PartialEq)]
pub struct Metric {
    /// Its name.
    pub name: String,
    /// Where its value comes from.
    pub source: MetricSource,
    /// Whether more is sought, and not less.
    pub highest: bool,
    /// Variables that are subscribed to for it.
    pub related: Vec<Reference>,
    /// Its value where no message gave it one.
    pub default: Option<f64>,
    /// Its value for conditions before it has one.
    pub initial: Option<f64>,
    /// Whether campaigns optimise it.
    pub optimised: bool,
}

/// Where a metric's value comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MetricSource {
    /// Java code of the user's.
    Code,
    /// How long operations were active.
    FuzzingTime,
    /// Nothing: it only sent messages.
    Timing,
}

/// An operation: with all it permits, or as a test holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Operation {
    /// Its name; may be empty.
    pub name: Box<str>,
    /// What it does.
    pub kind: OperationKind,
    /// When it is active.
    pub activation: Activation,
    /// The variable whose messages it disturbs.
    pub variable: Option<Reference>,
    /// The operation of the space that it is one of.
    pub template: Option<Reference>,
    /// When it was seen to be active, in seconds.
    pub recorded: Option<(f64, f64)>,
    /// Seed of its draws.
    pub seed: i64,
    /// Which comes first.
    pub priority: i32,
    /// The probability that a fresh test holds it.
    pub inclusion: f64,
    /// Whether the time in which it is active counts.
    pub timed: bool,
    /// What its start conditions contain.
    pub constraints: Vec<Constraint>,
}

/// What an operation does to messages.
#[derive(Debug, Clone, PartialEq)]
pub enum OperationKind {
    /// Draws numbers, one for each value set, and puts them in place of values or adds them.
    RandomValue {
        /// Whether they are added.
        relative: bool,
        /// What of a message, and from what.
        values: Vec<ValueSet>,
    },
    /// Keeps messages with this probability.
    PacketLoss {
        /// From the least to the most.
        keep: (f64, f64),
    },
    /// Delays messages, in seconds.
    Latency {
        /// From the least to the most.
        delay: (f64, f64),
        /// Whether the delay is drawn for each message.
        randomised: bool,
    },
    /// Drops all messages.
    Blackhole,
    /// Java code of the user's.
    Custom {
        /// What it is given.
        parameters: Vec<ValueSet>,
    },
    /// Something that the original declares and never did.
    Other(Box<str>),
}

/// A named range or set.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueSet {
    /// What it is for: a path into a message, or a parameter's name.
    pub name: Box<str>,
    /// What it holds.
    pub domain: Domain,
}

/// What a value set holds. Bounds are as in the file, perhaps reversed.
#[derive(Debug, Clone, PartialEq)]
pub enum Domain {
    /// Numbers.
    Reals(f64, f64),
    /// Whole numbers.
    Integers(i64, i64),
    /// A box between two corners.
    Points([f64; 3], [f64; 3]),
    /// Texts.
    Texts(Vec<Box<str>>),
    /// Something the original never read.
    Other(Box<str>),
}

/// When an operation is active.
#[derive(Debug, Clone, PartialEq)]
pub enum Activation {
    /// From a time to another, in seconds.
    Time(f64, f64),
    /// From when a condition holds until another does, if there is one.
    Condition(Option<Condition>, Option<Condition>),
    /// From when a condition holds, for a time.
    ConditionFor(Option<Condition>, f64),
    /// It does not say.
    Missing,
}

/// A condition.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// A metric compared with a metric or a whole number.
    Compare(Reference, Comparison, Operand),
    /// Both hold.
    And(Box<Condition>, Box<Condition>),
    /// At least one holds.
    Or(Box<Condition>, Box<Condition>),
}

/// How two sides are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `<`
    Less,
    /// `>`
    Greater,
    /// `==`
    Equal,
}

impl From<Comparison> for sesame_plan::condition::Comparison {
    fn from(by: Comparison) -> Self {
        match by {
            Comparison::Less => Self::Below,
            Comparison::Greater => Self::Above,
            Comparison::Equal => Self::Equal,
        }
    }
}

/// The right side of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Operand {
    /// A metric.
    Metric(Reference),
    /// A whole number.
    Integer(i64),
}

/// What a start condition contains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constraint {
    /// A metric.
    Metric(Reference),
    /// A whole number, from the least to the greatest.
    Integer(i64, i64),
}

/// A campaign.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Campaign {
    /// Its name.
    pub name: String,
    /// What it measures.
    pub metrics: Vec<Reference>,
    /// What its conditions compare.
    pub condition_metrics: Vec<Reference>,
    /// What its tests may hold.
    pub included: Vec<Reference>,
    /// How tests switch operations: by conditions of so many levels, or by time; `None` where it does not say.
    pub activation: Option<ActivationMode>,
    /// How it finds tests.
    pub approach: Approach,
    /// When a test ends, in seconds.
    pub limit: Option<f64>,
    /// The tests it performed.
    pub tests: Vec<Test>,
    /// Sets of them.
    pub sets: Vec<ResultSet>,
}

/// How tests switch operations on and off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActivationMode {
    /// At times.
    Time,
    /// By conditions of so many levels.
    Condition {
        /// The levels; 0 where the file does not say.
        depth: u32,
    },
}

/// How a campaign finds tests.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Approach {
    /// It does not say.
    #[default]
    Missing,
    /// At random.
    Random,
    /// NSGA-II.
    Nsga {
        /// Tests per generation; 0 where the file does not say.
        population: u32,
        /// Tests in total.
        evaluations: u32,
        /// The cells that it counts.
        coverage: Option<Coverage>,
        /// How it boosts coverage, if it does.
        boosting: Option<Boosting>,
    },
    /// One test again and again.
    Repeat {
        /// Which.
        test: Option<Reference>,
        /// How often.
        times: u32,
    },
}

/// How a search mutates children until they lie in cells that need tests. A number that the file does not state is the
/// original's default.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Boosting {
    /// The file says that it does and nothing more: `useMutationEnhancingCoverage`.
    Unstated,
    /// In every so many generations, the children of every so many parents.
    Fixed {
        /// From one boosted generation to the next.
        generations: u32,
        /// From one boosted parent to the next.
        parents: u32,
    },
    /// In every so many generations the first children, fewer each time.
    Linear {
        /// From one boosted generation to the next.
        generations: u32,
        /// Children at the beginning.
        first: u32,
        /// Children at least.
        last: u32,
        /// How many fewer each time.
        drop: u32,
    },
    /// By a strategy of this kind, which the original does not have.
    Other(Box<str>),
}

/// Cells of the reduced parameter space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coverage {
    /// Tests that a cell must have seen.
    pub hits: u32,
    /// The share of cells at which a search stops; 0 for none.
    pub target: f64,
    /// Per dimension: its name there, where it begins and ends, and its cells.
    pub dimensions: Vec<(String, f64, f64, u32)>,
}

/// A test that was performed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Test {
    /// Its name.
    pub name: Box<str>,
    /// What it disturbed.
    pub operations: Vec<Operation>,
    /// What was measured.
    pub values: Vec<Measured>,
    /// How many metrics stand there without a value.
    pub without_value: usize,
    /// The tests it was made of.
    pub parents: Vec<Reference>,
}

/// A value that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The metric that it refers to.
    pub metric: Option<Reference>,
    /// The metric of its name.
    pub name: Option<Reference>,
    /// The value, which may be infinite or not a number.
    pub value: f64,
}

/// A set of tests.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultSet {
    /// Its name.
    pub name: String,
    /// Whether it is the campaign's result, and not one on the way.
    pub last: bool,
    /// Its tests.
    pub members: Vec<Reference>,
}

/// What is tested.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct System {
    /// What is published: name and type.
    pub variables: Vec<(String, Option<Reference>)>,
    /// Types of values.
    pub types: Vec<TypeOfValue>,
    /// Nodes.
    pub nodes: Vec<Node>,
    /// The simulator.
    pub simulator: Option<Simulator>,
}

/// A node.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Node {
    /// Its name.
    pub name: String,
    /// What it publishes.
    pub publishes: Vec<Reference>,
    /// What it subscribes to.
    pub subscribes: Vec<Reference>,
}

/// A type of values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TypeOfValue {
    /// Its name.
    pub name: String,
    /// Whether its values are a single text on the wire, and not JSON.
    pub text: bool,
    /// Its fields.
    pub fields: Vec<FieldOfType>,
}

/// A field of a type.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FieldOfType {
    /// Its name.
    pub name: String,
    /// Its type.
    pub ty: Option<Reference>,
    /// The fields in it.
    pub fields: Vec<FieldOfType>,
}

/// The simulator.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Simulator {
    /// What kind it is, for example `TTSSimulator`.
    pub kind: String,
    /// Where it was reached.
    pub address: String,
    /// Its step in milliseconds of simulation time, where it was stepped.
    pub step_ms: Option<f64>,
}
