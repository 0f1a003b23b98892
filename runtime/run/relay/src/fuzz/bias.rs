//! Bias: adds a constant. On time stamps this is the skew of a clock.

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::{Amount, add};
use crate::fuzz::places::Places;
use crate::value::Value;

/// A bias or clock skew operation.
#[derive(Debug, Clone)]
pub struct Bias {
    /// The values to change.
    pub places: Places,
    /// The constant, in the field's unit.
    pub bias: Amount,
}

impl Bias {
    /// Adds the bias to the values.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        self.places.change(at.on, message, |value, _| add(value, |axis| self.bias.on(axis)))
    }
}
