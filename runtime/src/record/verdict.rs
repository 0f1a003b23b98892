//! What a run says about a requirement: kept, violated, or unsaid.

use serde::Serialize;
use sesame_plan::{Bound, CampaignPlan, Failing, MetricId, Span};

use crate::observation::Outcome;
use crate::record::MetricValue;

/// What a run says about a requirement. Three values, never two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The run ended as planned and the metric's value is inside the bound.
    Kept,
    /// The metric's value is outside the bound.
    Violated,
    /// There is no value, or the run broke off before it could be known.
    Unsaid,
}

impl Verdict {
    /// One word for tables and the database.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Kept => "kept",
            Verdict::Violated => "violated",
            Verdict::Unsaid => "unsaid",
        }
    }
}

/// The verdict on a requirement.
///
/// A value that is a default counts as measured when the run ended as planned. When the run broke off (crash, timeout)
/// a value that was set and is outside the bound is a violation and stands; anything else is unsaid, since the rest of
/// the run might have changed it.
pub fn verdict(bound: Bound, outcome: &Outcome, value: MetricValue) -> Verdict {
    let ended = matches!(outcome, Outcome::Completed | Outcome::Void | Outcome::Unknown);
    match value.value {
        Some(x) if bound.holds(x) && ended => Verdict::Kept,
        Some(x) if !bound.holds(x) && (ended || value.set) => Verdict::Violated,
        Some(_) | None => Verdict::Unsaid,
    }
}

/// Whether a run failed in a given way. One in which nothing was disturbed did not, whatever it shows.
pub fn fails(
    plan: &CampaignPlan,
    failing: &Failing,
    outcome: &Outcome,
    value: impl Fn(MetricId) -> MetricValue,
) -> bool {
    match failing {
        Failing::Crash => matches!(outcome, Outcome::Crash { .. }),
        Failing::Timeout => matches!(outcome, Outcome::Timeout { .. }),
        Failing::Violation { requirements } => {
            *outcome != Outcome::Void
                && requirements.iter().all(|&id| {
                    let requirement = plan.requirement(id);
                    verdict(requirement.bound, outcome, value(requirement.metric)) == Verdict::Violated
                })
        }
    }
}

/// When a metric's value was outside a bound: spans in order, none touching, from its change points
/// `(seconds, value)` up to the end of the run.
pub fn violation_spans(series: &[(f64, f64)], bound: Bound, end: f64) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for (at, &(start, value)) in series.iter().enumerate() {
        let stop = series.get(at + 1).map_or(end, |next| next.0).min(end);
        if bound.holds(value) || start >= end {
            continue;
        }
        match spans.last_mut() {
            Some(last) if last.end >= start => last.end = stop,
            _ => spans.push(Span { start, end: stop }),
        }
    }
    spans
}

/// A bound as `(low, low excluded, high, high excluded)`; an end that is missing is unbounded.
pub(crate) fn ends(bound: Bound) -> (Option<f64>, bool, Option<f64>, bool) {
    match bound {
        Bound::AtMost { value } => (None, false, Some(value), false),
        Bound::Below { value } => (None, false, Some(value), true),
        Bound::AtLeast { value } => (Some(value), false, None, false),
        Bound::Above { value } => (Some(value), true, None, false),
        Bound::Equal { value } => (Some(value), false, Some(value), false),
        Bound::Within { low, high } => (Some(low), false, Some(high), false),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_plan::RequirementId;

    use super::*;

    fn value(value: Option<f64>, set: bool) -> MetricValue {
        MetricValue { value, set }
    }

    #[test]
    fn a_default_counts_as_measured_when_the_run_ended() {
        let at_most_zero = Bound::AtMost { value: 0.0 };
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(Some(0.0), false)), Verdict::Kept);
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(Some(999.0), false)), Verdict::Violated);
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(None, false)), Verdict::Unsaid);
    }

    #[test]
    fn after_a_crash_only_a_violation_that_was_seen_stands() {
        let at_most_zero = Bound::AtMost { value: 0.0 };
        let crash = Outcome::Crash { message: "gone".to_owned() };
        assert_eq!(verdict(at_most_zero, &crash, value(Some(3.0), true)), Verdict::Violated);
        assert_eq!(verdict(at_most_zero, &crash, value(Some(999.0), false)), Verdict::Unsaid);
        assert_eq!(verdict(at_most_zero, &crash, value(Some(0.0), true)), Verdict::Unsaid);
    }

    #[test]
    fn a_run_fails_alike_if_it_violates_all_of_it_and_was_disturbed() {
        let plan = crate::record::sample::plan();
        let violation =
            |ids: &[u32]| Failing::Violation { requirements: ids.iter().copied().map(RequirementId).collect() };
        // R1: at most 0 of metric 0; R4: at most 70 of metric 3.
        let with = |outcome: &Outcome, failing: &Failing, collisions: f64, cycle: f64| {
            fails(&plan, failing, outcome, |id| value(Some(if id.0 == 3 { cycle } else { collisions }), true))
        };
        let both = violation(&[0, 3]);
        assert!(with(&Outcome::Completed, &both, 1.0, 71.0));
        assert!(!with(&Outcome::Completed, &both, 1.0, 69.0) && with(&Outcome::Completed, &violation(&[0]), 1.0, 69.0));
        assert!(!with(&Outcome::Void, &both, 1.0, 71.0), "nothing was disturbed");
        let crash = Outcome::Crash { message: "gone".to_owned() };
        assert!(with(&crash, &both, 1.0, 71.0), "a violation seen before a crash stands");
        assert!(with(&crash, &Failing::Crash, 0.0, 0.0) && !with(&crash, &Failing::Timeout, 0.0, 0.0));
        assert!(with(&Outcome::Timeout { limit: 1.0 }, &Failing::Timeout, 0.0, 0.0));
    }

    proptest! {
        #[test]
        fn spans_cover_exactly_the_times_at_which_the_last_value_breaks_the_bound(
            steps in prop::collection::vec((1u32..20, -2i32..3), 0..12),
            low in -2i32..1, width in 0i32..3, end in 0u32..100,
        ) {
            let bound = Bound::Within { low: f64::from(low), high: f64::from(low + width) };
            let mut time = 0;
            let series: Vec<(f64, f64)> = steps.iter().map(|&(step, value)| {
                time += step;
                (f64::from(time), f64::from(value))
            }).collect();
            let end = f64::from(end);
            let spans = violation_spans(&series, bound, end);
            prop_assert!(spans.iter().all(|span| span.start < span.end && span.end <= end));
            prop_assert!(spans.windows(2).all(|pair| pair[0].end < pair[1].start));
            for tick in 0..200 {
                let t = f64::from(tick) / 2.0 + 0.25;
                let held = series.iter().rev().find(|point| point.0 <= t);
                let broken = t < end && held.is_some_and(|point| !bound.holds(point.1));
                prop_assert_eq!(spans.iter().any(|span| span.start <= t && t < span.end), broken, "at {}", t);
            }
        }
    }
}
