//! The front after each generation, as a result set.

use std::ops::ControlFlow;

use sesame_record::{RecordError, Recorder, ResultSet, Status};

use crate::campaign::observer::{Generation, Observer};

/// Records the front after each generation.
#[derive(Debug)]
pub(super) struct FrontOfEachGeneration;

impl Observer for FrontOfEachGeneration {
    fn generation_ended(
        &mut self,
        generation: Generation<'_>,
        recorder: &mut Recorder,
    ) -> Result<ControlFlow<String>, RecordError> {
        recorder.put_result_set(&ResultSet {
            name: format!("generation-{}", generation.number),
            generation: Some(generation.number),
            status: Status::Intermediate,
            members: generation.front.numbers(),
        })?;
        Ok(ControlFlow::Continue(()))
    }
}
