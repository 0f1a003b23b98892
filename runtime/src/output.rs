//! What programs say: on standard output what was asked for, on standard error everything else.

use std::fmt;
use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::ValueEnum;

/// How a command shows what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum Format {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// Says a line on standard error: progress, notes, warnings, errors. A full disk under a log, a reader that has gone
/// away or a lost connection must not end a run, so a line that cannot be written is dropped.
pub(crate) fn say(line: fmt::Arguments<'_>) {
    // In one piece, so that it stays whole beside what other processes write to the same log.
    io::stderr().write_all(format!("{line}\n").as_bytes()).ok();
}

/// Prints for people or programs. A reader that has gone away, as `| head` does, is not a failure; a full disk is.
pub(crate) fn print(text: &str) -> Result<ExitCode, Failure> {
    let mut output = io::stdout().lock();
    match output.write_all(text.as_bytes()).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// What went wrong, in words for the user; causes are in the words.
#[derive(Debug)]
pub(crate) struct Failure(pub(crate) String);

impl<E: std::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure(error.to_string())
    }
}
