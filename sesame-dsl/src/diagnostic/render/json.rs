//! For programs: one JSON object per line.

use serde::Serialize;

use sesame_base::visible::visible_json;

use crate::diagnostic::{Applicability, Diagnostic, Severity};
use crate::location::Location;
use crate::source::SourceMap;

/// A part of the source with what is said about it.
#[derive(Serialize)]
struct Label<'a> {
    /// Where it is.
    at: Location<'a>,
    /// A note on it; may be empty.
    text: &'a str,
}

/// A diagnostic.
#[derive(Serialize)]
struct Line<'a> {
    /// Its code, such as `E0203`, which `sesamec explain` explains.
    code: &'static str,
    /// `error` or `warning`.
    severity: &'static str,
    /// What is wrong, in a sentence.
    title: &'a str,
    /// The place that it is about.
    primary: Label<'a>,
    /// Other places that are related to it.
    secondary: Vec<Label<'a>>,
    /// Further notes.
    notes: &'a [String],
    /// Ways to fix it.
    suggestions: Vec<Suggested<'a>>,
}

/// A way to mend what is wrong.
#[derive(Serialize)]
struct Suggested<'a> {
    /// What to do.
    message: &'a str,
    /// `machine_applicable` if a program may apply the edits without asking; `maybe_incorrect` if they remove the
    /// mistake, but the author may mean something else.
    applicability: &'static str,
    /// The changes of the source that do it, which can be applied as they are.
    edits: Vec<Edit<'a>>,
}

/// A change of the source.
#[derive(Serialize)]
struct Edit<'a> {
    /// What is replaced; empty where something is inserted.
    at: Location<'a>,
    /// The new text.
    replacement: &'a str,
}

/// One JSON object per line and diagnostic.
pub fn json(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    let at = |span| Location::new(sources, span);
    let mut out = String::new();
    for diagnostic in diagnostics {
        let line = Line {
            code: diagnostic.code.text(),
            severity: match diagnostic.severity() {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            title: &diagnostic.title,
            primary: Label { at: at(diagnostic.span), text: &diagnostic.label },
            secondary: diagnostic.secondary.iter().map(|(span, text)| Label { at: at(*span), text }).collect(),
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
                        .map(|(span, replacement)| Edit { at: at(*span), replacement })
                        .collect(),
                })
                .collect(),
        };
        out.push_str(&visible_json(&serde_json::to_string(&line).expect("strings and numbers serialise")));
        out.push('\n');
    }
    out
}
