//! `compensate`: fits the simulation to what a lab recorded, and looks whether the reality gap is smaller then
//! [SESAME 2023, Section 4.7].

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use sesame_analysis::compensation;
use sesame_analysis::gap::{Gap, compensated_runs, gap, gap_after, lab_runs};
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Compensation, Fit, Lab, LabTask, Task};
use sesame_record::Repository;
use sesame_report::quantity;
use sesame_rng::derive_seed;

use crate::campaign::{Pool, PoolSettings, Retries};
use crate::cli::execution::{
    ExecutionArgs, OutputArgs, begin, claim_files, interruptible, perform, refuse_unfilled, report_outcome, shown,
};
use crate::cli::failure::{Failure, STOPPED};
use crate::cli::progress_line::wait;
use crate::cli::results_folder::{open, refuse_other_model, run_folder};
use crate::cli::run::compensated_name;
use crate::cli::run_again::limit;
use crate::cli::scratch::Scratch;
use crate::cli::session::Session;
use crate::cli::terminal::{Format, print, print_json, say, text_options};
use crate::fitting::{self, Journal, Judged, LabTraces, Progress, Settings, Simulations};
use crate::lab::find;

/// How often a line says how far the fit is.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// What a fit has tried, in the folder of the lab's results, until it is complete.
const TRIED: &str = "fit.jsonl";

/// One of this many tests is kept aside to judge by.
const ONE_IN: usize = 3;

/// To what the simulation is fitted, and how.
#[derive(Debug, Args)]
pub struct CompensateArgs {
    /// Folder with the results of the lab, for example `results/42-hall`
    #[arg(value_name = "LAB")]
    lab: PathBuf,
    /// Folder of the run that recorded the tests; by default the one after which the lab's folder is named,
    /// `results/42`
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Tests that are kept out of the fit and by which it is judged; by default every third
    #[arg(long, value_name = "TEST", value_delimiter = ',')]
    hold_out: Vec<String>,
    /// The number of sets of values to try
    #[arg(long, default_value_t = 60, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    evaluations: u32,
    /// End after the fit, without running the campaign again with the compensated simulation
    #[arg(long)]
    no_campaign: bool,
    #[command(flatten)]
    execution: ExecutionArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// What came of it, for programs.
#[derive(Serialize)]
struct Compensated<'a> {
    /// What is set.
    compensation: &'a Compensation,
    /// How far the simulation is from the lab in the traces of tests to which it was fitted.
    fitted: Side,
    /// The same in tests that were kept aside; nothing if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<Side>,
    /// The gap of each metric, before and after.
    metrics: serde_json::Value,
    /// Folder with the tests of the lab, simulated again.
    simulated_again: &'a Path,
    /// Folder with the campaign that was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    campaign_again: Option<&'a Path>,
}

#[derive(Serialize)]
struct Side {
    tests: Vec<String>,
    discrepancy_before: f64,
    discrepancy_after: f64,
}

pub(super) fn compensate(session: &Session, args: &CompensateArgs) -> Result<ExitCode, Failure> {
    let Session { results, .. } = session;
    let lab = Repository::open(&run_folder(results, &args.lab))?;
    let Some(task) = lab.task().in_lab().cloned() else {
        return Err(Failure(format!("{} has no results of a lab: `physical` runs tests in one", shown(lab.path()))));
    };
    let campaign = campaign_of(session, &lab, &task, args.results.as_deref())?;
    refuse_other_model(session, &campaign)?;
    // Asked first, since it says whether the results belong together.
    let runs_in_lab = lab_runs(&campaign, &lab)?;
    let found = find(&session.plan, Some(&task.lab))?.clone();
    if found.fits.is_empty() {
        return Err(Failure(format!(
            "lab `{}` does not say what may be fitted; add it to its `physical` block, for example\n    \
             fit relay delay [0ms, 100ms]",
            found.name
        )));
    }
    let traces = fitting::lab_traces(&lab, &task)?;
    if traces.is_empty() {
        return Err(Failure(format!(
            "there are no traces of the lab in {}; results that were entered by hand have none",
            shown(lab.folder())
        )));
    }
    let (fitted_to, held_out) = split(&campaign, &traces, &args.hold_out)?;
    if held_out.is_empty() {
        say(format_args!("note: with so few tests none is held out, so nothing shows how the fit does on others"));
    }

    let files = claim_files(&session.runner, &session.plan)?;
    refuse_unfilled(session, &session.plan, true)?;
    let interrupted = interruptible()?;
    let seed = derive_seed(campaign.campaign().seed, &format!("compensate {}", found.name), &[]);
    let tried = lab.folder().join(TRIED);
    // All that decides what comes of a set of values.
    let of = serde_json::json!([seed, task.repeats, lab.digest()?, session.plan]).to_string();
    let cannot = |error| Failure(format!("cannot keep what is tried in {}: {error}", shown(&tried)));
    let mut journal = Journal::open(&tried, &of).map_err(cannot)?;
    if journal.known() > 0 {
        say(format_args!("Continuing a fit of which {} sets of values were tried", journal.known()));
    }
    let of = (&found, &task, seed);
    let fit = fitted(session, args, &campaign, of, (&fitted_to, &held_out), &mut journal, &interrupted);
    files.finish()?;
    let Some(outcome) = fit? else {
        say(format_args!("stopped; the same command continues from the tried values in {}", shown(&tried)));
        return Ok(ExitCode::from(STOPPED));
    };
    let for_people = args.output.format() == Format::Text;
    if for_people {
        print(&fitted_text(&session.plan, &found.fits, &outcome, (&fitted_to, &held_out)))?;
    }

    let again = Again {
        session,
        args,
        results: lab.folder().parent().unwrap_or(results).to_owned(),
        plan: CampaignPlan { compensation: Some(outcome.compensation.clone()), ..session.plan.clone() },
        interrupted: &interrupted,
    };
    let name = format!("{}-compensated", lab.folder().file_name().unwrap_or_default().display());
    let of_lab = Task::Compensated(LabTask { repeats: task.repeats.max(2), ..task.clone() });
    let Some((simulated, simulated_folder)) = again.run(&name, &of_lab, seed)? else {
        return Ok(ExitCode::from(STOPPED));
    };
    // From here on, what was found is recorded with results.
    journal.done().map_err(cannot)?;
    let before = gap(&campaign, &runs_in_lab, Some(&found))?;
    let after = gap_after(&campaign, &compensated_runs(&campaign, &simulated)?, &runs_in_lab, Some(&found))?;
    if for_people {
        print(&gap_text(&session.plan, &before, &after))?;
    }

    let mut campaign_again = None;
    if !args.no_campaign {
        let seed = campaign.campaign().seed;
        let name = compensated_name(&seed.to_string(), &found.name);
        let done = again.run(&name, &Task::Campaign, seed)?;
        let Some((repository, folder)) = done else { return Ok(ExitCode::from(STOPPED)) };
        if for_people {
            report_outcome(&repository, &folder, &folder.join("report.html"), &args.output)?;
        }
        campaign_again = Some(folder);
    }
    if !for_people {
        let side = |tests: &[&LabTraces], judged: &Judged| Side {
            tests: tests.iter().map(|test| TestNumber(test.number).to_string()).collect(),
            discrepancy_before: judged.before,
            discrepancy_after: judged.after,
        };
        let metrics = compensation::before_and_after(&session.plan, &before, &after);
        print_json(&Compensated {
            compensation: &outcome.compensation,
            fitted: side(&fitted_to, &outcome.fitted),
            held_out: outcome.held_out.as_ref().map(|judged| side(&held_out, judged)),
            metrics: serde_json::from_str(&metrics.json())?,
            simulated_again: &simulated_folder,
            campaign_again: campaign_again.as_deref(),
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The run that recorded the tests of a lab: the one that is named, or the one beside it after which the lab's folder
/// is named.
fn campaign_of(
    session: &Session,
    lab: &Repository,
    task: &LabTask,
    named: Option<&Path>,
) -> Result<Repository, Failure> {
    if let Some(named) = named {
        return open(&session.results, Some(named));
    }
    let folder = lab.folder().canonicalize()?;
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    // A second run in a lab is `42-hall-2`.
    let run = name.rfind(&format!("-{}", task.lab)).map(|end| folder.with_file_name(&name[..end]));
    match run.filter(|run| run.is_dir()) {
        Some(run) => Ok(Repository::open(&run)?),
        None => Err(Failure(format!(
            "which run recorded the tests of {}? name its folder with `--results`",
            shown(lab.folder())
        ))),
    }
}

/// The tests that are fitted to, and those that are kept aside.
fn split<'t>(
    campaign: &Repository,
    traces: &'t [LabTraces],
    held_out: &[String],
) -> Result<(Vec<&'t LabTraces>, Vec<&'t LabTraces>), Failure> {
    let mut aside = Vec::new();
    for name in held_out {
        let number = campaign.find(name)?;
        let number = campaign.row(number)?.duplicate_of.unwrap_or(number);
        if !traces.iter().any(|test| test.number == number) {
            return Err(Failure(format!("`{name}` was not run in the lab, or has no trace there")));
        }
        aside.push(number);
    }
    if held_out.is_empty() && traces.len() > 1 {
        let every_third = traces.iter().skip(ONE_IN - 1).step_by(ONE_IN).map(|test| test.number);
        aside.extend(every_third);
        if aside.is_empty() {
            aside.extend(traces.last().map(|test| test.number));
        }
    }
    let (aside, fitted): (Vec<_>, Vec<_>) = traces.iter().partition(|test| aside.contains(&test.number));
    if fitted.is_empty() {
        return Err(Failure("all tests of the lab are held out; leave one to fit to".to_owned()));
    }
    Ok((fitted, aside))
}

/// Fits; `None` when the user stopped it.
fn fitted(
    session: &Session,
    args: &CompensateArgs,
    campaign: &Repository,
    (lab, task, seed): (&Lab, &LabTask, u64),
    (fitted_to, held_out): (&[&LabTraces], &[&LabTraces]),
    journal: &mut Journal,
    interrupted: &AtomicBool,
) -> Result<Option<fitting::Outcome>, Failure> {
    let scratch = Scratch::new("compensate")?;
    let longest = fitted_to.iter().chain(held_out).map(|test| Ok(limit(&campaign.test(test.number)?)));
    let longest = longest.collect::<Result<Vec<_>, Failure>>()?.into_iter().max().unwrap_or(Duration::from_secs(60));
    let mut pool = Pool::start(&PoolSettings {
        workers: usize::try_from(args.execution.workers(&session.plan)).unwrap_or(1),
        program: session.program.clone().recording(true),
        first: 1,
        retries: Retries::Here,
        directory: scratch.path().to_owned(),
        timeout: args.execution.timeout().unwrap_or(longest),
    })?;
    let mut simulations =
        Simulations { plan: &session.plan, executor: &mut pool, folder: scratch.path().to_owned(), interrupted };
    let settings = Settings {
        lab: &lab.name,
        fits: &lab.fits,
        evaluations: usize::try_from(args.evaluations).unwrap_or(usize::MAX),
        repeats: task.repeats,
        seed,
    };
    let started = Instant::now();
    let mut said = Instant::now();
    let found = fitting::fit(
        &mut simulations,
        journal,
        fitted_to,
        held_out,
        settings,
        &mut |Progress { done, total, best }| {
            if said.elapsed() >= LINE_EVERY {
                said = Instant::now();
                let left = started.elapsed().as_secs_f64() / done as f64 * (total - done) as f64;
                say(format_args!("   Fitting {done}/{total}  discrepancy {best:.4}  {} left", wait(left)));
            }
        },
    );
    Ok(found?)
}

/// How the compensated simulation runs.
struct Again<'a> {
    session: &'a Session,
    args: &'a CompensateArgs,
    /// The folder for folders of results.
    results: PathBuf,
    plan: CampaignPlan,
    interrupted: &'a AtomicBool,
}

impl Again<'_> {
    /// Runs a task; `None` when the user stopped it.
    fn run(&self, name: &str, task: &Task, seed: u64) -> Result<Option<(Repository, PathBuf)>, Failure> {
        let Again { session, args, results, plan, interrupted } = self;
        let plan = task.plan(plan);
        let files = claim_files(&session.runner, &plan)?;
        let (recorder, folder) = begin(session, results, name, &plan, task, seed, &args.execution)?;
        say(format_args!("   Running {} in {}", task.keyword(&plan), shown(&folder)));
        let again = |more: &[&str]| session.caller.command("resume", &[more, &[&shown(&folder)]].concat());
        let done = perform(session, recorder, &folder, &args.execution, files, interrupted, &again)?;
        Ok(done.map(|repository| (repository, folder)))
    }
}

/// What was fitted, and how far the simulation is from the lab.
fn fitted_text(
    plan: &CampaignPlan,
    fits: &[Fit],
    outcome: &fitting::Outcome,
    (fitted_to, held_out): (&[&LabTraces], &[&LabTraces]),
) -> String {
    let names = |tests: &[&LabTraces]| {
        let names: Vec<String> = tests.iter().map(|test| TestNumber(test.number).to_string()).collect();
        names.join(", ")
    };
    let side = |judged: &Judged| {
        let [before, after] = [judged.before, judged.after].map(|value| quantity(value, None));
        format!("from {before} to {after} standard deviations")
    };
    let values = compensation::values(plan, fits, &outcome.compensation).text(text_options());
    let fitted = format!(
        "The traces of {}, to which it was fitted, came closer to those of the lab: {}.",
        names(fitted_to),
        side(&outcome.fitted)
    );
    let held_out = outcome
        .held_out
        .as_ref()
        .map(|judged| format!("Those of {}, kept aside to judge by: {}.\n", names(held_out), side(judged)));
    format!("{values}\n{fitted}\n{}\n", held_out.unwrap_or_default())
}

/// The gap before and after.
fn gap_text(plan: &CampaignPlan, before: &Gap, after: &Gap) -> String {
    let table = compensation::before_and_after(plan, before, after).text(text_options());
    format!("{table}\nAfter the compensation: {}\n", after.sentences(plan).join("\n"))
}
