//! Random search: independent fresh tests, the baseline of every other strategy.

use sesame_plan::Test;
use sesame_rng::Stream;

use crate::Permitted;
use crate::sample::in_turn::Sampling;
use crate::space::initial::fresh_test;

/// Independent fresh tests. The nth depends on the seed and n alone, and is the nth of generation 0 of an NSGA-II with the
/// same seed.
#[derive(Debug, Clone)]
pub struct Random {
    permitted: Permitted,
    seed: u64,
}

impl Random {
    /// Tests of what is permitted.
    pub fn new(permitted: Permitted, seed: u64) -> Self {
        Random { permitted, seed }
    }
}

impl Sampling for Random {
    fn test(&mut self, index: u32) -> Test {
        fresh_test(&self.permitted, &mut Stream::derive(self.seed, "initial", &[u64::from(index)]))
    }
}
