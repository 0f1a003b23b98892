//! Whether a test that was run once more came out the same.

use serde::Serialize;

use sesame_base::test_number::TestNumber;

use crate::record::Difference;

/// What became of a recorded test that was run once more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// The test.
    pub test: TestNumber,
    /// The simulator's seed, then and now.
    pub simulator_seed: u64,
    /// Whether everything observed is the same, bit for bit.
    pub same: bool,
    /// What differs, if anything: `before` as recorded, `after` as replayed.
    pub differences: Vec<Difference>,
}
