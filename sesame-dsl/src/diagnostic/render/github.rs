//! For GitHub: workflow commands, which become annotations in a pull request.

use std::fmt::Write as _;

use super::terminal::for_terminals;
use crate::diagnostic::{Diagnostic, Severity, visible_lines};
use crate::source::SourceMap;

/// One workflow command per diagnostic and line.
pub fn github(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    let mut out = String::new();
    for diagnostic in diagnostics.iter().map(for_terminals) {
        let file = sources.file(diagnostic.span.file);
        let (start, end) = (file.position(diagnostic.span.lo), file.position(diagnostic.span.hi));
        let severity = match diagnostic.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        write!(
            out,
            "::{severity} file={},line={},col={}",
            property(&visible_lines(file.name())),
            start.line,
            start.column
        )
        .expect("a string takes everything");
        // GitHub accepts columns only if the span ends on the line it begins on; the end column is inclusive.
        if start.line == end.line && start.column < end.column {
            write!(out, ",endColumn={}", end.column - 1).expect("a string takes everything");
        } else if start.line < end.line {
            write!(out, ",endLine={}", end.line).expect("a string takes everything");
        }
        write!(out, ",title={}::{}", diagnostic.code, message(&diagnostic.title)).expect("a string takes everything");
        let suggestions = diagnostic.suggestions.iter().map(|suggestion| &suggestion.message);
        for line in std::iter::once(&diagnostic.label).chain(&diagnostic.notes).chain(suggestions) {
            if !line.is_empty() {
                write!(out, "%0A{}", message(line)).expect("a string takes everything");
            }
        }
        out.push('\n');
    }
    out
}

/// A text escaped as the message of a command.
fn message(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// A text escaped as a property of a command.
fn property(text: &str) -> String {
    message(text).replace(':', "%3A").replace(',', "%2C")
}
