//! `report`: the page and the tables anew.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use crate::cli::execution::{OutputArgs, report_outcome};
use crate::cli::failure::Failure;
use crate::cli::results_folder::open;

/// Which run is reported on, and where to.
#[derive(Debug, Args)]
pub struct Options {
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// File of the page; by default `report.html` beside the results
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    outcome: OutputArgs,
}

pub(super) fn report(results: &Path, options: &Options) -> Result<ExitCode, Failure> {
    let repository = open(results, options.results.as_deref())?;
    let folder = repository.path().parent().unwrap_or(results);
    let page = options.output.clone().unwrap_or_else(|| folder.join("report.html"));
    report_outcome(&repository, folder, &page, &options.outcome)
}
