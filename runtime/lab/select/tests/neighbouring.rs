//! Choices of neighbouring problems: other λ, more budget, some tests performed already.

use proptest::prelude::*;
use sesame_select::sweep::{changes, sweep};
use sesame_select::{Invalid, Pairs, Problem, State, Test, choose, marginal};

fn any_problem() -> impl Strategy<Value = Problem> {
    let fine = (0.0..1.0, 0.0..1.0, 0.0..=1.0, 0..3_u8);
    let coarse = (0..3_u8, 0..3_u8, 0..3_u8, 0..3_u8)
        .prop_map(|(x, y, q, cost)| (f64::from(x) / 2.0, f64::from(y) / 2.0, f64::from(q) / 2.0, cost));
    let test = prop_oneof![fine, coarse].prop_map(|(x, y, quality, cost)| Test {
        point: vec![x, y],
        quality,
        cost: 1.0 + f64::from(cost) / 2.0,
        forced: false,
    });
    (prop::collection::vec(test, 3..=12), 1..7_u8)
        .prop_map(|(tests, budget)| Problem::new(tests, 0.5, f64::from(budget), Pairs::Unordered).expect("it is valid"))
}

fn value(problem: &Problem, lambda: f64, chosen: &[usize]) -> f64 {
    problem.clone().with_lambda(lambda).expect("it is from 0 to 1").value(chosen)
}

proptest! {
    #[test]
    fn stretches_cover_all_weights_and_hold_the_best_choice_of_each(
        problem in any_problem(),
        lambdas in prop::collection::vec(0.0..=1.0, 8),
    ) {
        let sweep = sweep(&problem, &mut || false);
        prop_assert!(sweep.proved);
        let stretches = &sweep.stretches;
        prop_assert_eq!((stretches[0].from, stretches.last().expect("there is one").to), (0.0, 1.0));
        prop_assert!(stretches.windows(2).all(|pair| pair[0].to == pair[1].from && pair[0].chosen != pair[1].chosen));
        for lambda in lambdas {
            let best = choose(&problem.clone().with_lambda(lambda).expect("it is from 0 to 1"), &mut || false);
            let stretch = stretches.iter().find(|stretch| stretch.from <= lambda && lambda <= stretch.to);
            let here = value(&problem, lambda, &stretch.expect("they cover all").chosen);
            prop_assert!((here - best.value).abs() <= 1e-8 * best.value, "{} {} {}", lambda, here, best.value);
        }
        let mut chosen = Vec::new();
        for stretch in stretches {
            chosen.retain(|at| !stretch.leave.contains(at));
            chosen.extend(&stretch.enter);
            chosen.sort_unstable();
            prop_assert_eq!(&chosen, &stretch.chosen);
        }
    }

    #[test]
    fn more_budget_buys_what_a_new_choice_has(problem in any_problem()) {
        let now = choose(&problem, &mut || false);
        match marginal(&problem, &now, None, &mut || false) {
            None => prop_assert_eq!(now.chosen.len(), problem.tests().len()),
            Some(more) => {
                let anew = choose(&problem.clone().with_budget(more.budget).expect("it is greater"), &mut || false);
                prop_assert_eq!(&more.selection, &anew);
                prop_assert!((more.gain - (anew.value - now.value)).abs() < 1e-12);
                prop_assert!(more.budget > problem.budget());
                if now.value > 0.0 {
                    prop_assert!(more.gain > 0.0, "another test is always worth something: {:?}", more);
                }
            }
        }
    }

    #[test]
    fn tests_that_were_performed_stay_and_the_rest_of_the_budget_is_used(problem in any_problem()) {
        let first = choose(&problem, &mut || false);
        prop_assume!(!first.chosen.is_empty());
        let done = first.chosen[0];
        let mut tests = problem.tests().to_vec();
        let left = problem.budget() - tests[done].cost;
        tests[done].forced = true;
        tests[done].cost = 0.0;
        let again = Problem::new(tests, problem.lambda(), left, Pairs::Unordered).expect("it is valid");
        let second = choose(&again, &mut || false);
        prop_assert!(second.chosen.contains(&done));
        prop_assert!((second.value - first.value).abs() <= 1e-9 * first.value, "nothing changed, so the choice stands");
    }
}

#[test]
fn changes_are_what_enters_and_what_leaves() {
    assert_eq!(changes(&[1, 2, 5], &[2, 3, 5, 9]), (vec![3, 9], vec![1]));
}

#[test]
fn what_is_no_problem_is_named() {
    let test = |x: f64, quality: f64, cost: f64, forced: bool| Test { point: vec![x], quality, cost, forced };
    let fine = test(0.0, 0.5, 1.0, false);
    let wrong = |other: Test, lambda: f64, budget: f64| {
        Problem::new(vec![fine.clone(), other], lambda, budget, Pairs::Unordered).expect_err("it is wrong")
    };
    assert_eq!(wrong(fine.clone(), 1.5, 1.0), Invalid::Lambda(1.5));
    assert!(matches!(wrong(fine.clone(), f64::NAN, 1.0), Invalid::Lambda(_)));
    assert_eq!(wrong(fine.clone(), 0.5, -1.0), Invalid::Budget(-1.0));
    assert_eq!(wrong(test(0.0, 0.5, -1.0, false), 0.5, 1.0), Invalid::Cost(1, -1.0));
    assert_eq!(wrong(test(0.0, 1.5, 1.0, false), 0.5, 1.0), Invalid::Quality(1, 1.5));
    assert_eq!(wrong(test(f64::INFINITY, 0.5, 1.0, false), 0.5, 1.0), Invalid::Coordinate(1, f64::INFINITY));
    assert_eq!(wrong(test(1e200, 0.5, 1.0, false), 0.5, 1.0), Invalid::Spread);
    assert_eq!(wrong(Test { point: vec![0.0, 1.0], ..fine.clone() }, 0.5, 1.0), Invalid::Dimensions(1, 2));
    let forced = wrong(test(0.0, 0.5, 7.0, true), 0.5, 5.0);
    assert_eq!(forced, Invalid::Forced(7.0, 5.0));
    assert_eq!(forced.to_string(), "the forced tests cost 7, which is more than the budget of 5");
}

#[test]
fn budgets_for_one_test_and_none_have_their_choices() {
    let test = |x: f64, quality: f64, cost: f64| Test { point: vec![x], quality, cost, forced: false };
    let tests = vec![test(0.0, 0.5, 1.0), test(1.0, 0.9, 1.0), test(2.0, 0.9, 1.0), test(3.0, 1.0, 9.0)];
    let chosen = |budget: f64| {
        let selection =
            choose(&Problem::new(tests.clone(), 0.5, budget, Pairs::Unordered).expect("it is valid"), &mut || false);
        assert_eq!(selection.state, State::Proved);
        selection.chosen
    };
    assert_eq!(chosen(0.5), [0_usize; 0]);
    assert_eq!(chosen(1.0), [1], "the best that is affordable, and of equal ones the first");
    assert_eq!(chosen(2.0), [0, 2]);
    assert_eq!(chosen(8.0), [0, 1, 2]);
    assert_eq!(chosen(12.0), [0, 1, 2, 3]);
    assert_eq!(
        choose(&Problem::new(vec![], 0.5, 1.0, Pairs::Unordered).expect("it is valid"), &mut || false).value,
        0.0
    );
}

/// Two thousand tests in thirty clusters: far too many for anything but the bounds.
#[test]
fn near_duplicates_and_many_sizes_are_proved_after_few_questions() {
    let mut state = 1_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1_u64 << 24) as f64
    };
    let centres: Vec<[f64; 3]> = (0..30).map(|_| [unit(), unit(), unit()]).collect();
    let mut near = |at: usize| {
        let [x, y, quality] = centres[at % 30];
        let point = vec![x + 0.02 * unit(), y + 0.02 * unit()];
        Test {
            point,
            quality: 0.9 * quality + 0.1 * unit(),
            cost: 1.0 + f64::from(u8::from(at.is_multiple_of(3))),
            forced: false,
        }
    };
    let tests: Vec<Test> = (0..2_000).map(&mut near).collect();
    for lambda in [0.25, 0.75, 1.0] {
        let mut asked = 0;
        let problem = Problem::new(tests.clone(), lambda, 8.0, Pairs::Unordered).expect("it is valid");
        let selection = choose(&problem, &mut || {
            asked += 1;
            asked > 20_000
        });
        assert_eq!(selection.state, State::Proved, "λ = {lambda}");
    }
}
