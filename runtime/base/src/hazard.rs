//! When a requirement was violated for the first time in a run: a *hazard*, which a monitor foresees, misses, or
//! prevents.

use sesame_plan::{CampaignPlan, MetricSource, RequirementId};

use crate::observation::{MetricObservation, MetricValue, Outcome};
use crate::robustness::{Quantifier, lost, quantifier};
use crate::verdict::{Verdict, ends, verdict};

/// The first moment, in seconds, at which the metric of a requirement was outside of its bound, from what all metrics
/// showed in a run that ended at `end`; `None` if it never was. Of several values of one instant the last one counts.
///
/// The robustness of a temporal formula is known when all is over, and its signal says when it was violated. A metric
/// that has only its default is outside at the end of a run that came to its end. Of a value that grows with time, the
/// fuzzing time or the time in a state, the series has the ends of its growth, and the hazard is the end after which it
/// is known.
pub fn hazard(
    plan: &CampaignPlan,
    requirement: RequirementId,
    outcome: &Outcome,
    metrics: &[MetricObservation],
    end: f64,
) -> Option<f64> {
    let declared = plan.requirement(requirement);
    let observed = metrics.get(declared.metric.index())?;
    if matches!(plan.metric(declared.metric).source, MetricSource::Robustness { .. }) {
        return of_formula(plan, requirement, outcome, observed);
    }
    let bound = declared.bound;
    let next = |at: usize| observed.series.get(at + 1).map(|point| point.0);
    let lasting = observed.series.iter().enumerate().filter(|(at, point)| next(*at) != Some(point.0));
    let first = lasting.map(|(_, point)| *point).find(|(_, value)| !bound.holds(*value));
    let by_default = !observed.set && outcome.is_whole() && observed.value.is_some_and(|value| !bound.holds(value));
    first.map(|(time, _)| time).or(by_default.then_some(end))
}

/// When a requirement on the robustness of a formula was violated, from what that showed; `None` if it was not.
pub fn of_formula(
    plan: &CampaignPlan,
    requirement: RequirementId,
    outcome: &Outcome,
    observed: &MetricObservation,
) -> Option<f64> {
    let declared = plan.requirement(requirement);
    let MetricSource::Robustness { robustness } = &plan.metric(declared.metric).source else { return None };
    let shown = MetricValue::from(observed);
    if verdict(declared.bound, outcome, shown) != Verdict::Violated {
        return None;
    }
    let value = shown.value?;
    let quantifier = quantifier(&robustness.formula);
    let (low, _, high, _) = ends(declared.bound);
    let by_single_times = match quantifier {
        Some(Quantifier::Always) => low.is_some_and(|low| value <= low),
        Some(Quantifier::Eventually) => high.is_some_and(|high| value >= high),
        None => false,
    };
    let spans = lost(&observed.robustness, quantifier, declared.bound, value);
    let first = spans.first().filter(|_| by_single_times).map(|span| span.start);
    // Otherwise it took the whole run.
    first.or(observed.series.last().map(|point| point.0))
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{metric, minimal, requirement};
    use sesame_plan::{Bound, FieldRef, TopicId};

    use super::*;

    #[test]
    fn it_is_the_first_moment_outside_of_the_bound_after_all_of_its_instant() {
        let last = MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } };
        let plan = CampaignPlan {
            metrics: vec![metric("gap", last)],
            requirements: vec![requirement("apart", 0, Bound::AtLeast { value: 1.0 })],
            ..minimal()
        };
        let of = |outcome: &Outcome, series: &[(f64, f64)], default: f64| {
            let value = series.last().map_or(default, |point| point.1);
            let observed = MetricObservation::whole(Some(value), !series.is_empty(), series.to_vec());
            hazard(&plan, RequirementId(0), outcome, &[observed], 9.0)
        };
        let whole = &Outcome::Completed;
        assert_eq!(
            of(whole, &[(1.0, 3.0), (2.0, 0.5), (3.0, 2.0)], 5.0),
            Some(2.0),
            "although it is inside at the end"
        );
        assert_eq!(of(whole, &[(2.0, 0.5), (2.0, 2.0), (4.0, 0.1)], 5.0), Some(4.0), "within an instant it is nothing");
        assert_eq!(of(whole, &[(2.0, 1.0)], 5.0), None);
        assert_eq!((of(whole, &[], 0.5), of(whole, &[], 5.0)), (Some(9.0), None));
        assert_eq!(of(&Outcome::crash("gone".to_owned()), &[], 0.5), None, "it might still have been set");
    }
}
