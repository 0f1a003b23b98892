//! Whether certificates say anything: what [`sesame_monitor::check`] finds in monitors, as diagnostics.
//!
//! A monitor is checked with those that it demands guarantees from. One with a mistake is left out, and so are those
//! that rely on it. What follows from another finding is not reported again: if a guarantee can never hold, those that
//! demand it cannot either. Neither is what follows from a comparison with one outcome.

mod group;
mod report;
mod witness;

use super::Resolver;
use crate::diagnostic::Code;
use crate::span::Span;

/// How much work all checks of a space may take: far more than those of certificates that people write, and about a
/// second at most.
const MOST_WORK: u64 = 1_000_000;

impl Resolver<'_> {
    /// Reports what is wrong with certificates. Returns what could not be decided, in sentences.
    pub(super) fn certificates(&mut self) -> Vec<(Span, String)> {
        let mut notes = Vec::new();
        let mut work = MOST_WORK;
        let constant = self.diagnostics.iter().filter(|found| found.code == Code::ONE_OUTCOME);
        let constant: Vec<Span> = constant.map(|found| found.span).collect();
        let is_constant = |within: Span| {
            constant.iter().any(|known| known.file == within.file && within.lo <= known.lo && known.hi <= within.hi)
        };
        for members in group::groups(&self.eddis) {
            let mut evidence = members.iter().flat_map(|&at| &self.file.eddis[at].evidence);
            if evidence.any(|evidence| is_constant(evidence.condition.span)) {
                continue;
            }
            let Some(group) = group::Group::of(&self.eddis, members, &self.system) else { continue };
            let (diagnostics, undecided) = report::of(&group, self.file, &mut work);
            self.diagnostics.extend(diagnostics);
            notes.extend(undecided);
        }
        notes
    }
}
