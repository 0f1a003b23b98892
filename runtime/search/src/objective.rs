//! The objectives of a campaign as a search sees them: smaller is better.

use sesame_base::observation::{Observation, Outcome};
use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_plan::{CampaignPlan, MetricId};

/// The fitness of a run: its objective values in the campaign's order, negated where more is sought; or why it has
/// none.
pub fn fitness(plan: &CampaignPlan, observation: &Observation) -> Fitness {
    fitness_of(plan, &observation.outcome, |id| observation.metrics.get(id.index())?.value)
}

/// As [`fitness`], for a run of which only the outcome and the metrics' values are known.
pub fn fitness_of(plan: &CampaignPlan, outcome: &Outcome, value: impl Fn(MetricId) -> Option<f64>) -> Fitness {
    match outcome {
        // What was imported stands in fronts as it did there.
        Outcome::Completed | Outcome::Unknown => {}
        Outcome::NoEffect => return Fitness::Unfit(Unfit::Void),
        Outcome::Crash { .. } => return Fitness::Unfit(Unfit::Crash),
        Outcome::Timeout { .. } => return Fitness::Unfit(Unfit::Timeout),
        Outcome::LaunchFailed { .. } | Outcome::Disconnect { .. } | Outcome::WrongClock { .. } => {
            return Fitness::Unfit(Unfit::Unmeasured);
        }
    }
    let oriented = plan.objectives().map(|objective| {
        let value = value(objective.metric).filter(|value| !value.is_nan())?;
        Some(objective.oriented(value))
    });
    oriented.collect::<Option<Vec<f64>>>().map_or(Fitness::Unfit(Unfit::Unmeasured), Fitness::Measured)
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::MetricObservation;

    use sesame_plan::{Search, Strategy};

    use super::*;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn observed(outcome: Outcome, values: &[Option<f64>]) -> Observation {
        let metric = |&value: &Option<f64>| MetricObservation::whole(value, value.is_some(), Vec::new());
        Observation { end: 70.0, metrics: values.iter().map(metric).collect(), ..Observation::without_run(outcome) }
    }

    #[test]
    fn fitness_orients_objectives_in_the_order_of_the_campaign() {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        let completed = observed(Outcome::Completed, &[Some(12.5), Some(3.0)]);
        assert_eq!(fitness(&plan, &completed), Fitness::Measured(vec![12.5, -3.0]));
        plan.campaign.objectives.reverse();
        assert_eq!(fitness(&plan, &completed), Fitness::Measured(vec![-3.0, 12.5]));
        plan.campaign.objectives = vec![MetricId(1)];
        let Fitness::Measured(zero) = fitness(&plan, &observed(Outcome::Completed, &[None, Some(0.0)])) else {
            panic!("only objectives need a value")
        };
        assert!(zero[0].is_sign_positive());
    }

    #[test]
    fn only_completed_runs_with_all_objectives_have_a_fitness() {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        let values = [Some(12.5), Some(3.0)];
        let unfit = |outcome, values: &[Option<f64>]| match fitness(&plan, &observed(outcome, values)) {
            Fitness::Unfit(why) => why,
            other => panic!("{other:?}"),
        };
        assert_eq!(unfit(Outcome::NoEffect, &values), Unfit::Void);
        assert_eq!(unfit(Outcome::Crash { message: "x".to_owned() }, &[]), Unfit::Crash);
        assert_eq!(unfit(Outcome::Timeout { limit: 9.0 }, &values), Unfit::Timeout);
        assert_eq!(unfit(Outcome::Completed, &[Some(12.5), None]), Unfit::Unmeasured);
        assert_eq!(unfit(Outcome::Completed, &[Some(12.5), Some(f64::NAN)]), Unfit::Unmeasured);
        assert_eq!(unfit(Outcome::Completed, &[]), Unfit::Unmeasured);
    }
}
