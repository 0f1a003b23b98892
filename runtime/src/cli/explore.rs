//! `explore`: variations of a test along one dimension of the reduced space, in the simulation. What is found with
//! them, a violation or a reality gap, is then known to begin and end somewhere [SESAME 2023, Section 4.6].

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Dimension, Task, Test, Variations};
use sesame_record::{Origin, Repository};
use sesame_search::variation::{coordinate, reach, vary};

use crate::cli::execution::{ExecutionArgs, OutputArgs, begin, claim_files, execute, refuse_unfilled};
use crate::cli::failure::Failure;
use crate::cli::results_folder::{open, refuse_changed};
use crate::cli::session::{Session, World};
use crate::cli::terminal::say;

/// How many recorded tests are named that lie nearest.
const NEAREST: usize = 5;

/// Dimensions by which it is judged what lies near a test.
const ALL: [Dimension; 3] = [Dimension::T1, Dimension::T2, Dimension::P1];

/// Which test is varied, and how.
#[derive(Debug, Args)]
pub struct ExploreArgs {
    /// The test, for example `T158`
    test: String,
    /// The dimension: P1 for how strong the operations are, T1 for when they are active, T2 for how long
    #[arg(long, value_name = "DIMENSION", value_parser = dimension)]
    vary: Dimension,
    /// The number of variations
    #[arg(short = 'n', long, default_value_t = 7, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    times: u32,
    /// The first coordinate; by default as low as the test can go
    #[arg(long, value_name = "COORDINATE")]
    from: Option<f64>,
    /// The last coordinate; by default as high as the test can go
    #[arg(long, value_name = "COORDINATE")]
    to: Option<f64>,
    /// Folder of the run that recorded the test, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    #[command(flatten)]
    world: World,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// A dimension along which tests can be varied.
fn dimension(text: &str) -> Result<Dimension, String> {
    let known = ALL.into_iter().find(|dimension| dimension.name().eq_ignore_ascii_case(text));
    known.ok_or_else(|| "tests are varied along P1 (how strong), T1 (when) or T2 (how long)".to_owned())
}

pub(super) fn explore(session: &Session, args: &ExploreArgs) -> Result<ExitCode, Failure> {
    let session = &*args.world.of(session)?;
    let repository = open(&session.results, args.results.as_deref())?;
    let number = repository.find(&args.test)?;
    refuse_changed(session, &repository, number)?;
    let test = repository.row(number)?.test;
    let plan = &session.plan;
    let tests = variations(plan, &test, args)?;
    say_nearest(&repository, number, &test, args.vary)?;
    let name = TestNumber(number).to_string();
    let folder = format!("{}-{name}-{}", named(&repository), args.vary.name());
    let task = Task::Variations(Variations { name, dimension: args.vary, tests });
    let seed = repository.campaign().seed;
    let results = repository.folder().parent().unwrap_or(&session.results).to_owned();
    drop(repository);
    let plan = task.plan(plan);
    let files = claim_files(&session.runner, &plan)?;
    refuse_unfilled(session, &plan, true)?;
    let (recorder, folder) = begin(session, &results, &folder, &plan, &task, seed, &args.execution)?;
    execute(session, recorder, &folder, &args.execution, &args.output, files)
}

/// The name of the folder of results.
fn named(repository: &Repository) -> String {
    repository.folder().file_name().unwrap_or_default().display().to_string()
}

/// The variations, no two equal, in the order of their coordinates.
fn variations(plan: &CampaignPlan, test: &Test, args: &ExploreArgs) -> Result<Vec<Test>, Failure> {
    let ExploreArgs { vary: dimension, from, to, times, .. } = *args;
    let [least, greatest] = reach(plan, test, dimension)?;
    let (from, to) = (from.unwrap_or(least).max(least), to.unwrap_or(greatest).min(greatest));
    if from.is_nan() || to.is_nan() || from > to {
        return Err(Failure(format!(
            "{} of {} can be from {least:.3} to {greatest:.3}; give `--from` and `--to` in this range, in this order",
            dimension.name(),
            args.test
        )));
    }
    let mut tests: Vec<Test> = Vec::new();
    for at in 0..times {
        let share = if times == 1 { 0.5 } else { f64::from(at) / f64::from(times - 1) };
        let variation = vary(plan, test, dimension, from + share * (to - from))?;
        if !tests.contains(&variation) {
            tests.push(variation);
        }
    }
    Ok(tests)
}

/// Names recorded tests that lie near a test: what is known around it already.
fn say_nearest(repository: &Repository, number: u32, test: &Test, dimension: Dimension) -> Result<(), Failure> {
    let plan = repository.plan();
    let place = |test: &Test| -> Vec<Option<f64>> { ALL.iter().map(|&at| coordinate(plan, test, at)).collect() };
    let here = place(test);
    let mut near: Vec<(f64, u32, f64)> = Vec::new();
    for row in repository.tests()? {
        let is_another = row.number != number && row.origin != Origin::Reference && row.duplicate_of.is_none();
        let Some(coordinate) = coordinate(plan, &row.test, dimension).filter(|_| is_another) else { continue };
        let squares = place(&row.test)
            .iter()
            .zip(&here)
            .map(|(a, b)| match (a, b) {
                (Some(a), Some(b)) => (a - b) * (a - b),
                (None, None) => 0.0,
                _ => 1.0,
            })
            .sum::<f64>();
        near.push((squares.sqrt(), row.number, coordinate));
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let named: Vec<String> = near
        .iter()
        .take(NEAREST)
        .map(|(distance, number, at)| {
            format!("{} ({} {at:.2}, distance {distance:.2})", TestNumber(*number), dimension.name())
        })
        .collect();
    if !named.is_empty() {
        say(format_args!("note: recorded already, and nearest to {}: {}", TestNumber(number), named.join(", ")));
    }
    Ok(())
}
