//! The supervisor's side of its workers: starts them, hands out tests, and deals with those that die or hang.
//!
//! A worker that dies of something else than `SIGKILL` was brought down by its simulator or a hook: the test it ran is a
//! crash. One that was killed is another matter, and so is a simulator that was: the test is run again. What Ctrl-C sends to
//! all of a terminal's foreground processes does not reach workers, since that would look like a crash: the supervisor
//! ends them.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use sesame_base::observation::{Observation, Outcome};
use sesame_relay::lifecycle::process_group::was_killed;

use crate::campaign::link::{self, Stream};
use crate::campaign::protocol::{self, Hello, Reply};
use crate::campaign::traces;
use crate::campaign::worker::{crashed, empty};
use crate::campaign::worker_process::WorkerProcess;

pub use crate::campaign::protocol::Job;

/// How long a fresh worker may take to report.
const START_LIMIT: Duration = Duration::from_secs(30);

/// How long a worker that broke off the conversation may take to end.
const DEATH_LIMIT: Duration = Duration::from_secs(2);

/// The environment variable with a worker's number, which all that a worker starts inherits.
pub(super) const WORKER: &str = "SESAME_WORKER";

/// How a pool runs its workers.
#[derive(Debug, Clone)]
pub struct PoolSettings {
    /// How many workers; at least one.
    pub workers: usize,
    /// The program that is a worker when called with `worker`: the runner itself.
    pub program: PathBuf,
    /// Folder in which each worker gets a folder of its own.
    pub directory: PathBuf,
    /// Wall time after which a test is stopped and its worker replaced.
    pub timeout: Duration,
}

/// A worker that cannot be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start worker {worker}: {reason}")]
pub struct PoolError {
    /// Which one, from 1.
    pub worker: usize,
    /// Why.
    pub reason: String,
}

/// A test that has ended.
#[derive(Debug)]
pub struct Ended {
    /// Its number.
    pub number: u32,
    /// What its run showed.
    pub observation: Observation,
    /// What befell its worker: that it was killed and the test run again, what it printed last before it died. Of this
    /// one session: it may hold process numbers.
    pub notes: Vec<String>,
    /// Why the trace that was asked for could not be written: the result must not be recorded without it.
    pub trace_failure: Option<String>,
    /// Whether its worker or its simulator was killed, and again when it was run once more. The observation says so; it
    /// may say nothing of the test, but only of this machine today.
    pub killed: bool,
    /// Whether its simulator is stepped, so that running the test again gives the same result.
    pub lock_stepped: bool,
}

/// Worker processes and the threads that talk to them.
pub struct Pool {
    jobs: Option<mpsc::Sender<Job>>,
    results: mpsc::Receiver<Result<Ended, PoolError>>,
    lanes: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
    /// Wall time after which a test is stopped, in milliseconds.
    timeout: Arc<AtomicU64>,
    lock_stepped: bool,
}

impl Pool {
    /// Starts the workers.
    pub fn start(settings: &PoolSettings) -> Result<Self, PoolError> {
        let (jobs, queue) = mpsc::channel();
        let queue = Arc::new(Mutex::new(queue));
        let (sender, results) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let timeout = Arc::new(AtomicU64::new(millis(settings.timeout)));
        // Dropped if a worker cannot be started, which ends those that were.
        let mut pool = Pool { jobs: Some(jobs), results, lanes: Vec::new(), stop, timeout, lock_stepped: true };
        for number in 1..=settings.workers.max(1) {
            let (stop, timeout) = (Arc::clone(&pool.stop), Arc::clone(&pool.timeout));
            let mut lane = Lane { number, settings: settings.clone(), worker: None, stop, timeout };
            let worker = lane.start()?;
            pool.lock_stepped &= worker.lock_stepped;
            lane.worker = Some(worker);
            let (queue, sender) = (Arc::clone(&queue), sender.clone());
            pool.lanes.push(thread::spawn(move || lane.work(&queue, &sender)));
        }
        Ok(pool)
    }

    /// Changes the wall time after which a test is stopped, for tests not begun yet.
    pub fn set_timeout(&self, timeout: Duration) {
        self.timeout.store(millis(timeout), Ordering::Relaxed);
    }

    /// Whether the simulators are stepped, so that equal tests give equal results.
    pub fn lock_stepped(&self) -> bool {
        self.lock_stepped
    }

    /// Hands out a test.
    pub fn submit(&self, job: Job) {
        let sent = self.jobs.as_ref().is_some_and(|jobs| jobs.send(job).is_ok());
        assert!(sent, "lanes live as long as their pool");
    }

    /// The next test that ended; `None` after `wait` without one.
    pub fn next(&self, wait: Duration) -> Result<Option<Ended>, PoolError> {
        self.results.recv_timeout(wait).map_or(Ok(None), |result| result.map(Some))
    }
}

impl Drop for Pool {
    /// Stops the workers, whatever they do.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.jobs = None;
        for lane in self.lanes.drain(..) {
            // A lane that panicked has nothing left to stop: its worker was ended when it unwound.
            lane.join().ok();
        }
    }
}

/// One worker process after another, and the thread that feeds them.
struct Lane {
    number: usize,
    settings: PoolSettings,
    worker: Option<Worker>,
    stop: Arc<AtomicBool>,
    timeout: Arc<AtomicU64>,
}

impl Lane {
    fn work(mut self, queue: &Mutex<mpsc::Receiver<Job>>, results: &mpsc::Sender<Result<Ended, PoolError>>) {
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
    fn start(&self) -> Result<Worker, PoolError> {
        match Worker::start(self) {
            Err(NotStarted { killed: true, .. }) if !self.stop.load(Ordering::Relaxed) => Worker::start(self),
            started => started,
        }
        .map_err(|NotStarted { reason, .. }| PoolError { worker: self.number, reason })
    }

    /// Runs a test. If its worker or its simulator is killed, the test is run once more: whoever kills processes, by hand
    /// or for want of memory, is to leave no trace in results. Killed again, it is a crash that says so.
    fn run(&mut self, job: &Job) -> Result<Ended, PoolError> {
        let (ended, victim) = self.attempt(job)?;
        let Some(victim) = victim.filter(|_| !self.stop.load(Ordering::Relaxed)) else { return Ok(ended) };
        let (mut ended, again) = self.attempt(job)?;
        ended.notes.insert(0, format!("the {victim} was killed while it ran this test, so the test was run again"));
        if again.is_some() {
            ended.killed = true;
            if let Outcome::Crash { message } = &mut ended.observation.outcome {
                *message = format!("killed twice, by somebody or by the system for want of memory: {message}");
            }
        }
        Ok(ended)
    }

    /// Runs a test, and says which process was killed by someone else, if one was.
    fn attempt(&mut self, job: &Job) -> Result<(Ended, Option<&'static str>), PoolError> {
        let mut worker = match self.worker.take() {
            Some(worker) => worker,
            None => self.start()?,
        };
        let lock_stepped = worker.lock_stepped;
        let printed = fs::metadata(output_file(&self.directory())).map_or(0, |file| file.len());
        let timeout = Duration::from_millis(self.timeout.load(Ordering::Relaxed));
        let mut killed = None;
        let (observation, notes, trace_failure) = match worker.ask(job, timeout, &self.stop) {
            Ok(reply) => {
                self.worker = Some(worker);
                killed = reply.incidents.killed.then_some("simulator");
                (reply.observation, reply.incidents.notes, reply.trace_failure)
            }
            Err(error) if error.kind() == io::ErrorKind::TimedOut => {
                let outcome = Outcome::Timeout { limit: timeout.as_secs_f64() };
                // Only of a worker that is gone is it known that it writes no more.
                drop(worker);
                let lost = self.save_trace(job, &outcome);
                (empty(outcome), Vec::new(), lost)
            }
            Err(error) => {
                // Only what is the same in every session: the cause is part of the digest.
                let status = worker.process.wait(DEATH_LIMIT);
                killed = status.is_some_and(was_killed).then_some("worker");
                let how = status.map_or_else(|| error.to_string(), |status| status.to_string());
                let observation = crashed(format!("the worker process ended: {how}"));
                drop(worker);
                let lost = self.save_trace(job, &observation.outcome);
                let words = last_lines(&output_file(&self.directory()), printed, 10);
                let words = words.map(|words| format!("the worker's last words:\n{words}"));
                (observation, words.into_iter().collect(), lost)
            }
        };
        Ok((Ended { number: job.number, observation, notes, trace_failure, killed: false, lock_stepped }, killed))
    }

    /// Saves what a dead worker wrote of a trace that was asked for; why not, otherwise.
    fn save_trace(&self, job: &Job, outcome: &Outcome) -> Option<String> {
        let order = job.trace.as_ref().filter(|_| !self.stop.load(Ordering::Relaxed))?;
        traces::save(order, &self.directory(), outcome).err()
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
    fn start(lane: &Lane) -> Result<Self, NotStarted> {
        let directory = lane.directory();
        fs::create_dir_all(&directory)?;
        let output = File::options().create(true).append(true).open(output_file(&directory))?;
        let mut command = Command::new(&lane.settings.program);
        let offer = link::offer(&mut command)?;
        command.env(WORKER, lane.number.to_string()).current_dir(&directory).stdout(output.try_clone()?).stderr(output);
        let mut process = WorkerProcess::start(command)
            .map_err(|error| io::Error::other(format!("{}: {error}", lane.settings.program.display())))?;
        let taken = offer.taken(START_LIMIT, &mut || {
            if lane.stop.load(Ordering::Relaxed) {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "the run was stopped"));
            }
            if process.ended().is_some() { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(()) }
        });
        match taken {
            Ok((stream, Hello { lock_stepped, .. })) => Ok(Worker { stream, process, lock_stepped }),
            Err(error) if error.kind() == io::ErrorKind::TimedOut => Err(error.into()),
            // It closed the connection, so it is about to end: how says more.
            Err(error) => Err(process.wait(DEATH_LIMIT).map_or_else(
                || error.into(),
                |status| {
                    let output = last_lines(&output_file(&directory), 0, 10);
                    let output = output.map_or_else(String::new, |lines| format!("; its last words:\n{lines}"));
                    NotStarted { reason: format!("it ended at once, {status}{output}"), killed: was_killed(status) }
                },
            )),
        }
    }

    /// Runs a test. The error is `TimedOut` when it took too long or the pool was told to stop.
    fn ask(&mut self, job: &Job, timeout: Duration, stop: &AtomicBool) -> io::Result<Reply> {
        let stream = &mut self.stream;
        protocol::send(stream, job)?;
        let asked = Instant::now();
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
