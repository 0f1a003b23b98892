//! Runtime monitors: conditional safety certificates as data ([SESAME 2023, §6.1.7]). A monitor watches evidence in
//! messages and publishes the strongest guarantee that holds.

use serde::{Deserialize, Serialize};

use crate::formula::Condition;
use crate::{
    CampaignPlan, FieldRef, Input, MetricSource, MonitorId, MonitorPart, MonitorState, RequirementId, Score, Side,
    TopicId, Type,
};

/// A runtime monitor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Monitor {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Where it publishes its state: a topic that carries a `bool` (whether any guarantee holds), an `int` (the
    /// integrity of the strongest one that holds, 0 if none does) or a `text` (its name), or a message of one such
    /// field. `None` for an external monitor, which is a part of the system: its evidence is what that part says, and
    /// the runner only scores it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub publishes: Option<TopicId>,
    /// Guarantees of other monitors on which it relies. No monitor relies on itself by any chain of demands.
    pub demands: Vec<Demand>,
    /// What it watches; at least one.
    pub evidence: Vec<Evidence>,
    /// What it can guarantee, highest integrity first; at least one, and no two of one integrity.
    pub guarantees: Vec<Guarantee>,
    /// The state in which no guarantee holds.
    pub otherwise: SafeState,
    /// Line of its declaration, from 1.
    pub line: u32,
}

impl Monitor {
    /// The most monitors of a plan, and the most demands, pieces of evidence, and guarantees of one of them.
    pub const MOST_PARTS: usize = 1_000;
    /// The most gates of all guarantees of one monitor together, those inside of others included.
    pub const MOST_GATES: usize = 10_000;

    /// The state that a position names.
    pub fn state_name(&self, state: MonitorState) -> &str {
        match state {
            MonitorState::Guarantee(at) => &self.guarantees[at as usize].name,
            MonitorState::Otherwise => &self.otherwise.name,
        }
    }

    /// The name of a part.
    pub fn part_name(&self, part: MonitorPart) -> &str {
        match part {
            MonitorPart::Evidence(at) => &self.evidence[at as usize].name,
            MonitorPart::Demand(at) => &self.demands[at as usize].name,
            MonitorPart::Guarantee(at) => self.state_name(MonitorState::Guarantee(at)),
            MonitorPart::Otherwise => self.state_name(MonitorState::Otherwise),
        }
    }
}

impl CampaignPlan {
    /// What a monitor may publish its state as, on a topic: a message that is a `bool`, an `int` or a `text`, or that
    /// has one such field and no other, whose name is given; `None` of a topic on which no state can be published.
    pub fn state_on(&self, topic: TopicId) -> Option<(&Type, Option<&str>)> {
        let fits = |ty: &Type| matches!(ty, Type::Bool | Type::Int { .. } | Type::Text);
        let topic = self.topics.get(topic.index()).filter(|topic| topic.paths.len() == 1)?;
        match &topic.ty {
            Type::Message { id } => match self.messages.get(id.index())?.fields.as_slice() {
                [only] if fits(&only.ty) => Some((&only.ty, Some(&only.name))),
                _ => None,
            },
            ty => fits(ty).then_some((ty, None)),
        }
    }

    /// The requirements whose hazards each monitor is to foresee, by monitor and then by requirement: those for which
    /// metrics score it. Where no metric scores hazards, every monitor is to foresee those of every requirement that
    /// does not bound a score of a monitor.
    pub fn hazards_to_foresee(&self) -> Vec<(MonitorId, RequirementId)> {
        let scored = self.metrics.iter().filter_map(|metric| match metric.source {
            MetricSource::Monitor { monitor, score } => Some((monitor, score.requirement()?)),
            _ => None,
        });
        let mut pairs: Vec<(MonitorId, RequirementId)> = scored.collect();
        if pairs.is_empty() {
            let is_of_system = |metric: &MetricSource| !matches!(metric, MetricSource::Monitor { .. });
            let requirements = (0..).map(RequirementId).zip(&self.requirements);
            let requirements: Vec<RequirementId> = requirements
                .filter(|(_, requirement)| is_of_system(&self.metric(requirement.metric).source))
                .map(|(id, _)| id)
                .collect();
            let monitors = (0..).map(MonitorId).take(self.monitors.len());
            pairs = monitors.flat_map(|monitor| requirements.iter().map(move |&id| (monitor, id))).collect();
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    /// For how long after the beginning of an alarm of a monitor a hazard of a requirement justifies it, in seconds: as
    /// the first metric says that counts such false alarms. `None` where it has to be within the alarm.
    pub fn alarm_horizon(&self, monitor: MonitorId, requirement: RequirementId) -> Option<f64> {
        let counted = self.metrics.iter().find_map(|metric| match metric.source {
            MetricSource::Monitor { monitor: of, score: Score::FalseAlarms { requirement: bound, within } } => {
                (of == monitor && bound == requirement).then_some(within)
            }
            _ => None,
        });
        counted.flatten()
    }

    /// Whether a monitor publishes its state on a topic, so that nobody else needs to know the topic.
    pub fn is_state_of_monitor(&self, topic: TopicId) -> bool {
        self.monitors.iter().any(|monitor| monitor.publishes == Some(topic))
    }

    /// Whether the runner publishes on a topic: the state of a monitor, or what is to bring the system into a safe
    /// state.
    pub fn is_published_by_monitor(&self, topic: TopicId) -> bool {
        let mitigations = self.monitors.iter().filter_map(|monitor| monitor.otherwise.mitigation.as_ref());
        self.is_state_of_monitor(topic) || mitigations.into_iter().any(|mitigation| mitigation.field.topic == topic)
    }
}

/// A guarantee of another monitor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Demand {
    /// Its name, which is that of the guarantee.
    pub name: String,
    /// Whose guarantee it is.
    pub monitor: MonitorId,
    /// Position in that monitor's [`Monitor::guarantees`].
    pub guarantee: u32,
}

/// A condition on messages with three values: true, false, and unknown until each of its topics has had a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What [`Evidence::condition`] refers to by position; at least one.
    pub inputs: Vec<Input>,
    /// When it is true.
    pub condition: Condition,
    /// How long the condition must have held without interruption, in seconds; 0 is at once.
    pub held: f64,
    /// When it is too old to be believed; `None` is never.
    pub stale: Option<Stale>,
    /// Where it listens: to messages as they are delivered, unless the space says `inbound`.
    pub side: Side,
}

/// When evidence is too old.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stale {
    /// The longest silence of a topic that it reads, or of a member of a group, in seconds; positive.
    pub after: f64,
    /// Its value after that.
    pub is: StaleIs,
    /// Whether all topics and members must be silent for so long; else one of them is enough.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub all: bool,
}

/// The value of stale evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StaleIs {
    /// It does not hold.
    False,
    /// Nobody knows.
    Unknown,
}

/// Something that a monitor can guarantee.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Guarantee {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// Its integrity: 1 or more; larger is stronger.
    pub integrity: u32,
    /// What it needs.
    pub gate: Gate,
}

/// What a guarantee needs, in three-valued logic (Kleene's).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Gate {
    /// Evidence: position in [`Monitor::evidence`].
    Evidence(u32),
    /// A demand: position in [`Monitor::demands`].
    Demand(u32),
    /// All of two or more.
    All(Vec<Gate>),
    /// At least one of two or more.
    Any(Vec<Gate>),
    /// At least so many of two or more.
    AtLeast {
        /// How many: from 1 to the number of parts.
        count: u32,
        /// The parts.
        of: Vec<Gate>,
    },
}

impl Gate {
    /// The most gates that are inside of each other: a piece of evidence alone is one. A plan is JSON, whose readers
    /// limit its depth.
    pub const MOST_DEPTH: usize = 30;

    /// The gates that it combines; none of evidence and demands.
    pub fn parts(&self) -> &[Gate] {
        match self {
            Gate::Evidence(_) | Gate::Demand(_) => &[],
            Gate::All(parts) | Gate::Any(parts) | Gate::AtLeast { of: parts, .. } => parts,
        }
    }

    /// How many of its parts must hold; `None` for evidence and demands.
    pub fn needed(&self) -> Option<usize> {
        match self {
            Gate::Evidence(_) | Gate::Demand(_) => None,
            Gate::All(parts) => Some(parts.len()),
            Gate::Any(_) => Some(1),
            Gate::AtLeast { count, .. } => Some(*count as usize),
        }
    }

    /// How many gates are inside of each other, this one included.
    pub fn depth(&self) -> usize {
        1 + self.parts().iter().map(Gate::depth).max().unwrap_or(0)
    }

    /// How many gates it consists of, this one included.
    pub fn size(&self) -> usize {
        1 + self.parts().iter().map(Gate::size).sum::<usize>()
    }
}

/// The state of a monitor in which no guarantee holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SafeState {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What is sent each time that a guarantee is lost and none is left; `None` of an external monitor.
    pub mitigation: Option<Mitigation>,
}

/// A message that is to bring the system into a safe state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mitigation {
    /// What is set. If it is a field, other fields are those of the last message of the topic.
    pub field: FieldRef,
    /// What it is set to: of the type of the field, and in its unit.
    pub value: MitigationValue,
}

/// A value of a field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MitigationValue {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Real(f64),
    /// A text.
    Text(String),
}
