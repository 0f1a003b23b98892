//! The runners of a project's campaigns, from the project: `run`, and the commands that every runner has.
//!
//! A campaign whose simulator is a program and that uses no hooks in Rust is interpreted: the runtime is linked into
//! `sesamec`, its plan says everything, and its workers import hooks in Python. The runner of any other campaign is a
//! crate, which is generated and built first.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context as _, bail};
use clap::{Arg, ArgAction, ArgMatches};
use sesame_codegen::output::Mode;
use sesame_codegen::plan::RunnerPlan;
use sesame_codegen::stubs::{filled_in, unfilled_objectives};
use sesame_codegen::{emit, environment, names};
use sesame_plan::python::PythonHooks;
use sesame_runtime::Interpreted;
use sesame_runtime::cli::{CALLER, Caller, EXIT_CODES, RUNNER, Running, Showing};
use sesame_runtime::transport::is_built_in;

use super::arguments::Generation;
use super::build;
use super::commands::{all, check, choose, write};
use super::owner;
use super::shell::{self, Shell};
use crate::frontend::{Checked, Language};

/// Names of the arguments that say which campaign it is.
const FILE: &str = "space_file";
const CAMPAIGN: &str = "space_campaign";
const OUT: &str = "runners_folder";

/// A command of runners, with the arguments that say whose.
pub(super) fn of_a_campaign(mut command: clap::Command) -> clap::Command {
    let others: Vec<clap::Id> =
        command.get_arguments().filter(|arg| arg.is_positional()).map(|arg| arg.get_id().clone()).collect();
    for (position, id) in (2..).zip(others) {
        command = command.mut_arg(id, |arg| arg.index(position));
    }
    command.after_help(EXIT_CODES).args([
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

/// What those arguments say.
fn named(matches: &ArgMatches) -> Generation {
    Generation::of(
        matches.get_one::<PathBuf>(FILE).expect("it is required").clone(),
        matches.get_one::<String>(CAMPAIGN).cloned(),
        matches.get_one::<PathBuf>(OUT).cloned(),
    )
}

/// The runner of a campaign that was found in its space.
struct Found<'a> {
    generation: &'a Generation,
    checked: Checked,
    /// The campaign among the plans.
    chosen: usize,
    /// How commands of this runner are called, for hints that can be copied.
    caller: Caller,
}

impl<'a> Found<'a> {
    /// Checks the space.
    fn find(shell: Shell, language: &Language, generation: &'a Generation) -> anyhow::Result<Self> {
        let checked = check(shell, language, &generation.file, generation.diagnostics.format)?;
        let chosen = choose(&checked, &generation.file, generation.campaign.as_deref())?;
        let mut arguments = vec![generation.file.display().to_string()];
        if checked.plans.len() > 1 {
            arguments.extend(["--campaign".to_owned(), checked.plans[chosen].plan.campaign.name.clone()]);
        }
        if let Some(out) = &generation.out {
            arguments.extend(["--out".to_owned(), out.display().to_string()]);
        }
        let caller = Caller { program: shell::command().to_owned(), arguments };
        Ok(Found { generation, checked, chosen, caller })
    }

    fn plan(&self) -> &RunnerPlan {
        &self.checked.plans[self.chosen]
    }

    /// The runner as data, if the campaign needs no Rust beyond these features.
    fn interpreted(&self, is_there: fn(feature: &str) -> bool) -> anyhow::Result<Option<Interpreted>> {
        if sesame_runtime::cli::carries_out_tests() {
            return self.as_data().map(Some);
        }
        if self.plan().needs_a_runner(is_there) || self.chooses_runtime()? {
            return Ok(None);
        }
        let hooks = self.plan().has_hooks().then(|| self.hooks_in_python());
        // A process that forks workers may have hooks of its own for them.
        let in_python = sesame_runtime::cli::forks_workers() || hooks.as_ref().is_some_and(|it| it.file.is_some());
        if hooks.is_some() && !in_python {
            return Ok(None);
        }
        environment::check_program(&self.generation.file, self.plan())?;
        let runner = Interpreted { hooks, ..self.as_data()? };
        Ok(Some(runner).filter(|runner| !self.has_all_hooks_in_rust(runner)))
    }

    /// Where the campaign's hooks are, if they are in Python.
    fn hooks_in_python(&self) -> PythonHooks {
        let plan = self.plan();
        let campaign = &plan.plan.campaign.name;
        let folder = self.generation.runners(&[campaign]).join("hooks");
        let file = names::python_hooks(&self.generation.file);
        let is_there = self.generation.file.with_file_name(&file).is_file();
        PythonHooks {
            file: is_there.then_some(file),
            metrics: plan.hooks.iter().map(|hook| hook.metric.clone()).collect(),
            operations: plan.operations.iter().map(|operation| operation.operation.clone()).collect(),
            in_rust: filled_in(plan, &folder)
                .into_iter()
                .map(|(name, file)| (name, file.display().to_string()))
                .collect(),
        }
    }

    /// Whether no hook that the campaign calls is in Python, and each is filled in in Rust. What is wrong with the
    /// hooks in Python is said when they are to be used.
    fn has_all_hooks_in_rust(&self, runner: &Interpreted) -> bool {
        let Some(hooks) = &runner.hooks else { return false };
        let all = self.plan().called_hooks().all(|name| hooks.in_rust.iter().any(|(filled, _)| filled == name));
        all && sesame_runtime::cli::hooks_in_python(runner).is_ok_and(|registered| registered.is_empty())
    }

    /// Whether its runner links another runtime than this program.
    fn chooses_runtime(&self) -> anyhow::Result<bool> {
        Ok(environment::runtime_is_chosen(&self.generation.file, &self.generation.options())?)
    }

    /// Its plan and its folders.
    fn as_data(&self) -> anyhow::Result<Interpreted> {
        let file = &self.generation.file;
        let (space, simulator) = environment::folders(file, self.plan())?;
        let campaign = &self.plan().plan.campaign.name;
        let folder = self.generation.own_runners(&[campaign])?.join(names::campaign_folder(campaign));
        let results = folder.join("results");
        if let Some(link) = [&folder, &results].into_iter().find(|path| path.is_symlink()) {
            bail!("{} is a link, and results are never written through links", link.display());
        }
        owner::check(file, &folder)?;
        let directory = std::path::absolute(&folder).with_context(|| format!("cannot find {}", folder.display()))?;
        Ok(Interpreted { plan: emit::plan_json(self.plan()), directory, space, simulator, hooks: None })
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
    let found = Found::find(shell, language, generation)?;
    // These concern the crate.
    let build = build || generation.force || generation.templates.is_some();
    if !build && let Some(interpreted) = found.interpreted(is_built_in)? {
        return Ok(sesame_runtime::cli::interpret(&interpreted, found.caller, arguments));
    }
    let allowed = arguments.iter().any(|argument| argument == "--allow-unimplemented");
    compiled(shell, &found, arguments, allowed)
}

/// Whether tests are to be run by agents.
fn by_agents(arguments: &[OsString]) -> bool {
    arguments.iter().any(|argument| argument == "--on" || argument.as_encoded_bytes().starts_with(b"--on="))
}

/// A command that runs tests.
pub(super) fn running(
    shell: Shell,
    language: &Language,
    command: &Running,
    (name, matches): (&str, &ArgMatches),
) -> anyhow::Result<ExitCode> {
    let generation = named(matches);
    let found = Found::find(shell, language, &generation)?;
    // No middleware is needed to read a file.
    let is_there = if command.only_reads() { |_: &str| true } else { is_built_in };
    if let Some(interpreted) = found.interpreted(is_there)? {
        return Ok(sesame_runtime::cli::carry_out(command, &interpreted, found.caller));
    }
    let mut arguments = vec![OsString::from(name)];
    arguments.extend(passed_on(&super::runners(), name, matches));
    compiled(shell, &found, &arguments, true)
}

/// A command that shows results. The space is read only if the campaign is not named.
pub(super) fn showing(
    shell: Shell,
    language: &Language,
    command: &Showing,
    matches: &ArgMatches,
) -> anyhow::Result<ExitCode> {
    let generation = named(matches);
    if let Some(run) = matches.try_get_one::<PathBuf>("results").ok().flatten().filter(|run| run.is_dir()) {
        // It says which campaign it is of.
        return Ok(sesame_runtime::cli::show(command, run));
    }
    let folder = |name: &str| generation.runners(&[name]).join(names::campaign_folder(name));
    let named = generation.campaign.as_deref().map(folder).filter(|folder| folder.join("results").is_dir());
    let folder = match named {
        Some(folder) => folder,
        None => folder(&Found::find(shell, language, &generation)?.plan().plan.campaign.name),
    };
    owner::check(&generation.file, &folder)?;
    Ok(sesame_runtime::cli::show(command, &folder.join("results")))
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
fn compiled(shell: Shell, found: &Found<'_>, arguments: &[OsString], allow_unfilled: bool) -> anyhow::Result<ExitCode> {
    let Found { generation, checked, chosen, caller } = found;
    if sesame_runtime::cli::forks_workers() {
        bail!(
            "campaign `{}` runs with Rust code of yours or another runtime, so not in a process of Python: run it with \
             `sesamec run`",
            found.plan().plan.campaign.name
        );
    }
    let hooks = found.hooks_in_python();
    let in_rust = |name: &str| hooks.in_rust.iter().any(|(filled, _)| filled == name);
    if let Some(file) = &hooks.file
        && let Some(name) = found.plan().called_hooks().find(|name| !in_rust(name))
    {
        bail!(
            "`{name}` has no hook in Rust, and {file} is Python, which a compiled runner does not call: campaign `{}` runs \
             compiled because of its simulator or the options, so write the hook in Rust",
            found.plan().plan.campaign.name
        );
    }
    build::check_cargo(found.plan())?;
    let mode = if generation.force { Mode::Force } else { Mode::Write };
    let (out, _) = write(shell, generation, &generation.options(), checked, &[*chosen], mode)?;
    let runner = found.plan();
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
    let folder = out.join(names::campaign_folder(campaign));
    let program = build::build(shell, &folder, campaign)?;
    if by_agents(arguments) {
        if found.chooses_runtime()? {
            bail!(
                "campaign `{campaign}` chooses a runtime of its own, which agents do not have: run it without `--on`, or \
                 without that choice"
            );
        }
        return Ok(sesame_runtime::cli::supervise(&program, &found.as_data()?, caller.clone(), arguments));
    }
    let mut runner = Command::new(&program);
    runner.args(arguments).env(CALLER, serde_json::to_string(caller)?).env(RUNNER, folder.canonicalize()?);
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
