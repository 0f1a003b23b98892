//! Fresh tests: what a random search is made of and an evolution begins with. Sobol and Latin hypercube tests are drawn
//! the same way, along their own numbers.
//!
//! The kinds of a fresh test are the operations of the campaign, each included with its own probability; if none is,
//! one of those with a probability above zero (or of all), each alike. Its length is uniform over what the campaign
//! permits. In three of four tests, if there are more kinds than places, a random choice of them stays; if there are
//! fewer, each has its place and the other places are filled with them at random. In the others each place is drawn for
//! itself, so that every permitted list can come up. A test may hold an operation several times, then, with windows,
//! parameters and draws of its own each time. Where each operation is there at most once, every test is of the first
//! sort, and one with fewer kinds than places is shorter, as far as that is permitted.
//!
//! Windows and sub-ranges are uniform over all feasible pairs of ends, values uniform over their range; windows of
//! copies that must not overlap are uniform over all [disjoint ones](crate::space::separation). But a tenth of the
//! windows are as long as is permitted, and a tenth of the choices are a [strongest one][Strongest]: uniform draws are
//! nearly always of middling length and strength, and what is dangerous is at the ends. Windows in which the
//! undisturbed system has no message to disturb are drawn again. The order of the list is random. Where conditions
//! switch, start and end are grown independently, and lengths are uniform, with a tenth at the greatest one.
//!
//! [Strongest]: crate::space::Strongest

use sesame_plan::condition::ConditionEnd;
use sesame_plan::{Activation, Choice, Copies, Test, TestOperation};
use sesame_rng::Stream;

use crate::space::condition::grown;
use crate::space::heard::Heard;
use crate::space::range::Range;
use crate::space::separation;
use crate::space::test_space::{ActivationSpace, OperationSpace, TestSpace};

/// The share of fresh tests in which each place is drawn for itself.
const EACH_FOR_ITSELF: f64 = 0.25;

/// The share of fresh windows that are as long as is permitted, and of fresh choices that are a strongest one.
pub(crate) const ENDS: f64 = 0.1;

/// How often what meets no message is drawn again.
pub(crate) const TRIES: usize = 12;

/// A fresh test; one that the campaign permits.
pub fn fresh_test(test_space: &TestSpace, stream: &mut Stream) -> Test {
    let kinds = fresh_kinds(test_space, &mut || stream.unit());
    let mut test = Test { operations: kinds.into_iter().map(|kind| fresh_operation(kind, stream)).collect() };
    test_space.settle_windows(&mut test, separation::spread);
    test_space.settle_on_messages(&mut test, stream);
    test
}

/// The kinds of operations of a fresh test, in their order, by numbers in `0..1`. Numbers that are uniform and
/// independent give the distribution that the head of this module states.
pub(crate) fn fresh_kinds<'a>(test_space: &'a TestSpace, number: &mut impl FnMut() -> f64) -> Vec<&'a OperationSpace> {
    let operations = test_space.operations();
    let (fewest, most) = (test_space.fewest(), test_space.most());
    let length = fewest + place(number(), most - fewest + 1);
    let each_for_itself = test_space.copies() != Copies::Once && number() < EACH_FOR_ITSELF;
    let mut kinds: Vec<&OperationSpace> = Vec::new();
    for kind in operations {
        // What is certain takes no number.
        if kind.inclusion >= 1.0 || (kind.inclusion > 0.0 && number() < kind.inclusion) {
            kinds.push(kind);
        }
    }
    if kinds.is_empty() {
        let likely: Vec<_> = operations.iter().filter(|op| op.inclusion > 0.0).collect();
        let pool = if likely.is_empty() { operations.iter().collect() } else { likely };
        kinds.push(pool[place(number(), pool.len())]);
    }
    let mut places: Vec<&OperationSpace> = Vec::with_capacity(length);
    while places.len() < length {
        let held = |kind: &OperationSpace| places.iter().filter(|place| place.operation == kind.operation).count();
        let mut pool: Vec<_> = kinds.iter().copied().filter(|kind| held(kind) < test_space.most_copies(kind)).collect();
        let new: Vec<_> = pool.iter().copied().filter(|kind| held(kind) == 0).collect();
        let copies = new.is_empty();
        if !each_for_itself && !copies {
            pool = new;
        }
        if pool.is_empty() {
            // No more of what is included has room.
            if places.len() >= fewest {
                break;
            }
            pool = operations.iter().filter(|kind| held(kind) < test_space.most_copies(kind)).collect();
        }
        let kind = pool[place(number(), pool.len())];
        // The first copies are as likely at the beginning of the list as at its end.
        let at = if each_for_itself || !copies { places.len() } else { place(number(), places.len() + 1) };
        places.insert(at, kind);
    }
    places
}

/// The place of a value in `0..1` among so many equal parts.
pub(crate) fn place(value: f64, parts: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is below the number of parts")]
    let place = libm::floor(value * parts as f64) as usize;
    place.min(parts - 1)
}

/// A fresh instance of an operation, with an operation seed of its own.
pub(crate) fn fresh_operation(kind: &OperationSpace, stream: &mut Stream) -> TestOperation {
    let activation = fresh_activation(kind, stream);
    let parameters = (0..kind.parameters.len()).map(|parameter| fresh_choice(kind, parameter, stream)).collect();
    TestOperation { operation: kind.operation, activation, parameters, operation_seed: stream.bits(), messages: None }
}

/// A fresh choice for a parameter, by its position.
pub(crate) fn fresh_choice(kind: &OperationSpace, parameter: usize, stream: &mut Stream) -> Choice {
    if stream.chance(ENDS) {
        kind.strongest.choice(parameter, stream)
    } else {
        kind.parameters[parameter].fresh(stream)
    }
}

/// A fresh window that meets a message, if there is any: it is drawn again until it does, but so often only; then it is
/// laid around a message.
pub(crate) fn fresh_window(range: Range, heard: &Heard, stream: &mut Stream) -> (f64, f64) {
    let draw = |stream: &mut Stream| {
        if stream.chance(ENDS) { range.longest_interval(stream.unit()) } else { range.interval(stream) }
    };
    let mut window = draw(stream);
    for _ in 0..TRIES {
        if heard.is_in(window) {
            return window;
        }
        window = draw(stream);
    }
    heard.around_a_message(range, window.1 - window.0, stream).unwrap_or(window)
}

/// A fresh window, or fresh conditions; of an offline operation there is nothing to choose.
pub(crate) fn fresh_activation(kind: &OperationSpace, stream: &mut Stream) -> Activation {
    match &kind.activation {
        ActivationSpace::Offline => Activation::Offline,
        ActivationSpace::Time(window) => {
            let (start, end) = fresh_window(*window, &kind.heard, stream);
            Activation::Time { start, end }
        }
        ActivationSpace::Condition { space, constraints, first } => {
            let [first_start, first_end] = &**first;
            let start = grown(space, constraints, stream).unwrap_or_else(|| first_start.clone());
            match space.end {
                ConditionEnd::Condition => {
                    let end = grown(space, &[], stream).unwrap_or_else(|| first_end.clone());
                    Activation::Condition { start, end, times: space.times }
                }
                ConditionEnd::Length { low, high } => {
                    let length = if stream.chance(ENDS) { high } else { Range::between(low, high).number(stream) };
                    Activation::ConditionFor { start, length, times: space.times }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{Count, OperationId, Search, Strategy};

    use super::*;
    use crate::space::test_space::tests::{any_plan, broken_rule};
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn fresh_tests(inclusion: &[f64], count: Count) -> Vec<Vec<u32>> {
        let mut plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
        plan.campaign.count = count;
        plan.campaign.operations = (0u32..).map(OperationId).take(inclusion.len()).collect();
        plan.operations.iter_mut().zip(inclusion).for_each(|(op, &p)| op.inclusion = p);
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let kinds = |i| fresh_test(&test_space, &mut Stream::derive(1, "test", &[i])).operations;
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
        // Three of four hold both; of the others with n places all but one of 2^(n-1).
        let alike = [2, 3, 4, 5].map(|length| 0.25 / 5.0 * libm::pow(0.5, f64::from(length - 1)));
        let one_kind = share(&tests, |kinds| kinds.len() > 1 && (!kinds.contains(&0) || !kinds.contains(&1)));
        assert!((one_kind - alike.iter().sum::<f64>()).abs() < 0.01, "{one_kind}");
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

    #[test]
    fn a_tenth_of_the_windows_are_longest_and_a_tenth_of_the_choices_strongest() {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
        plan.campaign.copies = Copies::MayOverlap;
        plan.operations[0].lengths = Some(sesame_plan::Lengths { low: 0.0, high: 2.0 });
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let kind = &test_space.operations()[0];
        let drawn: Vec<TestOperation> =
            (0..6_000).map(|i| fresh_operation(kind, &mut Stream::derive(1, "test", &[i]))).collect();
        let share = |holds: &dyn Fn(&TestOperation) -> bool| {
            drawn.iter().filter(|used| holds(used)).count() as f64 / drawn.len() as f64
        };
        let longest =
            share(&|used| matches!(used.activation, Activation::Time { start, end } if end - start > 1.999_999));
        let strongest = share(&|used| kind.strongest.which(&used.parameters).is_some());
        assert!((longest - ENDS).abs() < 0.015 && (strongest - ENDS).abs() < 0.015, "{longest} {strongest}");
    }

    proptest! {
        #[test]
        fn fresh_tests_are_permitted(plan in any_plan(), seed: u64) {
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let test = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[]));
            prop_assert_eq!(broken_rule(&plan, &test), None);
        }
    }
}
