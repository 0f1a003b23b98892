//! What is wrong with a file, as data; [`render`] makes text of it.
//!
//! A diagnostic stands for one mistake. Its title says what is wrong, the primary label adds what the title cannot know
//! (what stands there, what would fit), and suggestions are patches that could be applied as they are.

mod code;
pub mod render;

pub use code::{CODES, Code, Severity, page};

use crate::span::Span;

/// One mistake, or one thing worth a warning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which kind of mistake; decides the severity.
    pub code: Code,
    /// What is wrong: lower case, names in backquotes, no final dot.
    pub title: String,
    /// Where.
    pub span: Span,
    /// What stands there or was expected there; may be empty.
    pub label: String,
    /// Other places that matter, for example where a name was first defined.
    pub secondary: Vec<(Span, String)>,
    /// What else helps to understand.
    pub notes: Vec<String>,
    /// Ways out, best first.
    pub suggestions: Vec<Suggestion>,
}

/// A way out: a message, and the edit that does it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Suggestion {
    /// What to do: begins with a verb, or says what exists.
    pub message: String,
    /// What to replace by what. Spans do not overlap.
    pub edits: Vec<(Span, String)>,
}

impl Diagnostic {
    /// A diagnostic without label, notes or suggestions.
    pub fn new(code: Code, span: Span, title: impl Into<String>) -> Self {
        Diagnostic {
            code,
            title: one_line(&title.into()),
            span,
            label: String::new(),
            secondary: Vec::new(),
            notes: Vec::new(),
            suggestions: Vec::new(),
        }
    }

    /// With this label at the primary span.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = one_line(&label.into());
        self
    }

    /// With another place and what it has to do with the mistake.
    pub fn also(mut self, span: Span, label: impl Into<String>) -> Self {
        self.secondary.push((span, one_line(&label.into())));
        self
    }

    /// With a note.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// With a suggestion that replaces one span.
    pub fn suggest(mut self, message: impl Into<String>, span: Span, replacement: impl Into<String>) -> Self {
        self.suggestions.push(Suggestion { message: message.into(), edits: vec![(span, replacement.into())] });
        self
    }

    /// Error or warning.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// A text that quotes source text may hold its line ends; what is said of a place is one line.
fn one_line(text: &str) -> String {
    if text.contains(['\n', '\r']) { text.split_whitespace().collect::<Vec<_>>().join(" ") } else { text.to_owned() }
}
