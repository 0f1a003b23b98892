//! Random search: independent fresh tests, the baseline of every other strategy.

use sesame_base::observation::Observation;
use sesame_plan::Test;
use sesame_rng::Stream;

use crate::sample::sampled_search::Sampling;
use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;

/// Independent fresh tests. The nth depends on the seed and n alone, and is the nth of generation 0 of an NSGA-II with
/// the same seed.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    test_space: TestSpace,
    seed: u64,
}

impl Random {
    /// Tests of what is permitted.
    pub(crate) fn new(test_space: TestSpace, seed: u64) -> Self {
        Random { test_space, seed }
    }
}

impl Sampling for Random {
    fn begin(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
    }

    fn test(&mut self, index: u32) -> Option<Test> {
        Some(fresh_test(&self.test_space, &mut Stream::derive(self.seed, "initial", &[u64::from(index)])))
    }
}
