//! What the search costs without any simulation: hypervolumes of many objectives, exact and as a campaign has them; and
//! evaluations per second of NSGA-II on published problems, and the hypervolume they reach. Beside it, where
//! `SESAME_OPTIMISERS_PYTHON` names a Python with them, pygmo and pymoo in the same run, turn by turn.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_optimise::hypervolume::{WORK, hypervolume, measured};
use sesame_optimise::problems::{Problem, approximate};
use sesame_rng::Stream;
use sesame_tests::optimisers::{Ran, Run, ask};

const POPULATION: u32 = 100;
const EVALUATIONS: u32 = 25_000;

fn runs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("NSGA-II");
    group.sample_size(20).throughput(Throughput::Elements(u64::from(EVALUATIONS)));
    for problem in Problem::ALL {
        group.bench_function(BenchmarkId::new(problem.name(), EVALUATIONS), |bencher| {
            bencher.iter(|| black_box(approximate(problem, POPULATION, EVALUATIONS, 1)));
        });
    }
    group.finish();
}

/// Points on a sphere, of which none dominates another.
fn sphere(objectives: usize, count: usize) -> Vec<Vec<f64>> {
    let mut stream = Stream::derive(1, "sphere", &[]);
    let point = |_| {
        let ray: Vec<f64> = (0..objectives).map(|_| stream.normal().abs()).collect();
        let length = ray.iter().map(|x| x * x).sum::<f64>().sqrt();
        ray.iter().map(|x| x / length).collect()
    };
    (0..count).map(point).collect()
}

fn volumes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("hypervolume");
    group.sample_size(10);
    for (objectives, count) in [(3, 400), (4, 400), (5, 400), (6, 400), (8, 100), (8, 200)] {
        let points = sphere(objectives, count);
        let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let reference = vec![1.1; objectives];
        let name = format!("{objectives} objectives");
        group.bench_function(BenchmarkId::new(&name, count), |bencher| {
            bencher.iter(|| black_box(measured(&points, &reference, WORK)));
        });
    }
    group.finish();
}

/// Seconds of each run, and the hypervolume of its final population.
struct Figures {
    seconds: Vec<f64>,
    volumes: Vec<f64>,
}

impl Figures {
    fn of(problem: Problem, runs: &[(f64, Vec<Vec<f64>>)]) -> Self {
        let volume = |front: &[Vec<f64>]| {
            let points: Vec<&[f64]> = front.iter().map(Vec::as_slice).collect();
            hypervolume(&points, problem.reference())
        };
        Figures {
            seconds: runs.iter().map(|run| run.0).collect(),
            volumes: runs.iter().map(|run| volume(&run.1)).collect(),
        }
    }

    fn fastest(&self) -> f64 {
        f64::from(EVALUATIONS) / self.seconds.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn row(&self, problem: Problem, name: &str, ours: f64) {
        let low = self.volumes.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.volumes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (rate, times) = (self.fastest(), ours / self.fastest());
        println!("| {} | {name} | {rate:.0} | {times:.2} | {low:.4} to {high:.4} |", problem.name());
    }
}

fn beside_others(_: &mut Criterion) {
    println!("| problem | implementation | evaluations per second | ours, as a multiple | hypervolume, 5 seeds |");
    println!("|---|---|---:|---:|---:|");
    for problem in Problem::ALL {
        let mut figures: [Vec<(f64, Vec<Vec<f64>>)>; 3] = Default::default();
        for seed in 1..=5 {
            let start = Instant::now();
            let front = approximate(problem, POPULATION, EVALUATIONS, seed);
            figures[0].push((start.elapsed().as_secs_f64(), front));
            for (library, theirs) in ["pygmo", "pymoo"].into_iter().zip(1..) {
                let (population, evaluations) = (POPULATION, EVALUATIONS);
                let run = Run { library, problem: problem.name(), population, evaluations, seed };
                // Python is started anew for each, and not counted.
                let Some(ran) = ask::<Run, Ran>(&[run]) else { continue };
                figures[theirs].extend(ran.into_iter().map(|ran| (ran.seconds, ran.front)));
            }
        }
        let ours = Figures::of(problem, &figures[0]);
        ours.row(problem, "Sesame", ours.fastest());
        for (name, runs) in ["pygmo", "pymoo"].into_iter().zip(&figures[1..]) {
            if runs.is_empty() {
                println!("no Python with {name}: set SESAME_OPTIMISERS_PYTHON to the one that `./test --long` makes");
            } else {
                Figures::of(problem, runs).row(problem, name, ours.fastest());
            }
        }
    }
}

criterion_group!(benches, volumes, runs, beside_others);
criterion_main!(benches);
