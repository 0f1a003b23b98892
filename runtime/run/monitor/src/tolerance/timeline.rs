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
    pub(super) part: Part,
    pub(super) evidence: EvidenceId,
    pub(super) truth: Truth,
}

/// The parts of an instant, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// All its timers.
    Timers,
    /// An event, by the position in the recording of its first message.
    Event(usize),
    /// After all its messages: evidence that hears several streams changes.
    End,
}

impl Change {
    /// When it happened: changes of one moment are decided on together.
    pub(super) fn moment(&self) -> (SimTime, Part) {
        (self.at, self.part)
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
    for (message, recorded) in recording.messages.iter().enumerate() {
        if !recorded.joined {
            event = message;
        }
        if let Some(messages) = messages.get_mut(recorded.stream as usize) {
            messages.push((message, event, recorded.at));
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
    let mut latest: Vec<Option<(usize, SimTime)>> = vec![None; streams];
    let mut automaton = Automaton::new();
    let mut last = Truth::Unknown;
    let mut add = |at, part, truth| {
        if std::mem::replace(&mut last, truth) != truth {
            changes.push(Change { at, part, evidence, truth });
        }
    };
    let together = |a: &Heard, b: &Heard| streams > 1 && a.at == b.at;
    for instant in heard.chunk_by(together).take_while(|instant| instant[0].at <= end) {
        let Heard { at, message, event, .. } = instant[instant.len() - 1];
        while automaton.due(rule) <= at.nanos() {
            let due = SimTime::from_nanos(automaton.due(rule));
            automaton.pass(rule, due);
            add(due, Part::Timers, automaton.value());
        }
        for heard in instant {
            latest[heard.place] = Some((heard.message, at));
        }
        let Some(latest) = latest.iter().copied().collect::<Option<Vec<_>>>() else { continue };
        let oldest = latest.iter().map(|&(_, at)| at).min().expect("evidence hears a stream");
        let latest: Vec<usize> = latest.into_iter().map(|(message, _)| message).collect();
        automaton.observe(rule, at, conditions.truth(evidence, message, &latest), oldest);
        add(at, if streams > 1 { Part::End } else { Part::Event(event) }, automaton.value());
    }
    while automaton.due(rule) <= end.nanos() {
        let due = automaton.due(rule);
        automaton.pass(rule, SimTime::from_nanos(due));
        add(SimTime::from_nanos(due), Part::Timers, automaton.value());
        if due == i64::MAX {
            break;
        }
    }
}
