//! The traces of a campaign and of a lab, read for a comparison.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use sesame_analysis::gap::{LabRun, dimensions, points};
use sesame_analysis::traces::{Signal, Signals, TracedTest};
use sesame_plan::{CampaignPlan, Lab};
use sesame_record::{Repository, recording};
use sesame_runtime::trace;
use sesame_runtime::wire::WireTable;

use crate::cli::shell;

/// The runs in a folder of results.
pub(super) type Runs = (PathBuf, Vec<LabRun>);

/// The traces of tests that have some on both sides.
///
/// The simulation's trace of a test is that of the recorded test, or of the first run in which it was simulated again.
pub(super) fn read(
    campaign: &Repository,
    again: Option<&Runs>,
    labs: &[Runs],
    lab: Option<&Lab>,
) -> anyhow::Result<Vec<TracedTest>> {
    let plan = campaign.plan();
    let tests: BTreeSet<u32> = labs.iter().flat_map(|(_, runs)| runs).map(|run| run.of).collect();
    let dimensions = dimensions(lab);
    let points = points(campaign, &tests, &dimensions)?;
    let mut traced = Vec::new();
    for test in tests {
        let simulated = match again {
            Some(runs) => simulated_again(runs, test),
            None => recording(campaign.folder(), test),
        };
        let Some(simulated) = simulated else { continue };
        let runs = labs.iter().flat_map(|(folder, runs)| runs.iter().map(move |run| (folder, run)));
        let of_test = runs.filter(|(_, run)| run.of == test);
        let files: Vec<PathBuf> = of_test.filter_map(|(folder, run)| recording(folder, run.row.number)).collect();
        if files.is_empty() {
            continue;
        }
        let lab = files.iter().map(|file| signals(plan, file)).collect::<anyhow::Result<_>>()?;
        let at = points.get(&test).cloned().unwrap_or_else(|| vec![None; dimensions.len()]);
        traced.push(TracedTest { test, at, simulation: signals(plan, &simulated)?, lab });
    }
    Ok(traced)
}

/// What the compensated simulation of each test published, of tests that have a trace of it.
pub(super) fn read_again(plan: &CampaignPlan, again: &Runs) -> anyhow::Result<BTreeMap<u32, Signals>> {
    let tests: BTreeSet<u32> = again.1.iter().map(|run| run.of).collect();
    let files = tests.into_iter().filter_map(|test| Some((test, simulated_again(again, test)?)));
    files.map(|(test, file)| Ok((test, signals(plan, &file)?))).collect()
}

/// The trace of the first run in which a test was simulated again.
fn simulated_again((folder, runs): &Runs, test: u32) -> Option<PathBuf> {
    let run = runs.iter().find(|run| run.of == test)?;
    recording(folder, run.row.number)
}

fn signals(plan: &CampaignPlan, file: &Path) -> anyhow::Result<Signals> {
    let found: BTreeMap<String, trace::Signal> = trace::signals(file, plan, &WireTable::new(plan))?;
    Ok(found.into_iter().map(|(name, trace::Signal { times, values })| (name, Signal { times, values })).collect())
}

/// Why there is nothing to compare, and what to do.
pub(super) fn missing(campaign: &Repository, runs: &[LabRun]) -> String {
    let test = runs.first().map_or(1, |run| run.of);
    format!(
        "no test has a trace on both sides. In the lab, runners record each run; this records a test of {}:\n    {} replay \
         FILE T{test} --record",
        campaign.folder().display(),
        shell::command(),
    )
}
