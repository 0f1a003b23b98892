//! Running one test by itself, without recording it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::campaign::executor::{Executor as _, ExecutorError, Job, JobResult};
use crate::campaign::pool::{Pool, PoolSettings, Retries};
use crate::campaign::worker_program::WorkerProgram;

/// Where and how long one test runs.
#[derive(Debug, Clone)]
pub struct SingleSettings {
    /// The runner's program, started again as the worker.
    pub program: WorkerProgram,
    /// Folder in which the worker gets a folder of its own.
    pub directory: PathBuf,
    /// Wall time after which the test is stopped.
    pub timeout: Duration,
}

/// Runs a test in a worker of its own; `None` when the user stopped it.
pub fn run_single(
    job: Job,
    settings: &SingleSettings,
    interrupted: &AtomicBool,
) -> Result<Option<JobResult>, ExecutorError> {
    let SingleSettings { program, directory, timeout } = settings.clone();
    let mut pool =
        Pool::start(&PoolSettings { workers: 1, first: 1, program, directory, timeout, retries: Retries::Here })?;
    pool.submit(job);
    while !interrupted.load(Ordering::Relaxed) {
        if let Some(result) = pool.next(Duration::from_millis(100))? {
            return Ok(Some(result));
        }
    }
    Ok(None)
}
