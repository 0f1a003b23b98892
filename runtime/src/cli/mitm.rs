//! `mitm`: topics pass through the relay, one more in each stage, and no operation acts on them.

use std::process::ExitCode;

use clap::Args;

use sesame_plan::{Task, TopicId, Undisturbed};
use sesame_report::preparation;

use crate::cli::execution::{ExecutionArgs, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::preparation::{Call, Found, PreparationArgs, Work, carry_out};
use crate::cli::session::Session;
use crate::lab::find;

/// How often each stage is run, and where.
#[derive(Debug, Args)]
pub struct MitmArgs {
    /// The number of runs of each stage
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// The lab in which the stages are run; by default in simulation
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The seed that determines the simulator's seed, the same for all runs; by default the campaign's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    preparation: PreparationArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

pub(super) fn mitm(session: &Session, args: &MitmArgs) -> Result<ExitCode, Failure> {
    let lab = match &args.lab {
        Some(name) => Some(find(&session.plan, Some(name))?.name.as_str()),
        None => None,
    };
    refuse_unfilled(session, &session.plan, true)?;
    let seed = args.seed.unwrap_or(session.plan.campaign.seed);
    let mut command = vec!["mitm".to_owned(), "--runs".to_owned(), args.runs.to_string()];
    command.extend(lab.iter().flat_map(|&lab| ["--lab".to_owned(), lab.to_owned()]));
    command.extend(args.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
    let call = Call { name: "mitm", command, args: &args.preparation, execution: &args.execution };
    let here;
    let session = match lab {
        Some(name) => {
            here = session.in_lab(name)?;
            &here
        }
        None => session,
    };
    if session.plan.relayable().is_empty() {
        return Err(Failure(format!("{}; `null` runs the scenario without a relay", nothing_to_relay(session))));
    }
    carry_out(session, call, |work| {
        let mut found = Found::default();
        let ended = stages(session, work, lab, args.runs, seed, &mut found)?;
        Ok(ended.then_some(found))
    })
}

/// Why there is nothing to relay.
pub(super) fn nothing_to_relay(session: &Session) -> String {
    let plan = &session.plan;
    let campaign = &plan.campaign.name;
    let needed = (0u32..).map(TopicId).take(plan.topics.len()).any(|id| plan.needed_in_step(id));
    if needed {
        format!("all topics that operations of campaign `{campaign}` act on pass through the relay in each step anyway")
    } else {
        format!("no operation of campaign `{campaign}` acts on a topic, so nothing is relayed")
    }
}

/// Runs all stages and compares them; false if the user stopped it.
pub(super) fn stages(
    session: &Session,
    work: &Work<'_>,
    lab: Option<&str>,
    runs: u32,
    seed: u64,
    found: &mut Found,
) -> Result<bool, Failure> {
    let topics = u32::try_from(session.plan.relayable().len()).unwrap_or(u32::MAX);
    let mut stages = Vec::new();
    for relayed in 0..=topics {
        let lab = lab.map(str::to_owned);
        let task = Task::Undisturbed(Undisturbed { runs, relayed, equal_seeds: true, lab });
        let session = session.relaying(relayed);
        let plan = task.plan(&session.plan);
        // One at a time: runs at the same time would take the time that is measured from each other.
        let Some(stage) = work.runs(&session, &relayed.to_string(), &task, &plan, seed, true)? else {
            return Ok(false);
        };
        stages.push(stage);
    }
    found.preparation.mitm = Some(preparation::mitm(&stages)?);
    let named = (0..).zip(stages).map(|(relayed, stage): (u32, _)| (format!("{relayed} relayed"), stage));
    found.files.extend(named);
    Ok(true)
}
