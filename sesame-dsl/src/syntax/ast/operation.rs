//! Operations: what they disturb, and how.

use sesame_grammar::Rule;
use sesame_plan::Counted;

use super::words::{Count, Head, Name, Path, Point, Quantity, Range, Text, UnitName, WithMember};
use crate::span::Span;

#[derive(Debug)]
pub(crate) struct Operation {
    pub(crate) head: Head,
    pub(crate) body: OperationBody,
}

#[derive(Debug)]
pub(crate) struct OperationBody {
    /// One for each topic, in the order of their first places; none for an operation on no topic.
    pub(crate) targets: Vec<Target>,
    /// How many members of its groups a test chooses.
    pub(crate) chosen: Option<Chosen>,
    /// What it acts on instead of messages; not together with targets.
    pub(crate) resource: Option<Resource>,
    pub(crate) from: Option<(Span, Vec<WithMember>)>,
    pub(crate) to: Option<(Span, Vec<WithMember>)>,
    pub(crate) kind: OperationKind,
    /// The first word of the kind.
    pub(crate) kind_word: Span,
    pub(crate) within: Vec<(Span, Range)>,
    /// `for`
    pub(crate) lengths: Vec<(Span, Range)>,
    pub(crate) priority: Vec<(Span, Quantity)>,
    pub(crate) inclusion: Vec<(Span, Quantity)>,
    pub(crate) untimed: Vec<Span>,
    /// `next … messages` and `every … messages`, in written order.
    pub(crate) counted: Vec<(Counted, Span, Range)>,
    /// With the turn in which angles stay, if it is written.
    pub(crate) wrapped: Vec<(Span, Option<Range>)>,
    pub(crate) contains: Vec<(Span, Vec<Contained>)>,
}

impl OperationBody {
    /// What has nothing but a kind.
    pub(crate) fn of_kind(kind: OperationKind, kind_word: Span) -> Self {
        OperationBody {
            targets: Vec::new(),
            chosen: None,
            resource: None,
            from: None,
            to: None,
            kind,
            kind_word,
            within: vec![],
            lengths: vec![],
            priority: vec![],
            inclusion: vec![],
            untimed: vec![],
            counted: vec![],
            wrapped: vec![],
            contains: vec![],
        }
    }
}

/// What an operation disturbs of one topic.
#[derive(Debug)]
pub(crate) struct Target {
    pub(crate) topic: Name,
    /// At least one, all of this topic.
    pub(crate) places: Vec<Path>,
    /// From its first place to its last.
    pub(crate) span: Span,
}

/// How many members of a group a test chooses: `one of`, `1..2 of`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chosen {
    pub(crate) least: Count,
    pub(crate) most: Count,
    pub(crate) span: Span,
}

/// A node, or a parameter of one, with the words before it.
#[derive(Debug)]
pub(crate) struct Resource {
    pub(crate) parameter: Option<Text>,
    pub(crate) node: WithMember,
    /// How many members of the group a test chooses.
    pub(crate) chosen: Option<Chosen>,
    pub(crate) span: Span,
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
    /// On messages, words of the language with at most one amount after them: `blackhole`, `noise [0m, 1m]`, or
    /// `bias [(0, 0, 0)m, (1, 1, 1)m]`. Which kind it is, and whether it has an amount, is as the rule of the grammar
    /// says.
    Plain {
        rule: Rule,
        amounts: Option<Amounts>,
    },
    /// A kind that acts on nodes or their parameters instead of messages.
    OnNode(OnNode),
    Random {
        absolute: bool,
        amounts: Amounts,
    },
    RandomText(Vec<Text>),
    /// Names of constants of messages; at least one.
    RandomConstant(Vec<Path>),
    StuckAt(Stuck),
    NotFinite(NotFinite),
    /// The words `burst loss`, and the clauses as written.
    BurstLoss {
        span: Span,
        enter: Vec<(Span, Range)>,
        leave: Vec<(Span, Range)>,
        loss: Vec<(Span, Range)>,
    },
    Latency {
        range: Range,
        distribution: Vec<(Span, Distribution)>,
        drain: Vec<(Span, Drain)>,
    },
    Reorder {
        range: Range,
        drain: Vec<(Span, Drain)>,
    },
    Custom(Custom),
    Scene(Scene),
}

/// A parameter of the simulator that is chosen for a whole run.
#[derive(Debug)]
pub(crate) struct Scene {
    /// Its name in the simulator, if that is another one.
    pub(crate) known_as: Option<Text>,
    pub(crate) integer: bool,
    pub(crate) unit: Option<UnitName>,
    pub(crate) range: Range,
    /// Its value in runs that choose none.
    pub(crate) usual: Option<Quantity>,
}

impl OperationKind {
    /// The names of constants of messages in it.
    pub(crate) fn constants(&self) -> &[Path] {
        match self {
            OperationKind::StuckAt(Stuck::Constants(names)) | OperationKind::RandomConstant(names) => names,
            _ => &[],
        }
    }

    /// Where it is written what a parameter of a kind, other than a custom one, may be.
    pub(crate) fn written(&self, parameter: &str) -> Option<Span> {
        match self {
            OperationKind::Plain { amounts, .. } => amounts.as_ref().map(Amounts::span),
            OperationKind::OnNode(OnNode::Set(New::Values(values))) => {
                Some(values.first()?.span().to(values.last()?.span()))
            }
            OperationKind::Random { amounts, .. } | OperationKind::StuckAt(Stuck::Amounts(amounts)) => {
                Some(amounts.span())
            }
            OperationKind::StuckAt(Stuck::Texts(texts)) => Some(texts.first()?.span.to(texts.last()?.span)),
            OperationKind::StuckAt(Stuck::Constants(names)) => Some(names.first()?.span.to(names.last()?.span)),
            OperationKind::Latency { range, .. }
            | OperationKind::Reorder { range, .. }
            | OperationKind::OnNode(OnNode::Set(New::Range(range)) | OnNode::Slow(range))
            | OperationKind::Scene(Scene { range, .. }) => Some(range.span),
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
            | OperationKind::RandomConstant(_)
            | OperationKind::NotFinite(_)
            | OperationKind::OnNode(OnNode::Transition(_) | OnNode::Pause | OnNode::Kill)
            | OperationKind::Custom(_) => None,
        }
    }
}

/// What is done to a node or to one of its parameters.
#[derive(Debug)]
pub(crate) enum OnNode {
    Set(New),
    /// A transition of its lifecycle, by its name.
    Transition(Name),
    Pause,
    Slow(Range),
    Kill,
}

/// What a parameter of a node is set to.
#[derive(Debug)]
pub(crate) enum New {
    /// A number.
    Range(Range),
    /// One of these; at least one.
    Values(Vec<NewValue>),
}

/// A value that is given to a parameter of a node.
#[derive(Debug)]
pub(crate) enum NewValue {
    Truth(bool, Span),
    Text(Text),
    List(Vec<Item>, Span),
}

impl NewValue {
    pub(crate) fn span(&self) -> Span {
        match self {
            NewValue::Truth(_, span) | NewValue::List(_, span) => *span,
            NewValue::Text(text) => text.span,
        }
    }
}

/// An item of a list.
#[derive(Debug)]
pub(crate) enum Item {
    Truth(bool, Span),
    Text(Text),
    Number(Quantity),
}

impl Item {
    pub(crate) fn span(&self) -> Span {
        match self {
            Item::Truth(_, span) => *span,
            Item::Text(text) => text.span,
            Item::Number(number) => number.span,
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
    /// Names of constants of messages; at least one.
    Constants(Vec<Path>),
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
    pub(crate) has_errors: bool,
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

#[derive(Debug, Clone, Copy)]
pub(crate) enum Drain {
    Finish,
    Flush,
    Drop,
}
