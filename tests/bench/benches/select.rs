//! How long it takes to choose tests for a laboratory and to prove the choice; and beside that, where
//! `SESAME_SOLVERS_PYTHON` names a Python with them, CP-SAT and outer approximation over `HiGHS` with a minute each.
//!
//! `SESAME_SELECT_SECONDS` is another limit than a minute for each choice; with 2 and with `SESAME_SELECT_TESTS`, the
//! most tests that are chosen from, at 100, a run takes a few minutes and shows that everything works.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

use sesame_select::{Selection, choose};
use sesame_tests::selecting::{Choice, Points, Request, ask};

const LAMBDAS: [f64; 3] = [0.25, 0.5, 0.75];
/// The λ of the largest choices, for which others need all of their minute.
const LARGE: [f64; 1] = [0.5];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=3;

/// Where points are, whether costs are uneven, and how this is called.
const KINDS: [(Points, bool, &str); 6] = [
    (Points::Uniform, false, "uniform"),
    (Points::Uniform, true, "uniform, uneven"),
    (Points::Clustered, false, "clustered"),
    (Points::Clustered, true, "clustered, uneven"),
    (Points::Front, false, "front"),
    (Points::Front, true, "front, uneven"),
];

/// A variable's number.
fn variable(name: &str) -> Option<f64> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} is a number")))
}

/// Wall time after which a choice is given up.
fn limit() -> f64 {
    variable("SESAME_SELECT_SECONDS").unwrap_or(60.0)
}

/// Whether choices from so many tests are asked for.
fn wanted(tests: usize) -> bool {
    variable("SESAME_SELECT_TESTS").is_none_or(|most| tests as f64 <= most)
}

fn timed(choice: Choice) -> (f64, Selection) {
    let problem = choice.problem();
    let limit = limit();
    let start = Instant::now();
    let selection = choose(&problem, &mut || start.elapsed().as_secs_f64() > limit);
    (start.elapsed().as_secs_f64(), selection)
}

fn choices(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("choices");
    group.sample_size(10);
    for (tests, budget) in [(60, 5), (200, 10), (1_000, 10), (1_000, 20), (10_000, 10)] {
        let problem = Choice { tests, budget, lambda: 0.5, points: Points::Uniform, uneven: false, seed: 1 }.problem();
        group.bench_function(BenchmarkId::new("uniform", format!("{budget} of {tests}")), |bencher| {
            bencher.iter(|| black_box(choose(&problem, &mut || false)));
        });
    }
    group.finish();
}

/// The median and the slowest of all seeds and λ, and the greatest gap.
fn table(_: &mut Criterion) {
    println!("| tests | budget | {} |", KINDS.map(|(_, _, name)| name).join(" | "));
    println!("|---:|---:|{}", "---:|".repeat(KINDS.len()));
    for tests in [30, 60, 100, 200, 1_000, 10_000].into_iter().filter(|&tests| wanted(tests)) {
        for budget in [5, 10, 20] {
            let cells = KINDS.map(|(points, uneven, _)| {
                let mut all: Vec<(f64, f64)> = Vec::new();
                for seed in SEEDS {
                    for lambda in LAMBDAS {
                        let (seconds, selection) = timed(Choice { tests, budget, lambda, points, uneven, seed });
                        all.push((seconds, selection.gap()));
                    }
                }
                all.sort_by(|a, b| a.0.total_cmp(&b.0));
                let open = all.iter().filter(|(_, gap)| *gap > 0.0).count();
                let gap = all.iter().map(|(_, gap)| *gap).fold(0.0, f64::max);
                let (median, slowest) = (all[all.len() / 2].0, all[all.len() - 1].0);
                let rest = if open > 0 { format!(", {open} open, gap {:.2} %", 100.0 * gap) } else { String::new() };
                format!("{median:.4} to {slowest:.4} s{rest}")
            });
            println!("| {tests} | {budget} | {} |", cells.join(" | "));
        }
    }
}

/// What a solver makes of a choice compared with ours.
fn other(solver: &'static str, choice: Choice, ours: &Selection) -> String {
    let Some(solved) = ask(&Request::of(choice, solver, limit())) else { return "not asked".to_owned() };
    let solved = match solved {
        Ok(solved) => solved,
        Err(why) => return why,
    };
    if ours.gap() == 0.0 {
        assert!(solved.value <= ours.value * (1.0 + 1e-6), "{solver} has a better choice of {choice:?}");
    }
    if solved.proved {
        assert!(solved.value >= ours.value * (1.0 - 1e-6), "{solver} proves less of {choice:?}");
        format!("{:.2} s", solved.seconds)
    } else {
        format!("gap {:.2} %", 100.0 * (solved.bound - solved.value) / solved.value)
    }
}

fn beside_others(_: &mut Criterion) {
    println!("| points | tests | budget | λ | Sesame | CP-SAT | outer approximation over HiGHS |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    let rows: [(usize, u32, &[f64]); 9] = [
        (30, 5, &LAMBDAS),
        (60, 5, &LAMBDAS),
        (60, 10, &LAMBDAS),
        (100, 10, &LAMBDAS),
        (100, 20, &LARGE),
        (200, 10, &LAMBDAS),
        (1_000, 10, &LAMBDAS),
        (1_000, 20, &LARGE),
        (10_000, 10, &LARGE),
    ];
    for (points, uneven, name) in KINDS.into_iter().filter(|(points, ..)| *points != Points::Clustered) {
        for (tests, budget, lambdas) in rows.into_iter().filter(|(tests, ..)| wanted(*tests)) {
            for &lambda in lambdas {
                let choice = Choice { tests, budget, lambda, points, uneven, seed: 1 };
                let (seconds, selection) = timed(choice);
                let ours = match selection.gap() {
                    0.0 => format!("{seconds:.4} s"),
                    gap => format!("gap {:.2} %", 100.0 * gap),
                };
                let others = ["cp-sat", "highs"].map(|solver| other(solver, choice, &selection));
                println!("| {name} | {tests} | {budget} | {lambda} | {ours} | {} |", others.join(" | "));
            }
        }
    }
}

criterion_group!(benches, choices, table, beside_others);
criterion_main!(benches);
