//! A run of the cell under joint jitter, and the requirements that it violated. Shared by the sweep beside it and by
//! the crate's tests.

use kuka_cell_sim::arm::target_topic;
use kuka_cell_sim::zones::zone_topic;
use kuka_cell_sim::{CYCLE_TIME_TOPIC, GRIPPER_SPEED_TOPIC};
use sesame_runtime::rng::keyed_unit;
use sesame_runtime::simulator::bench::{Bench, Published, Tamper};
use sesame_runtime::simulator::{Setup, Simulator};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::Value;

/// A random offset added to each target of a joint of the R3200 for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jitter {
    /// Which joint.
    pub(crate) link: usize,
    /// Offsets are uniform within these, in rad.
    pub(crate) offset: (f64, f64),
    /// From when until when, in s.
    pub(crate) window: (f64, f64),
}

/// The results of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    /// R1: intervals of 0.2 s with a gripper inside Z1, Z2 or Z3.
    pub(crate) collisions: u32,
    /// R2: the highest speed of a gripper, in m/s.
    pub(crate) top_speed: f64,
    /// R3: the smallest distance of the R3200 to another arm, in mm.
    pub(crate) approach: f64,
    /// R4: the time of the first cycle in s, if it was completed.
    pub(crate) cycle_time: Option<f64>,
}

/// How a simulator is set up everywhere here.
pub(crate) fn setup(seed: u64) -> Setup {
    Setup::new(seed, SimTime::from_seconds(0.02))
}

/// 70 s of the cell, disturbed.
pub(crate) fn run<S: Simulator>(seed: u64, jitters: &[Jitter]) -> Bench<S> {
    let topics: Vec<String> = jitters.iter().map(|jitter| target_topic("R3200ProductMove", jitter.link)).collect();
    let jitters = jitters.to_vec();
    let tamper: Tamper = Box::new(move |now, topic, value| {
        let mut value = value;
        for (index, (jitter, jittered)) in jitters.iter().zip(&topics).enumerate() {
            let (from, until) = jitter.window;
            if topic == jittered && (from..until).contains(&now.seconds()) {
                let Value::Real(target) = value else { panic!("targets are real numbers") };
                let (low, high) = jitter.offset;
                let draw = keyed_unit(7, now.nanos().unsigned_abs(), index as u64);
                value = Value::Real(target + low + (high - low) * draw);
            }
        }
        Some(value)
    });
    let mut bench = Bench::start_tampered(&setup(seed), Some(tamper)).expect("the cell starts");
    bench.run_until(SimTime::from_seconds(70.0)).expect("the cell runs");
    bench
}

/// Computes the metrics of the requirements from a run.
pub(crate) fn outcome<S: Simulator>(bench: &Bench<S>) -> Outcome {
    let mut inside: Vec<SimTime> = ["Z1", "Z2", "Z3"]
        .iter()
        .flat_map(|zone| bench.published(&zone_topic(zone)))
        .filter(|message| level(message) < 0.0)
        .map(|message| message.time)
        .collect();
    inside.sort_unstable();
    let mut collisions = 0;
    let mut ready_at = SimTime::ZERO;
    for time in inside {
        if time >= ready_at {
            collisions += 1;
            ready_at = time + SimTime::from_seconds(0.2);
        }
    }
    let levels = |zone| bench.published(&zone_topic(zone)).iter().map(level);
    Outcome {
        collisions,
        top_speed: bench.published(GRIPPER_SPEED_TOPIC).iter().map(real).fold(0.0, f64::max),
        approach: levels("ZR270073").chain(levels("ZR270072")).fold(f64::INFINITY, f64::min),
        cycle_time: bench.published(CYCLE_TIME_TOPIC).first().map(real),
    }
}

/// The level of a safety zone message, in mm.
pub(crate) fn level(message: &Published) -> f64 {
    message.value.number_at(&["level"]).expect("safety zone messages have a level")
}

/// The number in a message that is a plain number.
pub(crate) fn real(message: &Published) -> f64 {
    message.value.number_at::<&str>(&[]).expect("the message is a number")
}
