//! Noise: adds a new normally distributed number with mean zero per message and number.

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::add;
use crate::fuzz::places::Places;
use crate::value::Value;

/// A noise operation.
#[derive(Debug, Clone)]
pub struct Noise {
    /// The values to change.
    pub places: Places,
    /// The standard deviation, in the field's unit; not negative.
    pub sigma: f64,
}

impl Noise {
    /// Adds noise to the values, independently for each coordinate of a point.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        self.places.change(at.on, message, |value, first| {
            add(value, |axis| self.sigma * at.draws.normal(first + 2 * axis as u64))
        })
    }
}
