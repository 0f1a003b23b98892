//! Random search: independent fresh tests, the baseline of every other strategy.

use crate::rng::Stream;
use crate::search::initial::fresh_test;
use crate::search::{Candidate, Evaluated, Permitted, Strategy};

/// Tests per generation: enough to keep many workers busy, few enough to see progress.
const GENERATION: u32 = 50;

/// Independent fresh tests in generations of 50; nothing is learned from the results.
#[derive(Debug, Clone)]
pub struct Random {
    permitted: Permitted,
    evaluations: u32,
    seed: u64,
    asked: u32,
    awaited: usize,
}

impl Random {
    /// So many tests of what is permitted. The nth test depends on the seed and n alone, and is the nth of generation 0
    /// of an NSGA-II with the same seed.
    pub fn new(permitted: Permitted, evaluations: u32, seed: u64) -> Self {
        Random { permitted, evaluations, seed, asked: 0, awaited: 0 }
    }
}

impl Strategy for Random {
    fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        let generation = self.asked / GENERATION;
        let end = self.evaluations.min(self.asked + GENERATION);
        let batch: Vec<Candidate> = (self.asked..end)
            .map(|index| {
                let mut stream = Stream::derive(self.seed, "initial", &[u64::from(index)]);
                Candidate {
                    test: fresh_test(&self.permitted, &mut stream),
                    parents: Vec::new(),
                    generation,
                    known: None,
                }
            })
            .collect();
        self.asked = end;
        self.awaited = batch.len();
        batch
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(results.len() == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
    }
}
