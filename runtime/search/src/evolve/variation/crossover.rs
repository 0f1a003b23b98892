//! Crossover: of two lists of operations, and of their conditions.

use sesame_plan::{Activation, Test};
use sesame_rng::Stream;

use super::mutation::kind_of;
use super::rates::Rates;
use crate::space::condition;
use crate::space::test_space::TestSpace;

/// One-point crossover of two lists: each is cut in two, and the tails are exchanged. The cuts are uniform over all
/// that leave both children with a permitted number of operations and exchange neither nothing nor everything; `None`
/// when there are none such. Copies of one operation that come together [settle](TestSpace::settle).
pub(crate) fn crossover([a, b]: [&Test; 2], test_space: &TestSpace, stream: &mut Stream) -> Option<[Test; 2]> {
    let (a, b) = (&a.operations, &b.operations);
    let lengths = test_space.fewest()..=test_space.most();
    let mut cuts = Vec::new();
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            let fits = lengths.contains(&(i + b.len() - j)) && lengths.contains(&(j + a.len() - i));
            let idle = (i == 0 && j == 0) || (i == a.len() && j == b.len());
            if fits && !idle {
                cuts.push((i, j));
            }
        }
    }
    if cuts.is_empty() {
        return None;
    }
    let (i, j) = cuts[stream.below(cuts.len())];
    Some([[&a[..i], &b[j..]].concat(), [&b[..j], &a[i..]].concat()].map(|operations| {
        let mut test = Test { operations };
        test_space.settle(&mut test, stream);
        test
    }))
}

/// Exchanges parts of conditions between two tests, the children of a crossover or, where there was none, their
/// parents; start conditions with start conditions, end conditions with end conditions. `None` where neither changed
/// anything.
pub(super) fn exchange_conditions(
    parents: [&Test; 2],
    crossed: Option<[Test; 2]>,
    test_space: &TestSpace,
    rates: &Rates,
    stream: &mut Stream,
) -> Option<[Test; 2]> {
    let Some(space) = test_space.conditions() else { return crossed };
    let mut changed = crossed.is_some();
    let [mut a, mut b] = crossed.unwrap_or_else(|| parents.map(Clone::clone));
    for (a, b) in a.operations.iter_mut().zip(&mut b.operations) {
        // Both draws are made in any case, so that later ones do not depend on them.
        let [starts, ends] = [(); 2].map(|()| stream.chance(rates.exchange));
        let [of_a, of_b] = [&*a, &*b].map(|operation| kind_of(operation, test_space).activation.constraints());
        match (&mut a.activation, &mut b.activation) {
            (Activation::Condition { start: c, end: e, .. }, Activation::Condition { start: d, end: f, .. }) => {
                changed |= starts && condition::exchange([(c, of_a), (d, of_b)], space, stream);
                changed |= ends && condition::exchange([(e, &[]), (f, &[])], space, stream);
            }
            (Activation::ConditionFor { start: c, .. }, Activation::ConditionFor { start: d, .. }) => {
                changed |= starts && condition::exchange([(c, of_a), (d, of_b)], space, stream);
            }
            _ => {}
        }
    }
    changed.then_some([a, b])
}
