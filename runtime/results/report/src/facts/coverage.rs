//! How much of the space a campaign has looked at.

use std::collections::BTreeMap;

use serde::Serialize;

use sesame_plan::{CampaignPlan, Direction, GridAxis, MetricId};
use sesame_record::{Origin, RecordError, Repository, ScannedTest};
use sesame_search::coverage::{Coverage, CurvePoint, Feasible, Grid, curve};
use sesame_search::sspr::Convention;

/// How much of the space a campaign has looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageSummary {
    /// The grid's axes, in its order.
    pub axes: Vec<GridAxis>,
    /// Tests that must have hit a cell for it to be covered.
    pub hits: u32,
    /// Cells covered.
    pub covered: usize,
    /// All cells.
    pub cells: usize,
    /// The share of all cells that is covered, in `0..=1`.
    pub coverage: f64,
    /// Cells that a test can reach, or has hit.
    pub feasible: usize,
    /// The share of these that is covered, in `0..=1`.
    pub feasible_coverage: f64,
    /// Whether exactly these cells can be reached; otherwise some of them perhaps cannot.
    pub feasible_exact: bool,
    /// The share of all cells at which the search stops.
    pub stop_at: Option<f64>,
    /// Coverage over evaluations: where a cell became covered, and at the end.
    pub curve: Vec<CurvePoint>,
    #[serde(skip)]
    pub(crate) counted: Coverage,
    #[serde(skip)]
    pub(crate) reachable: Feasible,
    #[serde(skip)]
    pub(crate) worst: WorstOfCells,
}

/// The worst value of some metrics in each cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct WorstOfCells {
    /// The metrics: objectives and those that a requirement bounds, where it is known which way is of interest.
    pub(crate) metrics: Vec<MetricId>,
    /// Per cell and metric the value and the number of its test, of cells that were hit.
    values: BTreeMap<usize, Vec<Option<(f64, u32)>>>,
}

impl WorstOfCells {
    fn new(plan: &CampaignPlan) -> WorstOfCells {
        let mut metrics = Vec::new();
        let bounded = plan.requirements.iter().map(|requirement| requirement.metric);
        for id in plan.campaign.objectives.iter().copied().chain(bounded) {
            if plan.metric(id).direction.is_some() && !metrics.contains(&id) {
                metrics.push(id);
            }
        }
        WorstOfCells { metrics, values: BTreeMap::new() }
    }

    fn add(&mut self, plan: &CampaignPlan, cell: usize, test: &ScannedTest) {
        let worst = self.values.entry(cell).or_insert_with(|| vec![None; self.metrics.len()]);
        for (&id, worst) in self.metrics.iter().zip(worst) {
            let Some(value) = test.value(id).value.filter(|value| value.is_finite()) else { continue };
            let more = plan.metric(id).direction == Some(Direction::Maximise);
            if worst.is_none_or(|(known, _)| if more { value > known } else { value < known }) {
                *worst = Some((value, test.number));
            }
        }
    }

    /// The worst value of each metric in a cell with its test; nothing where no test was.
    pub(crate) fn of(&self, cell: usize) -> &[Option<(f64, u32)>] {
        self.values.get(&cell).map_or(&[], Vec::as_slice)
    }
}

/// The coverage of a campaign that counts it; `None` for any other.
pub(crate) fn coverage(repository: &Repository) -> Result<Option<CoverageSummary>, RecordError> {
    let plan = repository.plan();
    let Some(goal) = &plan.campaign.coverage else { return Ok(None) };
    let grid = Grid::new(goal.axes.clone()).map_err(|error| {
        RecordError::damaged(repository.path(), format!("the cells of its coverage are not a grid: {error}"))
    })?;
    let mut points = Vec::new();
    let mut worst = WorstOfCells::new(plan);
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference {
            let point = test.covering_point(plan, Convention::Ours);
            if let Some(cell) = point.as_ref().and_then(|point| grid.cell_of(point)) {
                worst.add(plan, cell, &test);
            }
            points.push(point);
        }
    })?;
    let reachable = Feasible::from_plan(plan, &grid);
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
        worst,
    }))
}
