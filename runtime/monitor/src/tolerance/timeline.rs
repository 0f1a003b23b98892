//! How the value of one piece of evidence changes over a recording.

use sesame_base::time::SimTime;

use super::{Conditions, Recording};
use crate::evidence::{Automaton, Rule};
use crate::network::EvidenceId;
use crate::truth::Truth;

/// A change of the value of evidence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Change {
    pub(super) at: SimTime,
    /// The position in the recording of the first message of the event; `None` for a timer.
    pub(super) message: Option<usize>,
    pub(super) evidence: EvidenceId,
    pub(super) truth: Truth,
}

impl Change {
    /// What happened. Events are in the order in which they happen: timers of an instant are one event, which comes
    /// before its messages.
    pub(super) fn event(&self) -> (SimTime, Option<usize>) {
        (self.at, self.message)
    }
}

/// A message that evidence hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Heard {
    pub(super) at: SimTime,
    /// The position of the message in the recording.
    pub(super) message: usize,
    /// The position of the first message of its event.
    pub(super) event: usize,
    /// The position of its stream among those of the evidence.
    pub(super) place: usize,
}

/// What each piece of evidence hears, in the order of the recording.
pub(super) fn heard(recording: &Recording) -> Vec<Vec<Heard>> {
    let streams = recording.streams.iter().flatten().max().map_or(0, |&last| last as usize + 1);
    let mut messages = vec![Vec::new(); streams];
    let mut event = 0;
    for (message, it) in recording.messages.iter().enumerate() {
        if !it.joined {
            event = message;
        }
        if let Some(messages) = messages.get_mut(it.stream as usize) {
            messages.push((message, event, it.at));
        }
    }
    let of_evidence = recording.streams.iter().map(|streams| {
        let of_stream = streams.iter().enumerate().flat_map(|(place, &stream)| {
            messages[stream as usize].iter().map(move |&(message, event, at)| Heard { at, message, event, place })
        });
        let mut all: Vec<Heard> = of_stream.collect();
        all.sort_unstable_by_key(|heard| heard.message);
        all
    });
    of_evidence.collect()
}

/// Adds the changes of one piece of evidence, until the end of a recording. `heard` is what it hears, in the order of
/// time, from so many streams.
pub(super) fn timeline(
    (evidence, rule): (EvidenceId, &Rule),
    (heard, streams): (&[Heard], usize),
    end: SimTime,
    conditions: &mut dyn Conditions,
    changes: &mut Vec<Change>,
) {
    let mut latest = vec![None; streams];
    let mut automaton = Automaton::new();
    let mut last = Truth::Unknown;
    let mut add = |at, message, truth| {
        if std::mem::replace(&mut last, truth) != truth {
            changes.push(Change { at, message, evidence, truth });
        }
    };
    for &Heard { at, message, event, place } in heard.iter().take_while(|heard| heard.at <= end) {
        while automaton.due(rule) <= at.nanos() {
            let due = SimTime::from_nanos(automaton.due(rule));
            automaton.pass(rule, due);
            add(due, None, automaton.value());
        }
        latest[place] = Some(message);
        automaton.observe(rule, at, conditions.truth(evidence, message, &latest));
        add(at, Some(event), automaton.value());
    }
    while automaton.due(rule) <= end.nanos() {
        let due = automaton.due(rule);
        automaton.pass(rule, SimTime::from_nanos(due));
        add(SimTime::from_nanos(due), None, automaton.value());
        if due == i64::MAX {
            break;
        }
    }
}
