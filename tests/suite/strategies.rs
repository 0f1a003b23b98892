//! How early the strategies reach half of the paper's cells on the gearbox cell, and what that costs.

use std::fmt::Write as _;

use sesame_base::observation::Outcome;
use sesame_optimise::front::Front;
use sesame_optimise::hypervolume::hypervolume;
use sesame_record::Repository;
use sesame_search::fitness_of;
use sesame_tests::{Project, Runner, command, done, sesamec};

use crate::search::quartiles;

const SEEDS: u32 = 20;
/// The cells to reach: half of 6 × 6 × 3.
const HALF: u32 = 54;
/// What no test reaches: five operations that are active from 0 s to 65 s, and no collision.
const REFERENCE: [f64; 2] = [325.0, 0.0];

/// Campaigns on the cell, each with its search and exploration.
const STRATEGIES: [(&str, &str, &str); 10] = [
    ("tracking", "nsga2 { population 10  evaluations 210 }", ""),
    ("boost_fixed", "nsga2 { population 10  evaluations 210 }", "boost fixed { }"),
    ("boost_linear", "nsga2 { population 10  evaluations 210 }", "boost linear { from 10 to 1 }"),
    ("construction", "nsga2 { population 10  evaluations 210 }", "construct { share 100%  until 50% }"),
    ("elites", "map_elites { population 10  evaluations 210 }", ""),
    ("random_tests", "random { evaluations 210 }", ""),
    ("latin", "latin_hypercube { evaluations 210 }", ""),
    ("even", "sobol { evaluations 210 }", ""),
    ("novelties", "nsga2 { population 10  evaluations 210 }", "novelty { over T1, T2, P1 }"),
    ("falsified", "falsification { evaluations 210 }", ""),
];

/// What a run came to.
struct Ran {
    /// Evaluations at which half of the cells were reached; infinite where they were not.
    half: f64,
    covered: f64,
    volume: f64,
    /// Tests without effect.
    void: usize,
}

fn run(runner: &Runner, campaign: &str, seed: u32) -> Ran {
    runner.run(&["--results", campaign, "--seed", &seed.to_string()]).expect(0);
    let folder = runner.folder.join(campaign).join(seed.to_string());
    let mut results = command(sesamec());
    let curve = done(results.args(["results", "coverage", "--format", "csv"]).arg(&folder)).expect(0).out;
    let rows: Vec<(u32, u32)> = curve
        .lines()
        .skip(1)
        .map(|line| {
            let mut fields = line.split(',').map(|field| field.parse().unwrap());
            (fields.next().unwrap(), fields.next().unwrap())
        })
        .collect();
    let half = rows.iter().find(|(_, covered)| *covered >= HALF).map_or(f64::INFINITY, |(at, _)| f64::from(*at));
    let covered = rows.last().map_or(0.0, |(_, covered)| f64::from(*covered));

    let repository = Repository::open(&folder).unwrap();
    let plan = repository.plan();
    let mut front = Front::default();
    // The reference runs before and after are not tests of the search.
    let tests = repository.tests().unwrap();
    let tests = &tests[1..tests.len() - 1];
    for row in tests {
        front.add(row.number, &fitness_of(plan, &row.outcome, |metric| row.value(metric).value));
    }
    let points: Vec<&[f64]> = front.members().iter().map(|member| member.objectives.as_slice()).collect();
    let void = tests.iter().filter(|row| row.outcome == Outcome::NoEffect).count();
    Ran { half, covered, volume: hypervolume(&points, &REFERENCE), void }
}

/// The median of something of several runs, and its quartiles.
fn spread(runs: &[Ran], of: fn(&Ran) -> f64) -> String {
    let [lower, median, upper] = quartiles(&runs.iter().map(of).collect::<Vec<_>>());
    format!("{median:.0} ({lower:.0} to {upper:.0})")
}

fn median(runs: &[Ran], of: fn(&Ran) -> f64) -> f64 {
    quartiles(&runs.iter().map(of).collect::<Vec<_>>())[1]
}

/// By how many per cent the hypervolumes are larger than those of other runs with the same seeds.
fn compared(runs: &[Ran], others: &[Ran]) -> String {
    let differences: Vec<f64> =
        runs.iter().zip(others).map(|(ran, other)| 100.0 * (ran.volume / other.volume - 1.0)).collect();
    let (mean, half_width) = interval(&differences);
    format!("{mean:+.1} % ± {half_width:.1} %")
}

#[test]
#[ignore = "long: 200 campaigns of 210 tests"]
fn construction_reaches_half_of_the_cells_almost_at_once_and_does_not_lose_the_front() {
    let mut campaigns = String::new();
    for (name, search, exploration) in STRATEGIES {
        write!(
            campaigns,
            "campaign {name} {{\n  objectives fuzzing_time, collision_occurrence\n  operations jitter_link0, jitter_link1   \
             1..5 per test may overlap\n  search {search}\n  coverage {{ T1 [0, 1] cells 6  T2 [0, 0.5] cells 6  P1 [0, 1] cells 3 }}\n  \
             {exploration}\n  end after 70s\n}}\n"
        )
        .unwrap();
    }
    let project = Project::kuka_cell_with("kuka_cell_strategies", &campaigns);
    let mut table = String::from(
        "| strategy | 54 cells after | cells at 210 | hypervolume at 210 | against tracking |\n|---|---:|---:|---:|---:|\n",
    );
    let mut ran: Vec<Vec<Ran>> = Vec::new();
    for (name, ..) in STRATEGIES {
        let runner = project.build(name);
        let runs: Vec<Ran> = (1..=SEEDS).map(|seed| run(&runner, name, seed)).collect();
        writeln!(
            table,
            "| {name} | {} | {} | {} | {} |",
            spread(&runs, |ran| ran.half),
            spread(&runs, |ran| ran.covered),
            spread(&runs, |ran| ran.volume),
            compared(&runs, ran.first().unwrap_or(&runs))
        )
        .unwrap();
        ran.push(runs);
    }
    println!("{table}");
    let [tracking, fixed, _, construction, ..] = &ran[..] else { panic!("ten strategies") };
    assert!(median(construction, |ran| ran.half) <= 60.0, "{table}");
    let [tracking, fixed, construction] = [tracking, fixed, construction].map(|runs| median(runs, |ran| ran.covered));
    assert!(fixed > tracking && construction > fixed, "{table}");
}

#[test]
#[ignore = "long: 20 campaigns of 210 tests"]
fn prediction_covers_more_by_condition_than_evolution_alone() {
    const SEEDS: u32 = 10;
    let mut campaigns = String::new();
    for (name, exploration) in [("counted", ""), ("predicted", "predict { candidates 20 }")] {
        write!(
            campaigns,
            "campaign {name} {{\n  objectives fuzzing_time, collision_occurrence\n  operations jitter_link0, \
             jitter_link1   1..5 per test may overlap\n  activate by condition over link0_high in [0, 10], link0_low in [0, 10], \
             link1_high, link1_low, near_zone1 in [-50, 10], near_zone2 in [-50, 10], near_zone3 in [-50, 10] {{ depth 4  \
             integers [1, 20] }}\n  search nsga2 {{ population 10  evaluations 210 }}\n  coverage {{ T1 [0, 1] cells 6  \
             T2 [0, 0.5] cells 6  P1 [0, 1] cells 3 }}\n  {exploration}\n  end after 70s\n}}\n"
        )
        .unwrap();
    }
    let project = Project::kuka_cell_with("kuka_cell_predicted", &campaigns);
    let mut table = String::from(
        "| strategy | cells at 210 | of all | without effect | 54 cells after | hypervolume, against counted |\n\
         |---|---:|---:|---:|---:|---:|\n",
    );
    let mut ran: Vec<Vec<Ran>> = Vec::new();
    for name in ["counted", "predicted"] {
        let runner = project.build(name);
        let runs: Vec<Ran> = (1..=SEEDS).map(|seed| run(&runner, name, seed)).collect();
        let void = runs.iter().map(|ran| ran.void).sum::<usize>() as f64 / f64::from(SEEDS * 210);
        writeln!(
            table,
            "| {name} | {} | {:.2} | {:.1} % | {} | {} |",
            spread(&runs, |ran| ran.covered),
            median(&runs, |ran| ran.covered) / 108.0,
            100.0 * void,
            spread(&runs, |ran| ran.half),
            compared(&runs, ran.first().unwrap_or(&runs))
        )
        .unwrap();
        ran.push(runs);
    }
    println!("{table}");
    let [counted, predicted] = [&ran[0], &ran[1]].map(|runs| median(runs, |ran| ran.covered));
    assert!(predicted > 1.2 * counted && predicted >= 0.3 * 108.0, "{table}");
}

/// The mean of paired differences, and the half width of its 95 % interval (Student's t).
fn interval(differences: &[f64]) -> (f64, f64) {
    let quantile = match differences.len() {
        10 => 2.262,
        20 => 2.093,
        other => panic!("there are ten or twenty seeds, not {other}"),
    };
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance =
        differences.iter().map(|difference| (difference - mean) * (difference - mean)).sum::<f64>() / (n - 1.0);
    (mean, quantile * (variance / n).sqrt())
}
