//! What the commands of preparatory testing share: where their runs are made and recorded, and how they end.
//!
//! A command records each side, or each stage, as a run of its own in a folder below its own. With `--resume` it goes
//! on in that folder: what is complete is read, what was begun is finished.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use clap::Args;
use serde::Serialize;

use sesame_base::gathered::gathered;
use sesame_plan::{CampaignPlan, Lab, Task};
use sesame_record as record;
use sesame_record::{DATABASE, Recorder, Repository};
use sesame_report::preparation::{self, Preparation};
use sesame_report::write_aside;

use crate::cli::execution::{ExecutionArgs, begin, claim_files, interruptible, perform, shown};
use crate::cli::failure::{Failure, NOT_AS_REQUIRED, STOPPED};
use crate::cli::results_folder::run_folder;
use crate::cli::session::Session;
use crate::cli::terminal::{Format, print, print_json, say, text_options};
use crate::lab::find;

/// Where the results of preparatory testing go, and how they are shown.
#[derive(Debug, Default, Args)]
pub(super) struct PreparationArgs {
    /// Continue in this folder, for example `results/mitm`, with the same options; complete runs are not repeated
    #[arg(long, value_name = "DIR", conflicts_with = "results")]
    resume: Option<PathBuf>,
    /// Folder in which the results get a folder of their own; by default `results` in the runner's folder
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// The format of the results; with JSON, standard output contains nothing else
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

impl PreparationArgs {
    /// The arguments of a command that has options of its own for them.
    pub(super) fn of(resume: Option<PathBuf>, results: Option<PathBuf>, format: Format) -> Self {
        PreparationArgs { resume, results, format }
    }
}

/// A lab of this name; without a name, the only one that runners reach, if there is exactly one.
pub(super) fn lab_of<'a>(plan: &'a CampaignPlan, name: Option<&str>) -> Result<Option<&'a Lab>, Failure> {
    if name.is_some() {
        return Ok(Some(find(plan, name)?));
    }
    let mut reached = plan.labs.iter().filter(|lab| lab.simulator.is_some());
    match (reached.next(), reached.next()) {
        (Some(lab), None) => Ok(Some(lab)),
        (None, _) => {
            say(format_args!("note: the space has no lab that a runner reaches, so there are runs in simulation only"));
            Ok(None)
        }
        (Some(_), Some(_)) => {
            say(format_args!(
                "note: the space has several labs, so there are runs in simulation only; name one with `--lab`"
            ));
            Ok(None)
        }
    }
}

/// A command of preparatory testing at work.
pub(super) struct Work<'a> {
    /// The folder of its results, or of those of one of its steps.
    folder: PathBuf,
    /// The folder with which the command goes on.
    whole: &'a Path,
    /// How it is called again to go on: its command and what it was given.
    command: &'a [String],
    execution: &'a ExecutionArgs,
    interrupted: &'a AtomicBool,
}

impl<'a> Work<'a> {
    /// A step of this work, with a folder of its own.
    pub(super) fn step(&self, name: &str) -> Work<'a> {
        Work { folder: self.folder.join(name), ..*self }
    }

    /// Makes the runs of a task in a folder below its own, or finishes them. `None` if the user stopped it, which is
    /// said.
    pub(super) fn runs(
        &self,
        session: &Session,
        name: &str,
        task: &Task,
        plan: &CampaignPlan,
        seed: u64,
        one_at_a_time: bool,
    ) -> Result<Option<Repository>, Failure> {
        let of_one = self.execution.one_at_a_time();
        let execution = if one_at_a_time { &of_one } else { self.execution };
        let folder = self.folder.join(name);
        let recorder = if folder.join(DATABASE).exists() {
            let known = Repository::open(&folder)?;
            refuse_other(&known, task, plan, seed)?;
            if known.campaign().stop.is_some() {
                return Ok(Some(known));
            }
            drop(known);
            Recorder::resume(&folder, execution.workers(plan))?
        } else {
            let (recorder, made) = begin(session, &self.folder, name, plan, task, seed, execution)?;
            if made != folder {
                return Err(Failure(format!("{} exists and does not contain results", shown(&folder))));
            }
            recorder
        };
        let files = claim_files(&session.runner, plan)?;
        let again = |more: &[&str]| {
            let given: Vec<&str> = self.command.iter().skip(1).map(String::as_str).collect();
            let name = self.command.first().map_or("prepare", String::as_str);
            session.caller.command(name, &[&given, more, &["--resume", &shown(self.whole)]].concat())
        };
        perform(session, recorder, &folder, execution, files, self.interrupted, &again)
    }
}

/// Insists that results are of this task, plan and seed.
fn refuse_other(known: &Repository, task: &Task, plan: &CampaignPlan, seed: u64) -> Result<(), Failure> {
    let folder = shown(known.folder());
    if let Some(difference) = known.plan().model_difference(plan) {
        return Err(Failure(format!(
            "the model has changed since {folder} was begun ({difference}); leave out `--resume` to begin anew"
        )));
    }
    if known.task() != task || known.campaign().seed != seed {
        return Err(Failure(format!(
            "{folder} was begun with other options; give the same ones, or leave out `--resume` to begin anew"
        )));
    }
    Ok(())
}

/// What a command of preparatory testing is called with.
pub(super) struct Call<'a> {
    /// Its name, which is also that of its folder.
    pub(super) name: &'a str,
    /// The words with which it is called again to go on: its command and what it was given.
    pub(super) command: Vec<String>,
    pub(super) args: &'a PreparationArgs,
    pub(super) execution: &'a ExecutionArgs,
}

/// Carries out a command: `steps` does the work and gives what was found with the results it was found in, or `None` if
/// the user stopped it.
pub(super) fn carry_out(
    session: &Session,
    call: Call<'_>,
    steps: impl FnOnce(&Work<'_>) -> Result<Option<Found>, Failure>,
) -> Result<ExitCode, Failure> {
    let Call { name, command, args, execution } = call;
    let (folder, claim) = if let Some(folder) = &args.resume {
        let folder = run_folder(&session.results, folder);
        if !folder.is_dir() {
            return Err(Failure(format!("there is nothing to go on with: {} is not a folder", shown(&folder))));
        }
        (folder, None)
    } else {
        let results = args.results.as_deref().unwrap_or(&session.results);
        let claim = record::claim_folder(results, name)?;
        (claim.folder.clone(), Some(claim))
    };
    let interrupted = interruptible()?;
    let work = Work { folder: folder.clone(), whole: &folder, command: &command, execution, interrupted: &interrupted };
    let found = steps(&work)?;
    // Others kept out of the folder as long as nothing was in it.
    drop(claim);
    match found {
        Some(found) => found.show(session, &folder, args.format),
        None => Ok(ExitCode::from(STOPPED)),
    }
}

/// What preparatory testing found.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) preparation: Preparation,
    /// The results, each with what it is.
    pub(super) files: Vec<(String, Repository)>,
    /// The positions among them of the regression tests in simulation and in the lab, if both ran.
    pub(super) known: Option<[usize; 2]>,
    /// Whether a step could not be carried out.
    pub(super) broken: bool,
}

/// What was found, for programs.
#[derive(Serialize)]
struct Concluded<'a> {
    /// Folder of the results.
    results: &'a Path,
    /// The page.
    report: &'a Path,
    /// Whether everything is as required.
    passed: bool,
    #[serde(flatten)]
    preparation: &'a Preparation,
}

impl Found {
    /// Writes the page and prints what was found.
    fn show(&self, session: &Session, folder: &Path, format: Format) -> Result<ExitCode, Failure> {
        let Found { preparation, files, broken, known: _ } = self;
        let page = folder.join("report.html");
        let named: Vec<(&str, &Repository)> = files.iter().map(|(name, file)| (name.as_str(), file)).collect();
        let html = preparation::page(&session.plan, preparation, &named)?;
        write_aside(&page, &html).map_err(|error| Failure(format!("cannot write {}: {error}", shown(&page))))?;
        let objections = preparation.objections();
        match format {
            Format::Text => {
                print(&preparation::text(preparation, text_options()))?;
                print(&format!("\n    Report {}\n", shown(&page)))?;
            }
            Format::Json => {
                let passed = objections.is_empty() && !broken;
                print_json(&Concluded { results: folder, report: &page, passed, preparation })?;
            }
        }
        for objection in gathered(&objections) {
            say(format_args!("not as required: {}", sesame_base::visible::visible_lines(&objection)));
        }
        Ok(match (broken, objections.is_empty()) {
            (true, _) => ExitCode::FAILURE,
            (false, true) => ExitCode::SUCCESS,
            (false, false) => ExitCode::from(NOT_AS_REQUIRED),
        })
    }
}
