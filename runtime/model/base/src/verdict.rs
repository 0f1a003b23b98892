//! What a run says about a requirement: satisfied, violated, or inconclusive.

use serde::Serialize;

use sesame_plan::{Bound, CampaignPlan, Failing, MetricId, Span};

use crate::observation::{MetricValue, Outcome, Reach};

/// What a run says about a requirement. Three values, never two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The run ended as planned and the metric's value is inside the bound.
    Satisfied,
    /// The metric's value is outside the bound; after a run that broke off, it could not have returned inside.
    Violated,
    /// There is no value, the run broke off before it could be known, or the metric read a number that was not finite.
    Inconclusive,
}

impl Verdict {
    /// One word for tables and the database.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Satisfied => "satisfied",
            Verdict::Violated => "violated",
            Verdict::Inconclusive => "inconclusive",
        }
    }
}

/// The verdict of a run on a requirement. This rule is the only one: tables, margins, confirmations, and the views of
/// the database follow it.
///
/// The requirement is violated if the bound holds for none of the values that the metric could have had at the planned
/// end of the run. It is satisfied if the run reached its planned end, everything that the metric read was finite, and
/// the bound holds for all of these values. Otherwise the run is inconclusive.
pub fn verdict(bound: Bound, outcome: &Outcome, shown: MetricValue) -> Verdict {
    if breaks(bound, shown.reach) {
        return Verdict::Violated;
    }
    let trusted = outcome.is_whole() && shown.not_finite.is_none();
    if trusted && shown.value.is_some() && keeps(bound, shown.reach) {
        Verdict::Satisfied
    } else {
        Verdict::Inconclusive
    }
}

/// Whether a bound holds for all of these values.
fn keeps(bound: Bound, reach: Reach) -> bool {
    let (low, low_excluded, high, high_excluded) = ends(bound);
    let above = low.is_none_or(|end| reach.low.is_some_and(|x| x > end || (!low_excluded && x == end)));
    let below = high.is_none_or(|end| reach.high.is_some_and(|x| x < end || (!high_excluded && x == end)));
    above && below
}

/// Whether a bound holds for none of these values.
pub fn breaks(bound: Bound, reach: Reach) -> bool {
    let (low, low_excluded, high, high_excluded) = ends(bound);
    let too_low = reach.high.zip(low).is_some_and(|(x, end)| x < end || (low_excluded && x == end));
    let too_high = reach.low.zip(high).is_some_and(|(x, end)| x > end || (high_excluded && x == end));
    too_low || too_high
}

/// Whether a run failed in a given way. A run without effect never counts as failing.
pub fn fails(
    plan: &CampaignPlan,
    failing: &Failing,
    outcome: &Outcome,
    value: impl Fn(MetricId) -> MetricValue,
) -> bool {
    match failing {
        Failing::Crash => matches!(outcome, Outcome::Crash { .. }),
        Failing::Timeout => matches!(outcome, Outcome::Timeout { .. }),
        Failing::Violation { requirements, margins } => {
            *outcome != Outcome::NoEffect
                && requirements.iter().enumerate().all(|(at, &id)| {
                    let requirement = plan.requirement(id);
                    let bound = widened(requirement.bound, margins.get(at).copied().unwrap_or(0.0));
                    verdict(bound, outcome, value(requirement.metric)) == Verdict::Violated
                })
        }
    }
}

/// The share of its bound by which a requirement must be violated at least, for a test to count as one that fails in
/// the same way as another.
const MARGIN: f64 = 1e-6;

/// By how much a requirement must be violated by a test that fails like one in which its metric had this value: a small
/// share of the bound, or of the violation if that is less (a bound of 0 has no size).
pub fn margin(bound: Bound, value: f64) -> f64 {
    let (low, _, high, _) = ends(bound);
    let violation = |end: f64, by: f64| {
        let size = if end == 0.0 { by } else { end.abs().min(by) };
        if by > 0.0 { MARGIN * size } else { 0.0 }
    };
    let below = low.map_or(0.0, |end| violation(end, end - value));
    let above = high.map_or(0.0, |end| violation(end, value - end));
    below.max(above)
}

/// A bound that only values keep or miss by at most this much.
fn widened(bound: Bound, margin: f64) -> Bound {
    if margin == 0.0 {
        return bound;
    }
    match bound {
        Bound::AtMost { value } => Bound::AtMost { value: value + margin },
        Bound::Below { value } => Bound::Below { value: value + margin },
        Bound::AtLeast { value } => Bound::AtLeast { value: value - margin },
        Bound::Above { value } => Bound::Above { value: value - margin },
        Bound::Equal { value } => Bound::Within { low: value - margin, high: value + margin },
        Bound::Within { low, high } => Bound::Within { low: low - margin, high: high + margin },
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
pub fn ends(bound: Bound) -> (Option<f64>, bool, Option<f64>, bool) {
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

    use sesame_plan::testing::{plan, requirement};
    use sesame_plan::{RequirementId, Trend};

    use super::*;

    fn value(value: Option<f64>, set: bool) -> MetricValue {
        MetricValue::whole(value, set)
    }

    /// The value of a metric that was set in a run that broke off.
    fn cut_off(value: f64, trend: Option<Trend>) -> MetricValue {
        MetricValue { value: Some(value), set: true, reach: Reach::onwards(trend, Some(value)), not_finite: None }
    }

    fn crash() -> Outcome {
        Outcome::Crash { message: "gone".to_owned() }
    }

    #[test]
    fn a_default_counts_as_measured_when_the_run_ended() {
        let at_most_zero = Bound::AtMost { value: 0.0 };
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(Some(0.0), false)), Verdict::Satisfied);
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(Some(999.0), false)), Verdict::Violated);
        assert_eq!(verdict(at_most_zero, &Outcome::Completed, value(None, false)), Verdict::Inconclusive);
    }

    #[test]
    fn after_a_crash_a_value_is_a_violation_only_if_it_can_only_get_worse() {
        let (at_most, at_least) = (Bound::AtMost { value: 2.0 }, Bound::AtLeast { value: 10.0 });
        let said = |bound, value, trend| verdict(bound, &crash(), cut_off(value, trend));
        assert_eq!(said(at_most, 3.0, Some(Trend::Rising)), Verdict::Violated);
        assert_eq!(said(at_most, 2.0, Some(Trend::Rising)), Verdict::Inconclusive);
        assert_eq!(said(at_most, 3.0, Some(Trend::Falling)), Verdict::Inconclusive);
        assert_eq!(said(at_most, 3.0, None), Verdict::Inconclusive);
        assert_eq!(said(at_least, 4.0, Some(Trend::Rising)), Verdict::Inconclusive, "ten may still come");
        assert_eq!(said(at_least, 4.0, Some(Trend::Falling)), Verdict::Violated);
        assert_eq!(
            said(at_least, 12.0, Some(Trend::Rising)),
            Verdict::Inconclusive,
            "a run that broke off keeps nothing"
        );
        assert_eq!(said(Bound::Within { low: 0.0, high: 2.0 }, 3.0, Some(Trend::Rising)), Verdict::Violated);
        assert_eq!(said(Bound::Below { value: 3.0 }, 3.0, Some(Trend::Rising)), Verdict::Violated);
        assert_eq!(said(Bound::Above { value: 3.0 }, 3.0, Some(Trend::Falling)), Verdict::Violated);
    }

    #[test]
    fn the_default_of_a_metric_that_was_never_set_says_nothing_after_a_crash() {
        let shown = MetricValue { value: Some(999.0), ..MetricValue::default() };
        assert_eq!(verdict(Bound::AtMost { value: 70.0 }, &crash(), shown), Verdict::Inconclusive);
    }

    #[test]
    fn a_metric_that_read_what_is_not_finite_keeps_nothing_but_may_violate() {
        let at_most = Bound::AtMost { value: 2.0 };
        let said = |x| {
            let shown = MetricValue { not_finite: Some(1.0), ..cut_off(x, Some(Trend::Rising)) };
            verdict(at_most, &Outcome::Completed, shown)
        };
        assert_eq!((said(1.0), said(3.0)), (Verdict::Inconclusive, Verdict::Violated));
    }

    #[test]
    fn a_run_fails_alike_if_it_violates_all_of_it_and_was_disturbed() {
        let mut plan = plan(Vec::new());
        plan.requirements = [(0, 0.0), (1, 70.0)]
            .map(|(metric, value)| requirement(&format!("R{metric}"), metric, Bound::AtMost { value }))
            .to_vec();
        let violation = |ids: &[u32]| Failing::Violation {
            requirements: ids.iter().copied().map(RequirementId).collect(),
            margins: Vec::new(),
        };
        let with = |outcome: &Outcome, failing: &Failing, collisions: f64, cycle: f64| {
            fails(&plan, failing, outcome, |id| {
                cut_off(if id.0 == 1 { cycle } else { collisions }, Some(Trend::Rising))
            })
        };
        let both = violation(&[0, 1]);
        assert!(with(&Outcome::Completed, &both, 1.0, 71.0));
        assert!(!with(&Outcome::Completed, &both, 1.0, 69.0) && with(&Outcome::Completed, &violation(&[0]), 1.0, 69.0));
        assert!(!with(&Outcome::NoEffect, &both, 1.0, 71.0), "nothing was disturbed");
        let crash = crash();
        assert!(with(&crash, &both, 1.0, 71.0), "a violation seen before a crash stands");
        assert!(with(&crash, &Failing::Crash, 0.0, 0.0) && !with(&crash, &Failing::Timeout, 0.0, 0.0));
        assert!(with(&Outcome::Timeout { limit: 1.0 }, &Failing::Timeout, 0.0, 0.0));
    }

    #[test]
    fn a_violation_by_rounding_is_not_the_failure_of_another_test() {
        let mut plan = plan(Vec::new());
        plan.requirements = vec![requirement("R1", 0, Bound::AtMost { value: 2.0 })];
        let with = |found: f64, value: f64| {
            let margins = vec![margin(plan.requirements[0].bound, found)];
            let failing = Failing::Violation { requirements: vec![RequirementId(0)], margins };
            fails(&plan, &failing, &Outcome::Completed, |_| MetricValue::whole(Some(value), true))
        };
        assert!(with(3.0, 3.0) && with(3.0, 2.001));
        assert!(!with(3.0, 2.0 + 1e-12), "it may as well be none");
        // The test itself violated it by no more than that.
        assert!(with(2.0 + 1e-9, 2.0 + 1e-9) && !with(2.0 + 1e-9, 2.0 + 1e-16));
        assert!((margin(Bound::AtMost { value: 0.0 }, 5.0) - 5e-6).abs() < 1e-15);
        assert!((margin(Bound::Within { low: 1.0, high: 2.0 }, 0.5) - 0.5e-6).abs() < 1e-15);
        assert_eq!(margin(Bound::AtMost { value: 2.0 }, 1.0), 0.0);
    }

    proptest! {
        // What a run that broke off says is what every run says that goes on from there.
        #[test]
        fn a_violation_is_one_for_every_value_in_reach(
            kind in 0usize..6, a in -3i32..4, width in 0i32..3,
            low in prop::option::of(-4i32..5), more in prop::option::of(0i32..4),
        ) {
            let at = f64::from(a);
            let bound = [
                Bound::AtMost { value: at }, Bound::Below { value: at }, Bound::AtLeast { value: at },
                Bound::Above { value: at }, Bound::Equal { value: at },
                Bound::Within { low: at, high: f64::from(a + width) },
            ][kind];
            let reach = Reach { low: low.map(f64::from), high: more.map(|more| f64::from(low.unwrap_or(0) + more)) };
            let inside = |x: &f64| reach.low.is_none_or(|low| *x >= low) && reach.high.is_none_or(|high| *x <= high);
            let values: Vec<f64> = (-100..=100).map(|half| f64::from(half) / 2.0).filter(inside).collect();
            let all = values.iter().all(|&x| !bound.holds(x));
            let shown = MetricValue { value: values.first().copied(), set: true, reach, not_finite: None };
            prop_assert_eq!(verdict(bound, &crash(), shown) == Verdict::Violated, all);
        }

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
