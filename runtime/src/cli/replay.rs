//! `replay`: a recorded test once more, just as it was.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_results::record::{TestRecord, differences};
use sesame_results::report::{Replay, replay_text};

use crate::campaign::{Job, JobResult, SingleSettings, default_timeout, run_single};
use crate::cli::execution::{claim_files, interruptible, refuse_unfilled, seconds};
use crate::cli::failure::{Failure, NOT_AS_REQUIRED, STOPPED};
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::scratch::Scratch;
use crate::cli::session::Session;
use crate::cli::terminal::Format;
use crate::cli::terminal::{print, print_json, say, text_options};
use crate::cli::view::Which;

/// Which test is run once more.
#[derive(Debug, Args)]
pub struct Options {
    /// The test, for example `T158`
    test: String,
    #[command(flatten)]
    which: Which,
    /// Seconds of wall time after which it is stopped; by default 20 times what it took, at least 60, or what stopped
    /// it
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
}

pub(super) fn replay(session: &Session, options: &Options) -> Result<ExitCode, Failure> {
    let Session { plan, results, .. } = session;
    let repository = open(results, options.which.results.as_deref())?;
    let record = repository.test(repository.find(&options.test)?)?;
    refuse_changed(session, &repository, record.number)?;
    let files = claim_files(&session.runner, plan)?;
    refuse_unfilled(&session.runner, plan, true)?;
    let interrupted = interruptible()?;
    let folder = Scratch::new("replay")?;
    let settings = SingleSettings {
        program: session.program.clone(),
        directory: folder.path().to_owned(),
        timeout: options.timeout.unwrap_or_else(|| limit(&record)),
    };
    let job = Job {
        number: record.number,
        test: record.test.clone(),
        simulator_seed: record.simulator_seed,
        trace: None,
        compensation: repository.plan().compensation.clone(),
    };
    let ended = run_single(job, &settings, &interrupted);
    files.finish()?;
    let Some(JobResult { observation: again, notes, lock_stepped, .. }) = ended? else {
        say(format_args!("stopped; a replay leaves nothing behind"));
        return Ok(ExitCode::from(STOPPED));
    };
    for note in notes {
        say(format_args!("{note}"));
    }
    if !lock_stepped {
        say(format_args!("note: the simulator runs freely, so this run may differ from the recorded one"));
    }
    let differences = differences(repository.plan(), &record.test, &record.observation, &again);
    let replay = Replay {
        test: TestNumber(record.number),
        simulator_seed: record.simulator_seed,
        same: differences.is_empty(),
        differences,
    };
    match options.which.format {
        Format::Text => print(&replay_text(&replay, text_options()))?,
        Format::Json => print_json(&replay)?,
    };
    Ok(ExitCode::from(if replay.same || !lock_stepped { 0 } else { NOT_AS_REQUIRED }))
}

/// How long the test may take now.
pub(super) fn limit(record: &TestRecord) -> Duration {
    match record.observation.outcome {
        Outcome::Timeout { limit } => Duration::from_secs_f64(limit),
        _ => default_timeout(record.observation.wall.run),
    }
}
