//! Wires that fell silent in a run.
//!
//! A run ends whether or not anybody speaks. So a run in which a topic fell silent must not be taken for one in which
//! nothing bad happened: what the reference run says about a wire decides which silence is remarkable, and a metric
//! whose topic was silent to the end is judged by what was known until then.

use sesame_plan::stl::Formula;
use sesame_plan::{CampaignPlan, Metric, MetricId, MetricSource, Source, TopicId};

use crate::observation::{MetricObservation, Observation, Reach, Traffic};
use crate::robustness::{Quantifier, quantifier};

/// A time in which a wire that speaks regularly in the reference run was silent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Silence {
    /// The position of the wire.
    pub wire: usize,
    /// Since when, in seconds.
    pub from: f64,
    /// Until when; `None` if to the end of the run.
    pub to: Option<f64>,
}

impl Traffic {
    /// A wire with fewer messages is not called periodic.
    const FEWEST: u64 = 10;
    /// How many median gaps the longest gap of a periodic wire may be long.
    const IRREGULARITY: f64 = 5.0;
    /// A silence is remarkable if it is longer than so many of the longest gaps of the reference run, and than
    /// [`Traffic::LEAST`].
    const GAPS: f64 = 10.0;
    /// In seconds of simulation time.
    const LEAST: f64 = 1.0;

    /// Whether messages come at regular times.
    pub fn is_periodic(&self) -> bool {
        self.messages >= Self::FEWEST && self.gap.length() <= Self::IRREGULARITY * self.median_gap
    }

    /// The longest silence that is not remarkable in another run.
    fn tolerance(&self) -> f64 {
        (Self::GAPS * self.gap.length()).max(Self::LEAST)
    }
}

/// The remarkable silences of a run, by wire and time. A run that broke off has none: nobody knows what would have
/// come.
pub fn silences(reference: &Observation, run: &Observation) -> Vec<Silence> {
    if !run.outcome.is_whole() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for usual in reference.traffic.iter().filter(|usual| usual.is_periodic()) {
        let (wire, tolerance) = (usual.wire as usize, usual.tolerance());
        // The reference run, too, may begin and end with a silence.
        let (before, after) = (usual.first + tolerance, reference.end - usual.last + tolerance);
        let Some(heard) = run.traffic.iter().find(|heard| heard.wire == usual.wire) else {
            found.extend((run.end > before).then_some(Silence { wire, from: 0.0, to: None }));
            continue;
        };
        found.extend((heard.first > before).then_some(Silence { wire, from: 0.0, to: Some(heard.first) }));
        let (from, to) = (heard.gap.start, Some(heard.gap.end));
        found.extend((heard.gap.length() > tolerance).then_some(Silence { wire, from, to }));
        found.extend((run.end - heard.last > after).then_some(Silence { wire, from: heard.last, to: None }));
    }
    found
}

/// Takes what a run showed after topics had fallen silent for what it is: not known. The metrics that read them could
/// have come to any value that they could have come to if the run had broken off when it was last heard of them.
pub fn distrust(plan: &CampaignPlan, silences: &[Silence], metrics: &mut [MetricObservation]) {
    if silences.iter().all(|silence| silence.to.is_some()) {
        return;
    }
    let wires = wires(plan);
    for (at, observed) in (0..).zip(metrics) {
        let sources = sources_of(plan, MetricId(at));
        let silent = silences.iter().filter(|silence| silence.to.is_none());
        let reads = |silence: &&Silence| {
            let wire = wires.get(silence.wire);
            wire.is_some_and(|wire| sources.iter().any(|source| source.reads(wire.topic, wire.member)))
        };
        let since = silent.filter(reads).map(|silence| silence.from).min_by(f64::total_cmp);
        if let Some(since) = since {
            let known = known_at(plan.metric(MetricId(at)), observed, since);
            observed.reach = observed.reach.or(known);
        }
    }
}

/// A wire of a plan: one path of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlannedWire<'a> {
    /// The topic.
    pub topic: TopicId,
    /// The position of the path among those of the topic.
    pub member: usize,
    /// The path.
    pub path: &'a str,
}

/// The wires of a plan, in their order.
pub fn wires(plan: &CampaignPlan) -> Vec<PlannedWire<'_>> {
    let topics = (0..).map(TopicId).zip(&plan.topics);
    let paths = topics.flat_map(|(topic, declared)| {
        declared.paths.iter().enumerate().map(move |(member, path)| PlannedWire { topic, member, path })
    });
    paths.collect()
}

/// What a metric reads, itself or by the metric whose hazards it counts.
fn sources_of(plan: &CampaignPlan, metric: MetricId) -> Vec<Source> {
    match &plan.metric(metric).source {
        // What a monitor makes of silence is its own affair; what is a hazard is not.
        MetricSource::Monitor { score, .. } => score.requirement().map_or_else(Vec::new, |requirement| {
            let of = plan.requirement(requirement).metric;
            if matches!(plan.metric(of).source, MetricSource::Monitor { .. }) {
                Vec::new()
            } else {
                sources_of(plan, of)
            }
        }),
        source => source.sources(),
    }
}

/// The values to which a metric could still have come from this time on.
fn known_at(metric: &Metric, observed: &MetricObservation, since: f64) -> Reach {
    let MetricSource::Robustness { robustness } = &metric.source else {
        let until = observed.series.iter().take_while(|point| point.0 <= since);
        return Reach::onwards(metric.trend, until.last().map(|point| point.1));
    };
    // What the signal is at a time depends on what comes until its horizon.
    let Some(horizon) = horizon_inside(&robustness.formula) else { return Reach::ANY };
    let known = observed.robustness.iter().take_while(|point| point.0 + horizon <= since).map(|point| point.1);
    match quantifier(&robustness.formula) {
        Some(Quantifier::Always) => Reach { low: None, high: known.min_by(f64::total_cmp) },
        Some(Quantifier::Eventually) => Reach { low: known.max_by(f64::total_cmp), high: None },
        None => Reach::ANY,
    }
}

/// How far the formula inside of the outermost quantifiers looks ahead, in seconds; `None` if without end.
fn horizon_inside(formula: &Formula) -> Option<f64> {
    match formula {
        Formula::Not { of } => horizon_inside(of),
        Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
            Some(horizon_inside(left)?.max(horizon_inside(right)?))
        }
        Formula::Always { of, .. } | Formula::Eventually { of, .. } => horizon(of),
        Formula::Predicate { .. } | Formula::Until { .. } => horizon(formula),
    }
}

fn horizon(formula: &Formula) -> Option<f64> {
    match formula {
        Formula::Predicate { .. } => Some(0.0),
        Formula::Not { of } => horizon(of),
        Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
            Some(horizon(left)?.max(horizon(right)?))
        }
        Formula::Always { interval, of } | Formula::Eventually { interval, of } => Some(interval.to? + horizon(of)?),
        Formula::Until { interval, left, right, weak: _ } => Some(interval.to? + horizon(left)?.max(horizon(right)?)),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::testing::{metric, minimal, requirement, topic};
    use sesame_plan::{Bound, FieldRef, Span, Trend, Type};

    use super::*;
    use crate::observation::{MetricValue, Outcome};
    use crate::verdict::{Verdict, verdict};

    /// What was published on the wire at position 0 at these tenths of a second.
    fn traffic(times: &[u32]) -> Vec<Traffic> {
        let times: Vec<f64> = times.iter().map(|&time| f64::from(time) / 10.0).collect();
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Vec::new() };
        let mut gaps: Vec<(f64, Span)> =
            times.windows(2).map(|pair| (pair[1] - pair[0], Span { start: pair[0], end: pair[1] })).collect();
        gaps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let gap = gaps.last().map_or(Span { start: first, end: first }, |gap| gap.1);
        let median_gap = gaps.get(gaps.len().saturating_sub(1) / 2).map_or(0.0, |gap| gap.0);
        vec![Traffic { wire: 0, messages: times.len() as u64, first, last, gap, median_gap }]
    }

    fn run(times: &[u32], end: f64) -> Observation {
        Observation { end, traffic: traffic(times), ..Observation::without_run(Outcome::Completed) }
    }

    fn every(step: usize, range: std::ops::Range<u32>) -> Vec<u32> {
        range.step_by(step).collect()
    }

    #[test]
    fn a_wire_that_falls_silent_is_seen_at_the_beginning_in_between_and_at_the_end() {
        let reference = run(&every(1, 0..100), 10.0);
        let of = |times: &[u32]| {
            let found = silences(&reference, &run(times, 10.0));
            found.into_iter().map(|silence| (silence.from, silence.to)).collect::<Vec<_>>()
        };
        assert_eq!(of(&every(1, 0..100)), []);
        assert_eq!(of(&every(10, 0..100)), [], "slower is not silent");
        assert_eq!(of(&every(1, 30..100)), [(0.0, Some(3.0))]);
        assert_eq!(of(&[every(1, 0..20), every(1, 40..100)].concat()), [(1.9, Some(4.0))]);
        assert_eq!(of(&every(1, 0..50)), [(4.9, None)]);
        assert_eq!(of(&[]), [(0.0, None)]);
        // Nobody knows what would have come.
        let broken = Observation { outcome: Outcome::crash(String::new()), ..run(&[], 10.0) };
        assert_eq!(silences(&reference, &broken), []);
    }

    #[test]
    fn a_wire_that_is_silent_at_times_in_the_reference_run_may_be_so_in_others() {
        // It speaks late and has done its work early.
        let reference = run(&every(1, 30..60), 10.0);
        assert_eq!(silences(&reference, &run(&every(1, 35..55), 10.0)), []);
        assert_eq!(silences(&reference, &run(&every(1, 45..60), 10.0)).len(), 1);
        // A few messages, and irregular ones, say nothing about when the next one comes.
        for times in [every(1, 0..9), vec![0, 1, 2, 3, 4, 5, 6, 7, 8, 20, 21, 22]] {
            assert_eq!(silences(&run(&times, 10.0), &run(&[], 10.0)), []);
        }
    }

    proptest! {
        /// Every moment is looked at: a silence is remarkable exactly if there is a moment at which the last message,
        /// or the beginning, is longer ago than it ever was in the reference run, ten times and a second at least.
        #[test]
        fn a_silence_is_remarkable_exactly_if_a_moment_is_too_far_from_the_last_message(
            step in 1usize..4, from in 0u32..20, to in 50u32..100, times in prop::collection::btree_set(0u32..100, 0..40),
        ) {
            let usual = every(step, from..to);
            let reference = run(&usual, 10.0);
            let times: Vec<u32> = times.into_iter().collect();
            let tolerance = (10 * u32::try_from(step).unwrap()).max(10);
            let last_usual = *usual.last().unwrap();
            let mut expected = false;
            for moment in 1..=100 {
                let before = times.iter().rev().find(|&&time| time < moment);
                let after = times.iter().find(|&&time| time >= moment);
                let since = moment - before.copied().unwrap_or(0);
                let more = match (before, after) {
                    (None, _) => from,
                    (_, None) => 100 - last_usual,
                    _ => 0,
                };
                expected |= since > tolerance + more;
            }
            let found = silences(&reference, &run(&times, 10.0));
            prop_assert_eq!(!found.is_empty(), expected, "{:?}", found);
        }
    }

    #[test]
    fn what_was_read_after_a_topic_fell_silent_decides_nothing() {
        let last = MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } };
        let judged = |trend, series: &[(f64, f64)], since: f64, to: Option<f64>| {
            let plan = CampaignPlan {
                metrics: vec![Metric { trend, ..metric("gap", last.clone()) }],
                requirements: vec![requirement("apart", 0, Bound::AtLeast { value: 1.0 })],
                topics: vec![topic("gap", &["gap"], Type::Real { unit: None })],
                ..minimal()
            };
            let value = series.last().map(|point| point.1);
            let mut metrics = vec![MetricObservation::whole(value, value.is_some(), series.to_vec())];
            distrust(&plan, &[Silence { wire: 0, from: since, to }], &mut metrics);
            verdict(plan.requirements[0].bound, &Outcome::Completed, MetricValue::from(&metrics[0]))
        };
        let falling = Some(Trend::Falling);
        assert_eq!(judged(falling, &[(1.0, 5.0)], 3.0, Some(8.0)), Verdict::Satisfied, "it spoke again");
        assert_eq!(judged(falling, &[(1.0, 5.0)], 3.0, None), Verdict::Inconclusive);
        assert_eq!(judged(falling, &[(1.0, 5.0), (2.0, 0.5)], 3.0, None), Verdict::Violated, "it was violated before");
        assert_eq!(judged(falling, &[(1.0, 5.0), (4.0, 0.5)], 3.0, None), Verdict::Inconclusive, "by an old value");
        assert_eq!(judged(Some(Trend::Rising), &[(1.0, 5.0)], 3.0, None), Verdict::Satisfied, "only better can come");
        assert_eq!(judged(None, &[(1.0, 5.0)], 3.0, None), Verdict::Inconclusive);
    }

    #[test]
    fn a_default_never_turns_silence_into_satisfaction() {
        let last = MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } };
        let plan = CampaignPlan {
            metrics: vec![metric("gap", last)],
            requirements: vec![requirement("apart", 0, Bound::AtLeast { value: 1.0 })],
            topics: vec![topic("gap", &["gap"], Type::Real { unit: None })],
            ..minimal()
        };
        let mut metrics = vec![MetricObservation::whole(Some(99.0), false, Vec::new())];
        distrust(&plan, &[Silence { wire: 0, from: 0.0, to: None }], &mut metrics);
        let shown = MetricValue::from(&metrics[0]);
        assert_eq!(verdict(plan.requirements[0].bound, &Outcome::Completed, shown), Verdict::Inconclusive);
        assert_eq!(shown.value, Some(99.0), "objectives keep it");
    }
}
