//! Drift: adds what grows with the time since the operation went on.

use sesame_base::time::SimTime;

use crate::fuzz::change::{Amount, add};
use crate::fuzz::{Action, Places};
use crate::value::Value;

/// A drift operation.
#[derive(Debug, Clone)]
pub struct Drift {
    /// What is changed.
    pub places: Places,
    /// How fast the offset grows, in the field's unit per second.
    pub rate: Amount,
}

impl Drift {
    /// Adds to the values what has accumulated in the time that the operation is on.
    pub fn apply(&self, active: SimTime, message: &mut Value) -> Action {
        let seconds = active.seconds();
        self.places.change(message, |value, _| add(value, |axis| self.rate.on(axis) * seconds))
    }
}
