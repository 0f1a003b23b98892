//! A grid over some dimensions of the reduced parameter space.

use sesame_plan::{Dimension, GridAxis};

use crate::sspr::Point;

/// Cells of a grid at most: what a table of them can hold and a map can show.
pub const MOST_CELLS: usize = 100_000;

/// Cells of equal width over one or more dimensions, numbered row by row: the last axis runs fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    axes: Vec<GridAxis>,
}

/// Why axes do not form a grid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GridError {
    /// An axis that is not written as it should be.
    #[error("`{0}` is not an axis of a grid; write it as `DIMENSION:LOW:HIGH:CELLS`, for example `T1:0:1:6`")]
    Malformed(String),
    /// A dimension that does not exist.
    #[error("there is no dimension `{0}`; there are T1, T2, T3, P1, P2, O0, O1, O2 and O3")]
    NoDimension(String),
    /// Ends that do not form a range.
    #[error("the axis {dimension} runs from {low} to {high}; the first must be less")]
    Ends {
        /// The dimension.
        dimension: &'static str,
        /// Where it is to begin.
        low: f64,
        /// Where it is to end.
        high: f64,
    },
    /// One dimension twice.
    #[error("the grid has the dimension {0} twice")]
    Twice(&'static str),
    /// No axis, or none with a cell.
    #[error("a grid has at least one axis, and each axis at least one cell")]
    Empty,
    /// Too many cells.
    #[error("the grid has more than {MOST_CELLS} cells; take fewer per axis")]
    TooMany,
}

impl Grid {
    /// A grid of these axes, in their order.
    pub fn new(axes: Vec<GridAxis>) -> Result<Grid, GridError> {
        if axes.is_empty() || axes.iter().any(|axis| axis.cells == 0) {
            return Err(GridError::Empty);
        }
        let mut cells = 1usize;
        for (at, axis) in axes.iter().enumerate() {
            let GridAxis { dimension, low, high, .. } = *axis;
            // Written so that a NaN is refused too.
            if !(low < high && (high - low).is_finite()) {
                return Err(GridError::Ends { dimension: dimension.name(), low, high });
            }
            if axes[..at].iter().any(|earlier| earlier.dimension == dimension) {
                return Err(GridError::Twice(dimension.name()));
            }
            let count = usize::try_from(axis.cells).unwrap_or(usize::MAX);
            cells = cells.checked_mul(count).filter(|&cells| cells <= MOST_CELLS).ok_or(GridError::TooMany)?;
        }
        Ok(Grid { axes })
    }

    /// A grid written as `T1:0:1:6,T2:0:0.5:6`: per axis the dimension, where it begins and ends, and its cells.
    pub fn parse(text: &str) -> Result<Grid, GridError> {
        let axes = text.split(',').map(|axis| {
            let malformed = || GridError::Malformed(axis.to_owned());
            let parts: Vec<&str> = axis.split(':').map(str::trim).collect();
            let [name, low, high, cells] = parts[..] else { return Err(malformed()) };
            let dimension = Dimension::named(name).ok_or_else(|| GridError::NoDimension(name.to_owned()))?;
            let number = |text: &str| text.parse::<f64>().map_err(|_| malformed());
            let (low, high) = (number(low)?, number(high)?);
            Ok(GridAxis { dimension, low, high, cells: cells.parse().map_err(|_| malformed())? })
        });
        Grid::new(axes.collect::<Result<_, _>>()?)
    }

    /// The axes.
    pub fn axes(&self) -> &[GridAxis] {
        &self.axes
    }

    /// How many cells there are; at least one.
    #[expect(clippy::len_without_is_empty, reason = "a grid always has a cell")]
    pub fn len(&self) -> usize {
        self.axes.iter().map(|axis| axis.cells as usize).product()
    }

    /// The cell of a point; `None` if the point lacks one of the dimensions.
    pub fn cell_of(&self, point: &Point) -> Option<usize> {
        let mut cell = 0;
        for axis in &self.axes {
            cell = cell * axis.cells as usize + place_on(axis, point.get(axis.dimension)?) as usize;
        }
        Some(cell)
    }

    /// Where a cell lies on each axis, from 0.
    pub fn place(&self, cell: usize) -> Vec<u32> {
        let mut rest = cell;
        let mut place: Vec<u32> = self
            .axes
            .iter()
            .rev()
            .map(|axis| {
                let at = rest % axis.cells as usize;
                rest /= axis.cells as usize;
                u32::try_from(at).expect("less than the axis' cells")
            })
            .collect();
        place.reverse();
        place
    }

    /// The values that fall into a cell of an axis: from the first up to, not including, the second. The cells at the
    /// ends have no end there.
    pub fn bounds(axis: &GridAxis, at: u32) -> (f64, f64) {
        let low = if at == 0 { f64::NEG_INFINITY } else { edge(axis, at) };
        let high = if at + 1 == axis.cells { f64::INFINITY } else { edge(axis, at + 1) };
        (low, high)
    }
}

/// Where a cell of an axis begins, as if it had an end there.
pub fn edge(axis: &GridAxis, at: u32) -> f64 {
    let share = f64::from(at) / f64::from(axis.cells);
    axis.low * (1.0 - share) + axis.high * share
}

/// The cell of an axis that a value falls into.
pub(crate) fn place_on(axis: &GridAxis, value: f64) -> u32 {
    let width = (axis.high - axis.low) / f64::from(axis.cells);
    let at = libm::floor((value - axis.low) / width).clamp(0.0, f64::from(axis.cells - 1));
    // In range by the clamp; a NaN, which no point has, would be the first cell.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was clamped to the cells")]
    let at = at as u32;
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_written_axis_by_axis() {
        let grid = Grid::parse("T1:0:1:6, O1:-0.5:5.5:6,P1:0:1:3").unwrap();
        assert_eq!(grid.len(), 108);
        assert_eq!(grid.axes()[1], GridAxis { dimension: Dimension::O1, low: -0.5, high: 5.5, cells: 6 });
        assert_eq!(grid.place(0), [0, 0, 0]);
        assert_eq!(grid.place(107), [5, 5, 2]);
        assert_eq!(grid.place(18 + 3 + 1), [1, 1, 1]);
    }

    #[test]
    fn text_that_is_not_a_grid_is_refused_with_the_reason() {
        let refused = |text: &str| Grid::parse(text).unwrap_err().to_string();
        assert_eq!(
            refused("T1:0:1"),
            "`T1:0:1` is not an axis of a grid; write it as `DIMENSION:LOW:HIGH:CELLS`, for example `T1:0:1:6`"
        );
        assert!(refused("T4:0:1:6").starts_with("there is no dimension `T4`"));
        assert!(refused("T1:1:0:6").contains("from 1 to 0"));
        assert!(refused("T1:0:NaN:6").contains("from 0 to NaN"));
        assert!(refused("T1:0:1:6,T1:0:1:3").contains("T1 twice"));
        assert!(refused("T1:0:1:0").contains("at least one cell"));
        assert!(refused("T1:0:1:4000,T2:0:1:4000").contains("more than 100000 cells"));
        assert!(refused("").contains("not an axis"));
    }

    #[test]
    fn values_beyond_the_ends_fall_into_the_end_cells() {
        let axis = GridAxis { dimension: Dimension::T2, low: 0.0, high: 0.5, cells: 5 };
        let values = [-3.0, 0.0, 0.0999, 0.1, 0.45, 0.5, 7.0];
        assert_eq!(values.map(|value| place_on(&axis, value)), [0, 0, 0, 1, 4, 4, 4]);
        assert_eq!(Grid::bounds(&axis, 0), (f64::NEG_INFINITY, 0.1));
        assert_eq!(Grid::bounds(&axis, 4), (0.4, f64::INFINITY));
    }
}
