//! Latin hypercube sampling (`McKay` et al. 1979): tests spread evenly over each of their choices.
//!
//! A baseline like random tests, only that nothing is left to luck along a single choice: of n tests, one has its first
//! window's length in the shortest n-th part of all lengths, one in the next, and so on; likewise for every other
//! choice of every operation. Campaigns by condition have no such choices and are not sampled so.

use sesame_base::observation::Observation;
use sesame_plan::Test;
use sesame_rng::{Stream, derive_seed, keyed_unit};

use crate::sample::decode::{BELOW_ONE, decoded};
use crate::sample::sampled_search::Sampling;
use crate::space::test_space::TestSpace;

/// So many tests, spread evenly over each choice.
#[derive(Debug, Clone)]
pub(crate) struct LatinHypercube {
    test_space: TestSpace,
    seed: u64,
    /// Per choice, the order in which its strata are taken.
    strata: Vec<Vec<usize>>,
    evaluations: u32,
}

impl LatinHypercube {
    /// So many tests of what is permitted.
    pub(crate) fn new(test_space: TestSpace, evaluations: u32, seed: u64) -> Self {
        LatinHypercube { test_space, seed, strata: Vec::new(), evaluations }
    }

    /// The value of the `index`th test for a choice, in `0..1`: each of as many equal parts holds one test's.
    fn value(&mut self, choice: usize, index: u32) -> f64 {
        while self.strata.len() <= choice {
            let mut stream = Stream::derive(self.seed, "latin hypercube", &[self.strata.len() as u64]);
            self.strata.push(stream.permutation(self.evaluations as usize));
        }
        let stratum = self.strata[choice][index as usize] as f64;
        let within = keyed_unit(derive_seed(self.seed, "in stratum", &[]), u64::from(index), choice as u64);
        ((stratum + within) / f64::from(self.evaluations)).min(BELOW_ONE)
    }
}

impl Sampling for LatinHypercube {
    fn begin(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
    }

    fn test(&mut self, index: u32) -> Option<Test> {
        let test_space = self.test_space.clone();
        Some(decoded(&test_space, self.seed, index, |choice| self.value(choice, index)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::space::initial::place;
    use crate::space::test_space::tests::{any_timed_plan, broken_rule};
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    #[test]
    fn each_choice_has_one_test_in_each_of_its_equal_parts() {
        let plan = SYNTHETIC_ROBOTS[0].plan(sesame_plan::Search::new(sesame_plan::Strategy::Random, 1));
        let mut search = LatinHypercube::new(TestSpace::from_plan(&plan).unwrap(), 40, 3);
        for choice in 0..8 {
            let mut strata: Vec<usize> = (0..40).map(|index| place(search.value(choice, index), 40)).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..40).collect::<Vec<_>>());
        }
        // Numbers of operations follow from the first choice: of 40 tests with one to five, eight each.
        let mut lengths = [0; 6];
        (0..40).for_each(|index| lengths[search.test(index).unwrap().operations.len()] += 1);
        assert_eq!(lengths, [0, 8, 8, 8, 8, 8]);
    }

    proptest! {
        #[test]
        fn tests_are_permitted(plan in any_timed_plan(), seed: u64) {
            let mut search = LatinHypercube::new(TestSpace::from_plan(&plan).unwrap(), 20, seed);
            for index in 0..20 {
                prop_assert_eq!(broken_rule(&plan, &search.test(index).unwrap()), None);
            }
        }
    }
}
