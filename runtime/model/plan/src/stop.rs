//! When a search stops before all its tests were evaluated.

use serde::{Deserialize, Serialize};

/// A reason for a search to stop after a generation. If there are several, the first that holds stops it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StopRule {
    /// It has run for this long. The only rule by which results depend on how fast the machine is.
    WallTime {
        /// Seconds of wall time since it was started or resumed; positive.
        seconds: f64,
    },
    /// The hypervolume of its front has hardly grown.
    Stagnation {
        /// Over so many generations; at least 1.
        generations: u32,
        /// By less than this share of what it is now; above 0.
        below: f64,
    },
    /// A next test would hardly fall into a cell that none has fallen into: an upper bound after Good and Turing.
    Discovery {
        /// Less likely than this, in `0..=1` and above 0.
        below: f64,
    },
    /// It has hit nearly all the cells that its tests can reach, or of those it has hit and those it has not that have
    /// a chance of at least a thousandth per test: an upper bound after Good and Turing.
    Completeness {
        /// At least this share of them, in `0..=1` and above 0.
        share: f64,
    },
    /// The last tests showed no new cause: no violation of a requirement that a smaller or equal set of operations did
    /// not explain already.
    NoNewCause {
        /// So many tests; at least 1.
        tests: u32,
    },
    /// Each two operations acted together in a test, or a known cause explains what they would violate.
    EveryPair,
}
