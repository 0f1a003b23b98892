//! What a user decides about a run, and what follows from it.

use std::path::Path;
use std::time::Duration;

use crate::campaign::pool::{PoolSettings, Retries};
use crate::campaign::worker_program::WorkerProgram;

/// A test that takes this many times as long as the reference run is taken to hang.
const TIMEOUT_FACTOR: f64 = 20.0;
/// The shortest timeout that is set unless the user sets one.
const LEAST_TIMEOUT: Duration = Duration::from_secs(60);
/// The timeout of the first reference run unless the user sets one: nothing is known of the simulator yet.
const FIRST_TIMEOUT: Duration = Duration::from_secs(600);

/// How long a test may take, in wall time, when one like it took so many seconds.
pub fn default_timeout(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds * TIMEOUT_FACTOR).max(LEAST_TIMEOUT)
}

/// What a user decides about a run.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The campaign's seed.
    pub seed: u64,
    /// How many worker processes at most; results do not depend on it.
    pub workers: usize,
    /// Wall time after which a test is stopped; by default a multiple of what the reference run takes.
    pub timeout: Option<Duration>,
    /// Wall time after which the first reference run is stopped; by default `timeout`, or ten minutes.
    pub reference_timeout: Option<Duration>,
    /// The runner's program, started again for each worker.
    pub program: WorkerProgram,
    /// Whether to go on although nothing receives what an operation disturbs.
    pub allow_unheard: bool,
}

impl Settings {
    /// Wall time after which the first reference run is stopped.
    pub(super) fn first_timeout(&self) -> Duration {
        self.reference_timeout.or(self.timeout).unwrap_or(FIRST_TIMEOUT)
    }

    /// Worker processes for so many tests: more workers than tests would have nothing to do.
    pub(super) fn pool(&self, tests: u32, directory: &Path, timeout: Duration) -> PoolSettings {
        PoolSettings {
            workers: self.workers.min(usize::try_from(tests).unwrap_or(usize::MAX)).max(1),
            program: self.program.clone(),
            first: 1,
            directory: directory.to_path_buf(),
            timeout,
            retries: Retries::Here,
        }
    }
}
