//! Times that grow while nothing happens: the fuzzing time, times in states of monitors, and durations. When do they
//! reach what conditions compare them with?
//!
//! The fuzzing time grows while an operation is active and while it still holds messages back. A condition over a time
//! that grows changes between events, so the relay computes the moment, to the nanosecond, instead of checking at every
//! event. Two times that grow alike never meet.

use sesame_base::time::SimTime;
use sesame_base::verdict::ends;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, Aggregate, CampaignPlan, MetricId, MetricSource, Score, Span, Test};

use crate::metric::next_mark;
use crate::relay::Relay;
use crate::relay::stage::Stage;

impl Stage {
    /// How long it has been active or held messages back until now.
    fn busy_time(&self, now: SimTime) -> SimTime {
        let tails = self.tails.iter().copied().chain(self.tail_since.map(|since| (since, now)));
        tails.fold(self.activity.active_time(now), |sum, (from, to)| sum + (to - from))
    }

    fn is_busy(&self) -> bool {
        self.activity.is_active() || self.tail_since.is_some()
    }

    /// Ends the tail: the operation holds no messages any more, or is active again.
    pub(super) fn end_tail(&mut self, now: SimTime) {
        if let Some(since) = self.tail_since.take().filter(|&since| since < now) {
            self.tails.push((since, now));
        }
    }

    /// The intervals in which it held messages back without being active, in seconds, clipped to a run that ended at
    /// `end`.
    pub(super) fn tails(&self, end: SimTime) -> Vec<Span> {
        let all = self.tails.iter().copied().chain(self.tail_since.map(|since| (since, end)));
        let clipped = all.map(|(from, to)| (from, to.min(end))).filter(|(from, to)| from < to);
        clipped.map(|(from, to)| Span { start: from.seconds(), end: to.seconds() }).collect()
    }
}

impl Relay<'_> {
    /// The sum over all operations that count in `fuzzing_time()` until now.
    pub(super) fn fuzzing_time(&self) -> SimTime {
        let timed = self.operations.iter().filter(|stage| stage.timed);
        timed.fold(SimTime::ZERO, |sum, stage| sum + stage.busy_time(self.now))
    }

    /// When a time that grows next reaches or exceeds what a condition compares it with, if nothing else happens
    /// before.
    #[inline]
    pub(super) fn next_comparison(&self) -> Option<SimTime> {
        if self.conditions.growing.is_empty() { None } else { self.first_comparison() }
    }

    #[inline(never)]
    fn first_comparison(&self) -> Option<SimTime> {
        let after = self.conditions.growing.iter().filter_map(|&(metric, with)| {
            let (total, pace) = self.growth(metric)?;
            let number = match with {
                Operand::Number(number) => Some(number),
                Operand::Variable(other) => match self.growth(other) {
                    Some(other) => return next_meeting((total, pace), other),
                    None => self.metrics.value(other, 0.0),
                },
            };
            if pace > 0 { next_mark(number.into_iter(), total, pace) } else { None }
        });
        after.min().map(|after| self.now + after)
    }

    /// What a time has grown to, and how many times as fast as time passes it grows now; `None` of other metrics, and
    /// of a duration that has not begun.
    fn growth(&self, metric: MetricId) -> Option<(SimTime, i64)> {
        match &self.metrics.plan().metric(metric).source {
            MetricSource::FuzzingTime => {
                let busy = self.operations.iter().filter(|stage| stage.timed && stage.is_busy()).count();
                Some((self.fuzzing_time(), i64::try_from(busy).unwrap_or(i64::MAX)))
            }
            MetricSource::Monitor { score: Score::TimeIn { .. }, .. } => {
                let spent = SimTime::from_seconds(self.metrics.value(metric, 0.0)?);
                let grows = self.monitors.as_ref().is_some_and(|monitors| monitors.grows(metric));
                Some((spent, i64::from(grows)))
            }
            MetricSource::Formula { .. } => self.metrics.growth(metric),
            _ => None,
        }
    }
}

/// After how long a time reaches another one, or exceeds it, whichever is next; both as what they are now, and how many
/// times as fast as time passes they grow.
fn next_meeting((total, pace): (SimTime, i64), (other, other_pace): (SimTime, i64)) -> Option<SimTime> {
    let nearer = pace.checked_sub(other_pace).filter(|&nearer| nearer > 0)?;
    let gap = (other - total).nanos();
    let mark = [gap, gap + 1].into_iter().find(|&mark| mark > 0)?;
    Some(SimTime::from_nanos((mark - 1) / nearer + 1))
}

/// What conditions and hazards read.
#[derive(Default)]
pub(super) struct Read {
    /// The metrics that the conditions of the test read.
    pub(super) variables: Vec<MetricId>,
    /// The times that grow, each with what it is compared with.
    pub(super) growing: Vec<(MetricId, Operand)>,
    /// The metrics of formulas, each with what it is compared with and what does not grow.
    pub(super) formulas: Vec<(MetricId, Operand)>,
}

impl Read {
    /// What a test reads, and the requirements whose hazards are scored.
    pub(super) fn by(plan: &CampaignPlan, test: &Test) -> Self {
        let mut read = Read::default();
        for operation in &test.operations {
            match &operation.activation {
                Activation::Condition { start, end, .. } => {
                    read.add(plan, start);
                    read.add(plan, end);
                }
                Activation::ConditionFor { start, .. } => read.add(plan, start),
                Activation::Time { .. } | Activation::Offline => {}
            }
        }
        for metric in &plan.metrics {
            let MetricSource::Monitor { score, .. } = metric.source else { continue };
            let Some(requirement) = score.requirement() else { continue };
            let requirement = plan.requirement(requirement);
            let (low, _, high, _) = ends(requirement.bound);
            for end in [low, high].into_iter().flatten() {
                read.compare(plan, requirement.metric, Operand::Number(end));
            }
        }
        read
    }

    fn add(&mut self, plan: &CampaignPlan, condition: &Condition) {
        match condition {
            Condition::Compare { left, right, .. } => {
                for (one, other) in [(*left, *right), (*right, *left)] {
                    if let Operand::Variable(metric) = one {
                        self.variables.push(metric);
                        self.compare(plan, metric, other);
                    }
                }
            }
            Condition::And(a, b) | Condition::Or(a, b) => {
                self.add(plan, a);
                self.add(plan, b);
            }
        }
    }

    fn compare(&mut self, plan: &CampaignPlan, metric: MetricId, with: Operand) {
        let grows = |metric| match &plan.metric(metric).source {
            MetricSource::FuzzingTime => true,
            MetricSource::Monitor { score, .. } => matches!(score, Score::TimeIn { .. }),
            MetricSource::Formula { formula } => matches!(formula.aggregate, Aggregate::Duration { .. }),
            _ => false,
        };
        if grows(metric) && !self.growing.contains(&(metric, with)) {
            self.growing.push((metric, with));
        }
        let is_fixed = !matches!(with, Operand::Variable(other) if grows(other));
        if is_fixed && matches!(plan.metric(metric).source, MetricSource::Formula { .. }) {
            self.formulas.push((metric, with));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        // Times are so small that every nanosecond can be looked at.
        #[test]
        fn times_that_grow_meet_at_their_nanosecond(
            total in 0..40i64, pace in 0..4i64, other in 0..40i64, other_pace in 0..4i64,
        ) {
            let stands = |after: i64| (total + pace * after).cmp(&(other + other_pace * after));
            // One that falls behind is the other one's to look at.
            let expected = (1..200).find(|&after| stands(after) > stands(after - 1)).map(SimTime::from_nanos);
            let now = |total, pace| (SimTime::from_nanos(total), pace);
            prop_assert_eq!(next_meeting(now(total, pace), now(other, other_pace)), expected);
        }
    }
}
