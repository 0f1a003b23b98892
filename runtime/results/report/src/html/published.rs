//! Coverage that was published for the grid of the methodology's paper (its Table 3), for comparison on the page.

use sesame_plan::{Dimension, GridAxis};

use crate::facts::coverage::CoverageSummary;

/// Cells of that grid.
pub(crate) const CELLS: f64 = 108.0;

/// Evaluations, and cells covered by then, of the coverage-tracking search: every tenth test of the original platform's
/// recorded run, which reaches half of the cells at 210 evaluations, as the paper says of its Figure 15a (§6.2.1).
pub(crate) const TRACKING: [(f64, f64); 22] = [
    (0.0, 0.0),
    (10.0, 10.0),
    (20.0, 17.0),
    (30.0, 18.0),
    (40.0, 23.0),
    (50.0, 27.0),
    (60.0, 30.0),
    (70.0, 30.0),
    (80.0, 35.0),
    (90.0, 38.0),
    (100.0, 42.0),
    (110.0, 45.0),
    (120.0, 48.0),
    (130.0, 48.0),
    (140.0, 48.0),
    (150.0, 49.0),
    (160.0, 51.0),
    (170.0, 53.0),
    (180.0, 53.0),
    (190.0, 53.0),
    (200.0, 53.0),
    (210.0, 54.0),
];

/// Evaluations at which the coverage-boosting search reached half of the cells (§6.2.1); its curve was not printed as
/// numbers.
pub(crate) const BOOSTING: (f64, f64) = (110.0, 54.0);

/// Whether a campaign counts the cells of the paper's Table 3, as it does: T1 in [0, 1] and T2 in [0, 0.5], 6 each, P1
/// in [0, 1], 3, covered by one test.
pub(crate) fn is_published_grid(coverage: &CoverageSummary) -> bool {
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    let published = [axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6), axis(Dimension::P1, 1.0, 3)];
    coverage.hits == 1
        && coverage.axes.len() == published.len()
        && published.iter().all(|axis| coverage.axes.contains(axis))
}
