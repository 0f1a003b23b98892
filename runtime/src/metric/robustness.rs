//! Metrics that are the robustness of a temporal formula: the values of its signals, held, go to a monitor, and the run's
//! end tells what comes of them.

use sesame_plan::stl::Robustness;
use sesame_plan::{CampaignPlan, Members, TopicId};

use super::Context;
use super::expression::{Held, least, number};
use super::held::{HeldInputs, hear};
use crate::stl::{FormulaError, Monitor};
use crate::time::SimTime;
use crate::value::Value;

/// A robustness in one run.
pub(super) struct RobustnessState<'p> {
    robustness: &'p Robustness,
    /// The group of which each member has a formula of its own.
    each: Option<TopicId>,
    /// One for each member of that group; one for a formula without.
    instances: Vec<Instance>,
    /// When the last message came.
    last: SimTime,
    heard: Vec<(usize, Held)>,
}

struct Instance {
    held: HeldInputs,
    /// None once the run is over.
    monitor: Option<Monitor>,
}

impl<'p> RobustnessState<'p> {
    /// Before the first message. Fails for a formula that the generator would not write.
    pub(super) fn new(robustness: &'p Robustness, plan: &CampaignPlan) -> Result<Self, FormulaError> {
        let monitor = Monitor::new(&robustness.formula, robustness.signals.len())?;
        let each = robustness.inputs.iter().find(|input| input.members == Members::Each).map(|input| input.field.topic);
        let count = each.map_or(1, |topic| plan.topic(topic).paths.len());
        let instance = || Instance { held: HeldInputs::new(&robustness.inputs, plan), monitor: Some(monitor.clone()) };
        let instances = (0..count).map(|_| instance()).collect();
        Ok(RobustnessState { robustness, each, instances, last: SimTime::ZERO, heard: Vec::new() })
    }

    /// A message on the `member`th path of a topic, at the context's time.
    pub(super) fn message(&mut self, topic: TopicId, member: usize, value: &Value, context: &mut Context) {
        let Robustness { inputs, signals, .. } = self.robustness;
        if let Err(lacking) = hear(inputs, topic, value, &mut self.heard) {
            context.note(format!("a message on `{}` has no value `{lacking}`", context.topic));
            return;
        }
        self.last = context.now;
        for (at, Instance { held, monitor }) in self.instances.iter_mut().enumerate() {
            // Where each member has a formula, what is said of all of them goes to all, and what is said of one to its own.
            let own = self.each != Some(topic) || at == member;
            for &(input, value) in &self.heard {
                if own || inputs[input].members != Members::Each {
                    held.hold(inputs, &[(input, value)], member);
                }
            }
            let (Some(values), Some(monitor)) = (held.values(), monitor) else { continue };
            for (at, signal) in signals.iter().enumerate() {
                let value = number(signal, values);
                // As with other formulas: what is no number says nothing, and what was known goes on.
                if value.is_finite() {
                    monitor.push(context.now, at, value);
                } else {
                    context.note(format!("refused the value {value} at {}", context.now));
                }
            }
        }
    }

    /// The run is over, at the context's time: by how much the formula was kept.
    pub(super) fn end(&mut self, context: &mut Context) {
        let end = context.now.max(self.last);
        let monitors = self.instances.iter_mut().filter_map(|instance| instance.monitor.take());
        let robustness = monitors.filter_map(|monitor| monitor.finish(end)).reduce(least);
        match robustness {
            Some(robustness) if robustness.is_finite() => context.set(robustness),
            Some(_) => context.note("the run ended before the formula says anything of it".to_owned()),
            None => {}
        }
    }

    /// The run broke off, and the end was not told: it is judged up to its last message.
    pub(super) fn break_off(&mut self, context: &mut Context) {
        if self.instances.iter().any(|instance| instance.monitor.is_some()) {
            context.now = self.last;
            self.end(context);
        }
    }
}
