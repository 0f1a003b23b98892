//! What is wrong with a file, as data; [`render`] turns it into text.
//!
//! A diagnostic stands for one mistake. Its title says which rule is broken, the primary label adds what the title
//! cannot know (what was found, what was expected), and suggestions are patches; each says whether a program may apply
//! it without asking.

mod code;
pub mod render;

pub use code::{CODES, Code, MEANINGS, Severity, page};
pub use sesame_base::visible::visible_lines;

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
    /// What was found or expected there; may be empty.
    pub label: String,
    /// Other places that matter, for example where a name was first defined.
    pub secondary: Vec<(Span, String)>,
    /// Further explanations.
    pub notes: Vec<String>,
    /// Possible fixes, best first.
    pub suggestions: Vec<Suggestion>,
}

/// A possible fix: a message, and the edits that apply it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Suggestion {
    /// What to do: an imperative or a question that makes sense without the diagnostic around it, because some
    /// renderers print it alone.
    pub message: String,
    /// What to replace with what. Spans do not overlap.
    pub edits: Vec<(Span, String)>,
    /// Whether a program may apply it without asking.
    pub applicability: Applicability,
}

/// How certain it is that a suggestion is what the author means, as in rustc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Applicability {
    /// What is written can mean nothing else: applied alone, the suggestion removes the mistake and makes no other.
    MachineApplicable,
    /// Applied alone, it removes the mistake, but the author may mean something else: another name, another unit.
    MaybeIncorrect,
}

impl Suggestion {
    /// A suggestion that the author has to agree to.
    pub fn possible(message: impl Into<String>, edits: Vec<(Span, String)>) -> Self {
        Suggestion { message: shortened(message.into()), edits, applicability: Applicability::MaybeIncorrect }
    }
}

impl Diagnostic {
    /// A diagnostic without label, notes or suggestions.
    pub fn new(code: Code, span: Span, title: impl Into<String>) -> Self {
        Diagnostic {
            code,
            title: shortened(one_line(&title.into())),
            span,
            label: String::new(),
            secondary: Vec::new(),
            notes: Vec::new(),
            suggestions: Vec::new(),
        }
    }

    /// With this label at the primary span.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = shortened(one_line(&label.into()));
        self
    }

    /// With another place that is involved in the mistake.
    pub fn secondary(mut self, span: Span, label: impl Into<String>) -> Self {
        self.secondary.push((span, shortened(one_line(&label.into()))));
        self
    }

    /// With a note.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(shortened(note.into()));
        self
    }

    /// With a suggestion that replaces one span, and that the author has to agree to.
    pub fn suggest(mut self, message: impl Into<String>, span: Span, replacement: impl Into<String>) -> Self {
        self.suggestions.push(Suggestion::possible(message, vec![(span, replacement.into())]));
        self
    }

    /// With a suggestion that replaces one span, and that a program may apply without asking.
    pub fn fix(self, message: impl Into<String>, span: Span, replacement: impl Into<String>) -> Self {
        let mut diagnostic = self.suggest(message, span, replacement);
        if let Some(fix) = diagnostic.suggestions.last_mut() {
            fix.applicability = Applicability::MachineApplicable;
        }
        diagnostic
    }

    /// With the suggestion to write a name that looks like the one at `span`.
    pub fn did_you_mean(self, span: Span, meant: impl Into<String>) -> Self {
        let meant = meant.into();
        self.suggest(format!("did you mean `{meant}`?"), span, meant)
    }

    /// Error or warning.
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }
}

/// A text that quotes source text may contain its line breaks; titles and labels are one line.
fn one_line(text: &str) -> String {
    if text.contains(['\n', '\r']) { text.split_whitespace().collect::<Vec<_>>().join(" ") } else { text.to_owned() }
}

/// The most characters of one sentence.
const LONGEST: usize = 1000;

/// A sentence short enough to read, even if it quotes a long text: of more than a thousand characters, the beginning
/// and the end are kept.
pub fn shortened(text: String) -> String {
    if text.len() <= LONGEST {
        return text;
    }
    let nth = |n| text.char_indices().nth(n).map_or(text.len(), |(at, _)| at);
    let nth_last = |n| text.char_indices().rev().nth(n).map_or(0, |(at, _)| at);
    let (from, to) = (nth(LONGEST * 2 / 3), nth_last(LONGEST / 3));
    if from < to { format!("{} … {}", &text[..from], &text[to..]) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_that_quotes_a_megabyte_is_short_and_keeps_both_ends() {
        let text = format!("`{}` is not a unit", "µ".repeat(1 << 20));
        let short = shortened(text);
        assert_eq!(short.chars().count(), 666 + 3 + 334);
        assert!(short.starts_with("`µµ") && short.contains("µ … µ") && short.ends_with("µ` is not a unit"));
        let long = "µ".repeat(600);
        assert_eq!(shortened(long.clone()), long, "the limit counts characters, not bytes");
    }
}
