//! Which strategy a plan and a task name.

use sesame_optimise::falsify;
use sesame_optimise::nsga2::{self, Nsga2, Survival};
use sesame_plan as plan;
use sesame_plan::{ActivationMode, CampaignPlan, Exploration, Search, Task};

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
use crate::fixed_tests::FixedTests;
use crate::interleaved::Interleaved;
use crate::sample::grid::FullFactorial;
use crate::sample::latin_hypercube::LatinHypercube;
use crate::sample::random::Random;
use crate::sample::sampled_search::SampledSearch;
use crate::sample::sobol::Sobol;
use crate::shrink::ShrinkEach;
use crate::space::test_space::TestSpace;
use crate::{SearchError, Strategy};

/// How the tests of a task are found. `seed` is that of the run, which may be another than the plan's.
pub fn strategy_of_task(plan: &CampaignPlan, task: &Task, seed: u64) -> Result<Box<dyn Strategy>, SearchError> {
    match task {
        Task::Campaign => strategy(plan, seed),
        Task::Known { tests, .. } => Ok(Box::new(FixedTests::known(plan, tests))),
        Task::Repeat { test, times, .. } => Ok(Box::new(FixedTests::repeated(test, *times, seed))),
        Task::Shrink(_) | Task::ShrinkEach { .. } => Ok(Box::new(ShrinkEach::new(plan, task.shrinkings()))),
        Task::Variations(variations) => Ok(Box::new(FixedTests::each_once(&variations.tests))),
        Task::Undisturbed(undisturbed) => Ok(Box::new(FixedTests::undisturbed(undisturbed, seed))),
        Task::Lab(lab) | Task::Compensated(lab) => Ok(Box::new(FixedTests::in_lab(lab, seed))),
    }
}

/// How the tests of a plan's campaign are found. `seed` is that of the run, which may be another than the plan's.
pub fn strategy(plan: &CampaignPlan, seed: u64) -> Result<Box<dyn Strategy>, SearchError> {
    let (strategy, evaluations) = match plan.campaign.search {
        Search::Strategy { strategy, evaluations } => (strategy, evaluations),
        Search::Repeat { test, times } => {
            return Ok(Box::new(FixedTests::repeated(&plan.test(test).test, times, seed)));
        }
    };
    require_what_it_needs(plan, strategy)?;
    let space = TestSpace::from_plan(plan)?;
    Ok(match strategy {
        plan::Strategy::Nsga2 { population } => {
            let settings = nsga2::Settings { population, evaluations, seed, survival: survival(plan) };
            nsga2(plan, settings, space)?
        }
        plan::Strategy::Nsga3 { population } => {
            let settings = nsga2::Settings { population, evaluations, seed, survival: Survival::ReferencePoints };
            Box::new(Nsga2::new(settings, variation(plan, space, seed)))
        }
        plan::Strategy::MapElites { population } => {
            let settings = nsga2::Settings { population, evaluations, seed, survival: Survival::Crowded };
            Box::new(MapElites::new(settings, variation(plan, space, seed), grid(plan)?))
        }
        plan::Strategy::LatinHypercube => {
            Box::new(SampledSearch::new(LatinHypercube::new(space, evaluations, seed), evaluations))
        }
        plan::Strategy::Sobol => Box::new(SampledSearch::new(Sobol::new(space, seed), evaluations)),
        plan::Strategy::Grid { levels } => {
            Box::new(SampledSearch::new(FullFactorial::new(plan, &space, levels, seed)?, evaluations))
        }
        plan::Strategy::Falsification { population } => {
            let requirements = plan.requirements.len();
            let settings = falsify::Settings { requirements, evaluations, batch: population, seed };
            Box::new(Falsification::new(plan, space, settings))
        }
        plan::Strategy::Interleaved { keep_causes } => {
            Box::new(Interleaved::new(plan, space, evaluations, !keep_causes, seed))
        }
        plan::Strategy::Random => Box::new(SampledSearch::new(Random::new(space, seed), evaluations)),
    })
}

/// Refuses a campaign that lacks what its strategy needs, as the table of strategies has it.
fn require_what_it_needs(plan: &CampaignPlan, strategy: plan::Strategy) -> Result<(), SearchError> {
    let campaign = || plan.campaign.name.clone();
    let properties = strategy.kind().properties();
    if let Some((setting, value)) = strategy.not_permitted() {
        let (setting, permitted) = (setting.noun(), setting.bounds());
        return Err(SearchError::Setting { campaign: campaign(), setting, value, permitted });
    }
    if properties.by_time_only && plan.campaign.activation != ActivationMode::Time {
        return Err(SearchError::NotByTime { campaign: campaign() });
    }
    if properties.needs_requirements && plan.requirements.is_empty() {
        return Err(SearchError::NoRequirement { campaign: campaign() });
    }
    if properties.needs_coverage && plan.campaign.coverage.is_none() {
        return Err(SearchError::NoCoverage { campaign: campaign() });
    }
    Ok(())
}

/// NSGA-II, with what directs it to cells that need tests.
fn nsga2(plan: &CampaignPlan, settings: nsga2::Settings, space: TestSpace) -> Result<Box<dyn Strategy>, SearchError> {
    let seed = settings.seed;
    let tests = variation(plan, space.clone(), seed);
    let by_time = plan.campaign.activation == ActivationMode::Time;
    Ok(match &plan.campaign.exploration {
        Some(Exploration::Predict { .. }) if by_time => {
            return Err(SearchError::NotByCondition { campaign: plan.campaign.name.clone() });
        }
        Some(Exploration::Boost { .. } | Exploration::Construct { .. }) if !by_time => {
            return Err(SearchError::NotByTime { campaign: plan.campaign.name.clone() });
        }
        &Some(Exploration::Predict { candidates }) => {
            let predicting = PredictingVariation::new(tests, space, cells(plan)?, candidates, seed);
            Box::new(Nsga2::new(settings, predicting))
        }
        None => Box::new(Nsga2::new(settings, tests)),
        Some(Exploration::Novelty { neighbours, over }) => {
            let measure =
                Measure { neighbours: *neighbours as usize, over: over.clone(), largest_count: space.most() as f64 };
            Box::new(Novel::new(Nsga2::new(settings, tests), measure))
        }
        &Some(Exploration::Boost { every_generations, children, tries }) => {
            let boosting = Boosting { every_generations, children, tries };
            Box::new(Nsga2::new(settings, BoostingVariation::new(tests, cells(plan)?, boosting, seed)))
        }
        &Some(Exploration::Construct { share, until }) => {
            let cells = cells(plan)?;
            let (grid, feasible) = (cells.grid().clone(), cells.feasible().clone());
            let placer = CellPlacer::new(space, grid, feasible, plan.campaign.copies);
            let construction = Construction { share, until: until.unwrap_or(1.0) };
            Box::new(Nsga2::new(settings, ConstructingVariation::new(tests, cells, placer, construction, seed)))
        }
    })
}

fn variation(plan: &CampaignPlan, space: TestSpace, seed: u64) -> TestVariation {
    let rates = match plan.campaign.activation {
        ActivationMode::Time => variation::Rates::default(),
        ActivationMode::Condition { .. } => variation::Rates::by_condition(),
    };
    TestVariation::new(space, rates, seed)
}

/// Many tests by condition have equal objective values, since a condition that never holds changes nothing.
fn survival(plan: &CampaignPlan) -> Survival {
    match plan.campaign.activation {
        ActivationMode::Time => Survival::Crowded,
        ActivationMode::Condition { .. } => Survival::Distinct,
    }
}

/// The grid of a campaign's coverage.
fn grid(plan: &CampaignPlan) -> Result<Grid, SearchError> {
    let campaign = || plan.campaign.name.clone();
    let goal = plan.campaign.coverage.as_ref().ok_or_else(|| SearchError::NoCoverage { campaign: campaign() })?;
    Grid::new(goal.axes.clone()).map_err(|reason| SearchError::Grid { campaign: campaign(), reason })
}

/// The cells to which an exploration directs tests.
fn cells(plan: &CampaignPlan) -> Result<Cells, SearchError> {
    let campaign = || plan.campaign.name.clone();
    let goal = plan.campaign.coverage.as_ref().ok_or_else(|| SearchError::NoCoverage { campaign: campaign() })?;
    Cells::from_plan(plan, goal).map_err(|reason| SearchError::Grid { campaign: campaign(), reason })
}
