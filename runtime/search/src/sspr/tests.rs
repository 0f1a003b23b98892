#![expect(
    clippy::disallowed_methods,
    reason = "independent of the code that is tested, and compared within tolerances"
)]

use proptest::prelude::*;

use sesame_plan::{
    Activation, CampaignPlan, Choice, ChoiceKind, Dimension, Distribution, Domain, Drain, Operation, OperationKind,
    Span, Test,
};
use sesame_rng::Stream;

use super::*;
use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;
use crate::space::test_space::tests::any_timed_plan;

fn disturbance(class: Class, intervals: &[(f64, f64)], parameters: &[Intensity]) -> Disturbance {
    Disturbance {
        class,
        window: Span { start: 10.0, end: 110.0 },
        intervals: intervals.iter().map(|&(start, end)| Span { start, end }).collect(),
        parameters: parameters.to_vec(),
    }
}

fn range(low: f64, high: f64) -> Intensity {
    Intensity { permitted: (-1.0, 1.0), chosen: (low, high), shape: ChoiceKind::Range }
}

fn value(value: f64) -> Intensity {
    Intensity { permitted: (0.2, 1.2), chosen: (value, value), shape: ChoiceKind::Value }
}

fn coordinates(point: &Point) -> Vec<Option<f64>> {
    Dimension::ALL.map(|dimension| point.get(dimension)).to_vec()
}

fn assert_close(point: &Point, expected: [Option<f64>; 9]) {
    for ((found, expected), dimension) in coordinates(point).iter().zip(expected).zip(Dimension::ALL) {
        match (found, expected) {
            (Some(found), Some(expected)) => assert!((found - expected).abs() < 1e-12, "{dimension:?}: {found}"),
            (found, expected) => assert_eq!(*found, expected, "{dimension:?}"),
        }
    }
}

#[test]
fn a_test_worked_out_by_hand_has_the_point_of_each_convention() {
    let test = [
        // Shares 0.1 to 0.3: midpoint 0.2, length 0.2.
        disturbance(Class::Value, &[(20.0, 40.0)], &[range(-0.2, 0.4)]),
        // Shares 0.5 to 0.9: midpoint 0.7, length 0.4.
        disturbance(Class::Loss, &[(60.0, 100.0)], &[value(0.7)]),
        // Active twice: midpoints 0.1 and 1.0 - 0.05, lengths 0.2 and 0.1.
        disturbance(Class::Delay, &[(10.0, 30.0), (100.0, 110.0)], &[value(0.4)]),
    ];
    let (t1, t2) = (1.95 / 4.0, 0.9 / 4.0);
    let t3 = ((0.2f64 - t1).powi(2) + (0.7 - t1).powi(2) + (0.1 - t1).powi(2) + (0.95 - t1).powi(2)) / 4.0;
    let timing = [Some(t1), Some(t2), Some(t3.sqrt())];
    let [a, b, c] = timing;
    // Normalised: a third of the range wide, and half and a fifth of the way from 0.2 to 1.2.
    let p1 = (0.3 + 0.5 + 0.2) / 3.0;
    let variance = |values: [f64; 3]| {
        let mean = values.iter().sum::<f64>() / 3.0;
        values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 3.0
    };
    let counts = |o2: f64, o3: f64| [Some(3.0), Some(1.0), Some(o2), Some(o3)];
    let [o0, o1, o2, o3] = counts(1.0, 1.0);
    let ours = Point::from_disturbances(&test, Convention::Ours).unwrap();
    let p2 = variance([0.3, 0.5, 0.2]).sqrt();
    assert_close(&ours, [a, b, c, Some(p1), Some(p2), o0, o1, o2, o3]);
    // The probability to lose is half of the way up, so that to keep is half of the way too.
    let original = Point::from_disturbances(&test, Convention::Original).unwrap();
    assert_close(&original, [a, b, c, Some(p1), Some(variance([0.3, 0.5, 0.2])), o0, o1, o2, o3]);
    let paper = Point::from_disturbances(&test, Convention::Paper).unwrap();
    let (mean, spread) = ((0.3 + 0.7 + 0.4) / 3.0, variance([0.3, 0.7, 0.4]).sqrt());
    assert_close(&paper, [a, b, c, Some(mean), Some(spread), o0, o1, o2, o3]);
}

#[test]
fn the_original_swaps_losses_and_delays_and_counts_what_is_kept() {
    let losses = [
        disturbance(Class::Loss, &[(20.0, 40.0)], &[value(0.3)]),
        disturbance(Class::Loss, &[(20.0, 40.0)], &[]),
        disturbance(Class::Delay, &[(20.0, 40.0)], &[]),
        disturbance(Class::Other, &[(20.0, 40.0)], &[]),
    ];
    let get = |convention, dimension| Point::from_disturbances(&losses, convention).unwrap().get(dimension).unwrap();
    assert_eq!([get(Convention::Ours, Dimension::O2), get(Convention::Ours, Dimension::O3)], [2.0, 1.0]);
    assert_eq!([get(Convention::Original, Dimension::O2), get(Convention::Original, Dimension::O3)], [1.0, 2.0]);
    assert_eq!(get(Convention::Ours, Dimension::O0), 4.0);
    assert!((get(Convention::Ours, Dimension::P1) - 0.1).abs() < 1e-12);
    assert!((get(Convention::Original, Dimension::P1) - 0.9).abs() < 1e-12);
}

#[test]
fn the_original_counts_custom_operations_but_not_their_parameters() {
    let custom = || disturbance(Class::Other, &[(20.0, 40.0)], &[value(0.7)]);
    let shifted = disturbance(Class::Value, &[(20.0, 40.0)], &[range(-0.2, 0.4)]);
    let of = |test: &[Disturbance], dimension| {
        [Convention::Ours, Convention::Original]
            .map(|convention| Point::from_disturbances(test, convention).unwrap().get(dimension))
    };
    let both = [shifted, custom()];
    let [ours, original] = of(&both, Dimension::P1).map(Option::unwrap);
    assert!((ours - 0.4).abs() < 1e-12 && (original - 0.3).abs() < 1e-12, "{ours} {original}");
    assert_eq!(of(&both, Dimension::P2)[1], Some(0.0));
    assert_eq!(of(&both, Dimension::O0), [Some(2.0); 2]);
    assert_eq!(of(&[custom()], Dimension::P1)[1], None);
}

#[test]
fn what_was_never_active_is_no_part_of_the_point() {
    let active = disturbance(Class::Value, &[(20.0, 40.0)], &[range(0.0, 1.0)]);
    let idle = disturbance(Class::Loss, &[], &[value(1.2)]);
    let both = Point::from_disturbances(&[idle.clone(), active.clone()], Convention::Ours);
    assert_eq!(both, Point::from_disturbances(&[active], Convention::Ours));
    assert_eq!(Point::from_disturbances(&[idle], Convention::Ours), None);
    assert_eq!(Point::from_disturbances(&[], Convention::Ours), None);
}

#[test]
fn a_test_without_parameters_has_no_intensity() {
    let fixed = Intensity { permitted: (0.5, 0.5), chosen: (0.5, 0.5), shape: ChoiceKind::Value };
    let point =
        Point::from_disturbances(&[disturbance(Class::Loss, &[(20.0, 40.0)], &[fixed])], Convention::Ours).unwrap();
    assert_eq!(point.get(Dimension::P1), None);
    assert_eq!(point.get(Dimension::P2), None);
    assert_eq!(distance(&point, &point, &[Dimension::T1], 1.0), Some(0.0));
    assert_eq!(distance(&point, &point, &[Dimension::P1], 1.0), None);
}

#[test]
fn a_planned_window_is_cut_at_the_end_of_the_campaign() {
    let mut plan = sesame_plan::testing::plan(vec![sesame_plan::testing::operation(0, OperationKind::Blackhole)]);
    plan.campaign.end_after = 8.0;
    let test = |start, end| Test {
        operations: vec![sesame_plan::TestOperation {
            operation: sesame_plan::OperationId(0),
            activation: Activation::Time { start, end },
            parameters: Vec::new(),
            operation_seed: 0,
            messages: None,
        }],
    };
    let cut = planned(&plan, &test(6.0, 9.0)).unwrap();
    assert_eq!(cut[0].intervals, [Span { start: 6.0, end: 8.0 }]);
    assert_eq!(planned(&plan, &test(8.5, 9.0)).unwrap()[0].intervals, []);
}

/// The reduction again, straight from its definition: sums over all intervals and parameters, one dimension at a time.
fn naive(plan: &CampaignPlan, test: &Test, dimension: Dimension) -> Option<f64> {
    let (mut midpoints, mut lengths, mut parameters, mut counts) = (vec![], vec![], vec![], [0.0; 4]);
    for used in &test.operations {
        let operation: &Operation = plan.operation(used.operation);
        let Activation::Time { start, end } = used.activation else { panic!("by time") };
        let end = end.min(plan.campaign.end_after);
        let (s, e) = (operation.within.start, operation.within.end);
        midpoints.push((start + end - 2.0 * s) / (e - s) / 2.0);
        lengths.push((end - start) / (e - s));
        counts[0] += 1.0;
        counts[match operation.kind {
            OperationKind::RandomValue { .. } => 1,
            OperationKind::PacketLoss | OperationKind::Blackhole => 2,
            OperationKind::Latency { .. } => 3,
            _ => panic!("none here"),
        }] += 1.0;
        for (choice, parameter) in used.parameters.iter().zip(&operation.parameters) {
            let mut part = |low: f64, high: f64, part: f64| {
                if low != high {
                    parameters.push(part / (high - low));
                }
            };
            match (&parameter.domain, choice) {
                (Domain::Number { low, high, .. }, Choice::Value { value }) => part(*low, *high, value - low),
                (Domain::Number { low, high, .. }, Choice::Range { low: from, high: to }) => {
                    part(*low, *high, to - from);
                }
                (Domain::Point { low, high }, Choice::Point { point }) => {
                    (0..3).for_each(|axis| part(low[axis], high[axis], point[axis] - low[axis]));
                }
                (Domain::Texts { .. } | Domain::Files { .. }, _) => {}
                other => panic!("{other:?}"),
            }
        }
    }
    let moment = |of: &[f64], power: i32| of.iter().map(|x| x.powi(power)).sum::<f64>() / of.len() as f64;
    let spread = |of: &[f64]| (moment(of, 2) - moment(of, 1).powi(2)).max(0.0).sqrt();
    let some = |of: &[f64]| (!of.is_empty()).then_some(());
    match dimension {
        Dimension::T1 => Some(moment(&midpoints, 1)),
        Dimension::T2 => Some(moment(&lengths, 1)),
        Dimension::T3 => Some(spread(&midpoints)),
        Dimension::P1 => some(&parameters).map(|()| moment(&parameters, 1)),
        Dimension::P2 => some(&parameters).map(|()| spread(&parameters)),
        Dimension::O0 => Some(counts[0]),
        Dimension::O1 => Some(counts[1]),
        Dimension::O2 => Some(counts[2]),
        Dimension::O3 => Some(counts[3]),
    }
}

proptest! {
    #[test]
    fn planned_tests_have_the_point_of_the_definition(mut plan in any_timed_plan(), seed: u64) {
        let kinds = [
            OperationKind::PacketLoss,
            OperationKind::Blackhole,
            OperationKind::Latency { distribution: Distribution::Uniform, drain: Drain::Finish },
            OperationKind::RandomValue { mode: sesame_plan::ValueMode::Offset, integer: false },
        ];
        for (operation, kind) in plan.operations.iter_mut().zip(kinds.into_iter().cycle()) {
            operation.kind = kind;
        }
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let test = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[]));
        let point = Point::from_disturbances(&planned(&plan, &test).unwrap(), Convention::Ours).unwrap();
        for dimension in Dimension::ALL {
            match (point.get(dimension), naive(&plan, &test, dimension)) {
                // A difference of squares loses half of the digits.
                (Some(a), Some(b)) => prop_assert!((a - b).abs() < 1e-7, "{:?}: {} and {}", dimension, a, b),
                (a, b) => prop_assert_eq!(a, b, "{:?}", dimension),
            }
        }
    }

    #[test]
    fn distances_are_a_metric_over_any_dimensions(plan in any_timed_plan(), seed: u64, chosen in 1usize..512) {
        let test_space = TestSpace::from_plan(&plan).unwrap();
        let point = |n| {
            let test = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[n]));
            Point::from_disturbances(&planned(&plan, &test).unwrap(), Convention::Ours)
        };
        let [Some(a), Some(b), Some(c)] = [point(0), point(1), point(2)] else { return Ok(()) };
        let over: Vec<Dimension> = (0..9).filter(|bit| chosen >> bit & 1 == 1).map(|bit| Dimension::ALL[bit]).collect();
        let most = test_space.most() as f64;
        let (Some(ab), Some(bc), Some(ac)) =
            (distance(&a, &b, &over, most), distance(&b, &c, &over, most), distance(&a, &c, &over, most))
        else {
            return Ok(());
        };
        prop_assert_eq!(distance(&a, &a, &over, most), Some(0.0));
        prop_assert_eq!(Some(ab), distance(&b, &a, &over, most));
        prop_assert!(ac <= ab + bc + 1e-12);
        // Every coordinate is a share, so no distance is longer than the unit cube's diagonal.
        prop_assert!(ab <= (over.len() as f64).sqrt() + 1e-12);
    }
}
