//! `prepare`: all steps of preparatory testing, one after another.

use std::process::ExitCode;

use clap::Args;

use crate::cli::execution::{ExecutionArgs, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::preparation::{Call, Found, PreparationArgs, Work, carry_out, lab_of};
use crate::cli::session::Session;
use crate::cli::terminal::say;
use crate::cli::{known, mitm, monitors, null};

/// How often things are run, and where.
#[derive(Debug, Args)]
pub struct PrepareArgs {
    /// The number of runs without disturbance on each side, and in each stage
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// The lab; by default the only one of the space that runners reach, if there is exactly one
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The seed of all runs; by default the campaign's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Continue with the next step after one that fails
    #[arg(long)]
    keep_going: bool,
    #[command(flatten)]
    preparation: PreparationArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// A step of the preparation.
type Step<'s> = (&'static str, &'s dyn Fn(&Work<'_>, &mut Found) -> Result<bool, Failure>);

pub(super) fn prepare(session: &Session, args: &PrepareArgs) -> Result<ExitCode, Failure> {
    let lab = lab_of(&session.plan, args.lab.as_deref())?;
    refuse_unfilled(session, &session.plan, true)?;
    let seed = args.seed.unwrap_or(session.plan.campaign.seed);
    let mut command = vec!["prepare".to_owned(), "--runs".to_owned(), args.runs.to_string()];
    command.extend(lab.iter().flat_map(|lab| ["--lab".to_owned(), lab.name.clone()]));
    command.extend(args.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
    command.extend(args.keep_going.then(|| "--keep-going".to_owned()));
    let call = Call { name: "prepare", command, args: &args.preparation, execution: &args.execution };
    let observe = |work: &Work<'_>, found: &mut Found| null::observe(session, work, lab, args.runs, seed, found);
    let relay = |work: &Work<'_>, found: &mut Found| {
        if session.plan.relayable().is_empty() {
            found.preparation.left_out.push(format!("`mitm` is left out: {}.", mitm::nothing_to_relay(session)));
            return Ok(true);
        }
        mitm::stages(session, work, None, args.runs, seed, found)
    };
    let test = |work: &Work<'_>, found: &mut Found| {
        if session.plan.tests.is_empty() {
            let name = &session.plan.campaign.name;
            let sentence = format!("`known` is left out: campaign `{name}` can run no regression test of the space.");
            found.preparation.left_out.push(sentence);
            return Ok(true);
        }
        known::sides(session, work, lab, &[], args.seed, found)
    };
    let verify = |_: &Work<'_>, found: &mut Found| {
        monitors::of_both_sides(session, lab, found)?;
        Ok(true)
    };
    let mut steps: Vec<Step<'_>> = vec![("null", &observe), ("mitm", &relay), ("known", &test)];
    if !session.plan.monitors.is_empty() {
        steps.push(("monitors", &verify));
    }
    carry_out(session, call, |work| in_order(work, &steps, args.keep_going))
}

/// Carries out the steps up to the first that fails, or all of them.
fn in_order(work: &Work<'_>, steps: &[Step<'_>], keep_going: bool) -> Result<Option<Found>, Failure> {
    let mut found = Found::default();
    for (at, (name, step)) in steps.iter().enumerate() {
        match step(&work.step(name), &mut found) {
            Ok(true) => {}
            Ok(false) => return Ok(None),
            Err(Failure(words)) if keep_going => {
                say(format_args!("error: {}", sesame_base::visible::visible_lines(&words)));
                found.preparation.left_out.push(format!("`{name}` could not be carried out: {words}"));
                found.broken = true;
            }
            Err(failure) => return Err(failure),
        }
        if !keep_going && !found.preparation.objections().is_empty() {
            let rest: Vec<String> = steps[at + 1..].iter().map(|(name, _)| format!("`{name}`")).collect();
            if !rest.is_empty() {
                let rest = rest.join(" and ");
                let sentence = format!("{rest} left out, since `{name}` failed; `--keep-going` carries them out.");
                found.preparation.left_out.push(sentence);
            }
            break;
        }
    }
    Ok(Some(found))
}
