//! What an import says of what it did.

use std::collections::BTreeMap;

/// What became of something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// It is called something else in newer files, or here.
    Renamed,
    /// It is expressed in another way.
    Mapped,
    /// A probability to keep messages became one to lose them.
    Flipped,
    /// Its bounds were the wrong way round.
    Swapped,
    /// It is not quite what it was.
    Changed,
    /// It is as it was, and odd.
    Noted,
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
            Kind::Noted => "Noted",
            Kind::LeftOut => "Left out",
        }
    }
}

/// What an import counts, so that everything in a file is either in the results or in a note.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Counted {
    /// Performed tests.
    Test,
    /// Operations of performed tests, each as one, whatever number of values it draws.
    Operation,
    /// Values that were measured in performed tests.
    Value,
}

/// Notes, each with how often there was reason for it; by kind, then in the order of their words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Notes {
    notes: BTreeMap<(Kind, String), usize>,
    lost: BTreeMap<Counted, usize>,
}

impl Notes {
    /// Takes a note.
    pub(crate) fn say(&mut self, kind: Kind, text: impl Into<String>) {
        self.times(kind, text, 1);
    }

    /// Takes a note that there was reason for so often.
    pub(crate) fn times(&mut self, kind: Kind, text: impl Into<String>, times: usize) {
        *self.notes.entry((kind, text.into())).or_default() += times;
    }

    /// Takes all notes of others.
    pub(crate) fn take_in(&mut self, others: Notes) {
        for ((kind, text), times) in others.notes {
            self.times(kind, text, times);
        }
        for (what, times) in others.lost {
            *self.lost.entry(what).or_default() += times;
        }
    }

    /// Takes a note of so many things that are not in the results.
    pub(crate) fn lose(&mut self, what: Counted, text: impl Into<String>, times: usize) {
        if times > 0 {
            *self.lost.entry(what).or_default() += times;
            self.times(Kind::LeftOut, text, times);
        }
    }

    /// How many things of the file are not in the results. Each of them is counted in one note of [`Kind::LeftOut`].
    pub fn lost(&self, what: Counted) -> usize {
        self.lost.get(&what).copied().unwrap_or_default()
    }

    /// All notes.
    pub fn iter(&self) -> impl Iterator<Item = (Kind, String)> {
        self.notes.iter().map(|((kind, text), &times)| match times {
            1 => (*kind, text.clone()),
            times => (*kind, format!("{text} ({times} times)")),
        })
    }
}
