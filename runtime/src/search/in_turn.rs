//! Tests that do not depend on results, handed out one after the other.

use sesame_plan::Test;

use crate::search::Candidate;

/// Tests per generation: enough to keep many workers busy, few enough to see progress.
const GENERATION: u32 = 50;

/// How far a search is that learns nothing: so many evaluations, in generations of 50.
#[derive(Debug, Clone, Copy)]
pub(super) struct InTurn {
    pub(super) evaluations: u32,
    asked: u32,
    awaited: usize,
}

impl InTurn {
    pub(super) fn new(evaluations: u32) -> Self {
        InTurn { evaluations, asked: 0, awaited: 0 }
    }

    /// The next generation, of the tests of these indices, from 0; empty when all evaluations are used up.
    pub(super) fn ask(&mut self, test: impl FnMut(u32) -> Test) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        let generation = self.asked / GENERATION;
        let end = self.evaluations.min(self.asked + GENERATION);
        let tests = (self.asked..end).map(test);
        let batch: Vec<Candidate> = tests
            .map(|test| Candidate { test, parents: Vec::new(), generation, known: None, simulator_seed: None })
            .collect();
        self.asked = end;
        self.awaited = batch.len();
        batch
    }

    /// Takes note that so many results were told.
    pub(super) fn tell(&mut self, results: usize) {
        assert!(results == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
    }
}
