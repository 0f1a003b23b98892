//! `null`: the scenario without disturbance and without a relay, in simulation and in a lab.

use std::process::ExitCode;

use clap::Args;

use sesame_plan::{Lab, Task, Undisturbed};
use sesame_record::Repository;
use sesame_report::preparation;
use sesame_rng::derive_seed;

use crate::cli::execution::{ExecutionArgs, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::preparation::{Call, Found, PreparationArgs, Work, carry_out, lab_of};
use crate::cli::session::Session;

/// How often the scenario is run, and where.
#[derive(Debug, Args)]
pub struct NullArgs {
    /// The number of runs on each side
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// The lab; by default the only one of the space that runners reach, if there is exactly one
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The seed that determines the simulator's seeds; by default the campaign's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    preparation: PreparationArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

pub(super) fn null(session: &Session, args: &NullArgs) -> Result<ExitCode, Failure> {
    let lab = lab_of(&session.plan, args.lab.as_deref())?;
    refuse_unfilled(session, &session.plan, true)?;
    let seed = args.seed.unwrap_or(session.plan.campaign.seed);
    let mut command = vec!["null".to_owned(), "--runs".to_owned(), args.runs.to_string()];
    command.extend(lab.iter().flat_map(|lab| ["--lab".to_owned(), lab.name.clone()]));
    command.extend(args.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
    let call = Call { name: "null", command, args: &args.preparation, execution: &args.execution };
    carry_out(session, call, |work| {
        let mut found = Found::default();
        let ended = observe(session, work, lab, args.runs, seed, &mut found)?;
        Ok(ended.then_some(found))
    })
}

/// Runs the scenario on both sides and compares; false if the user stopped it.
pub(super) fn observe(
    session: &Session,
    work: &Work<'_>,
    lab: Option<&Lab>,
    runs: u32,
    seed: u64,
    found: &mut Found,
) -> Result<bool, Failure> {
    let side = |session: &Session, lab: Option<&Lab>| -> Result<Option<Repository>, Failure> {
        // The lab has seeds of its own: equal ones would make a stand-in for the lab repeat the runs of the simulation.
        let seed = lab.map_or(seed, |lab| derive_seed(seed, &format!("lab {}", lab.name), &[]));
        let name = lab.map(|lab| lab.name.clone());
        let task = Task::Undisturbed(Undisturbed { runs, relayed: 0, equal_seeds: false, lab: name });
        let session = session.relaying(0);
        let plan = task.plan(&session.plan);
        work.runs(&session, lab.map_or("simulation", |_| "lab"), &task, &plan, seed, lab.is_some())
    };
    let Some(simulation) = side(session, None)? else { return Ok(false) };
    let mut in_lab = None;
    if let Some(lab) = lab {
        let Some(repository) = side(&session.in_lab(&lab.name)?, Some(lab))? else { return Ok(false) };
        in_lab = Some((lab, repository));
    }
    let compared = in_lab.as_ref().map(|(lab, repository)| (*lab, repository));
    found.preparation.null = Some(preparation::null(&simulation, compared)?);
    found.files.push(("Without disturbance, simulation".to_owned(), simulation));
    let named = |(lab, repository): (&Lab, Repository)| (format!("Without disturbance, lab {}", lab.name), repository);
    found.files.extend(in_lab.map(named));
    Ok(true)
}
