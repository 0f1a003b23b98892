//! Which strategy a plan names.

use sesame_optimise::falsify;
use sesame_optimise::nsga2::{self, Nsga2, Survival};
use sesame_plan::{ActivationMode, CampaignPlan, Exploration, Search};

use crate::coverage::Grid;
use crate::evolve::boost::{Boosting, BoostingVariation};
use crate::evolve::cells::Cells;
use crate::evolve::construct::placement::CellPlacer;
use crate::evolve::construct::{ConstructingVariation, Construction};
use crate::evolve::map_elites::MapElites;
use crate::evolve::novelty::{Measure, Novel};
use crate::evolve::predict::PredictingVariation;
use crate::evolve::variation::{self, TestVariation};
use crate::falsification::Falsification;
use crate::known::Known;
use crate::repeat::Repeat;
use crate::sample::latin_hypercube::LatinHypercube;
use crate::sample::random::Random;
use crate::sample::sampled_search::SampledSearch;
use crate::sample::sobol::Sobol;
use crate::shrink::Shrink;
use crate::space::test_space::TestSpace;
use crate::{SearchError, Strategy};

/// Whether the strategy of a plan asks for the margins of requirements.
pub fn needs_margins(plan: &CampaignPlan) -> bool {
    matches!(plan.campaign.search, Search::Falsification { .. })
}

/// Whether the strategy of a plan asks for the trajectories of runs.
pub fn needs_trajectories(plan: &CampaignPlan) -> bool {
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
            let test_space = TestSpace::from_plan(plan)?;
            let tests = variation(plan, test_space.clone(), seed);
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
                    let predicting = PredictingVariation::new(tests, test_space, cells(plan)?, candidates, seed);
                    Box::new(Nsga2::new(settings, predicting))
                }
                None => Box::new(Nsga2::new(settings, tests)),
                Some(Exploration::Novelty { neighbours, over }) => {
                    let measure = Measure {
                        neighbours: *neighbours as usize,
                        over: over.clone(),
                        largest_count: test_space.most() as f64,
                    };
                    Box::new(Novel::new(Nsga2::new(settings, tests), measure))
                }
                &Some(Exploration::Boost { every_generations, children, tries }) => {
                    let boosting = Boosting { every_generations, children, tries };
                    Box::new(Nsga2::new(settings, BoostingVariation::new(tests, cells(plan)?, boosting, seed)))
                }
                &Some(Exploration::Construct { share, until }) => {
                    let cells = cells(plan)?;
                    let (grid, feasible) = (cells.grid().clone(), cells.feasible().clone());
                    let placer = CellPlacer::new(test_space, grid, feasible, plan.campaign.copies);
                    let construction = Construction { share, until: until.unwrap_or(1.0) };
                    Box::new(Nsga2::new(settings, ConstructingVariation::new(tests, cells, placer, construction, seed)))
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
            Box::new(MapElites::new(settings, variation(plan, TestSpace::from_plan(plan)?, seed), grid))
        }
        &Search::LatinHypercube { evaluations } => {
            by_time(plan)?;
            Box::new(SampledSearch::new(
                LatinHypercube::new(TestSpace::from_plan(plan)?, evaluations, seed),
                evaluations,
            ))
        }
        &Search::Sobol { evaluations } => {
            by_time(plan)?;
            Box::new(SampledSearch::new(Sobol::new(TestSpace::from_plan(plan)?, seed), evaluations))
        }
        &Search::Falsification { population, evaluations } => {
            by_time(plan)?;
            let requirements = plan.requirements.len();
            if requirements == 0 {
                return Err(SearchError::NoRequirement { campaign: plan.campaign.name.clone() });
            }
            let settings = falsify::Settings { requirements, evaluations, batch: population, seed };
            Box::new(Falsification::new(TestSpace::from_plan(plan)?, settings))
        }
        &Search::Random { evaluations } => {
            Box::new(SampledSearch::new(Random::new(TestSpace::from_plan(plan)?, seed), evaluations))
        }
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

fn variation(plan: &CampaignPlan, test_space: TestSpace, seed: u64) -> TestVariation {
    let rates = match plan.campaign.activation {
        ActivationMode::Time => variation::Rates::default(),
        ActivationMode::Condition { .. } => variation::Rates::by_condition(),
    };
    TestVariation::new(test_space, rates, seed)
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
    Cells::from_plan(plan, goal).map_err(|reason| SearchError::Grid { campaign: campaign(), reason })
}
