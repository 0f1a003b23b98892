//! `known`: runs regression tests and checks their expectations.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use sesame_plan::{CampaignPlan, KnownTestId, Task};
#[cfg(feature = "process")]
use sesame_plan::{Lab, Recorded};
#[cfg(feature = "process")]
use sesame_record::Repository;
#[cfg(feature = "process")]
use sesame_report::preparation;
#[cfg(feature = "process")]
use sesame_rng::derive_seed;

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
#[cfg(feature = "process")]
use crate::cli::preparation::{Call, Found, PreparationArgs, Work, carry_out};
use crate::cli::session::{Session, World};
use crate::cli::terminal::say;

/// Which regression tests are run, and how.
#[derive(Debug, Args)]
pub struct KnownArgs {
    /// Names of regression tests; by default all that this campaign can run
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// The seed that determines the simulator's seed of each test; by default a test has its own `simulator seed`, or
    /// one determined by the campaign's seed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Run them in simulation and in this lab, and compare
    #[cfg(feature = "process")]
    #[arg(long, value_name = "NAME", conflicts_with_all = ["junit", "fail_on"])]
    lab: Option<String>,
    /// With `--lab`, continue in this folder, for example `results/known-hall`; complete runs are not repeated
    #[cfg(feature = "process")]
    #[arg(long, value_name = "DIR", requires = "lab", conflicts_with = "results")]
    resume: Option<PathBuf>,
    /// Folder in which the results get a folder `known`; by default `results` in the runner's folder
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn known(session: &Session, args: &KnownArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    #[cfg(feature = "process")]
    if let Some(lab) = &args.lab {
        return in_lab(session, lab, args);
    }
    let Session { plan, results, .. } = session;
    let task = Task::Known { tests: chosen(plan, &args.names).map_err(Failure)?, lab: None };
    let plan = plan_of(plan, &task, args.seed);
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(session, &plan, true)?;
    let seed = args.seed.unwrap_or(plan.campaign.seed);
    let results = args.results.as_deref().unwrap_or(results);
    let (recorder, folder) = begin(session, results, "known", &plan, &task, seed, &args.execution)?;
    execute(session, recorder, &folder, &args.execution, &args.output, files)
}

/// Runs them in simulation and in a lab.
#[cfg(feature = "process")]
fn in_lab(session: &Session, lab: &str, args: &KnownArgs) -> Result<ExitCode, Failure> {
    let lab = crate::lab::find(&session.plan, Some(lab))?;
    refuse_unfilled(session, &session.plan, true)?;
    chosen(&session.plan, &args.names).map_err(Failure)?;
    let mut command = vec!["known".to_owned()];
    command.extend(args.names.iter().cloned());
    command.extend(["--lab".to_owned(), lab.name.clone()]);
    command.extend(args.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]));
    let name = format!("known-{}", lab.name);
    let preparation = PreparationArgs::of(args.resume.clone(), args.results.clone(), args.output.format());
    let call = Call { name: &name, command, args: &preparation, execution: &args.execution };
    carry_out(session, call, |work| {
        let mut found = Found::default();
        let ended = sides(session, work, Some(lab), &args.names, args.seed, &mut found)?;
        Ok(ended.then_some(found))
    })
}

/// Runs tests of these names in simulation, and in the lab if there is one, and compares; false if the user stopped it.
#[cfg(feature = "process")]
pub(super) fn sides(
    session: &Session,
    work: &Work<'_>,
    lab: Option<&Lab>,
    names: &[String],
    seed: Option<u64>,
    found: &mut Found,
) -> Result<bool, Failure> {
    let tests = chosen(&session.plan, names).map_err(Failure)?;
    // What monitors decide on both sides can be compared then.
    let recorded = cfg!(feature = "mcap") && lab.is_some() && !session.plan.monitors.is_empty();
    let side = |session: &Session, lab: Option<&Lab>| -> Result<Option<Repository>, Failure> {
        let task = Task::Known { tests: tests.clone(), lab: lab.map(|lab| lab.name.clone()) };
        let mut plan = plan_of(&session.plan, &task, seed);
        if recorded {
            plan.campaign.record = Some(Recorded::All);
        }
        // The lab has seeds of its own: equal ones would make a stand-in for the lab repeat the runs of the simulation.
        let run = seed.unwrap_or(plan.campaign.seed);
        let run = lab.map_or(run, |lab| derive_seed(run, &format!("lab {}", lab.name), &[]));
        work.runs(session, lab.map_or("simulation", |_| "lab"), &task, &plan, run, lab.is_some())
    };
    let Some(simulation) = side(session, None)? else { return Ok(false) };
    let mut in_lab = None;
    if let Some(lab) = lab {
        let Some(repository) = side(&session.in_lab(&lab.name)?, Some(lab))? else { return Ok(false) };
        in_lab = Some((lab, repository));
    }
    let compared = in_lab.as_ref().map(|(lab, repository)| (*lab, repository));
    found.preparation.known = Some(preparation::known(&simulation, compared)?);
    let at = found.files.len();
    found.known = in_lab.as_ref().map(|_| [at, at + 1]);
    found.files.push(("Regression tests, simulation".to_owned(), simulation));
    let named = |(lab, repository): (&Lab, Repository)| (format!("Regression tests, lab {}", lab.name), repository);
    found.files.extend(in_lab.map(named));
    Ok(true)
}

/// The plan of a task; with a seed for all tests, none of them has one of its own, which it prints.
fn plan_of(plan: &CampaignPlan, task: &Task, seed: Option<u64>) -> CampaignPlan {
    let mut plan = task.plan(plan);
    if seed.is_some() {
        let replaced = forget_seeds(&mut plan, task);
        if !replaced.is_empty() {
            let names = replaced.join(", ");
            say(format_args!("note: with --seed, tests do not run with the `simulator seed` that they name: {names}"));
        }
    }
    plan
}

/// Takes from the tests of a task the simulator's seeds that they name; returns the names of those that had one.
fn forget_seeds(plan: &mut CampaignPlan, task: &Task) -> Vec<String> {
    let Task::Known { tests, .. } = task else { return Vec::new() };
    let mut replaced = Vec::new();
    for id in tests {
        let test = &mut plan.tests[id.index()];
        if test.simulator_seed.take().is_some() {
            replaced.push(test.name.clone());
        }
    }
    replaced
}

/// The regression tests of these names, each once and in the space's order; all of them when no name is given.
fn chosen(plan: &CampaignPlan, names: &[String]) -> Result<Vec<KnownTestId>, String> {
    if plan.tests.is_empty() {
        return Err(format!(
            "campaign `{}` can run none of the space's regression tests: it runs those whose operations are all its own and \
             that begin before its end",
            plan.campaign.name
        ));
    }
    let known = || plan.tests.iter().map(|test| test.name.as_str());
    if let Some(stranger) = names.iter().find(|name| !known().any(|known| known == *name)) {
        let known: Vec<&str> = known().collect();
        return Err(format!(
            "campaign `{}` cannot run a regression test `{stranger}`; it can run {}",
            plan.campaign.name,
            known.join(", ")
        ));
    }
    let wanted = |name: &str| names.is_empty() || names.iter().any(|wanted| wanted == name);
    Ok((0u32..).map(KnownTestId).zip(known()).filter(|(_, name)| wanted(name)).map(|(id, _)| id).collect())
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    #[test]
    fn known_tests_are_chosen_by_name() {
        let mut plan = sample::plan();
        let mut second = plan.tests[0].clone();
        second.name = "second".to_owned();
        plan.tests.push(second);
        let chosen = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            super::chosen(&plan, &names)
        };
        assert_eq!(chosen(&[]), Ok(vec![KnownTestId(0), KnownTestId(1)]));
        assert_eq!(chosen(&["second", "second"]), Ok(vec![KnownTestId(1)]));
        assert_eq!(chosen(&["second", "known_jitter"]), Ok(vec![KnownTestId(0), KnownTestId(1)]));
        assert!(chosen(&["third"]).unwrap_err().ends_with("it can run known_jitter, second"));
        plan.tests[1].simulator_seed = Some(7);
        let mut seeded = plan.clone();
        assert_eq!(forget_seeds(&mut seeded, &Task::Known { tests: vec![KnownTestId(0)], lab: None }), [""; 0]);
        assert_eq!(seeded, plan);
        assert_eq!(forget_seeds(&mut seeded, &Task::Known { tests: vec![KnownTestId(1)], lab: None }), ["second"]);
        assert_eq!(seeded.tests[1].simulator_seed, None);
        plan.tests.clear();
        assert!(super::chosen(&plan, &[]).unwrap_err().contains("none of the space's regression tests"));
    }
}
