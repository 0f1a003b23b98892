//! `sesamec lab form` and `sesamec lab add`: results of a lab in which people ran the tests by hand. A form is printed,
//! filled in, and recorded.

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

use anyhow::{Context as _, anyhow, bail, ensure};
use clap::{Args, ValueEnum};

use sesame_analysis::gap::lab_runs;
use sesame_analysis::{excluded, exclusions};
use sesame_codegen::input;
use sesame_codegen::output::FreshFolder;
use sesame_dsl::similar::most_similar;
use sesame_plan::{CampaignPlan, LabTask, LabTest, Task};
use sesame_record::{DATABASE, Entered, EnteredRun, Provenance, Recorder, Repository};
use sesame_runtime::cli::Caller;

use self::campaign::Campaign;
use self::check::Taken;
use self::form::Wanted;
use crate::cli::commands::all;
use crate::cli::shell::{self, Shell};

/// The lab of a space that declares none.
const ONLY: &str = "lab";

/// Why results that were entered have ended.
const ENDED: &str = "entered by hand";

/// For which runs there are rows.
#[derive(Debug, Args)]
pub(in super::super) struct Form {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// The tests to be run, for example `T158 T17`; the front if omitted.
    #[arg(value_name = "TEST")]
    tests: Vec<String>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// How often each test is run; if omitted, as often as the lab's `physical` block says, or else once.
    #[arg(short = 'n', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    times: Option<u32>,
    /// Also print rows for tests that the lab excludes as too dangerous.
    #[arg(long)]
    although_excluded: bool,
    /// Write the form into this file, which must not exist; if omitted, it is printed.
    #[arg(short, long, value_name = "FILE")]
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
pub(in super::super) struct Add {
    /// The results of the campaign: a results file, or the folder of a run.
    results: PathBuf,
    /// Filled-in forms, as CSV or JSON.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The lab; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// Who ran the tests, for forms that leave it empty.
    #[arg(long, value_name = "TEXT")]
    operator: Option<String>,
    /// The robots, for forms that leave them empty.
    #[arg(long, value_name = "TEXT")]
    hardware: Option<String>,
    /// The software of the robots, for forms that leave it empty.
    #[arg(long, value_name = "TEXT")]
    software: Option<String>,
    /// The date, in any notation, for forms that leave it empty.
    #[arg(long, value_name = "TEXT")]
    date: Option<String>,
    /// The folder for the lab's results; runs already in it stay. If omitted, a folder beside the run, named after the
    /// run and the lab.
    #[arg(long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

/// Prints a form.
pub(super) fn print_form(shell: Shell, asked: &Form) -> anyhow::Result<()> {
    let campaign = Campaign::open(&asked.results)?;
    let name = lab_name(campaign.plan(), asked.lab.as_deref())?;
    let lab = campaign.plan().labs.iter().find(|lab| lab.name == name);
    let times = asked.times.unwrap_or_else(|| lab.map_or(1, |lab| lab.repeats));
    let mut tests = campaign.to_run(&asked.tests)?;
    if let Some(lab) = lab.filter(|_| !asked.although_excluded)
        && let Some(said) = exclusions(campaign.repository(), lab, &tests)?
    {
        ensure!(asked.tests.is_empty(), "{said}; leave them out, or pass `--although-excluded`");
        shell.note(said);
        let excluded = excluded(campaign.repository(), lab, &tests)?;
        tests.retain(|test| excluded.iter().all(|(number, _)| number != test));
        ensure!(!tests.is_empty(), "lab `{name}` excludes every test of the front; name others, for example `T1 T2`");
    }
    let wanted = Wanted { lab: &name, tests: &tests, times };
    let text = match asked.format {
        Written::Csv => form::csv(&campaign, &wanted),
        Written::Json => form::json(&campaign, &wanted),
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
    let rows = tests.len() * times as usize;
    shell.did("Written", format!("{}: a form for {}", file.display(), counted(rows, "run")));
    let [results, file] = [&asked.results, file].map(|path| path.display().to_string());
    let mut arguments = vec![results.as_str(), &file];
    if asked.lab.is_some() {
        arguments.extend(["--lab", &name]);
    }
    shell.text(&format!("\nNext:\n\n  fill in the form, then    {}\n", command("lab add", &arguments)));
    Ok(())
}

/// Records filled-in forms.
pub(super) fn add(shell: Shell, asked: &Add) -> anyhow::Result<()> {
    let campaign = Campaign::open(&asked.results)?;
    let name = lab_name(campaign.plan(), asked.lab.as_deref())?;
    let provenance = Provenance {
        operator: said("--operator", asked.operator.as_ref())?,
        hardware: said("--hardware", asked.hardware.as_ref())?,
        software: said("--software", asked.software.as_ref())?,
        date: said("--date", asked.date.as_ref())?,
    };
    let folder = asked.output.clone().map_or_else(|| beside(campaign.folder(), &name), Ok)?;
    let earlier = if folder.join(DATABASE).exists() { Some(Repository::open(&folder)?) } else { None };
    let before = earlier.as_ref().map_or_else(|| Ok(Vec::new()), |earlier| recorded(earlier, &campaign, &name))?;

    let mut taken = Taken::new(&campaign, &name, &provenance, &folder, &before);
    for file in &asked.files {
        match input::bytes(file, input::MOST_OF_A_TEXT) {
            Ok(bytes) => taken.take(file, &bytes),
            Err(error) => taken.refuse(format!("{}: cannot be read: {error}", file.display())),
        }
    }
    let (runs, blank) = taken.finish().map_err(|mut mistakes| {
        mistakes.push("nothing was recorded; correct this and add the files again".to_owned());
        all(&mistakes)
    })?;

    let task = task(&campaign, &name, earlier.as_ref(), &before, &runs)?;
    if let Some(earlier) = earlier {
        drop(earlier);
        append(&folder, task, &before, &runs)?;
    } else {
        create(&campaign, &folder, task, &runs)?;
    }
    let tests: BTreeSet<u32> = runs.iter().map(|run| run.of).collect();
    if let Some(lab) = campaign.plan().labs.iter().find(|lab| lab.name == name) {
        let tests: Vec<u32> = tests.iter().copied().collect();
        exclusions(campaign.repository(), lab, &tests)?.into_iter().for_each(|said| shell.note(said));
    }
    let (runs, tests) = (counted(runs.len(), "run"), counted(tests.len(), "test"));
    shell.did("Recorded", format!("{}: {runs} of {tests} in lab `{name}`", folder.display()));
    if blank > 0 {
        let rows = if blank == 1 { "1 row is".to_owned() } else { format!("{blank} rows are") };
        shell.note(format!("{rows} not filled in, so these runs are not recorded"));
    }
    let [results, folder] = [&asked.results, &folder].map(|path| path.display().to_string());
    shell.text(&format!(
        "\nNext:\n\n  look at the runs                 {}\n  compare them with the campaign    {}\n",
        command("results", &["tests", &folder]),
        command("gap", &[&results, &folder]),
    ));
    Ok(())
}

/// The folder for the results of a lab, where a runner would put them: beside the run, named after both.
fn beside(run: &Path, lab: &str) -> anyhow::Result<PathBuf> {
    let whole = std::path::absolute(run)?;
    let Some(name) = whole.file_name() else {
        bail!("{} has no folder beside it; name one for the results of the lab with `--output`", run.display())
    };
    let mut named = name.to_owned();
    named.push(format!("-{lab}"));
    Ok(if run.file_name().is_some() { run.with_file_name(named) } else { whole.with_file_name(named) })
}

/// The lab of this name; without one the only lab of the space, or [`ONLY`] if the space has none.
fn lab_name(plan: &CampaignPlan, asked: Option<&str>) -> anyhow::Result<String> {
    let names = || plan.labs.iter().map(|lab| lab.name.as_str());
    let known = || names().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    match (asked, &plan.labs[..]) {
        (None, []) => Ok(ONLY.to_owned()),
        (None, [lab]) => Ok(lab.name.clone()),
        (None, _) => bail!("the space has several labs; name one with `--lab`: {}", known()),
        (Some(name), []) => {
            let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) && !name.is_empty();
            ensure!(plain, "`--lab` names a lab as a space would: with letters, digits, `_` and `-`");
            Ok(name.to_owned())
        }
        (Some(name), _) if names().any(|known| known == name) => Ok(name.to_owned()),
        (Some(name), _) => match most_similar(name, names()) {
            Some(meant) => bail!("there is no lab `{name}`; did you mean `{meant}`?"),
            None => bail!("there is no lab `{name}`, there is {}", known()),
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

/// The runs that a folder holds, which must be of this lab and of tests of this campaign.
fn recorded(earlier: &Repository, campaign: &Campaign, lab: &str) -> anyhow::Result<Vec<EnteredRun>> {
    const OTHER: &str = "choose another folder with `--output`";
    let folder = earlier.folder().display();
    let runs = earlier.entered_runs()?;
    let Some(task) = earlier.task().in_lab().filter(|_| !runs.is_empty()) else {
        bail!("{folder} holds results that were not entered by hand; {OTHER}");
    };
    ensure!(task.lab == lab, "{folder} holds runs of lab `{}`, not of `{lab}`; {OTHER}", task.lab);
    lab_runs(campaign.repository(), earlier).map_err(|error| anyhow!("{error}; or {OTHER}"))?;
    Ok(runs)
}

/// The task of results that hold the runs of before and these.
fn task(
    campaign: &Campaign,
    lab: &str,
    earlier: Option<&Repository>,
    before: &[EnteredRun],
    runs: &[Entered],
) -> anyhow::Result<LabTask> {
    let earlier = earlier.and_then(|earlier| earlier.task().in_lab());
    let tests = earlier.map_or(&[][..], |task| &task.tests);
    let mut tests: BTreeMap<u32, LabTest> = tests.iter().map(|test| (test.number, test.clone())).collect();
    let mut times: BTreeMap<u32, u32> = BTreeMap::new();
    for of in before.iter().map(|run| run.of).chain(runs.iter().map(|run| run.of)) {
        *times.entry(of).or_default() += 1;
        tests.entry(of).or_insert_with(|| LabTest { number: of, test: campaign.test(of).clone() });
    }
    Ok(LabTask {
        lab: lab.to_owned(),
        results: earlier.map_or_else(|| campaign.repository().digest(), |task| Ok(task.results.clone()))?,
        tests: tests.into_values().collect(),
        repeats: times.into_values().max().unwrap_or(1),
    })
}

/// Records runs in a folder of their own, which is not there until all are recorded.
fn create(campaign: &Campaign, folder: &Path, task: LabTask, runs: &[Entered]) -> anyhow::Result<()> {
    let fresh = FreshFolder::begin(folder)?;
    let whole = Task::Lab(task.clone());
    let mut plan = whole.plan(campaign.plan());
    // Nobody recorded messages.
    plan.campaign.record = None;
    let seed = campaign.repository().campaign().seed;
    let mut recorder = Recorder::create_for(fresh.path(), &plan, &whole, seed, 0)?;
    recorder.put_entered_runs(task, runs)?;
    drop(recorder.finish(ENDED)?);
    fresh.settle()?;
    Ok(())
}

/// Records runs beside those that are in a folder.
fn append(folder: &Path, task: LabTask, before: &[EnteredRun], runs: &[Entered]) -> anyhow::Result<()> {
    let mut recorder = Recorder::reopen(folder, 0)?;
    // Only now nobody else writes there.
    ensure!(
        recorder.repository().entered_runs()? == before,
        "runs were added to {} at the same time; add the files again",
        folder.display()
    );
    recorder.put_entered_runs(task, runs)?;
    recorder.finish(ENDED)?;
    Ok(())
}

/// A command that can be pasted into a shell.
fn command(name: &str, arguments: &[&str]) -> String {
    Caller { program: shell::command().to_owned(), arguments: Vec::new() }.command(name, arguments)
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
