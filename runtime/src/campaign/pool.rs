//! The supervisor's side of its workers: starts them, hands out tests, and deals with those that die or hang.
//!
//! A worker that is killed from outside cannot be told from one that its simulator or a hook brought down: the test it
//! ran is a crash. What Ctrl-C sends to all of a terminal's foreground processes does not reach workers, since that
//! would look just the same: the supervisor ends them.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::frames::{self, Hello, Reply};
use super::traced;
use super::worker::{crashed, empty};
use crate::observation::{Observation, Outcome};

pub use super::frames::Job;

/// How long a fresh worker may take to report.
const START_LIMIT: Duration = Duration::from_secs(30);

/// How a pool runs its workers.
#[derive(Debug, Clone)]
pub struct PoolSettings {
    /// How many workers; at least one.
    pub workers: usize,
    /// The program that is a worker when called with `worker ADDRESS`: the runner itself.
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
}

/// Worker processes and the threads that talk to them.
pub struct Pool {
    jobs: Option<mpsc::Sender<Job>>,
    results: mpsc::Receiver<Result<Ended, PoolError>>,
    lanes: Vec<JoinHandle<()>>,
    stop: Arc<AtomicBool>,
    /// Wall time after which a test is stopped, in milliseconds.
    timeout: Arc<AtomicU64>,
}

impl Pool {
    /// Starts the workers.
    pub fn start(settings: &PoolSettings) -> Result<Self, PoolError> {
        let (jobs, queue) = mpsc::channel();
        let queue = Arc::new(Mutex::new(queue));
        let (sender, results) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let timeout = Arc::new(AtomicU64::new(millis(settings.timeout)));
        let mut lanes = Vec::with_capacity(settings.workers);
        for number in 1..=settings.workers.max(1) {
            let (stop, timeout) = (Arc::clone(&stop), Arc::clone(&timeout));
            let mut lane = Lane { number, settings: settings.clone(), worker: None, stop, timeout };
            lane.worker = Some(Worker::start(&lane)?);
            let (queue, sender) = (Arc::clone(&queue), sender.clone());
            lanes.push(thread::spawn(move || lane.work(&queue, &sender)));
        }
        Ok(Pool { jobs: Some(jobs), results, lanes, stop, timeout })
    }

    /// Changes the wall time after which a test is stopped, for tests not begun yet.
    pub fn set_timeout(&self, timeout: Duration) {
        self.timeout.store(millis(timeout), Ordering::Relaxed);
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

    /// Runs a test. If its worker is killed, which no simulator does to itself, the test is run once more: whoever kills
    /// processes, by hand or for want of memory, is to leave no trace in results. Killed again, it is a crash.
    fn run(&mut self, job: &Job) -> Result<Ended, PoolError> {
        let (ended, killed) = self.attempt(job)?;
        if !killed || self.stop.load(Ordering::Relaxed) {
            return Ok(ended);
        }
        let (mut ended, _) = self.attempt(job)?;
        ended.notes.insert(0, "the worker was killed while it ran this test, so the test was run again".to_owned());
        Ok(ended)
    }

    /// Runs a test, and says whether its worker was killed by someone else.
    fn attempt(&mut self, job: &Job) -> Result<(Ended, bool), PoolError> {
        let mut worker = match self.worker.take() {
            Some(worker) => worker,
            None => Worker::start(self)?,
        };
        let printed = fs::metadata(output_file(&self.directory())).map_or(0, |file| file.len());
        let timeout = Duration::from_millis(self.timeout.load(Ordering::Relaxed));
        let mut killed = false;
        let (observation, notes, trace_failure) = match worker.ask(job, timeout, &self.stop) {
            Ok(reply) => {
                self.worker = Some(worker);
                (reply.observation, Vec::new(), reply.trace_failure)
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
                let how = worker.how_it_ended(&error);
                killed = how.as_ref().is_ok_and(|status| was_killed(*status));
                let how = how.map_or_else(|error| error, |status| status.to_string());
                let observation = crashed(format!("the worker process ended: {how}"));
                drop(worker);
                let lost = self.save_trace(job, &observation.outcome);
                let words = last_lines(&output_file(&self.directory()), printed, 10);
                let words = words.map(|words| format!("the worker's last words:\n{words}"));
                (observation, words.into_iter().collect(), lost)
            }
        };
        Ok((Ended { number: job.number, observation, notes, trace_failure }, killed))
    }

    /// Saves what a dead worker wrote of a trace that was asked for; why not, otherwise.
    fn save_trace(&self, job: &Job, outcome: &Outcome) -> Option<String> {
        let order = job.trace.as_ref().filter(|_| !self.stop.load(Ordering::Relaxed))?;
        traced::save(order, &self.directory(), outcome).err()
    }

    fn directory(&self) -> PathBuf {
        self.settings.directory.join(self.number.to_string())
    }

    fn refuse(&self, reason: &impl ToString) -> PoolError {
        PoolError { worker: self.number, reason: reason.to_string() }
    }
}

/// One worker process. Dropping it ends the process.
struct Worker {
    process: Child,
    stream: Option<TcpStream>,
}

impl Worker {
    fn start(lane: &Lane) -> Result<Self, PoolError> {
        let directory = lane.directory();
        let refuse = |reason: io::Error| lane.refuse(&reason);
        fs::create_dir_all(&directory).map_err(refuse)?;
        let output = File::options().create(true).append(true).open(output_file(&directory)).map_err(refuse)?;
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(refuse)?;
        let token = token().map_err(|error| lane.refuse(&error))?;
        let mut command = Command::new(&lane.settings.program);
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let process = command
            .arg("worker")
            .arg(listener.local_addr().map_err(refuse)?.to_string())
            .env("SESAME_WORKER_TOKEN", &token)
            .env("SESAME_WORKER", lane.number.to_string())
            .current_dir(&directory)
            .stdin(Stdio::null())
            .stdout(output.try_clone().map_err(refuse)?)
            .stderr(output)
            .spawn()
            .map_err(|error| lane.refuse(&format!("{}: {error}", lane.settings.program.display())))?;
        let mut worker = Worker { process, stream: None };
        worker.stream = Some(worker.accept(&listener, &token, lane)?);
        Ok(worker)
    }

    /// Waits for the worker's connection. Whoever else connects, without the token, is turned away.
    fn accept(&mut self, listener: &TcpListener, token: &str, lane: &Lane) -> Result<TcpStream, PoolError> {
        let refuse = |error: io::Error| lane.refuse(&error);
        listener.set_nonblocking(true).map_err(refuse)?;
        let started = Instant::now();
        while started.elapsed() < START_LIMIT {
            if let Some(status) = self.process.try_wait().map_err(refuse)? {
                let output = last_lines(&output_file(&lane.directory()), 0, 10);
                let output = output.map_or_else(String::new, |lines| format!("; its last words:\n{lines}"));
                return Err(lane.refuse(&format!("it ended at once, {status}{output}")));
            }
            match listener.accept() {
                Ok((mut stream, _)) => {
                    stream.set_nonblocking(false).map_err(refuse)?;
                    stream.set_nodelay(true).map_err(refuse)?;
                    stream.set_read_timeout(Some(Duration::from_secs(5))).map_err(refuse)?;
                    if frames::receive::<Hello>(&mut stream).is_ok_and(|hello| hello.token == token) {
                        return Ok(stream);
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => thread::sleep(Duration::from_millis(2)),
                Err(error) => return Err(lane.refuse(&error)),
            }
        }
        Err(lane.refuse(&format!("it did not report within {} s", START_LIMIT.as_secs())))
    }

    /// Runs a test. The error is `TimedOut` when it took too long or the pool was told to stop.
    fn ask(&mut self, job: &Job, timeout: Duration, stop: &AtomicBool) -> io::Result<Reply> {
        let stream = self.stream.as_mut().ok_or(io::ErrorKind::NotConnected)?;
        frames::send(stream, job)?;
        let asked = Instant::now();
        // Short waits for the first byte, so that a stop is noticed; then the frame is read in one go.
        stream.set_read_timeout(Some(Duration::from_millis(100)))?;
        loop {
            match stream.peek(&mut [0]) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(_) => break,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    if asked.elapsed() >= timeout || stop.load(Ordering::Relaxed) {
                        return Err(io::ErrorKind::TimedOut.into());
                    }
                }
                Err(error) => return Err(error),
            }
        }
        stream.set_read_timeout(Some(Duration::from_secs(60)))?;
        frames::receive(stream)
    }

    /// The status of a process that broke off the conversation; the error it broke off with if it has not ended.
    fn how_it_ended(&mut self, error: &io::Error) -> Result<ExitStatus, String> {
        let patience = Instant::now();
        while patience.elapsed() < Duration::from_secs(2) {
            match self.process.try_wait() {
                Ok(Some(status)) => return Ok(status),
                Ok(None) => thread::sleep(Duration::from_millis(5)),
                Err(_) => break,
            }
        }
        Err(error.to_string())
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // Closing the connection ends a healthy worker; killing ends one that hangs. Both may already be gone.
        self.stream = None;
        self.process.kill().ok();
        self.process.wait().ok();
    }
}

/// Whether a process was killed, which it cannot be but from outside.
#[cfg(unix)]
fn was_killed(status: ExitStatus) -> bool {
    /// `SIGKILL`, which POSIX numbers.
    const KILL: i32 = 9;
    std::os::unix::process::ExitStatusExt::signal(&status) == Some(KILL)
}

/// Whether a process was killed: its status does not tell here.
#[cfg(not(unix))]
fn was_killed(_: ExitStatus) -> bool {
    false
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

fn token() -> Result<String, getrandom::Error> {
    let high = getrandom::u64()?;
    let low = getrandom::u64()?;
    Ok(format!("{high:016x}{low:016x}"))
}
