//! What the relay adds to a message between two nodes of ROS 2: the latency beside that of the direct way, and of a
//! bare relay over the same DDS library that only hands bytes on. At 200 Hz, and at saturation: as fast as messages
//! pass with a hundred of them under way.
//!
//! The nodes are participants of this process, on the loopback interface. The three ways take turns.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_codegen::frontend::{Look, SESAME};
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Relay;
use sesame_relay::wire::WireTable;
use sesame_tests::dds::{JOINTS, Reader, Writer, joints, number, participant};

/// One that no example uses.
const DOMAIN: u16 = 199;

/// With joints of an arm as messages, of which an operation may act on one.
const SPACE: &str = r#"
space bench

system {
  simulator peers = ros2 { domain 199 }
  message Header = "std_msgs/msg/Header" { stamp: real[s]  frame_id: text }
  message Joints = "sensor_msgs/msg/JointState" {
    header: Header  name: list of text  position: list of real  velocity: list of real  effort: list of real
  }
  topic peer = "/peer" : Joints
  node hearing { subscribes peer }
}

metric disturbed minimise = fuzzing_time()
operation off on peer.position[0] = bias [-1, 1]

campaign look {
  objectives disturbed
  operations off   1 per test
  search     random { evaluations 1 }
  end        after 100000s
}
"#;

/// How many messages are under way at saturation.
const WINDOW: u64 = 100;

/// Hands bytes on until it is told to stop: what a relay costs at least.
fn bare(stop: &AtomicBool) {
    let participant = participant(DOMAIN);
    let mut reader = Reader::new(&participant, "rt/bare/undisturbed", JOINTS);
    let writer = Writer::new(&participant, "rt/bare", JOINTS);
    while !stop.load(Ordering::Relaxed) {
        reader.take(|message| writer.write(message));
    }
}

/// Sesame's relay, until it is told to stop.
fn sesame(plan: &CampaignPlan, stop: &AtomicBool) {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).expect("the space has no hooks");
    let mut transport = sesame_ros2::ros2(PathBuf::from(".")).transport(plan);
    let mut relay = Relay::new(plan, &wires, &Test::default(), metrics.start(), &[]).expect("the test fits the plan");
    relay.begin();
    transport.reset(1, &mut relay).expect("its nodes are there");
    while !stop.load(Ordering::Relaxed) {
        let until = transport.now() + SimTime::from_nanos(50_000_000);
        transport.advance(until, &mut relay).expect("nothing fails");
    }
}

/// A way from the publisher to the subscriber.
struct Way {
    name: &'static str,
    writer: Writer,
    reader: Reader,
    sent: u64,
}

/// Latencies in nanoseconds, ascending, and how long all messages took.
struct Measured {
    latencies: Vec<u64>,
    seconds: f64,
}

/// The median over rounds of what a round has: a round in which the machine did something else counts no more than
/// any other.
fn median(rounds: &[Measured], of: impl Fn(&Measured) -> f64) -> f64 {
    let mut values: Vec<f64> = rounds.iter().map(of).collect();
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// In microseconds.
fn percentile(rounds: &[Measured], percent: usize) -> f64 {
    median(rounds, |Measured { latencies, .. }| {
        latencies[(latencies.len() * percent / 100).min(latencies.len() - 1)] as f64 / 1000.0
    })
}

fn rate(rounds: &[Measured]) -> f64 {
    median(rounds, |round| round.latencies.len() as f64 / round.seconds)
}

impl Way {
    /// Sends so many messages, one each time that `turn` returns, and receives them all.
    fn measure(&mut self, count: u64, turn: impl Fn(u64, &AtomicU64) + Sync) -> Measured {
        let begin = Instant::now();
        let nanos = || u64::try_from(begin.elapsed().as_nanos()).expect("it is soon over");
        let first = self.sent;
        self.sent += count;
        let sent: Vec<AtomicU64> = (0..count).map(|_| AtomicU64::new(0)).collect();
        let received = AtomicU64::new(0);
        let (writer, reader) = (&self.writer, &mut self.reader);
        let mut latencies = Vec::new();
        thread::scope(|scope| {
            scope.spawn(|| {
                for at in 0..count {
                    turn(at, &received);
                    let message = joints(first + at);
                    sent[usize::try_from(at).expect("few")].store(nanos(), Ordering::Release);
                    writer.write(message);
                }
            });
            let mut come = 0;
            while come < count {
                assert!(begin.elapsed() < Duration::from_secs(300), "{}: {come} of {count} have come", self.name);
                reader.take(|message| {
                    let number = number(&message) - first;
                    let sent = sent[usize::try_from(number).expect("few")].load(Ordering::Acquire);
                    latencies.push(nanos() - sent);
                    come += 1;
                    received.store(come, Ordering::Release);
                });
            }
        });
        let seconds = begin.elapsed().as_secs_f64();
        latencies.sort_unstable();
        Measured { latencies, seconds }
    }

    fn at_200_hz(&mut self, count: u64) -> Measured {
        let begin = Instant::now();
        self.measure(count, |at, _| {
            let due = begin + Duration::from_millis(5) * u32::try_from(at).expect("few");
            thread::sleep(due.saturating_duration_since(Instant::now()));
        })
    }

    fn at_saturation(&mut self, count: u64) -> Measured {
        self.measure(count, |at, received| {
            while at - received.load(Ordering::Acquire).min(at) >= WINDOW {
                thread::yield_now();
            }
        })
    }
}

/// So many rounds of each way, in turn.
fn rounds(ways: &mut [Way], count: usize, mut measure: impl FnMut(&mut Way) -> Measured) -> Vec<Vec<Measured>> {
    let mut all: Vec<Vec<Measured>> = ways.iter().map(|_| Vec::new()).collect();
    for _ in 0..count {
        for (way, all) in ways.iter_mut().zip(&mut all) {
            all.push(measure(way));
        }
    }
    all
}

fn print(title: &str, ways: &[Way], measured: &[Vec<Measured>]) {
    let [direct, bare, sesame] = measured else { panic!("there are three ways") };
    let added = |rounds, percent| percentile(rounds, percent) - percentile(direct, percent);
    println!("\n| {title} | p50 | p99 | added p50 | added p99 | messages per second |\n|---|---:|---:|---:|---:|---:|");
    for (way, rounds) in ways.iter().zip(measured) {
        let [p50, p99] = [50, 99].map(|percent| percentile(rounds, percent));
        let [more_50, more_99] = [50, 99].map(|percent| added(rounds, percent));
        let rate = rate(rounds);
        println!("| {} | {p50:.0} µs | {p99:.0} µs | {more_50:.0} µs | {more_99:.0} µs | {rate:.0} |", way.name);
    }
    let [added_50, added_99] = [50, 99].map(|percent| added(sesame, percent) / added(bare, percent));
    let [p50, p99] = [50, 99].map(|percent| percentile(sesame, percent) / percentile(bare, percent));
    println!("\nSesame : bare: added p50 {added_50:.2}, added p99 {added_99:.2}, p50 {p50:.2}, p99 {p99:.2}");
}

fn main() {
    // Cargo tells whether it measures or only tries that this works.
    let measured = std::env::args().any(|word| word == "--bench");
    let checked = (SESAME.check)("bench.sesame", SPACE, Look::Short);
    assert_eq!(checked.errors, 0, "{}", checked.diagnostics);
    let plan = checked.plans.into_iter().map(|runner| runner.plan).next().expect("there is a campaign");

    let (publisher, subscriber) = (participant(DOMAIN), participant(DOMAIN));
    let named = [
        ("direct", "rt/direct", "rt/direct"),
        ("a bare relay", "rt/bare/undisturbed", "rt/bare"),
        ("Sesame", "rt/peer/undisturbed", "rt/peer"),
    ];
    let mut ways = named.map(|(name, from, to)| Way {
        name,
        writer: Writer::new(&publisher, from, JOINTS),
        reader: Reader::new(&subscriber, to, JOINTS),
        sent: 0,
    });
    let stop = Arc::new(AtomicBool::new(false));
    let relays = [
        thread::spawn({
            let stop = Arc::clone(&stop);
            move || bare(&stop)
        }),
        thread::spawn({
            let stop = Arc::clone(&stop);
            move || sesame(&plan, &stop)
        }),
    ];
    // Until all have found each other.
    thread::sleep(Duration::from_secs(5));
    let (times, slow, fast) = if measured { (20, 400, 20_000) } else { (1, 20, 1_000) };
    rounds(&mut ways, 1, |way| way.at_200_hz(20));
    let results = rounds(&mut ways, times, |way| way.at_200_hz(slow));
    print("200 Hz", &ways, &results);
    let results = rounds(&mut ways, times, |way| way.at_saturation(fast));
    print("saturation", &ways, &results);
    stop.store(true, Ordering::Relaxed);
    for relay in relays {
        relay.join().expect("no relay panics");
    }
}
