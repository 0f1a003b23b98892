//! Conducting a campaign: reference run, search, reference run again.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use sesame_plan::{CampaignPlan, MetricSource, Search, Test};

use super::pool::{Job, Pool, PoolError, PoolSettings};
use crate::observation::{Observation, Outcome};
use crate::record::{
    Event, EventKind, Origin, RecordError, Recorder, Repository, ResultSet, Status, TestRecord, Verdict, verdict,
};
use crate::rng::derive_seed;
use crate::search::{self, Candidate, Evaluated, Fitness, Front, SearchError};

/// A test that runs this many times as long as the undisturbed run is taken to hang.
const PATIENCE: f64 = 20.0;
/// The shortest limit that is set unasked.
const LEAST_TIMEOUT: Duration = Duration::from_secs(60);
/// The limit of the undisturbed run, of which nothing is known yet.
const FIRST_TIMEOUT: Duration = Duration::from_secs(600);

/// What a user decides about a run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The campaign's seed.
    pub seed: u64,
    /// How many worker processes; results do not depend on it.
    pub workers: usize,
    /// Wall time after which a test is stopped; by default a multiple of what the undisturbed run takes.
    pub timeout: Option<Duration>,
    /// The runner's program, started again for each worker.
    pub program: PathBuf,
}

/// How far a campaign is.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Tests evaluated.
    pub done: u32,
    /// Tests to be evaluated in total.
    pub total: u32,
    /// The test evaluated last; `None` at the start.
    pub latest: Option<&'a TestRecord>,
    /// The front so far.
    pub front: &'a Front,
}

/// How a campaign ended.
#[derive(Debug)]
pub enum Conducted {
    /// All tests were evaluated.
    Finished(Repository),
    /// The user stopped it; `resume` goes on.
    Interrupted,
}

/// Why a campaign could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// The plan leaves nothing to search.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// No worker.
    #[error(transparent)]
    Pool(#[from] PoolError),
    /// Results could not be kept.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The undisturbed run failed, so nothing that follows would mean anything.
    #[error("the undisturbed reference run failed: {0}\nnothing was fuzzed: a campaign needs a system that works undisturbed")]
    Reference(String),
    /// A resumed campaign asks for other tests than those recorded.
    #[error("test T{0} of these results is not the one that this runner asks for: the results come from another model or version; start anew with `run`")]
    OtherCampaign(u32),
}

/// Conducts a campaign and records it; what the recorder already holds is not simulated again.
pub fn conduct(
    plan: &CampaignPlan,
    mut recorder: Recorder,
    settings: &Settings,
    directory: PathBuf,
    interrupted: &AtomicBool,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Conducted, CampaignError> {
    let mut strategy = search::strategy(plan, settings.seed)?;
    let recorded = recorder.repository().tests()?.iter().map(|row| row.number).collect();
    let pool = Pool::start(&PoolSettings {
        workers: settings.workers,
        program: settings.program.clone(),
        directory,
        timeout: settings.timeout.unwrap_or(FIRST_TIMEOUT),
    })?;
    let mut desk = Desk { plan, recorder: &mut recorder, recorded, pool, interrupted };

    let undisturbed = |number, seed| Planned {
        number,
        origin: Origin::Reference,
        generation: None,
        parents: Vec::new(),
        test: Test::default(),
        simulator_seed: simulator_seed(seed, 0),
        duplicate_of: None,
    };
    let Some(reference) = desk.evaluate(vec![undisturbed(0, settings.seed)], &mut |_| {})?.pop() else {
        return interrupt(desk, recorder);
    };
    if let Outcome::Crash { .. } | Outcome::Timeout { .. } = reference.observation.outcome {
        let detail = reference.observation.outcome.detail().unwrap_or_default();
        return Err(CampaignError::Reference(detail));
    }
    for warning in reference_warnings(plan, &reference.observation) {
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: Some(0), text: warning })?;
    }
    if settings.timeout.is_none() {
        let usual = Duration::from_secs_f64(reference.observation.wall.run * PATIENCE);
        desk.pool.set_timeout(usual.max(LEAST_TIMEOUT));
    }

    let total = plan.campaign.search.evaluations();
    let repeats = matches!(plan.campaign.search, Search::Repeat { .. });
    let mut front = Front::default();
    let mut earlier = Earlier::default();
    let mut next = 1;
    progress(Progress { done: 0, total, latest: None, front: &front });
    loop {
        let candidates = strategy.ask();
        let Some(generation) = candidates.first().map(|candidate| candidate.generation) else { break };
        let planned = candidates
            .into_iter()
            .map(|Candidate { test, parents, generation }| {
                let number = next;
                next += 1;
                Planned {
                    number,
                    origin: Origin::Search,
                    generation: Some(generation),
                    parents,
                    duplicate_of: if repeats { None } else { earlier.same(&test, number) },
                    test,
                    simulator_seed: simulator_seed(settings.seed, if repeats { number } else { 0 }),
                }
            })
            .collect();
        let first = next;
        let mut done = 0;
        let mut evaluated: Vec<TestRecord> = desk.evaluate(planned, &mut |record| {
            done += 1;
            front.add(record.number, &search::fitness(plan, &record.observation));
            progress(Progress { done: record_count(first, done, next), total, latest: Some(record), front: &front });
        })?;
        if interrupted.load(Ordering::Relaxed) {
            return interrupt(desk, recorder);
        }
        evaluated.sort_by_key(|record| record.number);
        let told: Vec<Evaluated> = evaluated
            .iter()
            .map(|record| Evaluated {
                number: record.number,
                test: record.test.clone(),
                fitness: search::fitness(plan, &record.observation),
            })
            .collect();
        // Built anew in the order of numbers, since equal members are kept by number, not by who came first.
        front = told.iter().fold(before_generation(&front, &told), |mut front, told| {
            front.add(told.number, &told.fitness);
            front
        });
        strategy.tell(&told);
        if !plan.campaign.objectives.is_empty() {
            desk.recorder.put_result_set(&ResultSet {
                name: format!("generation-{generation}"),
                generation: Some(generation),
                status: Status::Intermediate,
                members: front.numbers(),
            })?;
        }
    }
    todo_end(desk, next, front, reference)
}
