//! When two tests are the same.

use std::collections::BTreeMap;

use sesame_plan::{Activation, CampaignPlan, Choice, Messages, Test, TestOperation};
use sesame_rng::derive_seed;

use crate::space::condition;

/// A hash of what tells a test apart from others, of 128 bits: of 10^12 different tests, two have the same by chance
/// once in 10^14 campaigns. Tests themselves would take many times the memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TestKey([u64; 2]);

impl TestKey {
    /// A hash of everything in a test. Tests with equal keys give equal runs.
    pub fn exact(test: &Test) -> TestKey {
        let content = serde_json::to_vec(test).unwrap_or_else(|error| unreachable!("a test is plain data: {error}"));
        let number = |bytes: &[u8]| bytes.iter().fold(0, |number: u64, &byte| number << 8 | u64::from(byte));
        let length = content.len() as u64;
        TestKey::of([length].into_iter().chain(content.chunks(8).map(number)))
    }

    /// A hash of a test without operation seeds, its operations in any order, its conditions in any order and grouping:
    /// a search need not try two tests with equal ones.
    pub fn without_seeds(test: &Test) -> TestKey {
        let operations = identity(test).into_iter();
        TestKey::of(operations.flat_map(|numbers| [vec![numbers.len() as u64], numbers].concat()))
    }

    /// A hash of what a test disturbs: its operations in any order, with the seeds of those that draw. Without
    /// randomness of the simulator, tests with equal ones come to the same.
    pub fn of_disturbance(plan: &CampaignPlan, test: &Test) -> TestKey {
        let seed = |used: &TestOperation| plan.operation(used.operation).kind.draws().then_some(used.operation_seed);
        let operations = test.operations.iter().map(|used| (numbers_of(used), seed(used)));
        let mut operations: Vec<Vec<u64>> =
            operations.map(|(numbers, seed)| [numbers, seed.into_iter().collect()].concat()).collect();
        operations.sort_unstable();
        TestKey::of(operations.into_iter().flat_map(|numbers| [vec![numbers.len() as u64], numbers].concat()))
    }

    fn of(numbers: impl Iterator<Item = u64>) -> TestKey {
        let numbers: Vec<u64> = numbers.collect();
        TestKey(["one half of a key", "the other half"].map(|half| derive_seed(0, half, &numbers)))
    }
}

/// The tests of a campaign by their keys.
#[derive(Debug, Default)]
pub struct SeenTests(BTreeMap<TestKey, u32>);

impl SeenTests {
    /// The number of the first test that is equal to this one; if there is none, this one is remembered.
    pub fn first_equal(&mut self, test: &Test, number: u32) -> Option<u32> {
        let first = *self.0.entry(TestKey::exact(test)).or_insert(number);
        (first != number).then_some(first)
    }
}

/// What tells two tests apart: their operations in any order, without operation seeds.
pub(crate) fn identity(test: &Test) -> Vec<Vec<u64>> {
    let mut operations: Vec<Vec<u64>> = test.operations.iter().map(numbers_of).collect();
    operations.sort_unstable();
    operations
}

/// What tells two operations apart, without their seeds.
fn numbers_of(operation: &TestOperation) -> Vec<u64> {
    let mut numbers = vec![u64::from(operation.operation.0)];
    match &operation.activation {
        Activation::Time { start, end } => numbers.extend([0, start.to_bits(), end.to_bits()]),
        Activation::Condition { start, end, times } => {
            numbers.extend([1, u64::from(*times)]);
            numbers.extend(condition::identity(start));
            numbers.extend(condition::identity(end));
        }
        Activation::ConditionFor { start, length, times } => {
            numbers.extend([2, u64::from(*times), length.to_bits()]);
            numbers.extend(condition::identity(start));
        }
        Activation::Offline => numbers.push(3),
    }
    for choice in &operation.parameters {
        match choice {
            Choice::Value { value } => numbers.push(value.to_bits()),
            Choice::Range { low, high } => numbers.extend([low.to_bits(), high.to_bits()]),
            Choice::Point { point } => numbers.extend(point.map(f64::to_bits)),
            Choice::Text { text } => {
                numbers.push(text.len() as u64);
                numbers.extend(text.bytes().map(u64::from));
            }
        }
    }
    for run in operation.messages.iter().flat_map(Messages::runs) {
        numbers.extend([u64::from(run.wire), run.first, run.last]);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_rng::Stream;

    use super::*;
    use crate::space::TestSpace;
    use crate::space::initial::fresh_test;
    use crate::space::test_space::tests::any_plan;

    proptest! {
        #[test]
        fn keys_are_equal_exactly_where_tests_are(plan in any_plan(), seed in any::<u64>()) {
            let Ok(space) = TestSpace::from_plan(&plan) else { return Ok(()) };
            let mut stream = Stream::derive(seed, "test", &[]);
            let test = fresh_test(&space, &mut stream);
            let other = fresh_test(&space, &mut stream);
            prop_assert_eq!(TestKey::exact(&test) == TestKey::exact(&other), test == other);
            prop_assert_eq!(TestKey::exact(&test), TestKey::exact(&test.clone()));
            let mut drawn_otherwise = test.clone();
            drawn_otherwise.operations.reverse();
            for used in &mut drawn_otherwise.operations {
                used.operation_seed ^= 1;
            }
            prop_assert_ne!(TestKey::exact(&test), TestKey::exact(&drawn_otherwise));
            prop_assert_eq!(TestKey::without_seeds(&test), TestKey::without_seeds(&drawn_otherwise));
            let draws = test.operations.iter().any(|used| plan.operation(used.operation).kind.draws());
            let disturb = [&test, &drawn_otherwise].map(|test| TestKey::of_disturbance(&plan, test));
            prop_assert_eq!(disturb[0] == disturb[1], !draws);
            let mut seen = SeenTests::default();
            prop_assert_eq!(seen.first_equal(&test, 1), None);
            prop_assert_eq!(seen.first_equal(&drawn_otherwise, 2), None);
            prop_assert_eq!(seen.first_equal(&test, 3), Some(1));
        }
    }
}
