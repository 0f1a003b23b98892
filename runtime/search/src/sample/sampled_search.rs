//! Tests that do not depend on results, handed out one after the other.

use std::collections::VecDeque;

use sesame_base::observation::Observation;
use sesame_plan::Test;

use crate::{Candidate, Evaluated, Strategy};

/// Tests per generation: enough to keep many workers busy, few enough to see progress.
const GENERATION: u32 = 50;

/// Tests that are there before any is run.
pub(crate) trait Sampling: Send {
    /// The test of an index; asked for in order, from 0. It depends on the index and the reference run alone. `None`
    /// after the last one.
    fn test(&mut self, index: u32) -> Option<Test>;

    /// Takes the reference run, before the first test is asked for.
    fn begin(&mut self, _reference: &Observation) {}

    /// As [`Strategy::tests`].
    fn tests(&self) -> Option<u128> {
        None
    }

    /// What there is to say of the tests that there are, after so many of them were evaluated.
    fn ended(&self, _evaluated: u32) -> Option<String> {
        None
    }
}

/// A search that learns nothing: as many tests of a sampling as evaluations, if it has so many, in generations of 50.
#[derive(Debug, Clone)]
pub(crate) struct SampledSearch<S> {
    sampling: S,
    evaluations: u32,
    asked: u32,
    /// How many tests each generation has that was asked and not told.
    awaited: VecDeque<usize>,
    /// Whether all tests were asked for.
    over: bool,
}

impl<S: Sampling> SampledSearch<S> {
    /// The first so many tests of a sampling.
    pub(crate) fn new(sampling: S, evaluations: u32) -> Self {
        SampledSearch { sampling, evaluations, asked: 0, awaited: VecDeque::new(), over: false }
    }
}

impl<S: Sampling> Strategy for SampledSearch<S> {
    fn begin(&mut self, reference: &Observation) {
        self.sampling.begin(reference);
    }

    fn ask(&mut self) -> Vec<Candidate> {
        let generation = self.asked / GENERATION;
        let end = self.evaluations.min(self.asked + GENERATION);
        let tests = (self.asked..end).map_while(|index| self.sampling.test(index));
        let batch: Vec<Candidate> = tests
            .map(|test| Candidate { test, parents: Vec::new(), generation, known: None, simulator_seed: None })
            .collect();
        self.over = batch.is_empty();
        if !self.over {
            self.awaited.push_back(batch.len());
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most as many as a generation has")]
        let asked = batch.len() as u32;
        self.asked += asked;
        batch
    }

    fn asks_ahead(&self) -> bool {
        true
    }

    fn tests(&self) -> Option<u128> {
        self.sampling.tests()
    }

    fn ended(&self) -> Option<String> {
        self.over.then(|| self.sampling.ended(self.asked)).flatten()
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(self.awaited.pop_front() == Some(results.len()), "exactly the oldest generation is told");
    }
}
