//! `twin`: a recorded test once more, with the mitigation of its monitors withheld.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use sesame_base::test_number::TestNumber;
use sesame_report::{Twin, twin as compare, twin_text};

use crate::cli::execution::{seconds, shown};
use crate::cli::failure::{Failure, NOT_AS_REQUIRED, STOPPED};
use crate::cli::monitors::chosen;
use crate::cli::run_again::{Again, Asked, run_again};
use crate::cli::session::Session;
use crate::cli::terminal::{Format, print, print_json, say, text_options};
use crate::cli::view::Which;

/// Which test is run without mitigation.
#[derive(Debug, Args)]
pub struct TwinArgs {
    /// The test, for example `T158`
    test: String,
    /// Withhold the mitigation of this monitor only; may be repeated. By default no monitor's mitigation is sent
    #[arg(long, value_name = "MONITOR")]
    without: Vec<String>,
    #[command(flatten)]
    which: Which,
    /// Write the trace of the twin into this file, which must not exist
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Seconds of wall time after which the twin is stopped; by default 20 times the test's time, at least 60, or the
    /// limit that stopped the test
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
}

pub(super) fn twin(session: &Session, args: &TwinArgs) -> Result<ExitCode, Failure> {
    let plan = &session.plan;
    let withheld = chosen(plan, &args.without, |monitor| {
        monitor.otherwise.mitigation.is_some() || args.without.contains(&monitor.name)
    })?;
    let sends_none = withheld.iter().map(|&id| plan.monitor(id)).find(|monitor| monitor.otherwise.mitigation.is_none());
    if let Some(monitor) = sends_none {
        return Err(Failure(format!("monitor `{}` has no mitigation that could be withheld", monitor.name)));
    }
    if withheld.is_empty() {
        return Err(Failure("no monitor of the space has a mitigation; `mitigate with` declares one".to_owned()));
    }
    if let Some(file) = args.record.as_ref().filter(|file| file.exists()) {
        return Err(Failure(format!("{} exists already, and is not overwritten", shown(file))));
    }
    let asked = Asked {
        run: "twin",
        test: &args.test,
        results: args.which.results.as_deref(),
        record: args.record.is_some(),
        timeout: args.timeout,
        withheld: withheld.clone(),
    };
    let Some(again) = run_again(session, asked)? else { return Ok(ExitCode::from(STOPPED)) };
    let Again { repository, record, lock_stepped, .. } = &again;
    if !*lock_stepped {
        say(format_args!("note: the simulator runs freely, so chance also makes the twin differ from the test"));
    }
    if record.observation.monitors.iter().any(|monitor| monitor.omitted > 0) {
        let test = TestNumber(record.number);
        say(format_args!("note: {test} has more decisions of monitors than are kept, so mitigations may be missing"));
    }
    if let Some(reason) = &again.trace_failure {
        return Err(Failure(format!("the trace of the twin could not be written: {reason}")));
    }
    if let Some(file) = &args.record {
        let cannot = |error: std::io::Error| Failure(format!("cannot write the trace: {error}: {}", shown(file)));
        let mut to = std::fs::File::create_new(file).map_err(cannot)?;
        std::io::copy(&mut std::fs::File::open(&again.trace).map_err(cannot)?, &mut to).map_err(cannot)?;
        say(format_args!("recorded in {}", shown(file)));
    }
    let found: Twin = compare(repository.plan(), record, &again.observation, &withheld, *lock_stepped);
    match args.which.format {
        Format::Text => print(&twin_text(&found, text_options()))?,
        Format::Json => print_json(&found)?,
    };
    Ok(ExitCode::from(if found.passed { 0 } else { NOT_AS_REQUIRED }))
}
