//! What robustness costs per sample, by the length of the window: it is to be flat. Beside it, where
//! `SESAME_RTAMT_PYTHON` names a Python with rtamt, what rtamt takes for the same formula and trace in the same run.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_base::time::SimTime;
use sesame_plan::Comparison;
use sesame_plan::stl::{Formula, Interval};
use sesame_rng::Stream;
use sesame_stl::Monitor;
use sesame_tests::rtamt::{Case, answers};

const WINDOWS: [u32; 4] = [20, 200, 2_000, 20_000];

fn above(signal: u32) -> Formula {
    Formula::Predicate { signal, comparison: Comparison::Above, constant: 0.0 }
}

/// Two signals of uniform noise, one sample each per second.
fn noise(samples: u32) -> Case {
    let mut stream = Stream::derive(1, "noise", &[]);
    let mut signal = || (0..samples).map(|_| stream.uniform(-1.0, 1.0)).collect();
    Case { formula: String::new(), x: signal(), y: signal() }
}

/// The operators, each asked for at every time of the trace, and what rtamt calls them. The longest windows of rtamt's
/// `until` are left out, since its time grows with their square.
fn formulas(window: u32) -> [(&'static str, Formula, String, bool); 3] {
    let interval = Interval { from: 0.0, to: Some(f64::from(window)) };
    let throughout = |of| Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(of) };
    [
        (
            "always",
            Formula::Eventually {
                interval: Interval::UNBOUNDED,
                of: Box::new(Formula::Always { interval, of: Box::new(above(0)) }),
            },
            format!("eventually (always[0:{window}] (x > 0))"),
            true,
        ),
        (
            "eventually",
            throughout(Formula::Eventually { interval, of: Box::new(above(0)) }),
            format!("always (eventually[0:{window}] (x > 0))"),
            true,
        ),
        (
            "until",
            throughout(Formula::Until { interval, weak: false, left: Box::new(above(0)), right: Box::new(above(1)) }),
            format!("always ((x > 0) until[0:{window}] ((x > 0) and (y > 0)))"),
            window <= 200,
        ),
    ]
}

fn robustness(formula: &Formula, trace: &Case) -> Option<f64> {
    let mut monitor = Monitor::new(formula, 2).expect("the formula is sound");
    let mut now = SimTime::ZERO;
    for (second, (&x, &y)) in (0..).zip(trace.x.iter().zip(&trace.y)) {
        now = SimTime::from_nanos(second * 1_000_000_000);
        monitor.push(now, 0, x);
        monitor.push(now, 1, y);
    }
    monitor.finish(now)
}

fn per_sample(criterion: &mut Criterion) {
    let trace = noise(100_000);
    let mut group = criterion.benchmark_group("robustness per sample");
    group.throughput(Throughput::Elements(trace.x.len() as u64));
    for window in WINDOWS {
        for (name, formula, _, _) in formulas(window) {
            group.bench_function(BenchmarkId::new(name, window), |bencher| {
                bencher.iter(|| black_box(robustness(&formula, &trace)));
            });
        }
    }
    group.finish();
}

/// The best of five, in seconds.
fn best(formula: &Formula, trace: &Case) -> f64 {
    let once = || {
        let start = Instant::now();
        black_box(robustness(formula, trace));
        start.elapsed().as_secs_f64()
    };
    (0..5).map(|_| once()).fold(f64::INFINITY, f64::min)
}

fn beside_rtamt(_: &mut Criterion) {
    println!("| operator | window | samples | ours, ns per sample | rtamt, ns per sample | ratio |");
    println!("|---|---:|---:|---:|---:|---:|");
    for window in WINDOWS {
        for (name, formula, words, feasible) in formulas(window) {
            // Twice the window at least, so that half of the windows are whole.
            let samples = if name == "until" { 2 * window.max(500) } else { 2 * window.max(5_000) };
            let case = Case { formula: words, ..noise(samples) };
            if !feasible {
                continue;
            }
            let Some(theirs) = answers(&vec![case.clone(); 3]) else {
                println!("no Python with rtamt: set SESAME_RTAMT_PYTHON to the one that `./test --long` makes");
                return;
            };
            assert_eq!(robustness(&formula, &case), Some(theirs[0].robustness), "{}", case.formula);
            let nanos = |seconds: f64| seconds * 1e9 / f64::from(samples);
            let ours = nanos(best(&formula, &case));
            let theirs = nanos(theirs.iter().map(|answer| answer.seconds).fold(f64::INFINITY, f64::min));
            println!("| {name} | {window} | {samples} | {ours:.0} | {theirs:.0} | {:.0} |", theirs / ours);
        }
    }
}

criterion_group!(benches, per_sample, beside_rtamt);
criterion_main!(benches);
