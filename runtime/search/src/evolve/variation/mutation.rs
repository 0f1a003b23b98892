//! Mutation: of single operations, and of the list of a test.

use sesame_plan::condition::{Condition, ConditionEnd, ConditionSpace, Constraint};
use sesame_plan::{Activation, Test, TestOperation};
use sesame_rng::Stream;

use super::rates::Rates;
use crate::space::condition::{self, contains};
use crate::space::initial::{fresh_choice, fresh_operation, fresh_window};
use crate::space::range::Range;
use crate::space::test_space::{ActivationSpace, OperationSpace, TestSpace};

/// Mutates a permitted test; the result is permitted too. Perhaps nothing changes.
pub(crate) fn mutate(test: &mut Test, test_space: &TestSpace, rates: &Rates, stream: &mut Stream) {
    for at in 0..test.operations.len() {
        mutate_operation(&mut test.operations, at, test_space, rates, stream);
    }
    // Each is decided by a draw of its own, whether or not the list has room for it.
    let [add, duplicate, drop] = [rates.add, rates.duplicate, rates.drop].map(|rate| stream.chance(rate));
    let operations = &mut test.operations;
    if drop && operations.len() > test_space.fewest() {
        operations.remove(stream.below(operations.len()));
    }
    if duplicate && operations.len() < test_space.most() {
        let has_room = |operation: &&TestOperation| test_space.has_room(operations, kind_of(operation, test_space));
        let originals: Vec<&TestOperation> = operations.iter().filter(has_room).collect();
        if !originals.is_empty() {
            let mut copy = originals[stream.below(originals.len())].clone();
            change_somehow(&mut copy, test_space, rates, stream);
            operations.insert(stream.below(operations.len() + 1), copy);
        }
    }
    if add && operations.len() < test_space.most() {
        // As the list is not full, there is one.
        let kinds: Vec<_> =
            test_space.operations().iter().filter(|kind| test_space.has_room(operations, kind)).collect();
        let kind = kinds[stream.below(kinds.len())];
        let place = stream.below(operations.len() + 1);
        operations.insert(place, fresh_operation(kind, stream));
    }
    test_space.settle(test, stream);
    test_space.settle_on_messages(test, stream);
}

fn mutate_operation(
    operations: &mut [TestOperation],
    at: usize,
    test_space: &TestSpace,
    rates: &Rates,
    stream: &mut Stream,
) {
    if test_space.operations().len() > 1 && stream.chance(rates.retarget) {
        let current = operations[at].operation;
        let is_other = |kind: &&OperationSpace| kind.operation != current && test_space.has_room(operations, kind);
        let others: Vec<_> = test_space.operations().iter().filter(is_other).collect();
        if !others.is_empty() {
            retarget(&mut operations[at], others[stream.below(others.len())], stream);
        }
    }
    let operation = &mut operations[at];
    if stream.chance(rates.window) {
        change_activation(operation, test_space, rates, stream);
    }
    let kind = kind_of(operation, test_space);
    for (at, (choice, parameter_space)) in operation.parameters.iter_mut().zip(&kind.parameters).enumerate() {
        if !parameter_space.is_fixed() && stream.chance(rates.parameter) {
            *choice = if stream.chance(rates.fresh) {
                fresh_choice(kind, at, stream)
            } else {
                parameter_space.near(choice, rates.steps, stream)
            };
            operation.operation_seed = stream.bits();
        }
    }
}

/// Puts a fresh instance of another operation in an operation's place, with the same window or the same conditions
/// where that one permits them.
fn retarget(operation: &mut TestOperation, kind: &OperationSpace, stream: &mut Stream) {
    let mut fresh = fresh_operation(kind, stream);
    match (&operation.activation, &kind.activation) {
        (&Activation::Time { start, end }, ActivationSpace::Time(window)) => {
            let start = start.max(window.low);
            let end = end.min(window.high).min(start + window.longest);
            if end - start >= window.shortest && kind.heard.is_in((start, end)) {
                fresh.activation = Activation::Time { start, end };
            }
        }
        (
            kept @ (Activation::Condition { start, .. } | Activation::ConditionFor { start, .. }),
            ActivationSpace::Condition { constraints, space, .. },
        ) if constraints.iter().all(|constraint| contains(start, constraint)) => {
            fresh.activation = kept.clone();
            if let (Activation::ConditionFor { length, .. }, ConditionEnd::Length { low, high }) =
                (&mut fresh.activation, space.end)
            {
                *length = length.clamp(low, high);
            }
        }
        // What is kept is not permitted there, or one of them is offline and has nothing to keep or to be given.
        _ => {}
    }
    *operation = fresh;
}

/// Changes the activation, or, of an offline operation, which has none to choose, each parameter.
pub(super) fn change_somehow(
    operation: &mut TestOperation,
    test_space: &TestSpace,
    rates: &Rates,
    stream: &mut Stream,
) {
    let kind = kind_of(operation, test_space);
    if kind.activation != ActivationSpace::Offline {
        return change_activation(operation, test_space, rates, stream);
    }
    for (choice, parameter_space) in operation.parameters.iter_mut().zip(&kind.parameters) {
        if !parameter_space.is_fixed() {
            *choice = parameter_space.near(choice, rates.steps, stream);
            operation.operation_seed = stream.bits();
        }
    }
}

/// Changes a window, or one of what takes its place: a start condition, an end condition, a length, each alike; if
/// there is one to choose.
fn change_activation(operation: &mut TestOperation, test_space: &TestSpace, rates: &Rates, stream: &mut Stream) {
    let kind = kind_of(operation, test_space);
    match (&mut operation.activation, &kind.activation) {
        (Activation::Offline, ActivationSpace::Offline) => return,
        (Activation::Time { start, end }, ActivationSpace::Time(window)) => {
            (*start, *end) = if stream.chance(rates.fresh) {
                fresh_window(*window, &kind.heard, stream)
            } else {
                let mut steps = (0..=rates.tries).map(|_| window.interval_near((*start, *end), rates.steps, stream));
                steps.find(|near| kind.heard.is_in(*near)).unwrap_or((*start, *end))
            };
        }
        (Activation::Condition { start, end, .. }, ActivationSpace::Condition { space, constraints, .. }) => {
            let (condition, constraints) =
                if stream.chance(0.5) { (start, constraints.as_slice()) } else { (end, [].as_slice()) };
            *condition = condition::changed(condition, space, constraints, (rates.fresh, rates.steps), stream);
        }
        (Activation::ConditionFor { start, length, .. }, ActivationSpace::Condition { space, constraints, .. }) => {
            change_start_or_length((start, length), constraints, space, rates, stream);
        }
        (activation, activation_space) => unreachable!("{activation_space:?} gives no {activation:?}"),
    }
    operation.operation_seed = stream.bits();
}

fn change_start_or_length(
    (start, length): (&mut Condition, &mut f64),
    constraints: &[Constraint],
    space: &ConditionSpace,
    rates: &Rates,
    stream: &mut Stream,
) {
    let range = match space.end {
        ConditionEnd::Length { low, high } => Range::between(low, high),
        ConditionEnd::Condition => Range::between(*length, *length),
    };
    if range.is_fixed() || stream.chance(0.5) {
        *start = condition::changed(start, space, constraints, (rates.fresh, rates.steps), stream);
    } else if stream.chance(rates.fresh) {
        *length = range.number(stream);
    } else {
        *length = range.number_near(*length, rates.steps, stream);
    }
}

pub(super) fn kind_of<'a>(operation: &TestOperation, test_space: &'a TestSpace) -> &'a OperationSpace {
    test_space.find(operation.operation).expect("a test of a campaign holds operations of that campaign")
}
