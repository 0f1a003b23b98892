//! Reorder: holds each message for an independent time, so that later ones can overtake it.

use sesame_base::time::SimTime;
use sesame_plan::Drain;

use crate::fuzz::action::Action;
use crate::fuzz::draws::KeyedRng;

/// A reorder operation.
#[derive(Debug, Clone, Copy)]
pub struct Reorder {
    /// The longest time that a message is held, in seconds; not negative.
    pub window: f64,
    /// What happens to held messages when the operation becomes inactive.
    pub drain: Drain,
}

impl Reorder {
    /// How long the message is held, independently of earlier messages.
    pub fn apply(self, draws: KeyedRng) -> Action {
        Action::Delayed(SimTime::from_seconds(draws.unit(0) * self.window))
    }
}
