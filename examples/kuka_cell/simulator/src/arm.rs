//! An arm of the cell: six driven joints, moved by the targets that reach it over the bus.

use std::collections::VecDeque;
use std::sync::Arc;

use sesame_runtime::simulator::{Bus, Port};
use sesame_runtime::time::SimTime;
use sesame_runtime::value::{Fields, Record, Value};

use crate::geometry::Vector;
use crate::kinematics::{self, ArmGeometry, Base, Joints, Posture};
use crate::servo::{AxisLimits, Servo};

/// The constants of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmModel {
    /// Its name on the wire, as in `joints/NAME/Link0/R/position`.
    pub name: &'static str,
    /// The name of its gripper in messages of safety zones.
    pub gripper_name: &'static str,
    /// Its lengths.
    pub geometry: ArmGeometry,
    /// Where it stands.
    pub base: Base,
    /// What its joints can do, `Link0` to `Link5`, in rad and s.
    pub joints: [AxisLimits; 6],
}

/// The protective field around a gripper and what it holds: a sphere of this radius in metres.
pub const GRIPPER_RADIUS: f64 = 0.35;

const fn joint(degrees: (f64, f64), degrees_per_second: f64, acceleration: f64) -> AxisLimits {
    AxisLimits {
        lower: degrees.0.to_radians(),
        upper: degrees.1.to_radians(),
        speed: degrees_per_second.to_radians(),
        acceleration,
    }
}

/// The joints of an arm of 3.2 m reach and about 120 kg payload. Ranges and rated speeds are typical of the class, in
/// our zero positions (see [`crate::kinematics`]); the cell's cabling limits `Link0` to half a turn either way. A joint
/// reaches its rated speed in a little less than half a second, the wrist sooner.
const LONG_ARM_JOINTS: [AxisLimits; 6] = [
    joint((-180.0, 180.0), 105.0, 4.2),
    joint((-50.0, 85.0), 101.0, 3.6),
    joint((-210.0, 65.0), 107.0, 4.2),
    joint((-350.0, 350.0), 170.0, 9.0),
    joint((-125.0, 125.0), 129.0, 9.0),
    joint((-350.0, 350.0), 206.0, 12.0),
];

/// The same for an arm of 2.7 m reach.
const SHORT_ARM_JOINTS: [AxisLimits; 6] = [
    joint((-185.0, 185.0), 123.0, 4.5),
    joint((-50.0, 85.0), 115.0, 4.0),
    joint((-210.0, 65.0), 112.0, 4.5),
    joint((-350.0, 350.0), 179.0, 10.0),
    joint((-125.0, 125.0), 172.0, 10.0),
    joint((-350.0, 350.0), 219.0, 13.0),
];

/// Reach to the wrist's centre 0.35 + 1.35 + 1.50 = 3.2 m.
const LONG_ARM: ArmGeometry =
    ArmGeometry { shoulder_height: 0.675, shoulder_offset: 0.35, upper_arm: 1.35, forearm: 1.50, gripper: 0.55 };

/// Reach to the wrist's centre 0.35 + 1.15 + 1.20 = 2.7 m.
const SHORT_ARM: ArmGeometry =
    ArmGeometry { shoulder_height: 0.675, shoulder_offset: 0.35, upper_arm: 1.15, forearm: 1.20, gripper: 0.55 };

/// The arm that carries gearboxes from the infeed conveyor past the inspection to the workers' station.
pub const R3200: ArmModel = ArmModel {
    name: "R3200ProductMove",
    gripper_name: "GripperR3200ProductMove",
    geometry: LONG_ARM,
    base: Base { position: Vector::new(0.0, 0.0, 0.0), heading: 0.0 },
    joints: LONG_ARM_JOINTS,
};

/// The arm that lays gearbox housings onto the infeed conveyor.
pub const R270073: ArmModel = ArmModel {
    name: "R270073",
    gripper_name: "GripperR270073",
    geometry: SHORT_ARM,
    base: Base { position: Vector::new(-3.7, 3.7, 0.0), heading: 0.0 },
    joints: SHORT_ARM_JOINTS,
};

/// The arm that fits shafts into the housings.
pub const R270072: ArmModel = ArmModel {
    name: "R270072",
    gripper_name: "GripperR270072",
    geometry: SHORT_ARM,
    base: Base { position: Vector::new(-0.5, 3.9, 0.0), heading: std::f64::consts::PI },
    joints: SHORT_ARM_JOINTS,
};

/// The names of the fields of an arm's state message: six measured joint angles in rad, the gripper's speed in m/s.
pub const STATE_FIELDS: [&str; 7] = ["link0", "link1", "link2", "link3", "link4", "link5", "gripper_speed"];

/// An arm in motion.
#[derive(Debug, Clone)]
pub struct Arm {
    model: &'static ArmModel,
    servos: [Servo; 6],
    posture: Posture,
    gripper_speed: f64,
    targets: [Port; 6],
    state: Port,
    state_fields: Arc<Fields>,
    field_bus: FieldBus,
}

/// How targets come from the bus to the drives.
#[derive(Debug, Clone, Default)]
struct FieldBus {
    latency: SimTime,
    soft_limit: Option<f64>,
    /// The joint, its target, and when it arrives; the earliest first.
    underway: VecDeque<(SimTime, usize, f64)>,
}

/// The joint of the second axis, the lower arm.
const SECOND_AXIS: usize = 1;

impl Arm {
    /// An arm at rest; opens its topics.
    pub fn open(model: &'static ArmModel, at: &Joints, bus: &mut Bus<'_>) -> Self {
        let targets = std::array::from_fn(|link| bus.open(&target_topic(model.name, link)));
        for &port in &targets {
            bus.subscribe(port);
        }
        Arm {
            model,
            servos: at.map(Servo::at_rest),
            posture: kinematics::posture(&model.geometry, &model.base, at),
            gripper_speed: 0.0,
            targets,
            state: bus.open(&state_topic(model.name)),
            state_fields: Fields::new(STATE_FIELDS),
            field_bus: FieldBus::default(),
        }
    }

    /// Targets take this long to arrive at the drives. Those of the second axis are cut to `soft_limit`, in rad.
    pub fn reach_drives_by(&mut self, latency: SimTime, soft_limit: Option<f64>) {
        self.field_bus.latency = latency;
        self.field_bus.soft_limit = soft_limit;
    }

    /// Takes the targets that have arrived, the last one of each joint. Values that are not numbers are ignored.
    pub fn receive(&mut self, bus: &mut Bus<'_>) {
        let FieldBus { latency, soft_limit, underway } = &mut self.field_bus;
        for (joint, &port) in self.targets.iter().enumerate() {
            while let Some(message) = bus.receive(port) {
                if let Some(target) = message.number_at::<&str>(&[]) {
                    underway.push_back((bus.now() + *latency, joint, target));
                }
            }
        }
        while let Some(&(arrives, joint, target)) = underway.front()
            && arrives <= bus.now()
        {
            underway.pop_front();
            let limit = soft_limit.filter(|_| joint == SECOND_AXIS).unwrap_or(f64::INFINITY);
            self.servos[joint].aim(target.min(limit));
        }
    }

    /// Moves for `n_parts` parts of `part` seconds. `disturbance` is an acceleration per joint, in rad/s².
    pub fn advance(&mut self, n_parts: u32, part: f64, disturbance: &Joints) {
        for ((servo, limits), &disturbance) in self.servos.iter_mut().zip(&self.model.joints).zip(disturbance) {
            for _ in 0..n_parts {
                servo.advance(limits, part, disturbance);
            }
        }
        self.stand_as_joints_do(n_parts, part);
    }

    /// The same with all drives off and the brakes on, with this share of their force.
    pub fn brake(&mut self, n_parts: u32, part: f64, share: f64) {
        for (servo, limits) in self.servos.iter_mut().zip(&self.model.joints) {
            for _ in 0..n_parts {
                servo.brake(limits, part, share);
            }
        }
        self.stand_as_joints_do(n_parts, part);
    }

    fn stand_as_joints_do(&mut self, n_parts: u32, part: f64) {
        let before = self.posture.gripper;
        self.posture = kinematics::posture(&self.model.geometry, &self.model.base, &self.joints());
        self.gripper_speed = (self.posture.gripper - before).length() / (f64::from(n_parts) * part);
    }

    /// Publishes its measured state.
    pub fn publish_state(&self, bus: &mut Bus<'_>) {
        let mut values = Vec::with_capacity(STATE_FIELDS.len());
        values.extend(self.servos.iter().map(|servo| Value::Real(servo.position())));
        values.push(Value::Real(self.gripper_speed));
        bus.publish(self.state, Record::new(&self.state_fields, values));
    }

    /// Its constants.
    pub fn model(&self) -> &'static ArmModel {
        self.model
    }

    /// Where its joints are, in rad.
    pub fn joints(&self) -> Joints {
        self.servos.map(|servo| servo.position())
    }

    /// How fast its joints turn, in rad/s.
    pub fn joint_speeds(&self) -> Joints {
        self.servos.map(|servo| servo.speed())
    }

    /// Where its parts are.
    pub fn posture(&self) -> &Posture {
        &self.posture
    }

    /// Mean speed of the gripper's centre over the last step, in m/s.
    pub fn gripper_speed(&self) -> f64 {
        self.gripper_speed
    }
}

/// The topic of a joint's target, in rad.
pub fn target_topic(arm: &str, link: usize) -> String {
    format!("joints/{arm}/Link{link}/R/position")
}

/// The topic of an arm's measured state.
pub fn state_topic(arm: &str) -> String {
    format!("arms/{arm}/state")
}
