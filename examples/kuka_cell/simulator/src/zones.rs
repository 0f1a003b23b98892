//! The zones of the cell and how far the grippers are from them, and the arms from each other.

use std::sync::Arc;

use parry3d_f64::bounding_volume::Aabb;
use sesame_runtime::simulator::{Bus, Port};
use sesame_runtime::value::{Fields, Record, Text, Value};

use crate::arm::{Arm, GRIPPER_RADIUS};
use crate::geometry::{Vector, distance_between_chains, sphere_to_cuboid};

/// A region of the cell whose distance from the grippers is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zone {
    /// Its name, also the end of its topic `safetyzones/NAME`.
    pub name: &'static str,
    /// Corner with the smallest coordinates, in m.
    pub lowest: [f64; 3],
    /// Corner with the largest coordinates, in m.
    pub highest: [f64; 3],
}

/// All zones. Z1 to Z3 are where people work next to the R3200; Z4 to Z6 are aisles and a fence around the assembly
/// arms; the trigger zones are small cubes that the R3200 passes at known points of its cycle.
pub const ZONES: [Zone; 9] = [
    // Behind the pick station: people who refill the infeed.
    Zone { name: "Z1", lowest: [-3.5, -0.2, 0.0], highest: [-2.50, 1.3, 2.0] },
    // Beyond the inspection surface on the right-hand side.
    Zone { name: "Z2", lowest: [-0.9, -4.3, 0.0], highest: [1.9, -3.06, 2.2] },
    // The workers' station, where gearboxes are handed over for manual operations.
    Zone { name: "Z3", lowest: [-3.6, -2.3, 0.0], highest: [-2.60, -0.5, 2.0] },
    // The aisle behind the R270073.
    Zone { name: "Z4", lowest: [-6.5, 2.0, 0.0], highest: [-5.7, 5.5, 2.0] },
    // The aisle behind the R270072.
    Zone { name: "Z5", lowest: [1.7, 2.2, 0.0], highest: [2.6, 5.6, 2.0] },
    // The fence with the maintenance door across the cell's left-hand side.
    Zone { name: "Z6", lowest: [-6.0, 6.3, 0.0], highest: [2.6, 6.8, 2.0] },
    // Over the front of the right-hand surface, where gearboxes are carried past.
    Zone { name: "ZTRIG1", lowest: [1.10, -0.85, 0.80], highest: [1.40, -0.55, 1.10] },
    // At the infeed's pick station.
    Zone { name: "ZTRIG2", lowest: [-2.15, 1.0, 0.40], highest: [-1.85, 1.3, 0.70] },
    // Where gearboxes are put down near the workers.
    Zone { name: "ZTRIG3", lowest: [-2.25, -1.30, 0.40], highest: [-1.95, -1.0, 0.70] },
];

/// The first of them are where people work.
const ZONES_WITH_PEOPLE: usize = 3;

/// The pairs of arms whose distance is measured, by position in the cell's arms, with the end of the topic.
const PAIRS: [(usize, usize, &str); 3] = [(0, 1, "ZR270073"), (0, 2, "ZR270072"), (1, 2, "ZR270073R270072")];

/// The names of arms in messages about pairs of arms.
const ARM_NAMES: [&str; 3] = ["ZR3200", "ZR270073", "ZR270072"];

/// The names of the fields of a safety zone message.
pub const ZONE_FIELDS: [&str; 4] = ["zone", "level", "object1", "object2"];

/// Measures and publishes the level of each zone and the distances between arms.
#[derive(Debug, Clone)]
pub struct ZoneMonitor {
    fields: Arc<Fields>,
    zones: Vec<(Aabb, Port, Text)>,
    grippers: [Text; 3],
    pairs: Vec<(usize, usize, Port, [Text; 3])>,
}

impl ZoneMonitor {
    /// Opens the topics. The zones are `shift` metres from where the model has them.
    pub fn open(arms: &[Arm; 3], shift: Vector, bus: &mut Bus<'_>) -> Self {
        let zones = ZONES.iter().map(|zone| {
            let [lowest, highest] = [zone.lowest, zone.highest].map(|corner| Vector::from_array(corner) + shift);
            let cuboid = Aabb::new(lowest, highest);
            (cuboid, bus.open(&zone_topic(zone.name)), Text::from(zone.name))
        });
        let zones = zones.collect();
        let pairs = PAIRS.iter().map(|&(one, other, name)| {
            let names = [name, ARM_NAMES[other], ARM_NAMES[one]].map(Text::from);
            (one, other, bus.open(&zone_topic(name)), names)
        });
        ZoneMonitor {
            fields: Fields::new(ZONE_FIELDS),
            zones,
            grippers: arms.each_ref().map(|arm| Text::from(arm.model().gripper_name)),
            pairs: pairs.collect(),
        }
    }

    /// The distance of an arm's gripper to the nearest zone in which people work, Z1 to Z3, in m.
    pub fn clearance_from_people(&self, arm: &Arm) -> f64 {
        let people = self.zones.iter().take(ZONES_WITH_PEOPLE);
        people
            .map(|(cuboid, ..)| sphere_to_cuboid(arm.posture().gripper, GRIPPER_RADIUS, cuboid))
            .fold(f64::INFINITY, f64::min)
    }

    /// Publishes all levels for the present postures.
    pub fn publish(&self, arms: &[Arm; 3], bus: &mut Bus<'_>) {
        for (cuboid, port, name) in &self.zones {
            let mut level = f64::INFINITY;
            let mut nearest = 0;
            for (index, arm) in arms.iter().enumerate() {
                let distance = sphere_to_cuboid(arm.posture().gripper, GRIPPER_RADIUS, cuboid);
                if distance < level {
                    (level, nearest) = (distance, index);
                }
            }
            bus.publish(*port, self.message(name, level, name, &self.grippers[nearest]));
        }
        let chains = arms.each_ref().map(|arm| arm.posture().capsules());
        for (one, other, port, [name, object1, object2]) in &self.pairs {
            let level = distance_between_chains(&chains[*one], &chains[*other]);
            bus.publish(*port, self.message(name, level, object1, object2));
        }
    }

    /// A safety zone message; `level` is given in m and published in mm.
    fn message(&self, zone: &Text, level: f64, object1: &Text, object2: &Text) -> Record {
        let values = vec![
            Value::Text(zone.clone()),
            Value::Real(level * 1000.0),
            Value::Text(object1.clone()),
            Value::Text(object2.clone()),
        ];
        Record::new(&self.fields, values)
    }
}

/// The topic of a zone.
pub fn zone_topic(zone: &str) -> String {
    format!("safetyzones/{zone}")
}
