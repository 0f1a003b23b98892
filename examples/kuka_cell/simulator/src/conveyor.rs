//! A sliding conveyor: a carriage on a straight track that takes gearboxes from one station to the next.

use sesame_runtime::simulator::{Bus, Port};

use crate::servo::{AxisLimits, Servo};

/// The constants of a conveyor.
#[derive(Debug, Clone, PartialEq)]
pub struct ConveyorModel {
    /// Its name on the wire, as in `conveyors/NAME/position`.
    pub name: &'static str,
    /// What its carriage can do, in m and s from the track's beginning.
    pub carriage: AxisLimits,
}

/// Brings assembled gearboxes from the assembly arms to where the R3200 picks them up.
pub const INFEED: ConveyorModel =
    ConveyorModel { name: "Infeed", carriage: AxisLimits { lower: 0.0, upper: 1.9, speed: 1.0, acceleration: 1.0 } };

/// Slides gearboxes from where the R3200 puts them down over to the workers, and the empty carrier back.
pub const OUTFEED: ConveyorModel =
    ConveyorModel { name: "Outfeed", carriage: AxisLimits { lower: 0.0, upper: 0.9, speed: 0.7, acceleration: 1.0 } };

/// A conveyor in motion.
#[derive(Debug, Clone)]
pub struct Conveyor {
    model: &'static ConveyorModel,
    carriage: Servo,
    target: Port,
    measured: Port,
}

impl Conveyor {
    /// A conveyor at rest at its track's beginning; opens its topics.
    pub fn open(model: &'static ConveyorModel, bus: &mut Bus<'_>) -> Self {
        let target = bus.open(&target_topic(model.name));
        bus.subscribe(target);
        Conveyor {
            model,
            carriage: Servo::at_rest(model.carriage.lower),
            target,
            measured: bus.open(&measured_topic(model.name)),
        }
    }

    /// Takes the last target that has arrived.
    pub fn receive(&mut self, bus: &mut Bus<'_>) {
        while let Some(message) = bus.receive(self.target) {
            if let Some(target) = message.number_at::<&str>(&[]) {
                self.carriage.aim(target);
            }
        }
    }

    /// Moves for `n_parts` parts of `part` seconds.
    pub fn advance(&mut self, n_parts: u32, part: f64) {
        for _ in 0..n_parts {
            self.carriage.advance(&self.model.carriage, part, 0.0);
        }
    }

    /// Publishes where the carriage is.
    pub fn publish_measured(&self, bus: &mut Bus<'_>) {
        bus.publish(self.measured, self.carriage.position());
    }
}

/// The topic of a carriage's target, in m.
pub fn target_topic(conveyor: &str) -> String {
    format!("conveyors/{conveyor}/position")
}

/// The topic of a carriage's measured place, in m.
pub fn measured_topic(conveyor: &str) -> String {
    format!("conveyors/{conveyor}/measured")
}
