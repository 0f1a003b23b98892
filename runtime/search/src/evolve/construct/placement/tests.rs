use proptest::prelude::*;

use sesame_plan::{Count, Distribution, Drain, GridAxis, OperationKind, Search, Strategy};

use super::*;
use crate::coverage::Feasible;
use crate::space::test_space::tests::{any_timed_plan, broken_rule};
use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

fn table_3() -> Grid {
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    Grid::new(vec![axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6), axis(Dimension::P1, 1.0, 3)]).unwrap()
}

fn cell_of(plan: &CampaignPlan, grid: &Grid, test: &Test) -> Option<usize> {
    grid.cell_of(&Point::from_disturbances(&planned(plan, test)?, Convention::Ours)?)
}

/// Cells of a plan into which no test was constructed, and how many feasible ones there are.
fn not_reached(plan: &CampaignPlan, grid: &Grid, seed: u64) -> (Vec<Vec<u32>>, usize) {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let feasible = Feasible::from_plan(plan, grid);
    let placer = CellPlacer::new(test_space.clone(), grid.clone(), feasible.clone(), plan.campaign.copies);
    let mut stream = Stream::derive(seed, "test", &[]);
    let mut failed = Vec::new();
    for cell in (0..grid.len()).filter(|&cell| feasible.reaches(cell)) {
        let from = fresh_test(&test_space, &mut stream);
        match placer.place_in_cell(&from, cell, plan, &mut stream) {
            Some(test) => {
                assert_eq!(cell_of(plan, grid, &test), Some(cell));
                assert_eq!(broken_rule(plan, &test), None);
                assert!(plan.campaign.copies == Copies::MayOverlap || !overlaps(&test), "{test:?}");
            }
            None => failed.push(grid.place(cell)),
        }
    }
    (failed, feasible.count())
}

/// Whether copies of one operation are active at the same time.
fn overlaps(test: &Test) -> bool {
    let windows = test.operations.iter().filter_map(|operation| match operation.activation {
        Activation::Time { start, end } => Some((operation.operation, start, end)),
        _ => None,
    });
    let windows: Vec<(OperationId, f64, f64)> = windows.collect();
    windows.iter().enumerate().any(|(at, a)| windows[..at].iter().any(|b| a.0 == b.0 && a.1 < b.2 && b.1 < a.2))
}

/// Twelve operations of all classes, each with its own window, some with integers and some without a number.
fn twelve_operations() -> CampaignPlan {
    let mut plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
    plan.operations = (0..12usize)
        .map(|at| {
            let mut operation = plan.operations[at % plan.operations.len()].clone();
            operation.name = format!("operation{at}");
            operation.within.start = [0.0, 5.0, 10.0, 0.0][at % 4];
            operation.within.end = [65.0, 60.0, 70.0, 40.0, 65.0][at % 5];
            match at % 4 {
                0 => {}
                1 => operation.kind = OperationKind::PacketLoss,
                2 => {
                    operation.kind =
                        OperationKind::Latency { distribution: Distribution::Uniform, drain: Drain::Finish }
                }
                _ => {
                    operation.kind = OperationKind::Blackhole;
                    operation.parameters.clear();
                }
            }
            if at == 6
                && let Some(Domain::Number { low, high, integer, .. }) =
                    operation.parameters.first_mut().map(|parameter| &mut parameter.domain)
            {
                (*low, *high, *integer) = (0.0, 20.0, true);
            }
            operation
        })
        .collect();
    plan.campaign.operations = (0u32..12).map(OperationId).collect();
    plan.campaign.count = Count { min: 1, max: 5 };
    plan.campaign.copies = Copies::Apart;
    plan
}

/// Cells that contain random tests, most of them far from the middle: each test is a witness that its cell can be
/// reached.
fn witnessed(plan: &CampaignPlan, grid: &Grid, tests: u64) -> std::collections::BTreeSet<usize> {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let mut cells = std::collections::BTreeSet::new();
    for n in 0..tests {
        let mut stream = Stream::derive(n, "witness", &[]);
        let mut test = fresh_test(&test_space, &mut stream);
        let [like, place] = [0, 1].map(|_| stream.chance(0.6).then(|| stream.unit()));
        for operation in &mut test.operations {
            let kind = test_space.find(operation.operation).unwrap();
            let ActivationSpace::Time(window) = kind.activation else { panic!("by time") };
            let whole = window.high - window.low;
            let share = like.unwrap_or_else(|| stream.unit());
            let length = (whole * share * share).max(window.shortest).min(window.longest);
            let at = place.unwrap_or_else(|| [0.0, 1.0, stream.unit()][stream.below(3)]);
            let start = window.low + (whole - length) * (at + 0.05 * stream.normal()).clamp(0.0, 1.0);
            operation.activation = Activation::Time { start, end: (start + length).min(window.high) };
            for (choice, parameter_space) in operation.parameters.iter_mut().zip(&kind.parameters) {
                if let (true, ParameterSpace::Number(range, shape)) = (stream.chance(0.4), parameter_space) {
                    let high = stream.chance(0.5);
                    *choice = match shape {
                        sesame_plan::ChoiceKind::Value => {
                            Choice::Value { value: if high { range.high } else { range.low } }
                        }
                        sesame_plan::ChoiceKind::Range => {
                            Choice::Range { low: range.low, high: if high { range.high } else { range.low } }
                        }
                    };
                }
            }
        }
        if !overlaps(&test) {
            cells.extend(cell_of(plan, grid, &test));
        }
    }
    cells
}

/// Tries every `every`-th cell with a witness; returns the cells for which no test could be constructed from five fresh
/// ones, and how many cells were tried.
fn not_built(plan: &CampaignPlan, grid: &Grid, tests: u64, every: usize) -> (Vec<Vec<u32>>, usize, usize) {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let feasible = Feasible::from_plan(plan, grid);
    let witnessed = witnessed(plan, grid, tests);
    let placer = CellPlacer::new(test_space.clone(), grid.clone(), feasible.clone(), plan.campaign.copies);
    let mut stream = Stream::derive(5, "test", &[]);
    let tried: Vec<usize> = witnessed.iter().copied().step_by(every).collect();
    let mut failed = Vec::new();
    for &cell in &tried {
        assert!(feasible.reaches(cell), "a witness is in {:?}", grid.place(cell));
        let built =
            (0..5).find_map(|_| placer.place_in_cell(&fresh_test(&test_space, &mut stream), cell, plan, &mut stream));
        match built {
            Some(test) => {
                assert_eq!(cell_of(plan, grid, &test), Some(cell));
                assert_eq!(broken_rule(plan, &test), None);
                assert!(!overlaps(&test), "{test:?}");
            }
            None => failed.push(grid.place(cell)),
        }
    }
    (failed, tried.len(), feasible.count())
}

const FIVE_DIMENSIONS: [&str; 3] = [
    "T1:0:1:10,T2:0:0.5:10,T3:0:0.4:5,P1:0:1:5,P2:0:0.5:4",
    "T1:0:1:10,T2:0:0.5:10,P1:0:1:5,O0:0.5:5.5:5,O2:-0.5:3.5:4",
    "T1:0:1:10,T2:0:1:10,T3:0:0.5:5,O1:-0.5:3.5:4,O3:-0.5:4.5:5",
];

#[test]
fn tests_are_constructed_in_nearly_all_reachable_cells_of_five_dimensions() {
    for grid in FIVE_DIMENSIONS {
        let (failed, tried, _) = not_built(&twelve_operations(), &Grid::parse(grid).unwrap(), 6_000, 8);
        assert!(tried > 100 && failed.len() * 100 <= tried, "{} of {tried} of {grid}: {failed:?}", failed.len());
    }
}

#[test]
#[ignore = "long: a million tests as witnesses for three grids of 10,000 cells, and a test built for each cell they reach"]
fn tests_are_constructed_in_99_percent_of_the_cells_of_five_dimensions_that_a_million_tests_reach() {
    for grid in FIVE_DIMENSIONS {
        let (failed, tried, feasible) = not_built(&twelve_operations(), &Grid::parse(grid).unwrap(), 1_000_000, 1);
        println!("{grid}: {} of {tried} witnessed cells not built, {feasible} feasible: {failed:?}", failed.len());
        assert!(tried > 1_000 && failed.len() * 100 <= tried, "{} of {tried} of {grid}", failed.len());
    }
}

#[test]
fn copies_of_one_operation_are_constructed_disjoint_or_not_at_all() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    plan.campaign.operations.truncate(1);
    plan.campaign.count = Count { min: 1, max: 4 };
    plan.campaign.copies = Copies::Apart;
    let grid = Grid::parse("T1:0:1:6,T2:0:0.6:6,O0:0.5:4.5:4").unwrap();
    let (failed, feasible) = not_reached(&plan, &grid, 1);
    // None of four copies in one window can be longer than a quarter of it on average.
    let copies = |place: &Vec<u32>| f64::from(place[2] + 1);
    assert!(failed.iter().all(|place| place[2] > 0), "{failed:?}");
    let too_long = |place: &Vec<u32>| 0.1 * f64::from(place[1]) * copies(place) >= 1.0 - 1e-9;
    let possible = failed.iter().filter(|place| !too_long(place)).count();
    assert!(feasible > 60 && possible * 5 <= feasible, "{possible} of {feasible}: {failed:?}");
    assert!(!Feasible::from_plan(&plan, &grid).is_exact(), "cells that only copies reach are not certain");
    plan.campaign.copies = Copies::MayOverlap;
    assert_eq!(not_reached(&plan, &grid, 1).0, Vec::<Vec<u32>>::new());
    plan.campaign.copies = Copies::Once;
    let once = Feasible::from_plan(&plan, &grid);
    assert!((0..grid.len()).all(|cell| !once.reaches(cell) || grid.place(cell)[2] == 0));
}

#[test]
fn a_test_is_constructed_in_every_feasible_cell_of_the_papers_grid() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    for seed in 0..5 {
        assert_eq!(not_reached(&plan, &table_3(), seed), (Vec::new(), 96));
    }
}

#[test]
fn cells_over_counts_spreads_and_integers_are_reached() {
    let mut plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
    plan.campaign.count = Count { min: 1, max: 4 };
    plan.operations[0].kind = OperationKind::PacketLoss;
    plan.operations[1].kind = OperationKind::Latency { distribution: Distribution::Uniform, drain: Drain::Finish };
    plan.operations[2].kind = OperationKind::Blackhole;
    plan.operations[2].parameters.clear();
    if let Domain::Number { low, high, integer, .. } = &mut plan.operations[3].parameters[0].domain {
        (*low, *high, *integer) = (0.0, 20.0, true);
    }
    let axis = |dimension, low, high, cells| GridAxis { dimension, low, high, cells };
    let grid = Grid::new(vec![
        axis(Dimension::O0, 0.5, 4.5, 4),
        axis(Dimension::O2, -0.5, 2.5, 3),
        axis(Dimension::T1, 0.0, 1.0, 3),
        axis(Dimension::T3, 0.0, 0.4, 3),
        axis(Dimension::P2, 0.0, 0.5, 3),
    ])
    .unwrap();
    let (failed, feasible) = not_reached(&plan, &grid, 1);
    assert!(feasible > 100 && failed.len() * 50 <= feasible, "{} of {feasible}: {failed:?}", failed.len());
}

#[test]
fn a_test_made_of_given_numbers_keeps_the_operations_that_it_has() {
    let mut plan = SYNTHETIC_ROBOTS[2].plan(Search::new(Strategy::Random, 1));
    plan.campaign.count = Count { min: 2, max: 3 };
    let (grid, test_space) = (table_3(), TestSpace::from_plan(&plan).unwrap());
    let feasible = Feasible::from_plan(&plan, &grid);
    let placer = CellPlacer::new(test_space.clone(), grid, feasible, plan.campaign.copies);
    let kind: Vec<OperationId> = test_space.operations().iter().map(|kind| kind.operation).collect();
    assert!(kind.len() >= 3, "there is a fresh operation to add");
    let mut stream = Stream::derive(1, "test", &[]);
    for _ in 0..50 {
        let mut test = fresh_test(&test_space, &mut stream);
        test.operations.truncate(2);
        test.operations.dedup_by_key(|operation| operation.operation);
        let made = placer.made_of(&test, &[(&kind, 3)], &mut stream).unwrap();
        assert_eq!(made.operations.len(), 3, "{made:?}");
        assert!(test.operations.iter().all(|kept| made.operations.contains(kept)), "{test:?} became {made:?}");
    }
}

#[test]
fn a_test_in_the_cell_changes_little_and_other_tests_keep_middles_and_numbers() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Strategy::Random, 1));
    // Disjoint copies leave less room, so some may have to be removed.
    plan.campaign.copies = Copies::MayOverlap;
    let (grid, test_space) = (table_3(), TestSpace::from_plan(&plan).unwrap());
    let feasible = Feasible::from_plan(&plan, &grid);
    let placer = CellPlacer::new(test_space.clone(), grid.clone(), feasible.clone(), plan.campaign.copies);
    let mut stream = Stream::derive(4, "test", &[]);
    for _ in 0..50 {
        let test = fresh_test(&test_space, &mut stream);
        let cell = (0..grid.len()).filter(|&cell| feasible.reaches(cell)).nth(stream.below(feasible.count())).unwrap();
        let built = placer.place_in_cell(&test, cell, &plan, &mut stream).unwrap();
        let kinds = |test: &Test| test.operations.iter().map(|operation| operation.operation).collect::<Vec<_>>();
        assert_eq!(kinds(&built), kinds(&test), "the cell does not count operations");
        for (before, after) in test.operations.iter().zip(&built.operations) {
            let [Choice::Range { low: a, high: b }, Choice::Range { low: c, high: d }] =
                [&before.parameters[0], &after.parameters[0]]
            else {
                panic!("offsets are sub-ranges")
            };
            // Narrower sub-ranges keep their middle; wider ones may lack the room.
            if d - c <= b - a {
                assert!((f64::midpoint(*a, *b) - f64::midpoint(*c, *d)).abs() < 1e-9);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn constructed_tests_are_permitted_and_lie_in_their_cell(plan in any_timed_plan(), seed: u64) {
        let grid = Grid::parse("T1:0:1:3,T2:0:1:3,P1:0:1:2,O0:0.5:4.5:2").unwrap();
        // The number of reached cells is tested with the robots above: with very different windows and with integers,
        // some cells can be reached in one way only, which attempts need not find.
        not_reached(&plan, &grid, seed);
    }
}
