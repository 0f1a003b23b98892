//! The search as a whole.

use std::sync::Arc;

use proptest::prelude::*;

use sesame_base::observation::{MetricObservation, Observation, Outcome};
use sesame_optimise::dominance::Fitness;
use sesame_plan::{Activation, Search, Strategy, Test};

use crate::space::test_space::tests::{any_plan, broken_rule};
use crate::testing::synthetic_robots::{SYNTHETIC_ROBOTS, SyntheticRobot};
use crate::{Evaluated, margins};

#[test]
fn the_seed_decides_and_results_told_again_bring_a_search_back_to_where_it_was() {
    let robot = &SYNTHETIC_ROBOTS[1];
    let mut plan = robot.plan(Search::new(Strategy::Interleaved { keep_causes: false }, 60));
    plan.requirements.push(SyntheticRobot::fewer_hits_than(20.0));
    let start = |seed| crate::strategy(&plan, seed).unwrap();
    let whole = robot.campaign_of(&plan, start(8).as_mut()).tests;
    assert_eq!(whole.len(), 60);
    assert_ne!(whole, robot.campaign_of(&plan, start(9).as_mut()).tests);
    let (mut resumed, mut told) = (start(8), 0);
    resumed.begin(&SyntheticRobot::without_disturbance(&plan));
    while told < whole.len() {
        let asked = resumed.ask();
        let stored = &whole[told..told + asked.len()];
        for (candidate, result) in asked.iter().zip(stored) {
            assert_eq!(candidate.test, result.test);
        }
        resumed.tell(stored);
        told += asked.len();
    }
    assert!(resumed.ask().is_empty());
    assert!(whole.iter().any(|result| margins(&plan, &result.run)[0].violated));
}

/// A test whose first metric has a value.
fn valued(number: u32, test: Test, value: f64) -> Evaluated {
    let run = Observation {
        metrics: vec![MetricObservation::whole(Some(value), true, Vec::new())],
        ..Observation::without_run(Outcome::Completed)
    };
    let fitness = Fitness::Measured(vec![value]);
    Evaluated { number, test, fitness, point: None, run: Arc::new(run), fresh_runs: Vec::new() }
}

/// Two operations violate the requirement together, and one of them also if it acts twice in a row. Then it alone is
/// the cause.
#[test]
fn an_operation_of_a_pair_is_tried_twice_by_itself() {
    let mut plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Interleaved { keep_causes: false }, 64));
    for operation in &mut plan.operations {
        operation.lengths = Some(sesame_plan::Lengths { low: 1.0, high: 5.0 });
    }
    plan.requirements = vec![sesame_plan::testing::requirement("R1", 0, sesame_plan::Bound::AtMost { value: 0.5 })];
    let violates = |test: &Test| {
        let count = |id: u32| test.operations.iter().filter(|used| used.operation.0 == id).count();
        let windows: Vec<(f64, f64)> = test
            .operations
            .iter()
            .filter_map(|used| match used.activation {
                Activation::Time { start, end } => Some((start, end)),
                _ => None,
            })
            .collect();
        let in_a_row = || windows.len() == 2 && (windows[0].1 == windows[1].0 || windows[1].1 == windows[0].0);
        count(0) == 2 && in_a_row() || count(0) == 1 && count(1) == 1
    };
    let mut search = crate::strategy(&plan, 3).unwrap();
    let (mut tests, mut number) = (Vec::new(), 0);
    loop {
        let asked = search.ask();
        if asked.is_empty() {
            break;
        }
        let results: Vec<Evaluated> = asked
            .into_iter()
            .map(|candidate| {
                number += 1;
                tests.push(candidate.test.clone());
                let value = f64::from(u8::from(violates(&candidate.test)));
                valued(number, candidate.test, value)
            })
            .collect();
        search.tell(&results);
    }
    let alone = |test: &Test| violates(test) && test.operations.iter().all(|used| used.operation.0 == 0);
    let pair = tests.iter().position(|test| violates(test) && !alone(test)).expect("each pair is tried");
    let found = tests[pair..].iter().position(alone).expect("it is tried alone");
    assert!(found <= 24, "within three generations: the pair is attributed in two of them");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Whatever a campaign permits, and whatever comes of its tests.
    #[test]
    fn tests_are_permitted(plan in any_plan(), seed: u64) {
        let mut plan = plan;
        plan.campaign.search = Search::new(Strategy::Interleaved { keep_causes: seed % 2 == 0 }, 40);
        plan.requirements = vec![sesame_plan::testing::requirement("R1", 0, sesame_plan::Bound::AtMost { value: 0.5 })];
        let mut search = crate::strategy(&plan, seed).unwrap();
        let mut number = 0;
        loop {
            let asked = search.ask();
            if asked.is_empty() {
                break;
            }
            let results: Vec<Evaluated> = asked.into_iter().map(|candidate| {
                prop_assert_eq!(broken_rule(&plan, &candidate.test), None);
                number += 1;
                let kinds = candidate.test.operations.iter().map(|used| u64::from(used.operation.0)).sum::<u64>();
                Ok(valued(number, candidate.test, kinds.wrapping_add(seed) as f64 % 3.0 / 2.0))
            }).collect::<Result<_, TestCaseError>>()?;
            search.tell(&results);
        }
        prop_assert_eq!(number, 40);
    }
}
