//! What an import says of what it did.

use std::collections::BTreeMap;

/// What became of something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// It is called something else in newer files, or here.
    Renamed,
    /// It is said in another way.
    Mapped,
    /// A probability to keep messages became one to lose them.
    Flipped,
    /// Its bounds were the wrong way round.
    Swapped,
    /// It is not quite what it was.
    Changed,
    /// It has no counterpart, or made no sense.
    LeftOut,
}

impl Kind {
    /// One word for the column of verbs.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Renamed => "Renamed",
            Kind::Mapped => "Mapped",
            Kind::Flipped => "Flipped",
            Kind::Swapped => "Swapped",
            Kind::Changed => "Changed",
            Kind::LeftOut => "Left out",
        }
    }
}

/// Notes, each with how often there was reason for it; by kind, then in the order of their words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notes(BTreeMap<(Kind, String), usize>);

impl Notes {
    /// Takes a note.
    pub(crate) fn say(&mut self, kind: Kind, text: impl Into<String>) {
        self.times(kind, text, 1);
    }

    /// Takes a note that there was reason for so often.
    pub(crate) fn times(&mut self, kind: Kind, text: impl Into<String>, times: usize) {
        *self.0.entry((kind, text.into())).or_default() += times;
    }

    /// All notes.
    pub fn iter(&self) -> impl Iterator<Item = (Kind, String)> {
        self.0.iter().map(|((kind, text), &times)| match times {
            1 => (*kind, text.clone()),
            times => (*kind, format!("{text} ({times} times)")),
        })
    }
}
