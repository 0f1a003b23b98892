//! Strategies that target cells, on synthetic robots.

use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_plan::{BoostedChildren, CampaignPlan, CoverageGoal, Exploration, Search, Strategy, Test};

use crate::coverage::{Coverage, Grid};
use crate::testing::synthetic_robots::{SYNTHETIC_ROBOTS, SyntheticRobot};
use crate::{Evaluated, SearchError, strategy};

fn nsga2() -> Search {
    Search::new(Strategy::Nsga2 { population: 10 }, 210)
}
const FIXED: Exploration =
    Exploration::Boost { every_generations: 2, children: BoostedChildren::Every { iterations: 2 }, tries: 10 };
const LINEAR: Exploration = Exploration::Boost {
    every_generations: 1,
    children: BoostedChildren::Falling { first: 10, last: 1, drop: 1 },
    tries: 10,
};
const CONSTRUCT: Exploration = Exploration::Construct { share: 1.0, until: Some(0.5) };

/// A campaign with the cells of [SESAME 2023, Table 3].
fn plan(landscape: &SyntheticRobot, search: Search, exploration: Option<Exploration>) -> CampaignPlan {
    let mut plan = landscape.plan(search);
    plan.campaign.coverage = Some(goal());
    plan.campaign.exploration = exploration;
    plan
}

fn goal() -> CoverageGoal {
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
    CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None }
}

/// Evaluations after which a share of all cells was hit, and the hypervolume in the end.
fn reached_and_volume(landscape: &SyntheticRobot, plan: &CampaignPlan, share: f64, seed: u64) -> (usize, f64) {
    let run = landscape.campaign(strategy(plan, seed).unwrap().as_mut());
    let mut coverage = Coverage::new(Grid::new(goal().axes).unwrap(), 1);
    let reached = run.tests.iter().position(|result| {
        result.point.iter().for_each(|point| {
            coverage.add(point);
        });
        coverage.share() >= share
    });
    (reached.map_or(usize::MAX, |at| at + 1), run.volume)
}

fn median<T: PartialOrd + Copy>(mut values: Vec<T>) -> T {
    values.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    values[values.len() / 2]
}

#[test]
fn boosting_covers_cells_earlier_and_construction_nearly_at_once() {
    let reached = |exploration: Option<Exploration>, share| {
        let landscape = &SYNTHETIC_ROBOTS[0];
        let plan = plan(landscape, nsga2(), exploration);
        median((1..=9).map(|seed| reached_and_volume(landscape, &plan, share, seed).0).collect())
    };
    let [tracking, fixed, linear] = [None, Some(FIXED), Some(LINEAR)].map(|exploration| reached(exploration, 0.3));
    assert!(fixed < tracking && linear < tracking, "{tracking}, {fixed} and {linear}");
    let construct = reached(Some(CONSTRUCT), 0.5);
    assert!((54..=60).contains(&construct), "{construct}");
}

/// Tests on the robot of two signals may hold copies that overlap, as the figures were measured so.
/// With 81 seeds the ratios are 0.99, 1.09, 1.00 and 0.99. With fewer they scatter: nine seeds of one robot came to
/// 0.78, so only all robots together are judged.
#[test]
fn construction_does_not_give_up_the_objectives() {
    let ratios = SYNTHETIC_ROBOTS.each_ref().map(|landscape| {
        let volumes = |exploration: Option<Exploration>| {
            let mut plan = plan(landscape, nsga2(), exploration);
            plan.campaign.copies = sesame_plan::Copies::MayOverlap;
            median((1..=27).map(|seed| reached_and_volume(landscape, &plan, 1.0, seed).1).collect())
        };
        volumes(Some(CONSTRUCT)) / volumes(None)
    });
    let product: f64 = ratios.iter().product();
    assert!(libm::pow(product, 0.25) > 0.9, "{ratios:?}");
}

#[test]
fn construction_ends_where_it_was_told_to_and_counts_cells_that_want_several_tests() {
    let mut covering = plan(&SYNTHETIC_ROBOTS[0], nsga2(), Some(Exploration::Construct { share: 1.0, until: None }));
    let covered = |plan: &CampaignPlan, needed| {
        let run = SYNTHETIC_ROBOTS[0].campaign(strategy(plan, 3).unwrap().as_mut());
        let mut coverage = Coverage::new(Grid::new(goal().axes).unwrap(), needed);
        run.tests.iter().filter_map(|result| result.point.as_ref()).for_each(|point| {
            coverage.add(point);
        });
        coverage.covered()
    };
    assert_eq!(covered(&covering, 1), 96, "every feasible cell");
    covering.campaign.coverage.as_mut().unwrap().hits = 2;
    assert!(covered(&covering, 2) >= 90, "two hits each with 210 tests");
}

#[test]
fn cells_that_construction_gives_up_are_named_with_the_reason() {
    // Four copies of the one operation lie one after the other: long ones cannot have their middles at one place.
    let mut copies = plan(&SYNTHETIC_ROBOTS[0], nsga2(), Some(Exploration::Construct { share: 1.0, until: None }));
    copies.campaign.copies = sesame_plan::Copies::Apart;
    let grid = Grid::parse("T2:0:0.25:2,T3:0:0.4:8").unwrap();
    copies.campaign.coverage = Some(CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
    copies.campaign.operations.truncate(1);
    copies.campaign.count = sesame_plan::Count { min: 4, max: 4 };
    let mut search = strategy(&copies, 3).unwrap();
    assert_eq!(search.given_up(), Vec::<String>::new());
    SYNTHETIC_ROBOTS[0].campaign(search.as_mut());
    let [why] = &search.given_up()[..] else { panic!("{:?}", search.given_up()) };
    assert!(why.starts_with("construction gave up ") && why.contains("T2 0.125–0.25, T3 0–0.05"), "{why}");
    assert!(why.contains("no test could be built, and there may be none: T2 "), "{why}");

    // A simulator on which nothing ever has an effect.
    let long = Search::new(Strategy::Nsga2 { population: 10 }, 400);
    let deaf = plan(&SYNTHETIC_ROBOTS[0], long, Some(Exploration::Construct { share: 1.0, until: None }));
    let mut search = strategy(&deaf, 3).unwrap();
    for number in 0..40 {
        let asked = search.ask();
        let told = asked.into_iter().map(|candidate| Evaluated {
            number,
            test: candidate.test,
            fitness: Fitness::Unfit(Unfit::Void),
            point: None,
            run: crate::testing::no_run(),
            fresh_runs: Vec::new(),
        });
        search.tell(&told.collect::<Vec<_>>());
    }
    let [why] = &search.given_up()[..] else { panic!("{:?}", search.given_up()) };
    assert!(why.starts_with("construction gave up 96 cells, for each of which three constructed tests had"), "{why}");
    assert!(why.ends_with("; and 76 more"), "{why}");
}

#[test]
fn the_seed_decides_and_results_told_again_bring_a_search_back_to_where_it_was() {
    let strategies = [
        (nsga2(), Some(FIXED)),
        (nsga2(), Some(LINEAR)),
        (nsga2(), Some(CONSTRUCT)),
        (Search::new(Strategy::MapElites { population: 10 }, 210), None),
        (Search::new(Strategy::LatinHypercube, 210), None),
        (Search::new(Strategy::Sobol, 210), None),
        (Search::new(Strategy::Grid { levels: 5 }, 210), None),
        (nsga2(), Some(Exploration::Novelty { neighbours: 10, over: sesame_plan::Dimension::ALL.to_vec() })),
    ];
    for (search, exploration) in strategies {
        let landscape = &SYNTHETIC_ROBOTS[1];
        let plan = plan(landscape, search, exploration);
        let whole = landscape.campaign(strategy(&plan, 8).unwrap().as_mut()).tests;
        assert_eq!(whole.len(), 210);
        assert_ne!(whole, landscape.campaign(strategy(&plan, 9).unwrap().as_mut()).tests);
        let mut resumed = strategy(&plan, 8).unwrap();
        let mut told = 0;
        loop {
            let asked: Vec<Test> = resumed.ask().into_iter().map(|candidate| candidate.test).collect();
            let stored = &whole[told..told + asked.len()];
            assert_eq!(asked, stored.iter().map(|result| result.test.clone()).collect::<Vec<_>>(), "{plan:?}");
            told += asked.len();
            if told > 100 {
                break;
            }
            resumed.tell(stored);
        }
    }
}

#[test]
fn strategies_without_what_they_work_on_are_refused() {
    let landscape = &SYNTHETIC_ROBOTS[0];
    let refusal = |plan: &CampaignPlan| strategy(plan, 1).err();
    let campaign = landscape.name.to_owned();
    let mut without = plan(landscape, nsga2(), Some(CONSTRUCT));
    without.campaign.coverage = None;
    assert_eq!(refusal(&without), Some(SearchError::NoCoverage { campaign: campaign.clone() }));
    without.campaign.exploration = None;
    assert_eq!(refusal(&without), None);
    without.campaign.search = Search::new(Strategy::MapElites { population: 10 }, 20);
    assert_eq!(refusal(&without), Some(SearchError::NoCoverage { campaign: campaign.clone() }));

    let end = sesame_plan::condition::ConditionEnd::Condition;
    let mut conditional = landscape.plan_by_condition(nsga2(), end);
    conditional.campaign.coverage = Some(goal());
    conditional.campaign.exploration = Some(FIXED);
    assert_eq!(refusal(&conditional), Some(SearchError::NotByTime { campaign: campaign.clone() }));
    conditional.campaign.exploration = None;
    conditional.campaign.search = Search::new(Strategy::LatinHypercube, 20);
    assert_eq!(refusal(&conditional), Some(SearchError::NotByTime { campaign: campaign.clone() }));
    let predicting = plan(landscape, nsga2(), Some(Exploration::Predict { candidates: 5 }));
    assert_eq!(refusal(&predicting), Some(SearchError::NotByCondition { campaign }));
}
