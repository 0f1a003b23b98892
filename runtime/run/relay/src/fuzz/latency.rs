//! Latency: holds each message back ([SESAME 2023, §3.6], `LatencyNetworkOperation`). The relay's release queue
//! releases it.

use sesame_base::time::SimTime;
use sesame_plan::{Distribution, Drain};

use crate::fuzz::action::Action;
use crate::fuzz::draws::KeyedRng;

/// How many times a normal delay is drawn before the middle is used; the probability that all are out of range is
/// 1e-21.
const TRIES: u64 = 16;

/// A latency operation.
#[derive(Debug, Clone, Copy)]
pub struct Latency {
    /// The range of delays, in seconds; a fixed delay has equal bounds.
    pub delay: (f64, f64),
    /// Their distribution.
    pub distribution: Distribution,
    /// What happens to held messages when the window ends.
    pub drain: Drain,
}

impl Latency {
    /// How long the message is held, unless earlier messages are held longer.
    pub fn apply(self, draws: KeyedRng) -> Action {
        let (low, high) = self.delay;
        let delay = if low == high {
            low
        } else if self.distribution == Distribution::Normal {
            // The range is two standard deviations on either side.
            let (middle, sigma) = (f64::midpoint(low, high), (high - low) / 4.0);
            let drawn = (0..TRIES).map(|attempt| draws.normal(2 * attempt)).find(|normal| normal.abs() <= 2.0);
            (middle + sigma * drawn.unwrap_or(0.0)).clamp(low, high)
        } else {
            low + draws.unit(0) * (high - low)
        };
        Action::Delayed(SimTime::from_seconds(delay))
    }
}
