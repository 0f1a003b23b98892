//! The condition of evidence over messages, with three values.

use sesame_base::time::SimTime;
use sesame_monitor::Truth;
use sesame_plan::{CampaignPlan, Evidence, TopicId};

use crate::metric::{Given, HeardValues, HeldInputs, Memories, Moment, Optional, hear, holds};
use crate::value::Value;
use crate::wire::Wire;

/// What is held of the messages that a condition reads.
pub(super) struct EvidenceState<'p> {
    evidence: &'p Evidence,
    held: HeldInputs,
    /// The values of the current message, per input.
    heard: HeardValues,
    optional: Optional,
    memories: Memories,
    sources: Sources,
}

impl<'p> EvidenceState<'p> {
    /// Before the first message. `sources` are the wires of all topics that it reads.
    pub(super) fn new(evidence: &'p Evidence, plan: &CampaignPlan, sources: impl Iterator<Item = Wire>) -> Self {
        EvidenceState {
            evidence,
            held: HeldInputs::new(&evidence.inputs, plan),
            heard: HeardValues::default(),
            optional: Optional::new(&evidence.inputs, plan),
            memories: Memories::new(&evidence.inputs, plan),
            sources: Sources::new(sources),
        }
    }

    /// Takes a message on the `member`th path of a topic. The error is a missing field; such a message is not heard.
    pub(super) fn hear(
        &mut self,
        wire: Wire,
        (topic, member): (TopicId, usize),
        now: SimTime,
        value: &Value,
    ) -> Result<Came, String> {
        hear(&self.evidence.inputs, &self.optional, (topic, member), value, &mut self.heard)?;
        self.memories.remember(&mut self.heard, member, now);
        if self.heard.is_nothing() {
            return Ok(Came::Nothing);
        }
        self.held.hold(&self.evidence.inputs, &self.heard, member);
        if self.sources.are_several() {
            self.sources.spoke(wire, now);
            return Ok(Came::Waits);
        }
        Ok(Came::Truth(self.truth(now)))
    }

    /// What the condition comes to now. It is unknown while a number that was read last is not finite, and where a
    /// function has no value.
    pub(super) fn truth(&self, now: SimTime) -> Truth {
        truth_of(self.evidence, &self.held, now)
    }

    /// When the topics and members that it reads had messages.
    pub(super) fn sources(&self) -> &Sources {
        &self.sources
    }
}

/// What comes of a message for evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Came {
    /// It has no element that the evidence reads, or is the first of those from which a previous value or a rate is
    /// computed, so it is as if it had not come.
    Nothing,
    /// Evidence with several sources waits for the end of the instant.
    Waits,
    /// What the condition comes to.
    Truth(Truth),
}

/// When each source of evidence, a topic or a member of a group, had its last message. It is kept only if there are
/// several.
#[derive(Debug, Clone)]
pub(super) struct Sources(Vec<(Wire, Option<SimTime>)>);

impl Sources {
    /// Before the first message.
    pub(super) fn new(wires: impl Iterator<Item = Wire>) -> Self {
        Sources(wires.map(|wire| (wire, None)).collect())
    }

    /// Whether there are several, so that the condition is evaluated at the end of an instant: between its messages
    /// the values do not belong together.
    pub(super) fn are_several(&self) -> bool {
        self.0.len() > 1
    }

    /// A source had a message.
    pub(super) fn spoke(&mut self, wire: Wire, now: SimTime) {
        for (_, last) in self.0.iter_mut().filter(|(of, _)| *of == wire) {
            *last = Some(now);
        }
    }

    /// The last message of the source that has been silent longest; `None` until each had one.
    pub(super) fn oldest(&self) -> Option<SimTime> {
        self.0.iter().map(|(_, last)| *last).min().flatten()
    }
}

/// What the condition of evidence comes to with these values.
pub(super) fn truth_of(evidence: &Evidence, held: &HeldInputs, now: SimTime) -> Truth {
    let Some(inputs) = held.values() else { return Truth::Unknown };
    // Evidence reads neither the time nor what a test chose.
    let moment = Moment::new(inputs, Given { now, zero: 0.0, scene: &[] });
    let truth = Truth::from(holds(&evidence.condition, &moment));
    if moment.undefined().is_some() { Truth::Unknown } else { truth }
}
