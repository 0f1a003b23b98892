//! What the search costs without any simulation: hypervolumes of many objectives, exact and as a campaign has them; and
//! evaluations per second of NSGA-II and NSGA-III on published problems, and the hypervolume they reach. Beside them,
//! where `SESAME_OPTIMISERS_PYTHON` names a Python with them, pygmo and pymoo in the same run, turn by turn.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_optimise::hypervolume::{WORK, hypervolume, measured};
use sesame_optimise::problems::{Problem, approximate};
use sesame_rng::Stream;
use sesame_tests::optimisers::{ManyObjectives, Ran, Run, ask};

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

/// A problem that all implementations of an algorithm solve with the same settings.
struct Contest {
    algorithm: &'static str,
    problem: &'static str,
    evaluations: u32,
    /// Where hypervolumes end.
    reference: Vec<f64>,
    /// The final population of ours with a seed.
    ours: Box<dyn Fn(u64) -> Vec<Vec<f64>>>,
    /// What other implementations are asked for with a seed.
    others: Vec<Box<dyn Fn(u64) -> Run>>,
}

fn contests() -> Vec<Contest> {
    let nsga2 = Problem::ALL.into_iter().map(|problem| Contest {
        algorithm: "NSGA-II",
        problem: problem.name(),
        evaluations: EVALUATIONS,
        reference: problem.reference().to_vec(),
        ours: Box::new(move |seed| approximate(problem, POPULATION, EVALUATIONS, seed)),
        others: ["pygmo", "pymoo"].map(|library| request_of(library, problem)).into(),
    });
    let nsga3 = ManyObjectives::ALL.into_iter().map(|many| Contest {
        algorithm: "NSGA-III",
        problem: many.problem,
        evaluations: many.evaluations,
        reference: vec![1.1; many.objectives],
        ours: Box::new(move |seed| many.approximated(seed)),
        others: vec![Box::new(move |seed| many.request(seed))],
    });
    nsga2.chain(nsga3).collect()
}

fn request_of(library: &'static str, problem: Problem) -> Box<dyn Fn(u64) -> Run> {
    let (population, evaluations) = (POPULATION, EVALUATIONS);
    Box::new(move |seed| Run { library, problem: problem.name(), population, evaluations, seed })
}

impl Contest {
    /// Prints a row of the table: the fastest run, how many times as fast ours is, the least and greatest hypervolume.
    /// Returns the evaluations per second of the fastest.
    fn row(&self, name: &str, runs: &[(f64, Vec<Vec<f64>>)], ours: Option<f64>) -> f64 {
        let volume = |front: &[Vec<f64>]| {
            let points: Vec<&[f64]> = front.iter().map(Vec::as_slice).collect();
            hypervolume(&points, &self.reference)
        };
        let volumes: Vec<f64> = runs.iter().map(|(_, front)| volume(front)).collect();
        let low = volumes.iter().copied().fold(f64::INFINITY, f64::min);
        let high = volumes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let seconds = runs.iter().map(|(seconds, _)| *seconds).fold(f64::INFINITY, f64::min);
        let rate = f64::from(self.evaluations) / seconds;
        let times = ours.unwrap_or(rate) / rate;
        let (algorithm, problem) = (self.algorithm, self.problem);
        println!("| {algorithm} | {problem} | {name} | {rate:.0} | {times:.2} | {low:.4} to {high:.4} |");
        rate
    }
}

fn beside_others(_: &mut Criterion) {
    println!(
        "| algorithm | problem | implementation | evaluations per second | ours, as a multiple | \
         hypervolume, 5 seeds |\n|---|---|---|---:|---:|---:|"
    );
    for contest in contests() {
        let mut ours = Vec::new();
        let mut theirs = vec![Vec::new(); contest.others.len()];
        for seed in 1..=5 {
            let start = Instant::now();
            let front = (contest.ours)(seed);
            ours.push((start.elapsed().as_secs_f64(), front));
            for (request, runs) in contest.others.iter().zip(&mut theirs) {
                // Python is started anew for each, and not counted.
                let Some(ran) = ask::<Run, Ran>(&[request(seed)]) else { continue };
                runs.extend(ran.into_iter().map(|ran| (ran.seconds, ran.front)));
            }
        }
        let rate = contest.row("Sesame", &ours, None);
        for (request, runs) in contest.others.iter().zip(&theirs) {
            let name = request(0).library;
            if runs.is_empty() {
                println!("no Python with {name}: set SESAME_OPTIMISERS_PYTHON to the one that `./test --long` makes");
            } else {
                contest.row(name, runs, Some(rate));
            }
        }
    }
}

criterion_group!(benches, volumes, runs, beside_others);
criterion_main!(benches);
