//! How much of the space a campaign has looked at.

use serde::Serialize;
use sesame_plan::GridAxis;

use crate::coverage::{Coverage, CurvePoint, Feasible, Grid, curve};
use crate::record::{Origin, RecordError, Repository};
use crate::report::number::fixed;
use crate::sspr::Convention;

/// How much of the space a campaign has looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageSummary {
    /// The grid's axes, in its order.
    pub axes: Vec<GridAxis>,
    /// Tests that a cell must have seen to be covered.
    pub hits: u32,
    /// Cells covered.
    pub covered: usize,
    /// Cells there are.
    pub cells: usize,
    /// The share of all cells that is covered, in `0..=1`.
    pub coverage: f64,
    /// Cells that a test can reach, or has hit.
    pub feasible: usize,
    /// The share of these that is covered, in `0..=1`.
    pub feasible_coverage: f64,
    /// Whether exactly these cells can be reached; otherwise some of them perhaps cannot.
    pub feasible_exact: bool,
    /// The share of all cells at which the search was to stop.
    pub stop_at: Option<f64>,
    /// Coverage over evaluations: where a cell became covered, and at the end.
    pub curve: Vec<CurvePoint>,
    #[serde(skip)]
    pub(crate) counted: Coverage,
    #[serde(skip)]
    pub(crate) reachable: Feasible,
}

/// The coverage of a campaign that counts it; `None` for any other.
pub(crate) fn coverage(repository: &Repository) -> Result<Option<CoverageSummary>, RecordError> {
    let plan = repository.plan();
    let Some(goal) = &plan.campaign.coverage else { return Ok(None) };
    let grid = Grid::new(goal.axes.clone())
        .map_err(|error| RecordError::damaged(repository.path(), format!("its coverage is no grid: {error}")))?;
    let mut points = Vec::new();
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference {
            points.push(test.covering_point(plan, Convention::Ours));
        }
    })?;
    let reachable = Feasible::of(plan, &grid);
    let mut counted = Coverage::new(grid, goal.hits);
    let curve = curve(&mut counted, points);
    Ok(Some(CoverageSummary {
        axes: goal.axes.clone(),
        hits: counted.needed(),
        covered: counted.covered(),
        cells: counted.grid().len(),
        coverage: counted.share(),
        feasible: counted.feasible(&reachable),
        feasible_coverage: counted.feasible_share(&reachable),
        feasible_exact: reachable.is_exact(),
        stop_at: goal.stop_at,
        curve,
        counted,
        reachable,
    }))
}

/// The coverage in words: `54 of 108 cells covered (50 %), 56 % of the 96 that can be reached`.
pub(crate) fn coverage_sentence(coverage: &CoverageSummary) -> String {
    let CoverageSummary { covered, cells, feasible, .. } = *coverage;
    let percent = |share: f64| fixed(100.0 * share, usize::from(share < 0.1));
    let known = if coverage.feasible_exact { "" } else { ", as far as known" };
    format!(
        "{covered} of {cells} cells covered ({} %), {} % of the {feasible} that can be reached{known}",
        percent(coverage.coverage),
        percent(coverage.feasible_coverage),
    )
}
