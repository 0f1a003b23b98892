//! The condition of evidence over messages, with three values.

use sesame_base::time::SimTime;
use sesame_monitor::Truth;
use sesame_plan::{CampaignPlan, Evidence, TopicId};

use crate::metric::{Held, HeldInputs, Moment, hear, holds};
use crate::value::Value;

/// What is held of the messages that a condition reads.
pub(super) struct EvidenceState<'p> {
    evidence: &'p Evidence,
    held: HeldInputs,
    /// The values of the current message, per input.
    heard: Vec<(usize, Held)>,
}

impl<'p> EvidenceState<'p> {
    /// Before the first message.
    pub(super) fn new(evidence: &'p Evidence, plan: &CampaignPlan) -> Self {
        EvidenceState { evidence, held: HeldInputs::new(&evidence.inputs, plan), heard: Vec::new() }
    }

    /// What the condition comes to after a message on the `member`th path of a topic. It is unknown before all inputs
    /// had a message, while a number that was read last is not finite, and where a function has no value. The error is
    /// a missing field; such a message is not heard.
    pub(super) fn message(
        &mut self,
        topic: TopicId,
        member: usize,
        now: SimTime,
        value: &Value,
    ) -> Result<Truth, String> {
        hear(&self.evidence.inputs, topic, value, &mut self.heard)?;
        self.held.hold(&self.evidence.inputs, &self.heard, member);
        Ok(truth_of(self.evidence, &self.held, now))
    }
}

/// What the condition of evidence comes to with these values.
pub(super) fn truth_of(evidence: &Evidence, held: &HeldInputs, now: SimTime) -> Truth {
    let Some(inputs) = held.values() else { return Truth::Unknown };
    let moment = Moment::new(inputs, now.seconds());
    let truth = Truth::from(holds(&evidence.condition, &moment));
    if moment.undefined().is_some() { Truth::Unknown } else { truth }
}
