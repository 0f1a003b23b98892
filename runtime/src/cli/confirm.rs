//! `confirm`: tests of a finished run again, each with fresh seeds of the simulator, to see whether what was found in
//! them comes again.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;

use sesame_record::{Origin, Recorder, Repository, TestRow, Verdict};
use sesame_report as report;

use crate::campaign::{Confirmations, confirm_recorded};
use crate::cli::execution::{ExecutionArgs, claim_files, interruptible, refuse_unfilled, shown};
use crate::cli::failure::{Failure, STOPPED};
use crate::cli::gate::Gate;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::session::{Session, World};
use crate::cli::terminal::Format;
use crate::cli::terminal::{print, print_json, say, text_options};

/// How often a line is printed.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Which tests are run again, and how.
#[derive(Debug, Args)]
pub struct ConfirmArgs {
    /// The tests, for example `T158 T17`; by default those of the front (with `--violations` those that violate)
    #[arg(value_name = "TEST")]
    tests: Vec<String>,
    /// Run again each test that violates a requirement and was run only once, on the front or not
    #[arg(long, conflicts_with = "tests")]
    violations: bool,
    /// The number of further runs of each test
    #[arg(short = 'n', long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    times: u32,
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// The format of the results
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    gate: Gate,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
}

pub(super) fn confirm(session: &Session, args: &ConfirmArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let Session { plan, results, .. } = session;
    let repository = open(results, args.results.as_deref())?;
    let mut tests = match args.tests.as_slice() {
        [] if args.violations => run_once(&repository)?,
        [] => repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members),
        names => names.iter().map(|name| repository.find(name)).collect::<Result<_, _>>()?,
    };
    if tests.is_empty() && args.violations {
        say(format_args!("no test that violates a requirement was run only once"));
        return report_outcome(&repository, &tests, args);
    }
    if tests.is_empty() {
        return Err(Failure(format!(
            "there is no front in {}: name the tests that are to be run again, for example\n    {}",
            shown(repository.path()),
            session.caller.command("confirm", &["T1"])
        )));
    }
    for test in &mut tests {
        refuse_changed(session, &repository, *test)?;
        // A duplicate is what its original is.
        *test = repository.row(*test)?.duplicate_of.unwrap_or(*test);
    }
    tests.sort_unstable();
    tests.dedup();
    let seed = repository.campaign().seed;
    let stop = repository.campaign().stop.clone().unwrap_or_default();
    let folder = repository.folder().to_owned();
    drop(repository);

    let mut recorder = Recorder::reopen(&folder, args.execution.workers(&session.plan))?;
    let files = claim_files(&session.runner, plan)?;
    refuse_unfilled(session, plan, true)?;
    let settings = args.execution.settings(session, seed, &files);
    let interrupted = interruptible()?;
    let confirmations = Confirmations { tests, times: args.times };
    let mut said = Instant::now();
    let complete = confirm_recorded(
        &mut recorder,
        &confirmations,
        &settings,
        &folder.join("workers"),
        &interrupted,
        &mut |runs, total| {
            if said.elapsed() >= LINE_EVERY {
                said = Instant::now();
                say(format_args!("{runs}/{total} runs"));
            }
        },
    );
    files.finish()?;
    // What is recorded stays, however it ended.
    let repository = recorder.finish(&stop)?;
    if !complete? {
        say(format_args!("stopped; the runs that had ended are kept"));
        return Ok(ExitCode::from(STOPPED));
    }
    report::write_page(&repository, &folder.join("report.html"))?;
    report_outcome(&repository, &confirmations.tests, args)
}

/// The tests that violate a requirement and were run once only, by number; none of a duplicate.
fn run_once(repository: &Repository) -> Result<Vec<u32>, Failure> {
    let (plan, repetitions) = (repository.plan(), repository.repetitions()?);
    let violates =
        |row: &TestRow| plan.requirements.iter().any(|requirement| row.verdict(requirement) == Verdict::Violated);
    let counts = |row: &&TestRow| row.origin != Origin::Reference && row.duplicate_of.is_none();
    let rows = repository.tests()?;
    let once = rows.iter().filter(counts).filter(|row| !repetitions.contains_key(&row.number) && violates(row));
    Ok(once.map(|row| row.number).collect())
}

/// Prints what fresh runs say of these tests. The exit code is for all that is recorded.
fn report_outcome(repository: &Repository, tests: &[u32], args: &ConfirmArgs) -> Result<ExitCode, Failure> {
    let summary = report::summary(repository)?;
    let code = args.gate.code(&summary, repository);
    let confirmed: Vec<_> = summary.confirmed.into_iter().filter(|test| tests.contains(&test.number)).collect();
    match args.format {
        Format::Text => print(&report::confirmed_text(&confirmed, text_options()))?,
        Format::Json => print_json(&confirmed)?,
    };
    Ok(code)
}
