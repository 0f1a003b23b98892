//! Where the parts of an arm are, given its joint angles, and which joint angles bring the gripper to a place.
//!
//! The arms are six-axis articulated robots with a spherical wrist. Angles are radians and right-handed:
//!
//! | joint   | axis                        | zero                               | positive                      |
//! |---------|-----------------------------|------------------------------------|-------------------------------|
//! | `Link0` | vertical                    | the heading of the base            | anticlockwise, from above     |
//! | `Link1` | shoulder, horizontal        | upper arm upright                  | the arm leans forward         |
//! | `Link2` | elbow, horizontal           | forearm square to the upper arm    | the forearm dips              |
//! | `Link3` | along the forearm           | the wrist bends in the arm's plane | right-handed about the forearm|
//! | `Link4` | wrist, square to the forearm| gripper in line with the forearm   | the gripper dips              |
//! | `Link5` | along the gripper           |                                    | turns the gripper about itself|

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::geometry::{Capsule, Vector};

/// Joint angles in rad, `Link0` to `Link5`.
pub type Joints = [f64; 6];

/// The lengths of an arm, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmGeometry {
    /// From the floor up to the shoulder's axis.
    pub shoulder_height: f64,
    /// From the base's axis out to the shoulder's axis.
    pub shoulder_offset: f64,
    /// From the shoulder to the elbow.
    pub upper_arm: f64,
    /// From the elbow to the centre of the wrist.
    pub forearm: f64,
    /// From the centre of the wrist to the centre of the gripper: flange, gripper and half of what it holds.
    pub gripper: f64,
}

/// Where an arm stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    /// The foot of the base's axis.
    pub position: Vector,
    /// The direction of `Link0` = 0, in rad from the cell's x axis.
    pub heading: f64,
}

/// The points at which an arm bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// Foot of the base's axis.
    pub base: Vector,
    /// Axis of the shoulder.
    pub shoulder: Vector,
    /// Axis of the elbow.
    pub elbow: Vector,
    /// Centre of the wrist.
    pub wrist: Vector,
    /// Centre of the gripper.
    pub gripper: Vector,
}

/// Thicknesses of the four parts of an arm, as radii in metres: typical of the class, cables and dress packs included.
const RADII: [f64; 4] = [0.35, 0.20, 0.16, 0.18];

impl Posture {
    /// The solids of the arm: base with turntable, upper arm, forearm, gripper with what it holds.
    pub fn capsules(&self) -> [Capsule; 4] {
        let points = [self.base, self.shoulder, self.elbow, self.wrist, self.gripper];
        std::array::from_fn(|i| Capsule::new(points[i], points[i + 1], RADII[i]))
    }
}

/// Forward kinematics: the posture that these joint angles give.
pub fn posture(geometry: &ArmGeometry, base: &Base, joints: &Joints) -> Posture {
    let (s0, c0) = libm::sincos(base.heading + joints[0]);
    let (s1, c1) = libm::sincos(joints[1]);
    let (s2, c2) = libm::sincos(joints[1] + joints[2]);
    let (s3, c3) = libm::sincos(joints[3]);
    let (s4, c4) = libm::sincos(joints[4]);
    let outward = Vector::new(c0, s0, 0.0);
    let sideways = Vector::new(-s0, c0, 0.0);
    let shoulder = base.position + outward * geometry.shoulder_offset + Vector::Z * geometry.shoulder_height;
    let elbow = shoulder + (outward * s1 + Vector::Z * c1) * geometry.upper_arm;
    // The forearm's own axes: along it, sideways, and square to both.
    let along = outward * c2 - Vector::Z * s2;
    let above = outward * s2 + Vector::Z * c2;
    let wrist = elbow + along * geometry.forearm;
    let gripper = wrist + (along * c4 + sideways * (s3 * s4) - above * (c3 * s4)) * geometry.gripper;
    Posture { base: base.position, shoulder, elbow, wrist, gripper }
}

/// Inverse kinematics: the joint angles that bring the gripper's centre to a place with the gripper hanging straight
/// down, elbow up; `Link5` turns against `Link0`, so that what the gripper holds keeps its orientation in the cell.
///
/// `None` where the arm cannot reach.
pub fn hanging_at(geometry: &ArmGeometry, base: &Base, place: Vector) -> Option<Joints> {
    let from_base = place - base.position;
    let turn = wrapped(libm::atan2(from_base.y, from_base.x) - base.heading);
    let out = libm::hypot(from_base.x, from_base.y) - geometry.shoulder_offset;
    let up = from_base.z + geometry.gripper - geometry.shoulder_height;
    let (upper, fore) = (geometry.upper_arm, geometry.forearm);
    let reach = libm::hypot(out, up);
    if reach > upper + fore || reach < (upper - fore).abs() || reach == 0.0 {
        return None;
    }
    // The triangle of shoulder, elbow and wrist, by the law of cosines.
    let at_shoulder =
        libm::acos(((upper * upper + reach * reach - fore * fore) / (2.0 * upper * reach)).clamp(-1.0, 1.0));
    let at_elbow = libm::acos(((upper * upper + fore * fore - reach * reach) / (2.0 * upper * fore)).clamp(-1.0, 1.0));
    let shoulder = libm::atan2(out, up) - at_shoulder;
    let elbow = FRAC_PI_2 - at_elbow;
    Some([turn, shoulder, elbow, 0.0, FRAC_PI_2 - shoulder - elbow, -turn])
}

/// The same direction within (−π, π].
fn wrapped(angle: f64) -> f64 {
    if angle > PI {
        angle - TAU
    } else if angle <= -PI {
        angle + TAU
    } else {
        angle
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const GEOMETRY: ArmGeometry =
        ArmGeometry { shoulder_height: 0.7, shoulder_offset: 0.3, upper_arm: 1.2, forearm: 1.4, gripper: 0.5 };
    const BASE: Base = Base { position: Vector::new(1.0, -2.0, 0.0), heading: 0.5 };

    #[test]
    fn at_zero_the_upper_arm_stands_and_the_forearm_points_ahead() {
        let ahead = Base { position: Vector::ZERO, heading: 0.0 };
        let posture = posture(&GEOMETRY, &ahead, &[0.0; 6]);
        assert_eq!(posture.shoulder, Vector::new(0.3, 0.0, 0.7));
        assert_eq!(posture.elbow, Vector::new(0.3, 0.0, 1.9));
        assert_eq!(posture.wrist, Vector::new(1.7, 0.0, 1.9));
        assert_eq!(posture.gripper, Vector::new(2.2, 0.0, 1.9));
    }

    #[test]
    fn a_place_out_of_reach_has_no_joint_angles() {
        assert_eq!(hanging_at(&GEOMETRY, &BASE, Vector::new(5.0, -2.0, 1.0)), None);
    }

    /// Rotation matrices, row by row, multiplied out: the textbook way.
    fn gripper_by_matrices(joints: &Joints) -> Vector {
        type Matrix = [[f64; 3]; 3];
        let about_y = |a: f64| [[a.cos(), 0.0, a.sin()], [0.0, 1.0, 0.0], [-a.sin(), 0.0, a.cos()]];
        let about_z = |a: f64| [[a.cos(), -a.sin(), 0.0], [a.sin(), a.cos(), 0.0], [0.0, 0.0, 1.0]];
        let about_x = |a: f64| [[1.0, 0.0, 0.0], [0.0, a.cos(), -a.sin()], [0.0, a.sin(), a.cos()]];
        let times = |a: Matrix, b: Matrix| -> Matrix {
            std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
        };
        let apply = |m: &Matrix, v: [f64; 3]| -> Vector {
            Vector::from_array(std::array::from_fn(|i| (0..3).map(|k| m[i][k] * v[k]).sum()))
        };
        let mut frame = about_z(BASE.heading + joints[0]);
        let mut place = BASE.position + apply(&frame, [GEOMETRY.shoulder_offset, 0.0, GEOMETRY.shoulder_height]);
        frame = times(frame, about_y(joints[1]));
        place += apply(&frame, [0.0, 0.0, GEOMETRY.upper_arm]);
        frame = times(frame, about_y(joints[2]));
        place += apply(&frame, [GEOMETRY.forearm, 0.0, 0.0]);
        frame = times(times(frame, about_x(joints[3])), about_y(joints[4]));
        place += apply(&frame, [GEOMETRY.gripper, 0.0, 0.0]);
        place
    }

    proptest! {
        #[test]
        fn agrees_with_the_product_of_rotation_matrices(joints in prop::array::uniform6(-3.0..3.0f64)) {
            let gap = posture(&GEOMETRY, &BASE, &joints).gripper - gripper_by_matrices(&joints);
            prop_assert!(gap.length() < 1e-12);
        }

        #[test]
        fn links_keep_their_lengths(joints in prop::array::uniform6(-3.0..3.0f64)) {
            let posture = posture(&GEOMETRY, &BASE, &joints);
            prop_assert!(((posture.elbow - posture.shoulder).length() - GEOMETRY.upper_arm).abs() < 1e-12);
            prop_assert!(((posture.wrist - posture.elbow).length() - GEOMETRY.forearm).abs() < 1e-12);
            prop_assert!(((posture.gripper - posture.wrist).length() - GEOMETRY.gripper).abs() < 1e-12);
        }

        #[test]
        fn inverse_kinematics_brings_the_hanging_gripper_there(turn in -3.1..3.1f64, out in 0.9..2.2f64, up in 0.2..1.5f64) {
            let place = BASE.position + Vector::new(out * turn.cos(), out * turn.sin(), up);
            let joints = hanging_at(&GEOMETRY, &BASE, place).expect("within reach");
            let reached = posture(&GEOMETRY, &BASE, &joints);
            prop_assert!((reached.gripper - place).length() < 1e-9);
            prop_assert!((reached.wrist - place - Vector::Z * GEOMETRY.gripper).length() < 1e-9, "hanging straight down");
            prop_assert!(joints[0].abs() <= PI);
        }
    }
}
