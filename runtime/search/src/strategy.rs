//! The contract of strategies: a strategy is asked for tests and told their results.

use std::sync::Arc;

use sesame_base::observation::Observation;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::nsga2::{self, Nsga2, Variation};
use sesame_plan::{Activation, KnownTestId, Test};

use crate::evolve::variation::TestVariation;
use crate::sspr::Point;

/// How tests are found, by ask and tell.
///
/// The caller alternates: it asks for a generation, evaluates all of it in any order, and tells the results in the
/// order asked. Of a strategy that [does not depend on results](Strategy::asks_ahead) it may ask for further
/// generations before that. The number of tests of all generations together is exactly
/// [`Task::evaluations`](sesame_plan::Task::evaluations), or less if the strategy runs out of tests; then
/// [`Strategy::ended`] says so.
pub trait Strategy: Send {
    /// The next generation of tests; empty when the search is over.
    fn ask(&mut self) -> Vec<Candidate>;

    /// Takes the results of exactly the oldest generation that was asked and not told, in its order.
    fn tell(&mut self, results: &[Evaluated]);

    /// Whether further generations may be asked for before the results of earlier ones are known, since no test
    /// depends on them.
    fn asks_ahead(&self) -> bool {
        false
    }

    /// Takes the reference run, before the first generation is asked.
    fn begin(&mut self, _reference: &Observation) {}

    /// Whether it reads the series of metrics in the runs that it is told. To others the caller may tell runs without
    /// them.
    fn reads_series(&self) -> bool {
        false
    }

    /// Whether the runs of the generation asked last list the messages that operations alter.
    fn lists_altered(&self) -> bool {
        false
    }

    /// What the search gave up, for the record of the campaign.
    fn given_up(&self) -> Vec<String> {
        Vec::new()
    }

    /// How many tests there are to choose from, if they are counted; [`u128::MAX`] if there are more.
    fn tests(&self) -> Option<u128> {
        None
    }

    /// Why the search is over, if there is more to say than that all tests were evaluated.
    fn ended(&self) -> Option<String> {
        None
    }
}

/// A test to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The test.
    pub test: Test,
    /// Numbers of the tests it descends from: none, one or two.
    pub parents: Vec<u32>,
    /// The generation it belongs to, from 0.
    pub generation: u32,
    /// Which known test it is, if known tests are run.
    pub known: Option<KnownTestId>,
    /// The simulator's seed in its run; `None` for the campaign's own. Equal tests with seeds of their own are each
    /// run.
    pub simulator_seed: Option<u64>,
}

/// A test with its result. What a strategy learns from in addition to the fitness, it derives from the runs itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The caller's number of the test, unique in the campaign.
    pub number: u32,
    /// The test, as asked.
    pub test: Test,
    /// Its fitness, from [`fitness`](crate::fitness); for a confirmed test, from its fresh runs.
    pub fitness: Fitness,
    /// Where its run lies in the reduced parameter space, if it counts for coverage.
    pub point: Option<Point>,
    /// Its own run.
    pub run: Arc<Observation>,
    /// The runs that confirm it, without series; empty if it is not confirmed.
    pub fresh_runs: Vec<Observation>,
}

impl Evaluated {
    /// Whether an operation of its test, by position, acted in its own run: it had an effect, or acted before the start
    /// or after the end, where no effect can be counted. An operation whose effects are unknown counts as one that
    /// acted.
    pub(crate) fn acted(&self, position: usize) -> bool {
        self.test.operations[position].activation == Activation::Offline
            || self.run.operations.get(position).is_none_or(|effect| effect.counters.any_effect())
    }
}

/// Variation of tests that learns from results.
pub(crate) trait Learning: Variation<Genome = Test> {
    /// Takes the results of the generation asked last, in its order.
    fn learn(&mut self, results: &[Evaluated]);

    /// Takes the reference run.
    fn begin(&mut self, _reference: &Observation) {}

    /// As [`Strategy::reads_series`].
    fn reads_series(&self) -> bool {
        false
    }

    /// What it gave up, each in a sentence.
    fn given_up(&self) -> Vec<String> {
        Vec::new()
    }
}

impl Learning for TestVariation {
    fn begin(&mut self, reference: &Observation) {
        self.take_reference(reference);
    }

    /// Results only matter to selection.
    fn learn(&mut self, _: &[Evaluated]) {}
}

impl<V: Learning + Send> Strategy for Nsga2<V> {
    fn ask(&mut self) -> Vec<Candidate> {
        let generation = self.generation();
        let asked = Nsga2::ask(self);
        asked
            .into_iter()
            .map(|a| Candidate { test: a.genome, parents: a.parents, generation, known: None, simulator_seed: None })
            .collect()
    }

    fn begin(&mut self, reference: &Observation) {
        self.variation_mut().begin(reference);
    }

    fn reads_series(&self) -> bool {
        self.variation().reads_series()
    }

    fn given_up(&self) -> Vec<String> {
        self.variation().given_up()
    }

    fn tell(&mut self, results: &[Evaluated]) {
        self.variation_mut().learn(results);
        Nsga2::tell(
            self,
            results.iter().map(|result| nsga2::Told {
                number: result.number,
                genome: result.test.clone(),
                fitness: result.fitness.clone(),
            }),
        );
    }
}
