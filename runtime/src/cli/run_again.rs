//! A recorded test once more, with its seeds: what `replay` and `twin` have in common.

use std::path::{Path, PathBuf};
use std::time::Duration;

use sesame_base::gathered::gathered;
use sesame_base::observation::{Observation, Outcome};
use sesame_plan::{MonitorId, Recorded};
use sesame_record::{Repository, TestRecord};

use crate::campaign::silence;
use crate::campaign::{Job, JobResult, SingleSettings, TraceRequest, default_timeout, run_single};
use crate::cli::execution::{claim_files, interruptible, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::scratch::Scratch;
use crate::cli::session::Session;
use crate::cli::terminal::say;

/// What is run once more, and how.
pub(super) struct Asked<'a> {
    /// What the new run is called.
    pub(super) run: &'static str,
    /// The test, as the user named it, and the folder of its results.
    pub(super) test: &'a str,
    pub(super) results: Option<&'a Path>,
    /// Whether its trace is written.
    pub(super) record: bool,
    pub(super) timeout: Option<Duration>,
    /// The monitors whose mitigation is not sent.
    pub(super) withheld: Vec<MonitorId>,
}

/// A run that came to an end.
pub(super) struct Again {
    pub(super) repository: Repository,
    /// The test as it was recorded.
    pub(super) record: TestRecord,
    pub(super) observation: Observation,
    pub(super) lock_stepped: bool,
    /// Why its trace could not be written.
    pub(super) trace_failure: Option<String>,
    /// Where its trace is, for as long as this lives.
    pub(super) trace: PathBuf,
    _folder: Scratch,
}

/// Runs a recorded test once more and says what happened to its worker. `None` if it was interrupted, which it prints;
/// then nothing is left behind.
pub(super) fn run_again(session: &Session, asked: Asked<'_>) -> Result<Option<Again>, Failure> {
    let Session { plan, results, .. } = session;
    let repository = open(results, asked.results)?;
    let record = repository.test(repository.find(asked.test)?)?;
    refuse_changed(session, &repository, record.number)?;
    let files = claim_files(&session.runner, plan)?;
    refuse_unfilled(session, plan, true)?;
    let interrupted = interruptible()?;
    let folder = Scratch::new(asked.run)?;
    let file = folder.path().join("recorded.mcap");
    let settings = SingleSettings {
        program: session.program.clone().recording(asked.record),
        directory: folder.path().to_owned(),
        timeout: asked.timeout.unwrap_or_else(|| limit(&record)),
    };
    let job = Job {
        number: record.number,
        test: record.test.clone(),
        simulator_seed: record.simulator_seed,
        trace: asked.record.then(|| TraceRequest { file: file.clone(), keep: Recorded::All }),
        compensation: repository.plan().compensation.clone(),
        withheld: asked.withheld,
        lists_altered: false,
    };
    let ended = run_single(job, &settings, &interrupted);
    files.finish()?;
    let Some(JobResult { mut observation, notes, lock_stepped, trace_failure, .. }) = ended? else {
        say(format_args!("stopped; a {} leaves nothing behind", asked.run));
        return Ok(None);
    };
    for note in gathered(notes) {
        say(format_args!("{note}"));
    }
    // As it was judged when it was recorded: a reference run is compared with an earlier one only.
    if let Some(reference) = repository.reference_run()?.filter(|reference| reference.number < record.number) {
        silence::judge(plan, &reference.observation, &mut observation);
    }
    Ok(Some(Again { repository, record, observation, lock_stepped, trace_failure, trace: file, _folder: folder }))
}

/// How long the test may take now.
pub(super) fn limit(record: &TestRecord) -> Duration {
    match record.observation.outcome {
        Outcome::Timeout { limit } => Duration::from_secs_f64(limit),
        _ => default_timeout(record.observation.wall.run),
    }
}
