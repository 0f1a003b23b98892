//! `twin`: a recorded test once more, with the mitigation of its monitors withheld.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use sesame_base::test_number::TestNumber;
use sesame_plan::Recorded;
use sesame_results::report::{Twin, twin as compare, twin_text};

use crate::campaign::{Job, JobResult, SingleSettings, TraceRequest, run_single};
use crate::cli::execution::{claim_files, interruptible, refuse_unfilled, seconds, shown};
use crate::cli::failure::{Failure, NOT_AS_REQUIRED, STOPPED};
use crate::cli::monitors::chosen;
use crate::cli::replay::limit;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::scratch::Scratch;
use crate::cli::session::Session;
use crate::cli::terminal::{Format, print, print_json, say, text_options};
use crate::cli::view::Which;

/// Which test is run without mitigation.
#[derive(Debug, Args)]
pub struct Options {
    /// The test, for example `T158`
    test: String,
    /// Withhold the mitigation of this monitor only; may be repeated. By default that of all monitors is withheld
    #[arg(long, value_name = "MONITOR")]
    without: Vec<String>,
    #[command(flatten)]
    which: Which,
    /// Write the trace of the twin into this file, which must not exist
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Seconds of wall time after which the twin is stopped; by default 20 times what the test took, at least 60, or
    /// what stopped it
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
}

pub(super) fn twin(session: &Session, options: &Options) -> Result<ExitCode, Failure> {
    let Session { plan, results, .. } = session;
    let withheld = chosen(plan, &options.without, |monitor| {
        monitor.otherwise.mitigation.is_some() || options.without.contains(&monitor.name)
    })?;
    let sends_none = withheld.iter().map(|&id| plan.monitor(id)).find(|it| it.otherwise.mitigation.is_none());
    if let Some(monitor) = sends_none {
        return Err(Failure(format!("monitor `{}` has no mitigation that could be withheld", monitor.name)));
    }
    if withheld.is_empty() {
        return Err(Failure("no monitor of the space has a mitigation; `mitigate with` declares one".to_owned()));
    }
    if let Some(file) = options.record.as_ref().filter(|file| file.exists()) {
        return Err(Failure(format!("{} exists already, and is not overwritten", shown(file))));
    }
    let repository = open(results, options.which.results.as_deref())?;
    let record = repository.test(repository.find(&options.test)?)?;
    refuse_changed(session, &repository, record.number)?;
    let files = claim_files(&session.runner, plan)?;
    refuse_unfilled(&session.runner, plan, true)?;
    let interrupted = interruptible()?;
    let folder = Scratch::new("twin")?;
    let recorded = folder.path().join("recorded.mcap");
    let trace = options.record.is_some().then(|| TraceRequest { file: recorded.clone(), keep: Recorded::All });
    let settings = SingleSettings {
        program: session.program.clone().recording(options.record.is_some()),
        directory: folder.path().to_owned(),
        timeout: options.timeout.unwrap_or_else(|| limit(&record)),
    };
    let job = Job {
        number: record.number,
        test: record.test.clone(),
        simulator_seed: record.simulator_seed,
        trace,
        compensation: repository.plan().compensation.clone(),
        withheld: withheld.clone(),
    };
    let ended = run_single(job, &settings, &interrupted);
    files.finish()?;
    let Some(JobResult { observation, notes, lock_stepped, trace_failure, .. }) = ended? else {
        say(format_args!("stopped; a twin leaves nothing behind"));
        return Ok(ExitCode::from(STOPPED));
    };
    for note in notes {
        say(format_args!("{note}"));
    }
    if !lock_stepped {
        say(format_args!("note: the simulator runs freely, so chance also makes the twin differ from the test"));
    }
    if record.observation.monitors.iter().any(|monitor| monitor.omitted > 0) {
        let test = TestNumber(record.number);
        say(format_args!("note: {test} has more decisions of monitors than are kept, so mitigations may be missing"));
    }
    if let Some(reason) = trace_failure {
        return Err(Failure(format!("the trace of the twin could not be written: {reason}")));
    }
    if let Some(file) = &options.record {
        let cannot = |error: std::io::Error| Failure(format!("cannot write the trace: {error}: {}", shown(file)));
        let mut to = std::fs::File::create_new(file).map_err(cannot)?;
        std::io::copy(&mut std::fs::File::open(&recorded).map_err(cannot)?, &mut to).map_err(cannot)?;
        say(format_args!("recorded in {}", shown(file)));
    }
    let found: Twin = compare(repository.plan(), &record, &observation, &withheld, lock_stepped);
    match options.which.format {
        Format::Text => print(&twin_text(&found, text_options()))?,
        Format::Json => print_json(&found)?,
    };
    Ok(ExitCode::from(if found.passed { 0 } else { NOT_AS_REQUIRED }))
}
