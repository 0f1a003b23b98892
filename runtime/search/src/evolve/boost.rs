//! Coverage boosting [SESAME 2023, section 4.2.2]: some children are mutated until they lie in a cell that needs tests.
//!
//! A boosted child is made like every other. If it is not planned to fall into a cell with too few hits, it is mutated
//! again, up to a number of tries; the first result that falls into such a cell is taken. If there is none, the child
//! stays as it first was. The publication does not say what happens then; the original platform keeps the last try,
//! which costs fitness and gains nothing.
//!
//! A cell into which an earlier child of the same generation is planned to fall counts as hit already.

use sesame_base::observation::Observation;
use sesame_optimise::nsga2::{Child, Variation};
use sesame_plan::{BoostedChildren, Test};
use sesame_rng::Stream;

use crate::evolve::cells::Cells;
use crate::strategy::Learning;
use crate::{Evaluated, TestVariation};

/// When and how children are boosted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Boosting {
    /// Only in every n-th generation; at least 1. Generation 0 has no children.
    pub(crate) every_generations: u32,
    /// Which children of such a generation.
    pub(crate) children: BoostedChildren,
    /// How often a child is mutated again at most.
    pub(crate) tries: u32,
}

/// Variation of tests with coverage boosting.
#[derive(Debug, Clone)]
pub(crate) struct BoostingVariation {
    tests: TestVariation,
    cells: Cells,
    boosting: Boosting,
    seed: u64,
}

impl BoostingVariation {
    pub(crate) fn new(tests: TestVariation, cells: Cells, boosting: Boosting, seed: u64) -> Self {
        BoostingVariation { tests, cells, boosting, seed }
    }

    fn boosts(&self, generation: u64, place: u64) -> bool {
        let every = u64::from(self.boosting.every_generations.max(1));
        // BoostingVariation generations are the multiples of `every` from `every` on.
        let [index, time] =
            [place, (generation / every).saturating_sub(1)].map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        generation.is_multiple_of(every) && self.boosting.children.includes(index, time)
    }

    fn needs_tests(&self, test: &Test) -> bool {
        self.cells.cell_of(test).is_some_and(|cell| self.cells.needs_tests(cell))
    }
}

impl Variation for BoostingVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        self.tests.initial(index)
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut place = 2 * pair;
        self.tests.offspring(parents, generation, pair).map(|mut child| {
            if self.boosts(generation, place) && !self.needs_tests(&child.genome) {
                let mut stream = Stream::derive(self.seed, "boost", &[generation, place]);
                let mut test = child.genome.clone();
                for _ in 0..self.boosting.tries {
                    self.tests.mutate_again(&mut test, &mut stream);
                    if self.needs_tests(&test) && self.tests.claim(&test) {
                        child.genome = test;
                        break;
                    }
                }
            }
            if let Some(cell) = self.cells.cell_of(&child.genome) {
                self.cells.reserve(cell);
            }
            place += 1;
            child
        })
    }
}

impl Learning for BoostingVariation {
    fn begin(&mut self, reference: &Observation) {
        self.tests.take_reference(reference);
    }

    fn learn(&mut self, results: &[Evaluated]) {
        self.cells.learn(results);
    }
}
