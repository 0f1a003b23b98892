//! What the reference run says about when a disturbance is worth a test: moments at which something happens.

use sesame_base::observation::{Course, Observation};
use sesame_plan::{CampaignPlan, Span};
use sesame_rng::Stream;

use crate::space::test_space::TestSpace;

/// Events that lie within this share of the run are one moment.
const ONE_MOMENT: f64 = 0.015;
/// How many moments are kept, the weightiest ones.
const KEPT: usize = 24;
/// How many even moments stand in for those of a run of which nothing is known.
const EVEN: u32 = 8;

/// A time at which something happens in the undisturbed system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    /// When, in seconds.
    pub(super) at: f64,
    /// How much happens then: the sum, over the signals in which something does, of one over the root of how often
    /// something happens in the signal.
    pub(super) weight: f64,
}

/// The moments of a run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Moments {
    /// When a run ends, in seconds.
    pub(super) end: f64,
    /// The shortest time in which anything can happen, in seconds: a step of the simulator, or the shortest time that
    /// is usual between two messages of a topic that operations disturb.
    pub(super) grain: f64,
    /// In order of time, at least one.
    pub(super) all: Vec<Moment>,
}

impl Moments {
    /// Those of a reference run that the test space knows already.
    pub(super) fn from_reference(plan: &CampaignPlan, space: &TestSpace, reference: &Observation) -> Self {
        let end = plan.campaign.end_after;
        let step = plan.simulator.step_ns().map(|ns| ns as f64 * 1e-9);
        let periods = space.operations().iter().filter_map(|kind| kind.heard.period()).filter(|period| *period > 0.0);
        let grain = step.or_else(|| periods.reduce(f64::min)).unwrap_or(end * 1e-3);
        let grain = grain.clamp(end * 1e-5, end * 0.02);
        let course = reference.course.as_ref();
        let moments = course.map_or_else(Vec::new, |course| moments(course, end, grain));
        let even = || (0..EVEN).map(|at| Moment { at: end * (f64::from(at) + 0.5) / f64::from(EVEN), weight: 1.0 });
        let moments = if moments.is_empty() { even().collect() } else { moments };
        Moments { end, grain, all: moments }
    }

    /// A moment, likelier the weightier it is.
    pub(super) fn draw(&self, stream: &mut Stream) -> f64 {
        let at = weighted(self.all.iter().map(|moment| libm::sqrt(moment.weight)), stream);
        self.all[at].at
    }

    /// How much happens in a stretch of time.
    pub(super) fn weight_in(&self, start: f64, end: f64) -> f64 {
        self.all.iter().filter(|moment| start <= moment.at && moment.at < end).map(|moment| moment.weight).sum()
    }

    /// The run in at most so many parts in which about equally much happens.
    pub(super) fn parts(&self, count: usize) -> Vec<Span> {
        let all: f64 = self.all.iter().map(|moment| moment.weight).sum();
        let mut cuts = vec![0.0];
        let mut sum = 0.0;
        for moment in &self.all {
            sum += moment.weight;
            if sum >= all * cuts.len() as f64 / count as f64 && cuts.len() < count && moment.at > self.grain {
                cuts.push(moment.at - self.grain / 2.0);
            }
        }
        cuts.push(self.end);
        let parts = cuts.windows(2).map(|ends| Span { start: ends[0], end: ends[1] });
        parts.filter(|part| part.length() > self.grain).collect()
    }
}

/// Reads the moments from a course, in order of time.
fn moments(course: &Course, end: f64, grain: f64) -> Vec<Moment> {
    let mut events: Vec<(f64, f64, usize)> = Vec::new();
    for (of, signal) in course.signals.iter().enumerate() {
        let weight = 1.0 / libm::sqrt(signal.events.len().max(1) as f64);
        let within = signal.events.iter().map(|event| event.at).filter(|at| grain < *at && *at < end);
        events.extend(within.map(|at| (at, weight, of)));
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let mut found = Vec::new();
    let mut rest = events.as_slice();
    while let Some(&(first, ..)) = rest.first() {
        let (together, later) = rest.split_at(rest.partition_point(|event| event.0 - first <= ONE_MOMENT * end));
        let at = together.iter().map(|event| event.0).sum::<f64>() / together.len() as f64;
        let mut signals: Vec<(usize, f64)> = together.iter().map(|&(_, weight, of)| (of, weight)).collect();
        signals.sort_by_key(|signal| signal.0);
        signals.dedup_by_key(|signal| signal.0);
        found.push(Moment { at, weight: signals.iter().map(|signal| signal.1).sum() });
        rest = later;
    }
    found.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.at.total_cmp(&b.at)));
    found.truncate(KEPT);
    found.sort_by(|a, b| a.at.total_cmp(&b.at));
    found
}

/// A position, each as likely as its weight says; weights are not negative and one is above zero.
pub(super) fn weighted(weights: impl Iterator<Item = f64> + Clone, stream: &mut Stream) -> usize {
    let mut left = stream.unit() * weights.clone().sum::<f64>();
    let mut last = 0;
    for (at, weight) in weights.enumerate() {
        if weight <= 0.0 {
            continue;
        }
        last = at;
        left -= weight;
        if left < 0.0 {
            break;
        }
    }
    last
}
