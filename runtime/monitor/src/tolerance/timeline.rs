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
    /// The position of the message in the recording; `None` for a timer.
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

/// Adds the changes of one piece of evidence, if the messages of each stream are shifted by so much, until the end of
/// the recording.
pub(super) fn timeline(
    rule: &Rule,
    evidence: EvidenceId,
    recording: &Recording,
    shift: &dyn Fn(u32) -> SimTime,
    conditions: &mut dyn Conditions,
    changes: &mut Vec<Change>,
) {
    let streams = &recording.streams[evidence.index()];
    let own = recording.messages.iter().enumerate().filter_map(|(at, message)| {
        let place = streams.iter().position(|&stream| stream == message.stream)?;
        Some((message.at + shift(message.stream), at, place))
    });
    let mut own: Vec<(SimTime, usize, usize)> = own.filter(|(at, ..)| *at <= recording.end).collect();
    own.sort_unstable();
    let mut latest = vec![None; streams.len()];
    let mut automaton = Automaton::new();
    let mut last = Truth::Unknown;
    let mut add = |at, message, truth| {
        if std::mem::replace(&mut last, truth) != truth {
            changes.push(Change { at, message, evidence, truth });
        }
    };
    for (at, message, place) in own {
        while automaton.due(rule) <= at.nanos() {
            let due = SimTime::from_nanos(automaton.due(rule));
            automaton.pass(rule, due);
            add(due, None, automaton.value());
        }
        latest[place] = Some(message);
        automaton.observe(rule, at, conditions.truth(evidence, message, &latest));
        add(at, Some(message), automaton.value());
    }
    while automaton.due(rule) <= recording.end.nanos() {
        let due = automaton.due(rule);
        automaton.pass(rule, SimTime::from_nanos(due));
        add(SimTime::from_nanos(due), None, automaton.value());
        if due == i64::MAX {
            break;
        }
    }
}
