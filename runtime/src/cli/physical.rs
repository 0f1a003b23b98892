//! `physical`: recorded tests in a lab.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Args;

use sesame_analysis::choice::choice_for;
use sesame_analysis::exclusions;
use sesame_base::test_number::TestNumber;
use sesame_plan::{Lab, LabTask, LabTest, Task};
use sesame_record::Repository;
use sesame_rng::derive_seed;

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::session::Session;
use crate::cli::terminal::say;
use crate::lab::find;

/// How long a choice may be looked for until the best so far is taken.
const CHOICE_LIMIT: Duration = Duration::from_secs(60);

/// Which tests are run in a lab, and how often.
#[derive(Debug, Args)]
pub struct PhysicalArgs {
    /// Recorded tests, for example `T158 T17`; by default those that the lab's `budget` chooses from the front
    #[arg(value_name = "TEST")]
    tests: Vec<String>,
    /// The lab; by default the only one of the space
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The number of runs of each test; by default the lab's `repeats`
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    times: Option<u32>,
    /// Folder of the run that recorded the tests, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Folder in which the results of the lab get a folder of their own; by default beside the run
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Also run tests that the lab excludes as too dangerous
    #[arg(long)]
    although_excluded: bool,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn physical(session: &Session, args: &PhysicalArgs) -> Result<ExitCode, Failure> {
    let lab = find(&session.plan, args.lab.as_deref())?;
    let repository = open(&session.results, args.results.as_deref())?;
    let mut numbers = Vec::new();
    let chosen = if args.tests.is_empty() { chosen(&repository, lab)? } else { Vec::new() };
    for name in args.tests.iter().chain(&chosen) {
        let number = repository.find(name)?;
        refuse_changed(session, &repository, number)?;
        // A duplicate is what its original is.
        let number = repository.row(number)?.duplicate_of.unwrap_or(number);
        if numbers.contains(&number) {
            return Err(Failure(format!("{} is named twice", TestNumber(number))));
        }
        numbers.push(number);
    }
    if !args.although_excluded
        && let Some(excluded) = exclusions(&repository, lab, &numbers)?
    {
        return Err(Failure(format!("{excluded}; leave them out, or pass `--although-excluded`")));
    }
    let mut tests = Vec::with_capacity(numbers.len());
    for &number in &numbers {
        let test = repository.row(number)?.test;
        if test.operations.is_empty() {
            return Err(Failure(format!(
                "{} disturbs nothing; a run without disturbance is made before and after the tests anyway",
                TestNumber(number)
            )));
        }
        tests.push(LabTest { number, test });
    }
    let task = LabTask {
        lab: lab.name.clone(),
        results: repository.digest()?,
        tests,
        repeats: args.times.unwrap_or(lab.repeats),
    };
    // The lab has seeds of its own: equal ones would make a stand-in for the lab repeat the runs of the simulation.
    let seed = derive_seed(repository.campaign().seed, &format!("lab {}", lab.name), &[]);
    let name = format!("{}-{}", repository.folder().file_name().unwrap_or_default().display(), lab.name);
    let results = match &args.into {
        Some(into) => into.clone(),
        None => repository.folder().parent().unwrap_or(&session.results).to_owned(),
    };
    drop(repository);

    let session = session.in_lab(&task.lab)?;
    let task = Task::Lab(task);
    let plan = task.plan(&session.plan);
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(&session, &plan, true)?;
    // There is one lab.
    let execution = args.execution.one_at_a_time();
    let (recorder, folder) = begin(&session, &results, &name, &plan, &task, seed, &execution)?;
    execute(&session, recorder, &folder, &execution, &args.output, files)
}

/// The names of the tests that a lab's budget chooses; it prints them.
fn chosen(repository: &Repository, lab: &Lab) -> Result<Vec<String>, Failure> {
    let until = Instant::now() + CHOICE_LIMIT;
    let Some(choice) = choice_for(repository, lab, &mut || Instant::now() >= until)? else {
        return Err(Failure(format!(
            "lab `{}` has no `budget` by which tests are chosen; name the tests, or add one to its `physical` block, for \
             example\n    budget 5 lambda 0.5 over T1, T2, P1",
            lab.name
        )));
    };
    let names: Vec<String> = choice.tests.iter().map(|&number| TestNumber(number).to_string()).collect();
    say(format_args!("    Chosen {} for {} of {}: {}", names.join(" "), choice.cost, choice.budget, choice.proof()));
    Ok(names)
}
