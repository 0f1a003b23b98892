//! The runners of a project's campaigns, from the project: `run`, and the commands that every runner has.
//!
//! A campaign whose simulator is a program and that uses no hooks is interpreted: the runtime is linked into `sesamec`,
//! and its plan says everything. The runner of any other campaign is a crate, which is generated and built first.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context as _, bail};
use clap::{Arg, ArgAction, ArgMatches, Subcommand as _};
use sesame_runtime::Interpreted;
use sesame_runtime::cli::{CALLER, Caller, Running, Showing};

use super::arguments::Generation;
use super::build;
use super::commands::{all, check, choose, write};
use super::shell::{self, Format, Shell};
use crate::emit;
use crate::environment::{self, Options};
use crate::frontend::{Checked, Language};
use crate::names;
use crate::output::Mode;
use crate::plan::RunnerPlan;
use crate::unfilled::unfilled_objectives;

/// The campaign whose runner a command is for.
#[derive(Debug)]
pub(super) struct RunnerOf {
    file: PathBuf,
    campaign: Option<String>,
    out: Option<PathBuf>,
}

/// Names of the arguments that say which campaign it is.
const FILE: &str = "space_file";
const CAMPAIGN: &str = "space_campaign";
const OUT: &str = "runners_folder";

impl RunnerOf {
    /// A command of runners, with the arguments that say whose.
    pub(super) fn arguments(mut command: clap::Command) -> clap::Command {
        let others: Vec<clap::Id> =
            command.get_arguments().filter(|arg| arg.is_positional()).map(|arg| arg.get_id().clone()).collect();
        for (position, id) in (2..).zip(others) {
            command = command.mut_arg(id, |arg| arg.index(position));
        }
        command.args([
            Arg::new(FILE)
                .index(1)
                .required(true)
                .value_name("FILE")
                .value_parser(clap::value_parser!(PathBuf))
                .help("The `.sesame` file"),
            Arg::new(CAMPAIGN)
                .long("campaign")
                .short('c')
                .value_name("CAMPAIGN")
                .help("The campaign; if omitted, the only one"),
            Arg::new(OUT)
                .long("out")
                .short('o')
                .value_name("FOLDER")
                .value_parser(clap::value_parser!(PathBuf))
                .help("The folder with the runners; if omitted, `runners` beside the file"),
        ])
    }

    /// What the command line says.
    pub(super) fn named(matches: &ArgMatches) -> Self {
        RunnerOf {
            file: matches.get_one::<PathBuf>(FILE).expect("it is required").clone(),
            campaign: matches.get_one::<String>(CAMPAIGN).cloned(),
            out: matches.get_one::<PathBuf>(OUT).cloned(),
        }
    }

    /// How its commands are called, for hints that can be copied.
    fn caller(&self, several: bool, name: &str) -> Caller {
        let mut arguments = vec![self.file.display().to_string()];
        if several {
            arguments.extend(["--campaign".to_owned(), name.to_owned()]);
        }
        if let Some(out) = &self.out {
            arguments.extend(["--out".to_owned(), out.display().to_string()]);
        }
        Caller { program: shell::command().to_owned(), arguments }
    }

    /// The folder of its runner.
    fn folder(&self, name: &str) -> PathBuf {
        let out = self.out.clone().unwrap_or_else(|| self.file.with_file_name(environment::RUNNERS));
        out.join(names::campaign_folder(name))
    }

    fn generation(&self) -> Generation {
        Generation::of(self.file.clone(), self.campaign.clone(), self.out.clone())
    }

    /// The runner as data, if the campaign needs no Rust.
    fn interpreted(&self, runner: &RunnerPlan, options: &Options) -> anyhow::Result<Option<Interpreted>> {
        if runner.needs_rust() || environment::runtime_is_chosen(&self.file, options)? {
            return Ok(None);
        }
        let (space, simulator) = environment::program_folders(&self.file, runner)?;
        let folder = self.folder(&runner.plan.campaign.name);
        if self.out.is_none() && folder.parent().is_some_and(Path::is_symlink) {
            bail!("{} is a link; choose the folder for the runners with `-o`", folder.with_file_name("").display());
        }
        let directory = std::path::absolute(&folder).with_context(|| format!("cannot find {}", folder.display()))?;
        Ok(Some(Interpreted { plan: emit::plan_json(runner), directory, space, simulator }))
    }
}

/// `sesamec run`
pub(super) fn run(
    shell: Shell,
    language: &Language,
    generation: &Generation,
    build: bool,
    arguments: &[OsString],
) -> anyhow::Result<ExitCode> {
    let checked = check(shell, language, &generation.file, generation.diagnostics.format)?;
    let chosen = choose(&checked, &generation.file, generation.campaign.as_deref())?;
    let runner = &checked.plans[chosen];
    let named =
        RunnerOf { file: generation.file.clone(), campaign: generation.campaign.clone(), out: generation.out.clone() };
    let caller = named.caller(checked.plans.len() > 1, &runner.plan.campaign.name);
    if !build && let Some(interpreted) = named.interpreted(runner, &generation.options())? {
        return Ok(sesame_runtime::cli::interpret(&interpreted, caller, arguments));
    }
    let allowed = arguments.iter().any(|argument| argument == "--allow-unimplemented");
    compiled(shell, generation, &checked, chosen, &caller, arguments, allowed)
}

/// A command that runs tests.
pub(super) fn running(
    shell: Shell,
    language: &Language,
    command: &Running,
    (name, matches): (&str, &ArgMatches),
) -> anyhow::Result<ExitCode> {
    let named = RunnerOf::named(matches);
    let checked = check(shell, language, &named.file, Format::Human)?;
    let chosen = choose(&checked, &named.file, named.campaign.as_deref())?;
    let runner = &checked.plans[chosen];
    let caller = named.caller(checked.plans.len() > 1, &runner.plan.campaign.name);
    if let Some(interpreted) = named.interpreted(runner, &Options::default())? {
        return Ok(sesame_runtime::cli::carry_out(command, &interpreted, caller));
    }
    let mut arguments = vec![OsString::from(name)];
    arguments.extend(passed_on(&Running::augment_subcommands(clap::Command::new("runner")), name, matches));
    compiled(shell, &named.generation(), &checked, chosen, &caller, &arguments, true)
}

/// A command that shows results. The space is read only if the campaign is not named.
pub(super) fn showing(
    shell: Shell,
    language: &Language,
    command: &Showing,
    matches: &ArgMatches,
) -> anyhow::Result<ExitCode> {
    let named = RunnerOf::named(matches);
    let name = match &named.campaign {
        Some(name) if named.folder(name).join("results").is_dir() => name.clone(),
        name => {
            let checked = check(shell, language, &named.file, Format::Human)?;
            let chosen = choose(&checked, &named.file, name.as_deref())?;
            checked.plans[chosen].plan.campaign.name.clone()
        }
    };
    Ok(sesame_runtime::cli::show(command, &named.folder(&name).join("results")))
}

/// The arguments of a runner's command, as a runner's own command line takes them.
pub(super) fn passed_on(runners: &clap::Command, name: &str, matches: &ArgMatches) -> Vec<OsString> {
    let command = runners.find_subcommand(name).expect("it is a command of runners");
    let given =
        |arg: &&Arg| matches.value_source(arg.get_id().as_str()) == Some(clap::parser::ValueSource::CommandLine);
    let (positional, options): (Vec<&Arg>, Vec<&Arg>) =
        command.get_arguments().filter(given).partition(|arg| arg.is_positional());
    let values = |arg: &Arg| matches.get_raw(arg.get_id().as_str()).into_iter().flatten().map(OsString::from);
    let mut passed = Vec::new();
    for arg in options {
        let flag = OsString::from(format!("--{}", arg.get_long().expect("options of runners have long names")));
        if matches!(arg.get_action(), ArgAction::SetTrue) {
            passed.push(flag);
        } else {
            // In one word, so that a value may begin with a hyphen.
            passed.extend(values(arg).map(|value| [flag.clone(), "=".into(), value].into_iter().collect::<OsString>()));
        }
    }
    if !positional.is_empty() {
        passed.push("--".into());
        passed.extend(positional.into_iter().flat_map(values));
    }
    passed
}

/// Generates and builds a runner, and becomes it.
fn compiled(
    shell: Shell,
    generation: &Generation,
    checked: &Checked,
    chosen: usize,
    caller: &Caller,
    arguments: &[OsString],
    allow_unfilled: bool,
) -> anyhow::Result<ExitCode> {
    let mode = if generation.force { Mode::Force } else { Mode::Write };
    let (out, _) = write(shell, generation, &generation.options(), checked, &[chosen], mode)?;
    let runner = &checked.plans[chosen];
    let campaign = &runner.plan.campaign.name;
    if !allow_unfilled {
        let unfilled = unfilled_objectives(runner, &out.join("hooks"));
        if !unfilled.is_empty() {
            let said = unfilled.iter().map(|(metric, file)| {
                format!(
                    "the hook of `{metric}` is not filled in yet, and `{campaign}` optimises it: fill in {}",
                    file.display()
                )
            });
            let mut said: Vec<String> = said.collect();
            if let Some(last) = said.last_mut() {
                last.push_str("\n  or pass `-- --allow-unimplemented` to see everything else work");
            }
            return Err(all(&said));
        }
    }
    let program = build::build(shell, &out.join(names::campaign_folder(campaign)), campaign)?;
    let mut runner = Command::new(&program);
    runner.args(arguments).env(CALLER, serde_json::to_string(caller)?);
    start(runner).with_context(|| format!("cannot run {}", program.display()))
}

/// Becomes the runner: Ctrl-C and exit code are then its own.
#[cfg(unix)]
fn start(mut runner: Command) -> std::io::Result<ExitCode> {
    use std::os::unix::process::CommandExt as _;
    Err(runner.exec())
}

/// Waits for the runner, which gets Ctrl-C from the console as well.
#[cfg(not(unix))]
fn start(mut runner: Command) -> std::io::Result<ExitCode> {
    let code = runner.status()?.code().unwrap_or(1);
    Ok(u8::try_from(code).map_or(ExitCode::FAILURE, ExitCode::from))
}
