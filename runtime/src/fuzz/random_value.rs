//! Random value: replaces or shifts a number by a fresh uniform draw per message (paper §3.8,
//! `RandomValueFromSetOperation`).

use sesame_plan::ValueMode;

use super::{Draws, Fate};
use crate::value::Value;

/// A random value operation with its sub-range.
#[derive(Debug, Clone)]
pub struct RandomValue {
    /// Where the number is in the message.
    pub path: Vec<String>,
    /// Whether the draw replaces the number or is added to it.
    pub mode: ValueMode,
    /// Whether draws are whole numbers.
    pub integer: bool,
    /// What is drawn from, in the field's unit; both ends included for whole numbers.
    pub range: (f64, f64),
}

impl RandomValue {
    /// Changes the number, if the message has it where the space says; whole numbers stay whole. A message that comes
    /// out as it went in counts as unchanged.
    pub fn apply(&self, draws: Draws, message: &mut Value) -> Fate {
        let Some(value) = message.at_mut(&self.path) else { return Fate::Unchanged };
        let draw = self.draw(draws.unit(0));
        let changed = match value {
            Value::Real(x) => replace(x, if self.mode == ValueMode::Offset { *x + draw } else { draw }),
            #[expect(clippy::cast_possible_truncation, reason = "`as` clamps to the integer's range")]
            Value::Int(n) => {
                let draw = libm::round(draw) as i64;
                replace(n, if self.mode == ValueMode::Offset { n.saturating_add(draw) } else { draw })
            }
            _ => false,
        };
        if changed { Fate::Changed } else { Fate::Unchanged }
    }

    fn draw(&self, unit: f64) -> f64 {
        let (low, high) = self.range;
        if self.integer { libm::floor(low + unit * (high - low + 1.0)).min(high) } else { low + unit * (high - low) }
    }
}

fn replace<T: PartialEq>(place: &mut T, new: T) -> bool {
    let changed = *place != new;
    *place = new;
    changed
}
