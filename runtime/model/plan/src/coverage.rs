//! How a campaign measures how much of the space it has looked at.

use serde::{Deserialize, Serialize};

/// A dimension of the reduced parameter space (the SESAME standard parameter reduction, SSPR).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Dimension {
    /// Mean of the midpoints of the active intervals, as shares of the permitted window.
    T1,
    /// Mean of the lengths of the active intervals, as shares of the permitted window.
    T2,
    /// Spread of the midpoints of the active intervals.
    T3,
    /// Mean of the normalised parameters.
    P1,
    /// Spread of the normalised parameters.
    P2,
    /// Number of operations.
    O0,
    /// Number of operations that change values.
    O1,
    /// Number of operations that lose messages.
    O2,
    /// Number of operations that delay messages.
    O3,
}

impl Dimension {
    /// All of them, in their usual order.
    pub const ALL: [Dimension; 9] = [
        Dimension::T1,
        Dimension::T2,
        Dimension::T3,
        Dimension::P1,
        Dimension::P2,
        Dimension::O0,
        Dimension::O1,
        Dimension::O2,
        Dimension::O3,
    ];

    /// Its name, as the `.sesame` file and tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Dimension::T1 => "T1",
            Dimension::T2 => "T2",
            Dimension::T3 => "T3",
            Dimension::P1 => "P1",
            Dimension::P2 => "P2",
            Dimension::O0 => "O0",
            Dimension::O1 => "O1",
            Dimension::O2 => "O2",
            Dimension::O3 => "O3",
        }
    }

    /// The dimension of a name.
    pub fn named(name: &str) -> Option<Dimension> {
        Dimension::ALL.into_iter().find(|dimension| dimension.name() == name)
    }
}

/// A dimension divided into cells of equal width. Values beyond its ends belong to the cell at that end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GridAxis {
    /// Which dimension.
    pub dimension: Dimension,
    /// Where the first cell begins.
    pub low: f64,
    /// Where the last cell ends; above `low`.
    pub high: f64,
    /// How many cells; at least 1.
    pub cells: u32,
}

/// How a campaign's coverage is counted, and when it suffices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoverageGoal {
    /// The grid: at least one axis, each of another dimension.
    pub axes: Vec<GridAxis>,
    /// Tests that a cell must have seen to be covered; at least 1.
    pub hits: u32,
    /// The share of all cells, in `0..=1`, at which the search stops; `None` for a search that only counts.
    pub stop_at: Option<f64>,
}
