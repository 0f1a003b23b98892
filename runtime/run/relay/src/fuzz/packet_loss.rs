//! Packet loss: drops each message independently ([SESAME 2023, §3.8], `PacketLossNetworkOperation`).

use crate::fuzz::action::Action;
use crate::fuzz::draws::KeyedRng;

/// A packet loss operation.
#[derive(Debug, Clone, Copy)]
pub struct PacketLoss {
    /// The probability to drop a message, in `0..=1`.
    pub loss: f64,
}

impl PacketLoss {
    /// Drops the message or lets it pass.
    pub fn apply(self, draws: KeyedRng) -> Action {
        if draws.unit(0) < self.loss { Action::Dropped } else { Action::Unchanged }
    }
}
