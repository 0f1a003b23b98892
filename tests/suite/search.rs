//! Whether searching pays: NSGA-II against random tests on the gearbox cell.

use std::fmt::Write as _;
use std::path::Path;

use sesame_plan::Direction;
use sesame_record::Repository;
use sesame_tests::{Project, Runner};

/// What no test reaches: five operations that are active from 0 s to 65 s, and no collision.
const REFERENCE: [f64; 2] = [325.0, 0.0];

/// Hypervolume of the final front of a run: the area of objective space that it dominates.
fn hypervolume(folder: &Path) -> f64 {
    let repository = Repository::open(folder).unwrap();
    let plan = repository.plan();
    let [fuzzing_time, collisions] = plan.campaign.objectives[..] else { panic!("two objectives") };
    assert_eq!(plan.metric(fuzzing_time).direction, Some(Direction::Minimise));
    assert_eq!(plan.metric(collisions).direction, Some(Direction::Maximise));
    let members = repository.latest_result_set().unwrap().unwrap().members;
    let tests = repository.tests().unwrap();
    let mut points: Vec<(f64, f64)> = tests
        .iter()
        .filter(|row| members.contains(&row.number))
        .map(|row| (row.value(fuzzing_time).value.unwrap(), row.value(collisions).value.unwrap()))
        .collect();
    // From the longest test to the shortest: each adds the strip of its height up to the test before it.
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = points.iter().skip(1).map(|point| point.0).chain([REFERENCE[0]]);
    points.iter().zip(ends).map(|(point, end)| (end - point.0) * (point.1 - REFERENCE[1])).sum()
}

fn run(runner: &Runner, seed: u32, results: &str) -> f64 {
    runner.run(&["--results", results, "--seed", &seed.to_string()]).expect(0);
    hypervolume(&runner.folder.join(results).join(seed.to_string()))
}

/// Quartiles by linear interpolation between order statistics.
pub(crate) fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| {
        let last = sorted.len() - 1;
        let at = share * last as f64;
        let below = (0..=last).rev().find(|&below| below as f64 <= at).unwrap();
        let (low, high) = (sorted[below], sorted[last.min(below + 1)]);
        // There is nothing between two that were never reached.
        if low == high { low } else { low + (high - low) * at.fract() }
    })
}

#[test]
#[ignore = "long: 20 campaigns of 210 tests"]
fn nsga2_beats_random_tests_in_the_median_of_ten_seeds() {
    let project = Project::kuka_cell("kuka_cell_compared");
    let (nsga2, random) = (project.build("coverage_experiment"), project.build("random_experiment"));
    let mut table = String::from("| seed | NSGA-II | random |\n|---:|---:|---:|\n");
    let (mut searched, mut drawn) = (Vec::new(), Vec::new());
    for seed in 1..=10 {
        searched.push(run(&nsga2, seed, "nsga2"));
        drawn.push(run(&random, seed, "random"));
        writeln!(table, "| {seed} | {:.0} | {:.0} |", searched[searched.len() - 1], drawn[drawn.len() - 1]).unwrap();
    }
    let [searched, drawn] = [quartiles(&searched), quartiles(&drawn)];
    for (at, name) in ["lower quartile", "median", "upper quartile"].into_iter().enumerate() {
        writeln!(table, "| {name} | {:.0} | {:.0} |", searched[at], drawn[at]).unwrap();
    }
    println!("{table}");
    assert!(searched[1] > drawn[1], "{table}");
}
