//! `run` and `resume`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use sesame_plan::Task;
use sesame_record as record;
use sesame_record::Recorder;

#[cfg(feature = "agents")]
use crate::campaign::Place;
use crate::cli::execution::{
    Elsewhere, ExecutionArgs, OutputArgs, begin, claim_files, execute_at, refuse_unfilled, shown,
};
use crate::cli::failure::Failure;
#[cfg(feature = "agents")]
use crate::cli::fleet::{FleetArgs, Reached};
use crate::cli::over_budget::refuse_over_budget;
use crate::cli::results_folder::{open, refuse_other_model, run_folder};
use crate::cli::session::{Session, World};

/// How a campaign is run. Nothing here but the seed and the number of evaluations changes results.
#[derive(Debug, Args)]
pub(super) struct RunArgs {
    /// The seed that determines everything; by default the campaign's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Evaluate this many tests instead of the campaign's number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    evaluations: Option<u32>,
    /// Run with the simulation as `compensate` fitted it to a lab: the folder with its results, for example
    /// `results/42-hall-compensated`
    #[arg(long, value_name = "DIR")]
    compensation: Option<PathBuf>,
    /// Run although a hook of an objective is still a stub: tests then count as unmeasured
    #[arg(long)]
    allow_unimplemented: bool,
    /// Run although the latest `mitm` of the same plan exceeded the relay budget
    #[arg(long)]
    over_budget: bool,
    /// Folder for results; by default `results` in the runner's folder
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    world: World,
    #[cfg(feature = "agents")]
    #[command(flatten)]
    fleet: FleetArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// How a stopped run is taken up again.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// Folder of the run, for example `results/42`; by default the latest that is unfinished
    #[arg(value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    world: World,
    #[cfg(feature = "agents")]
    #[command(flatten)]
    fleet: FleetArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn run(session: &Session, args: &RunArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let Session { plan, results, .. } = session;
    let mut plan = plan.clone();
    if let Some(wanted) = args.evaluations {
        plan.campaign.search.set_evaluations(wanted);
    }
    let seed = args.seed.unwrap_or(plan.campaign.seed);
    let mut name = format!("{seed}{}", args.world.suffix());
    if let Some(folder) = &args.compensation {
        let compensated = open(results, Some(folder))?;
        refuse_other_model(session, &compensated)?;
        let Some(compensation) = compensated.plan().compensation.clone() else {
            return Err(Failure(format!(
                "{} has no compensation: `compensate` fits the simulation to a lab and records one",
                shown(compensated.path())
            )));
        };
        name = compensated_name(&name, &compensation.lab);
        plan.compensation = Some(compensation);
    }
    let results = args.results.as_deref().unwrap_or(results);
    if !args.over_budget {
        refuse_over_budget(session, results)?;
    }
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(session, &plan, args.allow_unimplemented)?;
    #[cfg(feature = "agents")]
    let reached = args.fleet.reach()?;
    let (recorder, folder) = begin(session, results, &name, &plan, &Task::Campaign, seed, &args.execution)?;
    #[cfg(feature = "agents")]
    let elsewhere = elsewhere(reached, &args.fleet, session, &recorder, &folder)?;
    #[cfg(not(feature = "agents"))]
    let elsewhere = Elsewhere::here();
    execute_at(session, recorder, &folder, elsewhere, &args.execution, &args.output, files)
}

/// Where the tests of a run are carried out.
#[cfg(feature = "agents")]
fn elsewhere(
    reached: Option<Reached>,
    fleet: &FleetArgs,
    session: &Session,
    recorder: &Recorder,
    folder: &Path,
) -> Result<Elsewhere, Failure> {
    let Some(reached) = reached else { return Ok(Elsewhere::here()) };
    let campaign = recorder.repository().campaign();
    let agents = reached.fleet(session, &campaign.plan, folder, campaign.seed)?;
    Ok(Elsewhere { place: Place::Fleet(Box::new(agents)), options: fleet.shown() })
}

/// The name of the results of a campaign whose simulation is compensated for a lab.
pub(super) fn compensated_name(seed: &str, lab: &str) -> String {
    format!("{seed}-like-{lab}")
}

pub(super) fn resume(session: &Session, args: &ResumeArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let results = &session.results;
    let folder = match &args.results {
        Some(folder) => run_folder(results, folder),
        None => record::latest_unfinished(results)?.ok_or_else(|| {
            Failure(format!("there is nothing to go on with: no run in {} is unfinished", results.display()))
        })?,
    };
    let recorder = Recorder::resume(&folder, args.execution.workers(&session.plan))?;
    let task = recorder.repository().task().clone();
    #[cfg(feature = "process")]
    if let Some(lab) = task.lab() {
        let (mut session, execution) = (session.in_lab(lab)?, args.execution.one_at_a_time());
        if let Some(undisturbed) = task.undisturbed() {
            session = session.relaying(undisturbed.relayed);
        }
        return go_on(&session, recorder, &folder, Elsewhere::here(), &execution, &args.output);
    }
    if let Some(undisturbed) = task.undisturbed() {
        let (session, execution) = (session.relaying(undisturbed.relayed), args.execution.one_at_a_time());
        return go_on(&session, recorder, &folder, Elsewhere::here(), &execution, &args.output);
    }
    #[cfg(feature = "agents")]
    let elsewhere = elsewhere(args.fleet.reach()?, &args.fleet, session, &recorder, &folder)?;
    #[cfg(not(feature = "agents"))]
    let elsewhere = Elsewhere::here();
    go_on(session, recorder, &folder, elsewhere, &args.execution, &args.output)
}

fn go_on(
    session: &Session,
    recorder: Recorder,
    folder: &Path,
    elsewhere: Elsewhere,
    execution: &ExecutionArgs,
    output: &OutputArgs,
) -> Result<ExitCode, Failure> {
    let plan = &session.plan;
    if let Some(difference) = recorder.repository().campaign().plan.model_difference(plan) {
        return Err(Failure(format!(
            "the model has changed since {} was begun ({difference}). This starts anew:\n    {}",
            shown(folder),
            session.caller.command("run", &[])
        )));
    }
    let files = claim_files(&session.runner, plan)?;
    refuse_unfilled(session, plan, true)?;
    execute_at(session, recorder, folder, elsewhere, execution, output, files)
}
