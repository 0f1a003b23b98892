//! For line-based tools: `file:line:column: error[E0203]: title: label`.

use super::terminal::for_terminals;
use crate::diagnostic::{Diagnostic, Severity, visible_lines};
use crate::source::SourceMap;

/// One line per diagnostic.
pub fn short(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    use std::fmt::Write as _;
    let mut out = String::new();
    for diagnostic in diagnostics.iter().map(for_terminals) {
        let file = visible_lines(sources.file(diagnostic.span.file).name());
        let position = sources.position(diagnostic.span);
        let severity = match diagnostic.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let label = if diagnostic.label.is_empty() { String::new() } else { format!(": {}", diagnostic.label) };
        writeln!(
            out,
            "{file}:{}:{}: {severity}[{}]: {}{label}",
            position.line, position.column, diagnostic.code, diagnostic.title
        )
        .expect("a string takes everything");
    }
    out
}
