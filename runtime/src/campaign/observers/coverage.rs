//! How many cells of the reduced parameter space are covered.

use std::ops::ControlFlow;

use sesame_plan::{CampaignPlan, CoverageGoal};
use sesame_record::{GenerationCoverage, RecordError, Recorder, TestRecord};
use sesame_search::coverage::{self, Coverage, Feasible, Grid, GridError};
use sesame_search::sspr::{self, Point};

use crate::campaign::observer::{EndedTest, Generation, Observer};

/// Counts cells while a campaign runs, and ends it when its goal is reached. Hits add up in any order, so that what is
/// covered after a generation does not depend on the order in which its tests end.
#[derive(Debug)]
pub(super) struct CoverageOfEachGeneration {
    coverage: Coverage,
    feasible: Feasible,
    stop_at: Option<f64>,
}

impl CoverageOfEachGeneration {
    /// For the tests of a plan, and this goal of its campaign.
    pub(super) fn new(plan: &CampaignPlan, goal: &CoverageGoal) -> Result<Self, GridError> {
        let grid = Grid::new(goal.axes.clone())?;
        let feasible = Feasible::from_plan(plan, &grid);
        let coverage = Coverage::new(grid, goal.hits);
        Ok(CoverageOfEachGeneration { coverage, feasible, stop_at: goal.stop_at })
    }

    fn after(&self, generation: u32, evaluations: u32) -> GenerationCoverage {
        GenerationCoverage {
            generation,
            evaluations,
            covered: self.coverage.covered(),
            cells: self.coverage.grid().len(),
            feasible: self.coverage.feasible(&self.feasible),
        }
    }

    /// Why the search stops, if it has covered enough.
    fn reached(&self) -> Option<String> {
        let (covered, cells) = (self.coverage.covered(), self.coverage.grid().len());
        self.stop_at
            .filter(|&share| self.coverage.share() >= share)
            .map(|_| format!("its coverage was reached: {covered} of {cells} cells"))
    }
}

impl Observer for CoverageOfEachGeneration {
    fn test_ended(&mut self, test: EndedTest<'_>) {
        if let Some(point) = test.point {
            self.coverage.add(point);
        }
    }

    fn generation_ended(
        &mut self,
        generation: Generation<'_>,
        recorder: &mut Recorder,
    ) -> Result<ControlFlow<String>, RecordError> {
        recorder.put_coverage(&self.after(generation.number, generation.done))?;
        Ok(self.reached().map_or(ControlFlow::Continue(()), ControlFlow::Break))
    }

    fn may_end(&self) -> bool {
        self.stop_at.is_some()
    }

    /// That no search can reach the goal.
    fn warning(&self) -> Option<String> {
        let (feasible, cells) = (self.feasible.count(), self.coverage.grid().len());
        self.stop_at.filter(|&share| (feasible as f64) < share * cells as f64).map(|share| {
            format!(
                "the search cannot stop at {} % of all cells: its tests can reach {feasible} of {cells}",
                100.0 * share
            )
        })
    }

    fn coverage(&self) -> Option<&Coverage> {
        Some(&self.coverage)
    }
}

/// Where a run lies in the reduced parameter space, if it counts for coverage.
pub(in crate::campaign) fn counted_point(plan: &CampaignPlan, record: &TestRecord) -> Option<Point> {
    if !coverage::counts(&record.observation.outcome, record.duplicate_of.is_some()) {
        return None;
    }
    sspr::observed_point(plan, &record.test, &record.observation)
}

#[cfg(test)]
mod tests {
    use sesame_plan::{Dimension, GridAxis};
    use sesame_record::sample;

    use super::*;

    fn tracking(stop_at: f64) -> CoverageOfEachGeneration {
        let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
        let axes = vec![axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6), axis(Dimension::P1, 1.0, 3)];
        let goal = CoverageGoal { axes, hits: 1, stop_at: Some(stop_at) };
        CoverageOfEachGeneration::new(&sample::plan(), &goal).unwrap()
    }

    #[test]
    fn a_coverage_that_no_test_can_reach_is_told_before_anything_is_run() {
        assert_eq!(tracking(0.8).warning(), None);
        let warning = tracking(0.9).warning();
        let expected = "the search cannot stop at 90 % of all cells: its tests can reach 96 of 108";
        assert_eq!(warning.as_deref(), Some(expected));
    }

    #[test]
    fn what_is_covered_after_a_generation_is_the_same_in_any_order_of_its_tests() {
        let plan = sample::plan();
        let records = sample::records(&plan, 40);
        let (mut forth, mut back) = (tracking(0.1), tracking(0.1));
        for (first, last) in records.iter().zip(records.iter().rev()) {
            for (tracking, record) in [(&mut forth, first), (&mut back, last)] {
                if let Some(point) = counted_point(&plan, record) {
                    tracking.coverage.add(&point);
                }
            }
        }
        assert_eq!(forth.after(3, 40), back.after(3, 40));
        assert!(forth.reached().is_some_and(|why| why.starts_with("its coverage was reached: ")));
        assert_eq!(tracking(0.1).reached(), None);
    }
}
