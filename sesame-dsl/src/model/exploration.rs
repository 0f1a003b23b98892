//! How a search is made to look where it has not been, and when it has looked for long enough.

use super::ReducedDimension;

/// What NSGA-II does besides evolving so that more cells are covered; only in campaigns that count coverage, by time unless
/// it says otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Exploration {
    /// Some children are mutated again until they are planned to lie in a cell that wants tests.
    Boost {
        /// Only in every so-manieth generation: 1 or more. Default 2.
        every_generations: u32,
        /// Which children of such a generation.
        children: BoostedChildren,
        /// How often a child is mutated again at most: 1 or more. Default 10.
        tries: u32,
    },
    /// Some tests are changed so that they lie in a feasible cell that wants tests.
    Construct {
        /// The share of each generation, in `0..=1` and above 0. Default a half.
        share: f64,
        /// The share of all cells, in `0..=1` and above 0, from which on none is constructed any more.
        until: Option<f64>,
    },
    /// Of several candidates for each test the one is taken that would probably fall into a cell that wants tests. By
    /// condition only.
    Predict {
        /// How many candidates: 1 or more. Default 20.
        candidates: u32,
    },
    /// How far tests are from others counts as one objective more when survivors are chosen. By time and by condition, with
    /// or without cells.
    Novelty {
        /// How many of the nearest tests count: 1 or more. Default 10.
        neighbours: u32,
        /// The dimensions of distances: at least one, none twice. Default all.
        over: Vec<ReducedDimension>,
    },
}

/// Which children of a generation are boosted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoostedChildren {
    /// Every so-manieth: 1 or more. Default 2.
    Every {
        /// How many from one to the next.
        iterations: u32,
    },
    /// The first ones of a generation, `drop` fewer each time.
    Falling {
        /// How many the first time.
        first: u32,
        /// How many at least; at most `first`.
        last: u32,
        /// How many fewer each time. Default 1.
        drop: u32,
    },
}

/// What stops a search besides its number of tests and its coverage; after a generation, the first that holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StopRule {
    /// It has gone on for so many seconds of wall time, more than 0.
    WallTime {
        /// Seconds.
        seconds: f64,
    },
    /// Over so many generations, 1 or more, the hypervolume of its front grew by less than a share of itself.
    Stagnation {
        /// Generations.
        generations: u32,
        /// In `0..=1` and above 0.
        below: f64,
    },
    /// The next test would fall into a new cell with less than this probability, in `0..=1` and above 0. Only in campaigns
    /// that count coverage.
    Discovery {
        /// The probability.
        below: f64,
    },
    /// This share, in `0..=1` and above 0, of the cells that it would ever hit is hit. Only in campaigns that count
    /// coverage.
    Completeness {
        /// The share.
        share: f64,
    },
}
