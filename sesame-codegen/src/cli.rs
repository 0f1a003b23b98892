//! The `sesamec` command.

mod arguments;
mod build;
mod commands;
mod fmt;
mod import;
mod progress;
mod results;
mod search_space;
mod shell;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};

use self::arguments::{Deny, Diagnostics, Generation, Purpose};
use crate::environment::{Options, RuntimeChoice};
use crate::frontend::Language;

pub use shell::Shell;

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
        /// A folder with templates in place of sesamec's own, by their names; see the page on the compiler's commands.
        #[arg(long, value_name = "FOLDER")]
        templates: Option<PathBuf>,
    },
    /// Check a space, and say all that is wrong with it.
    Check {
        /// The `.sesame` file.
        file: PathBuf,
        /// Exit with 1 if there is anything of this kind.
        #[arg(long, value_name = "KIND")]
        deny: Option<Deny>,
        #[command(flatten)]
        diagnostics: Diagnostics,
    },
    /// Bring `.sesame` files into the one layout. Nothing but blanks and line ends is changed.
    Fmt {
        /// The files, or folders whose `.sesame` files are meant, and `-` for standard input to standard output; those
        /// in this folder if not said.
        files: Vec<PathBuf>,
        /// Write nothing; show what would change, and exit with 1 if anything would.
        #[arg(long)]
        check: bool,
        #[command(flatten)]
        diagnostics: Diagnostics,
    },
    /// Generate the test runners of a space, and stubs for hooks that are not there yet.
    Generate {
        #[command(flatten)]
        generation: Generation,
        /// Write nothing; exit with 1 if anything would be written.
        #[arg(long, conflicts_with = "force")]
        check: bool,
        /// Write nothing; show what would be written, and how files would change.
        #[arg(long, conflicts_with = "check")]
        dry_run: bool,
        /// Put the hooks into each runner's own `src/hooks/`, for a crate that is to be moved elsewhere. They start
        /// from the shared ones: those in the output folder, or else in `runners` beside the file.
        #[arg(long)]
        self_contained: bool,
        /// Copy the runtime, the simulator's crate and all others that are in folders into each runner, which then
        /// builds without them; `--self-contained` besides.
        #[arg(long)]
        vendor: bool,
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
    /// Import a testing space of the original SESAME platform (an EMF file, `.model`), with the tests that it
    /// performed.
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
    /// Print a script that completes sesamec's command line in a shell.
    #[command(
        after_help = "For example: sesamec completions bash > ~/.local/share/bash-completion/completions/sesamec"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
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
        Command::New { folder, runtime, templates } => {
            commands::new(shell, &folder, runtime.as_ref(), templates.as_deref())
        }
        Command::Check { file, deny, diagnostics } => {
            commands::check_only(shell, language, &file, deny, diagnostics.format)
        }
        Command::Fmt { files, check, diagnostics } => fmt::fmt(shell, language, &files, check, diagnostics.format),
        Command::Generate { generation, check, dry_run, self_contained, vendor } => {
            let purpose = match (check, dry_run) {
                (true, _) => Purpose::Check,
                (false, true) => Purpose::DryRun,
                (false, false) => Purpose::Write,
            };
            let options = Options { self_contained, vendor, ..generation.options() };
            commands::generate(shell, language, &generation, &options, purpose)
        }
        Command::Run { generation, arguments } => commands::run(shell, language, &generation, &arguments),
        Command::Results(asked) => results::results(shell, asked),
        Command::Import { file, out } => import::import(shell, language, &file, &out),
        Command::Explain { what, file: Some(file) } => commands::explain_campaign(shell, language, &what, &file),
        Command::Explain { what, file: None } => commands::explain_code(language, &what),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "sesamec", &mut script);
            shell::asked_for(&String::from_utf8_lossy(&script)).map(|()| ExitCode::SUCCESS)
        }
    };
    result.unwrap_or_else(|failure| {
        shell.failure(&failure);
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn the_page_on_the_commands_has_every_option() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/sesamec.md");
        let page = std::fs::read_to_string(page).unwrap();
        for command in Arguments::command().get_subcommands() {
            let heading = format!("\n## `sesamec {}`\n", command.get_name());
            let section = page.split_once(&heading).unwrap_or_else(|| panic!("no section{heading}")).1;
            let section = section.split("\n## ").next().unwrap();
            let nested = command.get_subcommands().flat_map(clap::Command::get_arguments);
            for option in command.get_arguments().chain(nested).filter_map(clap::Arg::get_long) {
                assert!(
                    section.contains(&format!("`--{option}")) || section.contains(&format!(", `--{option}")),
                    "{option}"
                );
            }
        }
        for name in sesame_templates::ALL.iter().map(|(name, _)| name) {
            assert!(page.contains(&format!("| `{name}` |")), "{name}");
        }
    }

    #[test]
    fn a_dry_run_and_a_check_are_two_things() {
        assert!(Arguments::try_parse_from(["sesamec", "generate", "a.sesame", "--check", "--dry-run"]).is_err());
        assert!(Arguments::try_parse_from(["sesamec", "generate", "a.sesame", "--dry-run", "--force"]).is_ok());
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
