//! How early the strategies reach half of the paper's cells on the gearbox cell, and what that costs.

use std::fmt::Write as _;

use sesame_runtime::record::Repository;
use sesame_runtime::search::hypervolume::hypervolume;
use sesame_runtime::search::{Front, fitness_of};
use sesame_tests::{Project, Runner, command, done, sesamec};

use crate::search::quartiles;

const SEEDS: u32 = 20;
/// The cells to reach: half of 6 × 6 × 3.
const HALF: u32 = 54;
/// What no test reaches: five operations that are active from 0 s to 65 s, and no collision.
const REFERENCE: [f64; 2] = [325.0, 0.0];

/// Campaigns on the cell, each with its search and exploration.
const STRATEGIES: [(&str, &str, &str); 7] = [
    ("tracking", "nsga2 { population 10  evaluations 210 }", ""),
    ("boost_fixed", "nsga2 { population 10  evaluations 210 }", "boost fixed { }"),
    ("boost_linear", "nsga2 { population 10  evaluations 210 }", "boost linear { from 10 to 1 }"),
    ("construction", "nsga2 { population 10  evaluations 210 }", "construct { share 100%  until 50% }"),
    ("elites", "map_elites { population 10  evaluations 210 }", ""),
    ("random_tests", "random { evaluations 210 }", ""),
    ("latin", "latin_hypercube { evaluations 210 }", ""),
];

/// What a run came to.
struct Ran {
    /// Evaluations at which half of the cells were reached; infinite where they were not.
    half: f64,
    covered: f64,
    volume: f64,
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
    // The undisturbed runs before and after are no tests of the search.
    let tests = repository.tests().unwrap();
    for row in &tests[1..tests.len() - 1] {
        front.add(row.number, &fitness_of(plan, &row.outcome, |metric| row.value(metric).value));
    }
    let points: Vec<&[f64]> = front.members().iter().map(|member| member.objectives.as_slice()).collect();
    Ran { half, covered, volume: hypervolume(&points, &REFERENCE) }
}

#[test]
#[ignore = "long: 140 campaigns of 210 tests"]
fn construction_reaches_half_of_the_cells_almost_at_once_and_does_not_lose_the_front() {
    let mut campaigns = String::new();
    for (name, search, exploration) in STRATEGIES {
        write!(
            campaigns,
            "campaign {name} {{\n  objectives fuzzing_time, collision_occurrence\n  operations jitter_link0, jitter_link1   \
             1..5 per test\n  search {search}\n  coverage {{ T1 [0, 1] cells 6  T2 [0, 0.5] cells 6  P1 [0, 1] cells 3 }}\n  \
             {exploration}\n  end after 70s\n}}\n"
        )
        .unwrap();
    }
    let project = Project::kuka_cell_with("kuka_cell_strategies", &campaigns);
    let mut table = String::from(
        "| strategy | 54 cells after | cells at 210 | hypervolume at 210 | against tracking |\n|---|---:|---:|---:|---:|\n",
    );
    let mut plain: Vec<f64> = Vec::new();
    let mut medians = Vec::new();
    for (name, ..) in STRATEGIES {
        let runner = project.build(name);
        let runs: Vec<Ran> = (1..=SEEDS).map(|seed| run(&runner, name, seed)).collect();
        let [half, covered, volume] = [|ran: &Ran| ran.half, |ran: &Ran| ran.covered, |ran: &Ran| ran.volume]
            .map(|of| quartiles(&runs.iter().map(of).collect::<Vec<_>>()).map(|quartile| format!("{quartile:.0}")));
        if plain.is_empty() {
            plain = runs.iter().map(|ran| ran.volume).collect();
        }
        let differences: Vec<f64> =
            runs.iter().zip(&plain).map(|(ran, plain)| 100.0 * (ran.volume / plain - 1.0)).collect();
        let (mean, half_width) = interval(&differences);
        let cell = |[lower, median, upper]: &[String; 3]| format!("{median} ({lower} to {upper})");
        writeln!(
            table,
            "| {name} | {} | {} | {} | {mean:+.1} % ± {half_width:.1} % |",
            cell(&half),
            cell(&covered),
            cell(&volume)
        )
        .unwrap();
        medians.push(quartiles(&runs.iter().map(|ran| ran.half).collect::<Vec<_>>())[1]);
    }
    println!("{table}");
    let [tracking, fixed, _, construction, ..] = medians[..] else { panic!("seven strategies") };
    assert!(construction <= 60.0, "{table}");
    assert!(fixed < tracking && construction < fixed, "{table}");
}

/// The mean of paired differences, and the half width of its 95 % interval (Student's t with 19 degrees of freedom).
fn interval(differences: &[f64]) -> (f64, f64) {
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|it| (it - mean) * (it - mean)).sum::<f64>() / (n - 1.0);
    (mean, 2.093 * (variance / n).sqrt())
}
