//! Which cells need tests, by the results so far and by the tests that were asked for since.

use sesame_plan::{CampaignPlan, CoverageGoal, Test};

use crate::Evaluated;
use crate::coverage::{Coverage, Feasible, Grid, GridError};
use crate::sspr::{Convention, Point, planned};

/// The cells of a campaign while it is searched. A test that is asked for reserves the cell into which it is planned to
/// fall, so that two tests of a generation do not target the same cell; results replace reservations.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    plan: CampaignPlan,
    coverage: Coverage,
    feasible: Feasible,
    reserved: Vec<u32>,
}

impl Cells {
    pub(crate) fn from_plan(plan: &CampaignPlan, goal: &CoverageGoal) -> Result<Cells, GridError> {
        let grid = Grid::new(goal.axes.clone())?;
        let feasible = Feasible::from_plan(plan, &grid);
        let reserved = vec![0; grid.len()];
        Ok(Cells { plan: plan.clone(), coverage: Coverage::new(grid, goal.hits), feasible, reserved })
    }

    pub(crate) fn plan(&self) -> &CampaignPlan {
        &self.plan
    }

    pub(crate) fn grid(&self) -> &Grid {
        self.coverage.grid()
    }

    /// Where a test is planned to lie; `None` where only a run can tell, or where it lies nowhere.
    pub(crate) fn point_of(&self, test: &Test) -> Option<Point> {
        Point::from_disturbances(&planned(&self.plan, test)?, Convention::Ours)
    }

    /// The cell that a test is planned to fall into.
    pub(crate) fn cell_of(&self, test: &Test) -> Option<usize> {
        self.grid().cell_of(&self.point_of(test)?)
    }

    /// Whether a cell is underserved: too few tests have hit it or have reserved it.
    pub(crate) fn needs_tests(&self, cell: usize) -> bool {
        self.coverage.hits()[cell].saturating_add(self.reserved[cell]) < self.coverage.needed()
    }

    /// Whether a test of the campaign can fall into a cell.
    pub(crate) fn can_reach(&self, cell: usize) -> bool {
        self.feasible.reaches(cell)
    }

    /// The cells that a test of the campaign can fall into.
    pub(crate) fn feasible(&self) -> &Feasible {
        &self.feasible
    }

    /// The share of all cells that are covered if all reserved cells are hit, in `0..=1`.
    pub(crate) fn expected_share(&self) -> f64 {
        let served = (0..self.grid().len()).filter(|&cell| !self.needs_tests(cell)).count();
        served as f64 / self.grid().len() as f64
    }

    /// Reserves a cell for a test that is asked for and planned to fall into it.
    pub(crate) fn reserve(&mut self, cell: usize) {
        self.reserved[cell] += 1;
    }

    /// Takes the results of the tests asked since the last time.
    pub(crate) fn learn(&mut self, results: &[Evaluated]) {
        self.reserved.fill(0);
        for point in results.iter().filter_map(|result| result.point.as_ref()) {
            self.coverage.add(point);
        }
    }
}
