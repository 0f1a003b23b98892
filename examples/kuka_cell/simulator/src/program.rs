//! The motion programmes of the cell's PLC: which stations the arms and conveyors go to, when, and in which order.
//!
//! Stations are places of the gripper's centre in the cell, in m; the gripper hangs straight down at each of them.

use sesame_runtime::simulator::SimulatorError;

use crate::arm::{ArmModel, R3200, R270072, R270073};
use crate::geometry::Vector;
use crate::kinematics::{Joints, hanging_at};
use crate::sequence::{Sequence, Signal, Step};

/// The period at which the cell starts gearboxes, in s: a cycle that finishes earlier waits.
pub const TAKT_SECONDS: f64 = 70.0;

/// Where the infeed's carriage stands between the assembly arms, and where the R3200 picks from it, in m.
const ASSEMBLY_TO_PICK: [f64; 1] = [1.85];

/// Where the R3200 picks gearboxes up from the infeed.
const PICK: [f64; 3] = [-2.0, 1.15, 0.85];
/// Where the R3200 puts gearboxes down at the workers' station.
const PLACE: [f64; 3] = [-2.1, -1.15, 0.85];
/// Where the R3200 waits between cycles: drawn in and high.
const HOME: [f64; 3] = [1.29, 0.40, 1.95];
/// Where the assembly arms put together gearboxes, on the infeed.
const ASSEMBLY: [f64; 3] = [-2.0, 3.0, 0.85];
/// Where the R270072 holds the next shaft ready, beside the infeed.
const SHAFT_READY: [f64; 3] = [-1.75, 2.15, 1.10];
/// Where the R270072 takes shafts from.
const SHAFT_RACK: [f64; 3] = [0.6, 5.3, 0.75];
/// Where the R270073 waits between cycles.
const HOUSING_READY: [f64; 3] = [-3.5, 2.2, 1.30];
/// Where the R270073 takes housings from.
const HOUSING_RACK: [f64; 3] = [-4.3, 5.3, 0.75];

/// The drawn-in posture in which the R3200 carries gearboxes: leaning back, the forearm dipping a little.
fn carrying(turn: f64) -> Joints {
    let (shoulder, dip) = (-0.45, 0.2);
    [turn, shoulder, dip - shoulder, 0.0, std::f64::consts::FRAC_PI_2 - dip, -turn]
}

/// The stretched-out posture in which the R3200 holds gearboxes over the right-hand surface for inspection.
fn inspecting(turn: f64) -> Joints {
    let (shoulder, dip) = (0.85, -0.45);
    [turn, shoulder, dip - shoulder, 0.0, std::f64::consts::FRAC_PI_2 - dip, -turn]
}

/// The direction of the right-hand surface's inspection place, in rad.
const INSPECTION_TURN: f64 = -1.25;

/// All sequences of the cell, not yet begun.
#[derive(Debug, Clone)]
pub struct Programs {
    /// R3200, R270073, R270072.
    pub arms: [Sequence<6>; 3],
    /// Where each arm's sequence begins.
    pub homes: [Joints; 3],
    /// Infeed and outfeed.
    pub conveyors: [Sequence<1>; 2],
}

/// Works out the stations' joint angles. Fails if a station is out of an arm's reach or joint range.
pub fn programs() -> Result<Programs, SimulatorError> {
    let (product_home, product_move) = product_move()?;
    let (housing_home, housing) = housing()?;
    let (shaft_home, shaft) = shaft()?;
    Ok(Programs {
        arms: [
            Sequence::new(product_move, product_home),
            Sequence::new(housing, housing_home),
            Sequence::new(shaft, shaft_home),
        ],
        homes: [product_home, housing_home, shaft_home],
        conveyors: [Sequence::new(infeed(), [0.0]), Sequence::new(outfeed(), [0.0])],
    })
}

/// R3200: pick – transport – inspect – transport – place.
fn product_move() -> Result<(Joints, Vec<Step<6>>), SimulatorError> {
    use Step::{Arrive, Await, Hold, Move, Raise};
    let at = |place| station(&R3200, place);
    let home = at(HOME)?;
    let pick_turn = at(PICK)?[0];
    let place_turn = at(PLACE)?[0];
    let steps = vec![
        // To the infeed, out over the gearbox, down, grip, up and drawn in.
        Move { to: with_turn(home, pick_turn), seconds: 5.6 },
        Move { to: at(above(PICK, 0.75))?, seconds: 2.6 },
        Arrive,
        Await(Signal::GearboxAtPick),
        Move { to: at(PICK)?, seconds: 2.5 },
        Arrive,
        Hold { seconds: 1.4 },
        Move { to: at(above(PICK, 0.45))?, seconds: 1.8 },
        Raise(Signal::GearboxLifted),
        Move { to: carrying(pick_turn), seconds: 2.8 },
        // Past the right-hand surface, and out over it for the inspection.
        Move { to: carrying(INSPECTION_TURN), seconds: 10.0 },
        Arrive,
        Move { to: inspecting(INSPECTION_TURN), seconds: 4.0 },
        Arrive,
        Hold { seconds: 0.8 },
        Move { to: carrying(INSPECTION_TURN), seconds: 4.0 },
        // On to the workers' station, down, let go.
        Move { to: carrying(place_turn), seconds: 5.4 },
        Move { to: at(above(PLACE, 0.75))?, seconds: 3.2 },
        Move { to: at(PLACE)?, seconds: 2.5 },
        Arrive,
        Hold { seconds: 2.4 },
        Move { to: at(above(PLACE, 0.75))?, seconds: 2.2 },
        Raise(Signal::GearboxPlaced),
        // Home, high over the right-hand surface.
        Move { to: with_turn(home, place_turn), seconds: 4.6 },
        Move { to: home, seconds: 10.0 },
        Arrive,
    ];
    Ok((home, steps))
}

/// R270073: lays the next housing onto the infeed's carrier.
fn housing() -> Result<(Joints, Vec<Step<6>>), SimulatorError> {
    use Step::{Arrive, Await, Hold, Move, Raise};
    let at = |place| station(&R270073, place);
    let home = at(HOUSING_READY)?;
    let steps = vec![
        Hold { seconds: 4.0 },
        Move { to: at(above(HOUSING_RACK, 0.6))?, seconds: 6.0 },
        Move { to: at(HOUSING_RACK)?, seconds: 2.0 },
        Arrive,
        Hold { seconds: 1.0 },
        Move { to: at(above(HOUSING_RACK, 0.6))?, seconds: 2.0 },
        Await(Signal::CarrierAtAssembly),
        Move { to: at(above(ASSEMBLY, 0.5))?, seconds: 6.0 },
        Move { to: at(ASSEMBLY)?, seconds: 2.0 },
        Arrive,
        Hold { seconds: 1.0 },
        Move { to: at(above(ASSEMBLY, 0.5))?, seconds: 2.0 },
        Move { to: home, seconds: 4.5 },
        Raise(Signal::HousingPlaced),
        Arrive,
    ];
    Ok((home, steps))
}

/// R270072: fetches the next shaft and fits it into the housing.
fn shaft() -> Result<(Joints, Vec<Step<6>>), SimulatorError> {
    use Step::{Arrive, Await, Hold, Move};
    let at = |place| station(&R270072, place);
    let home = at(SHAFT_READY)?;
    let steps = vec![
        // It holds a shaft ready while the R3200 picks; then it lays it by and fetches the one that fits the order.
        Await(Signal::GearboxLifted),
        Move { to: at(above(SHAFT_RACK, 0.6))?, seconds: 7.0 },
        Move { to: at(SHAFT_RACK)?, seconds: 2.0 },
        Arrive,
        Hold { seconds: 1.0 },
        Move { to: at(above(SHAFT_RACK, 0.6))?, seconds: 2.0 },
        Await(Signal::HousingPlaced),
        Move { to: at(above(ASSEMBLY, 0.6))?, seconds: 6.5 },
        Move { to: at(ASSEMBLY)?, seconds: 2.5 },
        Arrive,
        Hold { seconds: 2.0 },
        Move { to: at(above(ASSEMBLY, 0.6))?, seconds: 2.0 },
        Move { to: home, seconds: 2.5 },
        Arrive,
    ];
    Ok((home, steps))
}

/// The infeed takes the finished gearbox to the R3200 and the empty carrier back.
fn infeed() -> Vec<Step<1>> {
    use Step::{Await, AwaitSwitch, Move, Raise};
    vec![
        Move { to: ASSEMBLY_TO_PICK, seconds: 5.0 },
        AwaitSwitch,
        Raise(Signal::GearboxAtPick),
        Await(Signal::GearboxLifted),
        Move { to: [0.0], seconds: 5.0 },
        AwaitSwitch,
        Raise(Signal::CarrierAtAssembly),
    ]
}

/// The outfeed takes the gearbox to the workers, who take it off, and comes back.
fn outfeed() -> Vec<Step<1>> {
    use Step::{Await, AwaitSwitch, Hold, Move};
    vec![
        Await(Signal::GearboxPlaced),
        Move { to: [0.8], seconds: 3.0 },
        AwaitSwitch,
        Hold { seconds: 3.0 },
        Move { to: [0.0], seconds: 3.0 },
        AwaitSwitch,
    ]
}

fn above(place: [f64; 3], height: f64) -> [f64; 3] {
    [place[0], place[1], place[2] + height]
}

/// The same posture, turned about the base's axis; what the gripper holds keeps its orientation.
fn with_turn(joints: Joints, turn: f64) -> Joints {
    let [_, shoulder, elbow, roll, wrist, _] = joints;
    [turn, shoulder, elbow, roll, wrist, -turn]
}

/// The joint angles of a station.
fn station(arm: &ArmModel, place: [f64; 3]) -> Result<Joints, SimulatorError> {
    let [x, y, z] = place;
    let joints = hanging_at(&arm.geometry, &arm.base, Vector::from_array(place))
        .ok_or_else(|| SimulatorError(format!("station ({x}, {y}, {z}) is out of reach of {}", arm.name)))?;
    for (link, (angle, limits)) in joints.iter().zip(&arm.joints).enumerate() {
        if *angle < limits.lower || *angle > limits.upper {
            return Err(SimulatorError(format!(
                "station ({x}, {y}, {z}) needs Link{link} of {} at {angle:.3} rad, outside its range {:.3} to {:.3}",
                arm.name, limits.lower, limits.upper
            )));
        }
    }
    Ok(joints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::AxisLimits;

    /// Asserts that the axes can follow each move: within their ranges, below their speeds, with torque to spare.
    fn assert_feasible<const N: usize>(name: &str, home: [f64; N], steps: &[Step<N>], limits: &[AxisLimits; N]) {
        let mut from = home;
        for step in steps {
            let Step::Move { to, seconds } = *step else { continue };
            for axis in 0..N {
                let (limits, way) = (limits[axis], (to[axis] - from[axis]).abs());
                assert!((limits.lower..=limits.upper).contains(&to[axis]), "{name} axis {axis}: {step:?}");
                assert!(1.875 * way / seconds < 0.8 * limits.speed, "{name} axis {axis} too fast: {step:?}");
                assert!(
                    5.78 * way / (seconds * seconds) < 0.7 * limits.acceleration,
                    "{name} axis {axis} speeds up too fast: {step:?}"
                );
            }
            from = to;
        }
        assert_eq!(from, home, "{name} ends where it begins");
    }

    #[test]
    fn the_axes_can_follow_all_moves() {
        let (home, steps) = product_move().unwrap();
        assert_feasible("R3200", home, &steps, &R3200.joints);
        let (home, steps) = housing().unwrap();
        assert_feasible("R270073", home, &steps, &R270073.joints);
        let (home, steps) = shaft().unwrap();
        assert_feasible("R270072", home, &steps, &R270072.joints);
        assert_feasible("infeed", [0.0], &infeed(), &[crate::conveyor::INFEED.carriage]);
        assert_feasible("outfeed", [0.0], &outfeed(), &[crate::conveyor::OUTFEED.carriage]);
    }

    #[test]
    fn a_station_out_of_reach_is_refused_by_name() {
        let message = station(&R270073, [3.0, 3.0, 1.0]).unwrap_err().to_string();
        assert_eq!(message, "station (3, 3, 1) is out of reach of R270073");
    }
}
