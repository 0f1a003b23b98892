//! What it costs to record a test, by the length of its time series.

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};

use sesame_base::observation::{MetricObservation, Observation, Outcome, WallTime};
use sesame_plan::Test;
use sesame_record::{Origin, Recorder, TestRecord};

/// A test in which both metrics changed this often.
fn test(number: u32, points: u32) -> TestRecord {
    let series: Vec<(f64, f64)> = (0..points).map(|n| (f64::from(n) * 0.02, f64::from(n).sqrt())).collect();
    let metric = MetricObservation::whole(series.last().map(|point| point.1), true, series);
    TestRecord {
        number,
        origin: Origin::Search,
        generation: Some(0),
        parents: Vec::new(),
        test: Test::default(),
        simulator_seed: 1,
        duplicate_of: None,
        observation: Observation {
            outcome: Outcome::Completed,
            end: 70.0,
            operations: Vec::new(),
            unheard: Vec::new(),
            unreached: Vec::new(),
            traffic: Vec::new(),
            course: None,
            altered: None,
            metrics: vec![metric.clone(), metric],
            monitors: Vec::new(),
            messages: 10_000,
            warnings: Vec::new(),
            wall: WallTime::default(),
        },
    }
}

fn record(criterion: &mut Criterion) {
    let plan = sesame_bench::plan();
    let mut group = criterion.benchmark_group("record a test");
    for points in [0, 50, 500, 5_000] {
        let folder = tempfile::tempdir().expect("there is room for a folder");
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).expect("the folder is empty");
        let mut number = 0;
        group.bench_function(BenchmarkId::new("change points", 2 * points), |bencher| {
            bencher.iter_batched_ref(
                || {
                    number += 1;
                    test(number, points)
                },
                |record| recorder.commit(record).expect("the number is new"),
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, record);
criterion_main!(benches);
