//! Fuzzing operations with the ranges that they permit.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::condition::Constraint;
use crate::{Choice, Comparison, NodeId, OperationKind, TopicId};

/// A fuzzing operation with its permitted ranges. A test holds instances of it, see [`crate::TestOperation`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The topic whose messages it disturbs, the first if they are several; `None` exactly for one that acts on no
    /// messages: a custom operation before the start or after the end, or one on a node.
    pub topic: Option<TopicId>,
    /// The members of a group, of the first topic or of nodes, on which it acts; `None` for all topics of a group, or
    /// for an operation that acts on no group. The nodes of a group follow each other, and that of the kind is the
    /// first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub members: Option<MembersOf>,
    /// Only messages that these nodes publish; none for all messages.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub from: Vec<NodeId>,
    /// Only messages on their way to these nodes, for each of them apart; none for all messages, each before it is
    /// fanned out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub to: Vec<NodeId>,
    /// The values in each message of the first topic that it changes, in written order; none exactly where it acts on
    /// whole messages.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ValuePath>,
    /// The other topics that it disturbs at the same times and with the same choices, as a common cause does; no topic
    /// twice. Tests choose members of all of them, or of none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<Target>,
    /// What it does to them.
    pub kind: OperationKind,
    /// The parameters a test chooses, in the order that [`OperationKind`] documents, then one for each of `counted`,
    /// then that of chosen members.
    pub parameters: Vec<Parameter>,
    /// By what a test counts out the messages that it alters while it is active; none for all messages, and then not
    /// written. Each once, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub counted: Vec<Counted>,
    /// The time outside of which it is never active (`within`); seconds, `start < end`. For an offline operation, which
    /// is never active, the whole run.
    pub within: Span,
    /// How long it is active at a time (`for`): the length of a window, or of an activation by condition. Without it,
    /// `within` is the only limit, and it is not written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lengths: Option<Lengths>,
    /// Operations of a higher priority come first on a message; equal ones in declaration order. Default 0.
    pub priority: i32,
    /// Probability that a fresh test includes it. Default 1.
    pub inclusion: f64,
    /// Whether its active time counts in `fuzzing_time()`. Default true, and then not written.
    #[serde(default = "timed", skip_serializing_if = "is_timed")]
    pub timed: bool,
    /// The turn in which it keeps the numbers that it changes, which are angles; `None` where it leaves them as they
    /// come, and then not written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrapped: Option<Turn>,
    /// What its start conditions contain where a search grows them.
    pub constraints: Vec<Constraint>,
}

/// A topic that an operation disturbs in addition to its first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Target {
    /// The topic.
    pub topic: TopicId,
    /// The members of a group, as [`Operation::members`] has them of the first topic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub members: Option<MembersOf>,
    /// The values that it changes, as [`Operation::places`] has them of the first topic.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ValuePath>,
}

impl Target {
    fn as_ref(&self) -> TargetRef<'_> {
        TargetRef { topic: self.topic, members: self.members.as_ref(), places: &self.places }
    }
}

/// A topic that an operation disturbs, and what of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetRef<'a> {
    /// The topic.
    pub topic: TopicId,
    /// The members of a group; `None` for all of them, or for a topic that is not a group.
    pub members: Option<&'a MembersOf>,
    /// The values in each message; none where it acts on whole messages.
    pub places: &'a [ValuePath],
}

impl Operation {
    /// What it disturbs: each topic once, in written order.
    pub fn targets(&self) -> impl Iterator<Item = TargetRef<'_>> {
        let first = self.topic.map(|topic| TargetRef { topic, members: self.members.as_ref(), places: &self.places });
        first.into_iter().chain(self.further.iter().map(Target::as_ref))
    }

    /// The topics that it disturbs, each once, in written order.
    pub fn topics(&self) -> impl Iterator<Item = TopicId> {
        self.topic.into_iter().chain(self.further.iter().map(|target| target.topic))
    }

    /// Whether it disturbs a topic.
    pub fn disturbs(&self, topic: TopicId) -> bool {
        self.topics().any(|own| own == topic)
    }

    /// What it disturbs of a topic, with its position among the [targets](Operation::targets).
    pub fn target_on(&self, topic: TopicId) -> Option<(usize, TargetRef<'_>)> {
        self.targets().enumerate().find(|(_, target)| target.topic == topic)
    }

    /// Whether some test makes it act on a path of a topic, by its position among the members.
    pub fn may_act_on(&self, topic: TopicId, member: usize) -> bool {
        let has = |members: &MembersOf| u32::try_from(member).is_ok_and(|member| members.may_have(member));
        self.target_on(topic).is_some_and(|(_, target)| target.members.is_none_or(has))
    }

    /// Whether it acts on a path of a topic, by its position among the members, with these choices of a test.
    pub fn acts_on(&self, topic: TopicId, member: usize, choices: &[Choice]) -> bool {
        self.target_on(topic).is_some_and(|(_, target)| self.acts_on_member(target, member, choices))
    }

    /// Where the parameters by which a test counts messages begin: behind those of its kind.
    fn first_counted(&self) -> usize {
        let chosen = usize::from(matches!(self.members, Some(MembersOf::Chosen(_))));
        self.parameters.len().saturating_sub(chosen + self.counted.len())
    }

    /// The parameters of its kind.
    pub fn own_parameters(&self) -> &[Parameter] {
        &self.parameters[..self.first_counted()]
    }

    /// The parameters by which a test counts messages.
    pub fn counting_parameters(&self) -> impl Iterator<Item = (Counted, &Parameter)> {
        self.counted.iter().copied().zip(&self.parameters[self.first_counted()..])
    }

    /// Which messages it alters with these choices of a test, of those on one wire while it is active.
    pub fn counts(&self, choices: &[Choice]) -> Counts {
        let mut counts = Counts::ALL;
        let counting = self.counted.iter().zip(choices.iter().skip(self.first_counted()));
        for (counted, choice) in counting {
            let Choice::Value { value } = choice else { continue };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` clamps")]
            let count = (*value as u64).max(1);
            match counted {
                Counted::Next => counts.next = Some(count),
                Counted::Every => counts.every = count,
            }
        }
        counts
    }

    /// The number at which the parameter at a position disturbs nothing, or least, as
    /// [`OperationKind::neutral_value`] says: few messages, far apart.
    pub fn neutral_value(&self, parameter: usize) -> Option<f64> {
        let counted = parameter.checked_sub(self.first_counted()).and_then(|at| self.counted.get(at));
        match counted {
            Some(Counted::Next) => Some(0.0),
            Some(Counted::Every) => Some(f64::INFINITY),
            None => self.kind.neutral_value(&self.parameters.get(parameter)?.name),
        }
    }

    /// Whether it acts on a path of one of its targets, by its position among the members, with these choices of a
    /// test.
    pub fn acts_on_member(&self, target: TargetRef<'_>, member: usize, choices: &[Choice]) -> bool {
        let among = |members| self.members_of_test(members, choices).iter().any(|&one| one as usize == member);
        target.members.is_none_or(among)
    }

    /// Which members are meant with these choices of a test. A choice that its parameter does not permit has none.
    fn members_of_test<'a>(&self, members: &'a MembersOf, choices: &[Choice]) -> &'a [u32] {
        match members {
            MembersOf::These(these) => these,
            MembersOf::Chosen(permitted) => {
                let chosen = self.choice_of_members(choices).and_then(|choice| permitted.get(choice as usize));
                chosen.map_or(&[], Vec::as_slice)
            }
        }
    }

    /// Which of the permitted choices of members a test makes; `None` for an operation whose tests choose none.
    pub fn choice_of_members(&self, choices: &[Choice]) -> Option<u32> {
        let texts = self.choices_of_members()?;
        let Some(Choice::Text { text }) = choices.get(self.parameters.len() - 1) else { return None };
        u32::try_from(texts.iter().position(|item| item == text)?).ok()
    }

    /// The texts by which a test chooses members, in the order of the choices of [`MembersOf::Chosen`]: what the last
    /// parameter permits; `None` for an operation whose tests choose none.
    pub fn choices_of_members(&self) -> Option<&[String]> {
        let Some(MembersOf::Chosen(_)) = &self.members else { return None };
        self.parameters.last()?.domain.items()
    }

    /// The nodes on which it acts with these choices of a test, if it acts on nodes.
    pub fn nodes_of_test(&self, choices: &[Choice]) -> Vec<NodeId> {
        self.nodes_at(self.members.as_ref().map_or(&[0], |members| self.members_of_test(members, choices)))
    }

    /// The nodes on which some test makes it act, each once, if it acts on nodes.
    pub fn nodes(&self) -> Vec<NodeId> {
        match &self.members {
            None => self.nodes_at(&[0]),
            Some(MembersOf::These(these)) => self.nodes_at(these),
            Some(MembersOf::Chosen(choices)) => {
                let members: BTreeSet<u32> = choices.iter().flatten().copied().collect();
                self.nodes_at(&Vec::from_iter(members))
            }
        }
    }

    /// The nodes of these members.
    fn nodes_at(&self, members: &[u32]) -> Vec<NodeId> {
        let Some(NodeId(first)) = self.kind.node() else { return Vec::new() };
        members.iter().map(|member| NodeId(first.saturating_add(*member))).collect()
    }
}

/// By what a test counts out the messages that an operation alters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    /// The next ones of an activation: how many of them.
    Next,
    /// Every second, every third and so on: the first one that it alters is the second, or the third.
    Every,
}

impl Counted {
    /// The most that may be permitted, which no run has.
    pub const MOST: f64 = 1e9;

    /// Its name, and that of its parameter, in the language.
    pub const fn name(self) -> &'static str {
        match self {
            Counted::Next => "next",
            Counted::Every => "every",
        }
    }
}

/// Which messages an operation alters, of those on one wire while it is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// How many it alters at most; `None` for any number.
    pub next: Option<u64>,
    /// How many messages there are for each that it alters, which is the last of them; at least 1.
    pub every: u64,
}

impl Counts {
    /// All messages.
    pub const ALL: Counts = Counts { next: None, every: 1 };
}

/// Members of a group, by their positions.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MembersOf {
    /// These: at least one, in ascending order.
    These(Vec<u32>),
    /// Those that a test chooses by the last parameter, a text: for each of its texts the members, as with
    /// [`MembersOf::These`].
    Chosen(Vec<Vec<u32>>),
}

impl MembersOf {
    /// Whether some test has this member.
    pub fn may_have(&self, member: u32) -> bool {
        match self {
            MembersOf::These(these) => these.contains(&member),
            MembersOf::Chosen(choices) => choices.iter().any(|these| these.contains(&member)),
        }
    }
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

/// One whole turn, in the unit of an angle: from `low` up to and not including `high`, which are finite and apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Turn {
    /// The least angle.
    pub low: f64,
    /// The angle that is the least one again.
    pub high: f64,
}

/// The permitted lengths of windows, in seconds; `0 <= low <= high`, and `high` is more than 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lengths {
    /// The shortest.
    pub low: f64,
    /// The longest.
    pub high: f64,
}

impl Lengths {
    /// Whether a length is permitted, to the nanosecond: a length is the difference of two times, which are rounded.
    pub fn contain(self, length: f64) -> bool {
        const NANOSECOND: f64 = 1e-9;
        self.low - NANOSECOND <= length && length <= self.high + NANOSECOND
    }

    /// The lengths that are in both, if any is.
    pub fn shared(self, other: Lengths) -> Option<Lengths> {
        let shared = Lengths { low: self.low.max(other.low), high: self.high.min(other.high) };
        (shared.low <= shared.high).then_some(shared)
    }
}

/// When a campaign by time permits an operation to be active, as far as it limits how many copies fit into a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Times {
    /// Never during the run: it acts before the start or after the end.
    Offline,
    /// In windows of these lengths inside a stretch of so many seconds.
    Windows {
        /// How long the stretch is.
        room: f64,
        /// How long the windows are; `None` where the stretch is the only limit.
        lengths: Option<Lengths>,
    },
}

/// Where in a message a value is: from the message inwards; empty for the message itself.
pub type ValuePath = Vec<Step>;

/// One step into a message.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// The field of this name.
    Field(String),
    /// The element of a list at this position, from 0; none in a list that is shorter.
    Element(u32),
    /// The elements of a list from one position to another, from 0 and both included, as far as there are some.
    Elements {
        /// The first.
        first: u32,
        /// The last; not before the first.
        last: u32,
    },
    /// Each element of a list.
    Each,
    /// The elements of a list of which something holds.
    Filter(Filter),
}

/// Which elements of a list are chosen.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Filter {
    /// What of each element is compared.
    pub key: FilterKey,
    /// How it is compared.
    pub by: Comparison,
    /// With what. Texts and truth values are equal, or they are not.
    pub with: Compared,
}

/// What of an element of a list a filter compares.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FilterKey {
    /// The value at the end of this path of fields into the element; the element itself if it is empty.
    Own(Vec<String>),
    /// The element at the same position of another list in the same message: `name` of `position[name == "elbow"]`.
    Parallel(String),
}

/// What a filter compares with.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compared {
    /// A text.
    Text(String),
    /// A number, as it is on the wire.
    Number {
        /// The number.
        value: Finite,
        /// Its unit; `None` for a plain number.
        unit: Option<String>,
    },
    /// True or false.
    Truth(bool),
}

/// A finite number, which therefore has an order and is equal to itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Finite(pub f64);

impl Eq for Finite {}

impl PartialOrd for Finite {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Finite {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The path to a value behind a topic's name, as the `.sesame` file has it: `.level`, `[3]`, `.ranges[*]`.
pub fn value_path_in_words(path: &[Step]) -> String {
    let step = |step: &Step| match step {
        Step::Field(name) => format!(".{name}"),
        Step::Element(at) => format!("[{at}]"),
        Step::Elements { first, last } => format!("[{first}..{last}]"),
        Step::Each => "[*]".to_owned(),
        Step::Filter(Filter { key, by, with }) => {
            let key = match key {
                FilterKey::Own(path) if path.is_empty() => "*".to_owned(),
                FilterKey::Own(path) => path.join("."),
                FilterKey::Parallel(name) => name.clone(),
            };
            let with = match with {
                Compared::Text(text) => format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"")),
                Compared::Number { value, unit } => format!("{}{}", value.0, unit.as_deref().unwrap_or_default()),
                Compared::Truth(truth) => truth.to_string(),
            };
            format!("[{key} {} {with}]", by.sign())
        }
    };
    path.iter().map(step).collect()
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

impl Parameter {
    /// Whether it is a probability of an operation of this kind: not one that counts messages.
    pub fn is_probability(&self, kind: &OperationKind) -> bool {
        kind.has_probabilities() && !matches!(self.domain, Domain::Number { integer: true, .. })
    }
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
        shape: ChoiceKind,
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
pub enum ChoiceKind {
    /// One value of it.
    Value,
    /// A sub-range of it.
    Range,
}
