//! What a campaign optimises: its metrics, each with the direction that is sought.

use crate::{CampaignPlan, Direction, MetricId};

/// An objective of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Objective {
    /// The metric.
    pub metric: MetricId,
    /// Which end of it is sought.
    pub direction: Direction,
}

impl CampaignPlan {
    /// The objectives of the campaign, in its order.
    ///
    /// # Panics
    /// If the metric of an objective has no direction, which a [valid](CampaignPlan::validate) plan excludes.
    pub fn objectives(&self) -> impl ExactSizeIterator<Item = Objective> {
        self.campaign.objectives.iter().map(|&metric| {
            let direction = self.metric(metric).direction.expect("the metric of an objective has a direction");
            Objective { metric, direction }
        })
    }
}

impl Objective {
    /// A value of the metric, negated if more is sought: smaller is better. It is never a negative zero.
    pub fn oriented(self, value: f64) -> f64 {
        match self.direction {
            // Added to zero and subtracted from it, so that no negative zero comes out.
            Direction::Minimise => 0.0 + value,
            Direction::Maximise => 0.0 - value,
        }
    }

    /// The value of the metric, in its unit, that [`Objective::oriented`] made this one of.
    pub fn in_unit(self, oriented: f64) -> f64 {
        // Negating twice gives the value again.
        self.oriented(oriented)
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::{metric, minimal};
    use crate::{CampaignPlan, Direction, Metric, MetricId, MetricSource};

    #[test]
    fn oriented_values_are_smaller_for_better_ones_and_lead_back_to_the_value() {
        let of = |direction| Metric { direction: Some(direction), ..metric("m", MetricSource::FuzzingTime) };
        let metrics = vec![of(Direction::Minimise), of(Direction::Maximise)];
        let mut plan = CampaignPlan { metrics, ..minimal() };
        plan.campaign.objectives = vec![MetricId(1), MetricId(0)];
        let [most, least] = plan.objectives().collect::<Vec<_>>()[..] else { panic!("there are two") };
        assert_eq!((most.metric, least.metric), (MetricId(1), MetricId(0)));
        assert!(most.oriented(3.0) < most.oriented(2.0) && least.oriented(2.0) < least.oriented(3.0));
        for objective in [most, least] {
            assert_eq!(objective.in_unit(objective.oriented(2.5)), 2.5);
            let zeros = [0.0, -0.0].map(|zero| objective.oriented(zero));
            assert!(zeros.iter().all(|zero| zero.is_sign_positive()), "{objective:?} {zeros:?}");
        }
    }
}
