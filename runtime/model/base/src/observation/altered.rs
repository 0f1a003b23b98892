//! Which messages operations of a test altered in a run.

use serde::{Deserialize, Serialize};

/// How many altered messages a run lists at most.
pub const ALTERED_LISTED: usize = 10_000;

/// The messages that operations altered: dropped, held back, changed or followed by others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlteredMessages {
    /// Each message once for each operation that altered it, by operation, wire and number.
    Listed(Vec<AlteredMessage>),
    /// More than [`ALTERED_LISTED`].
    TooMany,
}

/// A message that an operation altered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlteredMessage {
    /// The position of the operation in the test.
    pub operation: u32,
    /// The position of the message's wire among those that the operation acts on.
    pub wire: u32,
    /// The number of the message among those published on its wire, from 0. What is done to a copy of a message is done
    /// to the message.
    pub number: u64,
    /// When the operation first altered it, in seconds of simulation time.
    pub time: f64,
}

impl AlteredMessages {
    /// What any of two runs altered, with the times of the first.
    #[must_use]
    pub fn with(self, other: AlteredMessages) -> AlteredMessages {
        let (AlteredMessages::Listed(mut first), AlteredMessages::Listed(second)) = (self, other) else {
            return AlteredMessages::TooMany;
        };
        first.extend(second);
        let which = |message: &AlteredMessage| (message.operation, message.wire, message.number);
        first.sort_by_key(which);
        first.dedup_by_key(|message| which(message));
        if first.len() > ALTERED_LISTED { AlteredMessages::TooMany } else { AlteredMessages::Listed(first) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(numbers: impl IntoIterator<Item = u64>, time: f64) -> AlteredMessages {
        let message = |number| AlteredMessage { operation: 0, wire: 0, number, time };
        AlteredMessages::Listed(numbers.into_iter().map(message).collect())
    }

    #[test]
    fn what_two_runs_altered_is_listed_once_and_within_the_limit() {
        let both = listed([1, 3], 1.0).with(listed([2, 3], 2.0));
        let AlteredMessages::Listed(both) = both else { panic!("they are few") };
        let found: Vec<(u64, f64)> = both.iter().map(|message| (message.number, message.time)).collect();
        assert_eq!(found, [(1, 1.0), (2, 2.0), (3, 1.0)]);
        let half = ALTERED_LISTED as u64 / 2;
        let within = listed(0..half, 1.0).with(listed(half..2 * half, 1.0));
        assert!(matches!(&within, AlteredMessages::Listed(all) if all.len() == ALTERED_LISTED));
        assert_eq!(within.with(listed([2 * half], 1.0)), AlteredMessages::TooMany);
        assert_eq!(listed([1], 1.0).with(AlteredMessages::TooMany), AlteredMessages::TooMany);
    }
}
