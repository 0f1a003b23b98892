//! Standard output for what was asked for, standard error for everything else that is said.

use std::fmt;
use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::ValueEnum;

use sesame_results::report::TextOptions;

use crate::cli::failure::Failure;

/// How a command shows what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// Says a line on standard error: progress, notes, warnings, errors. A full disk under a log, a reader that has gone
/// away or a lost connection must not end a run, so a line that cannot be written is dropped.
pub(super) fn say(line: fmt::Arguments<'_>) {
    // In one piece, so that it stays whole beside what other processes write to the same log.
    io::stderr().write_all(format!("{line}\n").as_bytes()).ok();
}

/// Prints for people or programs. A reader that has gone away, as `| head` does, is not a failure; a full disk is.
pub(super) fn print(text: &str) -> Result<ExitCode, Failure> {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints a value as JSON, indented.
pub(super) fn print_json(value: &impl serde::Serialize) -> Result<ExitCode, Failure> {
    let text = serde_json::to_string_pretty(value)?;
    print(&format!("{text}\n"))
}

/// On a terminal as wide as it is, with colour unless `NO_COLOR` says no; elsewhere plain and as wide as it comes.
pub(super) fn text_options() -> TextOptions {
    let terminal = console::Term::stdout();
    let width = terminal.size_checked().map(|(_, columns)| usize::from(columns));
    TextOptions { width, colour: terminal.is_term() && console::colors_enabled() }
}
