//! `repeat`: one test again and again, with another seed of the simulator each time.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, KnownTest, Task, Test};
use sesame_rng::derive_seed;

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::session::{Session, World};

/// Which test is repeated, and how.
#[derive(Debug, Args)]
pub struct RepeatArgs {
    /// A regression test's name, or a recorded test, for example `T158`
    test: String,
    /// The number of runs
    #[arg(value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    times: u32,
    /// Folder of the run that recorded the test, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder in which the results get a folder of their own; by default beside the run that recorded the test
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// The seed that determines the simulator's seeds; by default one of this test's own, so that the run that found it
    /// is not repeated
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// A test to be repeated.
struct Repeated {
    name: String,
    test: Test,
    /// What the campaign is made of, and its seed.
    plan: CampaignPlan,
    seed: u64,
    /// Where its results go by default.
    results: PathBuf,
}

pub(super) fn repeat(session: &Session, args: &RepeatArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let Session { plan, results, .. } = session;
    let declared = plan.tests.iter().find(|test| test.name == args.test && args.results.is_none());
    let Repeated { name, test, plan, seed, results } = match declared {
        Some(KnownTest { name, test, .. }) => Repeated {
            name: name.clone(),
            test: test.clone(),
            plan: plan.clone(),
            seed: plan.campaign.seed,
            results: results.to_owned(),
        },
        None => recorded(session, args)?,
    };
    let seed = args.seed.unwrap_or_else(|| derive_seed(seed, &format!("repeat {name}"), &[]));
    let folder_name = format!("repeat-{name}");
    let task = Task::Repeat { name, test, times: args.times };
    let plan = task.plan(&plan);
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(session, &plan, true)?;
    let results = args.into.as_deref().unwrap_or(&results);
    let (recorder, folder) = begin(session, results, &folder_name, &plan, &task, seed, &args.execution)?;
    execute(session, recorder, &folder, &args.execution, &args.output, files)
}

fn recorded(session: &Session, args: &RepeatArgs) -> Result<Repeated, Failure> {
    let results = &session.results;
    let repository = open(results, args.results.as_deref())?;
    let number = repository.find(&args.test)?;
    refuse_changed(session, &repository, number)?;
    let run = repository.path().parent().unwrap_or(results);
    Ok(Repeated {
        name: TestNumber(number).to_string(),
        test: repository.test(number)?.test,
        plan: repository.plan().clone(),
        seed: repository.campaign().seed,
        results: run.parent().unwrap_or(run).to_owned(),
    })
}
