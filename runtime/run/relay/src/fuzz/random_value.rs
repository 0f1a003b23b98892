//! Random value: replaces or shifts numbers, points and texts by a new uniform random number per message ([SESAME 2023,
//! §3.8], `RandomValueFromSetOperation`).

use sesame_plan::ValueMode;

use crate::fuzz::action::{Action, MessageContext};
use crate::fuzz::change::{add, map};
use crate::fuzz::places::Places;
use crate::fuzz::stuck_at::Stuck;
use crate::value::Value;

/// A random value operation on numbers or points, with its sub-ranges.
#[derive(Debug, Clone)]
pub struct RandomValue {
    /// The values to change.
    pub places: Places,
    /// Whether the random number replaces the value or is added to it.
    pub mode: ValueMode,
    /// Whether the random numbers are whole.
    pub integer: bool,
    /// The range on each axis of a point, in the field's unit; numbers use the first. For whole numbers both bounds are
    /// included.
    pub ranges: [(f64, f64); 3],
}

impl RandomValue {
    /// Changes the numbers that the message has as declared; whole numbers stay whole. A message with the same value as
    /// before counts as unchanged.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        self.places.change(at.on, message, |value, first| {
            let draw = |axis: usize| self.draw(axis, at.draws.unit(first + axis as u64));
            match self.mode {
                ValueMode::Offset => add(value, draw),
                ValueMode::Absolute => map(value, |axis, _| draw(axis)),
            }
        })
    }

    fn draw(&self, axis: usize, unit: f64) -> f64 {
        let (low, high) = self.ranges[axis];
        if self.integer { libm::floor(low + unit * (high - low + 1.0)).min(high) } else { low + unit * (high - low) }
    }
}

/// A random value operation that draws from a list.
#[derive(Debug, Clone)]
pub struct RandomItem {
    /// The values to change.
    pub places: Places,
    /// What is drawn from, all equally likely; at least one.
    pub items: Vec<Stuck>,
}

impl RandomItem {
    /// Replaces the values that are of the type of the items.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        self.places.change(at.on, message, |value, first| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is below their number")]
            let drawn = (at.draws.unit(first) * self.items.len() as f64) as usize;
            self.items.get(drawn).is_some_and(|item| item.put(value))
        })
    }
}
