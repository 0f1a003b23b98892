//! The observers of a campaign.

mod coverage;
mod front;
mod indicators;
mod stop;

use sesame_base::observation::Observation;
use sesame_plan::CampaignPlan;
use sesame_search::coverage::GridError;
use sesame_search::fitness;

use crate::campaign::observer::Observer;

pub(super) use coverage::counted_point;

/// The observers of a campaign. If several end a search after the same generation, the first one in this list gives the
/// reason.
pub(super) fn observers(plan: &CampaignPlan, reference: &Observation) -> Result<Vec<Box<dyn Observer>>, GridError> {
    let mut observers: Vec<Box<dyn Observer>> = Vec::new();
    if !plan.campaign.objectives.is_empty() {
        observers.push(Box::new(front::FrontOfEachGeneration));
    }
    observers.push(Box::new(indicators::IndicatorsOfEachGeneration::new(&fitness(plan, reference))));
    if let Some(goal) = &plan.campaign.coverage {
        observers.push(Box::new(coverage::CoverageOfEachGeneration::new(plan, goal)?));
    }
    observers.push(Box::new(stop::Rules::new(plan, reference)));
    Ok(observers)
}
