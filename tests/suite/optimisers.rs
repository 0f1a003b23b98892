//! The search compared with other implementations of NSGA-II: what they reach on published problems, and how they sort.

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;

use sesame_optimise::crowding::distances;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::hypervolume::hypervolume;
use sesame_optimise::igd::{Scaling, igd, igd_plus};
use sesame_optimise::problems::{Problem, approximate};
use sesame_optimise::sorting::fronts;
use sesame_tests::optimisers::{Distance, Distant, ManyObjectives, PYTHON, Ran, Run, Sort, Sorted, ask};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=5;

fn volume(problem: Problem, front: &[Vec<f64>]) -> f64 {
    let points: Vec<&[f64]> = front.iter().map(Vec::as_slice).collect();
    hypervolume(&points, problem.reference())
}

/// The least and the greatest.
fn band(volumes: &[f64]) -> (f64, f64) {
    volumes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

fn median(mut volumes: Vec<f64>) -> f64 {
    volumes.sort_by(f64::total_cmp);
    volumes[volumes.len() / 2]
}

#[test]
#[ignore = "long: needs Python's pygmo and pymoo"]
fn hypervolumes_of_published_problems_are_within_the_bands_of_pygmo_and_pymoo() {
    let (population, evaluations) = (100, 25_000);
    for problem in Problem::ALL {
        let requests: Vec<Run> = ["pygmo", "pymoo"]
            .into_iter()
            .flat_map(|library| {
                SEEDS.map(move |seed| Run { library, problem: problem.name(), population, evaluations, seed })
            })
            .collect();
        let Some(theirs) = ask::<Run, Ran>(&requests) else {
            println!("skipped: {PYTHON} names no Python with pygmo and pymoo");
            assert!(std::env::var_os("CI").is_none(), "CI has Python, so it has them");
            return;
        };
        let theirs: Vec<f64> = theirs.iter().map(|ran| volume(problem, &ran.front)).collect();
        let ours: Vec<f64> =
            SEEDS.map(|seed| volume(problem, &approximate(problem, population, evaluations, seed))).collect();
        let ((low, high), exact) = (band(&theirs), problem.exact_hypervolume());
        println!("{}: ours {:?}, theirs {low:.4} to {high:.4}, exact {exact:.4}", problem.name(), band(&ours));
        // As much again as the band is wide, since five seeds do not show all of it.
        let margin = (high - low).max(0.0005);
        let middle = median(ours.clone());
        assert!((low - margin..=exact).contains(&middle), "{}: {ours:?} beside {theirs:?}", problem.name());
        if problem == Problem::Zdt1 {
            assert!(middle >= 0.869, "{ours:?}");
        }
    }
}

/// The mean distance of a population to the unit sphere, which is the front of DTLZ2, and its hypervolume.
fn nsga3_quality(population: &[Vec<f64>]) -> (f64, f64) {
    let points: Vec<&[f64]> = population.iter().map(Vec::as_slice).collect();
    let distance = |point: &Vec<f64>| (point.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs();
    let distances = population.iter().map(distance).sum::<f64>() / population.len() as f64;
    (distances, hypervolume(&points, &vec![1.1; population[0].len()]))
}

#[test]
#[ignore = "long: needs Python's pymoo"]
fn nsga3_reaches_on_dtlz2_with_three_and_five_objectives_what_that_of_pymoo_reaches() {
    for many in ManyObjectives::ALL {
        let problem = many.problem;
        let requests: Vec<Run> = SEEDS.map(|seed| many.request(seed)).collect();
        let Some(theirs) = ask::<Run, Ran>(&requests) else {
            println!("skipped: {PYTHON} names no Python with pymoo");
            assert!(std::env::var_os("CI").is_none(), "CI has Python, so it has it");
            return;
        };
        let theirs: Vec<(f64, f64)> = theirs.iter().map(|ran| nsga3_quality(&ran.front)).collect();
        let ours: Vec<(f64, f64)> = SEEDS.map(|seed| nsga3_quality(&many.approximated(seed))).collect();
        let volumes = |of: &[(f64, f64)]| of.iter().map(|(_, volume)| *volume).collect::<Vec<_>>();
        let (low, high) = band(&volumes(&theirs));
        let distances = |of: &[(f64, f64)]| median(of.iter().map(|(distance, _)| *distance).collect());
        println!(
            "{problem}: ours {:?} at {:.4}, theirs {low:.4} to {high:.4} at {:.4}",
            band(&volumes(&ours)),
            distances(&ours),
            distances(&theirs)
        );
        let margin = (high - low).max(0.005);
        assert!(median(volumes(&ours)) >= low - margin, "{ours:?} beside {theirs:?}");
        assert!(distances(&ours) <= 2.0 * distances(&theirs) + 0.002, "{ours:?} beside {theirs:?}");
    }
}

#[test]
#[ignore = "long: needs Python's pymoo"]
fn fronts_and_crowding_distances_are_those_of_pymoo_on_random_and_tied_points() {
    let any_value = prop_oneof![(0i32..5).prop_map(f64::from), 0.0..5.0f64];
    let any_points = (2usize..=4, any::<bool>()).prop_flat_map(move |(objectives, tied)| {
        let value = if tied { (0i32..5).prop_map(f64::from).boxed() } else { any_value.clone().boxed() };
        proptest::collection::vec(proptest::collection::vec(value, objectives), 1..80)
    });
    let mut runner = TestRunner::deterministic();
    let cases: Vec<Sort> = (0..500)
        .map(|_| {
            let mut points = any_points.new_tree(&mut runner).unwrap().current();
            // Both take ties in one objective in the order of the others, once the points are in that order.
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            Sort { points }
        })
        .collect();
    let Some(theirs) = ask::<Sort, Sorted>(&cases) else {
        println!("skipped: {PYTHON} names no Python with pymoo");
        assert!(std::env::var_os("CI").is_none(), "CI has Python, so it has it");
        return;
    };
    let mut compared = 0;
    for (case, theirs) in cases.iter().zip(&theirs) {
        let fitness: Vec<Fitness> = case.points.iter().map(|point| Fitness::Measured(point.clone())).collect();
        let fitness: Vec<&Fitness> = fitness.iter().collect();
        let ours = fronts(&fitness);
        assert_eq!(ours, theirs.fronts, "{:?}", case.points);
        for (front, theirs) in ours.iter().zip(&theirs.crowding) {
            let mut distinct: Vec<&Vec<f64>> = front.iter().map(|&at| &case.points[at]).collect();
            distinct.dedup();
            // pymoo calls every one of one or two points a boundary, copies too, but none of copies of one point.
            if front.len() <= 2 || distinct.len() == 1 {
                continue;
            }
            let objectives = case.points[0].len() as f64;
            for (&ours, &theirs) in distances(&fitness, front).iter().zip(theirs) {
                let same = if ours.is_infinite() { theirs == -1.0 } else { (ours / objectives - theirs).abs() < 1e-12 };
                assert!(same, "{ours} / {objectives} and {theirs} in {front:?} of {:?}", case.points);
                compared += 1;
            }
        }
    }
    println!("{compared} crowding distances are equal");
    assert!(compared > 5_000);
}

#[test]
#[ignore = "long: needs Python's pymoo"]
fn distances_to_fronts_are_those_of_pymoo() {
    let any_sets = (1usize..=4).prop_flat_map(|objectives| {
        let points = proptest::collection::vec(proptest::collection::vec(-3.0..5.0f64, objectives), 1..40);
        (points.clone(), points)
    });
    let mut runner = TestRunner::deterministic();
    let cases: Vec<Distance> = (0..300)
        .map(|_| any_sets.new_tree(&mut runner).unwrap().current())
        .map(|(front, points)| Distance { front, points })
        .collect();
    let Some(theirs) = ask::<Distance, Distant>(&cases) else {
        println!("skipped: {PYTHON} names no Python with pymoo");
        assert!(std::env::var_os("CI").is_none(), "CI has Python, so it has it");
        return;
    };
    for (case, theirs) in cases.iter().zip(theirs) {
        let front: Vec<&[f64]> = case.front.iter().map(Vec::as_slice).collect();
        let points: Vec<&[f64]> = case.points.iter().map(Vec::as_slice).collect();
        let pairs = [
            (igd(&points, &front, Scaling::Unscaled), theirs.igd),
            (igd_plus(&points, &front, Scaling::Unscaled), theirs.igd_plus),
            (igd(&points, &front, Scaling::ByRange), theirs.igd_scaled),
            (igd_plus(&points, &front, Scaling::ByRange), theirs.igd_plus_scaled),
        ];
        for (ours, theirs) in pairs {
            let ours = ours.unwrap();
            assert!((ours - theirs).abs() <= 1e-9 * ours.max(1.0), "{ours} {theirs}: {case:?}");
        }
    }
}
