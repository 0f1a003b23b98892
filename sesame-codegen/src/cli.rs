//! The `sesamec` command.

mod build;
mod commands;
mod import;
mod results;
mod shell;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::environment::RuntimeChoice;
use crate::plan::RunnerPlan;

pub use shell::Shell;

/// The language as the command needs it.
#[derive(Debug, Clone, Copy)]
pub struct Language {
    /// Checks a space: its name as diagnostics show it, its text, and whether diagnostics are coloured.
    pub check: fn(file: &str, text: &str, colour: bool) -> Checked,
    /// The page of a diagnostic's code.
    pub explain: fn(code: &str) -> Option<&'static str>,
}

/// What came of checking a space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Checked {
    /// Errors and warnings as text for a terminal; empty when there are none.
    pub diagnostics: String,
    /// How many of them are errors.
    pub errors: usize,
    /// What the space holds, for example `4 campaigns, 9 operations`.
    pub summary: String,
    /// A plan for each campaign; empty when there are errors.
    pub plans: Vec<RunnerPlan>,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 the input has errors or generated files are out of date, 2 wrong usage; \
                          `run` ends with the runner's own.";

/// Test campaigns for robots from a `.sesame` space: checks it, generates test runners, runs them.
#[derive(Debug, Parser)]
#[command(name = "sesamec", version, about, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a new project: a space, with a small simulator of its own.
    New {
        /// Its folder; the last part is the space's name.
        folder: PathBuf,
        /// Where the runtime comes from: `path:FOLDER` or a version.
        #[arg(long, value_parser = RuntimeChoice::parse)]
        runtime: Option<RuntimeChoice>,
    },
    /// Check a space, and say all that is wrong with it.
    Check {
        /// The `.sesame` file.
        file: PathBuf,
    },
    /// Generate the test runners of a space, and stubs for hooks that are not there yet.
    Generate {
        #[command(flatten)]
        generation: Generation,
        /// Write nothing; exit with 1 if anything would be written.
        #[arg(long, conflicts_with = "force")]
        check: bool,
    },
    /// Check, generate, build, and run a campaign.
    #[command(after_help = "Everything after `--` goes to the runner, for example `-- --seed 7 --workers 4`.\n\n\
                            Exit codes: 1 if the space, the generation or the build failed, 2 wrong usage, else the runner's own.")]
    Run {
        #[command(flatten)]
        generation: Generation,
        /// What the runner is told.
        #[arg(last = true, value_name = "RUNNER ARGUMENTS")]
        arguments: Vec<std::ffi::OsString>,
    },
    /// Analyse the results of campaigns: what ran, fronts, points in the reduced parameter space, coverage.
    #[command(subcommand)]
    Results(results::Results),
    /// Import a testing space of the original SESAME platform (an EMF file, `.model`), with the tests that it performed.
    Import {
        /// The file.
        file: PathBuf,
        /// The folder for the space and the results; it must be empty or not there yet.
        #[arg(long, short = 'o', value_name = "FOLDER")]
        out: PathBuf,
    },
    /// Explain the code of a diagnostic, for example E0203; or a campaign of a space, with every default written out.
    Explain {
        /// The code, or the campaign.
        #[arg(value_name = "CODE or CAMPAIGN")]
        what: String,
        /// The `.sesame` file of the campaign.
        file: Option<PathBuf>,
    },
}

/// What is generated, and where.
#[derive(Debug, clap::Args)]
struct Generation {
    /// The `.sesame` file.
    file: PathBuf,
    /// The campaign; all of them for `generate`, the only one for `run` if not said.
    #[arg(long, short)]
    campaign: Option<String>,
    /// The folder for the runners; `runners` beside the file if not said.
    #[arg(long, short = 'o', value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Overwrite generated files that were edited by hand. Hooks are never overwritten.
    #[arg(long)]
    force: bool,
    /// Where the runtime comes from: `path:FOLDER` or a version. If not said: [runtime] in sesame.toml, else the checkout
    /// that sesamec was built from, else the released version.
    #[arg(long, value_parser = RuntimeChoice::parse)]
    runtime: Option<RuntimeChoice>,
}

/// The command line of this process.
pub fn main(language: &Language) -> ExitCode {
    run(Shell::of_the_process(), language, std::env::args_os())
}

/// A command line, the program's name first. Ends the process on wrong usage and on `--help`, as clap does.
pub fn run(
    shell: Shell,
    language: &Language,
    arguments: impl IntoIterator<Item = impl Into<std::ffi::OsString> + Clone>,
) -> ExitCode {
    let result = match Arguments::parse_from(arguments).command {
        Command::New { folder, runtime } => commands::new(shell, &folder, runtime.as_ref()),
        Command::Check { file } => commands::check(shell, language, &file).map(|_| ExitCode::SUCCESS),
        Command::Generate { generation, check } => commands::generate(shell, language, &generation, check),
        Command::Run { generation, arguments } => commands::run(shell, language, &generation, &arguments),
        Command::Results(asked) => results::results(shell, asked),
        Command::Import { file, out } => import::import(shell, language, &file, &out),
        Command::Explain { what, file: Some(file) } => commands::explain_campaign(shell, language, &what, &file),
        Command::Explain { what, file: None } => commands::explain_code(language, &what),
    };
    result.unwrap_or_else(|failure| {
        shell.failure(&failure);
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn what_follows_two_dashes_is_the_runners() {
        let arguments = Arguments::parse_from(["sesamec", "run", "a.sesame", "-c", "x", "--", "--seed", "7"]);
        let Command::Run { generation, arguments } = arguments.command else { panic!("{arguments:?}") };
        assert_eq!(generation.campaign.as_deref(), Some("x"));
        assert_eq!(arguments, ["--seed", "7"]);
        assert!(Arguments::try_parse_from(["sesamec", "run", "a.sesame", "--seed", "7"]).is_err());
    }
}
