//! One of the tests that an agent runs at once: taken out of the queue, run in a worker, and its result put in.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use sesame_base::observation::Outcome;
use sesame_plan::Test;
use sesame_queue::announcement::Announcement;
use sesame_queue::intake::{Decision, Experience, decide};
use sesame_queue::message::{Ended, EndedAs, Work, digest_of};
use sesame_queue::queue::{HERE, Held, PAUSE, Queue, QueueError};
use sesame_queue::token::{Kind, SealError};

use super::{Agent, AgentSettings, lock};
use crate::campaign::executor::{Executor as _, Job, JobResult};
use crate::campaign::pool::{Pool, PoolSettings, Retries};
use crate::campaign::worker_program::WorkerProgram;

/// How long to wait for a test before looking whether the agent is to end.
const WAIT: Duration = Duration::from_millis(500);

/// How much later than its worker an agent may get a signal that is meant for both.
const TOGETHER: Duration = Duration::from_millis(300);

/// The most workers that the agents of a machine have together.
const MOST_WORKERS: usize = 10_000;

/// A lock on this machine, as long as the file lives; `None` if another process has it.
fn claim(path: &Path) -> std::io::Result<Option<File>> {
    let lock = File::options().create(true).truncate(false).write(true).open(path)?;
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(fs::TryLockError::WouldBlock) => Ok(None),
        Err(fs::TryLockError::Error(error)) => Err(error),
    }
}

/// A number that no worker of another agent of this machine has as long as the file lives: what tells the ports and
/// domains of workers apart follows from it.
fn claim_number(shared: &Path) -> std::io::Result<(usize, File)> {
    for number in 1..=MOST_WORKERS {
        if let Some(lock) = claim(&shared.join(format!("worker-{number}.lock")))? {
            return Ok((number, lock));
        }
    }
    Err(std::io::Error::other(format!("{MOST_WORKERS} workers of agents work on this machine already")))
}

/// One test after another, in one worker.
pub(super) struct Slot<'a> {
    pub(super) agent: &'a Agent<'a>,
    pub(super) announcement: &'a Announcement,
    pub(super) edition: &'a str,
    pub(super) program: &'a WorkerProgram,
    pub(super) worker: u32,
    /// The worker, and what holds its number.
    pub(super) pool: Option<(Pool, File)>,
    pub(super) experience: &'a Mutex<Experience>,
    pub(super) leaves: &'a AtomicBool,
}

impl Slot<'_> {
    fn leaves(&self) -> bool {
        self.leaves.load(Ordering::Relaxed) || self.agent.stops()
    }

    /// Takes and runs tests until the agent leaves the campaign.
    pub(super) fn work(&mut self) {
        // Of all agents of this machine, one at a time may run tests that would disturb each other.
        let mut alone = None;
        let queue = &self.agent.settings.queue;
        while !self.leaves() {
            if self.announcement.program.one_at_a_time && alone.is_none() {
                alone = claim(&self.agent.settings.shared.join("alone.lock")).ok().flatten();
                if alone.is_none() {
                    thread::sleep(PAUSE);
                    continue;
                }
            }
            match queue.take_test(&self.announcement.campaign, WAIT) {
                Ok(Some(held)) => {
                    self.agent.busy.fetch_add(1, Ordering::Relaxed);
                    self.deal_with(held);
                    *lock(&self.agent.worked) = Instant::now();
                    self.agent.busy.fetch_sub(1, Ordering::Relaxed);
                }
                Ok(None) => {}
                Err(_) => thread::sleep(PAUSE),
            }
        }
    }

    fn deal_with(&mut self, held: Box<dyn Held>) {
        let AgentSettings { token, name, .. } = self.agent.settings;
        let work = match token.open::<Work>(Kind::Work, &self.announcement.campaign, held.test()) {
            Ok(work) => work,
            Err(SealError::OtherToken) => {
                // Nobody who has the token put it in.
                held.finish().ok();
                return;
            }
            // Of another version: somebody else reads it.
            Err(SealError::Unreadable(_)) => return,
        };
        let outcome = if work.edition == self.edition {
            match decide(name, &work, held.deliveries()) {
                Decision::LeaveToOthers(rest) => {
                    self.rest(rest);
                    None
                }
                Decision::Poison { lost } => Some(EndedAs::Poison { lost }),
                Decision::Run => self.run(&work),
            }
        } else {
            // The campaign has other files by now; this agent will hear of it soon.
            self.rest(HERE);
            None
        };
        match outcome {
            Some(outcome) => self.conclude(held, &work, outcome),
            None => self.put_back(held, work),
        }
    }

    /// Waits for this long, or until the agent is to end.
    fn rest(&self, rest: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < rest && !self.leaves() {
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Puts what came of a test into the queue, and holds the test until that is done.
    fn conclude(&self, held: Box<dyn Held>, work: &Work, outcome: EndedAs) {
        let AgentSettings { token, name, .. } = self.agent.settings;
        let Work { number, attempt, .. } = *work;
        let ended = Ended { number, attempt, job: work.digest(), agent: name.clone(), outcome };
        let ran = matches!(ended.outcome, EndedAs::Ran { .. });
        let sealed = token.seal(Kind::Ended, &self.announcement.campaign, &ended);
        if self.insist(|queue| queue.put_result(&self.announcement.campaign, &sealed)).is_some() {
            self.agent.finished.fetch_add(u64::from(ran), Ordering::Relaxed);
            held.finish().ok();
        }
    }

    /// Puts a test back for others. If that cannot be done now, it is lost with this agent, and delivered to others
    /// too.
    fn put_back(&self, held: Box<dyn Held>, work: Work) {
        let AgentSettings { token, queue, .. } = self.agent.settings;
        let campaign = &self.announcement.campaign;
        let work = Work { put_back: work.put_back + 1, ..work };
        if queue.put_test(campaign, &token.seal(Kind::Work, campaign, &work)).is_ok() {
            held.finish().ok();
        }
    }

    /// Does what is asked of the queue as soon as it can be reached; `None` if the agent ends before.
    fn insist<T>(&self, mut call: impl FnMut(&dyn Queue) -> Result<T, QueueError>) -> Option<T> {
        loop {
            match call(&*self.agent.settings.queue) {
                Ok(done) => return Some(done),
                Err(QueueError::Unreachable { .. }) if !self.leaves() => thread::sleep(PAUSE),
                Err(_) => return None,
            }
        }
    }

    /// Runs a test; `None` if the agent is to end before.
    fn run(&mut self, work: &Work) -> Option<EndedAs> {
        let job: Job = match serde_json::from_str(work.job.get()) {
            Ok(job) => job,
            Err(error) => return Some(EndedAs::NotRun { reason: format!("the job cannot be read: {error}") }),
        };
        match self.try_run(work, job) {
            Ok(outcome) => outcome,
            Err(reason) => {
                self.pool = None;
                Some(EndedAs::NotRun { reason })
            }
        }
    }

    fn try_run(&mut self, work: &Work, mut job: Job) -> Result<Option<EndedAs>, String> {
        let trace = self.folder().join("trace.mcap");
        if let Some(request) = &mut job.trace {
            fs::create_dir_all(self.folder()).map_err(|error| error.to_string())?;
            request.file.clone_from(&trace);
        }
        let timeout = lock(self.experience).timeout(work.limit);
        let Some(mut result) = self.perform(job.clone(), timeout)? else { return Ok(None) };
        if result.observation.outcome.is_whole() {
            lock(self.experience).succeeded();
        } else {
            let timed_out = matches!(result.observation.outcome, Outcome::Timeout { .. });
            if lock(self.experience).doubts(timed_out, work.limit) {
                if !self.can_run(&job, 2 * timeout)? {
                    return Ok(None);
                }
                let longer = lock(self.experience).timeout(work.limit);
                if timed_out && longer > timeout {
                    let Some(again) = self.perform(job, longer)? else { return Ok(None) };
                    result = again;
                }
            }
        }
        let outcome = &result.observation.outcome;
        let fault = outcome.is_of_environment().then(|| outcome.message().unwrap_or_default().to_owned());
        let recorded = if work.records { self.recorded(&trace)? } else { None };
        let result = serde_json::value::to_raw_value(&result).map_err(|error| error.to_string())?;
        Ok(Some(EndedAs::Ran { result, fault, recorded }))
    }

    /// Whether this machine runs the campaign without disturbance, as far as it is to end before; how long that takes
    /// is remembered. The error says why it does not.
    fn can_run(&mut self, job: &Job, timeout: Duration) -> Result<bool, String> {
        // Nothing that is undisturbed should take longer, however slow the machine is.
        let undisturbed = Job { test: Test::default(), trace: None, ..job.clone() };
        let Some(own) = self.perform(undisturbed, timeout)? else { return Ok(false) };
        let outcome = &own.observation.outcome;
        if !outcome.is_whole() {
            let why = outcome.detail().unwrap_or_default();
            return Err(format!("without disturbance the campaign does not run here: {why}"));
        }
        lock(self.experience).measured(Duration::from_secs_f64(own.observation.wall.run));
        Ok(true)
    }

    /// Puts the trace of a test into the queue, if it was kept.
    fn recorded(&self, trace: &Path) -> Result<Option<String>, String> {
        let content = match fs::read(trace) {
            Ok(content) => content,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(format!("{}: {error}", trace.display())),
        };
        fs::remove_file(trace).map_err(|error| format!("{}: {error}", trace.display()))?;
        let hash = digest_of(&content);
        let put = self.insist(|queue| queue.put_file(&self.announcement.campaign, &hash, &content));
        put.map(|()| Some(hash)).ok_or_else(|| "the campaign has ended".to_owned())
    }

    fn folder(&self) -> PathBuf {
        self.agent.settings.folder.join(&self.announcement.campaign).join("workers").join(self.worker.to_string())
    }

    /// Runs a job in this slot's worker. The error says why there is no worker.
    fn perform(&mut self, job: Job, timeout: Duration) -> Result<Option<JobResult>, String> {
        if self.pool.is_none() {
            let (number, lock) = claim_number(&self.agent.settings.shared).map_err(|error| error.to_string())?;
            let settings = PoolSettings {
                workers: 1,
                first: number,
                program: self.program.clone(),
                directory: self.agent.settings.folder.join(&self.announcement.campaign).join("workers"),
                timeout,
                retries: Retries::Elsewhere,
            };
            self.pool = Some((Pool::start(&settings).map_err(|error| error.to_string())?, lock));
        }
        let (pool, _) = self.pool.as_mut().expect("it was started");
        pool.set_timeout(timeout, timeout);
        pool.submit(job);
        while !self.agent.stops() {
            if let Some(result) = pool.next(Duration::from_millis(20)).map_err(|error| error.to_string())? {
                if !result.observation.outcome.is_whole() {
                    // Who ends this agent may have ended its worker first.
                    self.agent.await_stop(TOGETHER);
                }
                return Ok(Some(result).filter(|_| !self.agent.stops()));
            }
        }
        Ok(None)
    }
}
