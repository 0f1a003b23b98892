//! Sobol' sampling: tests along Sobol' points, a baseline like random and Latin hypercube tests.
//!
//! Every beginning of the search is spread evenly over each choice, not only the whole: so it may be stopped at any
//! time. Campaigns by condition have no such choices and are not sampled so.

use sesame_base::observation::Observation;
use sesame_optimise::sobol::SobolPoints;
use sesame_plan::Test;

use crate::sample::decode::decoded;
use crate::sample::sampled_search::Sampling;
use crate::space::test_space::TestSpace;

/// Tests along scrambled Sobol' points. The nth depends on the seed and n alone.
#[derive(Debug, Clone)]
pub(crate) struct Sobol {
    test_space: TestSpace,
    seed: u64,
    points: SobolPoints,
}

impl Sobol {
    /// Tests of what is permitted.
    pub(crate) fn new(test_space: TestSpace, seed: u64) -> Self {
        Sobol { test_space, seed, points: SobolPoints::new(seed) }
    }
}

impl Sampling for Sobol {
    fn begin(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
    }

    fn test(&mut self, index: u32) -> Option<Test> {
        Some(decoded(&self.test_space, self.seed, index, |choice| self.points.value(choice, index)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::space::test_space::tests::{any_timed_plan, broken_rule};
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    #[test]
    fn every_beginning_has_tests_of_all_lengths_alike() {
        let plan = SYNTHETIC_ROBOTS[0].plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1));
        let mut search = Sobol::new(TestSpace::from_plan(&plan).unwrap(), 3);
        let mut lengths = [0; 6];
        (0..64).for_each(|index| lengths[search.test(index).unwrap().operations.len()] += 1);
        // One to five operations follow from fifths of the first choice, of which 64ths are taken once each.
        assert!(lengths[1..].iter().all(|n| (12..=14).contains(n)), "{lengths:?}");
    }

    proptest! {
        #[test]
        fn tests_are_permitted(plan in any_timed_plan(), seed: u64) {
            let mut search = Sobol::new(TestSpace::from_plan(&plan).unwrap(), seed);
            for index in 0..20 {
                prop_assert_eq!(broken_rule(&plan, &search.test(index).unwrap()), None);
            }
        }
    }
}
