//! Standard output for what was asked for, standard error for all other messages.

use std::process::ExitCode;

use sesame_base::visible::visible_json;
use sesame_report::TextOptions;

use crate::cli::failure::Failure;

pub(super) use crate::output::{Format, print, say};

/// Prints a value as JSON, indented.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<ExitCode, Failure> {
    let text = serde_json::to_string_pretty(value)?;
    print(&format!("{}\n", visible_json(&text)))
}

/// On a terminal as wide as it is, with colour unless `NO_COLOR` says no; elsewhere plain and as wide as it comes.
pub(super) fn text_options() -> TextOptions {
    let terminal = console::Term::stdout();
    let width = terminal.size_checked().map(|(_, columns)| usize::from(columns));
    TextOptions { width, colour: terminal.is_term() && console::colors_enabled() }
}
