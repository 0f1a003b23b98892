//! Coverage over evaluations.

use serde::Serialize;

use crate::coverage::Coverage;
use crate::sspr::Point;

/// How much was covered after so many tests.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Tests evaluated.
    pub evaluations: u32,
    /// Cells covered.
    pub covered: usize,
    /// The share of all cells that is covered, in `0..=1`.
    pub coverage: f64,
}

/// Feeds tests in their order, each with its point if it counts for one, and keeps a point of the curve wherever a cell
/// became covered, and at the end.
pub fn curve(coverage: &mut Coverage, tests: impl IntoIterator<Item = Option<Point>>) -> Vec<CurvePoint> {
    let mut curve = Vec::new();
    let mut evaluations = 0;
    let mut last = true;
    for point in tests {
        evaluations += 1;
        last = point.is_some_and(|point| coverage.add(&point));
        if last {
            curve.push(CurvePoint { evaluations, covered: coverage.covered(), coverage: coverage.share() });
        }
    }
    if !last {
        curve.push(CurvePoint { evaluations, covered: coverage.covered(), coverage: coverage.share() });
    }
    curve
}
