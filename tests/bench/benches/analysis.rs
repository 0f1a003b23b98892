//! What analyses of a results file cost: 10,000 made-up tests, or as many as `SESAME_BENCH_TESTS` says. The file stays
//! in the folder `SESAME_BENCH_RESULTS`, where it is set, and is used again.

use std::path::PathBuf;

use criterion::{Criterion, criterion_group, criterion_main};

use sesame_analysis as analysis;
use sesame_analysis::Selection;
use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome, WallTime};
use sesame_plan::{Activation, Dimension, Span};
use sesame_record::{Origin, Recorder, Repository, TestRecord};
use sesame_rng::Stream;
use sesame_search::coverage::Grid;
use sesame_search::space::TestSpace;
use sesame_search::space::fresh_test;
use sesame_search::sspr::Convention;

/// A test with random operations, observed as planned, and random values.
fn record(permitted: &TestSpace, metrics: usize, number: u32) -> TestRecord {
    let mut stream = Stream::derive(1, "bench", &[u64::from(number)]);
    let test = fresh_test(permitted, &mut stream);
    let operations = test.operations.iter().map(|operation| {
        let Activation::Time { start, end } = operation.activation else { unreachable!("a campaign by time") };
        let counters = Counters { seen: 100, changed: 100, ..Counters::default() };
        let touches = (Some(start), Some(end));
        OperationEffect {
            intervals: vec![Span { start, end }],
            tails: Vec::new(),
            counters,
            first_touch: touches.0,
            last_touch: touches.1,
        }
    });
    let operations = operations.collect();
    let metrics = (0..metrics)
        .map(|_| {
            let value = stream.uniform(0.0, 100.0);
            MetricObservation::whole(Some(value), true, vec![(1.0, value)])
        })
        .collect();
    TestRecord {
        number,
        origin: Origin::Search,
        generation: Some(number / 10),
        parents: Vec::new(),
        test,
        simulator_seed: 1,
        duplicate_of: None,
        observation: Observation {
            outcome: Outcome::Completed,
            end: 1000.0,
            operations,
            unheard: Vec::new(),
            unreached: Vec::new(),
            traffic: Vec::new(),
            course: None,
            altered: None,
            metrics,
            monitors: Vec::new(),
            messages: 10_000,
            warnings: Vec::new(),
            wall: WallTime::default(),
        },
    }
}

fn analyses(criterion: &mut Criterion) {
    let kept = std::env::var_os("SESAME_BENCH_RESULTS").map(PathBuf::from);
    let tests: u32 = std::env::var("SESAME_BENCH_TESTS").map_or(10_000, |n| n.parse().expect("a number of tests"));
    let scratch = tempfile::tempdir().expect("there is room for a folder");
    let folder = kept.unwrap_or_else(|| scratch.path().to_owned());
    let repository = Repository::open(&folder).unwrap_or_else(|_| {
        let mut plan = sesame_bench::plan();
        // A third objective, as large fronts have.
        plan.metrics.push(plan.metrics[1].clone());
        "third".clone_into(&mut plan.metrics[2].name);
        plan.campaign.objectives.push(sesame_plan::MetricId(2));
        let permitted = TestSpace::from_plan(&plan).expect("the space has operations");
        let mut recorder = Recorder::create(&folder, &plan, 1, 1).expect("the folder is empty");
        for number in 1..=tests {
            recorder.commit(&record(&permitted, plan.metrics.len(), number)).expect("the number is new");
        }
        recorder.finish("all tests were evaluated").expect("the file can be finished")
    });

    let mut group = criterion.benchmark_group("analyse");
    group.sample_size(10);
    let all = Selection::default();
    group.bench_function("tests", |bencher| bencher.iter(|| analysis::tests(&repository, &all).expect("it is whole")));
    group.bench_function("front", |bencher| bencher.iter(|| analysis::front(&repository, &all).expect("it is whole")));
    group.bench_function("sspr", |bencher| {
        let all_dimensions = &Dimension::ALL;
        bencher.iter(|| analysis::sspr(&repository, &all, all_dimensions, Convention::Ours).expect("it is whole"));
    });
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").expect("it is a grid");
    group.bench_function("coverage", |bencher| {
        bencher.iter(|| {
            analysis::coverage(&repository, &all, grid.clone(), 1, Convention::Ours).expect("it is whole").curve()
        });
    });
    group.finish();
}

criterion_group!(benches, analyses);
criterion_main!(benches);
