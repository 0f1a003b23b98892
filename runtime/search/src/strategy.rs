//! What a strategy is: it is asked for tests and told what came out of them.

use sesame_optimise::dominance::Fitness;
use sesame_optimise::nsga2::{self, Nsga2, Variation};
use sesame_plan::{KnownTestId, Test};

use crate::evolve::predict::VariableTrajectories;
use crate::evolve::variation::TestVariation;
use crate::margin::Margin;
use crate::sspr::Point;

/// How tests are found, by ask and tell.
///
/// The caller alternates: it asks for a generation, evaluates all of it in whatever order, and tells the results in the
/// order asked. The tests of all generations together are exactly [`Search::evaluations`]; of [`Shrink`], at most.
pub trait Strategy: Send {
    /// The next generation of tests; empty when the search is over.
    fn ask(&mut self) -> Vec<Candidate>;

    /// Takes the results of exactly the generation asked last, in its order.
    fn tell(&mut self, results: &[Evaluated]);

    /// Takes how the condition variables went in the undisturbed run, before the first generation is asked.
    fn reference(&mut self, _: VariableTrajectories) {}

    /// What the search gave up, for the record of the campaign.
    fn given_up(&self) -> Vec<String> {
        Vec::new()
    }

    /// Why the search is over, where there is more to say than that all tests were evaluated.
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
    /// The known test it is, where a search runs known tests for their own sake.
    pub known: Option<KnownTestId>,
    /// The simulator's seed in its run; `None` for the campaign's own. Equal tests with seeds of their own are run each.
    pub simulator_seed: Option<u64>,
}

/// A test with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The caller's number of the test, unique in the campaign.
    pub number: u32,
    /// The test, as asked.
    pub test: Test,
    /// Its fitness, from [`fitness`].
    pub fitness: Fitness,
    /// Where its run lies in the reduced parameter space, if it counts for coverage.
    pub point: Option<Point>,
    /// How the condition variables went in its run, where the campaign [predicts](needs_trajectories).
    pub trajectories: Option<VariableTrajectories>,
    /// How far each requirement of the plan is from its violation, from [`margins`], where the campaign
    /// [asks for them](needs_margins); else empty.
    pub margins: Vec<Margin>,
    /// Whether it failed as a campaign that [makes a test smaller](Search::Shrink) has it; else false.
    pub failing: bool,
}

/// Variation of tests that is told what came of them.
pub(crate) trait Learning: Variation<Genome = Test> {
    /// Takes the results of the generation asked last, in its order.
    fn learn(&mut self, results: &[Evaluated]);

    /// Takes how the condition variables went in the undisturbed run.
    fn reference(&mut self, _: VariableTrajectories) {}

    /// What it gave up, each in a sentence.
    fn given_up(&self) -> Vec<String> {
        Vec::new()
    }
}

impl Learning for TestVariation {
    /// Selection alone decides what becomes of results.
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

    fn reference(&mut self, trajectories: VariableTrajectories) {
        self.variation_mut().reference(trajectories);
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
