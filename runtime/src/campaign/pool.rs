//! The supervisor's side of its workers: starts them, hands out tests, and deals with those that die or hang.
//!
//! A worker that dies of something else than `SIGKILL` was brought down by its simulator or a hook: the test it ran is
//! a crash. One that was killed is another matter, and so is a simulator that was: the test is run again. What Ctrl-C
//! sends to all of a terminal's foreground processes does not reach workers, since that would look like a crash: the
//! supervisor ends them.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use sesame_base::observation::{Observation, Outcome};
use sesame_lifecycle::process_group::was_killed;

use crate::campaign::executor::{Executor, ExecutorError, Job, JobResult};
use crate::campaign::link::{self, Stream};
use crate::campaign::protocol::{self, Hello, Reply, Said};
use crate::campaign::traces;
use crate::campaign::worker_process::{WORKER, WorkerProcess};
use crate::campaign::worker_program::WorkerProgram;

/// How long a fresh worker may take to report.
const START_LIMIT: Duration = Duration::from_secs(30);

/// How long a worker that broke off the conversation may take to end.
const DEATH_LIMIT: Duration = Duration::from_secs(2);

/// Where a test is run again that the environment broke off: a failed launch, a lost connection, a clock that went back
/// say nothing about the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retries {
    /// Here, twice at most.
    Here,
    /// On another machine, by the caller.
    Elsewhere,
}

impl Retries {
    fn here(self) -> usize {
        match self {
            Retries::Here => 2,
            Retries::Elsewhere => 0,
        }
    }
}

/// How a pool runs its workers.
#[derive(Debug, Clone)]
pub struct PoolSettings {
    /// How many workers; at least one.
    pub workers: usize,
    /// The number of the first one, from 1: others of this machine may have the numbers before.
    pub first: usize,
    /// What is started as each worker: the runner itself.
    pub program: WorkerProgram,
    /// Folder in which each worker gets a folder of its own.
    pub directory: PathBuf,
    /// Wall time after which a test is stopped and its worker replaced.
    pub timeout: Duration,
    /// Where tests are run again that the environment broke off.
    pub retries: Retries,
}

/// Worker processes and the threads that talk to them.
pub struct Pool {
    jobs: Option<mpsc::Sender<Job>>,
    results: mpsc::Receiver<Result<JobResult, ExecutorError>>,
    slots: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
    /// Wall time after which a test is stopped, in milliseconds.
    timeout: Arc<AtomicU64>,
    lock_stepped: bool,
    /// What the start of a worker's system waits for, if one said so.
    waits: Arc<Mutex<Option<String>>>,
}

impl Pool {
    /// Starts the workers.
    pub fn start(settings: &PoolSettings) -> Result<Self, ExecutorError> {
        let (jobs, queue) = mpsc::channel();
        let queue = Arc::new(Mutex::new(queue));
        let (sender, results) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let timeout = Arc::new(AtomicU64::new(millis(settings.timeout)));
        // Dropped if a worker cannot be started, which ends those that were.
        let waits = Arc::default();
        let mut pool = Pool { jobs: Some(jobs), results, slots: Vec::new(), stop, timeout, lock_stepped: true, waits };
        for number in (settings.first..).take(settings.workers.max(1)) {
            let (stop, timeout) = (Arc::clone(&pool.stop), Arc::clone(&pool.timeout));
            let waits = Arc::clone(&pool.waits);
            let mut slot = WorkerSlot { number, settings: settings.clone(), worker: None, stop, timeout, waits };
            let worker = slot.start()?;
            pool.lock_stepped &= worker.lock_stepped;
            slot.worker = Some(worker);
            let (queue, sender) = (Arc::clone(&queue), sender.clone());
            pool.slots.push(thread::spawn(move || slot.work(&queue, &sender)));
        }
        Ok(pool)
    }
}

impl Executor for Pool {
    fn submit(&mut self, job: Job) {
        let sent = self.jobs.as_ref().is_some_and(|jobs| jobs.send(job).is_ok());
        assert!(sent, "slots live as long as their pool");
    }

    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError> {
        self.results.recv_timeout(wait).map_or(Ok(None), |result| result.map(Some))
    }

    fn set_timeout(&mut self, timeout: Duration, _reference: Duration) {
        self.timeout.store(millis(timeout), Ordering::Relaxed);
    }

    fn lock_stepped(&self) -> bool {
        self.lock_stepped
    }

    fn at_once(&self) -> usize {
        self.slots.len()
    }

    fn waits(&self) -> Option<String> {
        self.waits.lock().ok()?.clone()
    }
}

impl Drop for Pool {
    /// Stops the workers, also while they run tests.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.jobs = None;
        for slot in self.slots.drain(..) {
            // A slot that panicked has nothing left to stop: its worker was ended when it unwound.
            slot.join().ok();
        }
    }
}

/// One worker process after another, and the thread that feeds them.
struct WorkerSlot {
    number: usize,
    settings: PoolSettings,
    worker: Option<Worker>,
    stop: Arc<AtomicBool>,
    timeout: Arc<AtomicU64>,
    waits: Arc<Mutex<Option<String>>>,
}

impl WorkerSlot {
    fn work(mut self, queue: &Mutex<mpsc::Receiver<Job>>, results: &mpsc::Sender<Result<JobResult, ExecutorError>>) {
        loop {
            let job = match queue.lock() {
                Ok(queue) => queue.recv(),
                Err(_) => return,
            };
            let Ok(job) = job else { return };
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
            if results.send(self.run(&job)).is_err() {
                return;
            }
        }
    }

    /// Starts a worker. One that is killed meanwhile is started once more, as it would be while it runs a test.
    fn start(&self) -> Result<Worker, ExecutorError> {
        match Worker::start(self) {
            Err(NotStarted { killed: true, .. }) if !self.stop.load(Ordering::Relaxed) => Worker::start(self),
            started => started,
        }
        .map_err(|NotStarted { reason, .. }| ExecutorError::Worker { worker: self.number, reason })
    }

    /// Starts the process of a worker in a folder of its own.
    fn begin(&self, directory: &Path, output: File) -> io::Result<(link::Offer, WorkerProcess)> {
        let program = &self.settings.program;
        let mut command = program.command(directory)?;
        #[cfg(target_os = "linux")]
        if let Some(server) = program.forks() {
            let (offer, input) = link::pair()?;
            let forked = server.fork(&command, directory, self.number, &input, &output)?;
            return Ok((offer, WorkerProcess::forked(forked)));
        }
        let offer = link::offer(&mut command)?;
        command.env(WORKER, self.number.to_string()).current_dir(directory).stdout(output.try_clone()?).stderr(output);
        let process = WorkerProcess::start(command)
            .map_err(|error| io::Error::other(format!("{}: {error}", program.executable().display())))?;
        Ok((offer, process))
    }

    /// Runs a test. If the environment breaks it off, the test is run again, as often as [`Retries`] says; what
    /// happened then is its outcome.
    fn run(&mut self, job: &Job) -> Result<JobResult, ExecutorError> {
        let mut notes = Vec::new();
        for _ in 0..self.settings.retries.here() {
            let mut ended = self.run_unless_killed(job)?;
            notes.append(&mut ended.notes);
            let outcome = &ended.observation.outcome;
            if !outcome.is_of_environment() || self.stop.load(Ordering::Relaxed) {
                return Ok(JobResult { notes, ..ended });
            }
            let cause = outcome.message().unwrap_or_default();
            notes.push(format!("the environment broke off this test, so the test was run again: {cause}"));
        }
        let mut ended = self.run_unless_killed(job)?;
        notes.append(&mut ended.notes);
        Ok(JobResult { notes, ..ended })
    }

    /// Runs a test. If its worker or its simulator is killed, the test is run once more: a process killed by hand, or
    /// because memory is short, must leave no trace in results. If it is killed again, the test is a crash that says
    /// so.
    fn run_unless_killed(&mut self, job: &Job) -> Result<JobResult, ExecutorError> {
        let (ended, victim) = self.attempt(job)?;
        let Some(victim) = victim.filter(|_| !self.stop.load(Ordering::Relaxed)) else { return Ok(ended) };
        let (mut ended, again) = self.attempt(job)?;
        ended.notes.insert(0, format!("the {victim} was killed while it ran this test, so the test was run again"));
        if again.is_some() {
            ended.killed = true;
            if let Outcome::Crash { message } | Outcome::LaunchFailed { message } = &mut ended.observation.outcome {
                *message = format!("killed twice, by a user or by the system because memory was short: {message}");
            }
        }
        Ok(ended)
    }

    /// Runs a test, and says which process was killed by someone else, if one was.
    fn attempt(&mut self, job: &Job) -> Result<(JobResult, Option<&'static str>), ExecutorError> {
        let mut worker = match self.worker.take() {
            Some(worker) => worker,
            None => self.start()?,
        };
        let lock_stepped = worker.lock_stepped;
        let printed = fs::metadata(output_file(&self.directory())).map_or(0, |file| file.len());
        let timeout = Duration::from_millis(self.timeout.load(Ordering::Relaxed));
        let mut killed = None;
        let mut added = Vec::new();
        let listener = Arc::clone(&self.waits);
        let waits = |missing| {
            if let Ok(mut of_pool) = listener.lock() {
                *of_pool = missing;
            }
        };
        let answer = worker.ask(job, timeout, &self.stop, &mut |missing| waits(Some(missing)));
        waits(None);
        let (observation, notes, trace_failure) = match answer {
            Ok(reply) => {
                self.worker = Some(worker);
                added = reply.added;
                killed = reply.incidents.killed.then_some("simulator");
                (reply.observation, reply.incidents.notes, reply.trace_failure)
            }
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                let outcome = Outcome::Timeout { limit: timeout.as_secs_f64() };
                // Only of a worker that is gone is it known that it writes no more.
                drop(worker);
                let lost = self.save_trace(job, &outcome);
                (Observation::without_run(outcome), Vec::new(), lost)
            }
            Err(error) => {
                // Only what is the same in every session: the cause is part of the digest.
                let status = worker.process.wait(DEATH_LIMIT);
                killed = status.is_some_and(was_killed).then_some("worker");
                let how = status.map_or_else(|| error.to_string(), |status| status.to_string());
                let observation = Observation::crashed(format!("the worker process ended: {how}"));
                drop(worker);
                let lost = self.save_trace(job, &observation.outcome);
                let words = last_lines(&output_file(&self.directory()), printed, 10);
                let words = words.map(|words| format!("the last lines that the worker printed:\n{words}"));
                (observation, words.into_iter().collect(), lost)
            }
        };
        let number = job.number;
        Ok((
            JobResult { number, observation, notes, added, trace_failure, killed: false, lock_stepped, machine: None },
            killed,
        ))
    }

    /// Saves what a dead worker wrote of a trace that was asked for; why not, otherwise.
    fn save_trace(&self, job: &Job, outcome: &Outcome) -> Option<String> {
        let request = job.trace.as_ref().filter(|_| !self.stop.load(Ordering::Relaxed))?;
        traces::save(request, &self.directory(), outcome).err()
    }

    fn directory(&self) -> PathBuf {
        self.settings.directory.join(self.number.to_string())
    }
}

/// A worker and the connection to it. Dropping it ends the worker with everything that it started.
struct Worker {
    /// Closed before the process is waited for: that is its sign to end.
    stream: Stream,
    process: WorkerProcess,
    lock_stepped: bool,
}

/// Why a worker could not be started.
struct NotStarted {
    reason: String,
    /// Whether it was killed.
    killed: bool,
}

impl From<io::Error> for NotStarted {
    fn from(error: io::Error) -> Self {
        NotStarted { reason: error.to_string(), killed: false }
    }
}

impl Worker {
    fn start(slot: &WorkerSlot) -> Result<Self, NotStarted> {
        let directory = slot.directory();
        fs::create_dir_all(&directory)?;
        let output = File::options().create(true).append(true).open(output_file(&directory))?;
        let (offer, mut process) = slot.begin(&directory, output)?;
        let taken = offer.taken(START_LIMIT, &mut || {
            if slot.stop.load(Ordering::Relaxed) {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the run was stopped"));
            }
            if process.ended().is_some() { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(()) }
        });
        match taken {
            Ok((stream, Hello { lock_stepped, end_limit, .. })) => {
                process.extend_end_limit(end_limit);
                Ok(Worker { stream, process, lock_stepped })
            }
            Err(error) if error.kind() == io::ErrorKind::TimedOut => Err(error.into()),
            // It closed the connection, so it is about to end: how says more.
            Err(error) => Err(process.wait(DEATH_LIMIT).map_or_else(
                || error.into(),
                |status| {
                    let output = last_lines(&output_file(&directory), 0, 10);
                    let output =
                        output.map_or_else(String::new, |lines| format!("; the last lines that it printed:\n{lines}"));
                    NotStarted { reason: format!("it ended at once, {status}{output}"), killed: was_killed(status) }
                },
            )),
        }
    }

    /// Runs a test; `waits` gets what the start of the system waits for meanwhile. The error is `TimedOut` when it took
    /// too long or the pool was told to stop.
    fn ask(
        &mut self,
        job: &Job,
        timeout: Duration,
        stop: &AtomicBool,
        waits: &mut dyn FnMut(String),
    ) -> io::Result<Reply> {
        protocol::send(&mut self.stream, job)?;
        let asked = Instant::now();
        loop {
            match self.hear(asked, timeout, stop)? {
                Said::Waits(missing) => waits(missing),
                Said::Reply(reply) => return Ok(*reply),
            }
        }
    }

    fn hear(&mut self, asked: Instant, timeout: Duration, stop: &AtomicBool) -> io::Result<Said> {
        let stream = &mut self.stream;
        // Short waits for the first byte, so that a stop is noticed; then the frame is read in one go.
        stream.set_read_timeout(Some(Duration::from_millis(100)))?;
        let mut first = [0];
        loop {
            match stream.read(&mut first) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(_) => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    if asked.elapsed() >= timeout || stop.load(Ordering::Relaxed) {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                }
                Err(error) => return Err(error),
            }
        }
        stream.set_read_timeout(Some(Duration::from_secs(60)))?;
        protocol::receive(&mut first.chain(stream))
    }
}

fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

fn output_file(directory: &Path) -> PathBuf {
    directory.join("output.log")
}

/// The last lines of what a worker printed from this byte of its output on; `None` when that is nothing.
fn last_lines(path: &Path, from: u64, count: usize) -> Option<String> {
    let read = || -> io::Result<String> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(4096).max(from)))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    let text = read().unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    let tail = lines[lines.len().saturating_sub(count)..].join("\n");
    (!tail.trim().is_empty()).then_some(tail)
}
