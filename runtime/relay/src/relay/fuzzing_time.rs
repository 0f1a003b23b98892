//! The fuzzing time: how much of it has passed, and when it reaches the numbers with which conditions compare it.
//!
//! It grows while an operation is active and while it still holds messages back. A condition over it changes between
//! events, so the relay computes the moment, to the nanosecond, instead of checking at every event.

use sesame_base::time::SimTime;
use sesame_base::verdict::ends;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, CampaignPlan, MetricId, MetricSource, Score, Span, Test};

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

    /// When the fuzzing time next reaches or exceeds a number with which a condition compares it, if nothing else
    /// happens before.
    pub(super) fn next_comparison(&self) -> Option<SimTime> {
        if self.conditions.compared.is_empty() {
            return None;
        }
        let busy = self.operations.iter().filter(|stage| stage.timed && stage.is_busy()).count();
        let pace = i64::try_from(busy).ok().filter(|&pace| pace > 0)?;
        let total = self.fuzzing_time().nanos();
        let numbers = self.conditions.compared.iter().filter_map(|operand| match *operand {
            Operand::Number(number) => Some(number),
            Operand::Variable(metric) => self.metrics.value(metric, 0.0),
        });
        let marks = numbers.flat_map(|number| [reaching(number), beyond(number)]).filter(|&mark| mark > total);
        // The least number of nanoseconds after which this many operations have added up enough.
        marks.min().map(|mark| self.now + SimTime::from_nanos((mark - total - 1) / pace + 1))
    }
}

/// The first nanosecond whose seconds are at least this number.
pub(super) fn reaching(number: f64) -> i64 {
    first(number, |seconds| seconds >= number)
}

/// The first nanosecond whose seconds are above this number.
pub(super) fn beyond(number: f64) -> i64 {
    first(number, |seconds| seconds > number)
}

/// The first nanosecond near a number of seconds from which on something holds.
fn first(number: f64, holds: impl Fn(f64) -> bool) -> i64 {
    // Even the largest times have smaller gaps than this after rounding to seconds.
    const NEAR: i64 = 1 << 12;
    let near = SimTime::from_seconds(number).nanos();
    let (mut low, mut high) = (near.saturating_sub(NEAR), near.saturating_add(NEAR));
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(SimTime::from_nanos(middle).seconds()) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

/// What conditions and hazards read.
#[derive(Default)]
pub(super) struct Read {
    /// The metrics that the conditions of the test read.
    pub(super) variables: Vec<MetricId>,
    /// With what the fuzzing time is compared.
    pub(super) compared: Vec<Operand>,
    /// The metrics that are times in states of monitors, each with what it is compared with.
    pub(super) stays: Vec<(MetricId, Operand)>,
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
        let source = |metric| &plan.metric(metric).source;
        let is_fuzzing_time = |operand| matches!(operand, Operand::Variable(metric) if matches!(source(metric), MetricSource::FuzzingTime));
        match source(metric) {
            MetricSource::FuzzingTime if !is_fuzzing_time(with) => self.compared.push(with),
            MetricSource::Monitor { score: Score::TimeIn { .. }, .. } => self.stays.push((metric, with)),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_first_nanosecond_is_the_first(number in prop_oneof![0.0..100.0f64, (0i64..2000).prop_map(|n| n as f64 * 0.05)]) {
            let seconds = |nanos| SimTime::from_nanos(nanos).seconds();
            let (reached, passed) = (reaching(number), beyond(number));
            prop_assert!(seconds(reached) >= number && seconds(reached - 1) < number);
            prop_assert!(seconds(passed) > number && seconds(passed - 1) <= number);
        }
    }
}
