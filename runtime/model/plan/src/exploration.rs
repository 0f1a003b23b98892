//! How an evolutionary search is directed to where no test has been.

use serde::{Deserialize, Serialize};

use crate::Dimension;

/// What an evolution does so that more cells are covered. It needs a campaign that counts its coverage, unless it
/// says otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Exploration {
    /// Coverage boosting [SESAME 2023, section 4.2.2]: some children are mutated again until they lie in a
    /// cell that needs tests. For campaigns by time.
    Boost {
        /// Only in every n-th generation; at least 1.
        every_generations: u32,
        /// Which children of such a generation.
        children: BoostedChildren,
        /// How often a child is mutated again at most.
        tries: u32,
    },
    /// Construction: some tests are changed as little as may be so that they lie in a feasible cell that needs tests.
    /// For campaigns by time.
    Construct {
        /// The share of the tests of each generation, in `0..=1`.
        share: f64,
        /// The share of all cells, in `0..=1`, from which on none is constructed any more; `None` for all feasible
        /// ones.
        until: Option<f64>,
    },
    /// Novelty: how far a test is from others counts as one objective more when survivors are chosen. It needs no
    /// coverage.
    Novelty {
        /// How many of the nearest tests count; at least 1.
        neighbours: u32,
        /// The dimensions of distances; at least one.
        over: Vec<Dimension>,
    },
    /// Prediction: of several candidates for each test the one that would probably fall into a cell that needs tests.
    /// For campaigns by condition.
    Predict {
        /// How many candidates; at least 1.
        candidates: u32,
    },
}

/// Which children of a generation are boosted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BoostedChildren {
    /// Every n-th, beginning with the first.
    Every {
        /// At least 1.
        iterations: u32,
    },
    /// The first ones: `first` at the beginning, `drop` fewer each time that a generation is boosted, never fewer than
    /// `last`.
    Falling {
        /// How many at the beginning.
        first: u32,
        /// How many at least.
        last: u32,
        /// How many fewer each time.
        drop: u32,
    },
}

impl BoostedChildren {
    /// Whether the `index`th child, from 0, is boosted in the `time`th boosted generation, from 0.
    pub fn includes(self, index: u32, time: u32) -> bool {
        match self {
            BoostedChildren::Every { iterations } => index.is_multiple_of(iterations.max(1)),
            BoostedChildren::Falling { first, last, drop } => {
                index < first.saturating_sub(time.saturating_mul(drop)).max(last)
            }
        }
    }
}
