//! The messages of one step: which are expected, and which have come.

use sesame_relay::transport::round::{Owed, Promises};
use sesame_relay::wire::{Wire, WireTable};

use super::lines::Lines;
use crate::client::{Heard, Stepped};

/// One step.
pub(super) struct Round {
    pub(super) heard: Vec<Heard>,
    pub(super) stepped: Option<Stepped>,
    owed: Owed,
    /// The stream of the marker.
    marker: Option<usize>,
    marked: bool,
    /// What is stamped before this is of a step before, and owed no longer.
    before: Option<i128>,
}

impl Round {
    pub(super) fn new(promises: &Promises, marker: Option<usize>, before: Option<i128>) -> Self {
        let mut owed = Owed::default();
        owed.extend(promises.every_step().iter().copied());
        Round { heard: Vec::new(), stepped: None, owed, marker, marked: false, before }
    }

    /// Counts the answers to a message that is delivered on this wire.
    pub(super) fn owe(&mut self, promises: &Promises, delivered: Wire) {
        self.owed.extend(promises.answers(delivered).iter().map(|&(_, with)| with));
    }

    pub(super) fn take(&mut self, lines: &Lines, heard: &mut Vec<Heard>) {
        for heard in heard.drain(..) {
            if Some(heard.stream) == self.marker {
                self.marked = true;
                continue;
            }
            let late = self.before.zip(heard.message.stamp()).is_some_and(|(before, at)| i128::from(at) < before);
            if let Some(line) = lines.of_stream(heard.stream).filter(|_| !late) {
                self.owed.pay(line.wire);
            }
            self.heard.push(heard);
        }
    }

    /// Whether all that is expected has come.
    pub(super) fn is_complete(&self) -> bool {
        if self.marker.is_some() { self.marked } else { self.owed.is_empty() }
    }

    /// Whether nothing can come that is not expected.
    pub(super) fn is_certain(&self, promises: &Promises, lines: &Lines) -> bool {
        self.marker.is_some() || lines.iter().all(|line| promises.is_counted(line.wire))
    }

    /// What has not come, as a phrase.
    pub(super) fn awaited(&self, wires: &WireTable) -> String {
        if self.stepped.is_none() {
            return "the end of a step".to_owned();
        }
        if self.marker.is_some() {
            return "the marker of the end of a step".to_owned();
        }
        self.owed.awaited(wires)
    }
}
