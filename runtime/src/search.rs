//! How a campaign's tests are found: strategies that are asked for tests and told what came out.
//!
//! A [`Strategy`] has no clock, no files and no processes. What it asks depends on the plan, the seed and what it was
//! told, so a campaign is resumed by telling a new strategy the stored results again. Randomness comes from a stream per
//! child, derived from the seed, so nothing depends on the order in which the tests of a generation are run.
//!
//! Objectives are oriented once, in [`fitness`]: from there on smaller is better, in fronts and hypervolumes too.

pub mod choice;
pub mod condition;
pub mod confirming;
pub mod crowding;
pub mod dominance;
pub mod falsify;
pub mod front;
pub mod hypervolume;
pub mod igd;
pub mod indicators;
pub mod initial;
pub mod margin;
pub mod neighbours;
pub mod nsga2;
pub mod permitted;
pub mod problems;
pub mod published;
pub mod range;
pub mod real;
pub mod selection;
pub mod sobol_points;
pub mod sorting;
pub mod stop;
pub mod vary;

mod boost;
mod cells;
mod construct;
mod constructing;
mod decoded;
mod falsification;
mod in_turn;
mod known;
mod latin_hypercube;
mod map_elites;
mod novelty;
mod predict;
mod random;
mod repeat;
pub mod shrink;
mod sobol;

#[cfg(test)]
mod explored;
#[cfg(test)]
pub(crate) mod landscape;

use sesame_plan::{ActivationMode, CampaignPlan, Direction, Exploration, KnownTestId, MetricId, Search, Test};

use crate::coverage::Grid;
use crate::observation::{Observation, Outcome};
use crate::sspr::Point;
use boost::{Boosted, Boosting};
use cells::Cells;
use construct::Constructor;
use constructing::{Constructing, Construction};
use novelty::{Measure, Novel};
use nsga2::{Survival, Variation};
use predict::Predicting;

pub use confirming::Confirming;
pub use dominance::{Fitness, Unfit};
pub use falsification::Falsification;
pub use front::Front;
pub use in_turn::{InTurn, Sampling};
pub use known::Known;
pub use latin_hypercube::LatinHypercube;
pub use map_elites::MapElites;
pub use margin::{Margin, margins};
pub use neighbours::Neighbours;
pub use nsga2::Nsga2;
pub use permitted::{Permitted, SearchError};
pub use predict::Course;
pub use random::Random;
pub use repeat::Repeat;
pub use shrink::Shrink;
pub use sobol::Sobol;
pub use stop::StopRules;
pub use vary::TestVariation;

/// How tests are found, by ask and tell.
///
/// The caller alternates: it asks for a generation, evaluates all of it in whatever order, and tells the results in the
/// order asked. The tests of all generations together are exactly [`Search::evaluations`]; of [`Shrink`], at most.
pub trait Strategy: Send {
    /// The next generation of tests; empty when the search is over.
    fn ask(&mut self) -> Vec<Candidate>;

    /// Takes the results of exactly the generation asked last, in its order.
    fn tell(&mut self, results: &[Evaluated]);

    /// Takes how the condition variables went in the undisturbed run, before the first generation is asked.
    fn reference(&mut self, _: Course) {}

    /// Why the search is over, where there is more to say than that all tests were evaluated.
    fn ended(&self) -> Option<String> {
        None
    }
}

/// A test to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The test.
    pub test: Test,
    /// Numbers of the tests it descends from: none, one or two.
    pub parents: Vec<u32>,
    /// The generation it belongs to, from 0.
    pub generation: u32,
    /// The known test it is, where a search runs known tests for their own sake.
    pub known: Option<KnownTestId>,
    /// The simulator's seed in its run; `None` for the campaign's own. Equal tests with seeds of their own are run each.
    pub simulator_seed: Option<u64>,
}

/// A test with its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluated {
    /// The caller's number of the test, unique in the campaign.
    pub number: u32,
    /// The test, as asked.
    pub test: Test,
    /// Its fitness, from [`fitness`].
    pub fitness: Fitness,
    /// Where its run lies in the reduced parameter space, if it counts for coverage.
    pub point: Option<Point>,
    /// How the condition variables went in its run, where the campaign [predicts](needs_courses).
    pub course: Option<Course>,
    /// How far each requirement of the plan is from its violation, from [`margins`], where the campaign
    /// [asks for them](needs_margins); else empty.
    pub margins: Vec<Margin>,
    /// Whether it failed as a campaign that [makes a test smaller](Search::Shrink) has it; else false.
    pub failing: bool,
}

/// Whether the strategy of a plan asks for the margins of requirements.
pub fn needs_margins(plan: &CampaignPlan) -> bool {
    matches!(plan.campaign.search, Search::Falsification { .. })
}

/// Whether the strategy of a plan asks for the courses of runs.
pub fn needs_courses(plan: &CampaignPlan) -> bool {
    matches!(plan.campaign.exploration, Some(Exploration::Predict { .. }))
}

/// The strategy that a plan names. `seed` is the campaign's, or what `run --seed` put in its place.
pub fn strategy(plan: &CampaignPlan, seed: u64) -> Result<Box<dyn Strategy>, SearchError> {
    Ok(match &plan.campaign.search {
        Search::Nsga2 { population: 0, .. }
        | Search::MapElites { population: 0, .. }
        | Search::Falsification { population: 0, .. } => {
            return Err(SearchError::NoPopulation { campaign: plan.campaign.name.clone() });
        }
        &Search::Nsga2 { population, evaluations } => {
            let permitted = Permitted::of(plan)?;
            let tests = variation(plan, permitted.clone(), seed);
            let settings = nsga2::Settings { population, evaluations, seed, survival: survival(plan) };
            let by_time = plan.campaign.activation == ActivationMode::Time;
            match &plan.campaign.exploration {
                Some(Exploration::Predict { .. }) if by_time => {
                    return Err(SearchError::NotByCondition { campaign: plan.campaign.name.clone() });
                }
                Some(Exploration::Boost { .. } | Exploration::Construct { .. }) if !by_time => {
                    return Err(SearchError::NotByTime { campaign: plan.campaign.name.clone() });
                }
                &Some(Exploration::Predict { candidates }) => {
                    let predicting = Predicting::new(tests, permitted, cells(plan)?, candidates, seed);
                    Box::new(Nsga2::new(settings, predicting))
                }
                None => Box::new(Nsga2::new(settings, tests)),
                Some(Exploration::Novelty { neighbours, over }) => {
                    let measure = Measure {
                        neighbours: *neighbours as usize,
                        over: over.clone(),
                        largest_count: permitted.most() as f64,
                    };
                    Box::new(Novel::new(Nsga2::new(settings, tests), measure))
                }
                &Some(Exploration::Boost { every_generations, children, tries }) => {
                    let boosting = Boosting { every_generations, children, tries };
                    Box::new(Nsga2::new(settings, Boosted::new(tests, cells(plan)?, boosting, seed)))
                }
                &Some(Exploration::Construct { share, until }) => {
                    let cells = cells(plan)?;
                    let constructor = Constructor::new(permitted, cells.grid().clone());
                    let construction = Construction { share, until: until.unwrap_or(1.0) };
                    Box::new(Nsga2::new(settings, Constructing::new(tests, cells, constructor, construction, seed)))
                }
            }
        }
        &Search::MapElites { population, evaluations } => {
            let campaign = || plan.campaign.name.clone();
            let goal = plan.campaign.coverage.as_ref();
            let goal = goal.ok_or_else(|| SearchError::NoCoverage { campaign: campaign() })?;
            let grid =
                Grid::new(goal.axes.clone()).map_err(|reason| SearchError::Grid { campaign: campaign(), reason })?;
            let settings = nsga2::Settings { population, evaluations, seed, survival: Survival::Crowded };
            Box::new(MapElites::new(settings, variation(plan, Permitted::of(plan)?, seed), grid))
        }
        &Search::LatinHypercube { evaluations } => {
            by_time(plan)?;
            Box::new(InTurn::new(LatinHypercube::new(Permitted::of(plan)?, evaluations, seed), evaluations))
        }
        &Search::Sobol { evaluations } => {
            by_time(plan)?;
            Box::new(InTurn::new(Sobol::new(Permitted::of(plan)?, seed), evaluations))
        }
        &Search::Falsification { population, evaluations } => {
            by_time(plan)?;
            let requirements = plan.requirements.len();
            if requirements == 0 {
                return Err(SearchError::NoRequirement { campaign: plan.campaign.name.clone() });
            }
            let settings = falsify::Settings { requirements, evaluations, batch: population, seed };
            Box::new(Falsification::new(Permitted::of(plan)?, settings))
        }
        &Search::Random { evaluations } => Box::new(InTurn::new(Random::new(Permitted::of(plan)?, seed), evaluations)),
        &Search::Repeat { test, times } => Box::new(Repeat::new(plan.test(test).test.clone(), times, seed)),
        Search::Known { tests } => {
            Box::new(Known::new(tests.iter().map(|&id| (id, plan.test(id).test.clone())).collect()))
        }
        &Search::Shrink { test, simulator_seed, runs, evaluations, failing: _ } => {
            Box::new(Shrink::new(plan, plan.test(test).test.clone(), simulator_seed, runs, evaluations))
        }
    })
}

/// Refuses a campaign in which conditions switch operations.
fn by_time(plan: &CampaignPlan) -> Result<(), SearchError> {
    match plan.campaign.activation {
        ActivationMode::Time => Ok(()),
        ActivationMode::Condition { .. } => Err(SearchError::NotByTime { campaign: plan.campaign.name.clone() }),
    }
}

fn variation(plan: &CampaignPlan, permitted: Permitted, seed: u64) -> TestVariation {
    let rates = match plan.campaign.activation {
        ActivationMode::Time => vary::Rates::default(),
        ActivationMode::Condition { .. } => vary::Rates::by_condition(),
    };
    TestVariation::new(permitted, rates, seed)
}

/// Conditions hold or not: many tests are active equally long, and change nothing that is measured.
fn survival(plan: &CampaignPlan) -> Survival {
    match plan.campaign.activation {
        ActivationMode::Time => Survival::Crowded,
        ActivationMode::Condition { .. } => Survival::Distinct,
    }
}

/// The cells that an exploration is about.
fn cells(plan: &CampaignPlan) -> Result<Cells, SearchError> {
    let campaign = || plan.campaign.name.clone();
    let goal = plan.campaign.coverage.as_ref().ok_or_else(|| SearchError::NoCoverage { campaign: campaign() })?;
    Cells::of(plan, goal).map_err(|reason| SearchError::Grid { campaign: campaign(), reason })
}

/// The fitness of a run: its objective values in the campaign's order, negated where more is sought; or why it has none.
pub fn fitness(plan: &CampaignPlan, observation: &Observation) -> Fitness {
    fitness_of(plan, &observation.outcome, |id| observation.metrics.get(id.index())?.value)
}

/// As [`fitness`], for a run of which only the outcome and the metrics' values are known.
pub fn fitness_of(plan: &CampaignPlan, outcome: &Outcome, value: impl Fn(MetricId) -> Option<f64>) -> Fitness {
    match outcome {
        // What was imported stands in fronts as it did there.
        Outcome::Completed | Outcome::Unknown => {}
        Outcome::Void => return Fitness::Unfit(Unfit::Void),
        Outcome::Crash { .. } => return Fitness::Unfit(Unfit::Crash),
        Outcome::Timeout { .. } => return Fitness::Unfit(Unfit::Timeout),
    }
    let oriented = plan.campaign.objectives.iter().map(|&id| {
        let value = value(id).filter(|value| !value.is_nan())?;
        // Subtracted from zero and added to it, so that no negative zero comes out.
        match plan.metric(id).direction.expect("the generator gives every objective a direction") {
            Direction::Minimise => Some(0.0 + value),
            Direction::Maximise => Some(0.0 - value),
        }
    });
    oriented.collect::<Option<Vec<f64>>>().map_or(Fitness::Unfit(Unfit::Unmeasured), Fitness::Measured)
}

/// An oriented value of an objective as the metric has it, in its unit. It undoes what [`fitness`] does.
pub fn in_unit(plan: &CampaignPlan, objective: MetricId, oriented: f64) -> f64 {
    if plan.metric(objective).direction == Some(Direction::Maximise) { 0.0 - oriented } else { 0.0 + oriented }
}

/// Variation of tests that is told what came of them.
pub(crate) trait Learning: Variation<Genome = Test> {
    /// Takes the results of the generation asked last, in its order.
    fn learn(&mut self, results: &[Evaluated]);

    /// Takes how the condition variables went in the undisturbed run.
    fn reference(&mut self, _: Course) {}
}

impl Learning for TestVariation {
    /// Selection alone decides what becomes of results.
    fn learn(&mut self, _: &[Evaluated]) {}
}

impl<V: Learning + Send> Strategy for Nsga2<V> {
    fn ask(&mut self) -> Vec<Candidate> {
        let generation = self.generation();
        let asked = Nsga2::ask(self);
        asked
            .into_iter()
            .map(|a| Candidate { test: a.genome, parents: a.parents, generation, known: None, simulator_seed: None })
            .collect()
    }

    fn reference(&mut self, course: Course) {
        self.variation_mut().reference(course);
    }

    fn tell(&mut self, results: &[Evaluated]) {
        self.variation_mut().learn(results);
        Nsga2::tell(
            self,
            results.iter().map(|result| nsga2::Told {
                number: result.number,
                genome: result.test.clone(),
                fitness: result.fitness.clone(),
            }),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::{MetricObservation, WallTime};

    fn observed(outcome: Outcome, values: &[Option<f64>]) -> Observation {
        let metric = |&value: &Option<f64>| MetricObservation::whole(value, value.is_some(), Vec::new());
        Observation {
            outcome,
            end: 70.0,
            operations: Vec::new(),
            unheard: Vec::new(),
            metrics: values.iter().map(metric).collect(),
            messages: 0,
            warnings: Vec::new(),
            wall: WallTime::default(),
        }
    }

    #[test]
    fn fitness_orients_objectives_in_the_order_of_the_campaign() {
        let mut plan = landscape::LANDSCAPES[0].plan(Search::Random { evaluations: 1 });
        let completed = observed(Outcome::Completed, &[Some(12.5), Some(3.0)]);
        assert_eq!(fitness(&plan, &completed), Fitness::Measured(vec![12.5, -3.0]));
        plan.campaign.objectives.reverse();
        assert_eq!(fitness(&plan, &completed), Fitness::Measured(vec![-3.0, 12.5]));
        plan.campaign.objectives = vec![MetricId(1)];
        let Fitness::Measured(zero) = fitness(&plan, &observed(Outcome::Completed, &[None, Some(0.0)])) else {
            panic!("only objectives need a value")
        };
        assert!(zero[0].is_sign_positive());
    }

    #[test]
    fn only_completed_runs_with_all_objectives_have_a_fitness() {
        let plan = landscape::LANDSCAPES[0].plan(Search::Random { evaluations: 1 });
        let values = [Some(12.5), Some(3.0)];
        let unfit = |outcome, values: &[Option<f64>]| match fitness(&plan, &observed(outcome, values)) {
            Fitness::Unfit(why) => why,
            other => panic!("{other:?}"),
        };
        assert_eq!(unfit(Outcome::Void, &values), Unfit::Void);
        assert_eq!(unfit(Outcome::Crash { message: "x".to_owned() }, &[]), Unfit::Crash);
        assert_eq!(unfit(Outcome::Timeout { limit: 9.0 }, &values), Unfit::Timeout);
        assert_eq!(unfit(Outcome::Completed, &[Some(12.5), None]), Unfit::Unmeasured);
        assert_eq!(unfit(Outcome::Completed, &[Some(12.5), Some(f64::NAN)]), Unfit::Unmeasured);
        assert_eq!(unfit(Outcome::Completed, &[]), Unfit::Unmeasured);
    }
}
