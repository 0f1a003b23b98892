//! The runner's command line.
//!
//! Results go to standard output, progress and problems to standard error. Exit codes: 0 done, 1 failed, 2 wrong usage,
//! 3 done, but something is not as required where that was asked for, 130 stopped by the user.

#[cfg(feature = "agents")]
mod agent;
mod caller;
mod commands;
#[cfg(all(feature = "process", feature = "mcap"))]
mod compensate;
mod confirm;
mod execution;
mod explore;
mod export;
mod failure;
#[cfg(feature = "agents")]
mod fleet;
#[cfg(feature = "agents")]
mod forecast;
mod gate;
mod known;
#[cfg(feature = "process")]
mod mitm;
mod monitors;
#[cfg(feature = "process")]
mod null;
mod over_budget;
#[cfg(feature = "process")]
mod physical;
mod place;
#[cfg(feature = "process")]
mod preparation;
#[cfg(feature = "process")]
mod prepare;
mod progress;
mod progress_line;
mod repeat;
mod replay;
mod replay_recording;
mod report;
mod results_folder;
mod run;
mod run_again;
mod scratch;
mod session;
mod shrink;
#[cfg(feature = "agents")]
mod slurm;
mod terminal;
mod twin;
mod view;

#[cfg(feature = "process")]
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use sesame_base::visible::visible_lines;
use sesame_record as record;
use sesame_record::Repository;
#[cfg(feature = "process")]
use sesame_relay::fuzz::OperationEntry;
#[cfg(feature = "process")]
use sesame_relay::metric::HookEntry;
#[cfg(feature = "process")]
use sesame_relay::transport::Connect;

use crate::campaign::WorkerProgram;
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::say;
#[cfg(feature = "process")]
use crate::interpreted::Interpreted;
use crate::runner::Runner;

#[cfg(feature = "agents")]
pub use self::agent::{AgentArgs, AgentsArgs};
pub use self::caller::{CALLER, Caller};
pub use self::commands::{Internal, Running, Showing};
#[cfg(feature = "agents")]
pub use self::fleet::FleetArgs;
pub use self::place::RUNNER;

/// What the exit codes of a runner mean.
pub const EXIT_CODES: &str = "Exit codes: 0 done; 1 failed; 2 wrong usage; 3 done, but not as required (`known`: an \
                          expectation is not met; `null`, `mitm`, `prepare`: they found a deviation; `replay`, \
                          `replay-recording`: a test or a metric has another result; `monitors`: monitors decide \
                          differently; `twin`: a hazard was not mitigated in time; `--fail-on`: such a finding; \
                          insufficient results: most tests broke off, no operation had an effect, or no requirement \
                          was judged); 130 stopped by the user.";

#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::RunArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the campaign (what the runner does when no command is given)
    Run(run::RunArgs),
    #[command(flatten)]
    Running(Running),
    #[command(flatten)]
    Showing(Showing),
    #[command(flatten)]
    Internal(Internal),
}

/// The command line of a process that was started as a worker.
#[cfg(feature = "process")]
#[derive(Debug, Parser)]
struct Served {
    #[command(subcommand)]
    command: Internal,
}

/// The runner's command line. A generated `main` is nothing but this call.
pub fn main(runner: Runner) -> ExitCode {
    concluded(place::check(&runner.directory).and_then(|()| WorkerProgram::compiled().map_err(Failure::from)).and_then(
        |program| {
            let session = Session::new(runner, program, Caller::of_this_process())?;
            dispatch(&session, std::env::args_os())
        },
    ))
}

/// The command line of a runner that is interpreted: `arguments` are those after the program's name.
#[cfg(feature = "process")]
pub fn interpret(runner: &Interpreted, caller: Caller, arguments: &[OsString]) -> ExitCode {
    let program = std::iter::once(OsString::from("runner"));
    concluded(
        interpreted(runner, caller).and_then(|session| dispatch(&session, program.chain(arguments.iter().cloned()))),
    )
}

/// The command line of a runner that was compiled to this program, for tests that agents run: this process supervises
/// them.
#[cfg(feature = "agents")]
pub fn supervise(program: &Path, runner: &Interpreted, caller: Caller, arguments: &[OsString]) -> ExitCode {
    let session = WorkerProgram::compiled_at(program, runner)
        .map_err(Failure::from)
        .and_then(|program| Session::new(runner.runner(), program, caller));
    let name = std::iter::once(OsString::from("runner"));
    concluded(session.and_then(|session| dispatch(&session, name.chain(arguments.iter().cloned()))))
}

/// Carries out a command of a runner that is interpreted.
#[cfg(feature = "process")]
pub fn carry_out(command: &Running, runner: &Interpreted, caller: Caller) -> ExitCode {
    concluded(interpreted(runner, caller).and_then(|session| command.carry_out(&session)))
}

/// The file name of the space whose run is the latest in a folder of results; `None` if there is none that can be read.
pub fn recorded_source(results: &Path) -> Option<String> {
    let latest = record::latest_folder(results).ok().flatten()?;
    Some(Repository::open(&latest).ok()?.plan().source.clone())
}

/// Carries out a command on the runs in a folder of results.
pub fn show(command: &Showing, results: &Path) -> ExitCode {
    concluded(command.carry_out(results))
}

/// Whether another process forks the workers of this one, with the user's code in them.
pub fn forks_workers() -> bool {
    crate::campaign::forks_workers()
}

/// Whether the process that started this one carries out tests itself, so that neither simulator nor hooks are used.
pub fn carries_out_tests() -> bool {
    crate::campaign::carries_out_tests()
}

/// The metrics and operations of an interpreted runner's campaign that have hooks in Python. The error says what is
/// wrong with the file of the hooks, or that no Python has the package.
#[cfg(feature = "process")]
pub fn hooks_in_python(runner: &Interpreted) -> std::io::Result<Vec<String>> {
    crate::campaign::python::registered(runner)
}

/// Serves a supervisor with code that is not part of the plan: hooks, and what connects to the simulator, if that is
/// not the plan's. `arguments` are those that the supervisor gave to this process. Returns the exit code.
#[cfg(feature = "process")]
pub fn worker(
    hooks: &'static [HookEntry],
    operations: &'static [OperationEntry],
    connect: Option<Connect>,
    arguments: &[OsString],
) -> u8 {
    let code = Interpreted::code(hooks, operations, connect);
    let program = std::iter::once(OsString::from("worker"));
    let called = Served::try_parse_from(program.chain(arguments.iter().cloned()));
    let served = called.map_err(|error| Failure(error.to_string())).and_then(|it| it.command.serve_with(Some(&code)));
    u8::from(concluded(served) != ExitCode::SUCCESS)
}

/// Carries out what a program that interprets runners started of itself.
pub fn serve(command: &Internal) -> ExitCode {
    concluded(command.carry_out(None))
}

#[cfg(feature = "process")]
fn interpreted(runner: &Interpreted, caller: Caller) -> Result<Session, Failure> {
    Session::new(runner.runner(), WorkerProgram::interpreted(runner)?, caller)
}

/// Carries out `sesamec agent`.
#[cfg(feature = "agents")]
pub fn agent(args: &AgentArgs) -> ExitCode {
    concluded(agent::agent(args))
}

/// Carries out `sesamec agents`.
#[cfg(feature = "agents")]
pub fn agents(args: &AgentsArgs) -> ExitCode {
    concluded(agent::agents(args))
}

fn concluded(result: Result<ExitCode, Failure>) -> ExitCode {
    result.unwrap_or_else(|Failure(words)| {
        say(format_args!("error: {}", visible_lines(&words)));
        ExitCode::FAILURE
    })
}

fn dispatch(session: &Session, arguments: impl Iterator<Item = std::ffi::OsString>) -> Result<ExitCode, Failure> {
    let plan = &session.plan;
    let about = format!("Campaign `{}` of the space `{}`.\n\n{}", plan.campaign.name, plan.space, plan.campaign.doc);
    let command = Cli::command().name(plan.campaign.name.clone()).bin_name(plan.campaign.name.clone()).about(about);
    let matches = command.try_get_matches_from(arguments);
    let cli = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => error.exit(),
    };
    match cli.command {
        None => run::run(session, &cli.run),
        Some(Command::Run(args)) => run::run(session, &args),
        Some(Command::Running(command)) => command.carry_out(session),
        Some(Command::Showing(command)) => command.carry_out(&session.results),
        Some(Command::Internal(command)) => command.carry_out(Some(session)),
    }
}

/// What commands ask of recorded results in addition to what reports do: whether a gate closes, how a test is shrunk,
/// and how long it may take when it is run again.
#[cfg(test)]
pub(crate) fn asked_beside_reports(repository: &sesame_record::Repository, test: &str) -> Result<(), String> {
    let words = |error: sesame_record::RecordError| error.to_string();
    drop(gate::every_objection(&sesame_report::summary(repository).map_err(words)?, repository));
    let record = repository.find(test).and_then(|number| repository.test(number)).map_err(words)?;
    run_again::limit(&record);
    drop(shrink::failing(repository, &record, &[]).map_err(|Failure(words)| words)?);
    Ok(())
}
