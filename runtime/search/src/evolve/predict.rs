//! Coverage by condition, by prediction.
//!
//! Where conditions switch operations, only a run shows when they are active, so a test cannot be placed in a cell. But
//! most variables of conditions behave the same whether messages are disturbed or not. So a test's conditions are
//! evaluated on the recorded values of earlier runs, which gives the intervals, and thus the cell, of the test. Of
//! several candidates for a place in a generation the one that most probably falls into a cell that needs tests is
//! taken.
//!
//! Each candidate is predicted from the reference run and from the runs of its parents. The credibility of these two
//! sources is learned: the share of their predictions that came true, beginning at one half.

use std::collections::VecDeque;

use sesame_base::activation::Activity;
use sesame_base::observation::Observation;
use sesame_base::time::SimTime;
use sesame_optimise::nsga2::{Child, Variation};
use sesame_plan::{Activation, ActivationMode, CampaignPlan, MetricId, OperationId, Span, Test};
use sesame_rng::Stream;

use crate::evolve::cells::Cells;
use crate::space::initial::fresh_test;
use crate::space::test_space::TestSpace;
use crate::sspr::{Convention, Point, disturbance};
use crate::strategy::Learning;
use crate::{Evaluated, TestVariation};

/// Moments at which a recorded run is evaluated: more than enough to tell cells apart.
const MOMENTS: u32 = 350;
/// How many of the latest runs are remembered.
const REMEMBERED: usize = 200;

/// The values of a plan's condition variables in one run, in even steps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VariableTrajectories {
    variables: Vec<MetricId>,
    /// Per moment the values of the variables, each as of its last change; `None` where there was none yet.
    values: Vec<Vec<Option<f64>>>,
}

impl VariableTrajectories {
    /// The trajectories of the variables in an observed run; `None` for a campaign by time, which has none.
    pub(crate) fn from_observation(plan: &CampaignPlan, observation: &Observation) -> Option<VariableTrajectories> {
        let ActivationMode::Condition { space } = &plan.campaign.activation else { return None };
        let variables: Vec<MetricId> = space.variables.iter().map(|variable| variable.metric).collect();
        let values = (0..MOMENTS)
            .map(|moment| {
                let time = time_of(plan, moment);
                let value = |&metric: &MetricId| {
                    let series = &observation.metrics.get(metric.index())?.series;
                    let before = series.partition_point(|(at, _)| *at <= time);
                    before.checked_sub(1).map(|last| series[last].1).or(plan.metric(metric).initial)
                };
                variables.iter().map(value).collect()
            })
            .collect();
        Some(VariableTrajectories { variables, values })
    }

    /// Where a test would lie with these values; `None` if no operation would be active.
    pub(crate) fn predicted(&self, plan: &CampaignPlan, test: &Test) -> Option<Point> {
        let operations = test.operations.iter();
        let disturbances: Vec<_> = operations
            .map(|operation| {
                let intervals = self.intervals_of(plan, operation.operation, &operation.activation);
                disturbance(plan, operation.operation, &operation.parameters, intervals)
            })
            .collect();
        Point::from_disturbances(&disturbances, Convention::Ours)
    }

    /// When an operation would be active, in seconds.
    pub(crate) fn intervals_of(
        &self,
        plan: &CampaignPlan,
        operation: OperationId,
        activation: &Activation,
    ) -> Vec<Span> {
        let within = plan.operation(operation).within;
        let end = within.end.min(plan.campaign.end_after);
        let mut activity = Activity::new(activation, Span { start: within.start, end });
        let value_in = |values: &[Option<f64>], metric| {
            self.variables.iter().position(|variable| *variable == metric).and_then(|at| values[at])
        };
        let mut before: Option<&Vec<Option<f64>>> = None;
        for (moment, values) in (0u32..).zip(&self.values) {
            let now = SimTime::from_seconds(time_of(plan, moment));
            while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
                activity.advance_to(edge);
                activity.evaluate(edge, &|metric| value_in(before.unwrap_or(values), metric));
            }
            if before.replace(values) != Some(values) {
                activity.evaluate(now, &|metric| value_in(values, metric));
            }
        }
        activity.intervals(SimTime::from_seconds(end))
    }
}

/// When a moment is, in seconds of simulation time.
fn time_of(plan: &CampaignPlan, moment: u32) -> f64 {
    plan.campaign.end_after * f64::from(moment) / f64::from(MOMENTS)
}

/// How often predictions from one kind of source came true.
#[derive(Debug, Clone, Copy)]
struct Credibility {
    right: u32,
    all: u32,
}

impl Credibility {
    const NEW: Credibility = Credibility { right: 0, all: 0 };

    /// The share that came true, by Laplace's rule of succession.
    fn share(self) -> f64 {
        (f64::from(self.right) + 1.0) / (f64::from(self.all) + 2.0)
    }

    fn learn(&mut self, right: bool) {
        self.right += u32::from(right);
        self.all += 1;
    }
}

/// What was predicted of a test that was asked for.
#[derive(Debug, Clone)]
struct Prediction {
    from_reference: Option<usize>,
    from_parents: Vec<Option<usize>>,
}

/// Variation of tests by condition that prefers tests predicted to fall into cells that need tests.
#[derive(Debug, Clone)]
pub(crate) struct PredictingVariation {
    tests: TestVariation,
    test_space: TestSpace,
    cells: Cells,
    candidates: u32,
    seed: u64,
    reference: Option<VariableTrajectories>,
    /// The latest tests that were run, each with its trajectories, the oldest first.
    remembered: VecDeque<(Test, VariableTrajectories)>,
    reference_credibility: Credibility,
    parents_credibility: Credibility,
    /// The predictions for the generation asked last.
    predictions: Vec<Prediction>,
}

impl PredictingVariation {
    pub(crate) fn new(tests: TestVariation, test_space: TestSpace, cells: Cells, candidates: u32, seed: u64) -> Self {
        PredictingVariation {
            tests,
            test_space,
            cells,
            candidates: candidates.max(1),
            seed,
            reference: None,
            remembered: VecDeque::new(),
            reference_credibility: Credibility::NEW,
            parents_credibility: Credibility::NEW,
            predictions: Vec::new(),
        }
    }

    fn prediction(&self, test: &Test, parents: &[VariableTrajectories]) -> Prediction {
        let cell = |trajectories: &VariableTrajectories| {
            self.cells.grid().cell_of(&trajectories.predicted(self.cells.plan(), test)?)
        };
        Prediction {
            from_reference: self.reference.as_ref().and_then(cell),
            from_parents: parents.iter().map(cell).collect(),
        }
    }

    /// The credence that a test falls into a cell that needs tests, and that it falls into any cell.
    fn credence_of(&self, prediction: &Prediction) -> (f64, f64) {
        let of_parents = self.parents_credibility.share() / prediction.from_parents.len().max(1) as f64;
        let sources = [(self.reference_credibility.share(), prediction.from_reference)].into_iter();
        let sources = sources.chain(prediction.from_parents.iter().map(|&cell| (of_parents, cell)));
        let (mut all, mut wanted, mut active) = (0.0, 0.0, 0.0);
        for (trust, cell) in sources {
            all += trust;
            if let Some(cell) = cell {
                active += trust;
                wanted += if self.cells.needs_tests(cell) { trust } else { 0.0 };
            }
        }
        (wanted / all, active / all)
    }

    /// The best of the test and other candidates: fresh tests in the first generation, else tests changed further.
    fn chosen(&mut self, test: &Test, parents: &[VariableTrajectories], mut stream: Stream) -> Test {
        let prediction = self.prediction(test, parents);
        let mut changed = test.clone();
        let mut best = (self.credence_of(&prediction), test.clone(), prediction);
        for turn in 1..self.candidates {
            // Nothing can be better.
            if best.0 == (1.0, 1.0) {
                break;
            }
            let candidate = if parents.is_empty() {
                fresh_test(&self.test_space, &mut stream)
            } else {
                // Now and then back to where it began, so that most candidates keep much of their parents.
                if turn % 4 == 0 {
                    changed = test.clone();
                }
                self.tests.mutate_again(&mut changed, &mut stream);
                changed.clone()
            };
            let prediction = self.prediction(&candidate, parents);
            let credence = self.credence_of(&prediction);
            if credence > best.0 && self.tests.claim(&candidate) {
                best = (credence, candidate, prediction);
            }
        }
        let (_, test, prediction) = best;
        if let Some(cell) = prediction.from_reference.or(prediction.from_parents.first().copied().flatten()) {
            self.cells.reserve(cell);
        }
        self.predictions.push(prediction);
        test
    }
}

impl Variation for PredictingVariation {
    type Genome = Test;

    fn initial(&mut self, index: u64) -> Test {
        let test = self.tests.initial(index);
        self.chosen(&test, &[], Stream::derive(self.seed, "predict initial", &[index]))
    }

    fn offspring(&mut self, parents: [&Test; 2], generation: u64, pair: u64) -> [Child<Test>; 2] {
        let mut place = 2 * pair;
        let remembered = self.remembered.iter().rev();
        let trajectories: Vec<VariableTrajectories> = parents
            .iter()
            .filter_map(|parent| remembered.clone().find(|(test, _)| test == *parent))
            .map(|(_, trajectories)| trajectories.clone())
            .collect();
        self.tests.offspring(parents, generation, pair).map(|child| {
            let stream = Stream::derive(self.seed, "predict", &[generation, place]);
            let genome = self.chosen(&child.genome, &trajectories, stream);
            place += 1;
            Child { genome, ..child }
        })
    }
}

impl Learning for PredictingVariation {
    fn begin(&mut self, reference: &Observation) {
        self.tests.take_reference(reference);
        self.test_space.take_reference(reference);
        self.reference = VariableTrajectories::from_observation(self.cells.plan(), reference);
    }

    fn reads_series(&self) -> bool {
        true
    }

    fn learn(&mut self, results: &[Evaluated]) {
        for (prediction, result) in self.predictions.drain(..).zip(results) {
            let hit = result.point.as_ref().and_then(|point| self.cells.grid().cell_of(point));
            self.reference_credibility.learn(prediction.from_reference == hit);
            for cell in prediction.from_parents {
                self.parents_credibility.learn(cell == hit);
            }
            if let Some(trajectories) = VariableTrajectories::from_observation(self.cells.plan(), &result.run) {
                self.remembered.push_back((result.test.clone(), trajectories));
            }
        }
        while self.remembered.len() > REMEMBERED {
            self.remembered.pop_front();
        }
        self.cells.learn(results);
    }
}

#[cfg(test)]
mod tests {
    use sesame_plan::condition::ConditionEnd;
    use sesame_plan::{CoverageGoal, Exploration, Search, Strategy};

    use super::*;
    use crate::coverage::{Coverage, Grid};
    use crate::strategy;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    fn nsga2() -> Search {
        Search::new(Strategy::Nsga2 { population: 10 }, 80)
    }
    const PREDICT: Exploration = Exploration::Predict { candidates: 8 };

    fn grid() -> Grid {
        Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap()
    }

    fn plan(end: ConditionEnd, exploration: Option<Exploration>) -> CampaignPlan {
        let mut plan = SYNTHETIC_ROBOTS[0].plan_by_condition(nsga2(), end);
        plan.campaign.coverage = Some(CoverageGoal { axes: grid().axes().to_vec(), hits: 1, stop_at: None });
        plan.campaign.exploration = exploration;
        plan
    }

    #[test]
    fn a_test_is_predicted_where_it_falls_if_variables_go_as_they_did() {
        for end in [ConditionEnd::Condition, ConditionEnd::Length { low: 1.0, high: 15.0 }] {
            let plan = plan(end, None);
            let test_space = TestSpace::from_plan(&plan).unwrap();
            let trajectories = VariableTrajectories::from_observation(
                &plan,
                &crate::testing::synthetic_robots::SyntheticRobot::without_disturbance(&plan),
            )
            .unwrap();
            let (mut same, mut active) = (0, 0);
            for seed in 0..200 {
                let test = fresh_test(&test_space, &mut Stream::derive(seed, "test", &[]));
                let cell = |point: Option<Point>| point.and_then(|point| grid().cell_of(&point));
                let (foreseen, ran) = (
                    cell(trajectories.predicted(&plan, &test)),
                    cell(crate::testing::synthetic_robots::SyntheticRobot::point(&plan, &test)),
                );
                same += u32::from(foreseen == ran);
                active += u32::from(ran.is_some());
            }
            // What is looked at in steps may fall to the other side of an edge between cells.
            assert!(same >= 180 && active > 40, "{same} of 200, {active} active");
        }
    }

    #[test]
    fn prediction_covers_more_cells_and_makes_fewer_tests_without_effect() {
        for end in [ConditionEnd::Condition, ConditionEnd::Length { low: 1.0, high: 15.0 }] {
            let outcome = |exploration: Option<Exploration>| {
                let plan = plan(end, exploration);
                let (mut covered, mut void) = (0, 0);
                for seed in 1..=3 {
                    let run = SYNTHETIC_ROBOTS[0].campaign_of(&plan, strategy(&plan, seed).unwrap().as_mut());
                    let mut coverage = Coverage::new(grid(), 1);
                    for result in &run.tests {
                        void += usize::from(result.point.is_none());
                        result.point.iter().for_each(|point| {
                            coverage.add(point);
                        });
                    }
                    covered += coverage.covered();
                }
                (covered, void)
            };
            let (plain, predicted) = (outcome(None), outcome(Some(PREDICT)));
            assert!(predicted.0 > plain.0 && predicted.1 * 3 < plain.1, "{plain:?} and {predicted:?}");
        }
    }

    #[test]
    fn the_seed_decides_and_results_told_again_bring_a_search_back_to_where_it_was() {
        let plan = plan(ConditionEnd::Condition, Some(PREDICT));
        let run = |seed| SYNTHETIC_ROBOTS[0].campaign_of(&plan, strategy(&plan, seed).unwrap().as_mut()).tests;
        let whole = run(4);
        assert_eq!(whole, run(4));
        assert_ne!(whole, run(5));
        let mut resumed = strategy(&plan, 4).unwrap();
        resumed.begin(&crate::testing::synthetic_robots::SyntheticRobot::without_disturbance(&plan));
        for stored in whole.chunks(10).take(5) {
            let asked: Vec<Test> = resumed.ask().into_iter().map(|candidate| candidate.test).collect();
            assert_eq!(asked, stored.iter().map(|result| result.test.clone()).collect::<Vec<_>>());
            resumed.tell(stored);
        }
    }

    #[test]
    fn credibility_is_the_share_that_came_true() {
        let mut credibility = Credibility::NEW;
        assert_eq!(credibility.share(), 0.5);
        credibility.learn(true);
        credibility.learn(true);
        credibility.learn(false);
        assert_eq!(credibility.share(), 0.6);
    }
}
