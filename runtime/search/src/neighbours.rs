//! Averaging what a search is told of a test with its nearest neighbours, where runs are noisy and repeating them costs
//! too much.
//!
//! Tests that lie near each other disturb alike, so their runs are near to repetitions. What the search is told of a
//! test is the mean, objective by objective, over the test and those of all tests evaluated by the end of its
//! generation that are nearest to it by the distance of the reduced parameter space [SESAME 2023, equation 1]. It is
//! told once: later neighbours change nothing that was told. The record, the front and the rules to stop use each
//! test's own values.
//!
//! All of it depends on results of whole generations, by number, and of neighbours equally far the one with the smaller
//! number is nearer; so it is the same with any number of workers.

use std::collections::BTreeMap;

use sesame_optimise::dominance::Fitness;
use sesame_plan::{CampaignPlan, Dimension};

use crate::Evaluated;
use crate::sspr::{self, Point};

/// When, how strongly and how often operations act. The number of all operations is the sum of the three kinds.
const ALL: [Dimension; 8] = [
    Dimension::T1,
    Dimension::T2,
    Dimension::T3,
    Dimension::P1,
    Dimension::P2,
    Dimension::O1,
    Dimension::O2,
    Dimension::O3,
];
/// The tests of a campaign whose neighbours are asked for.
#[derive(Debug, Clone)]
pub struct Neighbours {
    count: usize,
    /// The most operations that a test of the campaign may hold.
    largest_count: f64,
    /// By number, those that have objective values and a point.
    tests: BTreeMap<u32, (Point, Vec<f64>)>,
}

impl Neighbours {
    /// Before a campaign's first generation; `None` where it does not average.
    pub fn from_plan(plan: &CampaignPlan) -> Option<Neighbours> {
        let count = plan.campaign.neighbours? as usize;
        let largest_count = f64::from(plan.campaign.count.max);
        Some(Neighbours { count, largest_count, tests: BTreeMap::new() })
    }

    /// Takes the results of a generation, and puts the means in the places of their fitness. `stands_for` is the number
    /// of the test whose result stands for another: a duplicate is told what its original would be, and is nobody's
    /// neighbour. A test without objective values, or in which no operation was active, stays as it is.
    pub fn average(&mut self, results: &mut [Evaluated], stands_for: impl Fn(u32) -> u32) {
        for result in results.iter() {
            if let (Some(point), Fitness::Measured(values)) = (&result.point, &result.fitness)
                && stands_for(result.number) == result.number
            {
                self.tests.insert(result.number, (*point, values.clone()));
            }
        }
        for result in results {
            if let Some(mean) = self.mean(stands_for(result.number)) {
                result.fitness = Fitness::Measured(mean);
            }
        }
    }

    fn mean(&self, number: u32) -> Option<Vec<f64>> {
        let (point, own) = self.tests.get(&number)?;
        let others = self.tests.iter().filter(|&(&other, _)| other != number);
        let mut others: Vec<(f64, u32, &[f64])> = others
            .map(|(&other, (at, values))| {
                (sspr::distance_of_any(point, at, &ALL, self.largest_count), other, values.as_slice())
            })
            .collect();
        let nearer = |a: &(f64, u32, &[f64]), b: &(f64, u32, &[f64])| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if others.len() > self.count {
            others.select_nth_unstable_by(self.count, nearer);
            others.truncate(self.count);
        }
        // Sums depend on their order.
        others.sort_by(nearer);
        let mut sums = own.clone();
        for (_, _, values) in &others {
            for (sum, value) in sums.iter_mut().zip(*values) {
                *sum += value;
            }
        }
        let tests = (others.len() + 1) as f64;
        Some(sums.into_iter().map(|sum| sum / tests).collect())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_optimise::dominance::Unfit;
    use sesame_plan::{Search, Strategy};

    use super::*;
    use crate::strategy;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    /// Random tests of a landscape with their points, in generations.
    fn results(count: u32) -> (CampaignPlan, Vec<Evaluated>) {
        let landscape = &SYNTHETIC_ROBOTS[0];
        let mut plan = landscape.plan(Search::new(Strategy::Random, count));
        plan.campaign.neighbours = Some(3);
        let run = landscape.campaign(strategy(&plan, 5).unwrap().as_mut());
        (plan, run.tests)
    }

    fn naive(plan: &CampaignPlan, known: &[Evaluated], of: &Evaluated, count: usize) -> Fitness {
        let Some(point) = of.point.as_ref().filter(|_| of.fitness.objectives().is_some()) else {
            return of.fitness.clone();
        };
        let mut others: Vec<(f64, u32, &[f64])> = known
            .iter()
            .filter(|other| other.number != of.number)
            .filter_map(|other| {
                let at = other.point.as_ref()?;
                let apart = |dimension| match (point.get(dimension), at.get(dimension)) {
                    (Some(a), Some(b)) => a - b,
                    (a, b) => f64::from(u8::from(a.is_some() != b.is_some())),
                };
                let most = f64::from(plan.campaign.count.max);
                let counts = [Dimension::O1, Dimension::O2, Dimension::O3].map(|dimension| apart(dimension) / most);
                let [t1, t2, t3, p1, p2] =
                    [Dimension::T1, Dimension::T2, Dimension::T3, Dimension::P1, Dimension::P2].map(apart);
                let far = [t1, t2, t3, p1, p2]
                    .iter()
                    .chain(&counts)
                    .fold(0.0, |sum, coordinate| sum + coordinate * coordinate);
                let far = libm::sqrt(far);
                Some((far, other.number, other.fitness.objectives()?))
            })
            .collect();
        others.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap());
        let nearest: Vec<&[f64]> = others.iter().take(count).map(|other| other.2).collect();
        let own = of.fitness.objectives().unwrap();
        let mean =
            |at: usize| nearest.iter().fold(own[at], |sum, values| sum + values[at]) / (nearest.len() + 1) as f64;
        Fitness::Measured((0..own.len()).map(mean).collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

        #[test]
        fn what_is_told_is_the_mean_with_the_nearest_tests_so_far(count in 1u32..6, size in 1usize..30) {
            let (mut plan, tests) = results(60);
            plan.campaign.neighbours = Some(count);
            let mut neighbours = Neighbours::from_plan(&plan).unwrap();
            let mut seen = 0;
            for generation in tests.chunks(size) {
                let mut told = generation.to_vec();
                neighbours.average(&mut told, |number| number);
                seen += generation.len();
                for (told, own) in told.iter().zip(generation) {
                    let expected = naive(&plan, &tests[..seen], own, count as usize);
                    prop_assert_eq!(&told.fitness, &expected);
                }
            }
        }
    }

    #[test]
    fn a_duplicate_is_told_what_its_original_is_and_is_nobodys_neighbour() {
        let (plan, tests) = results(20);
        let mut neighbours = Neighbours::from_plan(&plan).unwrap();
        let mut told = tests.clone();
        let mut again = tests.iter().find(|test| test.point.is_some()).unwrap().clone();
        let original = again.number;
        again.number = 99;
        told.push(again);
        neighbours.average(&mut told, |number| if number == 99 { original } else { number });
        let mut without = tests.clone();
        Neighbours::from_plan(&plan).unwrap().average(&mut without, |number| number);
        assert_eq!(told[..20], without[..]);
        let first = without.iter().find(|test| test.number == original).unwrap();
        assert_eq!(told[20].fitness, first.fitness);
    }

    #[test]
    fn what_has_no_values_or_no_place_stays_as_it_is() {
        let (plan, tests) = results(8);
        let mut told = tests[..3].to_vec();
        told[0].fitness = Fitness::Unfit(Unfit::Crash);
        told[1].point = None;
        let before = told.clone();
        Neighbours::from_plan(&plan).unwrap().average(&mut told, |number| number);
        assert_eq!(told, before, "the third has no neighbour that says anything");
    }
}
