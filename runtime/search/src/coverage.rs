//! Cells of the reduced parameter space, and how much of it a campaign has looked at.
//!
//! A [`Grid`] divides some dimensions into cells of equal width. [`Coverage`] counts the tests that fall into each; it
//! is the same whether it is fed while a campaign runs or from its results afterwards. Some cells no test can reach (a
//! long interval has its midpoint in the middle of the window): [`Feasible`] says which can be, so that coverage is
//! told both over all cells, as in [SESAME 2023], and over those.

mod curve;
mod feasible;
mod grid;
mod spread;

use sesame_base::observation::Outcome;

use crate::sspr::Point;

pub use curve::{CurvePoint, curve};
pub use feasible::Feasible;
pub use grid::{Grid, GridError, MOST_CELLS, edge};

/// Whether a run counts: one without effect, one that the environment broke off, and one that stands for a run that was
/// counted already, covers no cell.
pub fn counts(outcome: &Outcome, duplicate: bool) -> bool {
    !duplicate && !matches!(outcome, Outcome::NoEffect) && !outcome.is_of_environment()
}

/// How often each cell of a grid was hit.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    grid: Grid,
    /// Hits after which a cell is covered; at least 1.
    needed: u32,
    hits: Vec<u32>,
    covered: usize,
}

impl Coverage {
    /// Coverage of nothing yet. A cell is covered when `needed` tests have hit it, at least one.
    pub fn new(grid: Grid, needed: u32) -> Self {
        let hits = vec![0; grid.len()];
        Coverage { grid, needed: needed.max(1), hits, covered: 0 }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Hits after which a cell is covered.
    pub fn needed(&self) -> u32 {
        self.needed
    }

    /// Counts a test. True if it has made a cell covered. A test without one of the grid's dimensions (intensity, where
    /// no operation has a parameter) lies in no cell.
    pub fn add(&mut self, point: &Point) -> bool {
        self.grid.cell_of(point).is_some_and(|cell| self.hit(cell))
    }

    /// Counts a test that lies in a cell of the grid. True if it has made the cell covered.
    pub fn hit(&mut self, cell: usize) -> bool {
        self.hits[cell] = self.hits[cell].saturating_add(1);
        let now = self.hits[cell] == self.needed;
        self.covered += usize::from(now);
        now
    }

    /// Tests in each cell, in the grid's order.
    pub fn hits(&self) -> &[u32] {
        &self.hits
    }

    /// Whether enough tests have hit a cell.
    pub fn is_covered(&self, cell: usize) -> bool {
        self.hits[cell] >= self.needed
    }

    /// How many cells are covered.
    pub fn covered(&self) -> usize {
        self.covered
    }

    /// The share of all cells that is covered, in `0..=1`.
    pub fn share(&self) -> f64 {
        self.covered as f64 / self.hits.len() as f64
    }

    /// Cells that count as feasible: those that are, and those that were hit nevertheless (a run that broke off early
    /// has shorter intervals than any that was planned).
    pub fn feasible(&self, feasible: &Feasible) -> usize {
        (0..self.hits.len()).filter(|&cell| feasible.reaches(cell) || self.hits[cell] > 0).count()
    }

    /// The share of the cells counted by [`Coverage::feasible`] that is covered, in `0..=1`; 0 where there are none.
    pub fn feasible_share(&self, feasible: &Feasible) -> f64 {
        let cells = self.feasible(feasible);
        if cells == 0 { 0.0 } else { self.covered as f64 / cells as f64 }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{ChoiceKind, Dimension, GridAxis, Span};

    use super::*;
    use crate::sspr::{Class, Convention, Disturbance, Intensity};

    /// A point at these T1, T2 and P1, in a window of 1 s.
    fn point(t1: f64, t2: f64, p1: f64) -> Point {
        let disturbance = Disturbance {
            class: Class::Value,
            window: Span { start: 0.0, end: 1.0 },
            intervals: vec![Span { start: t1 - t2 / 2.0, end: t1 + t2 / 2.0 }],
            parameters: vec![Intensity { permitted: (0.0, 1.0), chosen: (p1, p1), shape: ChoiceKind::Value }],
        };
        Point::from_disturbances(&[disturbance], Convention::Ours).unwrap()
    }

    fn grid(cells: [u32; 3]) -> Grid {
        let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
        Grid::new(vec![
            axis(Dimension::T1, 1.0, cells[0]),
            axis(Dimension::T2, 0.5, cells[1]),
            axis(Dimension::P1, 1.0, cells[2]),
        ])
        .unwrap()
    }

    #[test]
    fn a_cell_is_covered_after_as_many_hits_as_it_needs() {
        let mut coverage = Coverage::new(grid([2, 1, 1]), 2);
        assert!(!coverage.add(&point(0.2, 0.1, 0.5)));
        assert_eq!((coverage.covered(), coverage.hits()), (0, &[1, 0][..]));
        assert!(coverage.add(&point(0.3, 0.1, 0.5)));
        assert!(!coverage.add(&point(0.3, 0.1, 0.5)));
        assert_eq!((coverage.share(), coverage.is_covered(0), coverage.is_covered(1)), (0.5, true, false));
    }

    #[test]
    fn runs_without_effect_and_duplicates_cover_nothing() {
        assert!(counts(&Outcome::Completed, false));
        assert!(counts(&Outcome::Crash { message: "gone".to_owned() }, false));
        assert!(!counts(&Outcome::NoEffect, false));
        assert!(!counts(&Outcome::Disconnect { message: "gone".to_owned() }, false));
        assert!(!counts(&Outcome::Completed, true));
    }

    proptest! {
        #[test]
        fn covered_cells_are_those_that_a_scan_over_all_tests_finds(
            places in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64, 0.0..1.0f64), 0..60),
            cells in [1u32..5, 1u32..5, 1u32..4], needed in 1u32..4,
        ) {
            let grid = grid(cells);
            let mut coverage = Coverage::new(grid.clone(), needed);
            let points: Vec<Point> = places.iter().map(|&(a, b, c)| point(a, b * 2.0 * a.min(1.0 - a), c)).collect();
            for point in &points {
                coverage.add(point);
            }
            let inside = |value: f64, of: &GridAxis, at: u32| {
                let width = (of.high - of.low) / f64::from(of.cells);
                let (low, high) = (of.low + width * f64::from(at), of.low + width * f64::from(at + 1));
                (value >= low || at == 0) && (value < high || at + 1 == of.cells)
            };
            let mut covered = 0;
            for cell in 0..grid.len() {
                let place = grid.place(cell);
                let hits = points.iter().filter(|point| {
                    grid.axes().iter().zip(&place).all(|(of, &at)| inside(point.get(of.dimension).unwrap(), of, at))
                });
                let hits = u32::try_from(hits.count()).unwrap();
                prop_assert_eq!(hits, coverage.hits()[cell], "cell {:?}", place);
                covered += usize::from(hits >= needed);
            }
            prop_assert_eq!(covered, coverage.covered());
        }
    }
}
