//! Fresh tests: what a random search is made of and an evolution begins with.
//!
//! The kinds of a fresh test are the operations of the campaign, each included with its own probability; if none is,
//! one of those with a probability above zero (or of all), each alike. Its length is uniform over what the campaign
//! permits. If there are more kinds than places, a random choice of them stays; if there are fewer, each has its place
//! and the other places are filled with them at random: a test may hold an operation several times, with windows and
//! parameters of its own each time. Windows and sub-ranges are uniform over all feasible pairs of ends, values uniform
//! over their range. The order of the list is random. Where conditions switch, start and end are grown independently, and
//! lengths are uniform.

use sesame_plan::condition::ConditionEnd;
use sesame_plan::{Activation, Test, TestOperation};

use crate::rng::Stream;
use crate::search::condition::grown;
use crate::search::permitted::{Permitted, PermittedActivation, PermittedOperation};
use crate::search::range::Range;

/// A fresh test; one that the campaign permits.
pub fn fresh_test(permitted: &Permitted, stream: &mut Stream) -> Test {
    let operations = permitted.operations();
    let mut kinds: Vec<&PermittedOperation> = operations.iter().filter(|op| stream.chance(op.inclusion)).collect();
    if kinds.is_empty() {
        let likely: Vec<_> = operations.iter().filter(|op| op.inclusion > 0.0).collect();
        let pool = if likely.is_empty() { operations.iter().collect() } else { likely };
        kinds.push(pool[stream.below(pool.len())]);
    }
    let length = permitted.fewest() + stream.below(permitted.most() - permitted.fewest() + 1);
    let mut places: Vec<&PermittedOperation> = stream.permutation(kinds.len()).into_iter().map(|i| kinds[i]).collect();
    places.truncate(length);
    while places.len() < length {
        let kind = kinds[stream.below(kinds.len())];
        places.insert(stream.below(places.len() + 1), kind);
    }
    Test { operations: places.into_iter().map(|kind| fresh_operation(kind, stream)).collect() }
}

/// A fresh instance of an operation, with a draw seed of its own.
pub fn fresh_operation(kind: &PermittedOperation, stream: &mut Stream) -> TestOperation {
    let activation = fresh_activation(&kind.activation, stream);
    let parameters = kind.parameters.iter().map(|permitted| permitted.fresh(stream)).collect();
    TestOperation { operation: kind.operation, activation, parameters, draw_seed: stream.bits() }
}

/// A fresh window, or fresh conditions; of an offline operation there is nothing to choose.
fn fresh_activation(activation: &PermittedActivation, stream: &mut Stream) -> Activation {
    match activation {
        PermittedActivation::Offline => Activation::Offline,
        PermittedActivation::Time(window) => {
            let (start, end) = window.interval(stream);
            Activation::Time { start, end }
        }
        PermittedActivation::Condition { space, constraints, first } => {
            let [first_start, first_end] = &**first;
            let start = grown(space, constraints, stream).unwrap_or_else(|| first_start.clone());
            match space.end {
                ConditionEnd::Condition => {
                    let end = grown(space, &[], stream).unwrap_or_else(|| first_end.clone());
                    Activation::Condition { start, end, times: space.times }
                }
                ConditionEnd::Length { low, high } => {
                    let length = Range::between(low, high).number(stream);
                    Activation::ConditionFor { start, length, times: space.times }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_plan::{Count, OperationId, Search};

    use super::*;
    use crate::search::landscape::LANDSCAPES;
    use crate::search::permitted::tests::{any_plan, broken_rule};

    fn fresh_tests(inclusion: &[f64], count: Count) -> Vec<Vec<u32>> {
        let mut plan = LANDSCAPES[2].plan(Search::Random { evaluations: 1 });
        plan.campaign.count = count;
        plan.campaign.operations = (0u32..).map(OperationId).take(inclusion.len()).collect();
        plan.operations.iter_mut().zip(inclusion).for_each(|(op, &p)| op.inclusion = p);
        let permitted = Permitted::of(&plan).unwrap();
        let kinds = |i| fresh_test(&permitted, &mut Stream::derive(1, "test", &[i])).operations;
        (0..6_000).map(|i| kinds(i).iter().map(|op| op.operation.0).collect()).collect()
    }

    fn share(tests: &[Vec<u32>], holds: impl Fn(&[u32]) -> bool) -> f64 {
        tests.iter().filter(|kinds| holds(kinds)).count() as f64 / tests.len() as f64
    }

    #[test]
    fn lengths_are_uniform_over_what_is_permitted() {
        let tests = fresh_tests(&[1.0, 1.0], Count { min: 1, max: 5 });
        for length in 1..=5 {
            assert!((share(&tests, |kinds| kinds.len() == length) - 0.2).abs() < 0.02, "length {length}");
        }
        assert!((share(&tests, |kinds| kinds[0] == 0) - 0.5).abs() < 0.02, "the order is random");
        assert!(tests.iter().all(|kinds| kinds.len() == 1 || (kinds.contains(&0) && kinds.contains(&1))));
    }

    #[test]
    fn an_operation_is_included_with_its_probability() {
        let tests = fresh_tests(&[0.8, 0.3, 0.0, 1.0], Count { min: 4, max: 6 });
        for (kind, probability) in [(0, 0.8), (1, 0.3), (2, 0.0), (3, 1.0)] {
            assert!((share(&tests, |kinds| kinds.contains(&kind)) - probability).abs() < 0.02, "kind {kind}");
        }
    }

    #[test]
    fn at_least_one_is_included_even_when_all_are_unlikely() {
        let tests = fresh_tests(&[0.0, 0.0], Count { min: 1, max: 1 });
        assert!((share(&tests, |kinds| kinds == [0]) - 0.5).abs() < 0.02);
        let tests = fresh_tests(&[0.001, 0.0], Count { min: 1, max: 2 });
        assert!(tests.iter().all(|kinds| kinds.iter().all(|&kind| kind == 0)), "never what has probability 0");
    }

    proptest! {
        #[test]
        fn fresh_tests_are_permitted(plan in any_plan(), seed: u64) {
            let permitted = Permitted::of(&plan).unwrap();
            let test = fresh_test(&permitted, &mut Stream::derive(seed, "test", &[]));
            prop_assert_eq!(broken_rule(&plan, &test), None);
        }
    }
}
