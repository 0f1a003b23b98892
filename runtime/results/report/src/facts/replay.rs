//! Whether a test that was run once more gave the same results.

use serde::Serialize;

use sesame_base::test_number::TestNumber;
use sesame_record::Difference;

/// The result of running a recorded test once more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replay {
    /// The test.
    pub test: TestNumber,
    /// The simulator's seed, then and now.
    pub simulator_seed: u64,
    /// Whether everything observed is the same, bit for bit.
    pub same: bool,
    /// The differences: `before` as recorded, `after` as replayed.
    pub differences: Vec<Difference>,
}
