//! `sesamec gap`: the results of a lab beside those of the campaign that its tests come from.

mod traces;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;

use sesame_plan::Lab;
use sesame_results::analysis::extents;
use sesame_results::analysis::gap::{Gap, GapError, compensated_runs, gap, gap_after, lab_runs};
use sesame_results::analysis::traces::TraceGap;
use sesame_results::record::Repository;

use super::results::{Format, Output, print};
use super::shell::{self, Shell};

/// What is compared.
#[derive(Debug, Args)]
pub(super) struct Compared {
    /// The results of the campaign: a results file, or the folder of a run.
    campaign: PathBuf,
    /// The results of the lab, in which tests of this campaign were run; several are taken together.
    #[arg(required = true, value_name = "LAB")]
    labs: Vec<PathBuf>,
    /// Compare with the tests as `compensate` simulated them again: the folder of these results.
    #[arg(long, value_name = "DIR")]
    simulation: Option<PathBuf>,
    /// Show the traces instead: each signal of each test, how far both sides are apart, and how much later the lab is.
    #[arg(long, conflicts_with_all = ["events", "extents"])]
    traces: bool,
    /// Show how far each gap extends instead: everywhere, in a range, in some tests, or nowhere; of metrics, and of the
    /// lag and level of signals.
    #[arg(long, conflicts_with = "events")]
    extents: bool,
    /// Show requirements and interlocked metrics instead: how many tests violate them where.
    #[arg(long)]
    events: bool,
    #[command(flatten)]
    output: Output,
}

/// Says how simulation and lab differ.
pub(super) fn compared(shell: Shell, asked: &Compared) -> anyhow::Result<ExitCode> {
    let campaign = Repository::open(&asked.campaign)?;
    let mut runs = Vec::new();
    let mut lab: Option<Lab> = None;
    let mut in_lab = Vec::new();
    for file in &asked.labs {
        let repository = Repository::open(file)?;
        let own = lab_runs(&campaign, &repository)?;
        in_lab.push((repository.folder().to_owned(), own.clone()));
        runs.extend(own);
        let Some(task) = repository.task().in_lab() else { continue };
        match &lab {
            Some(lab) if lab.name != task.lab => {
                bail!(
                    "{} is of lab `{}`, and others are of lab `{}`; compare them apart",
                    file.display(),
                    task.lab,
                    lab.name
                )
            }
            // Tolerances and interlocks are those of the day on which the lab ran.
            _ => lab = repository.plan().labs.iter().find(|lab| lab.name == task.lab).cloned(),
        }
    }
    let plan = campaign.plan();
    let again = asked.simulation.as_deref().map(Repository::open).transpose()?;
    let again = again.map(|it| Ok::<_, GapError>((it.folder().to_owned(), compensated_runs(&campaign, &it)?)));
    let again = again.transpose()?;
    let traced = traces::compared(&campaign, again.as_ref(), &in_lab, lab.as_ref())?;
    if asked.traces {
        let Some(traced) = traced else { bail!("{}", traces::missing(&campaign, &runs)) };
        print(&traced.table(), &asked.output)?;
        if asked.output.format() == Format::Table {
            shell::asked_for(&format!("\n{}\n", traced.sentences().join("\n")))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let found = match &again {
        Some((_, again)) => gap_after(&campaign, again, &runs, lab.as_ref())?,
        None => gap(&campaign, &runs, lab.as_ref())?,
    };
    let for_people = asked.output.format() == Format::Table;
    let table = match () {
        () if asked.events => found.events(),
        () if asked.extents => extents(plan, &found, traced.as_ref()),
        () if for_people => found.overview(plan),
        () => found.comparisons(plan),
    };
    print(&table, &asked.output)?;
    if for_people && !asked.events && !asked.extents {
        let mut sentences = found.sentences(plan);
        sentences.extend(traced.iter().flat_map(TraceGap::sentences));
        sentences.extend(found.next_test(&campaign)?.map(|(_, why)| why));
        shell::asked_for(&format!("\n{}\n", sentences.join("\n")))?;
    }
    advise(shell, &found);
    Ok(ExitCode::SUCCESS)
}

/// Says aside what would make the comparison tell more.
fn advise(shell: Shell, found: &Gap) {
    let once = found.metrics.iter().flat_map(|gap| &gap.tests).filter(|test| test.selected).map(|test| test.test);
    let mut once: Vec<String> = once.map(|test| format!("T{test}")).collect();
    once.sort_unstable();
    once.dedup();
    if !once.is_empty() {
        shell.note(format!(
            "the simulation ran {} only when the search found it; this makes it comparable:\n    {} confirm FILE {}",
            once.join(", "),
            shell::command(),
            once.join(" ")
        ));
    }
}
