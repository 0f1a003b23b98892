//! Scale: multiplies by a constant.

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::map;
use crate::fuzz::places::Places;
use crate::value::Value;

/// A scale operation.
#[derive(Debug, Clone)]
pub struct Scale {
    /// The values to change.
    pub places: Places,
    /// The constant.
    pub factor: f64,
}

impl Scale {
    /// Multiplies the values; of points, each coordinate.
    #[expect(clippy::float_cmp, reason = "exactly one changes nothing, not even whole numbers beyond 2^53")]
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        if self.factor == 1.0 {
            return Action::Unchanged;
        }
        self.places.change(at.on, message, |value, _| map(value, |_, x| x * self.factor))
    }
}
