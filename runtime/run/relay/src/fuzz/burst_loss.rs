//! Burst loss: drops messages in bursts (Gilbert 1960, Elliott 1963).
//!
//! A Markov chain of two states per wire: in the good state messages pass, in the bad state each is dropped with
//! probability `loss`. It starts in the good state when the operation becomes active, and makes a transition at each
//! message before the message is handled. In the long run `loss * enter / (enter + leave)` of all messages are dropped,
//! and a burst has a mean length of `1 / leave` messages.

use crate::fuzz::action::Action;
use crate::fuzz::draws::KeyedRng;
use crate::fuzz::per_wire::PerWire;

/// A burst loss operation.
#[derive(Debug)]
pub struct BurstLoss {
    /// The probability per message that a burst begins, in `0..=1`.
    pub enter: f64,
    /// The probability per message that a burst ends, in `0..=1`.
    pub leave: f64,
    /// The probability that a message of a burst is dropped, in `0..=1`.
    pub loss: f64,
    /// Per wire: whether there is a burst.
    pub bursting: PerWire<bool>,
}

impl BurstLoss {
    /// Makes a transition, and drops the message or lets it pass.
    pub fn apply(&mut self, draws: KeyedRng, member: u64) -> Action {
        let bursting = self.bursting.entry(member);
        let turns = draws.unit(0) < if *bursting { self.leave } else { self.enter };
        *bursting ^= turns;
        if *bursting && draws.unit(1) < self.loss { Action::Dropped } else { Action::Unchanged }
    }
}
