//! Rate limit: drops what comes too soon after the last message that passed.

use sesame_base::time::SimTime;

use crate::fuzz::{Action, PerWire};

/// A rate limit operation.
#[derive(Debug)]
pub struct RateLimit {
    /// The least time between two messages that pass on a wire.
    pub period: SimTime,
    /// When the last one passed since the operation went on.
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
