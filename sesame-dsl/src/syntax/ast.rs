//! What a file says, before names mean anything: the grammar's constructs with their spans and doc comments.
//!
//! A construct with a syntax error is not here; but the name it was about to declare is kept in [`File::broken`], and the
//! block around it is marked as damaged, so that one mistake does not look like several.

use super::eddi::Eddi;
use super::physical::Physical;
use super::surroundings::{Command, Launch, RelayBudget};
use crate::span::Span;
use sesame_plan::Copies;

/// A whole file. Order between kinds never matters; within a kind it is the order of the file.
#[derive(Debug, Default)]
pub(crate) struct File {
    pub(crate) spaces: Vec<Head>,
    pub(crate) imports: Vec<Text>,
    pub(crate) systems: Vec<System>,
    pub(crate) metrics: Vec<Metric>,
    pub(crate) requirements: Vec<Requirement>,
    pub(crate) operations: Vec<Operation>,
    pub(crate) tests: Vec<Test>,
    pub(crate) campaigns: Vec<Campaign>,
    pub(crate) eddis: Vec<Eddi>,
    pub(crate) physicals: Vec<Physical>,
    /// Names that a broken or unsupported construct was about to declare.
    pub(crate) broken: Vec<Name>,
    /// Whether anything at the top level could not be read.
    pub(crate) damaged: bool,
    /// Whether an imported file is missing, and with it names that others use.
    pub(crate) incomplete: bool,
}

/// A name, where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) text: String,
    pub(crate) span: Span,
}

/// The head of a declaration.
#[derive(Debug, Clone)]
pub(crate) struct Head {
    pub(crate) name: Name,
    pub(crate) doc: String,
}

#[derive(Debug)]
pub(crate) struct System {
    /// The keyword.
    pub(crate) span: Span,
    pub(crate) simulators: Vec<Simulator>,
    pub(crate) messages: Vec<Message>,
    pub(crate) topics: Vec<Topic>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) launches: Vec<(Span, Launch)>,
    pub(crate) terminates: Vec<(Span, Command)>,
    pub(crate) relay_budgets: Vec<(Span, RelayBudget)>,
    pub(crate) damaged: bool,
}

#[derive(Debug)]
pub(crate) struct Simulator {
    pub(crate) head: Head,
    /// `None` for a transport that is not supported yet.
    pub(crate) transport: Option<Transport>,
}

#[derive(Debug)]
pub(crate) enum Transport {
    InProcess(InProcess),
    Process(Process),
}

#[derive(Debug)]
pub(crate) struct InProcess {
    pub(crate) path: Text,
    pub(crate) crates: Vec<(Span, Text)>,
    pub(crate) steps: Vec<(Span, Quantity)>,
    pub(crate) damaged: bool,
}

#[derive(Debug)]
pub(crate) struct Process {
    pub(crate) program: Text,
    pub(crate) arguments: Vec<Text>,
    pub(crate) steps: Vec<(Span, Quantity)>,
    /// Where it says `free running`.
    pub(crate) free_running: Vec<(Span, ())>,
    pub(crate) damaged: bool,
}

/// A quoted text without its quotes and escapes; the span includes the quotes.
#[derive(Debug, Clone)]
pub(crate) struct Text {
    pub(crate) text: String,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) head: Head,
    pub(crate) fields: Vec<Field>,
    pub(crate) damaged: bool,
}

#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) head: Head,
    pub(crate) ty: Type,
}

#[derive(Debug, Clone)]
pub(crate) struct Type {
    pub(crate) kind: TypeKind,
    pub(crate) unit: Option<UnitName>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) enum TypeKind {
    Bool,
    Int,
    Real,
    Text,
    Point,
    List(Box<Type>),
    Message(Name),
}

#[derive(Debug, Clone)]
pub(crate) struct UnitName {
    pub(crate) text: String,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) struct Topic {
    pub(crate) head: Head,
    pub(crate) path: Text,
    pub(crate) ty: Type,
}

#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) head: Head,
    pub(crate) publishes: Vec<(Span, Vec<Name>)>,
    pub(crate) subscribes: Vec<(Span, Vec<Name>)>,
}

#[derive(Debug)]
pub(crate) struct Metric {
    pub(crate) head: Head,
    pub(crate) ty: Option<Type>,
    pub(crate) directions: Vec<(Span, Direction)>,
    pub(crate) defaults: Vec<(Span, Quantity)>,
    pub(crate) initials: Vec<(Span, Quantity)>,
    pub(crate) trends: Vec<(Span, Trend)>,
    /// `accepts non_finite`.
    pub(crate) accepts: Vec<Span>,
    pub(crate) source: MetricSource,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Direction {
    Maximise,
    Minimise,
}

/// How the value of a hook's metric changes, as its author says.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Trend {
    Rising,
    Falling,
}

#[derive(Debug)]
pub(crate) enum MetricSource {
    Hook { hooks: Vec<(Span, Vec<Name>)>, damaged: bool },
    FuzzingTime,
    Formula(Box<Formula>),
}

/// What a declarative metric is computed from, with its clauses as written.
#[derive(Debug)]
pub(crate) struct Formula {
    pub(crate) kind: FormulaKind,
    pub(crate) when: Vec<(Span, Expression)>,
    pub(crate) every: Vec<(Span, Quantity)>,
    pub(crate) per: Vec<(Span, Path)>,
    pub(crate) outbound: Vec<Span>,
    /// `whole windows`.
    pub(crate) whole: Vec<Span>,
}

#[derive(Debug)]
pub(crate) enum FormulaKind {
    /// `when condition then value`.
    WhenThen(Expression, Expression),
    /// An aggregate, if it is in order.
    Plain(Expression),
}

/// A number, a point or a condition: which, is for resolution to find out. Chains are flat, so that its depth is that of
/// its parentheses.
#[derive(Debug)]
pub(crate) struct Expression {
    pub(crate) kind: ExpressionKind,
    pub(crate) span: Span,
    /// Stands in parentheses, which are part of its span.
    pub(crate) parenthesised: bool,
}

#[derive(Debug)]
pub(crate) enum ExpressionKind {
    Number(Quantity),
    Truth(bool),
    Field(Path),
    /// `max of zones.level`; the span is that of the word.
    Members(Members, Span, Path),
    Negate(Box<Expression>),
    /// Two terms or more; true for one that is subtracted.
    Sum(Vec<(bool, Expression)>),
    /// Two factors or more; true for one that divides.
    Product(Vec<(bool, Expression)>),
    Compare(Box<Expression>, Relation, Box<Expression>),
    /// One word or more before it, the outermost first.
    Prefixed(Vec<Prefix>, Box<Expression>),
    Until(Box<Expression>, Until, Box<Expression>),
    All(Vec<Expression>),
    Any(Vec<Expression>),
    Implies(Box<Expression>, Box<Expression>),
    Call(Name, Vec<Expression>),
}

/// How two values of a formula compare: as those of a bound do, or by being different.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Relation {
    Comparison(Comparison),
    NotEqual,
}

/// A word before a condition.
#[derive(Debug)]
pub(crate) struct Prefix {
    pub(crate) word: PrefixWord,
    pub(crate) span: Span,
    pub(crate) interval: Option<Range>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PrefixWord {
    Not,
    Always,
    Eventually,
}

/// The word between two sides, and its interval.
#[derive(Debug)]
pub(crate) struct Until {
    pub(crate) span: Span,
    pub(crate) interval: Option<Range>,
}

/// What a group of topics is taken as, other than its minimum.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Members {
    Max,
    Sum,
    Each,
}

/// A topic, and fields of its message.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub(crate) topic: Name,
    pub(crate) fields: Vec<Name>,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) struct Requirement {
    pub(crate) head: Head,
    pub(crate) text: Text,
    pub(crate) metric: Name,
    pub(crate) bound: Bound,
}

#[derive(Debug)]
pub(crate) enum Bound {
    Compare(Comparison, Quantity),
    Within(Range),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Comparison {
    AtMost,
    Below,
    AtLeast,
    Above,
    Equal,
}

/// A number with its sign and unit.
#[derive(Debug, Clone)]
pub(crate) struct Quantity {
    /// Finite, or NaN for one whose digits were already reported.
    pub(crate) value: f64,
    pub(crate) unit: Option<UnitName>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct Range {
    pub(crate) low: Quantity,
    pub(crate) high: Quantity,
    pub(crate) span: Span,
}

/// A whole number as written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count {
    /// `None` for one that was already reported.
    pub(crate) value: Option<u64>,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) struct Operation {
    pub(crate) head: Head,
    /// `None` for a kind that is not supported yet.
    pub(crate) body: Option<OperationBody>,
}

#[derive(Debug)]
pub(crate) struct OperationBody {
    /// `None` for an operation on no topic.
    pub(crate) target: Option<Target>,
    pub(crate) from: Option<(Span, Vec<Name>)>,
    pub(crate) to: Option<(Span, Vec<Name>)>,
    pub(crate) kind: OperationKind,
    pub(crate) within: Vec<(Span, Range)>,
    pub(crate) priority: Vec<(Span, Quantity)>,
    pub(crate) inclusion: Vec<(Span, Quantity)>,
    pub(crate) untimed: Vec<Span>,
    pub(crate) contains: Vec<(Span, Vec<Contained>)>,
}

/// What an operation disturbs.
#[derive(Debug)]
pub(crate) struct Target {
    /// The topic of the first place.
    pub(crate) topic: Name,
    /// At least one.
    pub(crate) places: Vec<Place>,
    pub(crate) span: Span,
}

/// A place in the messages of a topic.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) topic: Name,
    pub(crate) steps: Vec<Step>,
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) enum Step {
    Field(Name),
    /// `[3]`; the span includes the brackets.
    Element(Count, Span),
    /// `[*]`
    Each(Span),
}

/// What the start condition of an operation has to contain.
#[derive(Debug)]
pub(crate) enum Contained {
    Variable(Name),
    /// A whole number; the span is that of all of it.
    Integer(Span, Range),
}

#[derive(Debug)]
pub(crate) enum OperationKind {
    Random {
        absolute: bool,
        amounts: Amounts,
    },
    RandomText(Vec<Text>),
    StuckAt(Stuck),
    Bias(Amounts),
    Drift(Amounts),
    Noise(Range),
    Scale(Range),
    NotFinite(NotFinite),
    Freeze,
    Stale(Range),
    ClockSkew(Range),
    PacketLoss(Range),
    /// The words `burst loss`, and the clauses as written.
    BurstLoss {
        span: Span,
        enter: Vec<(Span, Range)>,
        leave: Vec<(Span, Range)>,
        loss: Vec<(Span, Range)>,
    },
    RateLimit(Range),
    Latency {
        range: Range,
        distribution: Vec<(Span, Distribution)>,
        drain: Vec<(Span, Drain)>,
    },
    Reorder {
        range: Range,
        drain: Vec<(Span, Drain)>,
    },
    Duplicate(Range),
    Blackhole,
    Custom(Custom),
}

impl OperationKind {
    /// Where it is written what a parameter of a kind, other than a custom one, may be.
    pub(crate) fn written(&self, parameter: &str) -> Option<Span> {
        match self {
            OperationKind::Random { amounts, .. } | OperationKind::Bias(amounts) | OperationKind::Drift(amounts) => {
                Some(amounts.span())
            }
            OperationKind::StuckAt(Stuck::Amounts(amounts)) => Some(amounts.span()),
            OperationKind::StuckAt(Stuck::Texts(texts)) => Some(texts.first()?.span.to(texts.last()?.span)),
            OperationKind::Noise(range)
            | OperationKind::Scale(range)
            | OperationKind::Stale(range)
            | OperationKind::ClockSkew(range)
            | OperationKind::PacketLoss(range)
            | OperationKind::RateLimit(range)
            | OperationKind::Latency { range, .. }
            | OperationKind::Reorder { range, .. }
            | OperationKind::Duplicate(range) => Some(range.span),
            OperationKind::BurstLoss { enter, leave, loss, .. } => {
                let written = match parameter {
                    "enter" => enter,
                    "leave" => leave,
                    _ => loss,
                };
                written.first().map(|(_, range)| range.span)
            }
            OperationKind::StuckAt(Stuck::Truth(..))
            | OperationKind::RandomText(_)
            | OperationKind::NotFinite(_)
            | OperationKind::Freeze
            | OperationKind::Blackhole
            | OperationKind::Custom(_) => None,
        }
    }
}

/// Numbers of a range, or points of a box.
#[derive(Debug)]
pub(crate) enum Amounts {
    Range(Range),
    /// Two opposite corners; the span is that of all of it.
    Corners(Box<[Point; 2]>, Span),
}

impl Amounts {
    pub(crate) fn span(&self) -> Span {
        match self {
            Amounts::Range(range) => range.span,
            Amounts::Corners(_, span) => *span,
        }
    }
}

/// What a value is stuck at.
#[derive(Debug)]
pub(crate) enum Stuck {
    Amounts(Amounts),
    Texts(Vec<Text>),
    Truth(bool, Span),
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum NotFinite {
    Nan,
    Infinity,
    MinusInfinity,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Distribution {
    Fixed,
    Uniform,
    Normal,
}

/// The user's code.
#[derive(Debug)]
pub(crate) struct Custom {
    /// The word `custom`.
    pub(crate) span: Span,
    pub(crate) moment: Option<(Span, Moment)>,
    pub(crate) parameters: Vec<CustomParameter>,
    pub(crate) damaged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moment {
    BeforeStart,
    AfterEnd,
}

#[derive(Debug)]
pub(crate) struct CustomParameter {
    pub(crate) name: Name,
    pub(crate) doc: String,
    pub(crate) domain: Domain,
    /// The domain as written.
    pub(crate) span: Span,
}

#[derive(Debug)]
pub(crate) enum Domain {
    Number {
        integer: bool,
        unit: Option<UnitName>,
        range: Range,
    },
    /// Two opposite corners.
    Point {
        unit: Option<UnitName>,
        corners: Box<[Point; 2]>,
    },
    Texts(Vec<Text>),
    Files(Vec<Text>),
}

/// Three numbers of one unit.
#[derive(Debug)]
pub(crate) struct Point {
    /// Each with the point's unit.
    pub(crate) coordinates: [Quantity; 3],
    pub(crate) span: Span,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Drain {
    Finish,
    Flush,
    Drop,
}

#[derive(Debug)]
pub(crate) struct Test {
    pub(crate) head: Head,
    pub(crate) operations: Vec<TestOperation>,
    pub(crate) expectations: Vec<Expectation>,
    pub(crate) damaged: bool,
}

#[derive(Debug)]
pub(crate) struct TestOperation {
    pub(crate) operation: Name,
    pub(crate) choices: Vec<(Name, Choice)>,
    pub(crate) activation: Activation,
    pub(crate) seed: Option<Count>,
}

/// When an operation of a test is active.
#[derive(Debug)]
pub(crate) enum Activation {
    Window(Range),
    Trigger(Box<Trigger>),
    /// In the place of a window.
    Moment(Span, Moment),
}

/// Activation by condition. What the conditions may hold, is for resolution to say.
#[derive(Debug)]
pub(crate) struct Trigger {
    pub(crate) start: Expression,
    pub(crate) end: TriggerEnd,
    pub(crate) times: Option<Count>,
}

#[derive(Debug)]
pub(crate) enum TriggerEnd {
    Until(Expression),
    For(Quantity),
}

#[derive(Debug)]
pub(crate) enum Choice {
    Value(Quantity),
    Range(Range),
    Point(Point),
    Text(Text),
}

impl Choice {
    pub(crate) fn span(&self) -> Span {
        match self {
            Choice::Value(quantity) => quantity.span,
            Choice::Range(range) => range.span,
            Choice::Point(point) => point.span,
            Choice::Text(text) => text.span,
        }
    }
}

#[derive(Debug)]
pub(crate) struct Expectation {
    pub(crate) metric: Name,
    pub(crate) bound: Bound,
}

#[derive(Debug)]
pub(crate) struct Campaign {
    pub(crate) head: Head,
    /// The campaign it inherits from.
    pub(crate) from: Option<Name>,
    /// Clauses that stand in that one.
    pub(crate) inherited: Inherited,
    pub(crate) objectives: Vec<(Span, Vec<Name>)>,
    pub(crate) observes: Vec<(Span, Vec<Name>)>,
    pub(crate) operations: Vec<Operations>,
    pub(crate) activates: Vec<(Span, ActivationMode)>,
    pub(crate) searches: Vec<Search>,
    pub(crate) coverages: Vec<Coverage>,
    pub(crate) explorations: Vec<Exploration>,
    pub(crate) confirms: Vec<Confirm>,
    pub(crate) stops: Vec<Stop>,
    pub(crate) repeats: Vec<Repeat>,
    pub(crate) passives: Vec<Passive>,
    pub(crate) ends: Vec<(Span, Quantity)>,
    pub(crate) records: Vec<(Span, Record)>,
    /// Something of it could not be read or is not supported: what is missing may be there. So too with a `from`, since
    /// what the other campaign lacks is said of that one.
    pub(crate) damaged: bool,
    /// Something of it, or of what it inherits from, could not be read: nothing is known of what it has not.
    pub(crate) unread: bool,
}

/// Which clauses a campaign has from another, as far as it matters for what is said of them.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Inherited {
    pub(crate) operations: bool,
    pub(crate) activate: bool,
    pub(crate) end: bool,
}

/// How the tests of a search switch operations on and off.
#[derive(Debug, Clone)]
pub(crate) enum ActivationMode {
    Time,
    Condition(ByCondition),
}

/// `condition over …`, with its settings as written.
#[derive(Debug, Clone)]
pub(crate) struct ByCondition {
    /// The variables and their known ranges, as long as each other.
    pub(crate) variables: Vec<Name>,
    pub(crate) ranges: Vec<Option<Range>>,
    pub(crate) depth: Vec<(Span, Count)>,
    pub(crate) integers: Vec<(Span, Range)>,
    pub(crate) lengths: Vec<(Span, Range)>,
    pub(crate) times: Vec<(Span, Count)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Record {
    Failing,
    All,
}

#[derive(Debug, Clone)]
pub(crate) struct Operations {
    pub(crate) span: Span,
    pub(crate) names: Vec<Name>,
    pub(crate) min: Count,
    pub(crate) max: Count,
    /// What is written of several copies of one operation, and where; `None` where nothing is.
    pub(crate) copies: Option<(Span, Copies)>,
}

#[derive(Debug, Clone)]
pub(crate) struct Search {
    pub(crate) span: Span,
    /// `None` for a strategy that is not supported yet.
    pub(crate) strategy: Option<Strategy>,
    pub(crate) population: Vec<(Span, Count)>,
    pub(crate) evaluations: Vec<(Span, Count)>,
    pub(crate) seed: Vec<(Span, Count)>,
    pub(crate) neighbours: Vec<(Span, Count)>,
    pub(crate) damaged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Strategy {
    Nsga2,
    Random,
    MapElites,
    LatinHypercube,
    Sobol,
    Falsification,
}

#[derive(Debug, Clone)]
pub(crate) struct Coverage {
    pub(crate) span: Span,
    pub(crate) axes: Vec<CoverageAxis>,
    pub(crate) hits: Vec<(Span, Count)>,
    pub(crate) stops: Vec<(Span, Quantity)>,
    pub(crate) failsafes: Vec<(Span, Count)>,
    pub(crate) damaged: bool,
}

#[derive(Debug, Clone)]
pub(crate) struct CoverageAxis {
    pub(crate) dimension: Name,
    pub(crate) range: Range,
    pub(crate) cells: Count,
}

/// `boost fixed { … }`, `boost linear { … }`, `construct { … }`, `predict { … }` or `novelty { … }`, with the settings as
/// written.
#[derive(Debug, Clone)]
pub(crate) struct Exploration {
    pub(crate) span: Span,
    pub(crate) kind: ExplorationKind,
    pub(crate) generations: Vec<(Span, Count)>,
    pub(crate) iterations: Vec<(Span, Count)>,
    pub(crate) tries: Vec<(Span, Count)>,
    /// How many children at the beginning, and at the end.
    pub(crate) children: Vec<(Span, [Count; 2])>,
    pub(crate) drops: Vec<(Span, Count)>,
    pub(crate) shares: Vec<(Span, Quantity)>,
    pub(crate) untils: Vec<(Span, Quantity)>,
    pub(crate) candidates: Vec<(Span, Count)>,
    pub(crate) neighbours: Vec<(Span, Count)>,
    /// Dimensions.
    pub(crate) overs: Vec<(Span, Vec<Name>)>,
    pub(crate) damaged: bool,
}

/// `confirm 5 times { … }` with its settings as written.
#[derive(Debug, Clone)]
pub(crate) struct Confirm {
    pub(crate) span: Span,
    pub(crate) times: Count,
    pub(crate) by: Vec<(Span, Typical)>,
    /// Where `violations` is written.
    pub(crate) violations: Vec<(Span, ())>,
}

/// What the values of several runs are taken for.
#[derive(Debug, Clone)]
pub(crate) enum Typical {
    Mean,
    Median,
    Quantile(Quantity),
}

/// `stop { … }` with its rules as written.
#[derive(Debug, Clone)]
pub(crate) struct Stop {
    pub(crate) span: Span,
    pub(crate) times: Vec<(Span, Quantity)>,
    pub(crate) stagnations: Vec<(Span, (Count, Quantity))>,
    pub(crate) discoveries: Vec<(Span, Quantity)>,
    pub(crate) completenesses: Vec<(Span, Quantity)>,
    pub(crate) damaged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ExplorationKind {
    BoostFixed,
    BoostLinear,
    Construct,
    Predict,
    Novelty,
}

#[derive(Debug, Clone)]
pub(crate) struct Repeat {
    pub(crate) span: Span,
    pub(crate) test: Name,
    pub(crate) times: Count,
    pub(crate) seed: Vec<(Span, Count)>,
}

/// Runs that disturb nothing.
#[derive(Debug, Clone)]
pub(crate) struct Passive {
    pub(crate) span: Span,
    pub(crate) times: Count,
    pub(crate) seed: Vec<(Span, Count)>,
}
