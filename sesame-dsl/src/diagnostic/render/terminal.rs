//! What renderers for terminals have in common: nothing that a terminal interprets is printed as it is.

use std::borrow::Cow;

use crate::diagnostic::{Diagnostic, visible_lines};

/// A diagnostic whose texts contain nothing that a terminal interprets.
pub(super) fn for_terminals(diagnostic: &Diagnostic) -> Diagnostic {
    let mut shown = diagnostic.clone();
    let texts = [&mut shown.title, &mut shown.label].into_iter();
    let texts = texts.chain(shown.secondary.iter_mut().map(|(_, label)| label)).chain(&mut shown.notes);
    let suggested = shown.suggestions.iter_mut();
    let suggested = suggested
        .flat_map(|suggestion| suggestion.edits.iter_mut().map(|(_, text)| text).chain([&mut suggestion.message]));
    for text in texts.chain(suggested) {
        if let Cow::Owned(cleaned) = visible_lines(text) {
            *text = cleaned;
        }
    }
    shown
}
