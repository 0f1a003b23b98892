//! Commands that show what is recorded.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use sesame_report as report;

use crate::cli::failure::Failure;
use crate::cli::results_folder::open;
use crate::cli::terminal::{Format, print, print_json, text_options};

/// Which run, and how it is shown.
#[derive(Debug, Args)]
pub struct Which {
    /// Folder of the run, for example `results/42`; by default the latest
    #[arg(long, value_name = "DIR")]
    pub(super) results: Option<PathBuf>,
    /// The format of the output
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

pub(super) fn causes(results: &Path, which: &Which) -> Result<ExitCode, Failure> {
    let found = report::causes(&open(results, which.results.as_deref())?)?;
    match which.format {
        Format::Text => print(&report::causes_text(&found, text_options())),
        Format::Json => print_json(&found),
    }
}

/// A moment of a test from the command line, in seconds: `12.3s`, `12.3` or `300ms`.
pub(super) fn moment(text: &str) -> Result<f64, String> {
    let (digits, scale) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(digits), _) => (digits, 1e3),
        (None, Some(digits)) => (digits, 1.0),
        (None, None) => (text, 1.0),
    };
    let number: Option<f64> = digits.trim_end().parse().ok();
    let number = number.filter(|number| number.is_finite() && *number >= 0.0);
    number.map(|number| number / scale).ok_or_else(|| "not a time, such as `12.3s` or `300ms`".to_owned())
}

pub(super) fn show(results: &Path, which: &Which, test: &str, at: Option<f64>) -> Result<ExitCode, Failure> {
    if let Some(at) = at {
        let shown = report::show_at(&open(results, which.results.as_deref())?, test, at)?;
        return match which.format {
            Format::Text => print(&report::moment_text(&shown, text_options())),
            Format::Json => print_json(&shown),
        };
    }
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

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn moments_are_seconds_or_milliseconds() {
        assert_eq!(
            ["12.3s", "12.3", "300ms", "0", "1 s"].map(|text| moment(text).unwrap()),
            [12.3, 12.3, 0.3, 0.0, 1.0]
        );
        for wrong in ["", "s", "-1s", "inf", "NaN", "3min"] {
            assert!(moment(wrong).is_err(), "{wrong}");
        }
    }
}
