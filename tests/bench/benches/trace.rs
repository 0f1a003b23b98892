//! What a test's trace costs in addition to the test itself, without a simulator: per message, on a disk.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_base::time::SimTime;
use sesame_plan::Test;
use sesame_recording::{Subject, TraceWriter};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Relay};
use sesame_relay::value::{Fields, Record};
use sesame_relay::wire::WireTable;

const MESSAGES: u32 = 100_000;

fn trace(criterion: &mut Criterion) {
    let plan = sesame_bench::plan();
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).expect("the space has no hooks");
    let test = Test::default();
    let wire = wires.find("zones/Z1").expect("the topic is declared");
    let fields = Fields::new(["zone", "level", "object1", "object2"]);
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let file = folder.path().join("unfinished");
    let mut group = criterion.benchmark_group("per_message");
    group.throughput(Throughput::Elements(u64::from(MESSAGES))).sample_size(10);
    for recorded in [false, true] {
        let name = if recorded { "with a trace" } else { "without" };
        group.bench_function(BenchmarkId::new("run", name), |bencher| {
            bencher.iter(|| {
                let subject = Subject { plan: &plan, number: 1, test: &test, simulator_seed: 1 };
                let mut writer =
                    recorded.then(|| TraceWriter::create(&file, subject, &wires).expect("there is room for a trace"));
                let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).expect("the test fits");
                if let Some(writer) = &mut writer {
                    relay = relay.tapped(writer);
                }
                relay.subscribed(wire);
                let mut deliveries = Vec::new();
                for step in 0..MESSAGES {
                    let now = SimTime::from_nanos(i64::from(step) * 1_000_000);
                    let level = 700.0 - f64::from(step) / 7.0;
                    let value = Record::new(&fields, vec!["Z1".into(), level.into(), "Z1".into(), "gripper".into()]);
                    relay.message(now, wire, value.into(), &mut deliveries);
                    black_box(&deliveries);
                    deliveries.clear();
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, trace);
criterion_main!(benches);
