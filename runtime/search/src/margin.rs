//! Margins: how far the requirements of a space are from their violation in one run.

use sesame_base::observation::Observation;
use sesame_base::verdict::{Verdict, verdict};
use sesame_optimise::falsify::Margin;
use sesame_plan::{Bound, CampaignPlan, Requirement, Statistic};

use crate::Evaluated;
use crate::confirmed_front::aggregate_margin;

/// The margin of each requirement of the plan, in its order. One is violated exactly where the requirement's
/// [`verdict`] is.
///
/// A margin is in the unit of the requirement's metric: how far the metric may still move before it breaks the bound,
/// and negative by how far it has moved beyond. If the verdict is inconclusive, there is none. If a run broke off,
/// a violation has the least size that it could have had at the end of the run.
pub fn margins(plan: &CampaignPlan, observation: &Observation) -> Vec<Margin> {
    let margin = |requirement: &Requirement| {
        let shown = observation.value(requirement.metric);
        let verdict = verdict(requirement.bound, &observation.outcome, shown);
        let value = match verdict {
            Verdict::Satisfied => shown.value.map(|value| to_bound(requirement.bound, value)),
            Verdict::Violated => {
                let ends = [shown.reach.low, shown.reach.high].into_iter().flatten();
                ends.map(|end| to_bound(requirement.bound, end)).reduce(f64::max)
            }
            Verdict::Inconclusive => None,
        };
        Margin { value, violated: verdict == Verdict::Violated }
    };
    plan.requirements.iter().map(margin).collect()
}

/// The margin of each requirement over the fresh runs that confirm a test, aggregated as its campaign says. The margin
/// of a requirement is unknown if too few runs are conclusive.
pub fn confirmed_margins(plan: &CampaignPlan, by: Statistic, fresh_runs: &[Observation]) -> Vec<Margin> {
    let runs: Vec<Vec<Margin>> = fresh_runs.iter().map(|run| margins(plan, run)).collect();
    let of = |requirement: usize| {
        let margins: Vec<Margin> = runs.iter().map(|run| run[requirement]).collect();
        aggregate_margin(&margins, by)
    };
    (0..plan.requirements.len()).map(of).collect()
}

/// The margin of each requirement in an evaluated test: over the fresh runs where the campaign confirms, else in its
/// own run.
pub(crate) fn evaluated_margins(plan: &CampaignPlan, result: &Evaluated) -> Vec<Margin> {
    match plan.campaign.confirm {
        Some(confirmation) if !result.fresh_runs.is_empty() => {
            confirmed_margins(plan, confirmation.by, &result.fresh_runs)
        }
        _ => margins(plan, &result.run),
    }
}

/// How far a value is from breaking a bound.
fn to_bound(bound: Bound, x: f64) -> f64 {
    // Infinite values at infinite bounds are as far as can be.
    let ahead = |difference: f64| if difference.is_nan() { f64::INFINITY } else { difference };
    match bound {
        Bound::AtMost { value } | Bound::Below { value } => ahead(value - x),
        Bound::AtLeast { value } | Bound::Above { value } => ahead(x - value),
        Bound::Equal { value } => -(x - value).abs(),
        Bound::Within { low, high } => ahead(x - low).min(ahead(high - x)),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_base::observation::{MetricObservation, Outcome, Reach};
    use sesame_plan::{Search, Strategy};

    use super::*;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn margin(outcome: Outcome, shown: MetricObservation) -> Margin {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        plan.requirements = vec![sesame_plan::testing::requirement("in_time", 0, Bound::AtMost { value: 70.0 })];
        let observation = Observation { end: 70.0, metrics: vec![shown], ..Observation::without_run(outcome) };
        margins(&plan, &observation).remove(0)
    }

    #[test]
    fn a_crash_is_no_violation_by_the_default_of_a_metric_that_was_never_set() {
        let crash = || Outcome::Crash { message: "gone".to_owned() };
        let never_set = MetricObservation { value: Some(999.0), ..MetricObservation::default() };
        assert_eq!(margin(crash(), never_set), Margin { value: None, violated: false });
        let whole = MetricObservation::whole(Some(999.0), false, Vec::new());
        assert_eq!(margin(Outcome::Completed, whole), Margin { value: Some(-929.0), violated: true });
        let reach = Reach::onwards(Some(sesame_plan::Trend::Rising), Some(75.0));
        let risen = MetricObservation { value: Some(75.0), set: true, reach, ..MetricObservation::default() };
        assert_eq!(margin(crash(), risen), Margin { value: Some(-5.0), violated: true });
    }

    proptest! {
        #[test]
        fn a_margin_is_violated_exactly_where_the_verdict_is(
            x in prop::option::of(60i32..80), low in prop::option::of(60i32..80), more in prop::option::of(0i32..10),
            whole in any::<bool>(), finite in any::<bool>(),
        ) {
            let outcome = if whole { Outcome::Completed } else { Outcome::Timeout { limit: 1.0 } };
            let reach = if whole && finite {
                Reach::of_whole_run(x.map(f64::from))
            } else {
                Reach { low: low.map(f64::from), high: more.map(|more| f64::from(low.unwrap_or(70) + more)) }
            };
            let not_finite = (!finite).then_some(1.0);
            let shown = MetricObservation { value: x.map(f64::from), set: true, reach, not_finite, ..MetricObservation::default() };
            let verdict = verdict(Bound::AtMost { value: 70.0 }, &outcome, (&shown).into());
            let margin = margin(outcome, shown);
            prop_assert_eq!(margin.violated, verdict == Verdict::Violated);
            prop_assert_eq!(margin.value.is_none(), verdict == Verdict::Inconclusive);
            prop_assert!(margin.value.is_none_or(|value| (value < 0.0) == margin.violated));
        }

        #[test]
        fn margins_are_negative_where_a_bound_is_broken_and_positive_where_it_is_kept(
            x in -5i32..5, at in -5i32..5, width in 0i32..5,
        ) {
            let (x, value, high) = (f64::from(x), f64::from(at), f64::from(at + width));
            let bounds = [
                Bound::AtMost { value }, Bound::Below { value }, Bound::AtLeast { value }, Bound::Above { value },
                Bound::Equal { value }, Bound::Within { low: value, high },
            ];
            for bound in bounds {
                let margin = to_bound(bound, x);
                prop_assert!(if bound.holds(x) { margin >= 0.0 } else { margin <= 0.0 }, "{bound:?} of {x}: {margin}");
                // The way to the violation is that long: what moves less stays on its side.
                for nearer in [x - margin.abs() / 2.0, x + margin.abs() / 2.0] {
                    prop_assert!(margin == 0.0 || bound.holds(nearer) == bound.holds(x), "{bound:?} of {x}");
                }
            }
        }
    }
}
