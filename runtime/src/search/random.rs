//! Random search: independent fresh tests, the baseline of every other strategy.

use crate::rng::Stream;
use crate::search::in_turn::InTurn;
use crate::search::initial::fresh_test;
use crate::search::{Candidate, Evaluated, Permitted, Strategy};

/// Independent fresh tests in generations of 50; nothing is learned from the results.
#[derive(Debug, Clone)]
pub struct Random {
    permitted: Permitted,
    seed: u64,
    turn: InTurn,
}

impl Random {
    /// So many tests of what is permitted. The nth test depends on the seed and n alone, and is the nth of generation 0
    /// of an NSGA-II with the same seed.
    pub fn new(permitted: Permitted, evaluations: u32, seed: u64) -> Self {
        Random { permitted, seed, turn: InTurn::new(evaluations) }
    }
}

impl Strategy for Random {
    fn ask(&mut self) -> Vec<Candidate> {
        self.turn
            .ask(|index| fresh_test(&self.permitted, &mut Stream::derive(self.seed, "initial", &[u64::from(index)])))
    }

    fn tell(&mut self, results: &[Evaluated]) {
        self.turn.tell(results.len());
    }
}
