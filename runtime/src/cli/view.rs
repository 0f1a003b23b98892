//! Commands that show what is recorded.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use sesame_results::report;

use crate::cli::failure::Failure;
use crate::cli::results_folder::open;
use crate::cli::terminal::{Format, print, print_json, text_options};

/// Which run, and how it is shown.
#[derive(Debug, Args)]
pub struct Which {
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    pub(super) results: Option<PathBuf>,
    /// How to show it
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: Format,
}

pub(super) fn list(results: &Path, which: &Which) -> Result<ExitCode, Failure> {
    let list = report::list(&open(results, which.results.as_deref())?)?;
    match which.format {
        Format::Text => print(&report::list_text(&list, text_options())),
        Format::Json => print_json(&list),
    }
}

pub(super) fn show(results: &Path, which: &Which, test: &str) -> Result<ExitCode, Failure> {
    let shown = report::show(&open(results, which.results.as_deref())?, test)?;
    match which.format {
        Format::Text => print(&report::test_text(&shown, text_options())),
        Format::Json => print_json(&shown),
    }
}

/// The hash of a run's content.
#[derive(Serialize)]
struct Digest {
    /// 64 hexadecimal digits: equal runs have equal digests.
    digest: String,
}

pub(super) fn digest(results: &Path, which: &Which) -> Result<ExitCode, Failure> {
    let repository = open(results, which.results.as_deref())?;
    let digest = repository.digest()?;
    match which.format {
        Format::Text => print(&format!("{digest}\n")),
        Format::Json => print_json(&Digest { digest }),
    }
}
