//! By how much a safety zone must be widened, so that a robot stands before anyone is hurt.
//!
//! This is the protective separation distance of [ISO/TS 15066] (5.5.4, formula 1) with constant speeds:
//!
//! `S = v_h (t_r + t_s) + v_r t_r + S_s + C + Z_d + Z_r`
//!
//! While the system reacts (`t_r`) the robot moves on at `v_r`, and while it reacts and stops (`t_s`) the human
//! approaches at `v_h`. Stopping takes the robot a distance `S_s`, which is `v_r² / (2a)` with a constant deceleration
//! `a`. `C` is how far a body intrudes before it is detected, and `Z_d` and `Z_r` are the uncertainties of the
//! positions of human and robot. With `v_r = 0` it is `S = K T + C` of [ISO 13855].
//!
//! The speeds must be the greatest that can occur during the approach, including what the robot gains while nobody has
//! reacted yet. [`crate::speed::greatest_speed`] finds the one that occurred in a recording.

/// The speed of a walking human, in metres per second: K of ISO 13855 for the whole body.
pub const WALKING_SPEED: f64 = 1.6;

/// The speed of a reaching hand, in metres per second: K of ISO 13855 for upper limbs, where S is at most 0.5 m.
pub const REACHING_SPEED: f64 = 2.0;

/// An approach of a robot and a human, or of a robot and a thing that does not move. All numbers are finite and 0 or
/// more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// The greatest speed of the robot towards the other side, in metres per second: `v_r`.
    pub robot_speed: f64,
    /// The greatest speed of the other side towards the robot, in metres per second: `v_h`. 0 for a thing that does not
    /// move; for a human see [`WALKING_SPEED`] and [`REACHING_SPEED`].
    pub other_speed: f64,
    /// What passes before the robot begins to stop.
    pub reaction: Reaction,
    /// How the robot stops.
    pub stop: Stop,
    /// How far a part of a body intrudes into a zone before it is detected, in metres: C.
    pub intrusion: f64,
    /// By how much the measured position of the other side may be wrong, in metres: `Z_d`.
    pub other_uncertainty: f64,
    /// By how much the position of the robot may be wrong, in metres: `Z_r`.
    pub robot_uncertainty: f64,
}

/// The parts of the reaction time `t_r`, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reaction {
    /// Until a sensor or an operator has noticed.
    pub detection: f64,
    /// Until the interlock has decided, or the operator has pressed the button.
    pub response: f64,
    /// Until the robot has the order to stop.
    pub communication: f64,
}

impl Reaction {
    /// The whole, in seconds.
    pub fn total(&self) -> f64 {
        self.detection + self.response + self.communication
    }
}

/// How a robot stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// With this constant deceleration, in metres per second squared; more than 0.
    Deceleration(f64),
    /// As it was measured at this speed or a greater one, or as the manufacturer states.
    Measured {
        /// Its way, in metres.
        distance: f64,
        /// How long it takes, in seconds.
        time: f64,
    },
}

/// The parts of a protective separation distance, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationDistance {
    /// What the other side moves until the robot stands: `S_h`.
    pub other: f64,
    /// What the robot moves during the reaction: `S_r`.
    pub reaction: f64,
    /// What the robot moves while it stops: `S_s`.
    pub stopping: f64,
    /// The intrusion: C.
    pub intrusion: f64,
    /// Both uncertainties: `Z_d` + `Z_r`.
    pub uncertainty: f64,
}

impl SeparationDistance {
    /// The whole distance: by this length a zone is widened.
    pub fn total(&self) -> f64 {
        self.other + self.reaction + self.stopping + self.intrusion + self.uncertainty
    }
}

/// A number that no approach can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} is {value} {unit}: it must be finite and {permitted}")]
pub struct ExpansionError {
    /// The number's name.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What is permitted.
    pub permitted: &'static str,
}

/// The protective separation distance of an approach. All its parts are finite and 0 or more.
pub fn separation_distance(approach: &Approach) -> Result<SeparationDistance, ExpansionError> {
    let Approach { robot_speed, other_speed, reaction, stop, intrusion, other_uncertainty, robot_uncertainty } =
        *approach;
    let numbers = [
        ("the speed of the robot", robot_speed, "m/s"),
        ("the speed of the other side", other_speed, "m/s"),
        ("the time of detection", reaction.detection, "s"),
        ("the time of the response", reaction.response, "s"),
        ("the time of communication", reaction.communication, "s"),
        ("the intrusion distance", intrusion, "m"),
        ("the uncertainty of the other side's position", other_uncertainty, "m"),
        ("the uncertainty of the robot's position", robot_uncertainty, "m"),
    ];
    for (what, value, unit) in numbers {
        check(what, value, unit, value >= 0.0, "0 or more")?;
    }
    let (stopping, stop_time) = match stop {
        Stop::Deceleration(rate) => {
            check("the deceleration", rate, "m/s²", rate > 0.0, "more than 0")?;
            (robot_speed * robot_speed / (2.0 * rate), robot_speed / rate)
        }
        Stop::Measured { distance, time } => {
            check("the stopping distance", distance, "m", distance >= 0.0, "0 or more")?;
            check("the stopping time", time, "s", time >= 0.0, "0 or more")?;
            (distance, time)
        }
    };
    let distance = SeparationDistance {
        other: other_speed * (reaction.total() + stop_time),
        reaction: robot_speed * reaction.total(),
        stopping,
        intrusion,
        uncertainty: other_uncertainty + robot_uncertainty,
    };
    check("the separation distance", distance.total(), "m", true, "no more than a number can be")?;
    Ok(distance)
}

fn check(
    what: &'static str,
    value: f64,
    unit: &'static str,
    holds: bool,
    permitted: &'static str,
) -> Result<(), ExpansionError> {
    if holds && value.is_finite() {
        return Ok(());
    }
    Err(ExpansionError { what, value, unit, permitted })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn arm() -> Approach {
        Approach {
            robot_speed: 1.0,
            other_speed: WALKING_SPEED,
            reaction: Reaction { detection: 0.1, response: 0.25, communication: 0.05 },
            stop: Stop::Deceleration(2.0),
            intrusion: 0.2,
            other_uncertainty: 0.05,
            robot_uncertainty: 0.01,
        }
    }

    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-12
    }

    #[test]
    fn an_arm_and_a_walking_human() {
        let distance = separation_distance(&arm()).unwrap();
        // 0.4 s of reaction and 0.5 s of stopping.
        assert!(close(distance.other, 1.6 * 0.9));
        assert!(close(distance.reaction, 0.4));
        assert!(close(distance.stopping, 0.25));
        assert!(close(distance.total(), 1.44 + 0.4 + 0.25 + 0.2 + 0.06));
    }

    #[test]
    fn a_measured_stop_takes_the_place_of_the_formula() {
        let measured = Approach { stop: Stop::Measured { distance: 0.25, time: 0.5 }, ..arm() };
        assert_eq!(separation_distance(&measured), separation_distance(&arm()));
    }

    #[test]
    fn a_robot_that_stands_leaves_the_formula_of_iso_13855() {
        let standing = Approach { robot_speed: 0.0, other_uncertainty: 0.0, robot_uncertainty: 0.0, ..arm() };
        assert!(close(separation_distance(&standing).unwrap().total(), WALKING_SPEED * 0.4 + 0.2));
    }

    #[test]
    fn numbers_that_make_no_sense_are_named() {
        let message = |approach: Approach| separation_distance(&approach).unwrap_err().to_string();
        assert_eq!(
            message(Approach { robot_speed: -1.0, ..arm() }),
            "the speed of the robot is -1 m/s: it must be finite and 0 or more"
        );
        assert_eq!(
            message(Approach { stop: Stop::Deceleration(0.0), ..arm() }),
            "the deceleration is 0 m/s²: it must be finite and more than 0"
        );
        assert_eq!(
            message(Approach { intrusion: f64::NAN, ..arm() }),
            "the intrusion distance is NaN m: it must be finite and 0 or more"
        );
        let slow = Approach { stop: Stop::Deceleration(f64::MIN_POSITIVE), robot_speed: 1e9, ..arm() };
        assert!(message(slow).starts_with("the separation distance is inf m"));
    }

    proptest! {
        #[test]
        fn more_of_anything_but_deceleration_widens_the_zone(
            number in 0usize..8, more in 0.0..2.0f64, rate in 0.1..5.0f64,
        ) {
            let before = Approach { stop: Stop::Deceleration(rate), ..arm() };
            let mut after = before;
            let changed = match number {
                0 => &mut after.robot_speed,
                1 => &mut after.other_speed,
                2 => &mut after.reaction.detection,
                3 => &mut after.reaction.response,
                4 => &mut after.reaction.communication,
                5 => &mut after.intrusion,
                6 => &mut after.other_uncertainty,
                _ => &mut after.robot_uncertainty,
            };
            *changed += more;
            let total = |approach: &Approach| separation_distance(approach).unwrap().total();
            prop_assert!(total(&after) >= total(&before));
            let harder = Approach { stop: Stop::Deceleration(rate + more), ..before };
            prop_assert!(total(&harder) <= total(&before));
        }

        /// A simulation in small steps: the distance that both sides cover until the robot stands.
        #[test]
        fn the_distance_is_what_both_sides_cover_until_the_robot_stands(
            robot in 0.0..3.0f64, other in 0.0..2.0f64, reaction in 0.0..1.0f64, rate in 0.5..5.0f64,
        ) {
            let approach = Approach {
                robot_speed: robot,
                other_speed: other,
                reaction: Reaction { detection: reaction, response: 0.0, communication: 0.0 },
                stop: Stop::Deceleration(rate),
                intrusion: 0.0,
                other_uncertainty: 0.0,
                robot_uncertainty: 0.0,
            };
            let step = 1e-4;
            let (mut time, mut speed, mut covered) = (0.0, robot, 0.0);
            while time < reaction || speed > 0.0 {
                covered += (speed + other) * step;
                if time >= reaction {
                    speed -= rate * step;
                }
                time += step;
            }
            let total = separation_distance(&approach).unwrap().total();
            prop_assert!((covered - total).abs() < 2e-3, "{covered} {total}");
        }
    }
}
