//! NaN and infinity: what a sensor or a division by zero makes of a number.

use sesame_plan::NotFinite;

use crate::fuzz::change::map;
use crate::fuzz::{Action, Places};
use crate::value::Value;

/// An operation that replaces reals by what is no finite number.
#[derive(Debug, Clone)]
pub struct MakeNotFinite {
    /// What is replaced.
    pub places: Places,
    /// By what.
    pub number: NotFinite,
}

impl MakeNotFinite {
    /// Replaces reals and all coordinates of points; whole numbers have no such values and stay.
    pub fn apply(&self, message: &mut Value) -> Action {
        let new = match self.number {
            NotFinite::Nan => f64::NAN,
            NotFinite::Infinity => f64::INFINITY,
            NotFinite::MinusInfinity => f64::NEG_INFINITY,
        };
        self.places.change(message, |value, _| match value {
            Value::Int(_) => false,
            value => map(value, |_, _| new),
        })
    }
}
