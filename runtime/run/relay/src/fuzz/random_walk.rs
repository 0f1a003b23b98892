//! Random walk: adds a Brownian motion that starts at 0 when the operation becomes active, as the bias of an inertial
//! sensor or of odometry wanders.
//!
//! A step is drawn per message and number, with the variance that the time since the last step gives it. So the
//! distribution at a time does not depend on how many messages came before, or on which of them were lost.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use sesame_base::time::SimTime;

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::add;
use crate::fuzz::per_wire::PerWire;
use crate::fuzz::places::Places;
use crate::value::Value;

/// A random walk operation.
#[derive(Debug)]
pub struct RandomWalk {
    places: Places,
    sigma: f64,
    /// Per wire and value, by the number of the value's first random number.
    walks: PerWire<BTreeMap<u64, Walk>>,
}

/// The walk of one value since the operation became active.
#[derive(Debug, Default)]
struct Walk {
    /// How long the operation had been active at the last step.
    at: SimTime,
    /// Where it is, on each axis of a point; numbers use the first.
    offset: [f64; 3],
}

impl RandomWalk {
    /// A walk of the values at these places, with this standard deviation after one second, in the field's unit; not
    /// negative.
    pub fn new(places: Places, sigma: f64) -> Self {
        RandomWalk { places, sigma, walks: PerWire::default() }
    }

    /// The operation becomes active: all walks start at 0.
    pub fn begin(&mut self) {
        self.walks = PerWire::default();
    }

    /// Takes one step per value and coordinate, independent of each other, and adds where the walk is to the values.
    pub fn apply(&mut self, at: MessageContext, message: &mut Value) -> Action {
        let walks = self.walks.entry(at.on.member);
        let sigma = self.sigma;
        self.places.change(at.on, message, |value, first| {
            let walk = walks.entry(first).or_default();
            let deviation = sigma * libm::sqrt((at.active - walk.at).seconds());
            add(value, |axis| {
                walk.at = at.active;
                walk.offset[axis] += deviation * at.draws.normal(first + 2 * axis as u64);
                walk.offset[axis]
            })
        })
    }
}
