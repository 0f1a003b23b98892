//! `shrink`: reduces a failing test while it still fails in the same way, or the smallest test of each cause.

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
use crate::cli::terminal::say;

/// How many runs each cause may take if `--budget` does not say it.
const RUNS_OF_A_CAUSE: u32 = 200;

/// Which tests are shrunk, and how.
#[derive(Debug, Args)]
pub struct ShrinkArgs {
    /// The test, for example `T158`; to shrink a regression test, run `known` and give its folder with `--results`
    #[arg(required_unless_present = "violations")]
    test: Option<String>,
    /// Shrink the smallest test of each cause, one after the other
    #[arg(long, conflicts_with_all = ["test", "evaluations"])]
    violations: bool,
    /// The maximum number of simulator runs with `--violations`: each cause first gets an equal share, and runs that
    /// one does not need go on to the others; by default 200 for each cause
    #[arg(long, value_name = "N", requires = "violations", value_parser = clap::value_parser!(u32).range(1..))]
    budget: Option<u32>,
    /// Folder of the run that recorded the test, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder in which the results get a folder of their own; by default beside the run that recorded the test
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// The requirement that a smaller test must violate; may be repeated. By default it must violate every requirement
    /// that the test violates, or crash or time out as the test did; with `--violations`, causes of all requirements
    #[arg(long, value_name = "NAME")]
    requirement: Vec<String>,
    /// In how many runs a smaller test must fail, for noisy simulators: the first has the test's simulator seed, the
    /// others have seeds of their own
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// The maximum number of simulator runs
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    evaluations: u32,
    /// Go on to single messages: find the fewest that operations must alter. The simulator must be stepped, or `--runs`
    /// at least 2
    #[arg(long)]
    messages: bool,
    /// Find out when the operations of the smallest test have to act: vary their windows, and describe by what happens
    /// in the undisturbed run with which of them the test fails. Takes 48 tests for each operation by time
    #[arg(long)]
    when: bool,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn shrink(session: &Session, args: &ShrinkArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    if args.messages {
        refuse_free_running(session, args.runs)?;
    }
    let (repository, name, task) = match &args.test {
        Some(test) => one(session, args, test)?,
        None => each_cause(session, args)?,
    };
    let run = repository.path().parent().unwrap_or(&session.results);
    let into = args.into.as_deref().or(run.parent()).unwrap_or(run);
    let seed = repository.campaign().seed;
    let plan = task.plan(repository.plan());
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(session, &plan, true)?;
    let folder_name = format!("shrink-{name}");
    let (recorder, folder) = begin(session, into, &folder_name, &plan, &task, seed, &args.execution)?;
    execute(session, recorder, &folder, &args.execution, &args.output, files)
}

/// The task of shrinking one test, with the results that have it and its name there.
fn one(session: &Session, args: &ShrinkArgs, test: &str) -> Result<(Repository, String, Task), Failure> {
    let Session { results, .. } = session;
    if args.evaluations < args.runs {
        return Err(Failure(format!(
            "--evaluations {} is less than --runs {}: not even the test itself could be run that often",
            args.evaluations, args.runs
        )));
    }
    let declared = session.plan.tests.iter().any(|declared| declared.name == test);
    if declared && args.results.is_none() && record::latest_folder(results)?.is_none() {
        return Err(not_recorded(&session.caller, test));
    }
    let repository = open(results, args.results.as_deref())?;
    let number = match repository.find(test) {
        Err(RecordError::NoSuchTest { .. }) if declared => return Err(not_recorded(&session.caller, test)),
        found => found?,
    };
    let record = repository.test(number)?;
    let failing = failing(&repository, &record, &args.requirement)?;
    refuse_changed(session, &repository, record.number)?;
    let shrinking = shrinking(record, failing, args, args.evaluations);
    Ok((repository, shrinking.name.clone(), Task::Shrink(shrinking)))
}

/// The task of shrinking the smallest test of each cause, with the results that have them.
fn each_cause(session: &Session, args: &ShrinkArgs) -> Result<(Repository, String, Task), Failure> {
    let repository = open(&session.results, args.results.as_deref())?;
    let names: Vec<&str> = repository.plan().requirements.iter().map(|requirement| requirement.name.as_str()).collect();
    if let Some(stranger) = args.requirement.iter().find(|wanted| !names.contains(&wanted.as_str())) {
        let known = if names.is_empty() { "it has none".to_owned() } else { format!("it has {}", names.join(", ")) };
        return Err(Failure(format!("the campaign has no requirement `{stranger}`; {known}")));
    }
    let mut found = Vec::new();
    for cause in sesame_report::causes(&repository)?.causes {
        if !args.requirement.is_empty() && !args.requirement.contains(&cause.requirement) {
            continue;
        }
        let record = repository.test(cause.test.0)?;
        refuse_changed(session, &repository, record.number)?;
        match failing(&repository, &record, std::slice::from_ref(&cause.requirement)) {
            Ok(failing) => found.push((record, failing)),
            // Fresh runs violate it, and the run that would be shrunk does not.
            Err(Failure(why)) => say(format_args!("note: this cause of {} is left out: {why}", cause.requirement)),
        }
    }
    let Some(count) = u32::try_from(found.len()).ok().filter(|&count| count > 0) else {
        return Err(Failure(
            "no test violates a requirement that the reference run satisfies, so there is no cause to shrink; the command \
             `causes` shows what is known"
                .to_owned(),
        ));
    };
    let budget = args.budget.unwrap_or(RUNS_OF_A_CAUSE.saturating_mul(args.runs).saturating_mul(count));
    let shares = shares(budget, args.runs, count).ok_or_else(|| {
        let fewest = u64::from(args.runs) * u64::from(count);
        Failure(format!(
            "--budget {budget} is too little for {count} causes, each of which takes at least --runs {}: give {fewest} or \
             more, or name a requirement with --requirement",
            args.runs
        ))
    })?;
    let each = found.into_iter().zip(shares);
    let each = each.map(|((record, failing), share)| shrinking(record, failing, args, share)).collect();
    Ok((repository, "violations".to_owned(), Task::ShrinkEach { each }))
}

/// A budget in equal shares, each a multiple of the runs of a test; the first ones get what does not come out even.
/// `None` if not each can run one test.
fn shares(budget: u32, runs: u32, count: u32) -> Option<Vec<u32>> {
    let tests = budget / runs;
    let share = move |at: u32| (tests / count + u32::from(at < tests % count)) * runs;
    (tests >= count).then(|| (0..count).map(share).collect())
}

fn shrinking(record: TestRecord, failing: Failing, args: &ShrinkArgs, evaluations: u32) -> Shrinking {
    Shrinking {
        name: TestNumber(record.number).to_string(),
        test: record.test,
        failing,
        simulator_seed: record.simulator_seed,
        runs: args.runs,
        evaluations,
        messages: args.messages,
        when: args.when,
    }
}

/// Insists that a run shows whether a message matters: that equal tests give equal runs, or that several runs decide.
fn refuse_free_running(session: &Session, runs: u32) -> Result<(), Failure> {
    // Nothing is started before the first test.
    let transport = session.runner.connect.transport(&session.plan);
    if runs > 1 || transport.capabilities().lock_stepped {
        return Ok(());
    }
    Err(Failure(format!(
        "the simulator of `{}` runs freely: the same test sends other messages in each run, so one run does not show whether \
         a message matters. With `--runs 3`, a test with fewer messages counts only if it fails in each of three runs; or \
         leave out `--messages`",
        session.plan.space
    )))
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

    #[test]
    fn a_budget_is_shared_in_whole_tests() {
        assert_eq!(shares(100, 1, 3), Some(vec![34, 33, 33]));
        assert_eq!(shares(100, 3, 4), Some(vec![27, 24, 24, 24]), "of 33 tests with three runs each");
        assert_eq!(shares(5, 2, 2), Some(vec![2, 2]));
        assert_eq!(shares(5, 2, 3), None);
        assert_eq!(shares(u32::MAX, 1, 1), Some(vec![u32::MAX]));
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
