//! The program driven by grpcio: its runs are those of the cell.
//!
//! `SESAME_SIMLOG` names the Python, which `./test` sets up. Without it the tests say that they are skipped, and fail
//! with `CI=true`.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use kuka_cell_sim::Cell;
use sesame_peers::Ended;
use sesame_runtime::simulator::bench::Bench;
use sesame_runtime::simulator::{Hosted, Setup, Simulator as _};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::Value;

const STEP: SimTime = SimTime::from_nanos(20_000_000);
const STEPS: u32 = 500;
const TARGET: &str = "joints/R3200ProductMove/Link0/R/position";
const DISTURBANCE: f64 = 0.25;

/// What the driver heard, by name on the wire.
type Heard = BTreeMap<String, Vec<f64>>;

fn python() -> Option<PathBuf> {
    sesame_peers::named("SESAME_SIMLOG")
}

/// What Python hears in these many steps.
fn driven(arguments: &[&str]) -> Option<Heard> {
    let python = python()?;
    let mut child = Command::new(env!("CARGO_BIN_EXE_kuka_cell_simlog"))
        .args(["--simlog", "127.0.0.1:0"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let output = child.stdout.take().expect("it is a pipe");
    let served = Ended(child);
    let line = BufReader::new(output).lines().next().expect("it says where it listens").expect("in words");
    let port = line.rsplit(':').next().expect("there is a port").to_owned();
    let steps = STEPS.to_string();
    let driver = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/drive.py");
    let driven = Command::new(python).args([driver, &port, &steps]).args(arguments).output().expect("Python starts");
    drop(served);
    let said = String::from_utf8_lossy(&driven.stderr);
    assert!(driven.status.success(), "the driver failed: {said}");
    eprintln!("{said}");
    let heard: serde_json::Value = serde_json::from_slice(&driven.stdout).expect("it prints JSON");
    assert_eq!(heard["now"], 10.0, "500 steps of 20 ms");
    Some(serde_json::from_value(heard["heard"].clone()).expect("it heard numbers"))
}

fn number(value: &Value) -> f64 {
    value.number_at(&["level"]).or(value.number_at::<&str>(&[])).expect("it is a number")
}

/// The simulator's name of what the driver heard.
fn topic(name: &str) -> &str {
    name.strip_suffix("/in").unwrap_or(name)
}

fn same(heard: &Heard, expected: impl Fn(&str) -> Vec<f64>) {
    assert_eq!(heard.len(), 5);
    for (name, heard) in heard {
        let expected = expected(topic(name));
        assert_eq!((heard.len(), expected.len()), (500, 500), "{name}");
        for (at, (heard, expected)) in heard.iter().zip(&expected).enumerate() {
            let tolerance = 1e-5 * expected.abs().max(1.0);
            assert!((heard - expected).abs() <= tolerance, "{name} in step {at}: {heard}, not {expected}");
        }
    }
}

#[test]
fn listening_changes_nothing() {
    let Some(heard) = driven(&[]) else { return };
    let mut bench = Bench::<Cell>::start(&Setup::new(1, STEP)).expect("the cell starts");
    bench.run_until(SimTime::from_nanos(STEP.nanos() * i64::from(STEPS))).expect("it runs");
    same(&heard, |topic| bench.published(topic).iter().map(|message| number(&message.value)).collect());
}

#[test]
fn what_is_injected_is_what_the_arm_hears() {
    let Some(heard) = driven(&["--disturb", &DISTURBANCE.to_string()]) else { return };
    let mut cell = Hosted::start(&Setup::new(1, STEP), Cell::start).expect("the cell starts");
    assert!(cell.cut(TARGET, true));
    let mut expected = BTreeMap::<String, Vec<f64>>::new();
    for _ in 0..STEPS {
        cell.step().expect("it takes steps");
        for message in cell.take() {
            if message.topic == TARGET {
                cell.deliver(TARGET, Value::Real(number(&message.value) + DISTURBANCE));
            }
            if heard.keys().any(|name| topic(name) == message.topic) {
                expected.entry(message.topic).or_default().push(number(&message.value));
            }
        }
    }
    same(&heard, |topic| expected[topic].clone());
    // The disturbance is there: the cell moves otherwise than it would by itself.
    let mut bench = Bench::<Cell>::start(&Setup::new(1, STEP)).expect("the cell starts");
    bench.run_until(SimTime::from_nanos(STEP.nanos() * i64::from(STEPS))).expect("it runs");
    let alone: Vec<f64> = bench.published("safetyzones/Z1").iter().map(|message| number(&message.value)).collect();
    let apart = alone.iter().zip(&expected["safetyzones/Z1"]).map(|(alone, fuzzed)| (alone - fuzzed).abs());
    assert!(apart.fold(0.0, f64::max) > 10.0, "a quarter of a radian moves the gripper by millimetres");
}
