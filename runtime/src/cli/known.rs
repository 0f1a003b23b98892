//! `known`: runs regression tests and checks their expectations.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use sesame_plan::{CampaignPlan, KnownTestId, Task};

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::say;

/// Which regression tests are run, and how.
#[derive(Debug, Args)]
pub struct Options {
    /// Names of regression tests; by default all that this campaign can run
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// The seed of the simulator's randomness, for all of them; by default each has the `simulator seed` that it names,
    /// and that of the campaign's seed if it names none
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Folder in which the results get a folder `known`; by default `results` in the runner's folder
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn known(session: &Session, options: &Options) -> Result<ExitCode, Failure> {
    let Session { plan, results, .. } = session;
    let task = Task::Known { tests: chosen(plan, &options.names).map_err(Failure)? };
    let mut plan = task.plan(plan);
    if options.seed.is_some() {
        let replaced = forget_seeds(&mut plan, &task);
        if !replaced.is_empty() {
            let names = replaced.join(", ");
            say(format_args!("note: with --seed, tests do not run with the `simulator seed` that they name: {names}"));
        }
    }
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(&session.runner, &plan, true)?;
    let seed = options.seed.unwrap_or(plan.campaign.seed);
    let results = options.results.as_deref().unwrap_or(results);
    let (recorder, folder) = begin(session, results, "known", &plan, &task, seed, &options.execution)?;
    execute(session, recorder, &folder, &options.execution, &options.output, files)
}

/// Takes from the tests of a task the simulator's seeds that they name; returns the names of those that had one.
fn forget_seeds(plan: &mut CampaignPlan, task: &Task) -> Vec<String> {
    let Task::Known { tests } = task else { return Vec::new() };
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
    use sesame_results::record::sample;

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
