//! Multi-robot position integration against the truth: two robots are recorded one at a time, their recordings are laid
//! over each other, and the contact found is compared with that of a simulation in which both are present.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]

use proptest::prelude::*;
use sesame_safety::Vector;
use sesame_safety::alignment::Alignment;
use sesame_safety::body::{Body, Shape};
use sesame_safety::contact::{TOLERANCE, contacts};
use sesame_safety::coupling::{Coupling, Tolerance, by_motion};
use sesame_safety::trace::Trace;

/// A step of the simulation, in seconds.
const STEP: f64 = 0.002;
/// Steps of a run.
const STEPS: usize = 2000;
/// The radius of each robot, in metres.
const RADIUS: f64 = 0.3;
/// What a robot at most gains in a second, in metres per second.
const SPEED: f64 = 1.5;

/// A robot that drives from one goal to the next.
#[derive(Debug, Clone)]
struct Robot {
    position: Vector,
    goals: Vec<Vector>,
    /// Nearer to another robot than this, in metres, it waits; 0 if it does not look.
    careful: f64,
    /// When its clock says 0, in seconds of the test.
    clock: f64,
}

impl Robot {
    fn step(&mut self, other: Option<Vector>) {
        let waits = other.is_some_and(|other| (other - self.position).length() < self.careful);
        let Some(&goal) = self.goals.first() else { return };
        if waits {
            return;
        }
        let way = goal - self.position;
        if way.length() <= SPEED * STEP {
            self.position = goal;
            self.goals.remove(0);
        } else {
            self.position += way.normalize() * (SPEED * STEP);
        }
    }
}

/// The recordings of a run; a robot that is parked does not exist for the other one.
fn run(robots: [Option<&Robot>; 2]) -> [Option<Trace>; 2] {
    let mut robots = robots.map(Option::<&Robot>::cloned);
    let mut recorded = [Vec::new(), Vec::new()];
    for _ in 0..=STEPS {
        let positions = [0, 1].map(|at| robots[at].as_ref().map(|robot: &Robot| robot.position));
        for (at, robot) in robots.iter_mut().enumerate() {
            if let Some(robot) = robot {
                recorded[at].push(robot.position);
                robot.step(positions[1 - at]);
            }
        }
    }
    let mut clocks = robots.iter().map(|robot| robot.as_ref().map_or(0.0, |robot| robot.clock));
    recorded.map(|positions| {
        let clock = clocks.next().unwrap();
        let times = (0..positions.len()).map(|step| step as f64 * STEP - clock).collect();
        Trace::new(times, positions, None).ok()
    })
}

/// The first step of a run with both at which they overlap, in seconds of the test.
fn direct(robots: [&Robot; 2]) -> Option<f64> {
    let [Some(one), Some(other)] = run(robots.map(Some)) else { unreachable!() };
    let mut pairs = one.positions().iter().zip(other.positions());
    pairs.position(|(one, other)| (*one - *other).length() <= 2.0 * RADIUS).map(|step| step as f64 * STEP)
}

fn body(trace: Trace) -> Body {
    Body::moving(Shape::sphere(RADIUS).unwrap(), trace).unwrap()
}

fn any_robot() -> impl Strategy<Value = Robot> {
    let position = || [-2.0..2.0f64, -2.0..2.0f64, -0.2..0.2f64].prop_map(Vector::from_array);
    (position(), prop::collection::vec(position(), 1..5), 0.0..1000.0f64).prop_map(|(position, goals, clock)| Robot {
        position,
        goals,
        careful: 0.0,
        clock,
    })
}

const ALIKE: Tolerance = Tolerance { position: 1e-6, angle: 1e-6, time: STEP };

proptest! {
    #[test]
    fn robots_recorded_one_at_a_time_meet_when_they_do_together(one in any_robot(), other in any_robot()) {
        let [Some(first), None] = run([Some(&one), None]) else { unreachable!() };
        let [None, Some(second)] = run([None, Some(&other)]) else { unreachable!() };
        for alignment in [Alignment::CommonStart, Alignment::Offset(other.clock - one.clock)] {
            let aligned = alignment.align(&first, &second).unwrap();
            let found = contacts(&body(first.clone()), &body(aligned), TOLERANCE).unwrap();
            let replayed = found.first().map(|time| time + one.clock);
            match (replayed, direct([&one, &other])) {
                // Steps see a contact when it has begun, at most a step later unless it is a brush.
                (Some(replayed), Some(stepped)) => {
                    prop_assert!(replayed <= stepped + 1e-6, "{replayed} {stepped}");
                    let brush = found.intervals[0].to + one.clock <= stepped;
                    prop_assert!(brush || stepped - replayed <= STEP + 1e-4, "{replayed} {stepped} {found:?}");
                }
                // Between two steps, robots come nearer by no more than what both drive in half of one.
                (Some(_), None) => prop_assert!(found.nearest.clearance >= -SPEED * STEP, "{found:?}"),
                (None, stepped) => prop_assert_eq!(stepped, None),
            }
        }
        let [Some(together), Some(_)] = run([Some(&one), Some(&other)]) else { unreachable!() };
        let coupling = by_motion(&first, &together, together.end(), ALIKE);
        prop_assert!(coupling.method_holds(), "{}", coupling.sentence());
    }

    #[test]
    fn a_robot_that_waits_for_the_other_is_found_to_be_coupled(one in any_robot(), other in any_robot()) {
        let careful = Robot { careful: 1.5, ..one };
        let [Some(alone), None] = run([Some(&careful), None]) else { unreachable!() };
        let [Some(together), Some(_)] = run([Some(&careful), Some(&other)]) else { unreachable!() };
        let waited = alone.positions() != together.positions();
        let coupling = by_motion(&alone, &together, together.end(), ALIKE);
        prop_assert_eq!(matches!(coupling, Coupling::Coupled(_)), waited, "{}", coupling.sentence());
        prop_assert_eq!(coupling.method_holds(), !waited);
    }
}
