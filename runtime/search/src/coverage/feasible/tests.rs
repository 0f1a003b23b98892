use proptest::prelude::*;

use sesame_plan::{
    Choice, Copies, Count, Dimension, Distribution, Drain, Lengths, OperationKind, Search, Test, ValueMode,
};
use sesame_rng::Stream;

use super::*;
use crate::space::initial::fresh_test;
use crate::space::test_space::OperationSpace;
use crate::space::test_space::tests::any_timed_plan;
use crate::sspr::{Convention, Point, planned};
use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

fn point(plan: &CampaignPlan, test: &Test) -> Point {
    let disturbances = planned(plan, test).expect("tests are active by time");
    Point::from_disturbances(&disturbances, Convention::Ours).expect("windows begin before the campaign's end")
}

/// The permitted window of an operation by time.
fn window_of(kind: &OperationSpace) -> Range {
    match kind.activation {
        ActivationSpace::Time(window) => window,
        _ => panic!("by time: {kind:?}"),
    }
}

/// The cells that random tests find, most of them far from the middle: windows short or long, values at their ends.
/// Points on the edge of a cell do not count: copies of one operation that are moved apart may lie exactly there.
fn found(plan: &CampaignPlan, grid: &Grid, tests: u64) -> BTreeSet<usize> {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let mut cells = BTreeSet::new();
    for n in 0..tests {
        let mut stream = Stream::derive(n, "sample", &[]);
        let mut test = fresh_test(&test_space, &mut stream);
        let same = stream.chance(0.5).then(|| stream.unit());
        for operation in &mut test.operations {
            let kind = test_space.find(operation.operation).unwrap();
            if stream.chance(0.7) {
                let window = window_of(kind);
                let whole = window.high - window.low;
                let share = same.unwrap_or_else(|| stream.unit());
                let length = (whole * share * share).max(window.shortest).min(window.longest);
                let start = window.low + (whole - length) * [0.0, 1.0, stream.unit()][stream.below(3)];
                operation.activation = sesame_plan::Activation::Time { start, end: (start + length).min(window.high) };
            }
            for (choice, parameter_space) in operation.parameters.iter_mut().zip(&kind.parameters) {
                *choice = match (stream.below(4), parameter_space) {
                    (0, ParameterSpace::Number(range, ChoiceKind::Value)) => Choice::Value { value: range.low },
                    (0, ParameterSpace::Number(range, ChoiceKind::Range)) => {
                        Choice::Range { low: range.low, high: range.low }
                    }
                    (1, ParameterSpace::Number(range, ChoiceKind::Value)) => Choice::Value { value: range.high },
                    (1, ParameterSpace::Number(range, ChoiceKind::Range)) => {
                        Choice::Range { low: range.low, high: range.high }
                    }
                    (0, ParameterSpace::Point(axes)) => Choice::Point { point: axes.map(|axis| axis.low) },
                    (1, ParameterSpace::Point(axes)) => Choice::Point { point: axes.map(|axis| axis.high) },
                    _ => parameter_space.fresh(&mut stream),
                };
            }
        }
        test_space.settle(&mut test, &mut stream);
        let point = point(plan, &test);
        cells.extend(grid.cell_of(&point).filter(|&cell| !is_on_an_edge(&point, grid, cell)));
    }
    cells
}

/// Whether a point lies on a side of its cell. Numbers of operations do not count here: they are whole, so tests lie on
/// such sides as a rule.
fn is_on_an_edge(point: &Point, grid: &Grid, cell: usize) -> bool {
    let counts = [Dimension::O0, Dimension::O1, Dimension::O2, Dimension::O3];
    grid.axes().iter().zip(grid.place(cell)).filter(|(axis, _)| !counts.contains(&axis.dimension)).any(|(axis, at)| {
        let (low, high) = Grid::bounds(axis, at);
        point.get(axis.dimension).is_some_and(|value| (value - low).abs().min((value - high).abs()) < MARGIN)
    })
}

/// Whether a climber finds a test in a cell: it moves what a test chooses until the point's distance to the cell is
/// none.
fn climbs_into(plan: &CampaignPlan, grid: &Grid, cell: usize) -> bool {
    let test_space = TestSpace::from_plan(plan).unwrap();
    let place = grid.place(cell);
    let outside = |test: &Test| {
        let point = point(plan, test);
        let axes = grid.axes().iter().zip(&place);
        let distances = axes.map(|(axis, &at)| {
            let (low, high) = Grid::bounds(axis, at);
            let Some(value) = point.get(axis.dimension) else { return 9.0 };
            // The upper end is not inside.
            (low - value).max(value - high + 1e-12).max(0.0)
        });
        distances.sum::<f64>()
    };
    let steps = crate::space::range::StepSizes { finest: 0.001, boldest: 0.4 };
    for start in 0..150 {
        let mut stream = Stream::derive(start, "climb", &[cell as u64]);
        let mut test = fresh_test(&test_space, &mut stream);
        let mut now = outside(&test);
        for _ in 0..400 {
            if now == 0.0 {
                return true;
            }
            let mut other = test.clone();
            let moved = 1 + stream.below(2);
            for _ in 0..moved {
                let at = stream.below(other.operations.len());
                let operation = &mut other.operations[at];
                let kind = test_space.find(operation.operation).unwrap();
                if stream.chance(0.5) || kind.parameters.is_empty() {
                    let sesame_plan::Activation::Time { start, end } = operation.activation else { panic!("by time") };
                    let (start, end) = window_of(kind).interval_near((start, end), steps, &mut stream);
                    operation.activation = sesame_plan::Activation::Time { start, end };
                } else {
                    let which = stream.below(kind.parameters.len());
                    operation.parameters[which] =
                        kind.parameters[which].near(&operation.parameters[which], steps, &mut stream);
                }
            }
            test_space.settle(&mut other, &mut stream);
            let then = outside(&other);
            if then <= now {
                (test, now) = (other, then);
            }
        }
    }
    false
}

/// Campaigns as in other tests, with kinds of all classes, every operation as likely as another, and few per test.
fn campaigns() -> impl Strategy<Value = CampaignPlan> {
    let lengths = (0.0..0.3f64, 0.05..0.7f64);
    let lengths = prop_oneof![Just(None), Just(None), lengths.prop_map(Some)];
    (any_timed_plan(), 1u32..4, any::<bool>(), lengths).prop_map(|(mut plan, most, alike, lengths)| {
        let kinds = [
            OperationKind::PacketLoss,
            OperationKind::RandomValue { mode: ValueMode::Offset, integer: false },
            OperationKind::Latency { distribution: Distribution::Uniform, drain: Drain::Finish },
        ];
        for (operation, kind) in plan.operations.iter_mut().zip(kinds.into_iter().cycle()) {
            operation.kind = kind;
            operation.inclusion = 0.5;
        }
        if alike {
            let within = plan.operations[0].within;
            plan.operations.iter_mut().for_each(|operation| operation.within = within);
        }
        for operation in plan.operations.iter_mut().filter(|operation| !operation.kind.is_offline()) {
            let room = operation.within.end.min(plan.campaign.end_after) - operation.within.start;
            operation.lengths = lengths
                .filter(|_| room > 0.0)
                .map(|(low, more)| Lengths { low: low * room, high: (low + more) * room });
        }
        let min = plan.campaign.count.min.min(most);
        plan.campaign.count = Count { min, max: most };
        plan
    })
}

/// Grids over a few dimensions, coarse enough for a climber.
fn grids() -> impl Strategy<Value = Grid> {
    let axis = |dimension: Dimension| {
        let high = match dimension {
            Dimension::T1 | Dimension::T2 | Dimension::P1 => 1.0,
            Dimension::T3 | Dimension::P2 => 0.5,
            Dimension::O0 | Dimension::O1 | Dimension::O2 | Dimension::O3 => 4.0,
        };
        (1u32..4).prop_map(move |cells| GridAxis { dimension, low: 0.0, high, cells })
    };
    let chosen = prop::sample::subsequence(Dimension::ALL.to_vec(), 1..4);
    chosen
        .prop_flat_map(move |dimensions| dimensions.into_iter().map(axis).collect::<Vec<_>>())
        .prop_map(|axes| Grid::new(axes).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn random_tests_find_feasible_cells_only(plan in campaigns(), grid in grids()) {
        let feasible = Feasible::from_plan(&plan, &grid);
        for cell in found(&plan, &grid, 400) {
            prop_assert!(feasible.reaches(cell), "{:?}", grid.place(cell));
        }
        let loose = Feasible::compute(&plan, &grid, false, MARGIN);
        prop_assert!((0..grid.len()).all(|cell| loose.reaches(cell) || !feasible.reaches(cell)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_cell_that_is_clearly_feasible_is_found(plan in campaigns(), grid in grids()) {
        let clearly = Feasible::with_margin(&plan, &grid, 0.03);
        if clearly.is_exact() {
            let found = found(&plan, &grid, 800);
            for cell in (0..grid.len()).filter(|cell| clearly.reaches(*cell) && !found.contains(cell)) {
                prop_assert!(climbs_into(&plan, &grid, cell), "{:?} of {:?}", grid.place(cell), grid);
            }
        }
    }
}

fn table_3() -> Grid {
    Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap()
}

#[test]
fn windows_of_two_seconds_reach_the_cells_of_short_windows_only() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    let grid = Grid::parse("T1:0:1:4,T2:0:1:65").unwrap();
    let lengths = |plan: &CampaignPlan| {
        let feasible = Feasible::from_plan(plan, &grid);
        assert!(feasible.is_exact());
        let reached = (0..grid.len()).filter(|&cell| feasible.reaches(cell)).map(|cell| cell % 65);
        reached.collect::<BTreeSet<usize>>().len()
    };
    plan.campaign.copies = Copies::MayOverlap;
    assert_eq!(lengths(&plan), 65);
    let bounded = |plan: &mut CampaignPlan, low, high| {
        plan.operations.iter_mut().for_each(|operation| operation.lengths = Some(Lengths { low, high }));
    };
    // Cells are one second wide.
    bounded(&mut plan, 0.0, 2.0);
    assert_eq!(lengths(&plan), 2);
    bounded(&mut plan, 2.5, 2.5);
    assert_eq!(lengths(&plan), 1, "one length is in one cell");
}

#[test]
fn of_the_papers_108_cells_96_can_be_reached() {
    let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    // Tests end after the windows do, or the last midpoints could not be reached.
    assert!(plan.campaign.end_after >= 65.0);
    let feasible = Feasible::from_plan(&plan, &table_3());
    assert_eq!((feasible.count(), feasible.is_exact()), (96, true));
    // An interval of a third of the window or more has no midpoint in the first sixth of it.
    let cell = |t1: usize, t2: usize, p1: usize| (t1 * 6 + t2) * 3 + p1;
    assert!(feasible.reaches(cell(0, 3, 2)) && !feasible.reaches(cell(0, 4, 2)));
    assert!(feasible.reaches(cell(5, 3, 0)) && !feasible.reaches(cell(5, 4, 0)));
}

#[test]
fn a_campaign_that_ends_early_reaches_less() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    plan.campaign.end_after = 32.5;
    let feasible = Feasible::from_plan(&plan, &Grid::parse("T1:0:1:4,O0:0.5:6.5:6").unwrap());
    let reached: Vec<usize> = (0..24).filter(|&cell| feasible.reaches(cell)).collect();
    // The first two quarters, with one to five operations.
    assert_eq!(reached, [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]);
}

#[test]
fn one_operation_has_no_spread_and_five_have_some() {
    let grid = Grid::parse("T3:0:0.5:5,P2:0:0.5:5,O0:0.5:5.5:5").unwrap();
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    let feasible = Feasible::from_plan(&plan, &grid);
    let alone: Vec<Vec<u32>> = (0..grid.len()).filter(|&c| feasible.reaches(c)).map(|c| grid.place(c)).collect();
    assert!(alone.iter().filter(|place| place[2] == 0).eq([&vec![0, 0, 0]]));
    assert!(alone.contains(&vec![4, 4, 1]), "two at the ends of the window, one parameter at each end");
    // The greatest deviation of three numbers in 0..=1 is the square root of 2/9.
    assert!(alone.contains(&vec![4, 4, 2]));
    plan.campaign.count = Count { min: 1, max: 1 };
    assert_eq!(Feasible::from_plan(&plan, &grid).count(), 1);
}

#[test]
fn whole_numbers_reach_the_values_they_have() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    for operation in &mut plan.operations {
        let parameter = &mut operation.parameters[0];
        parameter.domain = Domain::Number { low: 0.0, high: 2.0, shape: ChoiceKind::Value, integer: true };
    }
    plan.campaign.count = Count { min: 1, max: 2 };
    // Cells around 0, 1/4, 1/2, 3/4 and 1, with the eighths between them.
    let grid = Grid::parse("P1:-0.0625:1.0625:9,O0:0.5:2.5:2").unwrap();
    let feasible = Feasible::from_plan(&plan, &grid);
    let reached: Vec<Vec<u32>> = (0..grid.len()).filter(|&c| feasible.reaches(c)).map(|c| grid.place(c)).collect();
    let of = |count: u32| reached.iter().filter(|place| place[1] == count).map(|place| place[0]).collect::<Vec<_>>();
    assert_eq!((of(0), of(1)), (vec![0, 4, 8], vec![0, 2, 4, 6, 8]));
    assert!(feasible.is_exact());
}

#[test]
fn very_many_kinds_of_operations_make_no_cell_infeasible() {
    assert_eq!(mixtures(30, 1, 20), None);
    assert_eq!(mixtures(2, 1, 2).unwrap(), [vec![0, 1], vec![0, 2], vec![1, 0], vec![1, 1], vec![2, 0]]);
}

#[test]
fn windows_of_copies_that_lie_apart_are_as_long_together_as_one() {
    let mut plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Random, 1));
    let grid = Grid::parse("T2:0:1:10,O0:0.5:5.5:5").unwrap();
    let longest = |plan: &CampaignPlan, count: usize| {
        let feasible = Feasible::from_plan(plan, &grid);
        (0..10).filter(|t2| feasible.reaches(t2 * 5 + count - 1)).max().map(|t2| t2 + 1)
    };
    assert_eq!([1, 2, 3, 4, 5].map(|n| longest(&plan, n)), [Some(10); 5]);
    // Two operations: three or more have two whole windows together.
    plan.campaign.copies = Copies::Apart;
    assert_eq!([1, 2, 3, 4, 5].map(|n| longest(&plan, n)), [10, 10, 7, 6, 5].map(Some));
    assert!(!Feasible::from_plan(&plan, &grid).is_exact());
    // What one operation alone reaches is certain.
    assert_eq!(
        (Feasible::from_plan(&plan, &table_3()).count(), Feasible::from_plan(&plan, &table_3()).is_exact()),
        (96, true)
    );
    plan.campaign.copies = Copies::Once;
    assert_eq!([1, 2, 3, 4, 5].map(|n| longest(&plan, n)), [Some(10), Some(10), None, None, None]);
    assert!(Feasible::from_plan(&plan, &grid).is_exact());
}
