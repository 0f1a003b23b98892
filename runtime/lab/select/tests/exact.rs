//! The choice compared with all subsets.

use proptest::prelude::*;
use sesame_select::{Pairs, Problem, Selection, State, Test, choose};

/// Values that differ by this share are equal, as the crate has it; here with room for rounding.
const EQUAL: f64 = 1e-9;

/// Tests on a coarse grid, so that there are duplicates and ties, or anywhere.
fn any_test() -> impl Strategy<Value = Test> {
    let coarse = (0..4_u8, 0..3_u8, 0..3_u8, 0..5_u8).prop_map(|(x, y, quality, cost)| {
        let cost = if cost == 0 { 0.5 } else { f64::from(cost) };
        (vec![f64::from(x) / 3.0, f64::from(y) / 2.0], f64::from(quality) / 2.0, cost)
    });
    let fine = (0.0..1.0, 0.0..1.0, 0.0..=1.0, 0.0..4.0).prop_map(|(x, y, quality, cost)| (vec![x, y], quality, cost));
    let even = (0.0..1.0, 0.0..1.0, 0.0..=1.0).prop_map(|(x, y, quality)| (vec![x, y], quality, 1.0));
    prop_oneof![coarse, fine, even].prop_map(|(point, quality, cost)| Test { point, quality, cost, forced: false })
}

/// Tests near a few centres, as fronts have them: near-duplicates of which several may be chosen.
fn clustered() -> impl Strategy<Value = Vec<Test>> {
    let centres = prop::collection::vec((0.0..1.0, 0.0..1.0, 0.1..0.9), 4);
    let near = (0..4_usize, -0.01..0.01, -0.01..0.01, -0.05..0.05, 1..3_u8);
    (centres, prop::collection::vec(near, 4..=15)).prop_map(|(centres, near)| {
        let test = |(at, x, y, quality, cost): (usize, f64, f64, f64, u8)| Test {
            point: vec![centres[at].0 + x, centres[at].1 + y],
            quality: centres[at].2 + quality,
            cost: f64::from(cost),
            forced: false,
        };
        near.into_iter().map(test).collect()
    })
}

fn any_problem() -> impl Strategy<Value = Problem> {
    let coarse = prop::collection::vec((0..4_u8, 0..2_u8, 0..3_u8), 0..=12).prop_map(|rows| {
        let test = |(x, y, quality): (u8, u8, u8)| Test {
            point: vec![f64::from(x) / 3.0, f64::from(y)],
            quality: f64::from(quality) / 2.0,
            cost: 1.0,
            forced: false,
        };
        rows.into_iter().map(test).collect::<Vec<_>>()
    });
    let tests = prop_oneof![coarse, prop::collection::vec(any_test(), 0..=14), clustered()];
    let lambda = prop_oneof![Just(0.0), Just(0.25), Just(0.5), Just(0.75), Just(1.0), 0.0..=1.0];
    let pairs = prop_oneof![Just(Pairs::Unordered), Just(Pairs::Ordered)];
    let forced = prop::collection::btree_set(0..30_usize, 0..=3);
    (tests, lambda, pairs, 0..9_u8, any::<bool>(), forced).prop_map(
        |(mut tests, lambda, pairs, budget, whole, forced)| {
            let mut paid = 0.0;
            for at in forced {
                if let Some(test) = tests.get_mut(at) {
                    test.forced = true;
                    // Some are paid for already.
                    test.cost = if at % 2 == 0 { 0.0 } else { test.cost };
                    paid += test.cost;
                }
            }
            let budget = paid + f64::from(budget) + if whole { 0.0 } else { 0.3 };
            Problem::new(tests, lambda, budget, pairs).expect("it is valid")
        },
    )
}

/// Tries all subsets as the documentation of [`choose`] has it.
fn best(problem: &Problem) -> (Vec<usize>, f64) {
    let tests = problem.tests();
    let mut subsets: Vec<(Vec<usize>, f64)> = Vec::new();
    for bits in 0..1_u32 << tests.len() {
        let subset: Vec<usize> = (0..tests.len()).filter(|at| bits >> at & 1 == 1).collect();
        let forced = (0..tests.len()).all(|at| !tests[at].forced || subset.contains(&at));
        if forced && problem.cost(&subset) <= problem.budget() * (1.0 + 1e-9) {
            let value = problem.value(&subset);
            subsets.push((subset, value));
        }
    }
    let most = subsets.iter().map(|(subset, _)| subset.len()).max().expect("the forced tests are affordable");
    if most < 2 {
        let quality = |subset: &[usize]| subset.first().map_or(-1.0, |&at| tests[at].quality);
        return subsets
            .into_iter()
            .reduce(|a, b| if quality(&b.0) > quality(&a.0) { b } else { a })
            .expect("it is one of them");
    }
    let value = subsets.iter().filter(|(subset, _)| subset.len() >= 2).map(|(_, value)| *value).fold(0.0, f64::max);
    let equal = subsets.into_iter().filter(|(subset, v)| subset.len() >= 2 && *v >= value * (1.0 - EQUAL));
    equal.min_by(|a, b| a.0.cmp(&b.0)).expect("two are affordable")
}

fn valid(problem: &Problem, selection: &Selection) {
    let tests = problem.tests();
    assert!(selection.chosen.is_sorted_by(|a, b| a < b), "{selection:?}");
    assert!(problem.cost(&selection.chosen) <= problem.budget() * (1.0 + 1e-9), "{selection:?}");
    assert!((0..tests.len()).all(|at| !tests[at].forced || selection.chosen.contains(&at)), "{selection:?}");
    assert_eq!(selection.value, problem.value(&selection.chosen));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_choice_is_the_best_of_all_subsets_with_the_smallest_numbers(problem in any_problem()) {
        let selection = choose(&problem, &mut || false);
        valid(&problem, &selection);
        let (chosen, value) = best(&problem);
        prop_assert_eq!(selection.state, State::Proved);
        prop_assert!((selection.value - value).abs() <= 2.0 * EQUAL * value, "{:?} {:?} {}", selection, chosen, value);
        prop_assert_eq!(selection.chosen, chosen);
    }

    #[test]
    fn a_choice_that_is_stopped_is_valid_and_its_bound_is_not_below_the_best(
        problem in any_problem(),
        answers in 0..12_u32,
    ) {
        let mut left = answers;
        let selection = choose(&problem, &mut || {
            let stop = left == 0;
            left = left.saturating_sub(1);
            stop
        });
        valid(&problem, &selection);
        let (chosen, value) = best(&problem);
        match selection.state {
            State::Open { bound } => {
                prop_assert!(bound >= value * (1.0 - EQUAL), "{} {}", bound, value);
                prop_assert!(selection.gap() >= 0.0);
            }
            State::TiesOpen => prop_assert!(selection.value >= value * (1.0 - 2.0 * EQUAL)),
            State::Proved => prop_assert_eq!(selection.chosen, chosen),
        }
    }
}
