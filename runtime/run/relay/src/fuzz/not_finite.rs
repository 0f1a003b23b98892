//! NaN and infinity, such as a sensor or a division by zero may produce.

use sesame_plan::NotFinite;

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::map;
use crate::fuzz::places::Places;
use crate::value::Value;

/// An operation that replaces reals by NaN or infinity.
#[derive(Debug, Clone)]
pub struct MakeNotFinite {
    /// The values to replace.
    pub places: Places,
    /// The replacement.
    pub number: NotFinite,
}

impl MakeNotFinite {
    /// Replaces reals and all coordinates of points; whole numbers have no such values and are left unchanged.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        let new = match self.number {
            NotFinite::Nan => f64::NAN,
            NotFinite::Infinity => f64::INFINITY,
            NotFinite::MinusInfinity => f64::NEG_INFINITY,
        };
        self.places.change(at.on, message, |value, _| match value {
            Value::Int(_) => false,
            value => map(value, |_, _| new),
        })
    }
}
