//! `replay`: a recorded test once more, just as it was.

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use sesame_base::test_number::TestNumber;
use sesame_record::{differences, trace_file};
use sesame_report::{Replay, replay_text};

use crate::cli::execution::{seconds, shown};
use crate::cli::failure::{Failure, NOT_AS_REQUIRED, STOPPED};
use crate::cli::run_again::{Again, Asked, run_again};
use crate::cli::session::Session;
use crate::cli::terminal::Format;
use crate::cli::terminal::{print, print_json, say, text_options};
use crate::cli::view::Which;

/// Which test is run once more.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The test, for example `T158`
    test: String,
    #[command(flatten)]
    which: Which,
    /// If the result is the same, record the trace of the test: `traces/T158.mcap` in the folder of the run
    #[arg(long)]
    record: bool,
    /// Seconds of wall time after which it is stopped; by default 20 times its recorded time, at least 60, or the limit
    /// that stopped it
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
}

pub(super) fn replay(session: &Session, args: &ReplayArgs) -> Result<ExitCode, Failure> {
    let asked = Asked {
        run: "replay",
        test: &args.test,
        results: args.which.results.as_deref(),
        record: args.record,
        timeout: args.timeout,
        withheld: Vec::new(),
    };
    let Some(again) = run_again(session, asked)? else { return Ok(ExitCode::from(STOPPED)) };
    let Again { repository, record, lock_stepped, .. } = &again;
    if !*lock_stepped {
        say(format_args!("note: the simulator runs freely, so this run may differ from the recorded one"));
    }
    let differences = differences(repository.plan(), &record.test, &record.observation, &again.observation);
    let replay = Replay {
        test: TestNumber(record.number),
        simulator_seed: record.simulator_seed,
        same: differences.is_empty(),
        differences,
    };
    if let Some(reason) = &again.trace_failure {
        return Err(Failure(format!("the trace of {} could not be written: {reason}", replay.test)));
    }
    // The trace gets its place once it is known to be of the recorded run.
    if args.record && replay.same {
        let file = trace_file(repository.folder(), record.number);
        keep(&again.trace, &file)?;
        say(format_args!("recorded in {}", shown(&file)));
    }
    match args.which.format {
        Format::Text => print(&replay_text(&replay, text_options()))?,
        Format::Json => print_json(&replay)?,
    };
    Ok(ExitCode::from(if replay.same || !*lock_stepped { 0 } else { NOT_AS_REQUIRED }))
}

/// Puts a trace into its place, whole or not at all.
fn keep(recorded: &Path, file: &Path) -> Result<(), Failure> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let cannot = |error: std::io::Error| Failure(format!("cannot write the trace: {error}: {}", file.display()));
    std::fs::create_dir_all(folder).map_err(cannot)?;
    // The scratch folder may be on another file system.
    let beside = file.with_extension("mcap.unfinished");
    std::fs::copy(recorded, &beside).map_err(cannot)?;
    std::fs::rename(&beside, file).map_err(cannot)
}
