//! For programs: one JSON object per line.

use std::fmt::Write as _;

use serde::Serialize;

use crate::diagnostic::{Applicability, Diagnostic, Severity, hidden};
use crate::place::Place;
use crate::source::SourceMap;

#[derive(Serialize)]
struct Label<'a> {
    at: Place<'a>,
    text: &'a str,
}

#[derive(Serialize)]
struct Line<'a> {
    code: &'static str,
    severity: &'static str,
    title: &'a str,
    primary: Label<'a>,
    secondary: Vec<Label<'a>>,
    notes: &'a [String],
    suggestions: Vec<Suggested<'a>>,
}

#[derive(Serialize)]
struct Suggested<'a> {
    message: &'a str,
    applicability: &'static str,
    edits: Vec<Edit<'a>>,
}

#[derive(Serialize)]
struct Edit<'a> {
    at: Place<'a>,
    replacement: &'a str,
}

/// One JSON object per line and diagnostic.
pub fn json(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    let place = |span| Place::new(sources, span);
    let mut out = String::new();
    for diagnostic in diagnostics {
        let line = Line {
            code: diagnostic.code.text(),
            severity: match diagnostic.severity() {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            title: &diagnostic.title,
            primary: Label { at: place(diagnostic.span), text: &diagnostic.label },
            secondary: diagnostic.secondary.iter().map(|(span, text)| Label { at: place(*span), text }).collect(),
            notes: &diagnostic.notes,
            suggestions: diagnostic
                .suggestions
                .iter()
                .map(|suggestion| Suggested {
                    message: &suggestion.message,
                    applicability: match suggestion.applicability {
                        Applicability::MachineApplicable => "machine_applicable",
                        Applicability::MaybeIncorrect => "maybe_incorrect",
                    },
                    edits: suggestion
                        .edits
                        .iter()
                        .map(|(span, replacement)| Edit { at: place(*span), replacement })
                        .collect(),
                })
                .collect(),
        };
        // JSON leaves some characters unescaped that a terminal interprets. They occur only in texts.
        for c in serde_json::to_string(&line).expect("strings and numbers serialise").chars() {
            if hidden(c) {
                write!(out, "\\u{:04x}", u32::from(c)).expect("a string takes everything");
            } else {
                out.push(c);
            }
        }
        out.push('\n');
    }
    out
}
