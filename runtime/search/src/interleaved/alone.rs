//! Whether an operation of a cause of several does it alone.
//!
//! If a test no longer violates a requirement without one of its operations, that says little about other tests. What
//! is left may do it alone if it is stronger, longer, or happens twice. So each operation of such a cause is tried
//! alone in these ways, near where the cause was seen. If one of them violates the requirement, the cause is the
//! smaller one.

use std::collections::BTreeSet;

use sesame_plan::{Activation, Test, TestOperation};
use sesame_rng::Stream;

use super::in_a_row::{in_a_row, is_permitted};
use super::setting::Setting;

/// Tests of single operations of a test that shows a cause.
pub(super) fn alone(setting: &Setting, test: &Test, stream: &mut Stream) -> Vec<Test> {
    let kinds = setting.kinds_of(test);
    let (start, end) = from_first_to_last(&test.operations);
    let mut tests = Vec::new();
    for kind in kinds.iter().copied().collect::<BTreeSet<usize>>() {
        let strongest = &setting.kind(kind).strongest;
        let of = |is_own: bool| {
            let uses = kinds.iter().zip(&test.operations).filter(move |(each, _)| (**each == kind) == is_own);
            uses.map(|(_, used)| used)
        };
        let own: Vec<TestOperation> = of(true)
            .map(|used| TestOperation { parameters: strongest.closest_to(&used.parameters), ..used.clone() })
            .collect();
        let parameters = own[0].parameters.clone();
        let mut at = |start: f64, end: f64| {
            let range = setting.window(kind)?;
            let start = start.max(range.low);
            let end = end.min(range.high).min(start + range.longest);
            (end - start >= range.shortest)
                .then(|| setting.operation(kind, Activation::Time { start, end }, parameters.clone(), stream))
        };
        // For as long as all of them together.
        let longer = at(start, end).map(|used| vec![used]);
        // Where the others acted, too; where they acted at the same time, right before or afterwards.
        let (own_start, own_end) = from_first_to_last(&own);
        let apart = |other: &TestOperation| {
            let (from, to) = window(other)?;
            if !own.iter().filter_map(window).any(|own| own.0 < to && from < own.1) {
                return Some((from, to));
            }
            let room = setting.window(kind)?;
            let length = to - from;
            if own_end + length <= room.high {
                Some((own_end, own_end + length))
            } else {
                (own_start - length >= room.low).then_some((own_start - length, own_start))
            }
        };
        let again = of(false).find_map(apart).and_then(|(from, to)| at(from, to));
        let twice = again.map(|again| [own.clone(), vec![again]].concat());
        tests.extend([Some(own), longer, twice].into_iter().flatten().map(|operations| Test { operations }));
        tests.extend(in_a_row(setting, kind, stream));
    }
    tests.retain(|test| is_permitted(setting, test));
    tests
}

/// From the first start to the last end of windows.
fn from_first_to_last(operations: &[TestOperation]) -> (f64, f64) {
    let windows = operations.iter().filter_map(window);
    windows.fold((f64::INFINITY, f64::NEG_INFINITY), |(start, end), window| (start.min(window.0), end.max(window.1)))
}

fn window(used: &TestOperation) -> Option<(f64, f64)> {
    match used.activation {
        Activation::Time { start, end } => Some((start, end)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_base::observation::{Observation, Outcome};

    use super::*;
    use crate::interleaved::moments::Moments;
    use crate::space::TestSpace;
    use crate::space::initial::fresh_test;
    use crate::space::test_space::tests::{any_plan, broken_rule};

    proptest! {
        /// Whatever a campaign permits.
        #[test]
        fn each_test_holds_one_operation_of_the_cause_and_is_permitted(plan in any_plan(), seed: u64) {
            let Ok(space) = TestSpace::from_plan(&plan) else { return Ok(()) };
            let nothing = Observation::without_run(Outcome::Completed);
            let moments = Moments::from_reference(&plan, &space, &nothing);
            let setting = Setting::new(plan.clone(), space, moments, None);
            let mut stream = Stream::derive(seed, "test", &[]);
            let cause = fresh_test(&setting.space, &mut stream);
            for test in alone(&setting, &cause, &mut stream) {
                prop_assert_eq!(setting.held(&test).len(), 1);
                prop_assert!(setting.held(&test).is_subset(&setting.held(&cause)));
                prop_assert_eq!(broken_rule(&plan, &test), None);
            }
        }
    }
}
