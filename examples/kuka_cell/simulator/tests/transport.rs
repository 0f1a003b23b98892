//! The safety concept of the transport: what it prevents, and what it depends on.

#[path = "../examples/landscape/disturbed.rs"]
#[expect(dead_code, reason = "the sweep and the tests of the cell use the rest")]
mod disturbed;

use disturbed::{level, real, setup};
use kuka_cell_sim::arm::{state_topic, target_topic};
use kuka_cell_sim::safety::{
    BRAKE_TOPIC, LUMINANCE_TOPIC, PERMISSION_TOPIC, SCAN_TOPIC, STANDS_TOPIC, STOP_TOPIC, SUPPLY_TOPIC,
};
use kuka_cell_sim::zones::zone_topic;
use kuka_cell_sim::{CYCLE_TIME_TOPIC, Cell, TransportCell};
use sesame_runtime::simulator::bench::{Bench, Tamper};
use sesame_runtime::simulator::{Bus, Progress, Setup, Simulator, SimulatorError};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::Value;

const PRODUCT: &str = "R3200ProductMove";

/// The cell with somebody who commands a stop at 20 s, and lets it go on at 23 s.
struct Commanded(TransportCell);

impl Simulator for Commanded {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        TransportCell::start(setup, bus).map(Commanded)
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        let (stop, permission) = (bus.open(STOP_TOPIC), bus.open(PERMISSION_TOPIC));
        if bus.now() == SimTime::from_seconds(20.0) {
            bus.publish(permission, false);
            bus.publish(stop, true);
        }
        if bus.now() == SimTime::from_seconds(23.0) {
            bus.publish(permission, true);
        }
        self.0.step(bus)
    }
}

/// 70 s of a cell whose messages pass through `tamper`.
fn run<S: Simulator>(tamper: impl FnMut(f64, &str, Value) -> Option<Value> + 'static) -> Bench<S> {
    let mut tamper = tamper;
    let tamper: Tamper = Box::new(move |now, topic, value| tamper(now.seconds(), topic, value));
    let mut bench = Bench::start_tampered(&setup(0), Some(tamper)).expect("the cell starts");
    bench.run_until(SimTime::from_seconds(70.0)).expect("the cell runs");
    bench
}

/// The lower arm leans out too far, towards the people beside the inspection, from 30 s to 35 s.
fn pushed(now: f64, topic: &str, value: Value) -> Value {
    let pushed = topic == target_topic(PRODUCT, 1) && (30.0..35.0).contains(&now);
    match value {
        Value::Real(target) if pushed => Value::Real(target + 0.28),
        value => value,
    }
}

/// The smallest distance to a zone with people.
fn nearest<S: Simulator>(bench: &Bench<S>) -> f64 {
    let levels =
        ["Z1", "Z2", "Z3"].map(|zone| bench.published(&zone_topic(zone)).iter().map(level).fold(1e9, f64::min));
    levels.into_iter().fold(f64::INFINITY, f64::min)
}

fn stands<S: Simulator>(bench: &Bench<S>) -> Vec<f64> {
    let said = bench.published(STANDS_TOPIC).iter();
    said.filter(|message| message.value == Value::Bool(true)).map(|message| message.time.seconds()).collect()
}

#[test]
fn without_disturbance_the_transport_is_that_of_the_cell_and_never_stands() {
    let (with, without) = (run::<TransportCell>(|_, _, value| Some(value)), run::<Cell>(|_, _, value| Some(value)));
    for topic in without.topics() {
        assert_eq!(with.published(topic), without.published(topic), "{topic}");
    }
    assert_eq!(stands(&with), [0.0; 0]);
    assert_eq!(with.published(SCAN_TOPIC).len(), 3500);
}

#[test]
fn an_arm_that_is_pushed_towards_people_is_stopped_before_it_reaches_them() {
    let pushed = |now: f64, topic: &str, value| Some(pushed(now, topic, value));
    let unprotected = run::<Cell>(pushed);
    assert!(nearest(&unprotected) < -20.0, "{}", nearest(&unprotected));
    let bench = run::<TransportCell>(pushed);
    assert!(nearest(&bench) > 0.0, "{}", nearest(&bench));
    assert!((30.0..33.0).contains(&stands(&bench)[0]), "{:?}", stands(&bench).first());
    assert!(bench.published(CYCLE_TIME_TOPIC).is_empty(), "only a person lets go of the brake");
}

#[test]
fn the_concept_is_blind_without_scans_and_without_light() {
    let cut = |now: f64, topic: &str, value| {
        let cut = now >= 29.0 && topic == SCAN_TOPIC;
        (!cut).then(|| pushed(now, topic, value))
    };
    let dark = |now: f64, topic: &str, value| {
        let dark = now >= 29.0 && topic == LUMINANCE_TOPIC;
        Some(pushed(now, topic, if dark { Value::Real(50.0) } else { value }))
    };
    for bench in [run::<TransportCell>(cut), run::<TransportCell>(dark)] {
        assert!(nearest(&bench) < -20.0, "{}", nearest(&bench));
        assert_eq!(stands(&bench), [0.0; 0]);
    }
}

#[test]
fn a_brake_without_air_does_not_stop_the_arm_in_time() {
    let leaking = |now: f64, topic: &str, value| {
        let leaks = now >= 24.0 && topic == SUPPLY_TOPIC;
        Some(pushed(now, topic, if leaks { Value::Real(0.0) } else { value }))
    };
    let bench = run::<TransportCell>(leaking);
    assert!(nearest(&bench) < 0.0, "{}", nearest(&bench));
    let pressure = bench.published(BRAKE_TOPIC).iter().find(|message| real(message) < 4.0).unwrap().time.seconds();
    assert!((24.5..25.5).contains(&pressure), "it takes its time to run empty: {pressure}");
}

#[test]
fn a_stop_brakes_the_arm_and_the_transport_goes_on_where_it_was() {
    let bench = run::<Commanded>(|_, _, value| Some(value));
    let stood = stands(&bench);
    assert_eq!([stood[0], stood[stood.len() - 1]], [20.0, 22.98]);
    let speed = |from: f64, to: f64| {
        let states = bench.published(&state_topic(PRODUCT)).iter();
        let within = states.filter(|state| (from..to).contains(&state.time.seconds()));
        within.map(|state| state.value.number_at(&["gripper_speed"]).unwrap()).fold(0.0, f64::max)
    };
    assert!(speed(19.0, 20.0) > 0.5 && speed(20.3, 23.0) == 0.0 && speed(23.0, 26.0) > 0.5);
    let undisturbed = run::<Cell>(|_, _, value| Some(value));
    let cycle = |published: &[sesame_runtime::simulator::bench::Published]| real(&published[0]);
    let later = cycle(bench.published(CYCLE_TIME_TOPIC)) - cycle(undisturbed.published(CYCLE_TIME_TOPIC));
    assert!((2.5..=3.5).contains(&later), "{later}");
}
