//! Rate limit: drops messages that come too soon after the last one that passed.

use sesame_base::time::SimTime;

use crate::fuzz::action::Action;
use crate::fuzz::per_wire::PerWire;

/// A rate limit operation.
#[derive(Debug)]
pub struct RateLimit {
    /// The least time between two messages that pass on a wire.
    pub period: SimTime,
    /// Per wire: when the last message passed since the operation became active.
    pub passed: PerWire<Option<SimTime>>,
}

impl RateLimit {
    /// Drops the message or lets it pass.
    pub fn apply(&mut self, now: SimTime, member: u64) -> Action {
        let passed = self.passed.entry(member);
        if passed.is_some_and(|before| now < before + self.period) {
            return Action::Dropped;
        }
        *passed = Some(now);
        Action::Unchanged
    }
}
