//! `sesamec gap`: the results of a lab beside those of the campaign that its tests come from.

mod sides;
mod traces;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;

use sesame_analysis::extents;
use sesame_analysis::gap::Gap;
use sesame_analysis::traces::TraceGap;

use super::results::{Format, Output, print};
use super::shell::{self, Shell};
pub(super) use sides::Sides;

/// What is compared.
#[derive(Debug, Args)]
pub(super) struct Compared {
    /// The results of the campaign: a results file, or the folder of a run.
    campaign: PathBuf,
    /// The results of the lab, in which tests of this campaign were run; several are taken together.
    #[arg(required = true, value_name = "LAB")]
    labs: Vec<PathBuf>,
    /// Compare with the tests that `compensate` simulated again: the folder of its results.
    #[arg(long, value_name = "DIR")]
    simulation: Option<PathBuf>,
    /// Show the traces instead: each signal of each test, how far both sides are apart, and how much later the lab is.
    #[arg(long, conflicts_with_all = ["events", "extents"])]
    traces: bool,
    /// Show how far each gap extends instead: everywhere, in a range, in some tests, or nowhere; of metrics, and of the
    /// lag and level of signals.
    #[arg(long, conflicts_with = "events")]
    extents: bool,
    /// Show requirements and interlocked metrics instead: how many tests violate them on both sides, on one, or on
    /// neither.
    #[arg(long)]
    events: bool,
    #[command(flatten)]
    output: Output,
}

/// Says how simulation and lab differ.
pub(super) fn compared(shell: Shell, asked: &Compared) -> anyhow::Result<ExitCode> {
    let sides = Sides::read(&asked.campaign, &asked.labs, asked.simulation.as_deref())?;
    let campaign = &sides.campaign;
    let plan = campaign.plan();
    let tests = if sides.again.is_some() { sides.traces_after()? } else { sides.traces()? };
    let traced = sides.compared(&tests);
    if asked.traces {
        let Some(traced) = traced else { bail!("{}", traces::missing(campaign, &sides.runs())) };
        print(&traced.table(), &asked.output)?;
        if asked.output.format() == Format::Table {
            shell::asked_for(&format!("\n{}\n", traced.sentences().join("\n")))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let found = match sides.gap_after()? {
        Some(after) => after,
        None => sides.gap()?,
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
        sentences.extend(found.next_test(campaign)?.map(|(_, why)| why));
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
