//! `report`: the page and the tables anew.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use crate::cli::execution::{OutputArgs, report_against, shown};
use crate::cli::failure::Failure;
use crate::cli::results_folder::open;

/// Which run is reported on, and where to.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// File of the page; by default `report.html` beside the results
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Folder of a run from before certificates of monitors were mended: the page compares which hazards were missed in
    /// the same tests before and after
    #[arg(long, value_name = "DIR")]
    before: Option<PathBuf>,
    #[command(flatten)]
    outcome: OutputArgs,
}

pub(super) fn report(results: &Path, args: &ReportArgs) -> Result<ExitCode, Failure> {
    let repository = open(results, args.results.as_deref())?;
    let folder = repository.path().parent().unwrap_or(results);
    let page = args.output.clone().unwrap_or_else(|| folder.join("report.html"));
    let before = args.before.as_deref().map(|before| open(results, Some(before))).transpose()?;
    if let Some(before) = &before
        && let Some(side) = [before, &repository].into_iter().find(|side| side.plan().monitors.is_empty())
    {
        return Err(Failure(format!(
            "{} has no monitors, so there is no certificate to compare; `compare` compares runs",
            shown(side.path())
        )));
    }
    report_against(&repository, before.as_ref(), folder, &page, &args.outcome)
}
