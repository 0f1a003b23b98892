//! Reorder: holds each message for a time of its own, so that later ones overtake it.

use sesame_base::time::SimTime;
use sesame_plan::Drain;

use crate::fuzz::{Action, KeyedRng};

/// A reorder operation.
#[derive(Debug, Clone, Copy)]
pub struct Reorder {
    /// The longest time that a message is held, in seconds; not negative.
    pub window: f64,
    /// What becomes of held messages when the operation goes off.
    pub drain: Drain,
}

impl Reorder {
    /// How long the message is held, whatever is held before it.
    pub fn apply(self, draws: KeyedRng) -> Action {
        Action::Delayed(SimTime::from_seconds(draws.unit(0) * self.window))
    }
}
