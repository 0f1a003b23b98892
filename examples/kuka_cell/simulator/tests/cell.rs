//! The cell without disturbance, and how disturbances violate its requirements.

#[path = "../examples/landscape/disturbed.rs"]
mod disturbed;

use disturbed::{Jitter, Outcome, level, outcome, real, run, setup};
use kuka_cell_sim::arm::{R3200, R270072, R270073, state_topic, target_topic};
use kuka_cell_sim::zones::zone_topic;
use kuka_cell_sim::{Cell, NoisyCell};
use sesame_runtime::simulator::bench::{Bench, Published};
use sesame_runtime::simulator::{Setup, Simulator};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::{Text, Value};

const PRODUCT: &str = "R3200ProductMove";
const UP: (f64, f64) = (0.27, 0.29);
const DOWN: (f64, f64) = (-0.29, -0.27);

fn jittered(link: usize, offset: (f64, f64), window: (f64, f64)) -> Outcome {
    outcome(&run::<Cell>(0, &[Jitter { link, offset, window }]))
}

/// The times at which a condition holds.
fn times(messages: &[Published], holds: impl Fn(&Published) -> bool) -> Vec<f64> {
    messages.iter().filter(|message| holds(message)).map(|message| message.time.seconds()).collect()
}

/// Asserts that these times are all within a span, and extend approximately from one end to the other.
fn assert_during(times: &[f64], span: (f64, f64), what: &str) {
    let first = times.first().unwrap_or_else(|| panic!("{what}: never"));
    let last = times.last().expect("there is a first");
    assert!(span.0 <= *first && *last <= span.1, "{what}: from {first} to {last}, expected within {span:?}");
}

#[test]
fn without_disturbance_it_satisfies_all_requirements_with_a_margin() {
    let bench = run::<Cell>(0, &[]);
    let outcome = outcome(&bench);
    assert_eq!(outcome.collisions, 0);
    assert!(outcome.top_speed < 1.8, "{outcome:?}");
    assert!(outcome.approach > 400.0, "{outcome:?}");
    assert!((64.0..68.0).contains(&outcome.cycle_time.unwrap()), "{outcome:?}");
    for zone in ["Z1", "Z2", "Z3", "Z4", "Z5", "Z6"] {
        assert!(bench.published(&zone_topic(zone)).iter().all(|message| level(message) >= 80.0), "{zone}");
    }
    assert!(bench.published(&zone_topic("ZR270073R270072")).iter().all(|message| level(message) > 400.0));
}

#[test]
fn the_r3200_passes_joint_extremes_and_trigger_zones_each_at_its_point_of_the_cycle() {
    let bench = run::<Cell>(0, &[]);
    let link = |link, holds: fn(f64) -> bool| {
        times(bench.published(&target_topic(PRODUCT, link)), |message| holds(real(message)))
    };
    let near = |zone| times(bench.published(&zone_topic(zone)), |message| level(message) < 300.0);
    assert_during(&link(0, |q| q > 2.5), (4.0, 19.0), "Link0 above 2.5: at the infeed");
    assert_during(&near("ZTRIG2"), (9.0, 16.0), "ZTRIG2: picking from the infeed");
    assert_during(&near("ZTRIG1"), (22.0, 26.0), "ZTRIG1: carrying past the right-hand surface");
    assert_during(&link(1, |q| q > 0.8), (29.0, 34.0), "Link1 above 0.8: stretched out for the inspection");
    assert_during(&link(0, |q| q < -2.5), (39.0, 60.0), "Link0 below -2.5: at the workers' station");
    assert_during(&near("ZTRIG3"), (44.0, 53.0), "ZTRIG3: placing near the workers");
    // Drawn in twice: before and after the inspection.
    let drawn_in = link(1, |q| q < -0.4);
    let (before, after): (Vec<f64>, Vec<f64>) = drawn_in.iter().partition(|&&time| time < 31.0);
    assert_during(&before, (15.0, 28.0), "Link1 below -0.4: carrying from the infeed");
    assert_during(&after, (34.0, 43.0), "Link1 below -0.4: carrying to the workers");
    // The thresholds' other ends are the ends of the metrics' scales.
    assert!(link(0, |q| q.abs() > std::f64::consts::PI).is_empty());
    assert!(link(1, |q| !(-0.5..=0.9).contains(&q)).is_empty());
}

#[test]
fn each_topic_carries_a_message_every_step() {
    let bench = run::<Cell>(0, &[]);
    let arms = [R3200.name, R270073.name, R270072.name];
    let joints = arms.iter().flat_map(|arm| (0..6).map(|link| target_topic(arm, link)));
    let states = arms.iter().map(|arm| state_topic(arm));
    let zones = ["Z1", "Z2", "Z3", "Z4", "Z5", "Z6", "ZTRIG1", "ZTRIG2", "ZTRIG3", "ZR270073", "ZR270072"];
    let zones = zones.iter().map(|zone| zone_topic(zone));
    for topic in joints.chain(states).chain(zones).chain(["cell/gripper_speed".to_owned()]) {
        assert_eq!(bench.published(&topic).len(), 3500, "{topic}");
    }
}

#[test]
fn joint_topics_and_safety_zone_messages_are_those_of_the_original_platform() {
    assert_eq!(target_topic(R3200.name, 0), "joints/R3200ProductMove/Link0/R/position");
    assert_eq!(target_topic(R270073.name, 5), "joints/R270073/Link5/R/position");
    let bench = run::<Cell>(0, &[]);
    // After 12 s, as the R3200 picks.
    let Value::Record(message) = &bench.published("safetyzones/Z1")[599].value else { panic!("a record") };
    let names: Vec<&str> = message.fields().names().iter().map(Text::as_str).collect();
    assert_eq!(names, ["zone", "level", "object1", "object2"]);
    assert_eq!(message.get("zone"), Some(&Value::from("Z1")));
    assert_eq!(message.get("object2"), Some(&Value::from("GripperR3200ProductMove")));
}

#[test]
fn the_next_cycle_starts_at_the_takt_and_takes_as_long() {
    let mut bench = Bench::<Cell>::start(&setup(0)).unwrap();
    bench.run_until(SimTime::from_seconds(140.0)).unwrap();
    let cycles: Vec<f64> = bench.published("cell/cycle_time").iter().map(real).collect();
    assert_eq!(cycles.len(), 2);
    assert!((cycles[0] - cycles[1]).abs() <= 0.02, "{cycles:?}");
}

#[test]
fn a_known_bias_of_link1_brings_the_gripper_into_zones_for_some_of_the_time() {
    let known = jittered(1, UP, (8.0, 57.0));
    assert!((5..=40).contains(&known.collisions), "{known:?}");
}

#[test]
fn it_matters_when_and_which_way_a_joint_is_off() {
    let collisions = |link, offset, from| jittered(link, offset, (from, from + 5.0)).collisions;
    // At the infeed Z1 lies on one side, at the workers' station Z3 on the other.
    assert!(collisions(0, UP, 10.0) > 10);
    assert_eq!(collisions(0, DOWN, 10.0), 0);
    assert!(collisions(0, DOWN, 45.0) > 10);
    assert_eq!(collisions(0, UP, 45.0), 0);
    // Leaning forward stretches a high arm out, over the inspection surface into Z2; leaning back enters no zone.
    assert!(collisions(1, UP, 30.0) > 5);
    assert_eq!(collisions(1, DOWN, 30.0), 0);
    // Drawn in for carrying, the arm is far from every zone.
    for (link, offset) in [(0, UP), (0, DOWN), (1, UP), (1, DOWN)] {
        assert_eq!(collisions(link, offset, 20.0), 0, "Link{link}");
    }
}

#[test]
fn a_bias_harms_and_noise_of_the_same_amplitude_is_smoothed_by_the_drives() {
    let bias = jittered(0, DOWN, (0.0, 65.0));
    let noise = jittered(0, (-0.3, 0.3), (0.0, 65.0));
    assert!(bias.collisions > 30 && noise.collisions < bias.collisions / 10, "{bias:?} {noise:?}");
}

#[test]
fn a_small_bias_does_less_than_a_large_one() {
    let collisions = [(0.04, 0.06), (0.1, 0.17), UP].map(|offset| jittered(0, offset, (0.0, 65.0)).collisions);
    assert!(collisions.is_sorted() && collisions[0] < collisions[2], "{collisions:?}");
}

#[test]
fn speed_approach_and_cycle_time_can_be_broken() {
    let speed = jittered(0, UP, (30.0, 35.0)).top_speed;
    assert!(speed > 2.2, "R2: {speed} m/s");
    let approach = jittered(0, DOWN, (10.0, 15.0)).approach;
    assert!(approach < 200.0, "R3: {approach} mm");
    assert!(jittered(1, UP, (8.0, 57.0)).cycle_time.is_none_or(|seconds| seconds > 70.0), "R4");
    assert!(
        jittered(0, UP, (45.0, 50.0)).cycle_time.is_some_and(|seconds| seconds <= 70.0),
        "one late arrival is borne"
    );
}

#[test]
fn an_arm_holds_its_last_target_while_messages_are_lost_and_catches_up_afterwards() {
    let topic = target_topic(PRODUCT, 0);
    let (dropped, lost_from, lost_until) = (topic.clone(), 22.0, 24.0);
    let tamper = move |now: SimTime, name: &str, value| {
        let lost = name == dropped && (lost_from..lost_until).contains(&now.seconds());
        (!lost).then_some(value)
    };
    let mut bench = Bench::<Cell>::start_tampered(&setup(0), Some(Box::new(tamper))).unwrap();
    let measured = |bench: &Bench<Cell>| bench.simulator().arms()[0].joints()[0];
    let target = |bench: &Bench<Cell>| real(bench.published(&topic).last().unwrap());
    bench.run_until(SimTime::from_seconds(lost_from - 0.02)).unwrap();
    let last = target(&bench);
    bench.run_until(SimTime::from_seconds(lost_until - 0.02)).unwrap();
    assert!((measured(&bench) - last).abs() < 0.01, "it stands where it was last told to be");
    assert!((measured(&bench) - target(&bench)).abs() > 0.5, "the programme has gone on");
    bench.run_until(SimTime::from_seconds(26.5)).unwrap();
    assert!((measured(&bench) - target(&bench)).abs() < 0.05, "caught up");
}

#[test]
fn targets_that_are_no_numbers_are_not_taken() {
    let broken = |bad: Value| {
        let tamper = move |_: SimTime, name: &str, value| {
            Some(if name.starts_with("joints/R3200ProductMove") { bad.clone() } else { value })
        };
        let mut bench = Bench::<Cell>::start_tampered(&setup(0), Some(Box::new(tamper))).unwrap();
        let before = bench.simulator().arms()[0].joints();
        bench.run_until(SimTime::from_seconds(5.0)).unwrap();
        (before, bench.simulator().arms()[0].joints())
    };
    for bad in [Value::Real(f64::NAN), Value::Real(f64::INFINITY), Value::from("closed")] {
        let (before, after) = broken(bad);
        assert_eq!(before, after);
    }
}

#[test]
fn joints_keep_their_ranges_and_speeds_for_any_command() {
    for absurd in [1e9, -1e9] {
        let tamper = move |_: SimTime, name: &str, value| {
            Some(if name.starts_with("joints/") { Value::Real(absurd) } else { value })
        };
        let mut bench = Bench::<Cell>::start_tampered(&setup(0), Some(Box::new(tamper))).unwrap();
        for step in 1..=500 {
            bench.run_until(SimTime::from_seconds(0.02 * f64::from(step))).unwrap();
            for arm in bench.simulator().arms() {
                for (link, limits) in arm.model().joints.iter().enumerate() {
                    assert!((limits.lower..=limits.upper).contains(&arm.joints()[link]));
                    assert!(arm.joint_speeds()[link].abs() <= limits.speed);
                }
            }
        }
        let stops = bench.simulator().arms()[0].joints();
        let expected = R3200.joints.map(|limits| if absurd > 0.0 { limits.upper } else { limits.lower });
        assert!(stops.iter().zip(expected).all(|(is, stop)| (is - stop).abs() < 1e-6), "{stops:?}");
    }
}

#[test]
fn the_arm_does_not_pick_before_the_infeed_has_made_its_end_switch() {
    let tamper = |_: SimTime, name: &str, value| (name != "conveyors/Infeed/position").then_some(value);
    let mut bench = Bench::<Cell>::start_tampered(&setup(0), Some(Box::new(tamper))).unwrap();
    bench.run_until(SimTime::from_seconds(80.0)).unwrap();
    assert!(bench.published("conveyors/Infeed/measured").iter().all(|message| real(message) == 0.0));
    assert!(times(bench.published("safetyzones/ZTRIG2"), |message| level(message) < 300.0).is_empty());
    assert!(bench.published("cell/cycle_time").is_empty());
}

/// Everything a run published, to be compared.
fn everything<S: Simulator>(bench: &Bench<S>) -> Vec<(String, Vec<Published>)> {
    bench.topics().map(|topic| (topic.to_owned(), bench.published(topic).to_vec())).collect()
}

#[test]
fn the_same_disturbance_gives_the_same_run_for_every_seed() {
    let jitter = [Jitter { link: 0, offset: (-0.3, 0.3), window: (3.0, 60.0) }];
    let run = |seed| everything(&run::<Cell>(seed, &jitter));
    assert!(run(1) == run(1));
    assert!(run(1) == run(2));
}

#[test]
fn torque_noise_follows_the_seed_and_breaks_nothing_by_itself() {
    let first = run::<NoisyCell>(1, &[]);
    assert!(everything(&first) == everything(&run::<NoisyCell>(1, &[])));
    for seed in 2..6 {
        let other = run::<NoisyCell>(seed, &[]);
        assert!(everything(&first) != everything(&other));
        let outcome = outcome(&other);
        assert_eq!(outcome.collisions, 0);
        assert!(outcome.top_speed < 1.9 && outcome.approach > 400.0, "{outcome:?}");
        assert!(outcome.cycle_time.unwrap() < 68.0, "{outcome:?}");
    }
}

#[test]
fn a_step_that_does_not_suit_is_refused_in_words() {
    let start = |nanos| Bench::<Cell>::start(&Setup::new(0, SimTime::from_nanos(nanos))).err();
    for nanos in [0, -20_000_000, 100_000_000] {
        let message = start(nanos).expect("refused").to_string();
        assert!(message.contains("at most 50 ms"), "{message}");
    }
    assert_eq!(start(10_000_000), None);
}
