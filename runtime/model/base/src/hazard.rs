//! When a requirement was lost in a run: a *hazard*, which a monitor foresees, misses, or prevents.

use sesame_plan::{CampaignPlan, MetricSource, RequirementId};

use crate::observation::{MetricObservation, MetricValue, Outcome, Reach};
use crate::verdict::{Verdict, breaks, verdict};

/// The first moment, in seconds, from which no continuation of a run could satisfy a requirement, from what all metrics
/// showed in a run that ended at `end`; `None` if the run did not violate it. If an instant has several values, the
/// last one counts.
///
/// A metric that only gets worse, such as a maximum with an upper bound, is lost when it leaves its bound. For all
/// others, only the end decides: a mean may recover, and a count may yet be reached. A run records when it
/// lost a bound on the robustness of a temporal formula: for `eventually [0s, 60s]` that is at 60 s.
pub fn hazard(
    plan: &CampaignPlan,
    requirement: RequirementId,
    outcome: &Outcome,
    metrics: &[MetricObservation],
    end: f64,
) -> Option<f64> {
    let declared = plan.requirement(requirement);
    let observed = metrics.get(declared.metric.index())?;
    let metric = plan.metric(declared.metric);
    if verdict(declared.bound, outcome, MetricValue::from(observed)) != Verdict::Violated {
        return None;
    }
    if matches!(metric.source, MetricSource::Robustness { .. }) {
        let lost = observed.lost.iter().find(|lost| lost.requirement == requirement);
        return Some(lost.map_or(end, |lost| lost.at));
    }
    let next = |at: usize| observed.series.get(at + 1).map(|point| point.0);
    let lasting = observed.series.iter().enumerate().filter(|(at, point)| next(*at) != Some(point.0));
    let mut lasting = lasting.map(|(_, point)| *point);
    let lost = lasting.find(|&(_, value)| breaks(declared.bound, Reach::onwards(metric.trend, Some(value))));
    Some(lost.map_or(end, |(time, _)| time))
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{metric, minimal, requirement};
    use sesame_plan::{Bound, FieldRef, Metric, TopicId, Trend};

    use super::*;

    #[test]
    fn it_is_the_first_moment_from_which_nothing_could_satisfy_the_requirement() {
        let last = MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } };
        let of = |trend, outcome: &Outcome, series: &[(f64, f64)], default: f64| {
            let plan = CampaignPlan {
                metrics: vec![Metric { trend, ..metric("gap", last.clone()) }],
                requirements: vec![requirement("apart", 0, Bound::AtLeast { value: 1.0 })],
                ..minimal()
            };
            let value = series.last().map_or(default, |point| point.1);
            let mut observed = MetricObservation::whole(Some(value), !series.is_empty(), series.to_vec());
            if !outcome.is_whole() {
                observed.reach = Reach::onwards(trend, series.last().map(|point| point.1));
            }
            hazard(&plan, RequirementId(0), outcome, &[observed], 9.0)
        };
        let (whole, crash) = (&Outcome::Completed, &Outcome::crash("gone".to_owned()));
        let falling = Some(Trend::Falling);
        assert_eq!(of(falling, whole, &[(1.0, 3.0), (2.0, 0.5), (3.0, 0.25)], 5.0), Some(2.0));
        assert_eq!(of(falling, crash, &[(1.0, 3.0), (2.0, 0.5)], 5.0), Some(2.0));
        assert_eq!(of(falling, whole, &[(2.0, 0.5), (2.0, 2.0), (4.0, 0.1)], 5.0), Some(4.0), "not within an instant");
        assert_eq!(of(None, whole, &[(1.0, 3.0), (2.0, 0.5), (3.0, 2.0)], 5.0), None, "it is satisfied at the end");
        assert_eq!(of(None, whole, &[(1.0, 3.0), (2.0, 0.5)], 5.0), Some(9.0), "until the end it could recover");
        assert_eq!(of(None, crash, &[(2.0, 0.5)], 5.0), None, "it might still have recovered");
        assert_eq!(of(Some(Trend::Rising), whole, &[(2.0, 0.5)], 5.0), Some(9.0));
        assert_eq!(of(falling, whole, &[(2.0, 1.0)], 5.0), None);
        assert_eq!((of(None, whole, &[], 0.5), of(None, whole, &[], 5.0)), (Some(9.0), None));
    }
}
