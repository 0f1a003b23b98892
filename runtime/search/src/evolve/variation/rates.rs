//! How often each part of a test is varied.
//!
//! # Rates
//!
//! Chosen on four synthetic robots with hidden phases of vulnerability, hits to be maximised and active time minimised.
//! The measure is the hypervolume of the final front relative to that of random search with the same budget (geometric
//! mean over the robots; 200 seeds with population 10 and 210 evaluations, 60 seeds with 20 and 1000). The default
//! rates reach 1.51 and 1.70. The table lists for each rate the default, and the measure with other values:
//!
//! | rate        | default    | population 10, 210 evaluations   | population 20, 1000 evaluations  |
//! |-------------|------------|----------------------------------|----------------------------------|
//! | `crossover` | 0.9        | 0: 1.32, 0.5: 1.47               | 0: 1.56, 0.5: 1.66               |
//! | `window`    | 0.4        | 0.1: 1.40, 0.2: 1.41, 0.8: 1.54  | 0.1: 1.57, 0.2: 1.63, 0.8: 1.68  |
//! | `parameter` | 0.3        | 0: 1.46, 0.1: 1.49, 0.8: 1.49    | 0: 1.66, 0.1: 1.70, 0.8: 1.62    |
//! | `fresh`     | 0.2        | 0: 1.43, 0.5: 1.53, 1: 1.41      | 0: 1.59, 0.5: 1.64, 1: 1.48      |
//! | `retarget`  | 0.05       | 0: 1.49, 0.2: 1.49               | 0: 1.67, 0.2: 1.62               |
//! | `add`       | 0.8        | 0.1: 1.17, 0.4: 1.34             | 0.1: 1.37, 0.4: 1.55             |
//! | `duplicate` | 0.5        | 0: 1.31, 0.25: 1.42, 0.8: 1.55   | 0: 1.43, 0.25: 1.59, 0.8: 1.68   |
//! | `drop`      | 0.2        | 0: 1.49, 0.5: 1.47               | 0: 1.67, 0.5: 1.64               |
//! | `steps`     | 0.01, 0.2  | 0.01, 0.05: 1.44; 0.1, 0.5: 1.50 | 0.01, 0.05: 1.64; 0.1, 0.5: 1.66 |
//!
//! Operations must be added much more often than removed: selection for little active time already empties lists and
//! shortens windows, and without a steady supply of operations a small population ends in short tests that hit nothing.
//! With `add` 0.1, `duplicate` 0.05 and `drop` 0.15 the measure is 0.92 and 1.08: worse than random search on the
//! smaller budget.
//!
//! # Rates by condition
//!
//! The paper's platform regrows a part of a condition in two of three operations and crosses conditions position by
//! position. The best rates were measured on the same robots with conditions over two positions and a count of parts
//! (population 10, 210 evaluations, 8 to 16 seeds). With the rates above and end conditions, evolution reaches 0.79 of
//! random search: a condition hardly determines how long an operation is active, so selection converges to tests of one
//! active step that hit nothing. Changing conditions twice as often (`window` 0.8) and regrowing half of them (`fresh`
//! 0.5) gives 1.22; `fresh` 0.8 gives 1.03, and without `exchange` the rates above give 0.59. With lengths of 1 s to
//! 15 s, they give 1.93. Results differ between robots: with end conditions 1.2 to 2.0 on three of them, and 0.7 on one
//! where two operations have to act in the same short phase.

use crate::space::range::StepSizes;

/// How often what is varied. All are probabilities except `steps` and `tries`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// For each pair: that its lists are crossed.
    pub crossover: f64,
    /// For each two operations at the same place in the lists of a pair that was to be crossed: that their start
    /// conditions exchange parts, and by a draw of their own their end conditions.
    pub exchange: f64,
    /// For each operation: that its window changes, or one of its conditions, or its length.
    pub window: f64,
    /// For each parameter of each operation: that it changes.
    pub parameter: f64,
    /// For each change of a window, length or parameter: that it is drawn anew instead of moved a little. For each
    /// change of a condition: that a part of it is grown anew, instead of one sign, number or variable changed.
    pub fresh: f64,
    /// For each operation: that a fresh instance of another operation takes its place and keeps its window or
    /// conditions, as far as that is permitted there.
    pub retarget: f64,
    /// For each test: that a fresh operation joins it.
    pub add: f64,
    /// For each test: that a copy of one of its operations, with its window or conditions changed, joins it.
    pub duplicate: f64,
    /// For each test: that an operation leaves it.
    pub drop: f64,
    /// How far windows and parameters move.
    pub steps: StepSizes,
    /// How often a child that equals an earlier test is mutated again.
    pub tries: u32,
}

impl Default for Rates {
    fn default() -> Self {
        Rates {
            crossover: 0.9,
            exchange: 0.2,
            window: 0.4,
            parameter: 0.3,
            fresh: 0.2,
            retarget: 0.05,
            add: 0.8,
            duplicate: 0.5,
            drop: 0.2,
            steps: StepSizes { finest: 0.01, boldest: 0.2 },
            tries: 20,
        }
    }
}

impl Rates {
    /// The default rates where conditions switch.
    pub fn by_condition() -> Self {
        Rates { window: 0.8, fresh: 0.5, ..Rates::default() }
    }
}
