//! `sesamec study`: the page of a campaign and its lab.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail, ensure};
use clap::Args;

use sesame_analysis::choice::Choosing;
use sesame_analysis::gap::{Gap, dimensions, points};
use sesame_analysis::{Candidates, Selection, Terms, candidates};
use sesame_plan::{Dimension, Lab, LabBudget};
use sesame_record::Repository;
use sesame_report::study::{Space, Study, Traces};
use sesame_report::write_aside;
use sesame_safety::briefing::html::section;

use super::gap::Sides;
use super::lab::{Conditions, sheets};
use super::select::named_lab;
use super::shell::Shell;

/// How long all choices together may take.
const LIMIT: Duration = Duration::from_secs(60);

/// What the page is of.
#[derive(Debug, Args)]
pub(super) struct Asked {
    /// The results of the campaign: a results file, or the folder of a run.
    campaign: PathBuf,
    /// The results of the lab in which tests of this campaign were run; none before its first run, several are taken
    /// together.
    #[arg(value_name = "LAB")]
    labs: Vec<PathBuf>,
    /// The tests that `compensate` simulated again: the folder of its results.
    #[arg(long, value_name = "DIR")]
    simulation: Option<PathBuf>,
    /// The lab, if it has not run yet; the only one of the space if omitted.
    #[arg(long, value_name = "NAME")]
    lab: Option<String>,
    /// The file of the page; replaces an earlier page of a study, but no other file.
    #[arg(short, long, value_name = "FILE", default_value = "study.html")]
    out: PathBuf,
    /// Also write each figure as an SVG file into this folder.
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    conditions: Conditions,
}

/// Writes the page.
pub(super) fn write(shell: Shell, asked: &Asked) -> anyhow::Result<ExitCode> {
    let sides = Sides::read(&asked.campaign, &asked.labs, asked.simulation.as_deref())?;
    let campaign = &sides.campaign;
    let lab = lab(&sides, asked.lab.as_deref())?;
    let gap = if sides.labs.is_empty() { None } else { Some(sides.gap()?) };
    let after = sides.gap_after()?;
    let chosen = Chosen::of(campaign, lab, gap.as_ref())?;
    let until = Instant::now() + LIMIT;
    let mut stop = || Instant::now() >= until;
    let choosing = chosen.choosing()?;
    let best = choosing.best(&mut stop);
    let sweep = choosing.sweep(&mut stop);
    if !sweep.proved {
        shell.note("not all choices are proved: there may be better ones".to_owned());
    }
    let ran = gap.as_ref().map_or(&[][..], |gap| &gap.tests);
    let others = others(campaign, &chosen)?;
    let space = Space::new(campaign.plan(), &chosen.terms, &choosing, &sweep, chosen.lambda, ran, &others);
    let tests = sides.traces()?;
    let traces = sides.compared(&tests).map(|gap| Traces { tests, gap });
    if traces.is_none() && !sides.labs.is_empty() {
        shell.note(format!(
            "no test has a trace on both sides; `{} replay FILE TEST --record` records one of the simulation",
            super::shell::command()
        ));
    }
    let tests: BTreeSet<u32> = best.tests.iter().chain(ran).copied().collect();
    let names: Vec<String> = tests.iter().map(|test| format!("T{test}")).collect();
    let sheets = sheets(shell, &asked.conditions, campaign, Some(lab), &names)?;
    let sheets: Vec<String> = sheets.iter().map(section).collect();
    let study = Study {
        campaign,
        lab,
        labs: &sides.labs,
        again: sides.again.as_ref(),
        space: &space,
        choices: &choosing.sweep_table(&sweep),
        chosen: &choosing.table(campaign.plan(), &chosen.terms, &best, &ran.iter().copied().collect()),
        gap: gap.as_ref(),
        after: after.as_ref(),
        traces: traces.as_ref(),
        simulated_after: &sides.simulated_after()?,
        sheets: &sheets,
    };
    let (page, figures) = study.page()?;
    replace_page(&asked.out, &page)?;
    shell.did("Wrote", asked.out.display());
    if let Some(folder) = &asked.svg {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        for figure in &figures {
            let file = folder.join(format!("{}.svg", figure.name));
            std::fs::write(&file, figure.svg()).with_context(|| format!("cannot write {}", file.display()))?;
        }
        shell.did("Wrote", format!("{} figures into {}", figures.len(), folder.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// The lab of the results, or the one that is named.
fn lab<'a>(sides: &'a Sides, name: Option<&str>) -> anyhow::Result<&'a Lab> {
    match (&sides.lab, name) {
        (Some(lab), Some(name)) if lab.name != name => bail!("the results are of lab `{}`, not `{name}`", lab.name),
        (Some(lab), _) => Ok(lab),
        (None, name) => match named_lab(sides.campaign.plan(), name)? {
            Some(lab) => Ok(lab),
            None => bail!("the space has no lab; declare one with `physical`"),
        },
    }
}

/// What tests are chosen from, and how.
struct Chosen {
    terms: Terms,
    lambda: f64,
    found: Candidates,
    run: BTreeSet<u32>,
}

impl Chosen {
    /// As the lab's `budget` says. Without one, as many tests as were run, with as much weight on difference as on
    /// interest.
    fn of(campaign: &Repository, lab: &Lab, gap: Option<&Gap>) -> anyhow::Result<Chosen> {
        let plan = campaign.plan();
        let budgeted = match (&lab.budget, gap) {
            (Some(_), _) => lab.clone(),
            (None, None) => bail!("lab `{}` has no `budget`, and has run no tests: nothing can be shown", lab.name),
            (None, Some(gap)) => {
                let limit = gap.tests.len() as f64 * lab.cost.base.max(f64::MIN_POSITIVE);
                Lab { budget: Some(LabBudget { limit, lambda: 0.5, over: dimensions(None) }), ..lab.clone() }
            }
        };
        let (Some(terms), Some(budget)) = (Terms::of_lab(plan, &budgeted), &budgeted.budget) else {
            bail!("lab `{}` has no `budget`", lab.name)
        };
        let set = campaign.latest_result_set()?.map(|set| set.name);
        let found = candidates(campaign, &Selection::of(campaign, set.as_deref())?, &terms)?;
        Ok(Chosen { terms, lambda: budget.lambda, found, run: BTreeSet::new() })
    }

    fn choosing(&self) -> anyhow::Result<Choosing<'_>> {
        Ok(Choosing::new(&self.found, &self.terms, self.lambda, &self.run)?)
    }
}

/// The points of tests that are not candidates.
fn others(campaign: &Repository, chosen: &Chosen) -> anyhow::Result<Vec<Vec<f64>>> {
    let candidates: BTreeSet<u32> = chosen.found.tests.iter().map(|candidate| candidate.number).collect();
    let others: BTreeSet<u32> = campaign.numbers()?.into_iter().filter(|number| !candidates.contains(number)).collect();
    let dimensions: &[Dimension] = &chosen.terms.over;
    let points = points(campaign, &others, dimensions)?;
    Ok(points.into_values().filter_map(|point| point.into_iter().collect::<Option<Vec<f64>>>()).collect())
}

/// Writes the page, if nothing else is there that would be lost.
fn replace_page(file: &Path, page: &str) -> anyhow::Result<()> {
    if let Ok(earlier) = std::fs::read(file) {
        let own = String::from_utf8_lossy(&earlier).contains(Study::MARK);
        ensure!(own, "{} is not the page of a study; name another file with `--out`", file.display());
    }
    write_aside(file, page).with_context(|| format!("cannot write {}", file.display()))
}
