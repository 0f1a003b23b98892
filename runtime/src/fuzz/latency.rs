//! Latency: holds each message back (paper §3.6, `LatencyNetworkOperation`). The relay's release queue lets it go.

use sesame_plan::Drain;

use super::{Draws, Fate};
use crate::time::SimTime;

/// A latency operation.
#[derive(Debug, Clone, Copy)]
pub struct Latency {
    /// What delays are drawn from, uniformly, in seconds; a fixed delay has equal ends.
    pub delay: (f64, f64),
    /// What becomes of held messages when the window ends.
    pub drain: Drain,
}

impl Latency {
    /// How long the message is held, if nothing before it is held longer.
    pub fn apply(self, draws: Draws) -> Fate {
        let (low, high) = self.delay;
        let delay = if low == high { low } else { low + draws.unit(0) * (high - low) };
        Fate::Delayed(SimTime::from_seconds(delay))
    }
}
