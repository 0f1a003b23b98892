//! How long it takes to choose tests for a laboratory and to prove the choice; and beside that, where
//! `SESAME_SOLVERS_PYTHON` names a Python with them, CP-SAT and outer approximation over `HiGHS` with a minute each.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

use sesame_select::{Selection, choose};
use sesame_tests::selecting::{Choice, FRONTS, Points, Request, ask};

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

/// Instances of one kind, as the tables name it.
#[derive(Clone, Copy)]
struct Kind {
    name: &'static str,
    points: Points,
    uneven: bool,
}

const KINDS: [Kind; 6] = [
    Kind { name: "uniform", points: Points::Uniform, uneven: false },
    Kind { name: "uniform, uneven", points: Points::Uniform, uneven: true },
    Kind { name: "clustered", points: Points::Clustered, uneven: false },
    Kind { name: "clustered, uneven", points: Points::Clustered, uneven: true },
    Kind { name: "fronts", points: Points::Fronts, uneven: false },
    Kind { name: "fronts, uneven", points: Points::Fronts, uneven: true },
];

/// The median and the slowest of all seeds and λ, and the greatest gap.
fn table(_: &mut Criterion) {
    println!("| tests | budget | {} |", KINDS.map(|kind| kind.name).join(" | "));
    println!("|---:|---:|{}", "---:|".repeat(KINDS.len()));
    for tests in [30, 60, 100, 200, 1_000, 10_000] {
        for budget in [5, 10, 20] {
            let cell = |kind: Kind| {
                if kind.points == Points::Fronts && tests > FRONTS {
                    return "–".to_owned();
                }
                let mut all: Vec<(f64, f64)> = Vec::new();
                for seed in SEEDS {
                    for lambda in LAMBDAS {
                        let Kind { points, uneven, .. } = kind;
                        let (seconds, selection) = timed(Choice { tests, budget, lambda, points, uneven, seed });
                        all.push((seconds, selection.gap()));
                    }
                }
                all.sort_by(|a, b| a.0.total_cmp(&b.0));
                let open = all.iter().filter(|(_, gap)| *gap > 0.0).count();
                let gap = all.iter().map(|(_, gap)| *gap).fold(0.0, f64::max);
                let (median, slowest) = (all[all.len() / 2].0, all[all.len() - 1].0);
                let rest = if open > 0 { format!(", {open} open, gap {:.2} %", 100.0 * gap) } else { String::new() };
                format!("{median:.4}, {slowest:.4}{rest}")
            };
            println!("| {tests} | {budget} | {} |", KINDS.map(cell).join(" | "));
        }
    }
}

/// Candidates from which no other solver has a model that fits into the memory of a usual machine: of 10,000 tests,
/// the distances alone are 800 MB, several times in Python.
const TOO_MANY: usize = 10_000;

/// Choices of all kinds that other solvers are asked for, and which λ.
const ASKED: [(usize, u32, &[f64]); 6] = [
    (30, 5, &LAMBDAS),
    (60, 10, &[0.5]),
    (100, 10, &[0.25, 0.5]),
    (200, 10, &[0.5]),
    (1_000, 10, &[0.5]),
    (1_000, 20, &[0.5]),
];

fn beside_others(_: &mut Criterion) {
    println!("| points | tests | budget | λ | Sesame | CP-SAT | outer approximation over HiGHS |");
    println!("|---|---:|---:|---:|---:|---:|---:|");
    for kind in KINDS.into_iter().filter(|kind| kind.points != Points::Clustered) {
        for (tests, budget, lambdas) in ASKED {
            for &lambda in lambdas {
                assert!(tests < TOO_MANY);
                let Kind { name, points, uneven } = kind;
                let choice = Choice { tests, budget, lambda, points, uneven, seed: 1 };
                let (seconds, selection) = timed(choice);
                assert!(selection.gap() == 0.0, "{choice:?} is proved within a minute");
                let others = ["cp-sat", "highs"].map(|solver| beside(choice, &selection, solver));
                println!("| {name} | {tests} | {budget} | {lambda} | {seconds:.4} s | {} |", others.join(" | "));
            }
        }
    }
}

/// How long a solver needs for a choice, or how far it gets in a minute. What it says is compared with ours.
fn beside(choice: Choice, ours: &Selection, solver: &'static str) -> String {
    let Some(solved) = ask(&Request::of(choice, solver, SECONDS)) else { return "not asked".to_owned() };
    assert!(solved.value <= ours.value * (1.0 + 1e-6), "{solver} has a better choice of {choice:?}");
    let apart = (solved.bound - solved.value) / solved.value;
    if solved.proved {
        assert!(solved.value >= ours.value * (1.0 - 1e-6), "{solver} proves less of {choice:?}");
        format!("{:.2} s", solved.seconds)
    } else if solved.value == 0.0 || apart > 1.0 {
        "no useful bound".to_owned()
    } else {
        format!("gap {:.2} %", 100.0 * apart)
    }
}

criterion_group!(benches, choices, table, beside_others);
criterion_main!(benches);
