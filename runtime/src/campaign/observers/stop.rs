//! The campaign's rules to stop.

use std::ops::ControlFlow;
use std::time::Instant;

use sesame_base::observation::Observation;
use sesame_plan::CampaignPlan;
use sesame_record::{RecordError, Recorder};
use sesame_search::StopRules;

use crate::campaign::observer::{Generation, Observer};

/// Ends the search when one of the campaign's rules to stop holds.
pub(super) struct Rules {
    rules: StopRules,
    /// When the search began: a rule by wall time counts from here.
    begun: Instant,
}

impl Rules {
    /// The rules of a plan, from now on, after this reference run.
    pub(super) fn new(plan: &CampaignPlan, reference: &Observation) -> Self {
        let mut rules = StopRules::from_plan(plan);
        rules.begin(reference);
        Rules { rules, begun: Instant::now() }
    }
}

impl Observer for Rules {
    fn generation_ended(
        &mut self,
        generation: Generation<'_>,
        _: &mut Recorder,
    ) -> Result<ControlFlow<String>, RecordError> {
        self.rules.tell(generation.tests);
        Ok(self.rules.reached(self.begun.elapsed()).map_or(ControlFlow::Continue(()), ControlFlow::Break))
    }

    fn may_end(&self) -> bool {
        self.rules.are_any()
    }
}
