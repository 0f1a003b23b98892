//! Variation of tests: crossover of their lists of operations, mutation of single operations and of the list.
//!
//! A mutated operation has a new operation seed. An operation that a child inherits unchanged keeps its seed, even if
//! its window was moved to make room for another copy. If a child inherits copies with equal seeds, the later one gets
//! a new seed, so that two copies never draw the same random numbers. A child never equals an earlier test of the
//! campaign (apart from operation seeds), unless all [`Rates::tries`] attempts to change it fail.

mod crossover;
mod mutation;
mod rates;

use std::collections::BTreeSet;

use sesame_base::observation::Observation;
use sesame_optimise::nsga2::{Child, Heritage, Variation};
use sesame_plan::Test;
use sesame_rng::Stream;

use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;
use crate::test_key::TestKey;

use crossover::exchange_conditions;
use mutation::change_somehow;

pub(crate) use crossover::crossover;
pub(crate) use mutation::mutate;
pub use rates::Rates;

/// [`Variation`] of the tests of one campaign.
#[derive(Debug, Clone)]
pub struct TestVariation {
    test_space: TestSpace,
    rates: Rates,
    seed: u64,
    /// The keys of all tests made so far: the tests themselves would take most of the memory of a long search.
    made: BTreeSet<TestKey>,
}

impl TestVariation {
    /// Variation of what is permitted, at these rates, with all draws from streams of the seed.
    pub fn new(test_space: TestSpace, rates: Rates, seed: u64) -> Self {
        TestVariation { test_space, rates, seed, made: BTreeSet::new() }
    }

    /// Learns from the reference run when there are messages to disturb.
    pub(crate) fn take_reference(&mut self, reference: &Observation) {
        self.test_space.take_reference(reference);
    }

    /// Mutates a permitted test once more.
    pub(crate) fn mutate_again(&self, test: &mut Test, stream: &mut Stream) {
        mutate(test, &self.test_space, &self.rates, stream);
    }

    /// Notes a test that was made elsewhere. False if it was made before.
    pub(crate) fn claim(&mut self, test: &Test) -> bool {
        self.made.insert(TestKey::without_seeds(test))
    }
}

impl Variation for TestVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        let test = fresh_test(&self.test_space, &mut Stream::derive(self.seed, "initial", &[index]));
        self.made.insert(TestKey::without_seeds(&test));
        test
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut stream = Stream::derive(self.seed, "crossover", &[generation, pair]);
        let crossed = if stream.chance(self.rates.crossover) {
            let crossed = crossover(parents, &self.test_space, &mut stream);
            exchange_conditions(parents, crossed, &self.test_space, &self.rates, &mut stream)
        } else {
            None
        };
        let [first, second] = match crossed {
            Some([a, b]) => [(a, Heritage::Both), (b, Heritage::Both)],
            None => [(parents[0].clone(), Heritage::First), (parents[1].clone(), Heritage::Second)],
        };
        let mut place = 2 * pair;
        [first, second].map(|(mut genome, heritage)| {
            let mut stream = Stream::derive(self.seed, "mutation", &[generation, place]);
            place += 1;
            mutate(&mut genome, &self.test_space, &self.rates, &mut stream);
            for _ in 0..self.rates.tries {
                if !self.made.contains(&TestKey::without_seeds(&genome)) {
                    break;
                }
                let k = stream.below(genome.operations.len());
                change_somehow(&mut genome.operations[k], &self.test_space, &self.rates, &mut stream);
                self.test_space.settle(&mut genome, &mut stream);
            }
            self.made.insert(TestKey::without_seeds(&genome));
            Child { genome, heritage }
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::condition::ConditionEnd;
    use sesame_plan::{Activation, CampaignPlan, Copies, Search, Strategy, TestOperation};

    use super::*;
    use crate::space::range::StepSizes;
    use crate::space::test_space::tests::{any_plan, broken_rule};
    use crate::test_key::identity;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    /// Nothing happens.
    const IDLE: Rates = Rates {
        crossover: 0.0,
        exchange: 0.0,
        window: 0.0,
        parameter: 0.0,
        fresh: 0.0,
        retarget: 0.0,
        add: 0.0,
        duplicate: 0.0,
        drop: 0.0,
        steps: StepSizes { finest: 0.01, boldest: 0.2 },
        tries: 20,
    };

    fn seeds(test: &Test) -> BTreeSet<u64> {
        test.operations.iter().map(|operation| operation.operation_seed).collect()
    }

    proptest! {
        #[test]
        fn offspring_are_permitted_over_many_generations(plan in any_plan(), seed: u64) {
            let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), Rates::default(), seed);
            let mut tests = [variation.initial(0), variation.initial(1)];
            for generation in 1..30 {
                let [a, b] = &tests;
                tests = variation.offspring([a, b], generation, 0).map(|child| child.genome);
                for test in &tests {
                    prop_assert_eq!(broken_rule(&plan, test), None);
                }
            }
        }

        #[test]
        fn crossover_exchanges_tails_and_loses_nothing(plan in any_plan(), seed: u64) {
            let plan = overlapping(plan);
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let mut stream = Stream::derive(seed, "test", &[]);
            let [a, b] = [(); 2].map(|()| fresh_test(&test_space, &mut stream));
            if let Some([c, d]) = crossover([&a, &b], &test_space, &mut stream) {
                prop_assert_eq!(broken_rule(&plan, &c), None);
                prop_assert_eq!(broken_rule(&plan, &d), None);
                prop_assert!(seeds(&c) != seeds(&a) && seeds(&c) != seeds(&b));
                let both = |x: &Test, y: &Test| identity(&Test { operations: [&x.operations[..], &y.operations].concat() });
                prop_assert_eq!(both(&c, &d), both(&a, &b));
                prop_assert_eq!(&seeds(&c) | &seeds(&d), &seeds(&a) | &seeds(&b));
            } else {
                // Only lists of one operation, or of the one permitted length 1, have no cut in between.
                prop_assert!(a.operations.len() == 1 || b.operations.len() == 1, "{} {}", a.operations.len(), b.operations.len());
            }
        }

        #[test]
        fn an_operation_has_a_new_draw_seed_exactly_when_it_is_new_or_changed(plan in any_plan(), seed: u64) {
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let mut stream = Stream::derive(seed, "test", &[]);
            let before = fresh_test(&test_space, &mut stream);
            let mut after = before.clone();
            let rates = Rates { steps: StepSizes { finest: 0.01, boldest: 0.02 }, ..Rates::default() };
            mutate(&mut after, &test_space, &rates, &mut stream);
            for operation in &after.operations {
                match before.operations.iter().find(|old| old.operation_seed == operation.operation_seed) {
                    // Only a window that gives way to another copy's changes alone.
                    Some(old) => {
                        let copies = after.operations.iter().filter(|other| other.operation == operation.operation).count();
                        let kept = TestOperation { activation: old.activation.clone(), ..operation.clone() };
                        let gives_way = plan.campaign.copies == Copies::Apart && copies > 1;
                        prop_assert_eq!(old, if gives_way { &kept } else { operation });
                    }
                    // A step may end where it began, at an end of the range; a new seed alone is then what changed.
                    None => prop_assert!(!before.operations.contains(operation)),
                }
            }
        }
    }

    /// The plan with copies that may overlap: there, crossover leaves operations as they are.
    fn overlapping(mut plan: CampaignPlan) -> CampaignPlan {
        plan.campaign.copies = Copies::MayOverlap;
        plan
    }

    #[test]
    fn an_operation_that_a_child_gets_twice_from_one_ancestor_draws_for_itself_the_second_time() {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let mut met = 0;
        for seed in 0..200 {
            let mut stream = Stream::derive(seed, "test", &[]);
            let parent = fresh_test(&test_space, &mut stream);
            let mut turned = parent.clone();
            turned.operations.reverse();
            let Some(children) = crossover([&parent, &turned], &test_space, &mut stream) else { continue };
            for child in children {
                assert!(test_space.permits_copies(&child), "{child:?}");
                met += u32::from(!seeds(&child).is_subset(&seeds(&parent)));
            }
        }
        assert!(met > 20, "{met} children met a twin");
    }

    /// Offspring of two tests by condition when only this is varied.
    fn offspring_of(rates: Rates, end: ConditionEnd, seed: u64) -> ([Test; 2], [Child<Test>; 2]) {
        let plan = SYNTHETIC_ROBOTS[2].plan_by_condition(Search::new(Strategy::Random, 1), end);
        let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), rates, seed);
        let tests = [variation.initial(0), variation.initial(1)];
        let children = variation.offspring([&tests[0], &tests[1]], 1, 0);
        (tests, children)
    }

    #[test]
    fn conditions_of_a_pair_exchange_parts_and_keep_their_operations() {
        let only = Rates { exchange: 1.0, crossover: 1.0, tries: 0, ..IDLE };
        let mut unlike = 0;
        for seed in 0..50 {
            let (parents, children) = offspring_of(only, ConditionEnd::Condition, seed);
            assert!(children.iter().all(|child| child.heritage == Heritage::Both));
            let operations = |tests: [&Test; 2]| {
                let all = tests.into_iter().flat_map(|test| &test.operations);
                let mut all: Vec<_> = all
                    .map(|operation| {
                        (operation.operation_seed, operation.operation, format!("{:?}", operation.parameters))
                    })
                    .collect();
                all.sort();
                all
            };
            let [a, b] = &parents;
            assert_eq!(operations([&children[0].genome, &children[1].genome]), operations([a, b]));
            let before: Vec<&Activation> =
                [a, b].iter().flat_map(|test| &test.operations).map(|operation| &operation.activation).collect();
            let new = children.iter().flat_map(|child| &child.genome.operations);
            unlike += u32::from(new.filter(|operation| !before.contains(&&operation.activation)).count() >= 1);
        }
        // Now and then conditions are exchanged whole.
        assert!(unlike >= 45, "{unlike} of 50 pairs");
    }

    #[test]
    fn conditions_and_lengths_are_mutated() {
        let (mut starts, mut lengths, mut kept) = (0, 0, 0);
        for seed in 0..100 {
            let only = Rates { window: 1.0, tries: 0, ..IDLE };
            let (parents, children) = offspring_of(only, ConditionEnd::Length { low: 1.0, high: 15.0 }, seed);
            for (parent, child) in parents.iter().zip(&children) {
                for (old, new) in parent.operations.iter().zip(&child.genome.operations) {
                    assert!(old.parameters == new.parameters && old.operation_seed != new.operation_seed);
                    match (&old.activation, &new.activation) {
                        (
                            Activation::ConditionFor { start: a, length: n, .. },
                            Activation::ConditionFor { start: b, length: m, .. },
                        ) => {
                            starts += u32::from(a != b);
                            lengths += u32::from(n != m);
                            kept += u32::from(a == b && n == m);
                        }
                        other => panic!("{other:?}"),
                    }
                }
            }
        }
        assert!(starts > 200 && lengths > 200 && kept < 20, "{starts} {lengths} {kept}");
    }

    #[test]
    fn tests_that_differ_in_their_conditions_are_different_tests() {
        let (tests, _) = offspring_of(IDLE, ConditionEnd::Condition, 1);
        let mut other = tests[0].clone();
        other.operations[0].operation_seed += 1;
        assert_eq!(identity(&other), identity(&tests[0]));
        assert_eq!(TestKey::without_seeds(&other), TestKey::without_seeds(&tests[0]));
        let Activation::Condition { start, end, .. } = &mut other.operations[0].activation else { panic!("{other:?}") };
        std::mem::swap(start, end);
        assert_ne!(identity(&other), identity(&tests[0]));
        assert_ne!(TestKey::without_seeds(&other), TestKey::without_seeds(&tests[0]));
    }

    #[test]
    fn each_way_of_mutation_does_what_its_name_says() {
        let plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let before = (0..100)
            .map(|i| fresh_test(&test_space, &mut Stream::derive(1, "test", &[i])))
            .find(|test| test.operations.len() == 3)
            .expect("lists of three are common");
        let mutated = |rates: Rates| {
            let mut test = before.clone();
            mutate(&mut test, &test_space, &rates, &mut Stream::derive(9, "mutation", &[]));
            test.operations
        };
        let old = &before.operations;
        let kept = |new: &[TestOperation]| new.iter().filter(|operation| old.contains(operation)).count();

        assert_eq!(mutated(IDLE), *old);
        let moved = mutated(Rates { window: 1.0, ..IDLE });
        assert!(moved.iter().zip(old).all(|(n, o)| n.activation != o.activation && n.parameters == o.parameters));
        let tuned = mutated(Rates { parameter: 1.0, ..IDLE });
        assert!(tuned.iter().zip(old).all(|(n, o)| n.activation == o.activation && n.parameters != o.parameters));
        let retargeted = mutated(Rates { retarget: 1.0, ..IDLE });
        assert!(retargeted.iter().zip(old).all(|(n, o)| n.operation != o.operation && n.activation == o.activation));
        let longer = mutated(Rates { add: 1.0, ..IDLE });
        assert_eq!((longer.len(), kept(&longer)), (4, 3));
        let copied = mutated(Rates { duplicate: 1.0, ..IDLE });
        assert_eq!((copied.len(), kept(&copied)), (4, 3));
        let copy = copied.iter().find(|operation| !old.contains(operation)).expect("the copy differs in its window");
        assert!(old.iter().any(|o| o.operation == copy.operation && o.parameters == copy.parameters));
        let shorter = mutated(Rates { drop: 1.0, ..IDLE });
        assert_eq!((shorter.len(), kept(&shorter)), (2, 2));
    }
}
