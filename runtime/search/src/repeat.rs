//! Repetition: one known test again and again, to see what of its result is chance.

use sesame_plan::Test;
use sesame_rng::derive_seed;

use crate::{Candidate, Evaluated, Strategy};

/// The same test so many times, draw seeds included, in one generation; each run has a seed of the simulator of its own.
#[derive(Debug, Clone)]
pub(crate) struct Repeat {
    test: Test,
    times: u32,
    seed: u64,
    awaited: Option<usize>,
}

impl Repeat {
    /// So many repetitions of a test; `seed` is the campaign's.
    pub(crate) fn new(test: Test, times: u32, seed: u64) -> Self {
        Repeat { test, times, seed, awaited: None }
    }
}

impl Strategy for Repeat {
    fn ask(&mut self) -> Vec<Candidate> {
        if let Some(awaited) = self.awaited {
            assert!(awaited == 0, "a generation is told before the next is asked");
            return Vec::new();
        }
        self.awaited = Some(self.times as usize);
        let repetition = |repetition: u32| Candidate {
            test: self.test.clone(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed: Some(derive_seed(self.seed, "simulator", &[u64::from(repetition)])),
        };
        (1..=self.times).map(repetition).collect()
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(self.awaited == Some(results.len()), "exactly the generation asked last is told");
        self.awaited = Some(0);
    }
}
