//! What the parts of a space share while they are written: names that were given, and what of the original became what.

use std::collections::BTreeMap;

use sesame_plan::Span;

use crate::monitors::Consert;
use crate::naming::Names;
use crate::notes::{Kind, Notes};
use crate::original::{Activation, Original, Reference};
use crate::parts::{Holders, Part};
use crate::types::{Messages, Type};
use crate::xml::printable;

/// What of the original became what.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Mapped {
    /// The `.sesame` file.
    pub(crate) text: String,
    /// Names of metrics, by position in the original.
    pub(crate) metrics: Vec<Option<String>>,
    /// What tests hold.
    pub(crate) holders: Holders,
    /// What each of those became.
    pub(crate) parts: Vec<Vec<Part>>,
    /// Names of campaigns, by position in the original.
    pub(crate) campaigns: Vec<Option<String>>,
    /// Names of the objectives of searches that became campaigns which only observe, by position in the original. Such
    /// campaigns have none in the `.sesame` file, and their results have them.
    pub(crate) objectives: BTreeMap<usize, Vec<String>>,
}

/// What is known while the text is written.
pub(crate) struct Writer<'o> {
    pub(crate) original: &'o Original,
    pub(crate) notes: &'o mut Notes,
    pub(crate) names: Names,
    pub(crate) mapped: Mapped,
    /// Types of messages, as far as the file and the operations tell them.
    pub(crate) messages: Messages,
    /// By position of what tests hold: the earliest end of a test that may hold it, in seconds.
    pub(crate) first_ends: Vec<f64>,
    /// Monitors of the original.
    pub(crate) conserts: Vec<Consert>,
    /// By position of the variable.
    pub(crate) topics: Vec<Option<(String, Type)>>,
}

impl Writer<'_> {
    /// A name for something of a kind, like the one it had; a note says if it is another one.
    pub(crate) fn name(&mut self, kind: &str, original: &str) -> String {
        let name = self.names.take(original, kind);
        if !original.is_empty() && name != original {
            self.notes.say(Kind::Renamed, format!("{kind} `{}` is `{name}` here", printable(original)));
        }
        name
    }

    /// When what tests hold may be active, by its position, as its `within` says; `None` for at any time.
    pub(crate) fn permitted(&self, at: usize) -> Option<Span> {
        let Activation::Time(start, end) = self.mapped.holders.operations[at].activation else { return None };
        let (start, end) = (start.min(end).max(0.0), start.max(end));
        (start < end && start < self.first_ends[at]).then_some(Span { start, end })
    }

    /// The topic that a reference to a variable became.
    pub(crate) fn topic(&self, variable: Reference) -> Option<&(String, Type)> {
        self.topics[self.original.variable(variable)?].as_ref()
    }

    /// The name of the metric that a reference to one became.
    pub(crate) fn metric(&self, metric: Reference) -> Option<&str> {
        self.mapped.metrics[self.original.metric(metric)?].as_deref()
    }
}

/// A fraction with the digits that were meant: what is left of 1 has noise in its last ones.
pub(crate) fn meant(share: f64) -> f64 {
    (share * 1e11).round() / 1e11
}

/// What is written above a declaration that was called something else.
pub(crate) fn called_before(original: &str) -> String {
    format!("In the original: `{}`.", printable(original))
}
