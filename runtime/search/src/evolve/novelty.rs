//! Novelty as one objective more (Lehman and Stanley 2011; as a second objective, Mouret 2011).
//!
//! How novel a test is, is the mean distance [SESAME 2023, equation 1] of its point to those of its nearest neighbours
//! among all tests so far. NSGA-II chooses its survivors by the campaign's objectives and by novelty together, so that
//! tests unlike the others stay and breed. Nothing else knows of it: fronts, hypervolumes and results are those of the
//! campaign's objectives.
//!
//! Up to 500 tests novelty is exact. Beyond that, tests nearer to an earlier one than a resolution are left out of the
//! comparison, and the resolution grows as often as it has to: so what a test costs does not grow with their number.

use std::collections::BTreeMap;

use sesame_base::observation::Observation;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::nsga2::{Nsga2, Told};
use sesame_plan::Dimension;

use crate::sspr::{self, Point};
use crate::{Candidate, Evaluated, Strategy, TestVariation};

/// Points that are compared with at most.
const MOST: usize = 500;
/// As far as they are thinned out then.
const THINNED: usize = 250;
/// The first resolution.
const FINEST: f64 = 1e-3;

/// NSGA-II with novelty among its objectives.
pub(crate) struct Novel {
    evolution: Nsga2<TestVariation>,
    archive: Archive,
    /// The tests of the population, by number: their objectives and points.
    alive: BTreeMap<u32, (Fitness, Option<Point>)>,
}

impl Novel {
    pub(crate) fn new(evolution: Nsga2<TestVariation>, measure: Measure) -> Self {
        Novel { evolution, archive: Archive::new(measure), alive: BTreeMap::new() }
    }
}

impl Strategy for Novel {
    fn begin(&mut self, reference: &Observation) {
        Strategy::begin(&mut self.evolution, reference);
    }

    fn ask(&mut self) -> Vec<Candidate> {
        Strategy::ask(&mut self.evolution)
    }

    fn tell(&mut self, results: &[Evaluated]) {
        for result in results {
            if let Some(point) = &result.point {
                self.archive.add(result.number, *point);
            }
            self.alive.insert(result.number, (result.fitness.clone(), result.point));
        }
        let appraised = |number: u32| {
            let (fitness, point) = &self.alive[&number];
            let Fitness::Measured(objectives) = fitness else { return fitness.clone() };
            let novelty = point.as_ref().map_or(0.0, |point| self.archive.novelty(number, point));
            // More of it is better; subtracted from zero, so that there is no negative zero.
            Fitness::Measured(objectives.iter().copied().chain([0.0 - novelty]).collect())
        };
        self.evolution.update_fitness(|member| appraised(member.number));
        let told = |result: &Evaluated| Told {
            number: result.number,
            genome: result.test.clone(),
            fitness: appraised(result.number),
        };
        self.evolution.tell(results.iter().map(told).collect::<Vec<_>>());
        let population = self.evolution.population();
        self.alive.retain(|&number, _| population.iter().any(|member| member.number == number));
    }
}

/// What novelty is measured by.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Measure {
    /// How many of the nearest points count; at least 1.
    pub(crate) neighbours: usize,
    /// The dimensions of distances.
    pub(crate) over: Vec<Dimension>,
    /// What counts are divided by: the most operations that a test may hold.
    pub(crate) largest_count: f64,
}

impl Measure {
    fn distance(&self, a: &Point, b: &Point) -> f64 {
        sspr::distance_of_any(a, b, &self.over, self.largest_count)
    }
}

/// The points that tests are compared with.
#[derive(Debug, Clone)]
struct Archive {
    measure: Measure,
    /// In the order of their tests.
    points: Vec<(u32, Point)>,
    /// Points nearer to an earlier one are left out; 0 as long as all are kept.
    resolution: f64,
}

impl Archive {
    fn new(measure: Measure) -> Self {
        Archive { measure, points: Vec::new(), resolution: 0.0 }
    }

    fn add(&mut self, number: u32, point: Point) {
        if self.is_covered(&point) {
            return;
        }
        self.points.push((number, point));
        if self.points.len() <= MOST {
            return;
        }
        while self.points.len() > THINNED {
            self.resolution = (2.0 * self.resolution).max(FINEST);
            for (number, point) in std::mem::take(&mut self.points) {
                if !self.is_covered(&point) {
                    self.points.push((number, point));
                }
            }
        }
    }

    fn is_covered(&self, point: &Point) -> bool {
        self.resolution > 0.0
            && self.points.iter().any(|(_, other)| self.measure.distance(point, other) < self.resolution)
    }

    /// The mean distance to the nearest points of other tests; to fewer where there are no more, and 0 where there are
    /// none.
    fn novelty(&self, number: u32, point: &Point) -> f64 {
        let others = self.points.iter().filter(|(other, _)| *other != number);
        let mut distances: Vec<f64> = others.map(|(_, other)| self.measure.distance(point, other)).collect();
        if distances.is_empty() {
            return 0.0;
        }
        let nearest = self.measure.neighbours.clamp(1, distances.len());
        distances.select_nth_unstable_by(nearest - 1, f64::total_cmp);
        distances.truncate(nearest);
        // In order, so that rounding does not depend on how they were selected.
        distances.sort_by(f64::total_cmp);
        distances.iter().sum::<f64>() / nearest as f64
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{Exploration, Search, Span, Strategy};

    use super::*;
    use crate::coverage::Grid;
    use crate::sspr::{Class, Convention, Disturbance, distance};
    use crate::strategy;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn point((start, length): (f64, f64)) -> Point {
        let window = Span { start: 0.0, end: 1.0 };
        let intervals = vec![Span { start: start * (1.0 - length), end: start * (1.0 - length) + length }];
        let of = Disturbance { class: Class::Value, window, intervals, parameters: Vec::new() };
        Point::from_disturbances(&[of], Convention::Ours).unwrap()
    }

    fn measure(neighbours: usize) -> Measure {
        Measure { neighbours, over: vec![Dimension::T1, Dimension::T2, Dimension::O0], largest_count: 5.0 }
    }

    proptest! {
        #[test]
        fn novelty_is_the_mean_distance_to_the_nearest(
            places in prop::collection::vec((0.0..1.0f64, 0.01..1.0f64), 2..40), neighbours in 1usize..6,
        ) {
            let mut archive = Archive::new(measure(neighbours));
            let points: Vec<Point> = places.into_iter().map(point).collect();
            for (number, point) in (1..).zip(&points) {
                archive.add(number, *point);
            }
            for (number, point) in (1..).zip(&points) {
                let others = (1..).zip(&points).filter(|(other, _)| *other != number);
                let mut distances: Vec<f64> =
                    others.map(|(_, other)| distance(point, other, &archive.measure.over, 5.0).unwrap()).collect();
                distances.sort_by(f64::total_cmp);
                let nearest = &distances[..neighbours.min(distances.len())];
                let expected = nearest.iter().sum::<f64>() / nearest.len() as f64;
                prop_assert!((archive.novelty(number, point) - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_archive_stays_small_and_no_test_is_far_from_all_of_it() {
        let mut archive = Archive::new(measure(3));
        let mut stream = sesame_rng::Stream::derive(1, "test", &[]);
        let points: Vec<Point> = (0..3_000).map(|_| point((stream.unit(), stream.unit().max(0.01)))).collect();
        for (number, point) in (1..).zip(&points) {
            archive.add(number, *point);
            assert!(archive.points.len() <= MOST);
        }
        assert!(archive.resolution < 0.2, "{}", archive.resolution);
        assert!(points.iter().all(|point| archive.is_covered(point)));
    }

    #[test]
    fn an_evolution_with_novelty_covers_more_and_keeps_most_of_its_front() {
        let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
        let landscape = &SYNTHETIC_ROBOTS[0];
        let ran = |exploration: Option<Exploration>| {
            let mut plan = landscape.plan(Search::new(Strategy::Nsga2 { population: 10 }, 210));
            plan.campaign.exploration = exploration;
            let (mut covered, mut volume) = (0, 0.0);
            for seed in 1..=8 {
                let run = landscape.campaign(strategy(&plan, seed).unwrap().as_mut());
                let mut cells: Vec<usize> =
                    run.tests.iter().filter_map(|test| grid.cell_of(test.point.as_ref()?)).collect();
                cells.sort_unstable();
                cells.dedup();
                covered += cells.len();
                volume += run.volume;
            }
            (covered, volume)
        };
        let over = vec![Dimension::T1, Dimension::T2, Dimension::P1];
        let (novel, novel_volume) = ran(Some(Exploration::Novelty { neighbours: 10, over }));
        let (plain, plain_volume) = ran(None);
        assert!(novel > plain, "{novel} and {plain} cells of eight seeds");
        assert!(novel_volume > 0.5 * plain_volume, "{novel_volume} and {plain_volume}");
    }
}
