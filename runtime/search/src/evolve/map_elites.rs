//! MAP-Elites (Mouret and Clune 2015) for several objectives (Pierrot et al. 2022): each cell of the grid keeps the
//! best tests that fell into it.
//!
//! The tests of a cell compete with each other only, so that the search goes on everywhere at once. Where one objective
//! is sought a cell keeps one test; with several it keeps those that none of its others dominates, of many the ones
//! farthest apart. Parents come from any occupied cell alike and from any of its tests alike.

use std::collections::BTreeMap;

use sesame_base::observation::Observation;
use sesame_optimise::dominance::{Fitness, dominates};
use sesame_optimise::nsga2::{Heritage, Settings, Variation};
use sesame_optimise::selection::survivors;
use sesame_rng::Stream;

use crate::coverage::Grid;
use crate::{Candidate, Evaluated, Strategy, TestVariation};

/// Tests that a cell keeps at most.
const ELITES: usize = 5;

/// MAP-Elites over the tests of one campaign, in generations.
#[derive(Debug, Clone)]
pub(crate) struct MapElites {
    settings: Settings,
    tests: TestVariation,
    grid: Grid,
    /// Per occupied cell its best tests, none of which dominates another.
    elites: BTreeMap<usize, Vec<Evaluated>>,
    generation: u32,
    asked: u32,
    awaited: usize,
}

impl MapElites {
    /// A search before its first generation.
    pub(crate) fn new(settings: Settings, tests: TestVariation, grid: Grid) -> Self {
        assert!(settings.population > 0, "a generation has at least one test");
        MapElites { settings, tests, grid, elites: BTreeMap::new(), generation: 0, asked: 0, awaited: 0 }
    }

    fn parent(&self, stream: &mut Stream) -> &Evaluated {
        let cell = self.elites.values().nth(stream.below(self.elites.len())).expect("it is one of them");
        &cell[stream.below(cell.len())]
    }

    /// Fresh tests: the first generation, and each until a test has landed anywhere.
    fn fresh(&mut self, size: u32) -> Vec<Candidate> {
        let (first, generation) = (self.asked, self.generation);
        let fresh = |at| Candidate {
            test: self.tests.initial(u64::from(first + at)),
            parents: Vec::new(),
            generation,
            known: None,
            simulator_seed: None,
        };
        (0..size).map(fresh).collect()
    }

    fn bred(&mut self, size: u32) -> Vec<Candidate> {
        let generation = self.generation;
        let mut batch = Vec::with_capacity(size as usize + 1);
        for pair in 0..u64::from(size.div_ceil(2)) {
            let mut stream = Stream::derive(self.settings.seed, "mating", &[u64::from(generation), pair]);
            let [first, second] = [(); 2].map(|()| self.parent(&mut stream).clone());
            for child in self.tests.offspring([&first.test, &second.test], u64::from(generation), pair) {
                let parents = match child.heritage {
                    Heritage::First => vec![first.number],
                    Heritage::Second => vec![second.number],
                    Heritage::Both if first.number == second.number => vec![first.number],
                    Heritage::Both => vec![first.number, second.number],
                };
                batch.push(Candidate { test: child.genome, parents, generation, known: None, simulator_seed: None });
            }
        }
        batch.truncate(size as usize);
        batch
    }

    fn keep(&mut self, result: &Evaluated) {
        let Some(cell) = result.point.as_ref().and_then(|point| self.grid.cell_of(point)) else { return };
        let Fitness::Measured(_) = result.fitness else { return };
        let elites = self.elites.entry(cell).or_default();
        if elites.iter().any(|elite| dominates(&elite.fitness, &result.fitness) || elite.fitness == result.fitness) {
            return;
        }
        elites.retain(|elite| !dominates(&result.fitness, &elite.fitness));
        elites.push(result.clone());
        if elites.len() > ELITES {
            let fitness: Vec<&Fitness> = elites.iter().map(|elite| &elite.fitness).collect();
            let kept = survivors(&fitness, ELITES);
            *elites = kept.into_iter().map(|(at, _)| elites[at].clone()).collect();
        }
    }
}

impl Strategy for MapElites {
    fn begin(&mut self, reference: &Observation) {
        self.tests.take_reference(reference);
    }

    fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        let size = self.settings.population.min(self.settings.evaluations - self.asked);
        let batch = if self.elites.is_empty() { self.fresh(size) } else { self.bred(size) };
        self.asked += size;
        self.awaited = batch.len();
        self.generation += 1;
        batch
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(results.len() == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
        for result in results {
            self.keep(result);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_optimise::nsga2::Survival;

    use super::*;
    use crate::evolve::variation::Rates;
    use crate::space::test_space::TestSpace;
    use crate::sspr::{Convention, Point, planned};
    use crate::strategy;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn search() -> MapElites {
        let plan = SYNTHETIC_ROBOTS[0].plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1));
        let tests = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), Rates::default(), 1);
        let grid = Grid::parse("T1:0:1:2").unwrap();
        MapElites::new(Settings { population: 10, evaluations: 100, seed: 1, survival: Survival::Crowded }, tests, grid)
    }

    proptest! {
           #[test]
           fn a_cell_keeps_tests_that_no_other_of_it_dominates(
               results in prop::collection::vec((0u8..6, 0u8..6, any::<bool>()), 1..40),
           ) {
               let plan = SYNTHETIC_ROBOTS[0].plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1));
               let mut search = search();
               let mut all = Vec::new();
               for (number, (a, b, early)) in (1..).zip(results) {
                   let mut test = search.tests.initial(u64::from(number));
                   for operation in &mut test.operations {
                       let (start, end) = if early { (5.0, 6.0) } else { (55.0, 56.0) };
                       operation.activation = sesame_plan::Activation::Time { start, end };
                   }
                   let point = Point::from_disturbances(&planned(&plan, &test).unwrap(), Convention::Ours);
                   let fitness = Fitness::Measured(vec![f64::from(a), f64::from(b)]);
                   let result = Evaluated { number, test, fitness, point, run: crate::testing::no_run(),
    fresh_runs: Vec::new() };
                   search.keep(&result);
                   all.push((early, result));
               }
               for (&cell, elites) in &search.elites {
                   prop_assert!(elites.len() <= ELITES);
                   let here = || all.iter().filter(|(early, _)| *early == (cell == 0)).map(|(_, evaluated)| evaluated);
                   for elite in elites {
                       prop_assert!(!here().any(|other| dominates(&other.fitness, &elite.fitness)));
                   }
                   let best = here().filter(|elite| !here().any(|other| dominates(&other.fitness, &elite.fitness)));
                   let mut distinct: Vec<&Fitness> = Vec::new();
                   for elite in best.filter(|_| true) {
                       if !distinct.contains(&&elite.fitness) {
                           distinct.push(&elite.fitness);
                       }
                   }
                   prop_assert_eq!(elites.len(), distinct.len().min(ELITES));
               }
           }
       }

    #[test]
    fn it_covers_more_than_an_evolution_for_the_objectives_alone() {
        let landscape = &SYNTHETIC_ROBOTS[0];
        let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
        let covered = |search, seed| {
            let mut plan = landscape.plan(search);
            plan.campaign.coverage =
                Some(sesame_plan::CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
            let run = landscape.campaign(strategy(&plan, seed).unwrap().as_mut());
            let mut cells: Vec<usize> =
                run.tests.iter().filter_map(|test| grid.cell_of(test.point.as_ref()?)).collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len()
        };
        let sum = |search: fn() -> sesame_plan::Search| (1..=8).map(|seed| covered(search(), seed)).sum::<usize>();
        let elites = sum(|| sesame_plan::Search::new(sesame_plan::Strategy::MapElites { population: 10 }, 210));
        let evolved = sum(|| sesame_plan::Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 210));
        assert!(elites > evolved, "{elites} and {evolved} cells of eight seeds");
    }
}
