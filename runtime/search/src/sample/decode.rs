//! Tests made of numbers in `0..1`, one for each of their choices: what sampling along such numbers has in common.

use sesame_plan::{Activation, Choice, ChoiceKind, Test, TestOperation};
use sesame_rng::derive_seed;

use crate::space::initial::{fresh_kinds, place};
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::separation;
use crate::space::test_space::{ActivationSpace, TestSpace};

/// The test of these numbers, given by the place of the choice: first how many operations there are and which, then of
/// each in turn its window's length and place, and its parameters. Numbers that are uniform and independent give the
/// distribution of [random tests](crate::space::initial). By condition there are no such choices: it is for campaigns
/// by time.
pub(super) fn decoded(test_space: &TestSpace, seed: u64, index: u32, mut number: impl FnMut(usize) -> f64) -> Test {
    let mut next = 0;
    let mut value = || {
        next += 1;
        number(next - 1)
    };
    let operations = fresh_kinds(test_space, &mut value)
        .into_iter()
        .enumerate()
        .map(|(slot, kind)| {
            let activation = match kind.activation {
                ActivationSpace::Time(window) => {
                    let (start, end) = window.interval_at([value(), value()]);
                    Activation::Time { start, end }
                }
                _ => Activation::Offline,
            };
            let parameters = kind.parameters.iter().map(|parameter| choice(parameter, &mut value)).collect();
            let operation_seed = derive_seed(seed, "draws", &[u64::from(index), slot as u64]);
            TestOperation { operation: kind.operation, activation, parameters, operation_seed, messages: None }
        })
        .collect();
    let mut test = Test { operations };
    test_space.settle_windows(&mut test, separation::spread);
    test
}

/// The greatest number below 1.
pub(super) const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

fn choice(parameter_space: &ParameterSpace, value: &mut impl FnMut() -> f64) -> Choice {
    let number = |range: &Range, value: f64| {
        if range.integer {
            (range.low + libm::floor(value * (range.high - range.low + 1.0))).min(range.high)
        } else {
            (range.low + value * (range.high - range.low)).min(range.high)
        }
    };
    match parameter_space {
        ParameterSpace::Number(range, ChoiceKind::Value) => Choice::Value { value: number(range, value()) },
        ParameterSpace::Number(range, ChoiceKind::Range) => {
            let (low, high) = range.interval_at([value(), value()]);
            let whole = |x: f64| if range.integer { libm::rint(x) } else { x };
            Choice::Range { low: whole(low), high: whole(high) }
        }
        ParameterSpace::Point(axes) => {
            Choice::Point { point: [0, 1, 2].map(|axis: usize| number(&axes[axis], value())) }
        }
        ParameterSpace::Items(items) => Choice::Text { text: items[place(value(), items.len())].clone() },
    }
}
