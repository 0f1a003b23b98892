//! What the relay costs per message, compared with a bare copy of the message.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_base::time::SimTime;
use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::{Activation, CampaignPlan, Choice, ChoiceKind, Domain, MetricId, OperationId, Test, TestOperation};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Relay};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::WireTable;

const MESSAGES: u32 = 10_000;

/// A test that keeps these operations active all the time, with the middle of what is permitted.
fn active(plan: &CampaignPlan, names: &[&str]) -> Test {
    let operation = |name: &&str| {
        let at = plan.operations.iter().position(|operation| operation.name == **name).expect("it is declared");
        let parameters = plan.operations[at].parameters.iter().map(|parameter| {
            let Domain::Number { low, high, shape, .. } = parameter.domain else { panic!("these have numbers only") };
            let (low, high) = (low * 0.75 + high * 0.25, high * 0.75 + low * 0.25);
            match shape {
                ChoiceKind::Value => Choice::Value { value: f64::midpoint(low, high) },
                ChoiceKind::Range => Choice::Range { low, high },
            }
        });
        TestOperation {
            operation: OperationId(u32::try_from(at).expect("few operations")),
            activation: Activation::Time { start: 0.0, end: 1000.0 },
            parameters: parameters.collect(),
            operation_seed: 1,
            messages: None,
        }
    };
    Test { operations: names.iter().map(operation).collect() }
}

/// The same test switched by conditions that are weighed on every event: active from the first one on.
fn by_condition(mut test: Test) -> Test {
    let active_time =
        |by| Condition::Compare { left: Operand::Variable(MetricId(0)), by, right: Operand::Number(2000.0) };
    for operation in &mut test.operations {
        let (start, end) = (active_time(Comparison::Below), active_time(Comparison::Above));
        operation.activation = Activation::Condition { start, end, times: 1 };
    }
    test
}

fn zone() -> Value {
    let fields = Fields::new(["zone", "level", "object1", "object2"]);
    Record::new(&fields, vec!["Z1".into(), 700.0.into(), "Z1".into(), "gripper".into()]).into()
}

fn relay(criterion: &mut Criterion) {
    let plan = sesame_bench::plan();
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).expect("the space has no hooks");
    let mut group = criterion.benchmark_group("per_message");
    group.throughput(Throughput::Elements(u64::from(MESSAGES)));

    let cases: [(&str, &str, Value, &[&str]); 22] = [
        ("number, untouched", "arm/command", Value::Real(1.0), &[]),
        ("number, offset", "arm/command", Value::Real(1.0), &["jitter"]),
        ("number, loss", "arm/command", Value::Real(1.0), &["lose"]),
        ("number, latency", "arm/command", Value::Real(1.0), &["lag"]),
        ("number, four operations", "arm/command", Value::Real(1.0), &["jitter", "jitter", "lose", "lag"]),
        ("number, four operations on values", "arm/command", Value::Real(1.0), &["jitter", "offset", "wander", "gain"]),
        ("number, bias", "arm/command", Value::Real(1.0), &["offset"]),
        ("number, drift", "arm/command", Value::Real(1.0), &["wander"]),
        ("number, noise", "arm/command", Value::Real(1.0), &["blur"]),
        ("number, random walk", "arm/command", Value::Real(1.0), &["slip"]),
        ("number, scale", "arm/command", Value::Real(1.0), &["gain"]),
        ("number, freeze", "arm/command", Value::Real(1.0), &["hold"]),
        ("number, stale", "arm/command", Value::Real(1.0), &["behind"]),
        ("number, burst loss", "arm/command", Value::Real(1.0), &["bursts"]),
        ("number, rate limit", "arm/command", Value::Real(1.0), &["thin"]),
        ("number, reorder", "arm/command", Value::Real(1.0), &["mix"]),
        ("number, duplicate", "arm/command", Value::Real(1.0), &["twice"]),
        ("message, four operations on values", "zones/Z1", zone(), &["shift", "shift", "shift", "shift"]),
        ("number, offset by condition", "arm/command", Value::Real(1.0), &["jitter"]),
        ("number, four operations by condition", "arm/command", Value::Real(1.0), &["jitter", "jitter", "lose", "lag"]),
        ("message, untouched and measured", "zones/Z1", zone(), &[]),
        ("message, offset and measured", "zones/Z1", zone(), &["shift"]),
    ];
    for (name, path, value, operations) in cases {
        let wire = wires.find(path).expect("the topic is declared");
        let timed = active(&plan, operations);
        let test = if name.ends_with("by condition") { by_condition(timed) } else { timed };
        group.bench_function(BenchmarkId::new("relay", name), |bencher| {
            bencher.iter(|| {
                let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).expect("the test fits");
                relay.subscribed(wire);
                let mut deliveries = Vec::new();
                for step in 0..MESSAGES {
                    let now = SimTime::from_nanos(i64::from(step) * 1_000_000);
                    relay.advance(now, &mut deliveries);
                    relay.message(now, wire, value.clone(), &mut deliveries);
                    black_box(&deliveries);
                    deliveries.clear();
                }
            });
        });
    }
    for (name, value) in [("number", Value::Real(1.0)), ("message", zone())] {
        group.bench_function(BenchmarkId::new("bare copy", name), |bencher| {
            bencher.iter(|| {
                let mut deliveries = Vec::new();
                for _ in 0..MESSAGES {
                    deliveries.push(value.clone());
                    black_box(&deliveries);
                    deliveries.clear();
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, relay);
criterion_main!(benches);
