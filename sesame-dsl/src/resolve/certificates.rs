//! Whether certificates say anything: what [`sesame_monitor::check`] finds in monitors, as diagnostics.
//!
//! A monitor is checked with those that it demands guarantees from. One with a mistake is left out, and so are those
//! that rely on it. What follows from another finding is not reported again: if a guarantee can never hold, those that
//! demand it cannot either.

mod group;
mod report;
mod witness;

use super::Resolver;
use crate::span::Span;

impl Resolver<'_> {
    /// Reports what is wrong with certificates. Returns what could not be decided, in sentences.
    pub(super) fn certificates(&mut self) -> Vec<(Span, String)> {
        let mut notes = Vec::new();
        for members in group::groups(&self.eddis) {
            let Some(group) = group::Group::of(&self.eddis, members, &self.system) else { continue };
            let (diagnostics, undecided) = report::of(&group, self.file);
            self.diagnostics.extend(diagnostics);
            notes.extend(undecided);
        }
        notes
    }
}
