//! Ways from a publisher to a subscriber: how long messages take over each, measured in turn.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Relay;
use sesame_relay::transport::Connect;
use sesame_relay::wire::WireTable;
use sesamec::frontend::{Look, SESAME};

/// Latencies in nanoseconds, ascending, and how long all messages took.
#[derive(Debug)]
pub struct Measured {
    /// The latency of each message.
    pub latencies: Vec<u64>,
    /// How long all messages together took, in seconds.
    pub seconds: f64,
}

/// The plan of the only campaign in this text.
pub fn plan(space: &str) -> CampaignPlan {
    let checked = (SESAME.check)("bench.sesame", space, Look::Short);
    assert_eq!(checked.errors, 0, "{}", checked.diagnostics);
    checked.plans.into_iter().map(|runner| runner.plan).next().expect("there is a campaign")
}

/// Sesame's relay without a disturbance, for as long as `within` takes, which advances it by so much simulation time.
pub fn while_relayed(plan: &CampaignPlan, connect: &Connect, within: impl FnOnce(&mut dyn FnMut(SimTime))) {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).expect("the space has no hooks");
    let mut transport = connect.transport(plan);
    let mut relay = Relay::new(plan, &wires, &Test::default(), metrics.start(), &[]).expect("the test fits the plan");
    relay.begin();
    transport.reset(1, &mut relay).unwrap_or_else(|error| panic!("{error}"));
    within(&mut |time| {
        let until = transport.now() + time;
        transport.advance(until, &mut relay).unwrap_or_else(|error| panic!("{error}"));
    });
}

/// Tells relays to stop, also when what is measured beside them fails.
struct Stopped<'a>(&'a AtomicBool);

impl Drop for Stopped<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Sesame's relay without a disturbance, and `other` beside it until it is told to stop, for as long as `within` takes.
pub fn beside(plan: &CampaignPlan, connect: &Connect, other: impl FnOnce(&AtomicBool) + Send, within: impl FnOnce()) {
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| other(&stop));
        scope.spawn(|| {
            while_relayed(plan, connect, |advance| {
                while !stop.load(Ordering::Relaxed) {
                    advance(SimTime::from_nanos(50_000_000));
                }
            });
        });
        let _stopped = Stopped(&stop);
        within();
    });
}

/// Sends so many messages, one each time that `turn` returns, and receives them all. `turn` is told the number of the
/// message and how many have come; `receive` waits a moment and hands on the numbers of those that have come.
pub fn exchange(
    name: &str,
    count: u64,
    turn: impl Fn(u64, &AtomicU64) + Sync,
    mut send: impl FnMut(u64) + Send,
    mut receive: impl FnMut(&mut dyn FnMut(u64)),
) -> Measured {
    let begin = Instant::now();
    let nanos = || u64::try_from(begin.elapsed().as_nanos()).expect("it is soon over");
    let sent: Vec<AtomicU64> = (0..count).map(|_| AtomicU64::new(0)).collect();
    let received = AtomicU64::new(0);
    let mut latencies = Vec::new();
    let place = |number: u64| &sent[usize::try_from(number).expect("few")];
    thread::scope(|scope| {
        scope.spawn(|| {
            for at in 0..count {
                turn(at, &received);
                place(at).store(nanos(), Ordering::Release);
                send(at);
            }
        });
        let mut come = 0;
        let mut latest = begin;
        while come < count {
            assert!(latest.elapsed() < Duration::from_secs(30), "{name}: no more than {come} of {count} come");
            receive(&mut |number| {
                latencies.push(nanos() - place(number).load(Ordering::Acquire));
                come += 1;
                latest = Instant::now();
                received.store(come, Ordering::Release);
            });
        }
    });
    let seconds = begin.elapsed().as_secs_f64();
    latencies.sort_unstable();
    Measured { latencies, seconds }
}

/// Waits until a message is due.
pub fn at_200_hz(begin: Instant, at: u64) {
    let due = begin + Duration::from_millis(5) * u32::try_from(at).expect("few");
    thread::sleep(due.saturating_duration_since(Instant::now()));
}

/// So many rounds of each way, in turn.
pub fn rounds<W>(ways: &mut [W], count: usize, mut measure: impl FnMut(&mut W) -> Measured) -> Vec<Vec<Measured>> {
    let mut all: Vec<Vec<Measured>> = ways.iter().map(|_| Vec::new()).collect();
    for _ in 0..count {
        for (way, all) in ways.iter_mut().zip(&mut all) {
            all.push(measure(way));
        }
    }
    all
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

/// Prints a table of ways, of which the first is the direct one and the last is Sesame's, and what Sesame adds in
/// ratio to what each of the others adds.
pub fn print(title: &str, names: &[&str], measured: &[Vec<Measured>]) {
    let added = |rounds: &[Measured], percent| percentile(rounds, percent) - percentile(&measured[0], percent);
    println!("\n| {title} | p50 | p99 | added p50 | added p99 | messages per second |\n|---|---:|---:|---:|---:|---:|");
    for (name, rounds) in names.iter().zip(measured) {
        let [p50, p99] = [50, 99].map(|percent| percentile(rounds, percent));
        let [more_50, more_99] = [50, 99].map(|percent| added(rounds, percent));
        let rate = median(rounds, |round| round.latencies.len() as f64 / round.seconds);
        println!("| {name} | {p50:.0} µs | {p99:.0} µs | {more_50:.0} µs | {more_99:.0} µs | {rate:.0} |");
    }
    let (sesame, others) = measured.split_last().expect("there are ways");
    println!();
    for (name, other) in names.iter().zip(others).skip(1) {
        let [added_50, added_99] = [50, 99].map(|percent| added(sesame, percent) / added(other, percent));
        let [p50, p99] = [50, 99].map(|percent| percentile(sesame, percent) / percentile(other, percent));
        println!("Sesame : {name}: added p50 {added_50:.2}, added p99 {added_99:.2}, p50 {p50:.2}, p99 {p99:.2}");
    }
}

/// A Python or a folder that a variable names, if it is there.
pub fn named(variable: &str) -> Option<std::path::PathBuf> {
    let found = std::env::var_os(variable).map(std::path::PathBuf::from).filter(|path| Path::exists(path));
    if found.is_none() {
        println!("skipped: {variable} names nothing; `./test` makes it");
    }
    found
}
