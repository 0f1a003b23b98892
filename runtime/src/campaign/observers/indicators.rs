//! How good the front is after each generation.

use std::ops::ControlFlow;

use sesame_optimise::dominance::Fitness;
use sesame_record::{RecordError, Recorder};
use sesame_search::indicators::Indicators;

use crate::campaign::observer::{EndedTest, Generation, Observer};

/// Measures and records the indicators of each generation.
#[derive(Debug)]
pub(super) struct IndicatorsOfEachGeneration(Indicators);

impl IndicatorsOfEachGeneration {
    /// For a campaign whose reference run has this fitness.
    pub(super) fn new(reference: &Fitness) -> Self {
        IndicatorsOfEachGeneration(Indicators::new(Some(reference)))
    }
}

impl Observer for IndicatorsOfEachGeneration {
    fn test_ended(&mut self, EndedTest { record, fitness, .. }: EndedTest<'_>) {
        self.0.add(&record.observation.outcome, record.duplicate_of.is_some(), fitness);
    }

    fn generation_ended(
        &mut self,
        generation: Generation<'_>,
        recorder: &mut Recorder,
    ) -> Result<ControlFlow<String>, RecordError> {
        let indicators = self.0.after(generation.number, generation.front);
        recorder.put_indicators(&indicators, self.0.reference())?;
        Ok(ControlFlow::Continue(()))
    }
}
