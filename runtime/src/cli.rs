//! The runner's command line.
//!
//! Results go to standard output, progress and problems to standard error. Exit codes: 0 done, 1 failed, 2 wrong usage,
//! 3 done, but something is not as required where that was asked for, 130 stopped by the user.

mod confirm;
mod execution;
mod export;
mod failure;
mod gate;
mod known;
mod progress;
mod progress_line;
mod repeat;
mod replay;
mod replay_recording;
mod report;
mod results_folder;
mod run;
mod shrink;
mod terminal;
mod view;

use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use sesame_base::visible::visible_lines;
use sesame_plan::CampaignPlan;

use crate::campaign;
use crate::cli::failure::Failure;
use crate::cli::terminal::say;
use crate::runner::Runner;

#[derive(Debug, Parser)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    after_help = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but not as required (`known`: an expectation is not \
                  kept; `replay`: the test came out different; `replay-recording`: a metric did; `--fail-on`: what it names was found; \
                  a campaign says too little: most of its tests broke off, none was disturbed, or no requirement was judged); 130 stopped by \
                  the user."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::Options,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the campaign (what the runner does when no command is given)
    Run(run::Options),
    /// Go on with a run that was stopped, to the same results
    Resume(run::ResumeOptions),
    /// Run the regression tests and check their expectations
    Known(known::Options),
    /// Run one test again and again, to see what of its result is chance
    Repeat(repeat::Options),
    /// Run recorded tests again with fresh seeds of the simulator and say whether what was found comes again
    Confirm(confirm::Options),
    /// Run a recorded test again just as it was and say whether it is the same, bit for bit
    Replay(replay::Options),
    /// Make a failing test smaller for as long as it fails as it did: fewer operations, shorter, milder
    Shrink(shrink::Options),
    /// Feed a recording to the campaign's metrics, without a simulator
    ReplayRecording(replay_recording::Options),
    /// Print a recorded test as a `test` block for the `.sesame` file
    Export(export::Options),
    /// Write the page with pictures anew and print what was found, also of an unfinished run
    Report(report::Options),
    /// List all tests of a run
    List(view::Which),
    /// Show one test whole: operations, effects, metrics, requirements
    Show {
        /// The test, for example `T158`
        test: String,
        #[command(flatten)]
        which: view::Which,
    },
    /// Print the hash of a run's content: equal runs have equal digests
    Digest(view::Which),
    /// Serve a supervisor; started by `run`
    #[command(hide = true)]
    Worker(campaign::Address),
    /// Keep the simulator of a worker; started by `worker`
    #[cfg(all(feature = "process", target_os = "linux"))]
    #[command(hide = true)]
    Simulator {
        /// Process id of the worker
        worker: u32,
        /// The file that is told how the simulator ended
        report: std::path::PathBuf,
        /// The simulator's program with its arguments
        #[arg(required = true, last = true)]
        program: Vec<std::ffi::OsString>,
    },
    /// Become a simulator; started by `simulator`
    #[cfg(all(feature = "process", target_os = "linux"))]
    #[command(hide = true)]
    Simulated {
        /// Process id of the keeper
        keeper: u32,
        /// The simulator's program with its arguments
        #[arg(required = true, last = true)]
        program: Vec<std::ffi::OsString>,
    },
}

/// The runner's command line. A generated `main` is nothing but this call.
pub fn main(runner: Runner) -> ExitCode {
    match dispatch(&runner) {
        Ok(code) => code,
        Err(Failure(words)) => {
            say(format_args!("error: {}", visible_lines(&words)));
            ExitCode::FAILURE
        }
    }
}

fn dispatch(runner: &Runner) -> Result<ExitCode, Failure> {
    let plan: CampaignPlan = serde_json::from_str(runner.plan).map_err(|error| {
        Failure(format!("the plan in this runner is damaged ({error}): run `sesamec generate` again"))
    })?;
    let about = format!("Campaign `{}` of the space `{}`.\n\n{}", plan.campaign.name, plan.space, plan.campaign.doc);
    let command = Cli::command().name(plan.campaign.name.clone()).bin_name(plan.campaign.name.clone()).about(about);
    let cli = match command.try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    let results = Path::new(runner.directory).join("results");
    match cli.command {
        None => run::run(runner, &plan, &results, &cli.run),
        Some(Command::Run(options)) => run::run(runner, &plan, &results, &options),
        Some(Command::Resume(options)) => run::resume(runner, &plan, &results, &options),
        Some(Command::Known(options)) => known::known(runner, &plan, &results, &options),
        Some(Command::Repeat(options)) => repeat::repeat(runner, &plan, &results, &options),
        Some(Command::Confirm(options)) => confirm::confirm(runner, &plan, &results, &options),
        Some(Command::Replay(options)) => replay::replay(runner, &plan, &results, &options),
        Some(Command::Shrink(options)) => shrink::shrink(runner, &plan, &results, &options),
        Some(Command::ReplayRecording(options)) => replay_recording::replay_recording(runner, &plan, &options),
        Some(Command::Export(options)) => export::export(&results, &options),
        Some(Command::Report(options)) => report::report(&results, &options),
        Some(Command::List(which)) => view::list(&results, &which),
        Some(Command::Show { test, which }) => view::show(&results, &which, &test),
        Some(Command::Digest(which)) => view::digest(&results, &which),
        Some(Command::Worker(supervisor)) => {
            campaign::serve(runner, &plan, &supervisor)?;
            Ok(ExitCode::SUCCESS)
        }
        #[cfg(all(feature = "process", target_os = "linux"))]
        Some(Command::Simulator { worker, report, program }) => {
            let (program, arguments) = program.split_first().expect("the program is required");
            Ok(sesame_relay::transport::keep_simulator(worker, &report, program, arguments))
        }
        #[cfg(all(feature = "process", target_os = "linux"))]
        Some(Command::Simulated { keeper, program }) => {
            let (program, arguments) = program.split_first().expect("the program is required");
            Ok(sesame_relay::transport::become_simulator(keeper, program, arguments))
        }
    }
}

/// What commands ask of recorded results beside what reports do: whether a gate closes, how a test is shrunk, and
/// how long it may take when it is run again.
#[cfg(test)]
pub(crate) fn asked_beside_reports(repository: &sesame_results::record::Repository, test: &str) -> Result<(), String> {
    let words = |error: sesame_results::record::RecordError| error.to_string();
    drop(gate::every_objection(&sesame_results::report::summary(repository).map_err(words)?, repository));
    let record = repository.find(test).and_then(|number| repository.test(number)).map_err(words)?;
    replay::limit(&record);
    drop(shrink::failing(repository, &record, &[]).map_err(|Failure(words)| words)?);
    Ok(())
}
