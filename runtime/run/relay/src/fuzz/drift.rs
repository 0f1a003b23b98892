//! Drift: adds an offset that grows with the time since the operation became active.

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::{Amount, add};
use crate::fuzz::places::Places;
use crate::value::Value;

/// A drift operation.
#[derive(Debug, Clone)]
pub struct Drift {
    /// The values to change.
    pub places: Places,
    /// How fast the offset grows, in the field's unit per second.
    pub rate: Amount,
}

impl Drift {
    /// Adds the offset that has accumulated while the operation is active.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        let seconds = at.active.seconds();
        self.places.change(at.on, message, |value, _| add(value, |axis| self.rate.on(axis) * seconds))
    }
}
