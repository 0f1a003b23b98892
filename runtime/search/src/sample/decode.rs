//! Tests made of numbers in `0..1`, one for each of their choices: what sampling along such numbers has in common.

use sesame_plan::{Activation, Choice, ChoiceKind, Test, TestOperation};
use sesame_rng::{Stream, derive_seed};

use crate::space::initial::{ENDS, fresh_kinds, place};
use crate::space::parameter_space::ParameterSpace;
use crate::space::range::Range;
use crate::space::separation;
use crate::space::test_space::{ActivationSpace, OperationSpace, TestSpace};

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
                    let (start, end) = match at_end(value()) {
                        Ok(_) => window.longest_interval(value()),
                        Err(length) => window.interval_at([length, value()]),
                    };
                    Activation::Time { start, end }
                }
                _ => Activation::Offline,
            };
            let parameters = (0..kind.parameters.len()).map(|parameter| choice(kind, parameter, &mut value)).collect();
            let operation_seed = derive_seed(seed, "draws", &[u64::from(index), slot as u64]);
            TestOperation { operation: kind.operation, activation, parameters, operation_seed, messages: None }
        })
        .collect();
    let mut test = Test { operations };
    test_space.settle_windows(&mut test, separation::spread);
    test_space.settle_on_messages(&mut test, &mut Stream::derive(seed, "unheard", &[u64::from(index)]));
    test
}

/// Whether a number in `0..1` stands for an end: where it lies among those that do, in `0..1`, or else among those that
/// do not.
fn at_end(number: f64) -> Result<f64, f64> {
    if number < ENDS { Ok(number / ENDS) } else { Err(((number - ENDS) / (1.0 - ENDS)).min(BELOW_ONE)) }
}

/// The greatest number below 1.
pub(super) const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

fn choice(kind: &OperationSpace, parameter: usize, value: &mut impl FnMut() -> f64) -> Choice {
    let first = match at_end(value()) {
        Ok(which) => {
            let strongest = kind.strongest.choices(parameter);
            return strongest[place(which, strongest.len())].clone();
        }
        Err(first) => first,
    };
    let mut first = Some(first);
    let mut value = || first.take().unwrap_or_else(&mut *value);
    let number = |range: &Range, value: f64| {
        if range.integer {
            (range.low + libm::floor(value * (range.high - range.low + 1.0))).min(range.high)
        } else {
            (range.low + value * (range.high - range.low)).min(range.high)
        }
    };
    match &kind.parameters[parameter] {
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
