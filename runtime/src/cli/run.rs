//! `run` and `resume`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use sesame_plan::{CampaignPlan, Search};

use super::progress::{Display, wait};
use super::{Failure, STOPPED, print, text_options};
use crate::campaign::{Conducted, Settings, conduct};
use crate::metric::unimplemented_hooks;
use crate::record::{self, Claim, Recorder, Repository};
use crate::report;
use crate::runner::Runner;

/// How a campaign is run. Nothing here but the seed and the number of evaluations changes results.
#[derive(Debug, Args)]
pub(super) struct Options {
    /// The seed that decides everything; by default the campaign's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Evaluate this many tests instead of the campaign's number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    evaluations: Option<u32>,
    /// Run although a hook of an objective is not filled in: tests then count as unmeasured
    #[arg(long)]
    allow_unimplemented: bool,
    /// Folder for results; by default `results` in the runner's folder
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    work: Work,
}

/// How a stopped run is taken up again.
#[derive(Debug, Args)]
pub(super) struct ResumeOptions {
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    work: Work,
}

#[derive(Debug, Args)]
struct Work {
    /// How many worker processes; by default one per processor
    #[arg(long, value_name = "N")]
    workers: Option<NonZeroUsize>,
    /// Seconds of wall time after which a test is stopped; by default 20 times the undisturbed run, at least 60
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    timeout: Option<Duration>,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| "must be above 0".to_owned())
}

pub(super) fn run(
    runner: &Runner,
    plan: &CampaignPlan,
    results: &Path,
    options: &Options,
) -> Result<ExitCode, Failure> {
    let mut plan = plan.clone();
    if let Some(wanted) = options.evaluations {
        match &mut plan.campaign.search {
            Search::Nsga2 { evaluations, .. } | Search::Random { evaluations } => *evaluations = wanted,
            Search::Repeat { times, .. } => *times = wanted,
        }
    }
    refuse_unfilled(runner, &plan, options.allow_unimplemented)?;
    let seed = options.seed.unwrap_or(plan.campaign.seed);
    let Claim { folder, unfinished } = record::claim_folder(options.results.as_deref().unwrap_or(results), seed)?;
    if let Some(unfinished) = unfinished {
        eprintln!("note: an earlier run is unfinished: `resume {}` goes on with it", shown(&unfinished));
    }
    let workers = options.work.workers();
    let recorder = Recorder::create(&folder, &plan, seed, count(workers))?;
    carry_out(&plan, recorder, &folder, seed, &options.work)
}

pub(super) fn resume(
    runner: &Runner,
    plan: &CampaignPlan,
    results: &Path,
    options: &ResumeOptions,
) -> Result<ExitCode, Failure> {
    let folder = match &options.results {
        Some(folder) => folder.clone(),
        None => record::latest_folder(results)?
            .ok_or_else(|| Failure(format!("there is nothing to go on with in {}", results.display())))?,
    };
    let recorder = Recorder::resume(&folder, count(options.work.workers()))?;
    let campaign = recorder.repository().campaign();
    let (recorded, seed) = (campaign.plan.clone(), campaign.seed);
    let mut comparable = recorded.clone();
    comparable.campaign.search = plan.campaign.search.clone();
    if comparable != *plan {
        return Err(Failure(format!(
            "the model has changed since {} was begun: start anew with `run`",
            shown(&folder)
        )));
    }
    refuse_unfilled(runner, plan, true)?;
    carry_out(&recorded, recorder, &folder, seed, &options.work)
}

impl Work {
    fn workers(&self) -> usize {
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.workers.map_or_else(processors, NonZeroUsize::get)
    }
}

fn count(workers: usize) -> u32 {
    u32::try_from(workers).unwrap_or(u32::MAX)
}

/// Names hooks that are not filled in; an objective among them ends the run before it starts.
fn refuse_unfilled(runner: &Runner, plan: &CampaignPlan, allowed: bool) -> Result<(), Failure> {
    let unfilled = unimplemented_hooks(plan, runner.hooks);
    let mut objectives = Vec::new();
    for id in unfilled {
        let name = &plan.metric(id).name;
        if plan.campaign.objectives.contains(&id) && !allowed {
            objectives.push(format!("`{name}`"));
        } else {
            eprintln!("warning: the hook of metric `{name}` is not filled in yet");
        }
    }
    if objectives.is_empty() {
        return Ok(());
    }
    let hooks = Path::new(runner.directory).join("../hooks");
    let hooks = hooks.canonicalize().unwrap_or(hooks);
    Err(Failure(format!(
        "the hook of {} is not filled in yet, and the campaign is to optimise it\n  \
         fill it in: {}\n  or pass --allow-unimplemented to see everything else work",
        objectives.join(" and "),
        shown(&hooks)
    )))
}

fn carry_out(
    plan: &CampaignPlan,
    recorder: Recorder,
    folder: &Path,
    seed: u64,
    work: &Work,
) -> Result<ExitCode, Failure> {
    let settings = Settings { seed, workers: work.workers(), timeout: work.timeout, program: std::env::current_exe()? };
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        // The first stops in good order; who insists is obeyed.
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(STOPPED));
        }
    })?;
    let started = Instant::now();
    let mut display = Display::new(plan, seed);
    let conducted = conduct(plan, recorder, &settings, &folder.join("workers"), &interrupted, &mut |progress| {
        display.update(progress);
    });
    display.finish();
    match conducted? {
        Conducted::Finished(repository) => {
            conclude(&repository, folder, started.elapsed())?;
            Ok(ExitCode::SUCCESS)
        }
        Conducted::Interrupted => {
            eprintln!("stopped; what was measured is kept. `resume {}` goes on to the same results", shown(folder));
            Ok(ExitCode::from(STOPPED))
        }
    }
}

/// Prints what was found and writes the page.
fn conclude(repository: &Repository, folder: &Path, took: Duration) -> Result<(), Failure> {
    let page = folder.join("report.html");
    report::write_page(repository, &page)?;
    print(&report::summary_text(&report::summary(repository)?, text_options()))?;
    let digest = repository.digest()?;
    print(&format!("\n    Report {}\n    Digest {digest}\n", shown(&page)))?;
    let tests = repository.tests()?.len();
    eprintln!(
        "      Took {} for {tests} runs",
        if took.as_secs() < 90 { format!("{:.1} s", took.as_secs_f64()) } else { wait(took.as_secs_f64()) }
    );
    Ok(())
}

/// A path as the user would type it: relative to where they are, if it is below.
fn shown(path: &Path) -> String {
    let here = std::env::current_dir().ok();
    let relative = here.as_deref().and_then(|here| path.strip_prefix(here).ok());
    relative.unwrap_or(path).display().to_string()
}
