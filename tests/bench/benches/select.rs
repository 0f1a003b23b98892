//! How long it takes to choose tests for a laboratory and to prove the choice; and beside that, where
//! `SESAME_SOLVERS_PYTHON` names a Python with them, CP-SAT and outer approximation over `HiGHS` with a minute each.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

use sesame_select::{Selection, choose};
use sesame_tests::selecting::{Choice, Points, Request, ask};

/// Wall time after which a choice is given up.
const SECONDS: f64 = 60.0;
const LAMBDAS: [f64; 3] = [0.25, 0.5, 0.75];
const SEEDS: std::ops::RangeInclusive<u64> = 1..=3;

fn timed(choice: Choice) -> (f64, Selection) {
    let problem = choice.problem();
    let start = Instant::now();
    let selection = choose(&problem, &mut || start.elapsed().as_secs_f64() > SECONDS);
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

/// The slowest of all seeds and λ, and the greatest gap.
fn table(_: &mut Criterion) {
    println!("| tests | budget | uniform | uniform, uneven | clustered | clustered, uneven |");
    println!("|---:|---:|---:|---:|---:|---:|");
    for tests in [30, 60, 100, 200, 1_000, 10_000] {
        for budget in [5, 10, 20] {
            let cell = |points, uneven| {
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
            };
            let kinds = [Points::Uniform, Points::Clustered].map(|points| [cell(points, false), cell(points, true)]);
            println!("| {tests} | {budget} | {} |", kinds.concat().join(" | "));
        }
    }
}

fn beside_others(_: &mut Criterion) {
    println!("| tests | budget | λ | Sesame | CP-SAT | outer approximation over HiGHS |");
    println!("|---:|---:|---:|---:|---:|---:|");
    for (tests, budget) in [(30, 5), (60, 5), (60, 10), (100, 10), (200, 10), (1_000, 10)] {
        for lambda in LAMBDAS {
            let choice = Choice { tests, budget, lambda, points: Points::Uniform, uneven: false, seed: 1 };
            let (seconds, selection) = timed(choice);
            assert!(selection.gap() == 0.0, "{choice:?} is proved within a minute");
            let others = ["cp-sat", "highs"].map(|solver| {
                let Some(solved) = ask(&Request::of(choice, solver, SECONDS)) else { return "not asked".to_owned() };
                assert!(solved.value <= selection.value * (1.0 + 1e-6), "{solver} has a better choice of {choice:?}");
                let apart = (solved.bound - solved.value) / solved.value;
                if solved.proved {
                    assert!(solved.value >= selection.value * (1.0 - 1e-6), "{solver} proves less of {choice:?}");
                    format!("{:.2} s", solved.seconds)
                } else {
                    format!("gap {:.2} %", 100.0 * apart)
                }
            });
            println!("| {tests} | {budget} | {lambda} | {seconds:.4} s | {} |", others.join(" | "));
        }
    }
}

criterion_group!(benches, choices, table, beside_others);
criterion_main!(benches);
