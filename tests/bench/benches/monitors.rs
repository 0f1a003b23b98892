//! What monitors cost per message, compared with a relay without them: in a space with fifty pieces of evidence and
//! twenty guarantees, and with more and more certificates that do not hear the message.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Relay};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

const MESSAGES: u32 = 10_000;

/// The pieces of evidence of a certificate, and its guarantees.
const EVIDENCE: usize = 10;
const GUARANTEES: usize = 4;

/// Whether each piece of evidence has a topic of its own, or all those of a space read one.
#[derive(Clone, Copy, PartialEq)]
enum Topics {
    Own,
    One,
}

/// A space with so many certificates. Each begins with `s0_0`, `s0_1` …, or all read `shared`.
fn space(certificates: usize, topics: Topics) -> String {
    let (mut system, mut monitors) = (String::new(), String::new());
    for at in 0..certificates {
        let (mut evidence, mut guarantees) = (String::new(), String::new());
        let _ = writeln!(system, "  topic state{at} = \"state/{at}\" : int");
        for of in 0..EVIDENCE {
            let topic = if topics == Topics::Own { format!("s{at}_{of}") } else { "shared".to_owned() };
            if topics == Topics::Own {
                let _ = writeln!(system, "  topic {topic} = \"{topic}\" : real");
            }
            let stale = if of % 2 == 0 { " stale after 10s is unknown" } else { " held 3ms" };
            let _ = writeln!(evidence, "  evidence e{of} = {topic} > {}{stale}", of + at);
        }
        for of in 0..GUARANTEES {
            let least = 2 * of + 2;
            let all = (0..EVIDENCE).map(|of| format!("e{of}")).collect::<Vec<_>>().join(", ");
            let _ = writeln!(guarantees, "  guarantee g{of} integrity {} = {least} of ({all})", of + 1);
        }
        let _ = writeln!(monitors, "eddi m{at} publishes state{at} {{\n{evidence}{guarantees}  otherwise none\n}}");
    }
    format!(
        "space bench\nsystem {{\n  simulator sim = in_process \"sim::Sim\" {{ crate \"simulator\"  step 1ms }}\n  \
         topic command = \"command\" : real\n  topic shared = \"shared\" : real\n{system}}}\n{monitors}\
         metric fuzzing_time minimise = fuzzing_time()\noperation jitter on command = random offset [-1, 1]\n\
         campaign all {{\n  objectives fuzzing_time\n  operations jitter 1..5 per test\n  \
         search nsga2 {{ population 10  evaluations 210  seed 42 }}\n  end after 1000s\n}}\n"
    )
}

/// How long messages on these wires in turn take through a relay: one each millisecond, with values that change what
/// holds every hundredth time.
fn pass(plan: &CampaignPlan, wires: &WireTable, metrics: &MetricTable<'_>, heard: &[Wire]) -> Duration {
    let test = Test::default();
    let mut relay = Relay::new(plan, wires, &test, metrics.start(), &[]).expect("the test fits");
    relay.begin();
    for &wire in heard {
        relay.subscribed(wire);
    }
    let mut deliveries = Vec::new();
    let begin = Instant::now();
    for step in 0..MESSAGES {
        let now = SimTime::from_nanos(i64::from(step) * 1_000_000);
        relay.advance(now, &mut deliveries);
        let value = if step % 200 < 100 { 1e6 } else { -1e6 };
        relay.message(now, heard[step as usize % heard.len()], Value::Real(value), &mut deliveries);
        black_box(&deliveries);
        deliveries.clear();
    }
    begin.elapsed()
}

fn monitors(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("monitors");
    group.throughput(Throughput::Elements(u64::from(MESSAGES)));
    let mut measure = |name: BenchmarkId, plan: &CampaignPlan, is_heard: &dyn Fn(&str) -> bool| {
        let wires = WireTable::new(plan);
        let metrics = MetricTable::new(plan, &wires, &[]).expect("the space has no hooks");
        let heard: Vec<Wire> = wires.iter().filter(|&wire| is_heard(wires.path(wire))).collect();
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|times| (0..times).map(|_| pass(plan, &wires, &metrics, &heard)).sum());
        });
    };
    let is_own = |path: &str| path.starts_with('s') && path.contains('_');
    let five = sesame_bench::plan_of(&space(5, Topics::Own));
    assert_eq!(five.monitors.iter().map(|monitor| monitor.evidence.len()).sum::<usize>(), 50);
    assert_eq!(five.monitors.iter().map(|monitor| monitor.guarantees.len()).sum::<usize>(), 20);
    measure(BenchmarkId::new("50 evidence, 20 guarantees", "one of them hears each message"), &five, &is_own);
    let mut none = five.clone();
    none.monitors.clear();
    measure(BenchmarkId::new("no monitors", "the same messages"), &none, &is_own);
    let five = sesame_bench::plan_of(&space(5, Topics::One));
    measure(BenchmarkId::new("50 evidence, 20 guarantees", "all hear each message"), &five, &|path| path == "shared");
    for others in [0, 10, 100, 300] {
        let plan = sesame_bench::plan_of(&space(1 + others, Topics::Own));
        let is_of_first = |path: &str| path.starts_with("s0_");
        measure(BenchmarkId::new("one certificate hears, others do not", others), &plan, &is_of_first);
    }
    group.finish();
}

criterion_group!(benches, monitors);
criterion_main!(benches);
