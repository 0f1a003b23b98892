//! Where tests run: the seam between a campaign and what carries out its tests.
//!
//! Tests are independent of each other, and results depend neither on the order in which they end nor on where they
//! ran. So an executor may be [processes of this machine](crate::campaign::pool), or machines far away.

use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use sesame_base::observation::Observation;
use sesame_plan::{Compensation, MonitorId, Recorded, Test};
use sesame_relay::transport::relay_latency::AddedOnWire;

/// Carries out tests, in any order.
pub trait Executor {
    /// Takes a test. It is run as soon as there is room for it.
    fn submit(&mut self, job: Job);

    /// The next test that has ended; `None` if none ends within `wait`.
    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError>;

    /// Changes the wall time after which a test is stopped, for tests that have not begun yet. A machine on which a run
    /// like the reference run takes longer than `reference` may give its tests more time.
    fn set_timeout(&mut self, timeout: Duration, reference: Duration);

    /// Whether the simulators are stepped, so that equal tests give equal results.
    fn lock_stepped(&self) -> bool;

    /// How many tests run at the same time, as far as is known now; at least one.
    fn at_once(&self) -> usize;

    /// What the start of a system waits for, if it takes long, in a sentence.
    fn waits(&self) -> Option<String> {
        None
    }

    /// The machines on which tests run; `None` if that is this one.
    fn machines(&self) -> Option<Machines> {
        None
    }

    /// What has happened to machines since this was last asked, in sentences.
    fn news(&mut self) -> Vec<String> {
        Vec::new()
    }
}

/// How busy machines are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machines {
    /// How many there are.
    pub machines: usize,
    /// How many tests they run at once.
    pub workers: usize,
    /// How many they run now.
    pub busy: usize,
    /// How many tests wait for a machine.
    pub waiting: usize,
}

/// A test to be run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Job {
    /// A number that no other job of the executor has at the same time; it comes back with the result.
    pub number: u32,
    /// The test.
    pub test: Test,
    /// Seed of the simulator's own randomness.
    pub simulator_seed: u64,
    /// The trace that is asked for, if any.
    pub trace: Option<TraceRequest>,
    /// What brings the simulation closer to a lab in this run, in place of what the worker's plan says.
    pub compensation: Option<Compensation>,
    /// Monitors whose mitigation is not sent in this run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub withheld: Vec<MonitorId>,
    /// Whether the run lists the messages that operations alter.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lists_altered: bool,
}

/// Asks for the trace of a test.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TraceRequest {
    /// The file it is to be, in a folder that exists.
    pub file: PathBuf,
    /// Whether to keep it for every outcome.
    pub keep: Recorded,
}

/// A test that has ended.
#[derive(Debug, Serialize, Deserialize)]
pub struct JobResult {
    /// The job's number.
    pub number: u32,
    /// What the run showed.
    pub observation: Observation,
    /// What happened to its worker: that it was killed and the test run again, what it printed last before it died. Of
    /// this one session: it may hold process numbers.
    pub notes: Vec<String>,
    /// How long the relay kept messages, wire by wire; wall time of this one session.
    pub added: Vec<AddedOnWire>,
    /// Why the trace that was asked for could not be written: the result must not be recorded without it.
    pub trace_failure: Option<String>,
    /// Whether its worker or its simulator was killed, and killed again when the test was repeated. The observation
    /// says so; it may say nothing of the test, but only of this machine today.
    pub killed: bool,
    /// Whether the simulator is stepped, so that running the test again gives the same result.
    pub lock_stepped: bool,
    /// The machine on which it ran, if that was not this one.
    #[serde(default)]
    pub machine: Option<String>,
}

/// Why tests cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ExecutorError {
    /// A worker of this machine cannot be started.
    #[error("cannot start worker {worker}: {reason}")]
    Worker {
        /// Which worker, from 1.
        worker: usize,
        /// Why.
        reason: String,
    },
    /// The program that carries out the tests fails to.
    #[error("the program that carries out the tests does not go on: {reason}")]
    Program {
        /// Why.
        reason: String,
    },
    /// The program that carries out the tests wants no more of them: the user stopped it, or it has ended.
    #[error("the program that carries out the tests has ended")]
    Closed,
    /// Agents cannot be reached, or none can run tests.
    #[error("agents cannot run the tests: {reason}")]
    Agents {
        /// Why.
        reason: String,
    },
}

impl From<std::io::Error> for ExecutorError {
    fn from(error: std::io::Error) -> Self {
        ExecutorError::Program { reason: error.to_string() }
    }
}
