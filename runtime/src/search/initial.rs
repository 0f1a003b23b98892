//! Fresh tests: what a random search is made of and an evolution begins with.
//!
//! The kinds of a fresh test are the operations of the campaign, each included with its own probability; if none is,
//! one of those with a probability above zero (or of all), each alike. Its length is uniform over what the campaign
//! permits. If there are more kinds than places, a random choice of them stays; if there are fewer, each has its place
//! and the other places are filled with them at random: a test may hold an operation several times, with windows and
//! parameters of its own each time. Windows and sub-ranges are uniform over all feasible pairs of ends, values uniform
//! over their range. The order of the list is random.

use sesame_plan::{Activation, Test, TestOperation};

use crate::rng::Stream;
use crate::search::permitted::{Permitted, PermittedOperation};
use crate::search::range::fresh_choice;

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
    let (start, end) = kind.window.interval(stream);
    let parameters = kind.parameters.iter().map(|&(range, shape)| fresh_choice(range, shape, stream)).collect();
    TestOperation {
        operation: kind.operation,
        activation: Activation::Time { start, end },
        parameters,
        draw_seed: stream.bits(),
    }
}
