//! Conducting a campaign: reference run, search, reference run again.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sha2::{Digest as _, Sha256};

use sesame_base::observation::{Observation, Outcome};
use sesame_optimise::front::Front;
use sesame_plan::{CampaignPlan, CoverageGoal, KnownTestId, OperationId, Recorded, Search, Test};
use sesame_results::record::{
    self, Difference, Event, EventKind, GenerationCoverage, Origin, RecordError, Recorder, Repetition, Repository,
    ResultSet, Status, TestRecord, Verdict, differences, verdict,
};
use sesame_rng::derive_seed;
use sesame_search as search;
use sesame_search::coverage::{self, Coverage, Feasible, Grid, GridError};
use sesame_search::indicators::Indicators;
use sesame_search::sspr::{self, Point};
use sesame_search::{
    Candidate, ConfirmedFront, Evaluated, GenerationTest, Neighbours, SearchError, StopRules, VariableTrajectories,
};

use crate::campaign::confirmation::{Again, LIKE_BEFORE};
use crate::campaign::pool::{Ended, Job, Pool, PoolError, PoolSettings};
use crate::campaign::traces::TraceOrder;

/// A test that runs this many times as long as the undisturbed run is taken to hang.
const PATIENCE: f64 = 20.0;
/// The shortest limit that is set unasked.
const LEAST_TIMEOUT: Duration = Duration::from_secs(60);
/// The limit of the undisturbed run, of which nothing is known yet.
const FIRST_TIMEOUT: Duration = Duration::from_secs(600);

/// How many recorded tests are read at once when a campaign is taken up again.
const READ_TOGETHER: u32 = 50;

/// How long a test may take, in wall time, when one like it took so many seconds.
pub fn patience(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds * PATIENCE).max(LEAST_TIMEOUT)
}

/// What a user decides about a run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The campaign's seed.
    pub seed: u64,
    /// How many worker processes at most; results do not depend on it.
    pub workers: usize,
    /// Wall time after which a test is stopped; by default a multiple of what the undisturbed run takes.
    pub timeout: Option<Duration>,
    /// The runner's program, started again for each worker.
    pub program: PathBuf,
    /// Whether to go on although nobody hears what an operation disturbs.
    pub allow_unheard: bool,
}

impl Settings {
    /// How many worker processes for so many tests: more than tests would have nothing to do.
    pub(super) fn workers_for(&self, tests: u32) -> usize {
        self.workers.min(usize::try_from(tests).unwrap_or(usize::MAX)).max(1)
    }
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
    /// Runs to confirm tests, beside those.
    pub repetitions: u32,
    /// The front so far.
    pub front: &'a Front,
    /// The cells covered so far, where the campaign counts them.
    pub coverage: Option<&'a Coverage>,
}

/// How a campaign ended.
#[derive(Debug)]
pub enum Conducted {
    /// All tests were evaluated, or its coverage sufficed.
    Finished(Box<Repository>),
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
    /// The plan's cells are no grid.
    #[error("the campaign's coverage cannot be counted: {0}")]
    Grid(#[from] GridError),
    /// No worker.
    #[error(transparent)]
    Pool(#[from] PoolError),
    /// Results could not be kept.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The undisturbed run failed, so nothing that follows would mean anything.
    #[error(
        "the undisturbed reference run failed: {0}\nnothing was fuzzed: a campaign needs a system that works undisturbed"
    )]
    Reference(String),
    /// An undisturbed run was killed, and again when it was run once more. It is not recorded, so that `resume` runs it again.
    #[error(
        "the undisturbed reference run failed: {reason}\nT{test} is not recorded, what was recorded before is kept: `resume` runs it \
         again. If nobody killed it, give it more memory, or the campaign fewer `--workers`"
    )]
    Killed {
        /// The test.
        test: u32,
        /// What is known of it.
        reason: String,
    },
    /// Nobody hears what operations disturb, so that tests with them would show nothing.
    #[error(
        "{}\nnothing was fuzzed: such tests would pass without having disturbed anything. Disturb what the simulator \
         subscribes to, let it subscribe to this, or read it by a metric with `outbound`; `--allow-unheard` goes on \
         nevertheless",
        .0.iter().map(Unheard::to_string).collect::<Vec<_>>().join("\n")
    )]
    Unheard(Vec<Unheard>),
    /// A trace could not be written. The test is not recorded, so that `resume` runs it again with its trace.
    #[error(
        "{reason}\nT{test} is not recorded without its trace, what was recorded before is kept: `resume` goes on once that is mended"
    )]
    Trace {
        /// The test.
        test: u32,
        /// Why not.
        reason: String,
    },
    /// A resumed campaign asks for other tests than those recorded.
    #[error(
        "test T{0} of these results is not the one that this runner asks for: the results come from another model or version; start anew with `run`"
    )]
    OtherCampaign(u32),
}

/// Conducts a campaign and records it; what the recorder already holds is not simulated again.
pub fn conduct(
    plan: &CampaignPlan,
    mut recorder: Recorder,
    settings: &Settings,
    directory: &Path,
    interrupted: &AtomicBool,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Conducted, CampaignError> {
    let mut strategy = search::strategy(plan, settings.seed)?;
    let mut tracking = plan.campaign.coverage.as_ref().map(|goal| Tracking::of(plan, goal)).transpose()?;
    let recorded = recorder.repository().numbers()?.into_iter().collect();
    let repeated = recorder.repository().repetitions()?;
    let pool = Pool::start(&PoolSettings {
        workers: settings.workers_for(plan.campaign.search.evaluations()),
        program: settings.program.clone(),
        directory: directory.to_path_buf(),
        timeout: settings.timeout.unwrap_or(FIRST_TIMEOUT),
    })?;
    let traces = match plan.campaign.record {
        Some(keep) => Some(Traces { folder: recorder.repository().make_trace_folder()?, keep }),
        None => None,
    };
    let mut desk = Desk { recorder: &mut recorder, recorded, repeated, pool, traces, interrupted };

    let mut ended = None;
    if !desk.evaluate(vec![undisturbed(0, settings.seed)], &mut |record| ended = Some(record.observation.clone()))? {
        return interrupt(recorder);
    }
    let Some(reference) = ended else { unreachable!("every test handed in is seen") };
    if let Outcome::Crash { .. } | Outcome::Timeout { .. } = reference.outcome {
        // The record of it stays as it is, so there is nothing that `resume` could go on with.
        drop(desk);
        recorder.finish("the undisturbed reference run failed")?;
        return Err(CampaignError::Reference(reference.outcome.detail().unwrap_or_default()));
    }
    let unheard = unheard(plan, &reference);
    if unheard.iter().any(Unheard::wholly) && !settings.allow_unheard {
        // What is recorded stays unfinished, so that `resume --allow-unheard` can go on with it.
        drop(desk);
        recorder.interrupt()?;
        return Err(CampaignError::Unheard(unheard.into_iter().filter(Unheard::wholly).collect()));
    }
    for unheard in unheard {
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: Some(0), text: unheard.to_string() })?;
    }
    for text in reference_warnings(plan, &reference) {
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: Some(0), text })?;
    }
    if settings.timeout.is_none() {
        desk.pool.set_timeout(patience(reference.wall.run));
    }

    if let Some(text) = tracking.as_ref().and_then(Tracking::out_of_reach) {
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: None, text })?;
    }

    let (trajectories, margins) = (search::needs_trajectories(plan), search::needs_margins(plan));
    if let Some(trajectories) = VariableTrajectories::from_observation(plan, &reference).filter(|_| trajectories) {
        strategy.reference(trajectories);
    }
    let total = plan.campaign.search.evaluations();
    let failing = if let Search::Shrink { failing, .. } = &plan.campaign.search { Some(failing) } else { None };
    let mut front = Front::default();
    let mut rules = StopRules::from_plan(plan);
    let mut indicators = Indicators::new(Some(&search::fitness(plan, &reference)));
    let begun = Instant::now();
    let mut earlier = Earlier::default();
    let mut confirming = plan.campaign.confirm.map(|confirmation| (confirmation, ConfirmedFront::default()));
    let mut again = Again::default();
    let mut neighbours = Neighbours::from_plan(plan);
    let mut originals = BTreeMap::new();
    let mut violating = BTreeSet::new();
    let mut numbered = 0;
    let mut done = 0;
    let mut stop = "all tests were evaluated".to_owned();
    progress(Progress {
        done,
        total,
        repetitions: 0,
        latest: None,
        front: &front,
        coverage: tracking.as_ref().map(|it| &it.coverage),
    });
    loop {
        let candidates = strategy.ask();
        let Some(generation) = candidates.first().map(|candidate| candidate.generation) else { break };
        let mut planned = Vec::with_capacity(candidates.len());
        for Candidate { test, parents, generation, known, simulator_seed: own_seed } in candidates {
            numbered += 1;
            planned.push(Planned {
                number: numbered,
                origin: known.map_or(Origin::Search, Origin::Known),
                generation: known.is_none().then_some(generation),
                parents,
                duplicate_of: if own_seed.is_some() { None } else { earlier.same(&test, numbered) },
                test,
                simulator_seed: own_seed.unwrap_or_else(|| simulator_seed(settings.seed)),
            });
        }
        let mut told = Vec::with_capacity(planned.len());
        violating.clear();
        originals.extend(planned.iter().filter_map(|test| Some((test.number, test.duplicate_of?))));
        let complete = desk.evaluate(planned, &mut |record| {
            let fitness = search::fitness(plan, &record.observation);
            done += 1;
            if confirming.is_some() {
                again.remember(record);
            }
            front.add(record.number, &fitness);
            if violates(plan, &record.observation) {
                violating.insert(record.number);
            }
            let failing = failing.is_some_and(|failing| {
                record::fails(plan, failing, &record.observation.outcome, |id| record.observation.value(id))
            });
            indicators.add(&record.observation.outcome, record.duplicate_of.is_some(), &fitness);
            let point = counted_point(plan, record);
            if let (Some(tracking), Some(point)) = (&mut tracking, &point) {
                tracking.coverage.add(point);
            }
            let trajectories =
                if trajectories { VariableTrajectories::from_observation(plan, &record.observation) } else { None };
            let margins = if margins { search::margins(plan, &record.observation) } else { Vec::new() };
            told.push(Evaluated {
                number: record.number,
                test: record.test.clone(),
                fitness,
                point,
                trajectories,
                margins,
                failing,
            });
            let coverage = tracking.as_ref().map(|it| &it.coverage);
            let repetitions = again.runs();
            progress(Progress { done, total, repetitions, latest: Some(record), front: &front, coverage });
        })?;
        if !complete {
            return interrupt(recorder);
        }
        told.sort_by_key(|evaluated| evaluated.number);
        let stands_for = |number: u32| originals.get(&number).copied().unwrap_or(number);
        if let Some((confirmation, confirming)) = &mut confirming {
            confirming.begin(told.iter().map(|it| GenerationTest {
                number: it.number,
                stands_for: stands_for(it.number),
                first: it.fitness.clone(),
                violates: confirmation.violations && violating.contains(&it.number),
            }));
            loop {
                let wanted = confirming.unconfirmed();
                if wanted.is_empty() {
                    break;
                }
                let coverage = tracking.as_ref().map(|it| &it.coverage);
                let before = confirming.front();
                let runs: Vec<_> = wanted.iter().map(|&number| (number, 1..=confirmation.times)).collect();
                let complete = desk.repeat(&mut again, &runs, settings.seed, &mut |repetitions| {
                    progress(Progress { done, total, repetitions, latest: None, front: &before, coverage });
                })?;
                if !complete {
                    return interrupt(recorder);
                }
                for number in wanted {
                    let fitness = record::confirmed_fitness(plan, desk.repetitions(number));
                    confirming.confirm(number, fitness.expect("all repetitions of the test have just been run"));
                }
            }
            for (evaluated, fitness) in told.iter_mut().zip(confirming.fitness()) {
                evaluated.fitness = fitness.clone();
                let runs = desk.repetitions(stands_for(evaluated.number));
                if let Some(confirmed) = record::confirmed_margins(plan, runs).filter(|_| margins) {
                    evaluated.margins = confirmed;
                }
            }
            front = confirming.front();
        }
        rules.tell(&told);
        if let Some(neighbours) = &mut neighbours {
            neighbours.average(&mut told, stands_for);
        }
        strategy.tell(&told);
        if !plan.campaign.objectives.is_empty() {
            desk.recorder.put_result_set(&ResultSet {
                name: format!("generation-{generation}"),
                generation: Some(generation),
                status: Status::Intermediate,
                members: front.numbers(),
            })?;
        }
        desk.recorder.put_indicators(&indicators.after(generation, &front), indicators.reference())?;
        if let Some(tracking) = &tracking {
            desk.recorder.put_coverage(&tracking.after(generation, done))?;
            if let Some(reached) = tracking.reached() {
                stop = reached;
                break;
            }
        }
        if let Some(reached) = rules.reached(begun.elapsed()) {
            stop = reached;
            break;
        }
    }

    if again.all_like_before() {
        let text = LIKE_BEFORE.to_owned();
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: None, text })?;
    }
    for text in strategy.given_up() {
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: None, text })?;
    }
    if let Some(why) = strategy.ended() {
        stop = why;
    }
    let mut ended = None;
    let last = undisturbed(numbered + 1, settings.seed);
    if !desk.evaluate(vec![last], &mut |record| ended = Some(record.observation.clone()))? {
        return interrupt(recorder);
    }
    let differing = ended.map(|ended| differences(plan, &Test::default(), &reference, &ended)).unwrap_or_default();
    if let Some(Difference { what, before, after }) = differing.first() {
        let text = format!(
            "an undisturbed run after the campaign differs from the one before it: {what} was {before} and is {after}; \
            the simulator does not start afresh for each test"
        );
        desk.recorder.put_event(&Event { kind: EventKind::Warning, test: Some(numbered + 1), text })?;
    }
    drop(desk);
    if !plan.campaign.objectives.is_empty() {
        recorder.put_result_set(&ResultSet {
            name: "final".to_owned(),
            generation: None,
            status: Status::Final,
            members: front.numbers(),
        })?;
    }
    Ok(Conducted::Finished(Box::new(recorder.finish(&stop)?)))
}

fn interrupt(recorder: Recorder) -> Result<Conducted, CampaignError> {
    recorder.interrupt()?;
    Ok(Conducted::Interrupted)
}

/// The simulator's seed, one for the whole campaign; searches that run a test several times bring their own.
fn simulator_seed(seed: u64) -> u64 {
    derive_seed(seed, "simulator", &[0])
}

/// Counting cells while a campaign runs. Hits add up in any order, so that what is covered after a generation does not
/// depend on the order in which its tests ended.
struct Tracking {
    coverage: Coverage,
    feasible: Feasible,
    stop_at: Option<f64>,
}

impl Tracking {
    fn of(plan: &CampaignPlan, goal: &CoverageGoal) -> Result<Tracking, GridError> {
        let grid = Grid::new(goal.axes.clone())?;
        let feasible = Feasible::from_plan(plan, &grid);
        Ok(Tracking { coverage: Coverage::new(grid, goal.hits), feasible, stop_at: goal.stop_at })
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

    /// What is to be said of a coverage that no search can reach.
    fn out_of_reach(&self) -> Option<String> {
        let (feasible, cells) = (self.feasible.count(), self.coverage.grid().len());
        self.stop_at.filter(|&share| (feasible as f64) < share * cells as f64).map(|share| {
            format!(
                "the search cannot stop at {} % of all cells: its tests can reach {feasible} of {cells}",
                100.0 * share
            )
        })
    }
}

/// Where a run lies in the reduced parameter space, if it counts for coverage.
fn counted_point(plan: &CampaignPlan, record: &TestRecord) -> Option<Point> {
    if !coverage::counts(&record.observation.outcome, record.duplicate_of.is_some()) {
        return None;
    }
    sspr::observed_point(plan, &record.test, &record.observation)
}

/// A test that has its number and waits for its run.
struct Planned {
    number: u32,
    origin: Origin,
    generation: Option<u32>,
    parents: Vec<u32>,
    test: Test,
    simulator_seed: u64,
    duplicate_of: Option<u32>,
}

fn undisturbed(number: u32, seed: u64) -> Planned {
    Planned {
        number,
        origin: Origin::Reference,
        generation: None,
        parents: Vec::new(),
        test: Test::default(),
        simulator_seed: simulator_seed(seed),
        duplicate_of: None,
    }
}

impl Planned {
    fn with(self, observation: Observation) -> TestRecord {
        TestRecord {
            number: self.number,
            origin: self.origin,
            generation: self.generation,
            parents: self.parents,
            test: self.test,
            simulator_seed: self.simulator_seed,
            duplicate_of: self.duplicate_of,
            observation,
        }
    }
}

/// The tests of this campaign by their content, so that an equal one is not simulated again. Of each test its hash is kept:
/// the tests themselves would be most of what a campaign holds in memory.
#[derive(Default)]
struct Earlier(HashMap<[u8; 16], u32>);

impl Earlier {
    /// The number of the first test equal to this one; this one is remembered if it is the first.
    fn same(&mut self, test: &Test, number: u32) -> Option<u32> {
        let content = serde_json::to_vec(test).unwrap_or_else(|error| unreachable!("a test is plain data: {error}"));
        // Half of a SHA-256: of 10^12 tests two have the same by chance once in 10^14 campaigns.
        let mut hash = [0; 16];
        hash.copy_from_slice(&Sha256::digest(content)[..16]);
        match self.0.entry(hash) {
            Entry::Occupied(first) => Some(*first.get()),
            Entry::Vacant(place) => {
                place.insert(number);
                None
            }
        }
    }
}

/// Where tests are handed out and their results recorded.
pub(super) struct Desk<'a> {
    pub(super) recorder: &'a mut Recorder,
    /// Numbers of the tests already recorded when the campaign was taken up again.
    pub(super) recorded: BTreeSet<u32>,
    /// What is recorded of repetitions, by test.
    pub(super) repeated: BTreeMap<u32, Vec<Repetition>>,
    pub(super) pool: Pool,
    pub(super) traces: Option<Traces>,
    pub(super) interrupted: &'a AtomicBool,
}

/// Which traces are kept, and in which folder of results.
pub(super) struct Traces {
    folder: PathBuf,
    keep: Recorded,
}

impl Traces {
    fn order(&self, test: &Planned) -> TraceOrder {
        // The undisturbed run is what others are compared with.
        let keep = if test.origin == Origin::Reference { Recorded::All } else { self.keep };
        TraceOrder { file: record::trace_file(&self.folder, test.number), keep }
    }
}

impl Desk<'_> {
    /// Runs tests and records each as it ends; `each` sees every one, in the order they ended. False if the user
    /// stopped it; what had ended by then is recorded.
    fn evaluate(&mut self, planned: Vec<Planned>, each: &mut dyn FnMut(&TestRecord)) -> Result<bool, CampaignError> {
        let mut waiting = BTreeMap::new();
        let mut duplicates = Vec::new();
        let mut known = VecDeque::new();
        let last = planned.last().map_or(0, |test| test.number);
        for test in planned {
            if self.recorded.contains(&test.number) {
                let record = self.read(&mut known, test.number..=last, test.origin)?;
                if record.test != test.test || record.simulator_seed != test.simulator_seed {
                    return Err(CampaignError::OtherCampaign(test.number));
                }
                each(&record);
            } else if let Some(original) = test.duplicate_of {
                duplicates.push((original, test));
            } else {
                let job = Job {
                    number: test.number,
                    test: test.test.clone(),
                    simulator_seed: test.simulator_seed,
                    trace: self.traces.as_ref().map(|traces| traces.order(&test)),
                };
                self.pool.submit(job);
                waiting.insert(test.number, test);
            }
        }
        while !waiting.is_empty() {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let Some(Ended { number, observation, notes, trace_failure, killed }) =
                self.pool.next(Duration::from_millis(100))?
            else {
                continue;
            };
            let Some(test) = waiting.remove(&number) else { continue };
            if let Some(reason) = trace_failure {
                return Err(CampaignError::Trace { test: number, reason });
            }
            if killed && test.origin == Origin::Reference {
                // Whatever is compared with it would say something of that kill, for good.
                return Err(CampaignError::Killed {
                    test: number,
                    reason: observation.outcome.detail().unwrap_or_default(),
                });
            }
            self.record(&test.with(observation), each)?;
            for text in notes {
                self.recorder.put_event(&Event { kind: EventKind::Session, test: Some(number), text })?;
            }
        }
        for (original, test) in duplicates {
            let observation = self.read(&mut VecDeque::new(), original..=original, test.origin)?.observation;
            self.record(&test.with(observation), each)?;
        }
        Ok(true)
    }

    /// What is recorded of the first of these tests, as far as a campaign looks at it: its series only where they are looked
    /// at. Those that follow are read together with it, and wait in `known`.
    fn read(
        &self,
        known: &mut VecDeque<TestRecord>,
        numbers: RangeInclusive<u32>,
        origin: Origin,
    ) -> Result<TestRecord, RecordError> {
        let number = *numbers.start();
        while known.front().is_some_and(|record| record.number < number) {
            known.pop_front();
        }
        if known.is_empty() {
            let repository = self.recorder.repository();
            let series = origin == Origin::Reference || search::needs_trajectories(repository.plan());
            let together = if series { number } else { number.saturating_add(READ_TOGETHER).min(*numbers.end()) };
            known.extend(repository.records(number..=together, series)?);
        }
        match known.pop_front() {
            Some(record) if record.number == number => Ok(record),
            // It is missing: the error says so.
            _ => self.recorder.repository().test(number),
        }
    }

    fn record(&mut self, record: &TestRecord, each: &mut dyn FnMut(&TestRecord)) -> Result<(), CampaignError> {
        self.recorder.commit(record)?;
        for warning in &record.observation.warnings {
            let event = Event { kind: EventKind::Warning, test: Some(record.number), text: warning.clone() };
            self.recorder.put_event(&event)?;
        }
        each(record);
        Ok(())
    }
}

/// An operation on a topic that nobody hears, or of whose members nobody hears some.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unheard {
    operation: String,
    topic: String,
    /// The names on the wire that nobody hears.
    paths: Vec<String>,
    /// Of how many.
    of: usize,
}

impl Unheard {
    /// Whether nobody hears any of its topic.
    fn wholly(&self) -> bool {
        self.paths.len() == self.of
    }
}

impl fmt::Display for Unheard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unheard { operation, topic, paths, .. } = self;
        let named = paths.iter().map(|path| format!("`{path}`")).collect::<Vec<_>>().join(", ");
        if self.wholly() {
            write!(
                f,
                "nobody hears operation `{operation}`: the simulator does not subscribe to its topic `{topic}` ({named}), and no outbound metric reads it"
            )
        } else {
            write!(
                f,
                "nobody hears operation `{operation}` on {named} of `{topic}`: the simulator subscribes to other members only"
            )
        }
    }
}

/// The operations that tests of this campaign may hold and that nobody heard, wholly or in part, in its undisturbed run.
fn unheard(plan: &CampaignPlan, reference: &Observation) -> Vec<Unheard> {
    let of_tests = |tests: &[KnownTestId]| -> BTreeSet<OperationId> {
        tests.iter().flat_map(|&id| &plan.test(id).test.operations).map(|it| it.operation).collect()
    };
    let operations = match &plan.campaign.search {
        Search::Known { tests } => of_tests(tests),
        Search::Repeat { test, .. } | Search::Shrink { test, .. } => of_tests(&[*test]),
        _ => plan.campaign.operations.iter().copied().collect(),
    };
    let found = operations.into_iter().filter_map(|id| {
        let operation = plan.operation(id);
        let topic = plan.topic(operation.topic?);
        let paths: Vec<String> = topic.paths.iter().filter(|path| reference.unheard.contains(path)).cloned().collect();
        let unheard =
            Unheard { operation: operation.name.clone(), topic: topic.name.clone(), paths, of: topic.paths.len() };
        (!unheard.paths.is_empty()).then_some(unheard)
    });
    found.collect()
}

/// Whether a run violates a requirement.
fn violates(plan: &CampaignPlan, observation: &Observation) -> bool {
    plan.requirements.iter().any(|requirement| {
        let value = observation.value(requirement.metric);
        verdict(requirement.bound, &observation.outcome, value) == Verdict::Violated
    })
}

/// What is wrong with a system before anything is fuzzed.
fn reference_warnings(plan: &CampaignPlan, reference: &Observation) -> Vec<String> {
    let broken = plan.requirements.iter().filter_map(|requirement| {
        let value = reference.value(requirement.metric);
        (verdict(requirement.bound, &reference.outcome, value) == Verdict::Violated).then(|| {
            let name = &plan.metric(requirement.metric).name;
            let value = value.value.map_or_else(|| "no value".to_owned(), |value| value.to_string());
            format!("requirement {} is broken before anything is fuzzed: `{name}` is {value}", requirement.name)
        })
    });
    broken.collect()
}

#[cfg(test)]
mod tests {
    use sesame_plan::{Dimension, GridAxis};
    use sesame_results::record::sample;

    use super::*;

    fn tracking(stop_at: f64) -> Tracking {
        let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
        let axes = vec![axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6), axis(Dimension::P1, 1.0, 3)];
        Tracking::of(&sample::plan(), &CoverageGoal { axes, hits: 1, stop_at: Some(stop_at) }).unwrap()
    }

    #[test]
    fn a_coverage_that_no_test_can_reach_is_told_before_anything_is_run() {
        assert_eq!(tracking(0.8).out_of_reach(), None);
        let said = tracking(0.9).out_of_reach();
        assert_eq!(said.as_deref(), Some("the search cannot stop at 90 % of all cells: its tests can reach 96 of 108"));
    }

    #[test]
    fn an_operation_that_nobody_hears_is_named_and_a_group_is_heard_if_a_member_is() {
        let plan = sample::plan();
        let heard = |unheard: &[&str]| {
            let mut reference = sample::observe(&plan, &Test::default(), 1);
            reference.unheard = unheard.iter().map(|&path| path.to_owned()).collect();
            super::unheard(&plan, &reference)
        };
        assert_eq!(heard(&[]), []);
        let operation = plan.operation(plan.campaign.operations[0]);
        let topic = plan.topic(operation.topic.unwrap());
        let paths: Vec<&str> = topic.paths.iter().map(String::as_str).collect();
        let found = heard(&paths);
        assert!(found[0].wholly());
        let said = CampaignError::Unheard(found.clone()).to_string();
        for part in [&operation.name, &topic.name, &topic.paths[0], "--allow-unheard"] {
            assert!(said.contains(part), "{said}");
        }
        let partly = Unheard { of: paths.len() + 1, ..found[0].clone() };
        assert!(!partly.wholly() && partly.to_string().contains("other members only"));
        let mut known = plan.clone();
        known.campaign.search = Search::Known { tests: Vec::new() };
        let mut reference = sample::observe(&plan, &Test::default(), 1);
        reference.unheard = topic.paths.clone();
        assert_eq!(super::unheard(&known, &reference), [], "only what is to be run counts");
    }

    #[test]
    fn an_equal_test_is_known_by_its_first_number_however_many_came_between() {
        let plan = sample::plan();
        let records = sample::records(&plan, 300);
        let mut earlier = Earlier::default();
        for (number, record) in (0u32..).zip(records.iter().chain(&records)) {
            let first = records.iter().position(|other| other.test == record.test);
            let first = u32::try_from(first.expect("it is among them")).unwrap();
            assert_eq!(earlier.same(&record.test, number), (first < number).then_some(first), "{number}");
        }
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
