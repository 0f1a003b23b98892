//! The `sesamec` command.

mod arguments;
mod build;
mod commands;
mod fmt;
mod gap;
mod import;
mod lab;
mod monitor;
mod owner;
mod progress;
mod python;
mod results;
mod runner;
mod scan;
mod search_space;
mod select;
mod shell;
mod study;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use sesame_codegen::environment::{EnvironmentOptions, RuntimeChoice};
use sesame_codegen::project;
use sesame_runtime::cli::{Internal, Running, Showing};

use self::arguments::{Deny, Diagnostics, ExplainFormat, Generation, Purpose};
use crate::frontend::Language;

pub use shell::Shell;

const EXIT_CODES: &str = "Exit codes: 0 success, 1 errors in the input or generated files out of date, 2 wrong usage; \
                          `run` and the other commands of a campaign have the exit codes of its runner; see their \
                          `--help`.";

/// Checks `.sesame` spaces, runs test campaigns of robots, and generates their runners.
#[derive(Debug, Parser)]
#[command(name = "sesamec", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Create a new project: a space with a small simulator.
    New {
        /// The folder of the project; its last part becomes the name of the space.
        folder: PathBuf,
        /// A simulator in Python instead of Rust: nothing is compiled.
        #[arg(long)]
        python: bool,
        /// Where the runtime comes from: `path:FOLDER` or a version.
        #[arg(long, value_parser = RuntimeChoice::parse, conflicts_with = "python")]
        runtime: Option<RuntimeChoice>,
        /// A folder with templates that replace sesamec's own by name; see docs/sesamec.md.
        #[arg(long, value_name = "FOLDER")]
        templates: Option<PathBuf>,
    },
    /// Check a space and report all errors and warnings.
    Check {
        /// The `.sesame` file.
        file: PathBuf,
        /// Exit with code 1 if there is any diagnostic of this kind.
        #[arg(long, value_name = "KIND")]
        deny: Option<Deny>,
        #[command(flatten)]
        diagnostics: Diagnostics,
    },
    /// Format `.sesame` files. Only white space changes.
    Fmt {
        /// Files, folders with `.sesame` files, or `-` for standard input to standard output; the `.sesame` files in
        /// the current folder if omitted.
        files: Vec<PathBuf>,
        /// Write nothing; show what would change, and exit with code 1 if anything would change.
        #[arg(long)]
        check: bool,
        #[command(flatten)]
        diagnostics: Diagnostics,
    },
    /// Generate the test runners of a space, and stubs for missing hooks.
    Generate {
        #[command(flatten)]
        generation: Generation,
        /// Write a monitor of the space as a program, instead of runners.
        #[arg(long, value_name = "NAME", conflicts_with = "campaign")]
        eddi: Option<String>,
        /// Write types and stubs of hooks in Python beside the file, or into the folder that `-o` names, instead of
        /// runners.
        #[arg(long, conflicts_with_all = ["campaign", "eddi", "runtime", "self_contained", "vendor"])]
        python: bool,
        /// Write nothing; exit with code 1 if anything would be written.
        #[arg(long, conflicts_with = "force")]
        check: bool,
        /// Write nothing; show what would be written, and how files would change.
        #[arg(long, conflicts_with = "check")]
        dry_run: bool,
        /// Put copies of the hooks into each runner's own `src/hooks/`, so that its crate can be moved. They come from
        /// the shared hooks in the output folder, or else in `runners` beside the file.
        #[arg(long)]
        self_contained: bool,
        /// Copy the runtime, the simulator's crate and all other crates in local folders into each runner, so that it
        /// builds without them. Implies `--self-contained`.
        #[arg(long)]
        vendor: bool,
    },
    /// Check and run a campaign; generate and build its runner first if the campaign needs Rust code of yours.
    #[command(after_help = "Everything after `--` goes to the runner, for example `-- --seed 7 --workers 4`.\n\n\
                            Exit codes: 1 if checking, generating or building failed, 2 wrong usage, otherwise that of the runner.")]
    Run {
        #[command(flatten)]
        generation: Generation,
        /// Generate and build the runner even if the campaign needs no Rust code of yours.
        #[arg(long)]
        build: bool,
        #[command(flatten)]
        agents: sesame_runtime::cli::FleetArgs,
        /// Arguments for the runner.
        #[arg(last = true, value_name = "RUNNER ARGUMENTS")]
        arguments: Vec<std::ffi::OsString>,
    },
    #[command(flatten)]
    Running(Running),
    #[command(flatten)]
    Showing(Showing),
    #[command(flatten)]
    Internal(Internal),
    /// Run tests of campaigns that other machines announce in a queue, until Ctrl-C.
    Agent(sesame_runtime::cli::AgentArgs),
    /// List the agents and campaigns of a queue.
    Agents(sesame_runtime::cli::AgentsArgs),
    /// Analyse the results of campaigns: what ran, fronts, points in the reduced parameter space, coverage.
    #[command(subcommand)]
    Results(results::Results),
    /// Choose the tests of a campaign that are worth running in a lab: interesting ones that differ from each other,
    /// within a budget.
    Select(select::Selected),
    /// Compare the results of a lab with those of the campaign that its tests come from: where simulation and reality
    /// differ, and by how much.
    Gap(gap::Compared),
    /// Write the page of a study: the chosen tests in the reduced space, the gap between simulation and lab, traces of
    /// both, what a compensation changed, and briefing sheets.
    Study(study::Asked),
    /// Brief people who run tests in a lab, record their runs, and find contacts in recordings.
    #[command(subcommand)]
    Lab(lab::Lab),
    /// Import a testing space of the original SESAME platform (an EMF file, `.model`), with the tests that it
    /// performed.
    Import {
        /// The `.model` file.
        file: PathBuf,
        /// The folder for the space and the results; it must be empty or must not exist.
        #[arg(long, short = 'o', value_name = "FOLDER")]
        out: PathBuf,
    },
    /// Look at a running system, and print a space of it.
    #[command(subcommand)]
    Scan(scan::Scan),
    /// Explain the code of a diagnostic, for example E0203; or something that a space declares, with all its uses.
    ///
    /// A `.sesame` file alone is a list of everything that it declares.
    ///
    /// A campaign is shown with every default written out, and with the space of its tests; a monitor with its
    /// certificate as a tree. Without a code or a name, all codes are listed. `explain wiring FILE` shows how the nodes
    /// of a ROS 2 system are remapped.
    Explain {
        /// The code, or the name; qualify a field or parameter, as in `SafetyZone.level`. Or a `.sesame` file.
        #[arg(value_name = "CODE, NAME or FILE")]
        what: Option<String>,
        /// The `.sesame` file that declares the name.
        file: Option<PathBuf>,
        /// How a definition and its uses, or all definitions, are shown: as text, or as one line of JSON.
        #[arg(long, value_enum, default_value_t, requires = "what")]
        format: ExplainFormat,
    },
    /// Print a script that completes sesamec's command line in a shell.
    #[command(
        after_help = "For example: sesamec completions bash > ~/.local/share/bash-completion/completions/sesamec"
    )]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Write the manual pages of sesamec into a folder, one for each command.
    #[command(after_help = "For example: sesamec man-pages ~/.local/share/man/man1")]
    ManPages {
        /// The folder; it is made if it is missing.
        folder: PathBuf,
    },
}

/// The commands of runners, as runners have them.
fn runners() -> clap::Command {
    Showing::augment_subcommands(Running::augment_subcommands(clap::Command::new("runner")))
}

/// The whole command line: commands of runners also say whose.
fn command_line() -> clap::Command {
    let runners = runners();
    let names = runners.get_subcommands().map(|command| command.get_name().to_owned());
    names.fold(Arguments::command(), |command, name| command.mut_subcommand(name, runner::of_a_campaign))
}

/// `sesamec man-pages`
fn man_pages(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    clap_mangen::generate_to(command_line(), folder)
        .with_context(|| format!("cannot write manual pages into {}", folder.display()))
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
    let matches = command_line().get_matches_from(arguments);
    let parsed = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let of_campaign = matches.subcommand().expect("a command is required");
    let result = match parsed.command {
        Command::New { folder, python, runtime, templates } => {
            let simulator = if python { project::Simulator::Python } else { project::Simulator::Rust };
            commands::new(shell, &folder, simulator, runtime.as_ref(), templates.as_deref())
        }
        Command::Check { file, deny, diagnostics } => {
            commands::check_only(shell, language, &file, deny, diagnostics.format)
        }
        Command::Fmt { files, check, diagnostics } => fmt::fmt(shell, language, &files, check, diagnostics.format),
        Command::Generate { generation, eddi, python, check, dry_run, self_contained, vendor } => {
            let purpose = match (check, dry_run) {
                (true, _) => Purpose::Check,
                (false, true) => Purpose::DryRun,
                (false, false) => Purpose::Write,
            };
            let options = EnvironmentOptions { self_contained, vendor, ..generation.options() };
            match eddi {
                _ if python => python::generate(shell, language, &generation, &options, purpose),
                Some(eddi) => monitor::generate(shell, language, &eddi, &generation, &options, purpose),
                None => commands::generate(shell, language, &generation, &options, purpose),
            }
        }
        Command::Run { generation, build, agents, mut arguments } => {
            arguments.extend(agents.arguments());
            runner::run(shell, language, &generation, build, &arguments)
        }
        Command::Running(command) => runner::running(shell, language, &command, of_campaign),
        Command::Showing(command) => runner::showing(shell, language, &command, of_campaign.1),
        Command::Internal(command) => Ok(sesame_runtime::cli::serve(&command)),
        Command::Agent(asked) => Ok(sesame_runtime::cli::agent(&asked)),
        Command::Agents(asked) => Ok(sesame_runtime::cli::agents(&asked)),
        Command::Results(asked) => results::results(shell, asked),
        Command::Select(asked) => select::selected(shell, &asked),
        Command::Gap(asked) => gap::compared(shell, &asked),
        Command::Study(asked) => study::write(shell, &asked),
        Command::Lab(asked) => lab::lab(shell, language, &asked),
        Command::Import { file, out } => import::import(shell, language, &file, &out),
        Command::Scan(asked) => scan::scan(shell, language, &asked),
        Command::Explain { what: Some(what), file: Some(file), format } => {
            commands::explain_name(shell, language, &what, &file, format)
        }
        Command::Explain { what: Some(file), format, .. } if file.ends_with(".sesame") => {
            commands::explain_file(shell, language, Path::new(&file), format)
        }
        Command::Explain { what: Some(what), format: ExplainFormat::Json, .. } => {
            Err(anyhow::anyhow!("`--format json` is for what a space declares: add the file of the space to `{what}`"))
        }
        Command::Explain { what: Some(what), .. } => commands::explain_code(language, &what),
        Command::Explain { what: None, .. } => commands::explainable(language),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut command_line(), "sesamec", &mut script);
            shell::asked_for(&String::from_utf8_lossy(&script)).map(|()| ExitCode::SUCCESS)
        }
        Command::ManPages { folder } => man_pages(&folder).map(|()| ExitCode::SUCCESS),
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
        command_line().debug_assert();
    }

    #[test]
    fn every_command_has_a_manual_page_with_its_options() {
        fn check(command: &clap::Command, page: &str, folder: &Path) {
            let path = folder.join(page).with_extension("1");
            let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert!(text.contains(".SH SYNOPSIS") && text.contains(".SH DESCRIPTION"), "{page}");
            for option in command.get_arguments().filter(|arg| !arg.is_hide_set()).filter_map(clap::Arg::get_long) {
                assert!(text.contains(&format!("\\-\\-{}", option.replace('-', "\\-"))), "{page} --{option}");
            }
            for command in command.get_subcommands().filter(|command| !command.is_hide_set()) {
                check(command, &format!("{page}-{}", command.get_name()), folder);
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let manual = folder.path().join("man/man1");
        man_pages(&manual).unwrap();
        check(&command_line(), "sesamec", &manual);
        let hidden = command_line().get_subcommands().filter(|it| it.is_hide_set()).count();
        let pages = std::fs::read_dir(&manual).unwrap().count();
        assert!(hidden > 0 && pages > 60, "{hidden} hidden, {pages} pages");
    }

    #[test]
    fn the_page_on_the_commands_has_every_option() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/sesamec.md");
        let page = std::fs::read_to_string(page).unwrap();
        let section = |page: &str, heading: String| {
            let (_, section) = page.split_once(&heading).unwrap_or_else(|| panic!("no section{heading}"));
            section.split("\n## ").next().unwrap().to_owned()
        };
        let guide = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide/running.md");
        let guide = section(&std::fs::read_to_string(guide).unwrap(), "\n## Running again\n".to_owned());
        let (runners, command) = (runners(), command_line());
        let mut missing = Vec::new();
        for command in command.get_subcommands().filter(|command| !command.is_hide_set()) {
            let name = command.get_name();
            let section = if runners.find_subcommand(name).is_some() {
                let section = section(&page, "\n## Commands of runners\n".to_owned());
                assert!(section.contains(&format!("`sesamec {name}`")), "{name}");
                assert!(guide.contains(&format!("| `{name}")), "{name} is not in the guide");
                section + &guide
            } else {
                section(&page, format!("\n## `sesamec {name}`\n"))
            };
            let nested = command.get_subcommands().flat_map(clap::Command::get_arguments);
            for option in command.get_arguments().chain(nested).filter_map(clap::Arg::get_long) {
                let named = section.contains(&format!("`--{option}")) || section.contains(&format!(" --{option}"));
                if !named {
                    missing.push(format!("{name} --{option}"));
                }
            }
        }
        assert_eq!(missing, [""; 0]);
        for name in sesame_templates::ALL.iter().map(|(name, _)| name) {
            assert!(page.contains(&format!("| `{name}` |")), "{name}");
        }
    }

    #[test]
    fn a_runner_is_given_what_its_command_was_given() {
        let lines = [
            &["replay", "a.sesame", "-c", "x", "T5"][..],
            &["replay", "a.sesame", "T5", "--results", "r/1", "--format", "json", "--timeout", "2.5"],
            &["known", "--out", "o", "a.sesame", "one", "two", "--fail-on", "violation,crash", "--junit=-j"],
            &["confirm", "a.sesame", "-n", "3", "--violations", "--workers", "2"],
            &["repeat", "a.sesame", "T5", "7", "--allow-unheard"],
            &["shrink", "a.sesame", "--requirement", "R1", "--requirement", "R2", "--", "T5"],
            &["shrink", "a.sesame", "--violations", "--budget", "60", "--messages"],
        ];
        for line in lines {
            let matches = command_line().get_matches_from(["sesamec"].iter().chain(line));
            let (name, of_command) = matches.subcommand().unwrap();
            let passed = runner::passed_on(&runners(), name, of_command);
            let again =
                runners().get_matches_from([std::ffi::OsString::from("runner"), name.into()].into_iter().chain(passed));
            let given = |matches: &clap::ArgMatches| format!("{:?}", Running::from_arg_matches(matches).unwrap());
            assert_eq!(given(&matches), given(&again), "{line:?}");
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
        let Command::Run { generation, arguments, .. } = arguments.command else { panic!("{arguments:?}") };
        assert_eq!(generation.campaign.as_deref(), Some("x"));
        assert_eq!(arguments, ["--seed", "7"]);
        assert!(Arguments::try_parse_from(["sesamec", "run", "a.sesame", "--seed", "7"]).is_err());
    }
}
