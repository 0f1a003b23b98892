//! What all commands that run tests share: how they work, and how they end.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use sesame_plan::{CampaignPlan, Domain, MetricId, Task};
use sesame_record as record;
use sesame_record::{Recorder, Repository};
use sesame_relay::files::SpaceFiles as _;
use sesame_relay::fuzz::unimplemented_operations;
use sesame_relay::metric::unimplemented_hooks;
use sesame_report as report;
use sesame_report::Summary;

use crate::campaign::{CampaignEnd, CampaignError, Place, Settings, run_campaign};
use crate::changed_files::ChangedFiles;
use crate::cli::failure::{Failure, STOPPED};
use crate::cli::gate::Gate;
use crate::cli::progress::{Display, Waiting};
use crate::cli::progress_line::wait;
use crate::cli::session::Session;
use crate::cli::terminal::Format;
use crate::cli::terminal::{print, print_json, say, text_options};
use crate::runner::Runner;

/// The most worker processes that may be asked for. Each is a process with a simulator of its own, and takes one of the
/// supervisor's open files, of which systems permit 1024 by default. Results do not depend on how many there are, and
/// more than a machine has processors gain something only where simulators wait.
const MOST_WORKERS: usize = 512;

/// How tests are run.
#[derive(Debug, Default, Args)]
pub(super) struct ExecutionArgs {
    /// The number of worker processes, at most 512 and never more than tests; by default one per processor. Always one
    /// if all would use the same system, at an address without `{port}` or `{worker}`
    #[arg(long, value_name = "N", value_parser = workers)]
    workers: Option<NonZeroUsize>,
    /// Seconds of wall time after which a test is stopped; by default 20 times the reference run, at least 60
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
    /// Seconds of wall time after which the first reference run is stopped; by default those of `--timeout`, or 600
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    reference_timeout: Option<Duration>,
    /// Continue although nothing receives what an operation disturbs: the simulator does not subscribe to its topic,
    /// and no outbound metric or monitor reads it
    #[arg(long)]
    allow_unheard: bool,
}

/// How a command says what was found.
#[derive(Debug, Default, Args)]
pub(super) struct OutputArgs {
    /// The format of the results; with JSON, standard output contains nothing else
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Write requirements, expectations, crashes and timeouts as JUnit test cases into this file
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    gate: Gate,
}

impl OutputArgs {
    /// How it is shown.
    #[cfg(feature = "process")]
    pub(super) fn format(&self) -> Format {
        self.format
    }
}

/// A number of workers from the command line.
fn workers(text: &str) -> Result<NonZeroUsize, String> {
    let asked: NonZeroUsize = text.parse().map_err(|_| "not a number above 0".to_owned())?;
    if asked.get() > MOST_WORKERS {
        return Err(format!(
            "at most {MOST_WORKERS}: each is a process with a simulator of its own. Leave the option out for one per processor; \
             results are the same with any number"
        ));
    }
    Ok(asked)
}

/// A length of wall time from the command line.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    if seconds.is_nan() || seconds <= 0.0 {
        return Err("must be above 0".to_owned());
    }
    match Duration::try_from_secs_f64(seconds) {
        Ok(limit) if limit.is_zero() => Err("must be a nanosecond or more".to_owned()),
        Ok(limit) => Ok(limit),
        Err(_) => Err("too long; leave the option out for the default".to_owned()),
    }
}

impl ExecutionArgs {
    /// The number of workers, for the record.
    pub(super) fn workers(&self, plan: &CampaignPlan) -> u32 {
        u32::try_from(self.processes(plan)).unwrap_or(u32::MAX)
    }

    /// What a campaign is told of it.
    pub(super) fn settings(&self, session: &Session, seed: u64, files: &Files) -> Settings {
        // A file that is changed is changed for every simulator.
        let workers = if files.may_change { 1 } else { self.processes(&session.plan) };
        if self.workers.is_some_and(|asked| asked.get() > workers) {
            let since = match session.plan.simulator.shared_address() {
                Some(address) => format!(
                    "all workers would use the one system at `{address}`; `{{port}}` or `{{worker}}` in an address gives \
                     each its own"
                ),
                None => "operations may change files".to_owned(),
            };
            say(format_args!("note: tests run one at a time, since {since}"));
        }
        Settings {
            seed,
            workers,
            timeout: self.timeout,
            reference_timeout: self.reference_timeout,
            program: session.program.clone(),
            allow_unheard: self.allow_unheard,
        }
    }

    /// The same with one worker.
    pub(super) fn one_at_a_time(&self) -> ExecutionArgs {
        let ExecutionArgs { workers: _, timeout, reference_timeout, allow_unheard } = *self;
        ExecutionArgs { workers: Some(NonZeroUsize::MIN), timeout, reference_timeout, allow_unheard }
    }

    /// The wall time after which a test is stopped, if the user says one.
    #[cfg(all(feature = "process", feature = "mcap"))]
    pub(super) fn timeout(&self) -> Option<Duration> {
        self.timeout
    }

    /// One where all would use the same system, whatever is asked for.
    fn processes(&self, plan: &CampaignPlan) -> usize {
        if plan.simulator.shared_address().is_some() {
            return 1;
        }
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get).min(MOST_WORKERS);
        self.workers.map_or_else(processors, NonZeroUsize::get)
    }
}

/// Names hooks that are not filled in; an objective among them ends the run before it starts. The hooks of a runner
/// that is a program of its own were checked when it was compiled.
pub(super) fn refuse_unfilled(session: &Session, plan: &CampaignPlan, allowed: bool) -> Result<(), Failure> {
    #[cfg(feature = "agents")]
    if session.program.of_another_process().is_some() {
        return Ok(());
    }
    let Unfilled { metrics, operations, hooks } = unfilled(session, plan);
    let mut objectives = Vec::new();
    for name in metrics {
        let is_objective = |&id: &MetricId| plan.metric(id).name == name;
        if plan.campaign.objectives.iter().any(is_objective) && !allowed {
            objectives.push(format!("`{name}`"));
        } else {
            say(format_args!("warning: the hook of metric `{name}` is not filled in yet"));
        }
    }
    for name in operations {
        say(format_args!("warning: the hook of operation `{name}` is not filled in yet: it disturbs nothing"));
    }
    if objectives.is_empty() {
        return Ok(());
    }
    let hooks = hooks.canonicalize().unwrap_or(hooks);
    Err(Failure(format!(
        "the hook of {} is not filled in yet, and the campaign is to optimise it\n  \
         fill it in: {}\n  or pass --allow-unimplemented to see everything else work",
        objectives.join(" and "),
        shown(&hooks)
    )))
}

/// Hooks that are not filled in yet.
struct Unfilled<'a> {
    metrics: Vec<&'a str>,
    operations: Vec<&'a str>,
    /// Where hooks are.
    hooks: PathBuf,
}

fn unfilled<'a>(session: &'a Session, plan: &'a CampaignPlan) -> Unfilled<'a> {
    let runner = &session.runner;
    #[cfg(feature = "process")]
    if let Some(python) = session.program.python() {
        return Unfilled {
            metrics: python.unfilled_metrics.iter().map(String::as_str).collect(),
            operations: python.unfilled_operations.iter().map(String::as_str).collect(),
            hooks: runner.directory.join(&runner.space).join(python.file.as_deref().unwrap_or_default()),
        };
    }
    let metrics = unimplemented_hooks(plan, runner.hooks).into_iter();
    let operations = unimplemented_operations(plan, runner.operations).into_iter();
    Unfilled {
        metrics: metrics.map(|id| plan.metric(id).name.as_str()).collect(),
        operations: operations.map(|id| plan.operation(id).name.as_str()).collect(),
        hooks: runner.directory.join("../hooks"),
    }
}

/// Puts back files of the space that an earlier run left changed, and keeps other runners of the space out if tests may
/// change files. A file that a test may choose and that is not there ends the run before it starts.
pub(super) fn claim_files(runner: &Runner, plan: &CampaignPlan) -> Result<Files, Failure> {
    let space = runner.directory.join(&runner.space);
    let may_change = plan.operations.iter().any(|operation| operation.kind.calls_code_outside_the_run());
    let (files, restored) = ChangedFiles::for_supervisor(&space, may_change)?;
    for path in restored {
        say(format_args!("note: an earlier run was ended while {} was changed; it has been restored", path.display()));
    }
    for operation in &plan.operations {
        for parameter in &operation.parameters {
            let Domain::Files { files: paths } = &parameter.domain else { continue };
            for path in paths {
                if !files.resolve(Path::new(path))?.is_file() {
                    return Err(Failure(format!(
                        "operation `{}` may choose the file `{path}`, which is not in {}: put it there, or leave it out",
                        operation.name,
                        shown(files.folder())
                    )));
                }
            }
        }
    }
    Ok(Files { files, may_change })
}

/// The files of the space while a command runs tests.
#[derive(Debug)]
pub(super) struct Files {
    files: ChangedFiles,
    may_change: bool,
}

impl Files {
    /// Puts back what the last worker could not; workers have ended by then.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        if self.may_change {
            self.files.restore_all()?;
        }
        Ok(())
    }
}

/// Begins the results of a run in a fresh folder of this name.
pub(super) fn begin(
    session: &Session,
    results: &Path,
    name: &str,
    plan: &CampaignPlan,
    task: &Task,
    seed: u64,
    execution: &ExecutionArgs,
) -> Result<(Recorder, PathBuf), Failure> {
    let claim = record::claim_folder(results, name)?;
    if let Some(unfinished) = &claim.unfinished {
        let resume = session.caller.command("resume", &[&shown(unfinished)]);
        say(format_args!("note: an earlier run is unfinished; this continues it:\n    {resume}"));
    }
    let folder = claim.folder.clone();
    Ok((Recorder::create_in(claim, plan, task, seed, execution.workers(plan))?, folder))
}

/// Runs a campaign to its end and says what was found.
pub(super) fn execute(
    session: &Session,
    recorder: Recorder,
    folder: &Path,
    execution: &ExecutionArgs,
    output: &OutputArgs,
    files: Files,
) -> Result<ExitCode, Failure> {
    execute_at(session, recorder, folder, Elsewhere::here(), execution, output, files)
}

/// Where tests run.
pub(super) struct Elsewhere {
    /// The executor.
    pub(super) place: Place,
    /// The options that say so, for a command that goes on with the run.
    pub(super) options: Vec<String>,
}

impl Elsewhere {
    /// On this machine.
    pub(super) fn here() -> Self {
        Elsewhere { place: Place::Here, options: Vec::new() }
    }
}

/// The same, with tests that run elsewhere.
pub(super) fn execute_at(
    session: &Session,
    recorder: Recorder,
    folder: &Path,
    Elsewhere { place, options }: Elsewhere,
    execution: &ExecutionArgs,
    output: &OutputArgs,
    files: Files,
) -> Result<ExitCode, Failure> {
    let interrupted = interruptible()?;
    let started = Instant::now();
    let before = runs(recorder.repository())?;
    let options: Vec<&str> = options.iter().map(String::as_str).collect();
    let again = |more: &[&str]| session.caller.command("resume", &[more, &options, &[&shown(folder)]].concat());
    let Some(repository) = perform_at(
        session,
        recorder,
        folder,
        place,
        execution,
        files,
        Stopping { interrupted: &interrupted, again: &again },
    )?
    else {
        return Ok(ExitCode::from(STOPPED));
    };
    let code = report_outcome(&repository, folder, &folder.join("report.html"), output)?;
    let (took, runs) = (started.elapsed(), runs(&repository)?);
    let took = if took.as_secs() < 90 { format!("{:.1} s", took.as_secs_f64()) } else { wait(took.as_secs_f64()) };
    let of_all = if before == 0 { String::new() } else { format!(" of {runs}") };
    say(format_args!("      Took {took} for {} runs{of_all}", runs - before));
    Ok(code)
}

/// Runs a campaign to its end; `None` if the user stopped it, which it prints. `again` gives the command that goes on
/// with it, with these options more.
#[cfg(feature = "process")]
pub(super) fn perform(
    session: &Session,
    recorder: Recorder,
    folder: &Path,
    execution: &ExecutionArgs,
    files: Files,
    interrupted: &AtomicBool,
    again: &dyn Fn(&[&str]) -> String,
) -> Result<Option<Repository>, Failure> {
    perform_at(session, recorder, folder, Place::Here, execution, files, Stopping { interrupted, again })
}

/// How a run is stopped, and the command that goes on with it.
#[derive(Clone, Copy)]
struct Stopping<'a> {
    interrupted: &'a AtomicBool,
    again: &'a dyn Fn(&[&str]) -> String,
}

/// The same, with tests that run elsewhere.
fn perform_at(
    session: &Session,
    recorder: Recorder,
    folder: &Path,
    place: Place,
    execution: &ExecutionArgs,
    files: Files,
    Stopping { interrupted, again }: Stopping<'_>,
) -> Result<Option<Repository>, Failure> {
    let campaign = recorder.repository().campaign();
    let (plan, seed) = (campaign.plan.clone(), campaign.seed);
    let mut settings = execution.settings(session, seed, &files);
    settings.program = settings.program.recording(plan.campaign.record.is_some());
    let mut display = Display::new(&plan, seed, execution.workers(&plan));
    let directory = folder.join("workers");
    let end = run_campaign(&plan, recorder, &settings, place, &directory, interrupted, &mut |event, progress| {
        display.update(event, progress);
    });
    display.finish();
    files.finish()?;
    let end = end.map_err(|error| {
        let continued = match &error {
            error if error.leaves_the_run_resumable() => format!("\nThis continues the run:\n    {}", again(&[])),
            CampaignError::Ineffective(_) => {
                format!("\nThis runs the campaign as it is:\n    {}", again(&["--allow-unheard"]))
            }
            _ => String::new(),
        };
        Failure(format!("{error}{continued}"))
    });
    match end? {
        CampaignEnd::Finished(repository) => Ok(Some(*repository)),
        CampaignEnd::Interrupted => {
            say(format_args!(
                "stopped; everything measured so far is kept. This continues to the same results:\n    {}",
                again(&[])
            ));
            Ok(None)
        }
    }
}

/// How many runs are recorded, repetitions among them.
fn runs(repository: &Repository) -> Result<usize, Failure> {
    let repetitions: usize = repository.repetitions()?.values().map(Vec::len).sum();
    Ok(repository.numbers()?.len() + repetitions)
}

/// One press of Ctrl-C may arrive more than once within this time: from the terminal, and from a program that started
/// this one and passes it on.
const ONE_PRESS: Duration = Duration::from_millis(500);

/// A flag that Ctrl-C sets: the first one stops in good order, a second one exits at once.
pub(super) fn interruptible() -> Result<Arc<AtomicBool>, Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    let mut first = None;
    ctrlc::set_handler(move || {
        flag.store(true, Ordering::Relaxed);
        if first.get_or_insert_with(Instant::now).elapsed() > ONE_PRESS {
            std::process::exit(i32::from(STOPPED));
        }
    })?;
    Ok(interrupted)
}

/// A run's results for programs.
#[derive(Serialize)]
struct Concluded<'a> {
    /// Folder of the results.
    results: &'a Path,
    /// The page with pictures.
    report: &'a Path,
    /// The hash of the run's content.
    digest: String,
    #[serde(flatten)]
    summary: &'a Summary,
}

/// Writes the page and the JUnit file and prints what was found.
pub(super) fn report_outcome(
    repository: &Repository,
    folder: &Path,
    page: &Path,
    output: &OutputArgs,
) -> Result<ExitCode, Failure> {
    report_against(repository, None, folder, page, output)
}

/// The same, compared with results from before certificates were mended.
pub(super) fn report_against(
    repository: &Repository,
    before: Option<&Repository>,
    folder: &Path,
    page: &Path,
    output: &OutputArgs,
) -> Result<ExitCode, Failure> {
    let waiting = Waiting::on(repository.evaluated()?, "making the page");
    let digest = repository.digest()?;
    report::write_page_against(repository, before, page, &digest)?;
    if let Some(junit) = &output.junit {
        report::write_junit(repository, junit)?;
    }
    let mut summary = report::summary(repository)?;
    summary.mend = before.map(|before| report::mend(repository, before)).transpose()?;
    drop(waiting);
    match output.format {
        Format::Text => {
            print(&report::summary_text(&summary, text_options()))?;
            print(&format!("\n    Report {}\n    Digest {digest}\n", shown(page)))?;
        }
        Format::Json => {
            print_json(&Concluded { results: folder, report: page, digest, summary: &summary })?;
        }
    }
    Ok(output.gate.code(&summary, repository))
}

/// A path as the user would type it: relative to where they are, if it is below.
pub(super) fn shown(path: &Path) -> String {
    let here = std::env::current_dir().ok();
    let relative = here.as_deref().and_then(|here| path.strip_prefix(here).ok());
    relative.unwrap_or(path).display().to_string()
}
