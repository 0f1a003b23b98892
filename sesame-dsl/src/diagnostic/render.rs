//! Diagnostics as text: for people, for line-based tools, for programs, for GitHub.

mod github;
mod human;
mod json;
mod short;

use std::borrow::Cow;

pub use github::github;
pub use human::human;
pub use json::json;
pub use short::short;

use super::{Diagnostic, visible};

/// A diagnostic whose texts contain nothing that a terminal interprets.
fn for_terminals(diagnostic: &Diagnostic) -> Diagnostic {
    let mut shown = diagnostic.clone();
    let texts = [&mut shown.title, &mut shown.label].into_iter();
    let texts = texts.chain(shown.secondary.iter_mut().map(|(_, label)| label)).chain(&mut shown.notes);
    let suggested = shown.suggestions.iter_mut();
    let suggested = suggested.flat_map(|it| it.edits.iter_mut().map(|(_, text)| text).chain([&mut it.message]));
    for text in texts.chain(suggested) {
        if let Cow::Owned(cleaned) = visible(text) {
            *text = cleaned;
        }
    }
    shown
}
