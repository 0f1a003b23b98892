//! A campaign from its first reference run to its last: ask the search for tests, run them, record them, tell the
//! search.

use std::collections::{BTreeSet, VecDeque};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use sesame_base::observation::{Observation, Outcome};
use sesame_optimise::front::Front;
use sesame_plan::{CampaignPlan, Task};
use sesame_record::{Recorder, Repository, ResultSet, Status};
use sesame_search as search;
use sesame_search::{Evaluated, Neighbours, Strategy};

#[cfg(feature = "agents")]
use crate::campaign::agents::{Agents, Fleet};
#[cfg(unix)]
use crate::campaign::asked::{self, Asked};
use crate::campaign::confirmation::ConfirmedSearch;
use crate::campaign::error::{CampaignError, Halt};
use crate::campaign::evaluator::{Evaluator, Happened};
use crate::campaign::events::{CampaignEvent, Listener, Progress};
use crate::campaign::executor::Executor;
use crate::campaign::numbering::{Numbering, PlannedTest};
use crate::campaign::observer::{EndedTest, Generation, Observer};
use crate::campaign::observers::{counted_point, observers};
use crate::campaign::pool::Pool;
use crate::campaign::reference::{self, Ineffective};
use crate::campaign::settings::{Settings, default_timeout};

/// The warning of a campaign whose simulator nobody steps.
const FREE_RUNNING: &str = "the simulator runs freely, so equal tests may give different results: equal tests are simulated \
     again, and neither a replay nor the digest of a second run is expected to be the same";

/// How a campaign ended.
#[derive(Debug)]
pub enum CampaignEnd {
    /// All tests were evaluated, or a rule ended the search.
    Finished(Box<Repository>),
    /// The user stopped it; `resume` goes on.
    Interrupted,
}

/// Where the tests of a campaign run.
#[derive(Default)]
pub enum Place {
    /// In worker processes of this machine, or by the program that started this one, if that carries out tests.
    #[default]
    Here,
    /// On machines with agents.
    #[cfg(feature = "agents")]
    Fleet(Box<Fleet>),
}

/// Runs the task of a recorder, with the plan of that task, in worker processes and records it; what the recorder
/// already holds is not simulated again. Each worker gets a folder of its own in `directory`.
#[cfg_attr(not(feature = "agents"), expect(clippy::needless_pass_by_value, reason = "agents take what is in it"))]
pub fn run_campaign(
    plan: &CampaignPlan,
    recorder: Recorder,
    settings: &Settings,
    place: Place,
    directory: &Path,
    interrupted: &AtomicBool,
    listener: &mut Listener<'_>,
) -> Result<CampaignEnd, CampaignError> {
    // Before any process is started, so that a plan without a search is refused at once.
    let task = recorder.repository().task().clone();
    let strategy = search::strategy_of_task(plan, &task, settings.seed)?;
    let timeout = settings.first_timeout();
    let mut executor: Box<dyn Executor> = match place {
        #[cfg(unix)]
        Place::Here if asked::carries_out_tests() => Box::new(Asked::connect(plan)?),
        Place::Here => Box::new(Pool::start(&settings.pool(task.evaluations(plan), directory, timeout))?),
        #[cfg(feature = "agents")]
        Place::Fleet(fleet) => Box::new(Agents::start(*fleet, timeout)?),
    };
    run_with(plan, strategy, recorder, settings, &mut *executor, interrupted, listener)
}

/// Runs a campaign by any executor.
fn run_with(
    plan: &CampaignPlan,
    strategy: Box<dyn Strategy>,
    mut recorder: Recorder,
    settings: &Settings,
    executor: &mut dyn Executor,
    interrupted: &AtomicBool,
    listener: &mut Listener<'_>,
) -> Result<CampaignEnd, CampaignError> {
    let task = recorder.repository().task().clone();
    let evaluator = Evaluator::new(plan, strategy.reads_series(), &mut recorder, executor, interrupted)?;
    let run = Campaign::begin(plan, &task, strategy, evaluator, settings, listener).and_then(Campaign::finish);
    match run {
        Ok(stop) => Ok(CampaignEnd::Finished(Box::new(recorder.finish(&stop)?))),
        Err(Halt::Stopped) => {
            recorder.interrupt()?;
            Ok(CampaignEnd::Interrupted)
        }
        Err(Halt::Failed(error)) => {
            match error {
                // The reference run stays recorded as it is, so there is nothing that `resume` could go on with.
                CampaignError::Reference(_) => drop(recorder.finish("the reference run failed")?),
                // The run stays unfinished, so that `resume --allow-unheard` can go on with it.
                CampaignError::Ineffective(_) => recorder.interrupt()?,
                _ => {}
            }
            Err(error)
        }
    }
}

/// A campaign whose first reference run has ended.
struct Campaign<'a, 'l> {
    plan: &'a CampaignPlan,
    evaluator: Evaluator<'a>,
    strategy: Box<dyn Strategy>,
    numbering: Numbering,
    /// What the first reference run showed.
    reference: Observation,
    observers: Vec<Box<dyn Observer>>,
    confirmed: Option<ConfirmedSearch>,
    neighbours: Option<Neighbours>,
    front: Front,
    /// Generations that were asked for before their turn, and begun.
    ahead: VecDeque<(u32, Vec<PlannedTest>)>,
    /// Tests evaluated.
    done: u32,
    /// How many of them were recorded before this session.
    earlier: u32,
    /// Tests to evaluate in total, at most.
    total: u32,
    listener: &'a mut Listener<'l>,
}

impl<'a, 'l> Campaign<'a, 'l> {
    /// Performs the first reference run, and checks that the campaign makes sense.
    fn begin(
        plan: &'a CampaignPlan,
        task: &Task,
        mut strategy: Box<dyn Strategy>,
        mut evaluator: Evaluator<'a>,
        settings: &Settings,
        listener: &'a mut Listener<'l>,
    ) -> Result<Self, Halt> {
        let lock_stepped = evaluator.executor.lock_stepped();
        let mut numbering = Numbering::new(settings.seed, lock_stepped);
        let front = Front::default();
        let (total, earlier) = (task.evaluations(plan), evaluator.earlier()?);
        let begun = Progress { done: 0, total, earlier, confirmation_runs: 0, front: &front, coverage: None };
        let by_agents = evaluator.executor.machines().is_some();
        let (started, limit) = (Instant::now(), settings.first_timeout());
        let reference = reference_run(&mut evaluator, &mut numbering, &mut |happened| {
            let event = match happened {
                // How long agents take is theirs to say: while none is there, nothing is stopped.
                Happened::Waits(missing) if by_agents => CampaignEvent::AgentsAwaited { missing },
                Happened::Waits(missing) => {
                    CampaignEvent::ReferenceRunAwaited { waited: started.elapsed(), limit, missing }
                }
                Happened::Told(text) => CampaignEvent::Told { text },
                Happened::Machines(machines) => CampaignEvent::Machines(machines),
                Happened::Ended(_) => return,
            };
            listener(event, begun);
        })?;
        match &reference.outcome {
            outcome @ Outcome::Timeout { .. } => {
                let stopped = outcome.detail().unwrap_or_default();
                let remedy =
                    "if the simulator is slow and not stuck, give it more time with `--reference-timeout SECONDS`";
                return Err(CampaignError::Reference(format!("{stopped}; {remedy}")).into());
            }
            outcome @ (Outcome::Crash { .. }
            | Outcome::LaunchFailed { .. }
            | Outcome::Disconnect { .. }
            | Outcome::WrongClock { .. }) => {
                return Err(CampaignError::Reference(outcome.detail().unwrap_or_default()).into());
            }
            Outcome::Completed | Outcome::NoEffect | Outcome::Unknown => {}
        }
        evaluator.compare_with(&reference);
        let ineffective = reference::ineffective(plan, task, &reference);
        if ineffective.iter().any(Ineffective::wholly) && !settings.allow_unheard {
            let wholly = ineffective.into_iter().filter(Ineffective::wholly);
            return Err(CampaignError::Ineffective(wholly.collect()).into());
        }
        let observers = observers(plan, &reference)?;
        let of_run = ineffective.iter().map(Ineffective::to_string).chain(reference::violations(plan, &reference));
        let of_campaign = (!lock_stepped).then(|| FREE_RUNNING.to_owned());
        let of_observers = observers.iter().filter_map(|observer| observer.warning());
        let warnings = of_run
            .map(|text| (Some(0), text))
            .chain(of_campaign.into_iter().chain(of_observers).map(|text| (None, text)));
        for text in &reference.warnings {
            listener(CampaignEvent::Warned { text }, begun);
        }
        for (test, text) in warnings {
            listener(CampaignEvent::Warned { text: &text }, begun);
            evaluator.warn(test, text)?;
        }
        let timeout = settings.timeout.unwrap_or_else(|| default_timeout(reference.wall.run));
        let took = Duration::from_secs_f64(reference.wall.run);
        evaluator.executor.set_timeout(timeout, took);
        strategy.begin(&reference);
        let mut campaign = Campaign {
            plan,
            evaluator,
            strategy,
            numbering,
            reference,
            observers,
            confirmed: plan.campaign.confirm.map(|confirmation| ConfirmedSearch::new(confirmation, settings.seed)),
            neighbours: Neighbours::from_plan(plan),
            front,
            ahead: VecDeque::new(),
            done: 0,
            earlier,
            total,
            listener,
        };
        campaign.tell(CampaignEvent::SearchStarted { reference: took, timeout });
        Ok(campaign)
    }

    /// Goes on to the end, with the last reference run; returns why the search ended.
    fn finish(mut self) -> Result<String, Halt> {
        let reason = loop {
            if let ControlFlow::Break(reason) = self.step()? {
                break reason;
            }
        };
        if let Some(text) = self.confirmed.as_ref().and_then(ConfirmedSearch::warning) {
            self.evaluator.warn(None, text)?;
        }
        for text in self.strategy.given_up() {
            self.evaluator.warn(None, text)?;
        }
        self.tell(CampaignEvent::SearchEnded { reason: &reason });
        // All of its runs are such runs.
        if self.evaluator.recorder.repository().task().undisturbed().is_some() {
            return Ok(reason);
        }
        let last = reference_run(&mut self.evaluator, &mut self.numbering, &mut |_| {})?;
        let lock_stepped = self.evaluator.executor.lock_stepped();
        if let Some(text) = reference::difference(self.plan, lock_stepped, &self.reference, &last) {
            self.evaluator.warn(Some(self.numbering.last()), text)?;
        }
        if !self.plan.campaign.objectives.is_empty() {
            self.evaluator.recorder.put_result_set(&ResultSet {
                name: "final".to_owned(),
                generation: None,
                status: Status::Final,
                members: self.front.numbers(),
            })?;
        }
        Ok(reason)
    }

    /// One generation: asked for, run, confirmed, seen by observers, told to the search. `Break` says why there is
    /// no next one.
    fn step(&mut self) -> Result<ControlFlow<String>, Halt> {
        let Some((number, planned)) = self.ahead.pop_front().or_else(|| self.ask()) else {
            let why = self.strategy.ended();
            return Ok(ControlFlow::Break(why.unwrap_or_else(|| "all tests were evaluated".to_owned())));
        };
        self.begin_early(&planned);
        let (mut tests, violating) = self.evaluate(planned)?;
        self.confirm(&mut tests, &violating)?;

        let generation = Generation { number, tests: &tests, front: &self.front, done: self.done };
        let mut end = None;
        for observer in &mut self.observers {
            if let ControlFlow::Break(reason) = observer.generation_ended(generation, self.evaluator.recorder)? {
                end.get_or_insert(reason);
            }
        }
        if let Some(neighbours) = &mut self.neighbours {
            neighbours.average(&mut tests, |number| self.numbering.stands_for(number));
        }
        self.strategy.tell(&tests);
        self.tell(CampaignEvent::GenerationEnded { generation: number });
        Ok(end.map_or(ControlFlow::Continue(()), ControlFlow::Break))
    }

    /// The next generation of the search, with its tests; `None` if the search is over.
    fn ask(&mut self) -> Option<(u32, Vec<PlannedTest>)> {
        let candidates = self.strategy.ask();
        self.evaluator.lists_altered = self.strategy.lists_altered();
        let generation = candidates.first()?.generation;
        Some((generation, candidates.into_iter().map(|candidate| self.numbering.candidate(candidate)).collect()))
    }

    /// Begins with further generations, if their tests do not depend on results, so that no worker waits while the last
    /// tests of a generation end. What is recorded is the same however many tests are begun early.
    fn begin_early(&mut self, planned: &[PlannedTest]) {
        // Fresh runs of a generation would wait for tests of later ones, and what a rule to stop leaves out must not
        // run.
        let may_end = self.observers.iter().any(|observer| observer.may_end());
        if !self.strategy.asks_ahead() || self.confirmed.is_some() || may_end {
            return;
        }
        // Its own tests come first.
        self.evaluator.begin_early(planned);
        let wanted = 2 * self.evaluator.executor.at_once();
        let next = planned.last().map_or(0, |test| test.number + 1);
        while self.evaluator.under_way_from(next) < wanted {
            let Some((generation, planned)) = self.ask() else { break };
            self.evaluator.begin_early(&planned);
            self.ahead.push_back((generation, planned));
        }
    }

    /// Runs the tests of a generation. Returns them in the order of their numbers, and the numbers of those that
    /// violate a requirement.
    fn evaluate(&mut self, planned: Vec<PlannedTest>) -> Result<(Vec<Evaluated>, BTreeSet<u32>), Halt> {
        let plan = self.plan;
        let series = self.strategy.reads_series();
        let (total, earlier) = (self.total, self.earlier);
        let mut tests = Vec::with_capacity(planned.len());
        let mut violating = BTreeSet::new();
        let Campaign { evaluator, observers, confirmed, front, done, listener, .. } = self;
        evaluator.evaluate(planned, &mut |happened| {
            let event = match happened {
                Happened::Ended(_) => None,
                Happened::Told(text) => Some(CampaignEvent::Told { text }),
                Happened::Machines(machines) => Some(CampaignEvent::Machines(machines)),
                Happened::Waits(_) => return,
            };
            if let Some(event) = event {
                let confirmation_runs = confirmed.as_ref().map_or(0, ConfirmedSearch::runs);
                let coverage = coverage(observers);
                return listener(event, Progress { done: *done, total, earlier, confirmation_runs, front, coverage });
            }
            let Happened::Ended(record) = happened else { return };
            let fitness = search::fitness(plan, &record.observation);
            let point = counted_point(plan, record);
            *done += 1;
            front.add(record.number, &fitness);
            for observer in &mut *observers {
                observer.test_ended(EndedTest { record, fitness: &fitness, point: point.as_ref() });
            }
            if let Some(confirmed) = confirmed {
                confirmed.remember(record);
            }
            if reference::violates(plan, &record.observation) {
                violating.insert(record.number);
            }
            tests.push(Evaluated {
                number: record.number,
                test: record.test.clone(),
                fitness,
                point,
                run: Arc::new(if series { record.observation.clone() } else { record.observation.without_series() }),
                fresh_runs: Vec::new(),
            });
            listener(
                CampaignEvent::TestEnded(record),
                Progress {
                    done: *done,
                    total,
                    earlier,
                    confirmation_runs: confirmed.as_ref().map_or(0, ConfirmedSearch::runs),
                    front,
                    coverage: coverage(observers),
                },
            );
        })?;
        tests.sort_by_key(|evaluated| evaluated.number);
        Ok((tests, violating))
    }

    /// Confirms what is to be confirmed of a generation, and puts confirmed values in place of those of single runs.
    fn confirm(&mut self, tests: &mut [Evaluated], violating: &BTreeSet<u32>) -> Result<(), Halt> {
        let Campaign {
            plan, evaluator, observers, confirmed, numbering, front, done, earlier, total, listener, ..
        } = self;
        let Some(confirmed) = confirmed else { return Ok(()) };
        let (done, earlier, total) = (*done, *earlier, *total);
        confirmed.confirm(plan, evaluator, numbering, tests, violating, &mut |confirmation_runs, front| {
            let progress = Progress { done, total, earlier, confirmation_runs, front, coverage: coverage(observers) };
            listener(CampaignEvent::ConfirmationAdvanced, progress);
        })?;
        *front = confirmed.front();
        Ok(())
    }

    fn tell(&mut self, event: CampaignEvent<'_>) {
        let progress = Progress {
            done: self.done,
            total: self.total,
            earlier: self.earlier,
            confirmation_runs: self.confirmed.as_ref().map_or(0, ConfirmedSearch::runs),
            front: &self.front,
            coverage: coverage(&self.observers),
        };
        (self.listener)(event, progress);
    }
}

fn coverage(observers: &[Box<dyn Observer>]) -> Option<&search::coverage::Coverage> {
    observers.iter().find_map(|observer| observer.coverage())
}

/// Performs a reference run: it is a test without operations. `meanwhile` is called several times a second until it
/// ends.
fn reference_run(
    evaluator: &mut Evaluator<'_>,
    numbering: &mut Numbering,
    meanwhile: &mut dyn FnMut(Happened<'_>),
) -> Result<Observation, Halt> {
    let mut shown = None;
    let planned = vec![numbering.reference_run()];
    evaluator.evaluate(planned, &mut |happened| {
        if let Happened::Ended(record) = happened {
            shown = Some(record.observation.clone());
        }
        meanwhile(happened);
    })?;
    Ok(shown.unwrap_or_else(|| unreachable!("each test that is evaluated is shown")))
}

#[cfg(test)]
mod tests;
