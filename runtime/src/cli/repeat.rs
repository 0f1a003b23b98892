//! `repeat`: one test again and again, with another seed of the simulator each time.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use sesame_plan::{CampaignPlan, KnownTest, KnownTestId, Search, Test};
use sesame_rng::derive_seed;

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::runner::Runner;

/// Which test is repeated, and how.
#[derive(Debug, Args)]
pub(super) struct Options {
    /// A regression test's name, or a recorded test, for example `T158`
    test: String,
    /// How often
    #[arg(value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    times: u32,
    /// Folder of the run that recorded the test, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder in which the results get a folder of their own; by default beside the run that recorded the test
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// The seed of the simulator's seeds; by default one of this test's own, so that the run that found it is no part of it
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
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
    /// Where its results go, if nothing else is said.
    results: PathBuf,
}

pub(super) fn repeat(
    runner: &Runner,
    plan: &CampaignPlan,
    results: &Path,
    options: &Options,
) -> Result<ExitCode, Failure> {
    let declared = plan.tests.iter().find(|test| test.name == options.test && options.results.is_none());
    let Repeated { name, test, mut plan, seed, results } = match declared {
        Some(KnownTest { name, test, .. }) => Repeated {
            name: name.clone(),
            test: test.clone(),
            plan: plan.clone(),
            seed: plan.campaign.seed,
            results: results.to_owned(),
        },
        None => recorded(plan, results, options)?,
    };
    let seed = options.seed.unwrap_or_else(|| derive_seed(seed, &format!("repeat {name}"), &[]));
    repeating(&mut plan, &name, test, options.times);
    let files = claim_files(runner, &plan)?;
    refuse_unfilled(runner, &plan, true)?;
    let results = options.into.as_deref().unwrap_or(&results);
    let (recorder, folder) = begin(results, &format!("repeat-{name}"), &plan, seed, &options.execution)?;
    execute(&plan, recorder, &folder, seed, &options.execution, &options.output, files)
}

fn recorded(plan: &CampaignPlan, results: &Path, options: &Options) -> Result<Repeated, Failure> {
    let repository = open(results, options.results.as_deref())?;
    let number = repository.find(&options.test)?;
    refuse_changed(&repository, plan, number)?;
    let run = repository.path().parent().unwrap_or(results);
    Ok(Repeated {
        name: format!("T{number}"),
        test: repository.test(number)?.test,
        plan: repository.plan().clone(),
        seed: repository.campaign().seed,
        results: run.parent().unwrap_or(run).to_owned(),
    })
}

/// Puts the repetition of a test in the place of what the campaign does.
fn repeating(plan: &mut CampaignPlan, name: &str, test: Test, times: u32) {
    let position = plan.tests.iter().position(|known| known.name == name && known.test == test);
    let position = position.unwrap_or_else(|| {
        plan.tests.push(KnownTest { name: name.to_owned(), doc: String::new(), test, expectations: Vec::new() });
        plan.tests.len() - 1
    });
    let test = KnownTestId(u32::try_from(position).expect("a plan holds fewer than 2^32 tests"));
    plan.campaign.search = Search::Repeat { test, times };
    // Nothing is sought, so there is no front.
    plan.campaign.objectives.clear();
    plan.campaign.coverage = None;
    plan.campaign.confirm = None;
}

#[cfg(test)]
mod tests {
    use sesame_results::record::sample;

    use super::super::results_folder::same_model;
    use super::*;

    #[test]
    fn a_found_test_joins_the_known_ones_and_the_model_stays_the_same() {
        let plan = sample::plan();
        let mut changed = plan.clone();
        repeating(&mut changed, "T9", Test::default(), 5);
        assert_eq!(changed.campaign.search, Search::Repeat { test: KnownTestId(1), times: 5 });
        assert_eq!((changed.tests[1].name.as_str(), &changed.tests[1].test), ("T9", &Test::default()));
        assert!(same_model(&changed, &plan), "so that `resume` goes on with it");

        let mut known = plan.clone();
        repeating(&mut known, "known_jitter", plan.tests[0].test.clone(), 5);
        assert_eq!(known.campaign.search, Search::Repeat { test: KnownTestId(0), times: 5 });
        assert_eq!(known.tests, plan.tests);
    }
}
