//! `export`: a recorded test in the words of the language.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;

use sesame_base::visible::visible_lines;
use sesame_notation::is_name;
use sesame_report as report;
use sesame_report::Expected;

use crate::cli::failure::Failure;
use crate::cli::results_folder::open;
use crate::cli::terminal::Format;
use crate::cli::terminal::{print, print_json};
use crate::cli::view::Which;

/// Which test is written, and under which name.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The test, for example `T158`
    #[arg(required_unless_present = "causes")]
    test: Option<String>,
    /// Instead of one test, the smallest test of each cause of a violation
    #[arg(long, conflicts_with_all = ["test", "name"])]
    causes: bool,
    /// Name of the block; by default made of the campaign's name and the test's
    #[arg(long, value_name = "NAME", value_parser = name)]
    name: Option<String>,
    /// Expect the measured values, so that the test notices any change of them; by default it expects the requirements
    #[arg(long)]
    pin: bool,
    #[command(flatten)]
    which: Which,
}

fn name(text: &str) -> Result<String, String> {
    if is_name(text) {
        Ok(text.to_owned())
    } else {
        Err("a name is made of letters, digits and `_`, and does not begin with a digit".to_owned())
    }
}

pub(super) fn export(results: &Path, args: &ExportArgs) -> Result<ExitCode, Failure> {
    let repository = open(results, args.which.results.as_deref())?;
    let expected = if args.pin { Expected::Values } else { Expected::Requirements };
    if let Some(test) = &args.test {
        let exported = report::export(&repository, test, args.name.as_deref(), expected)?;
        return match args.which.format {
            Format::Text => print_blocks(&exported.block),
            Format::Json => print_json(&exported),
        };
    }
    let exported = report::export_causes(&repository, expected)?;
    match args.which.format {
        Format::Text => {
            let blocks: Vec<&str> = exported.iter().map(|exported| exported.block.as_str()).collect();
            print_blocks(&blocks.join("\n"))
        }
        Format::Json => print_json(&exported),
    }
}

/// A block is the test to the last sign of its texts; on a terminal some of these would do more than be read.
fn print_blocks(blocks: &str) -> Result<ExitCode, Failure> {
    if console::Term::stdout().is_term() { print(&visible_lines(blocks)) } else { print(blocks) }
}
