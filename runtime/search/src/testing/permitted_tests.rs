//! What all strategies draw: permitted tests, and the same ones.

use sesame_base::observation::{Course, Heard, Observation};
use sesame_base::silence::wires;
use sesame_plan::condition::ConditionEnd;
use sesame_plan::{
    Activation, Campaign, CampaignPlan, Copies, Count, CoverageGoal, Dimension, Exploration, Lengths, Search, Span,
    Strategy, StrategyKind, Test, Type,
};

use crate::coverage::Grid;
use crate::space::test_space::TestSpace;
use crate::space::test_space::tests::{broken_copies, broken_rule};
use crate::strategy;
use crate::testing::synthetic_robots::{SYNTHETIC_ROBOTS, SyntheticRobot};

const ALL: [Copies; 3] = [Copies::Apart, Copies::MayOverlap, Copies::Once];

/// Every strategy by time, with what it needs.
fn by_time(copies: Copies, evaluations: u32) -> Vec<CampaignPlan> {
    let plan = |search, exploration| {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(search);
        let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
        plan.campaign.coverage = Some(CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
        plan.campaign.exploration = exploration;
        plan.campaign.copies = copies;
        plan.requirements = vec![SyntheticRobot::fewer_hits_than(20.0)];
        plan
    };
    let nsga2 = Search::new(Strategy::Nsga2 { population: 10 }, evaluations);
    let children = sesame_plan::BoostedChildren::Every { iterations: 1 };
    vec![
        plan(Search::new(Strategy::Random, evaluations), None),
        plan(Search::new(Strategy::Sobol, evaluations), None),
        plan(Search::new(Strategy::LatinHypercube, evaluations), None),
        plan(Search::new(Strategy::Grid { levels: 6 }, evaluations), None),
        plan(nsga2.clone(), None),
        plan(nsga2.clone(), Some(Exploration::Boost { every_generations: 1, children, tries: 5 })),
        plan(nsga2.clone(), Some(Exploration::Construct { share: 0.5, until: None })),
        plan(nsga2, Some(Exploration::Novelty { neighbours: 5, over: vec![Dimension::T1, Dimension::P1] })),
        plan(Search::new(Strategy::Nsga3 { population: 10 }, evaluations), None),
        plan(Search::new(Strategy::MapElites { population: 10 }, evaluations), None),
        plan(Search::new(Strategy::Falsification { population: 10 }, evaluations.min(60)), None),
    ]
}

fn tests_of(plan: &CampaignPlan, seed: u64) -> Vec<Test> {
    let mut strategy = strategy(plan, seed).unwrap();
    SYNTHETIC_ROBOTS[0].campaign_of(plan, strategy.as_mut()).tests.into_iter().map(|test| test.test).collect()
}

/// All tests of a campaign are permitted, as the plan itself has it and as the search does.
fn assert_permitted(plan: &CampaignPlan, tests: &[Test]) {
    let test_space = TestSpace::from_plan(plan).unwrap();
    for test in tests {
        assert_eq!(broken_rule(plan, test), None, "{:?} {:?}", plan.campaign.search, plan.campaign.copies);
        assert!(test_space.permits_copies(test), "{test:?}");
    }
}

fn has_copies(test: &Test) -> bool {
    let operations = &test.operations;
    (0..operations.len())
        .any(|i| operations[..i].iter().any(|operation| operation.operation == operations[i].operation))
}

#[test]
fn every_strategy_draws_permitted_tests_only() {
    for copies in ALL {
        for plan in by_time(copies, 200) {
            assert_permitted(&plan, &tests_of(&plan, 5));
        }
    }
}

#[test]
fn four_thousand_tests_of_an_evolution_are_permitted() {
    for copies in ALL {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Nsga2 { population: 20 }, 4_000));
        plan.campaign.copies = copies;
        let tests = tests_of(&plan, 3);
        assert_permitted(&plan, &tests);
        let copied = tests.iter().filter(|test| has_copies(test)).count();
        assert!(if copies == Copies::Once { copied == 0 } else { copied > 1_000 }, "{copied}");
    }
}

#[test]
fn strategies_by_condition_draw_permitted_tests_only() {
    let evaluations = 200;
    for copies in ALL {
        for (search, exploration) in [
            (Search::new(Strategy::Random, evaluations), None),
            (Search::new(Strategy::Nsga2 { population: 10 }, evaluations), None),
            (
                Search::new(Strategy::Nsga2 { population: 10 }, evaluations),
                Some(Exploration::Predict { candidates: 4 }),
            ),
            (Search::new(Strategy::MapElites { population: 10 }, evaluations), None),
        ] {
            let mut plan = SYNTHETIC_ROBOTS[0].plan_by_condition(search, ConditionEnd::Length { low: 1.0, high: 9.0 });
            let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6").unwrap();
            plan.campaign.coverage = Some(CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
            plan.campaign.exploration = exploration;
            plan.campaign.copies = copies;
            for test in tests_of(&plan, 5) {
                assert_eq!(broken_copies(&plan, &test), None);
                assert!((1..=5).contains(&test.operations.len()));
            }
        }
    }
}

/// Also with more operations than places, where `random` repeated none, and `sobol` and `latin_hypercube` did in a
/// quarter of their tests.
#[test]
fn fresh_tests_contain_copies_equally_often_with_each_strategy() {
    let evaluations = 2_000;
    for copies in [Copies::Apart, Copies::MayOverlap] {
        let shares = [
            Search::new(Strategy::Random, evaluations),
            Search::new(Strategy::Sobol, evaluations),
            Search::new(Strategy::LatinHypercube, evaluations),
            // Its first generation alone.
            Search::new(Strategy::Nsga2 { population: evaluations }, evaluations),
        ]
        .map(|search| {
            let mut plan = SYNTHETIC_ROBOTS[2].plan(search);
            plan.campaign.copies = copies;
            plan.campaign.count = Count { min: 1, max: 5 };
            let mut strategy = strategy(&plan, 7).unwrap();
            let mut tests = Vec::new();
            while tests.len() < 2_000 {
                let asked = strategy.ask();
                tests.extend(asked.iter().map(|candidate| candidate.test.clone()));
                let results = asked.into_iter().zip(0..).map(|(candidate, number)| crate::Evaluated {
                    number,
                    test: candidate.test,
                    fitness: sesame_optimise::dominance::Fitness::Unfit(sesame_optimise::dominance::Unfit::Void),
                    point: None,
                    run: crate::testing::no_run(),
                    fresh_runs: Vec::new(),
                });
                strategy.tell(&results.collect::<Vec<_>>());
            }
            tests.iter().filter(|test| has_copies(test)).count() as f64 / tests.len() as f64
        });
        // A quarter draws each of up to five places from six kinds: 0, 1/6, 4/9, 13/18 and 49/54 of them have copies.
        let expected = 0.25 / 5.0 * (1.0 / 6.0 + 4.0 / 9.0 + 13.0 / 18.0 + 49.0 / 54.0);
        assert!(shares.iter().all(|share| (share - expected).abs() < 0.02), "{shares:?} and {expected}");
    }
}

/// A strategy that begins with another reference run than the synthetic robots'.
struct Begun(Box<dyn crate::Strategy>, Observation);

impl crate::Strategy for Begun {
    fn begin(&mut self, _: &Observation) {
        self.0.begin(&self.1);
    }

    fn ask(&mut self) -> Vec<crate::Candidate> {
        self.0.ask()
    }

    fn tell(&mut self, results: &[crate::Evaluated]) {
        self.0.tell(results);
    }
}

/// Short windows would miss three messages nearly always.
#[test]
fn no_strategy_but_a_grid_spends_tests_on_windows_without_a_message() {
    let times = [5.0, 31.0, 60.0];
    let interleaved = Search::new(Strategy::Interleaved { keep_causes: true }, 200);
    for copies in [Copies::Apart, Copies::MayOverlap] {
        let mut plans = by_time(copies, 200);
        plans.retain(|plan| plan.campaign.search.strategy().unwrap().kind() != StrategyKind::Grid);
        plans.push(CampaignPlan {
            campaign: Campaign { search: interleaved.clone(), ..plans[0].campaign.clone() },
            ..plans[0].clone()
        });
        for mut plan in plans {
            plan.campaign.count.max = 2;
            let count = plan.operations.iter().flat_map(sesame_plan::Operation::topics).map(|topic| topic.0 + 1).max();
            let topic = |at: u32| {
                sesame_plan::testing::topic(&format!("t{at}"), &[&format!("t{at}")], Type::Real { unit: None })
            };
            plan.topics = (0..count.unwrap()).map(topic).collect();
            for operation in &mut plan.operations {
                operation.lengths = Some(Lengths { low: 0.0, high: 3.0 });
            }
            // Construction puts windows where a cell wants them.
            let constructs = matches!(plan.campaign.exploration, Some(Exploration::Construct { .. }));
            let stretches: Vec<Span> = times.iter().map(|&at| Span { start: at, end: at }).collect();
            let heard = (0..).zip(wires(&plan)).map(|(wire, _)| Heard { wire, stretches: stretches.clone() });
            let course = Course { heard: heard.collect(), ..Course::default() };
            let mut reference = SyntheticRobot::without_disturbance(&plan);
            reference.course = Some(course);
            let mut strategy = Begun(strategy(&plan, 4).unwrap(), reference);
            let tests = SYNTHETIC_ROBOTS[0].campaign_of(&plan, &mut strategy).tests;
            let windows = tests.iter().flat_map(|test| &test.test.operations).map(|used| &used.activation);
            let (mut all, mut missed) = (0, 0);
            for window in windows {
                let &Activation::Time { start, end } = window else { panic!("{window:?}") };
                all += 1;
                missed += u32::from(!times.iter().any(|at| start <= *at && *at < end));
            }
            let permitted = if constructs { all / 2 } else { all / 50 };
            assert!(
                missed <= permitted,
                "{missed} of {all}: {:?} {:?}",
                plan.campaign.search,
                plan.campaign.exploration
            );
        }
    }
}

#[test]
fn every_strategy_keeps_to_the_permitted_lengths() {
    let bounds = [
        (Copies::Apart, 0.0, 2.0),
        (Copies::Apart, 20.0, 60.0),
        (Copies::MayOverlap, 1.0, 3.0),
        (Copies::Once, 2.5, 2.5),
    ];
    for (copies, low, high) in bounds {
        for mut plan in by_time(copies, 40) {
            plan.operations[0].lengths = Some(Lengths { low, high });
            plan.campaign.count.max = 3;
            assert_permitted(&plan, &tests_of(&plan, 1));
        }
    }
}

#[test]
fn activations_by_condition_have_lengths_that_campaign_and_operation_permit() {
    let nsga2 = || Search::new(Strategy::Nsga2 { population: 10 }, 200);
    let mut plan = SYNTHETIC_ROBOTS[0].plan_by_condition(nsga2(), ConditionEnd::Length { low: 1.0, high: 15.0 });
    plan.operations[0].lengths = Some(Lengths { low: 0.0, high: 2.0 });
    let tests = tests_of(&plan, 1);
    let mut lengths = [Vec::new(), Vec::new()];
    for used in tests.iter().flat_map(|test| &test.operations) {
        let Activation::ConditionFor { length, .. } = used.activation else { panic!("{used:?}") };
        lengths[used.operation.index()].push(length);
    }
    assert!(lengths[0].iter().all(|length| (1.0..=2.0).contains(length)), "{:?}", lengths[0]);
    assert!(lengths[1].iter().any(|&length| length > 10.0));
}
