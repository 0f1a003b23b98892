//! How a search is made to look where it has not been.

/// What NSGA-II does besides evolving so that more cells are covered; only in campaigns by time that count coverage.
#[derive(Debug, Clone, Copy, PartialEq)]
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
