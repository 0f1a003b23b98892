//! By how much messages may be late before a monitor decides otherwise ([SESAME 2023, §3.3.4]): the largest delay up to
//! which every delay keeps the sequence of decisions.
//!
//! **The delayed recording.** Some streams are delayed by one delay: each of their messages is heard that much later,
//! by all evidence that hears it. All others are heard when they were recorded. Messages of one instant are heard in
//! the order of the recording, and timers before them; evidence that hears several streams changes after them. What
//! would be heard after the end of the recording is not heard.
//!
//! **What is kept.** Each monitor makes the same decisions in the same order, each at most as much earlier or later as
//! the delay. Decisions that may still come after the end (those of the recording within the delay before its end) may
//! be missing.
//!
//! **Why this is exact.** The order of all that happens changes only at delays that are the difference between two
//! times of the recording: that of something which is delayed (a change of evidence, or where evidence hears both
//! kinds of streams, a message or a timer that it starts) and that of something which is not. Between two of these
//! *critical* delays everything is decided alike. So it is enough to look at each of them, and at the nanosecond after
//! it. Evidence whose streams are all delayed changes as it did, only later, so its condition need not be evaluated
//! again.

mod critical;
mod timeline;

use sesame_base::time::SimTime;
use sesame_plan::MonitorId;

use crate::compare::Step;
use crate::network::{Deciding, EvidenceId, Network, State};
use crate::truth::Truth;
use critical::Critical;
use timeline::{Change, Heard, heard, timeline};

/// How many changes of evidence and messages of mixed evidence are taken, over all delays, before the search is given
/// up.
const PATIENCE: u64 = 20_000_000;

/// What was heard in a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recording {
    /// All messages, in the order in which they were heard.
    pub messages: Vec<RecordedMessage>,
    /// For each piece of evidence of the network: the streams that its condition reads, each once. A stream is whatever
    /// has a latest message of its own: a topic, or a member of a group, before or after operations.
    pub streams: Vec<Vec<u32>>,
    /// When the run ended.
    pub end: SimTime,
}

/// A message of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedMessage {
    /// When it was heard.
    pub at: SimTime,
    /// The stream that it is in.
    pub stream: u32,
    /// Whether it is one event with the message before it: monitors decide on both together. It is the same message in
    /// another stream, delivered as soon as it was published. No evidence hears both streams.
    pub joined: bool,
}

/// The conditions of evidence over the messages of a recording.
pub trait Conditions {
    /// What the condition of a piece of evidence says when it hears the message at this position of the recording,
    /// given the position of the latest message of each of its streams, in the order of [`Recording::streams`]. It
    /// must be the same for the same arguments. It is asked once each of them had a message.
    fn truth(&mut self, evidence: EvidenceId, heard: usize, latest: &[usize]) -> Truth;
}

impl<F: FnMut(EvidenceId, usize, &[usize]) -> Truth> Conditions for F {
    fn truth(&mut self, evidence: EvidenceId, heard: usize, latest: &[usize]) -> Truth {
        self(evidence, heard, latest)
    }
}

/// How late messages may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tolerance {
    /// Every delay up to this one keeps all decisions; [`SimTime::MAX`] if every delay does.
    pub delay: SimTime,
    /// What ends it.
    pub limit: Limit,
}

/// Why a tolerance is not larger.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Nothing ends it.
    None,
    /// A delay that is a nanosecond longer changes this decision.
    Decision(Broken),
    /// The search was given up: longer delays may or may not change decisions.
    GivenUp,
}

/// A decision that a delay changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Broken {
    /// The monitor that decides.
    pub monitor: MonitorId,
    /// Its position among the monitor's decisions.
    pub position: usize,
    /// The decision in the recording, if there is one at this position.
    pub recorded: Option<Step<State>>,
    /// The decision in the delayed recording, if there is one at this position.
    pub delayed: Option<Step<State>>,
}

/// The tolerance of the decisions of some monitors to a delay of some streams. Its decisions depend on all evidence
/// that their demands lead to, and only on that.
///
/// A delay of all streams together only shifts everything, so every such delay keeps the sequence.
pub fn tolerance(
    network: &Network,
    recording: &Recording,
    conditions: &mut dyn Conditions,
    delayed: &[u32],
    monitors: &[MonitorId],
) -> Tolerance {
    tolerances(network, recording, conditions, &[delayed], monitors)[0]
}

/// The tolerance of some monitors to a delay of each of these sets of streams, one after another: those of a topic, or
/// of a piece of evidence.
pub fn tolerances(
    network: &Network,
    recording: &Recording,
    conditions: &mut dyn Conditions,
    delayed: &[&[u32]],
    monitors: &[MonitorId],
) -> Vec<Tolerance> {
    let prepared = Prepared::new(network, recording, conditions);
    let mut of = |delayed| of_streams(network, recording, &prepared, conditions, delayed, monitors);
    delayed.iter().map(|delayed| of(delayed)).collect()
}

fn of_streams(
    network: &Network,
    recording: &Recording,
    prepared: &Prepared,
    conditions: &mut dyn Conditions,
    delayed: &[u32],
    monitors: &[MonitorId],
) -> Tolerance {
    let mut search = Search::new(network, recording, prepared, conditions, delayed, monitors);
    let recorded = search.decisions(SimTime::ZERO);
    let mut critical = search.critical(&recorded);
    let mut work = 0;
    // Between zero and the first critical delay.
    let mut next = Some(SimTime::from_nanos(1));
    while let Some(delay) = next {
        let found = search.decisions(delay);
        let pairs = recorded.iter().zip(&found).zip(monitors);
        let broken = pairs.filter_map(|((recorded, found), &monitor)| {
            broken(recorded, found, delay, recording.end).map(|position| Broken {
                monitor,
                position,
                recorded: recorded.get(position).copied(),
                delayed: found.get(position).copied(),
            })
        });
        // The earliest decision that is changed; at one time, that of the first monitor.
        let at = |broken: &Broken| broken.recorded.or(broken.delayed).map_or(SimTime::MAX, |step| step.at);
        if let Some(broken) = broken.min_by_key(at) {
            return Tolerance { delay: delay - SimTime::from_nanos(1), limit: Limit::Decision(broken) };
        }
        work += search.work();
        next = critical.after(delay);
        if let Some(next) = next.filter(|_| work > PATIENCE) {
            return Tolerance { delay: next - SimTime::from_nanos(1), limit: Limit::GivenUp };
        }
    }
    Tolerance { delay: SimTime::MAX, limit: Limit::None }
}

/// The position of the first decision that a delay changes.
fn broken(recorded: &[Step<State>], found: &[Step<State>], delay: SimTime, end: SimTime) -> Option<usize> {
    let late = |a: SimTime, b: SimTime| (a - b).nanos().unsigned_abs() > delay.nanos().unsigned_abs();
    (0..recorded.len().max(found.len())).find(|&at| match (recorded.get(at), found.get(at)) {
        (Some(recorded), Some(found)) => recorded.state != found.state || late(found.at, recorded.at),
        (Some(recorded), None) => recorded.at + delay <= end,
        (None, _) => true,
    })
}

/// What is the same for all delays.
struct Prepared {
    /// Per evidence: what it hears.
    heard: Vec<Vec<Heard>>,
    /// Per evidence: its changes in the recording.
    changes: Vec<Vec<Change>>,
}

impl Prepared {
    fn new(network: &Network, recording: &Recording, conditions: &mut dyn Conditions) -> Self {
        let heard = heard(recording);
        let ids = (0..).map(EvidenceId).take(network.evidence_count());
        let changes = ids.zip(&heard).zip(&recording.streams).map(|((id, heard), streams)| {
            let mut changes = Vec::new();
            timeline((id, network.rule(id)), (heard, streams.len()), recording.end, conditions, &mut changes);
            changes
        });
        Prepared { changes: changes.collect(), heard }
    }
}

struct Search<'a> {
    network: &'a Network,
    recording: &'a Recording,
    prepared: &'a Prepared,
    conditions: &'a mut dyn Conditions,
    monitors: &'a [MonitorId],
    /// Per stream, up to the last one that is delayed: whether it is.
    is_delayed: Vec<bool>,
    /// Evidence that hears both kinds of streams.
    mixed: Vec<EvidenceId>,
    /// Changes of evidence that hears nothing that is delayed.
    in_time: Vec<Change>,
    /// Changes of evidence that hears nothing else, without delay.
    late: Vec<Change>,
    /// All changes for the delay that was looked at last.
    changes: Vec<Change>,
}

impl<'a> Search<'a> {
    fn new(
        network: &'a Network,
        recording: &'a Recording,
        prepared: &'a Prepared,
        conditions: &'a mut dyn Conditions,
        delayed: &[u32],
        monitors: &'a [MonitorId],
    ) -> Self {
        let mut is_delayed = vec![false; delayed.iter().max().map_or(0, |&last| last as usize + 1)];
        for &stream in delayed {
            is_delayed[stream as usize] = true;
        }
        let (mut mixed, mut in_time, mut late) = (Vec::new(), Vec::new(), Vec::new());
        for ((id, changes), streams) in (0..).map(EvidenceId).zip(&prepared.changes).zip(&recording.streams) {
            match streams.iter().filter(|&&stream| is_in(&is_delayed, stream)).count() {
                0 => in_time.extend_from_slice(changes),
                delayed if delayed == streams.len() => late.extend_from_slice(changes),
                _ => mixed.push(id),
            }
        }
        let changes = Vec::new();
        Search { network, recording, prepared, conditions, monitors, is_delayed, mixed, in_time, late, changes }
    }

    /// What it costs to look at a delay.
    fn work(&self) -> u64 {
        let heard = self.mixed.iter().map(|evidence| self.prepared.heard[evidence.index()].len());
        (self.changes.len() + heard.sum::<usize>() + 1) as u64
    }

    /// Adds the changes of evidence that hears both kinds of streams.
    fn add_mixed(&mut self, evidence: EvidenceId, delay: SimTime, changes: &mut Vec<Change>) {
        let streams = &self.recording.streams[evidence.index()];
        let shift = |place: usize| if is_in(&self.is_delayed, streams[place]) { delay } else { SimTime::ZERO };
        let heard = &self.prepared.heard[evidence.index()];
        let mut heard: Vec<Heard> =
            heard.iter().map(|heard| Heard { at: heard.at + shift(heard.place), ..*heard }).collect();
        heard.sort_unstable_by_key(|heard| (heard.at, heard.message));
        let of = (evidence, self.network.rule(evidence));
        timeline(of, (&heard, streams.len()), self.recording.end, self.conditions, changes);
    }

    /// The decisions of each monitor if the delayed streams are late by this much.
    fn decisions(&mut self, delay: SimTime) -> Vec<Vec<Step<State>>> {
        let mut changes = std::mem::take(&mut self.changes);
        changes.clear();
        changes.extend_from_slice(&self.in_time);
        changes.extend(self.late.iter().map(|change| Change { at: change.at + delay, ..*change }));
        for at in 0..self.mixed.len() {
            self.add_mixed(self.mixed[at], delay, &mut changes);
        }
        let end = self.recording.end;
        changes.retain(|change| change.at <= end);
        changes.sort_unstable_by_key(|change| (change.moment(), change.evidence));

        let mut deciding = Deciding::new(self.network);
        let begin = Step { at: SimTime::ZERO, state: State::Safe };
        let mut decisions = vec![vec![begin]; self.monitors.len()];
        for event in changes.chunk_by(|a, b| a.moment() == b.moment()) {
            for change in event {
                deciding.set(self.network, change.evidence, change.truth);
            }
            deciding.decide(self.network, event[0].at, |decision| {
                let places = self.monitors.iter().zip(&mut decisions);
                let own = places.filter(|(monitor, _)| **monitor == decision.monitor);
                own.for_each(|(_, steps)| steps.push(Step { at: decision.at, state: decision.state }));
            });
        }
        self.changes = changes;
        decisions
    }

    /// All delays at which the order of what happens may change.
    fn critical(&self, recorded: &[Vec<Step<State>>]) -> Critical {
        let mut late: Vec<SimTime> = self.late.iter().map(|change| change.at).collect();
        let mut in_time: Vec<SimTime> = self.in_time.iter().map(|change| change.at).collect();
        late.extend(recorded.iter().flatten().map(|step| step.at));
        in_time.push(self.recording.end);
        for &evidence in &self.mixed {
            let rule = self.network.rule(evidence);
            let stale = rule.stale.map(|stale| stale.after.saturating_add(1));
            let timers = [Some(0), Some(rule.held), stale];
            let streams = &self.recording.streams[evidence.index()];
            for heard in &self.prepared.heard[evidence.index()] {
                let times = timers.into_iter().flatten().map(|after| heard.at + SimTime::from_nanos(after));
                if is_in(&self.is_delayed, streams[heard.place]) { late.extend(times) } else { in_time.extend(times) }
            }
        }
        Critical::new(late, in_time)
    }
}

fn is_in(is_delayed: &[bool], stream: u32) -> bool {
    is_delayed.get(stream as usize).copied().unwrap_or(false)
}
