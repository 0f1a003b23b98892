//! `sesamec gap`: the results of a lab beside those of the campaign that its tests come from.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;

use sesame_plan::Lab;
use sesame_results::analysis::gap::{Gap, gap, lab_runs};
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
    for file in &asked.labs {
        let repository = Repository::open(file)?;
        runs.extend(lab_runs(&campaign, &repository)?);
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
    let found = gap(&campaign, &runs, lab.as_ref())?;
    let for_people = asked.output.format() == Format::Table;
    let table = match (asked.events, for_people) {
        (true, _) => found.events(),
        (false, true) => found.overview(plan),
        (false, false) => found.comparisons(plan),
    };
    print(&table, &asked.output)?;
    if for_people && !asked.events {
        shell::asked_for(&format!("\n{}\n", found.sentences(plan).join("\n")))?;
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
