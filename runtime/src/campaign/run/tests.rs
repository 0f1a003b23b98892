//! Campaigns without processes: an executor in this thread, which ends tests in the order that it is told.

use std::sync::atomic::Ordering;
use std::time::Duration;

use sesame_plan::{
    Bound, Confirmation, Count, CoverageGoal, Dimension, GridAxis, KnownTest, KnownTestId, Search, Statistic,
};
use sesame_record as record;
use sesame_record::sample;
use sesame_rng::Stream;

use super::*;
use crate::campaign::WorkerProgram;
use crate::campaign::executor::{ExecutorError, Job, JobResult};

/// Computes what a run shows, without a simulator.
struct InThread<'a> {
    plan: &'a CampaignPlan,
    /// The seed of the order in which tests end; `None` for the order in which they came.
    order: Option<Stream>,
    waiting: Vec<Job>,
    /// How many tests it claims to run at once.
    at_once: usize,
    /// Tests run so far, and after how many the user stops the campaign.
    run: u32,
    stop_after: Option<u32>,
    interrupted: &'a AtomicBool,
}

impl Executor for InThread<'_> {
    fn submit(&mut self, job: Job) {
        self.waiting.push(job);
    }

    fn next(&mut self, _: Duration) -> Result<Option<JobResult>, ExecutorError> {
        if self.waiting.is_empty() {
            return Ok(None);
        }
        let next = self.order.as_mut().map_or(0, |order| order.below(self.waiting.len()));
        let Job { number, test, simulator_seed, .. } = self.waiting.remove(next);
        self.run += 1;
        if Some(self.run) == self.stop_after {
            self.interrupted.store(true, Ordering::Relaxed);
        }
        let observation = sample::observe(self.plan, &test, simulator_seed);
        Ok(Some(JobResult {
            number,
            observation,
            notes: Vec::new(),
            added: Vec::new(),
            trace_failure: None,
            killed: false,
            lock_stepped: true,
            machine: None,
        }))
    }

    fn set_timeout(&mut self, _: Duration, _: Duration) {}

    fn lock_stepped(&self) -> bool {
        true
    }

    fn at_once(&self) -> usize {
        self.at_once
    }
}

/// The sample campaign, with all that a campaign can do on the way.
fn plan() -> CampaignPlan {
    let mut plan = sample::plan();
    plan.campaign.search = Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 60);
    let axis = |dimension| GridAxis { dimension, low: 0.0, high: 1.0, cells: 4 };
    plan.campaign.coverage =
        Some(CoverageGoal { axes: vec![axis(Dimension::T1), axis(Dimension::T2)], hits: 1, stop_at: None });
    plan.campaign.confirm = Some(Confirmation { times: 2, by: Statistic::Median, violations: true });
    plan
}

fn settings(plan: &CampaignPlan) -> Settings {
    let (seed, program) = (plan.campaign.seed, WorkerProgram::compiled().unwrap());
    Settings { seed, workers: 1, timeout: None, reference_timeout: None, program, allow_unheard: false }
}

/// Begins or resumes a campaign; returns how it ended, how many tests were run, and its events.
fn campaign(
    plan: &CampaignPlan,
    folder: &Path,
    order: Option<u64>,
    stop_after: Option<u32>,
) -> (Result<CampaignEnd, CampaignError>, u32, Vec<String>) {
    campaign_of(plan, folder, order, stop_after, 1)
}

/// The same with so many tests at once.
fn campaign_of(
    plan: &CampaignPlan,
    folder: &Path,
    order: Option<u64>,
    stop_after: Option<u32>,
    at_once: usize,
) -> (Result<CampaignEnd, CampaignError>, u32, Vec<String>) {
    let recorder = if folder.join(record::DATABASE).exists() {
        Recorder::resume(folder, 1)
    } else {
        Recorder::create(folder, plan, plan.campaign.seed, 1)
    };
    let interrupted = AtomicBool::new(false);
    let order = order.map(|seed| Stream::derive(seed, "order", &[]));
    let mut executor =
        InThread { plan, order, waiting: Vec::new(), at_once, run: 0, stop_after, interrupted: &interrupted };
    let strategy = search::strategy(plan, plan.campaign.seed).unwrap();
    let mut events = Vec::new();
    let end = run_with(
        plan,
        strategy,
        recorder.unwrap(),
        &settings(plan),
        &mut executor,
        &interrupted,
        &mut |event, progress| {
            events.push(match event {
                CampaignEvent::ReferenceRunAwaited { .. } => "awaited".to_owned(),
                CampaignEvent::Told { text } | CampaignEvent::Warned { text } => text.to_owned(),
                CampaignEvent::AgentsAwaited { .. } | CampaignEvent::Machines(_) => "machines".to_owned(),
                CampaignEvent::SearchStarted { .. } => "search started".to_owned(),
                CampaignEvent::TestEnded(record) => format!("test {} of {}", progress.done, record.number),
                CampaignEvent::ConfirmationAdvanced => "confirmation".to_owned(),
                CampaignEvent::GenerationEnded { generation } => format!("generation {generation}"),
                CampaignEvent::SearchEnded { reason } => reason.to_owned(),
            });
        },
    );
    (end, executor.run, events)
}

fn digest(folder: &Path) -> String {
    record::digest(&folder.join(record::DATABASE)).unwrap()
}

#[test]
fn results_depend_neither_on_the_order_in_which_tests_end_nor_on_interruptions() {
    let plan = plan();
    let whole = tempfile::tempdir().unwrap();
    let (end, runs, events) = campaign(&plan, whole.path(), None, None);
    assert!(matches!(end.unwrap(), CampaignEnd::Finished(_)));
    assert!(runs > 62, "60 tests, two reference runs, and repetitions: {runs}");
    assert_eq!(events.first().map(String::as_str), Some("search started"));
    assert_eq!(events.last().map(String::as_str), Some("all tests were evaluated"));
    for generation in 0..6 {
        let at = |event: &str| events.iter().position(|other| other == event).unwrap_or_else(|| panic!("{event}"));
        let ended = at(&format!("generation {generation}"));
        let (first, last) = (10 * generation + 1, 10 * generation + 10);
        assert!((first..=last).all(|test| at(&format!("test {test} of {test}")) < ended), "{generation}");
    }

    for seed in 0..4 {
        let shuffled = tempfile::tempdir().unwrap();
        campaign(&plan, shuffled.path(), Some(seed), None).0.unwrap();
        assert_eq!(digest(shuffled.path()), digest(whole.path()), "order {seed}");
    }

    let stopped = tempfile::tempdir().unwrap();
    let mut sessions = 0;
    let mut run = 0;
    loop {
        sessions += 1;
        let (end, more, _) = campaign(&plan, stopped.path(), Some(sessions), Some(7));
        run += more;
        match end.unwrap() {
            CampaignEnd::Finished(_) => break,
            CampaignEnd::Interrupted => assert_eq!(more, 7, "it stops when it is told to"),
        }
    }
    assert!(sessions > 8, "{sessions}");
    // A test whose result was not taken any more is run again.
    assert!(run < runs + 2 * u32::try_from(sessions).unwrap(), "{run} of {runs}");
    assert_eq!(digest(stopped.path()), digest(whole.path()));
}

#[test]
fn a_search_ends_at_the_generation_that_reaches_its_coverage() {
    let mut plan = plan();
    let goal = plan.campaign.coverage.as_mut().unwrap();
    goal.stop_at = Some(0.1);
    let folder = tempfile::tempdir().unwrap();
    let (end, _, events) = campaign(&plan, folder.path(), None, None);
    let CampaignEnd::Finished(repository) = end.unwrap() else { panic!("it was stopped") };
    let reason = repository.campaign().stop.clone().unwrap();
    assert!(reason.starts_with("its coverage was reached: "), "{reason}");
    assert_eq!(events.last(), Some(&reason));
    assert_eq!(events.iter().filter(|event| event.starts_with("generation")).count(), 1);
}

#[test]
fn a_search_ends_when_its_grid_is_exhausted_also_after_interruptions() {
    let mut plan = plan();
    plan.campaign.operations.truncate(1);
    plan.campaign.count = Count { min: 1, max: 1 };
    plan.campaign.search = Search::new(sesame_plan::Strategy::Grid { levels: 3 }, 1_000);
    let tests = search::strategy(&plan, plan.campaign.seed).unwrap().tests().unwrap();
    assert!((10..200).contains(&tests), "{tests}");
    let whole = tempfile::tempdir().unwrap();
    let (end, _, events) = campaign(&plan, whole.path(), None, None);
    let CampaignEnd::Finished(repository) = end.unwrap() else { panic!("it was stopped") };
    assert_eq!(events.last(), Some(&format!("all {tests} tests of the grid were evaluated")));
    assert_eq!(repository.tests().unwrap().len() as u128, tests + 2, "two reference runs");

    let stopped = tempfile::tempdir().unwrap();
    while matches!(campaign(&plan, stopped.path(), Some(1), Some(7)).0.unwrap(), CampaignEnd::Interrupted) {}
    assert_eq!(digest(stopped.path()), digest(whole.path()));
}

#[test]
fn a_campaign_whose_operations_reach_nothing_ends_before_it_searches_and_can_be_resumed() {
    let plan = plan();
    let folder = tempfile::tempdir().unwrap();
    let interrupted = AtomicBool::new(false);
    let run = |allow_unheard: bool, recorder: Recorder| {
        let mut executor = Deaf(InThread {
            plan: &plan,
            order: None,
            waiting: Vec::new(),
            at_once: 1,
            run: 0,
            stop_after: None,
            interrupted: &interrupted,
        });
        let strategy = search::strategy(&plan, 1).unwrap();
        let settings = Settings { allow_unheard, ..settings(&plan) };
        run_with(&plan, strategy, recorder, &settings, &mut executor, &interrupted, &mut |_, _| {})
    };
    let refused = run(false, Recorder::create(folder.path(), &plan, plan.campaign.seed, 1).unwrap());
    assert!(matches!(refused, Err(CampaignError::Ineffective(_))), "{refused:?}");
    let resumed = run(true, Recorder::resume(folder.path(), 1).unwrap());
    assert!(matches!(resumed, Ok(CampaignEnd::Finished(_))), "{resumed:?}");
}

/// As [`InThread`], with a simulator that subscribes to nothing.
struct Deaf<'a>(InThread<'a>);

impl Executor for Deaf<'_> {
    fn submit(&mut self, job: Job) {
        self.0.submit(job);
    }

    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError> {
        let mut next = self.0.next(wait)?;
        if let Some(result) = &mut next {
            result.observation.unheard = self.0.plan.topics.iter().flat_map(|topic| topic.paths.clone()).collect();
        }
        Ok(next)
    }

    fn lock_stepped(&self) -> bool {
        self.0.lock_stepped()
    }

    fn at_once(&self) -> usize {
        self.0.at_once()
    }

    fn set_timeout(&mut self, timeout: Duration, reference: Duration) {
        self.0.set_timeout(timeout, reference);
    }
}

#[test]
fn a_regression_test_runs_with_the_seed_that_it_names_whatever_the_seed_of_the_campaign() {
    let mut plan = sample::plan();
    let seeded = KnownTest { name: "seeded".to_owned(), simulator_seed: Some(11), ..plan.tests[0].clone() };
    plan.tests.push(seeded);
    let task = Task::Known { tests: vec![KnownTestId(0), KnownTestId(1)], lab: None };
    let values = |seed: u64| {
        let folder = tempfile::tempdir().unwrap();
        let claim = record::claim_folder(folder.path(), "known").unwrap();
        let recorder = Recorder::create_in(claim, &plan, &task, seed, 1).unwrap();
        let interrupted = AtomicBool::new(false);
        let (order, waiting) = (None, Vec::new());
        let mut executor =
            InThread { plan: &plan, order, waiting, at_once: 1, run: 0, stop_after: None, interrupted: &interrupted };
        let strategy = search::strategy_of_task(&plan, &task, seed).unwrap();
        let settings = Settings { seed, ..settings(&plan) };
        let end = run_with(&plan, strategy, recorder, &settings, &mut executor, &interrupted, &mut |_, _| {}).unwrap();
        let CampaignEnd::Finished(repository) = end else { panic!("it was stopped") };
        let run = |name: &str| repository.test(repository.find(name).unwrap()).unwrap();
        let [unseeded, seeded] = [run("known_jitter"), run("seeded")];
        assert_eq!((unseeded.test, seeded.simulator_seed), (seeded.test, 11));
        (unseeded.observation.metrics, seeded.observation.metrics)
    };
    let [one, other] = [values(1), values(7)];
    assert_ne!(one.0, other.0);
    assert_eq!(one.1, other.1);
}

/// As [`InThread`], with a simulator that takes its time for the first test.
struct Slow<'a>(InThread<'a>, u32);

impl Executor for Slow<'_> {
    fn submit(&mut self, job: Job) {
        self.0.submit(job);
    }

    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError> {
        if self.1 > 0 {
            self.1 -= 1;
            return Ok(None);
        }
        self.0.next(wait)
    }

    fn lock_stepped(&self) -> bool {
        self.0.lock_stepped()
    }

    fn at_once(&self) -> usize {
        self.0.at_once()
    }

    fn set_timeout(&mut self, timeout: Duration, reference: Duration) {
        self.0.set_timeout(timeout, reference);
    }
}

#[test]
fn what_the_reference_run_shows_is_told_before_the_search_and_waiting_for_it_is_told_too() {
    let mut plan = plan();
    plan.campaign.confirm = None;
    plan.requirements[0].bound = Bound::Below { value: 0.0 };
    let folder = tempfile::tempdir().unwrap();
    let interrupted = AtomicBool::new(false);
    let (order, waiting) = (None, Vec::new());
    let quick =
        InThread { plan: &plan, order, waiting, at_once: 1, run: 0, stop_after: None, interrupted: &interrupted };
    let recorder = Recorder::create(folder.path(), &plan, plan.campaign.seed, 1).unwrap();
    let strategy = search::strategy(&plan, plan.campaign.seed).unwrap();
    let settings = Settings { reference_timeout: Some(Duration::from_secs(30)), ..settings(&plan) };
    let mut events = Vec::new();
    let mut listener = |event: CampaignEvent<'_>, progress: Progress<'_>| {
        assert_eq!((progress.total, progress.earlier), (60, 0));
        events.push(match event {
            CampaignEvent::ReferenceRunAwaited { limit, .. } => format!("awaited, at most {limit:?}"),
            CampaignEvent::Warned { text } => text.to_owned(),
            CampaignEvent::SearchStarted { timeout, .. } => format!("started, {timeout:?} a test"),
            _ => "later".to_owned(),
        });
    };
    run_with(&plan, strategy, recorder, &settings, &mut Slow(quick, 3), &interrupted, &mut listener).unwrap();
    assert_eq!(events[..3], ["awaited, at most 30s"; 3]);
    let warned = &events[3];
    assert!(warned.starts_with("requirement R1 is violated before anything is fuzzed"), "{warned}");
    assert_eq!(events[4], "started, 60s a test");
    assert!(events[5..].iter().all(|event| event == "later"));
    let recorded = Repository::open(folder.path()).unwrap().events().unwrap();
    assert!(recorded.iter().any(|event| event.text == *warned), "it is in the report as well");
}

#[test]
fn tests_of_a_search_that_learns_nothing_begin_early_and_are_recorded_in_their_turn() {
    let mut plan = plan();
    plan.campaign.search = Search::new(sesame_plan::Strategy::Random, 170);
    plan.campaign.confirm = None;
    let one = tempfile::tempdir().unwrap();
    let (_, runs, _) = campaign_of(&plan, one.path(), None, None, 1);
    assert_eq!(runs, 172, "each test, and two reference runs");
    for (at_once, order, stop_after) in [(30, Some(1), None), (200, Some(2), None), (60, Some(3), Some(80))] {
        let folder = tempfile::tempdir().unwrap();
        let (end, runs, events) = campaign_of(&plan, folder.path(), order, stop_after, at_once);
        if stop_after.is_some() {
            assert!(matches!(end.unwrap(), CampaignEnd::Interrupted));
            campaign_of(&plan, folder.path(), order, None, at_once).0.unwrap();
        } else {
            assert_eq!(runs, 172);
            let generations: Vec<_> = events.iter().filter(|event| event.starts_with("generation")).collect();
            assert_eq!(generations, ["generation 0", "generation 1", "generation 2", "generation 3"]);
        }
        assert_eq!(digest(folder.path()), digest(one.path()), "{at_once} at once");
    }
}

#[test]
fn no_test_begins_early_that_a_rule_to_stop_may_leave_out() {
    let mut plan = plan();
    plan.campaign.search = Search::new(sesame_plan::Strategy::Random, 170);
    plan.campaign.confirm = None;
    plan.campaign.coverage.as_mut().unwrap().stop_at = Some(0.01);
    let folder = tempfile::tempdir().unwrap();
    let (_, runs, events) = campaign_of(&plan, folder.path(), Some(1), None, 100);
    assert_eq!(runs, 52, "a generation, and two reference runs: {events:?}");
}
