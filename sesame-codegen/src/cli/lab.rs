//! `sesamec lab`: results of a lab in which people ran the tests by hand. A form is printed, filled in, and recorded.

mod campaign;
mod check;
mod form;
mod mistakes;
mod read_csv;
mod read_json;
mod sheet;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail, ensure};
use clap::{Args, Subcommand, ValueEnum};

use sesame_dsl::similar::most_similar;
use sesame_plan::{CampaignPlan, LabTask, LabTest, Task};
use sesame_results::record::{DATABASE, Entered, EnteredRun, Provenance, Recorder, Repository};
use sesame_runtime::cli::Caller;

use self::campaign::Campaign;
use self::check::{Recorded, Taken};
use super::commands::all;
use super::shell::{self, Shell};
use crate::input;
use crate::output::FreshFolder;

/// The folder in that of a run for results of a lab that are entered by hand.
const FOLDER: &str = "lab";

/// Why results that were entered have ended.
const ENDED: &str = "entered by hand";

/// What is done with runs that people make by hand.
#[derive(Debug, Subcommand)]
pub(super) enum Lab {
    /// Print a form for runs in a lab, to be filled in: a row for each run of each test.
    Form(Form),
    /// Check filled-in forms, and record their runs as results of the lab.
    Add(Add),
}

/// For which runs there are rows.
#[derive(Debug, Args)]
pub(super) struct Form {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// The tests to be run, for example `T158 T17`; the front if omitted.
    #[arg(value_name = "TEST")]
    tests: Vec<String>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// How often each test is run; if omitted, as often as the lab's `physical` block says, or else once.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    repeats: Option<u32>,
    /// Write the form into this file, which must not exist; if omitted, it is printed.
    #[arg(long, short = 'o', value_name = "FILE")]
    out: Option<PathBuf>,
    /// How the form is written: for a spreadsheet, or for a program.
    #[arg(long, value_enum, default_value_t)]
    format: Written,
}

/// How runs are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Written {
    #[default]
    Csv,
    Json,
}

/// What is recorded, and where.
#[derive(Debug, Args)]
pub(super) struct Add {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// Filled-in forms, as CSV or JSON.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// Who ran the tests.
    #[arg(long, value_name = "TEXT")]
    operator: Option<String>,
    /// On which robots.
    #[arg(long, value_name = "TEXT")]
    hardware: Option<String>,
    /// With which software.
    #[arg(long, value_name = "TEXT")]
    software: Option<String>,
    /// When, in any notation.
    #[arg(long, value_name = "TEXT")]
    date: Option<String>,
    /// The folder for the results; runs of the same lab that are there already are added to. If omitted, the next free
    /// one of `lab/1`, `lab/2`, … in the folder of the run.
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Does what is asked.
pub(super) fn lab(shell: Shell, asked: &Lab) -> anyhow::Result<ExitCode> {
    match asked {
        Lab::Form(asked) => print_form(shell, asked)?,
        Lab::Add(asked) => add(shell, asked)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn print_form(shell: Shell, asked: &Form) -> anyhow::Result<()> {
    let campaign = Campaign::open(&asked.results)?;
    let repeats = match asked.repeats {
        Some(repeats) => repeats,
        None => {
            let name = lab_name(campaign.plan(), asked.lab.as_deref())?;
            campaign.plan().labs.iter().find(|lab| lab.name == name).map_or(1, |lab| lab.repeats)
        }
    };
    if asked.repeats.is_some() && asked.lab.is_some() {
        lab_name(campaign.plan(), asked.lab.as_deref())?;
    }
    let tests = campaign.to_run(&asked.tests)?;
    let text = match asked.format {
        Written::Csv => form::csv(&campaign, &tests, repeats),
        Written::Json => form::json(&campaign, &tests, repeats),
    };
    let Some(file) = &asked.out else { return shell::asked_for(&text) };
    let written = OpenOptions::new().write(true).create_new(true).open(file);
    let mut written = written.map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            anyhow!("{} exists, and a form may be filled in; choose another name with `-o`", file.display())
        }
        _ => anyhow!("cannot write {}: {error}", file.display()),
    })?;
    written.write_all(text.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
    let rows = tests.len() * repeats as usize;
    shell.did("Written", format!("{}: a form for {}", file.display(), counted(rows, "run")));
    shell.text(&format!(
        "\nNext:\n\n  fill in the form, then    {}\n",
        command("lab add", &[&campaign.folder().display().to_string(), &file.display().to_string()])
    ));
    Ok(())
}

fn add(shell: Shell, asked: &Add) -> anyhow::Result<()> {
    let campaign = Campaign::open(&asked.results)?;
    let provenance = Provenance {
        operator: said("--operator", asked.operator.as_ref())?,
        hardware: said("--hardware", asked.hardware.as_ref())?,
        software: said("--software", asked.software.as_ref())?,
        date: said("--date", asked.date.as_ref())?,
    };
    let earlier = match &asked.output {
        Some(folder) if folder.join(DATABASE).exists() => Some(Repository::open(folder)?),
        _ => None,
    };
    let earlier_lab = earlier.as_ref().and_then(|it| it.task().in_lab()).map(|task| task.lab.as_str());
    let name = lab_name(campaign.plan(), asked.lab.as_deref().or(earlier_lab))?;
    let before = earlier.as_ref().map_or_else(|| Ok(Vec::new()), |it| runs_of(it, &campaign, &name))?;

    let recorded = earlier.as_ref().map(|it| Recorded { folder: it.folder().to_owned(), runs: &before });
    let mut taken = Taken::new(&campaign, recorded);
    for file in &asked.files {
        let bytes = input::bytes(file, input::MOST_OF_A_TEXT);
        let bytes = bytes.map_err(|error| anyhow!("{}: cannot be read: {error}", file.display()));
        match bytes {
            Ok(bytes) => taken.take(file, &bytes),
            Err(error) => taken.refuse(error.to_string()),
        }
    }
    let runs = match taken.finish() {
        Ok(runs) => runs,
        Err(mut mistakes) => {
            mistakes.push("nothing was recorded; correct this and add the files again".to_owned());
            return Err(all(&mistakes));
        }
    };

    let task = task(&campaign, &name, earlier.as_ref(), &before, &runs);
    let folder = match (asked.output.clone(), earlier) {
        (Some(folder), Some(earlier)) => {
            drop(earlier);
            append(&folder, task, &provenance, &before, &runs)?;
            folder
        }
        (Some(folder), None) => create(&campaign, folder, task, &provenance, &runs)?,
        (None, _) => create(&campaign, next_free(&campaign.folder().join(FOLDER)), task, &provenance, &runs)?,
    };
    let tests: BTreeSet<u32> = runs.iter().map(|run| run.of).collect();
    shell.did(
        "Recorded",
        format!(
            "{}: {} of {} in lab `{name}`",
            folder.display(),
            counted(runs.len(), "run"),
            counted(tests.len(), "test")
        ),
    );
    let look = command("results", &["tests", &folder.display().to_string()]);
    shell.text(&format!("\nNext:\n\n  look at the runs    {look}\n"));
    Ok(())
}

/// The lab of this name; without one the only lab of the space, or `lab` if the space has none.
fn lab_name(plan: &CampaignPlan, asked: Option<&str>) -> anyhow::Result<String> {
    let names = || plan.labs.iter().map(|lab| lab.name.as_str());
    let known = || names().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match (asked, &plan.labs[..]) {
        (None, []) => Ok(FOLDER.to_owned()),
        (None, [lab]) => Ok(lab.name.clone()),
        (None, _) => bail!("the space has several labs; name one with `--lab`: {}", known()),
        (Some(name), []) => Ok(said("--lab", Some(&name.to_owned()))?.unwrap_or_default()),
        (Some(name), _) if names().any(|known| known == name) => Ok(name.to_owned()),
        (Some(name), _) => match most_similar(name, names()) {
            Some(meant) => bail!("there is no lab `{name}`; did you mean `{meant}`?"),
            None => bail!("there is no lab `{name}`; there is {}", known()),
        },
    }
}

/// A text that is recorded and shown later.
fn said(option: &str, text: Option<&String>) -> anyhow::Result<Option<String>> {
    let Some(text) = text else { return Ok(None) };
    ensure!(!text.trim().is_empty(), "`{option}` is empty; give a text or leave it out");
    ensure!(!text.chars().any(char::is_control), "`{option}` contains control characters; give one line of text");
    Ok(Some(text.trim().to_owned()))
}

/// The runs that a folder holds, which must be of this lab and of tests of these results.
fn runs_of(earlier: &Repository, campaign: &Campaign, lab: &str) -> anyhow::Result<Vec<EnteredRun>> {
    let folder = earlier.folder().display();
    let runs = earlier.lab_runs()?;
    let Some(task) = earlier.task().in_lab().filter(|_| !runs.is_empty()) else {
        bail!("{folder} holds results that were not entered by hand; choose another folder with `--output`");
    };
    ensure!(
        task.lab == lab,
        "{folder} holds runs of lab `{}`, not of `{lab}`; choose another folder with `--output`",
        task.lab
    );
    ensure!(
        task.results == campaign.digest(),
        "{folder} holds runs of tests of other results, or was written before tests were run again there; choose \
         another folder with `--output`"
    );
    Ok(runs)
}

/// The task of results that hold the runs of before and these.
fn task(
    campaign: &Campaign,
    lab: &str,
    earlier: Option<&Repository>,
    before: &[EnteredRun],
    runs: &[Entered],
) -> LabTask {
    let mut tests: BTreeMap<u32, LabTest> = BTreeMap::new();
    if let Some(task) = earlier.and_then(|it| it.task().in_lab()) {
        tests.extend(task.tests.iter().map(|it| (it.number, it.clone())));
    }
    let mut times: BTreeMap<u32, u32> = BTreeMap::new();
    for of in before.iter().map(|run| run.of).chain(runs.iter().map(|run| run.of)) {
        *times.entry(of).or_default() += 1;
        tests.entry(of).or_insert_with(|| LabTest { number: of, test: campaign.test(of).clone() });
    }
    LabTask {
        lab: lab.to_owned(),
        results: campaign.digest().to_owned(),
        tests: tests.into_values().collect(),
        repeats: times.into_values().max().unwrap_or(1),
    }
}

/// Records runs in a folder of their own, which is not there until all are recorded. Gives the folder.
fn create(
    campaign: &Campaign,
    folder: PathBuf,
    task: LabTask,
    provenance: &Provenance,
    runs: &[Entered],
) -> anyhow::Result<PathBuf> {
    let fresh = FreshFolder::begin(&folder)?;
    let whole = Task::Lab(task.clone());
    let plan = whole.plan(campaign.plan());
    let mut recorder = Recorder::create_for(fresh.path(), &plan, &whole, campaign.seed(), 0)?;
    recorder.put_entered_runs(task, provenance, runs)?;
    drop(recorder.finish(ENDED)?);
    fresh.settle()?;
    Ok(folder)
}

/// Records runs beside those that are in a folder.
fn append(
    folder: &Path,
    task: LabTask,
    provenance: &Provenance,
    before: &[EnteredRun],
    runs: &[Entered],
) -> anyhow::Result<()> {
    let mut recorder = Recorder::reopen(folder, 0)?;
    // Only now nobody else writes there.
    ensure!(
        recorder.repository().lab_runs()? == before,
        "runs were added to {} at the same time; add the files again",
        folder.display()
    );
    recorder.put_entered_runs(task, provenance, runs)?;
    recorder.finish(ENDED)?;
    Ok(())
}

/// The first of `1`, `2`, … that is not there.
fn next_free(parent: &Path) -> PathBuf {
    let mut numbered = (1u32..).map(|n| parent.join(n.to_string()));
    numbered.find(|folder| !folder.exists() && !folder.is_symlink()).expect("a folder holds fewer than 2^32 others")
}

/// A command that can be pasted into a shell.
fn command(name: &str, arguments: &[&str]) -> String {
    Caller { program: shell::command().to_owned(), arguments: Vec::new() }.command(name, arguments)
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
