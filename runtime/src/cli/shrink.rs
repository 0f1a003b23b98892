//! `shrink`: reduces a failing test while it still fails in the same way.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use sesame_base::observation::{Observation, Outcome};
use sesame_base::test_number::TestNumber;
use sesame_base::verdict::margin;
use sesame_plan::{CampaignPlan, Failing, RequirementId, Shrinking, Task};
use sesame_record as record;
use sesame_record::{Origin, RecordError, Repository, TestRecord, Verdict, verdict};

use crate::cli::caller::Caller;
use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::session::{Session, World};

/// Which test is shrunk, and how.
#[derive(Debug, Args)]
pub struct ShrinkArgs {
    /// The test, for example `T158`; to shrink a regression test, run `known` and give its folder with `--results`
    test: String,
    /// Folder of the run that recorded the test, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder in which the results get a folder of their own; by default beside the run that recorded the test
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// The requirement that a smaller test must violate; may be repeated. By default it must violate every requirement
    /// that the test violates, or crash or time out as the test did
    #[arg(long, value_name = "NAME")]
    requirement: Vec<String>,
    /// In how many runs a smaller test must fail, for noisy simulators: the first has the test's simulator seed, the
    /// others have seeds of their own
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The maximum number of simulator runs
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    evaluations: u32,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn shrink(session: &Session, args: &ShrinkArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let Session { results, .. } = session;
    if args.evaluations < args.runs {
        return Err(Failure(format!(
            "--evaluations {} is less than --runs {}: not even the test itself could be run that often",
            args.evaluations, args.runs
        )));
    }
    let declared = session.plan.tests.iter().any(|test| test.name == args.test);
    if declared && args.results.is_none() && record::latest_folder(results)?.is_none() {
        return Err(not_recorded(&session.caller, &args.test));
    }
    let repository = open(results, args.results.as_deref())?;
    let number = match repository.find(&args.test) {
        Err(RecordError::NoSuchTest { .. }) if declared => return Err(not_recorded(&session.caller, &args.test)),
        found => found?,
    };
    let record = repository.test(number)?;
    let name = TestNumber(record.number).to_string();
    let failing = failing(&repository, &record, &args.requirement)?;
    refuse_changed(session, &repository, record.number)?;
    let run = repository.path().parent().unwrap_or(results);
    let into = args.into.as_deref().or(run.parent()).unwrap_or(run);
    let seed = repository.campaign().seed;
    let folder_name = format!("shrink-{name}");
    let task = Task::Shrink(Shrinking {
        name,
        test: record.test,
        failing,
        simulator_seed: record.simulator_seed,
        runs: args.runs,
        evaluations: args.evaluations,
    });
    let plan = task.plan(repository.plan());
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(&session.runner, &plan, true)?;
    let (recorder, folder) = begin(session, into, &folder_name, &plan, &task, seed, &args.execution)?;
    execute(session, recorder, &folder, &args.execution, &args.output, files)
}

/// What to do for a regression test that these results do not have.
fn not_recorded(caller: &Caller, test: &str) -> Failure {
    let known = caller.command("known", &[test]);
    let shrink = caller.command("shrink", &[test, "--results", "known"]);
    Failure(format!(
        "the regression test `{test}` did not run in these results. The first command runs it and prints the folder of its \
         results, which the second one names (`known`, or `known-2` if there is a `known` already):\n    {known}\n    {shrink}"
    ))
}

/// How a test failed, and with which requirements.
pub(super) fn failing(repository: &Repository, record: &TestRecord, wanted: &[String]) -> Result<Failing, Failure> {
    let plan = repository.plan();
    let test = TestNumber(record.number);
    if record.test.operations.is_empty() {
        return Err(Failure(format!("{test} has no operations, so there is nothing to shrink")));
    }
    match record.observation.outcome {
        Outcome::Crash { .. } if wanted.is_empty() => return Ok(Failing::Crash),
        Outcome::Timeout { .. } if wanted.is_empty() => return Ok(Failing::Timeout),
        _ => {}
    }
    let violated = violated(plan, &record.observation);
    let named = |id: &RequirementId| plan.requirement(*id).name.as_str();
    let names: Vec<&str> = violated.iter().map(named).collect();
    if let Some(stranger) = wanted.iter().find(|wanted| !names.contains(&wanted.as_str())) {
        return Err(Failure(format!(
            "{test} does not violate `{stranger}`; it violates {}",
            if names.is_empty() { "no requirement".to_owned() } else { names.join(", ") }
        )));
    }
    if violated.is_empty() {
        return Err(Failure(format!(
            "{test} violates no requirement and its run completed, so there is no failure for a smaller test to keep; \
             the command `list` shows which tests violate what"
        )));
    }
    let chosen: Vec<RequirementId> = violated
        .iter()
        .copied()
        .filter(|id| wanted.is_empty() || wanted.iter().any(|name| name == named(id)))
        .collect();
    // What needs no disturbance says nothing about one.
    let reference = match repository.tests()?.iter().find(|row| row.origin == Origin::Reference) {
        Some(row) => self::violated(plan, &repository.test(row.number)?.observation),
        None => Vec::new(),
    };
    let caused: Vec<RequirementId> = chosen.iter().copied().filter(|id| !reference.contains(id)).collect();
    if caused.is_empty() {
        let names: Vec<&str> = chosen.iter().map(named).collect();
        return Err(Failure(format!(
            "the reference run violates {} too, so {test} is not its cause",
            names.join(", ")
        )));
    }
    let of = |id: &RequirementId| {
        let requirement = plan.requirement(*id);
        record.observation.value(requirement.metric).value.map_or(0.0, |value| margin(requirement.bound, value))
    };
    let margins = caused.iter().map(of).collect();
    Ok(Failing::Violation { requirements: caused, margins })
}

/// The requirements that a run violates.
fn violated(plan: &CampaignPlan, observation: &Observation) -> Vec<RequirementId> {
    let of = |requirement: &sesame_plan::Requirement| {
        verdict(requirement.bound, &observation.outcome, observation.value(requirement.metric))
    };
    let requirements = (0u32..).map(RequirementId).zip(&plan.requirements);
    requirements.filter(|(_, requirement)| of(requirement) == Verdict::Violated).map(|(id, _)| id).collect()
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    #[test]
    fn a_regression_test_that_did_not_run_is_to_be_run_first() {
        let caller = Caller { program: "sesamec".to_owned(), arguments: vec!["cell.sesame".to_owned()] };
        let Failure(words) = not_recorded(&caller, "cut_both");
        let commands: Vec<&str> = words.lines().skip(1).map(str::trim).collect();
        assert_eq!(
            commands,
            ["sesamec known cell.sesame cut_both", "sesamec shrink cell.sesame cut_both --results known"]
        );
    }

    fn found(name: &str, wanted: &[&str]) -> Result<Failing, String> {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        let record = repository.test(repository.find(name).unwrap()).unwrap();
        let wanted: Vec<String> = wanted.iter().map(|&name| name.to_owned()).collect();
        failing(&repository, &record, &wanted).map_err(|Failure(words)| words)
    }

    #[test]
    fn a_test_is_shrunk_by_the_requirements_that_it_violates_and_the_reference_run_does_not() {
        let violation = |requirements: &[u32]| Ok(requirements.iter().copied().map(RequirementId).collect::<Vec<_>>());
        let found_violation = |name: &str, wanted: &[&str]| match found(name, wanted) {
            Ok(Failing::Violation { requirements, margins }) => {
                assert!(margins.len() == requirements.len() && margins.iter().all(|margin| *margin > 0.0));
                Ok(requirements)
            }
            Ok(other) => panic!("{other:?}"),
            Err(words) => Err(words),
        };
        assert_eq!(found("T23", &[]), Ok(Failing::Crash));
        assert_eq!(found("T31", &[]), Ok(Failing::Timeout));
        assert_eq!(found_violation("known_jitter", &[]), violation(&[0]));
        assert_eq!(found_violation("known_jitter", &["R1"]), violation(&[0]));
        assert_eq!(found("known_jitter", &["R3"]), Err("T1 does not violate `R3`; it violates R1".to_owned()));
        assert!(found("reference", &[]).unwrap_err().starts_with("T0 has no operations"));
        let folder = tempfile::tempdir().unwrap();
        let mut plan = sample::plan();
        plan.requirements[0].bound = sesame_plan::Bound::Below { value: 0.0 };
        let repository = sample::campaign(folder.path(), &plan, 20);
        let record = repository.test(1).unwrap();
        let Err(Failure(words)) = failing(&repository, &record, &["R1".to_owned()]) else { panic!("it is refused") };
        assert!(words.starts_with("the reference run violates R1 too"), "{words}");
    }
}
