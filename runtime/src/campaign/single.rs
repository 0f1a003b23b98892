//! Running one test alone, without recording it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::campaign::pool::{Ended, Job, Pool, PoolError, PoolSettings};

/// Where and how long one test runs.
#[derive(Debug, Clone)]
pub struct AloneSettings {
    /// The runner's program, started again as the worker.
    pub program: PathBuf,
    /// Folder in which the worker gets a folder of its own.
    pub directory: PathBuf,
    /// Wall time after which the test is stopped.
    pub timeout: Duration,
}

/// Runs a test in a worker of its own; `None` when the user stopped it.
pub fn run_alone(job: Job, settings: &AloneSettings, interrupted: &AtomicBool) -> Result<Option<Ended>, PoolError> {
    let AloneSettings { program, directory, timeout } = settings.clone();
    let pool = Pool::start(&PoolSettings { workers: 1, program, directory, timeout })?;
    pool.submit(job);
    while !interrupted.load(Ordering::Relaxed) {
        if let Some(ended) = pool.next(Duration::from_millis(100))? {
            return Ok(Some(ended));
        }
    }
    Ok(None)
}
