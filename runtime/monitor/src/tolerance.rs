//! By how much messages may be late before a monitor decides otherwise ([SESAME 2023, §3.3.4]): the largest delay up to
//! which every delay keeps the sequence of decisions.
//!
//! **The delayed recording.** Some streams are delayed by one delay: each of their messages is heard that much later, by
//! all evidence that hears it. All others are heard when they were recorded. Messages of one instant are heard in the
//! order of the recording, and timers before them. What would be heard after the end of the recording is not heard.
//!
//! **What is kept.** Each monitor makes the same decisions in the same order, each at most as much earlier or later as
//! the delay. Decisions that may still come after the end (those of the recording within the delay before its end) may
//! be missing.
//!
//! **Why this is exact.** The order of all that happens changes only at delays that are the difference between two times
//! of the recording: that of something which is delayed (a change of evidence, or where evidence hears both kinds of
//! streams, a message or a timer that it starts) and that of something which is not. Between two of these *critical*
//! delays everything is decided alike. So it is enough to look at each of them, and at the nanosecond after it. Evidence
//! whose streams are all delayed changes as it did, only later, so its condition need not be evaluated again.

mod critical;
mod timeline;

use sesame_base::time::SimTime;
use sesame_plan::MonitorId;

use crate::compare::Step;
use crate::network::{Deciding, EvidenceId, Network, State};
use crate::truth::Truth;
use critical::Critical;
use timeline::{Change, timeline};

/// How many changes of evidence are taken, over all delays, before the search is given up.
const PATIENCE: u64 = 20_000_000;

/// What was heard in a run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Recording {
    /// All messages, in the order in which they were heard.
    pub messages: Vec<Message>,
    /// Of each piece of evidence of the network: the streams that its condition reads, each once. A stream is whatever
    /// has a latest message of its own: a topic, or a member of a group, before or after operations.
    pub streams: Vec<Vec<u32>>,
    /// When the run ended.
    pub end: SimTime,
}

/// A message of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Message {
    /// When it was heard.
    pub at: SimTime,
    /// In which stream.
    pub stream: u32,
}

/// The conditions of evidence over the messages of a recording.
pub trait Conditions {
    /// What the condition of a piece of evidence says when it hears the message at this position of the recording, given
    /// the position of the latest message of each of its streams, in the order of [`Recording::streams`]. It must be
    /// the same for the same arguments.
    fn truth(&mut self, evidence: EvidenceId, heard: usize, latest: &[Option<usize>]) -> Truth;
}

impl<F: FnMut(EvidenceId, usize, &[Option<usize>]) -> Truth> Conditions for F {
    fn truth(&mut self, evidence: EvidenceId, heard: usize, latest: &[Option<usize>]) -> Truth {
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
    /// Of which monitor.
    pub monitor: MonitorId,
    /// Its position among the monitor's decisions.
    pub position: usize,
    /// The decision in the recording, if there is one at this position.
    pub recorded: Option<Step<State>>,
    /// The decision in the delayed recording, if there is one at this position.
    pub delayed: Option<Step<State>>,
}

/// The tolerance of the decisions of some monitors to a delay of some streams. Its decisions depend on all evidence that
/// their demands lead to, and only on that.
///
/// A delay of all streams together only shifts everything, so every such delay keeps the sequence.
pub fn tolerance(
    network: &Network,
    recording: &Recording,
    conditions: &mut dyn Conditions,
    delayed: &[u32],
    monitors: &[MonitorId],
) -> Tolerance {
    let mut search = Search::new(network, recording, conditions, delayed, monitors);
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
        // The earliest decision that is changed; of one time, that of the first monitor.
        let at = |broken: &Broken| broken.recorded.or(broken.delayed).map_or(SimTime::MAX, |step| step.at);
        if let Some(broken) = broken.min_by_key(at) {
            return Tolerance { delay: delay - SimTime::from_nanos(1), limit: Limit::Decision(broken) };
        }
        work += search.changes.len() as u64 + 1;
        next = critical.after(delay);
        if let Some(next) = next.filter(|_| work > PATIENCE) {
            return Tolerance { delay: next - SimTime::from_nanos(1), limit: Limit::GivenUp };
        }
    }
    Tolerance { delay: SimTime::MAX, limit: Limit::None }
}

/// The tolerance of some monitors to a delay of the streams of each piece of evidence, one after another; and the least
/// of these.
pub fn tolerances(
    network: &Network,
    recording: &Recording,
    conditions: &mut dyn Conditions,
    monitors: &[MonitorId],
) -> (Vec<Tolerance>, Option<Tolerance>) {
    let each: Vec<Tolerance> =
        recording.streams.iter().map(|streams| tolerance(network, recording, conditions, streams, monitors)).collect();
    let least = each.iter().copied().min_by_key(|tolerance| tolerance.delay);
    (each, least)
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

/// How the evidence of a network hears.
#[derive(Clone, Copy, PartialEq)]
enum Hears {
    /// Nothing that is delayed.
    InTime,
    /// Nothing that is not.
    Late,
    /// Both.
    Mixed,
}

struct Search<'a> {
    network: &'a Network,
    recording: &'a Recording,
    conditions: &'a mut dyn Conditions,
    monitors: &'a [MonitorId],
    /// Per stream, up to the last one that is delayed: whether it is.
    is_delayed: Vec<bool>,
    hears: Vec<Hears>,
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
        conditions: &'a mut dyn Conditions,
        delayed: &[u32],
        monitors: &'a [MonitorId],
    ) -> Self {
        let mut is_delayed = vec![false; delayed.iter().max().map_or(0, |&last| last as usize + 1)];
        for &stream in delayed {
            is_delayed[stream as usize] = true;
        }
        let hears = recording.streams.iter().map(|streams| {
            match streams.iter().filter(|&&stream| is_in(&is_delayed, stream)).count() {
                0 => Hears::InTime,
                late if late == streams.len() => Hears::Late,
                _ => Hears::Mixed,
            }
        });
        let hears = hears.collect();
        let (in_time, late, changes) = (Vec::new(), Vec::new(), Vec::new());
        let mut search = Search { network, recording, conditions, monitors, is_delayed, hears, in_time, late, changes };
        let mut in_time = Vec::new();
        let mut late = Vec::new();
        for evidence in search.all_evidence() {
            match search.hears[evidence.index()] {
                Hears::InTime => search.add_timeline(evidence, SimTime::ZERO, &mut in_time),
                Hears::Late => search.add_timeline(evidence, SimTime::ZERO, &mut late),
                Hears::Mixed => {}
            }
        }
        (search.in_time, search.late) = (in_time, late);
        search
    }

    fn all_evidence(&self) -> impl Iterator<Item = EvidenceId> + use<> {
        (0..).map(EvidenceId).take(self.hears.len().min(self.network.evidence_count()))
    }

    fn add_timeline(&mut self, evidence: EvidenceId, delay: SimTime, changes: &mut Vec<Change>) {
        let is_delayed = &self.is_delayed;
        let shift = |stream| if is_in(is_delayed, stream) { delay } else { SimTime::ZERO };
        timeline(self.network.rule(evidence), evidence, self.recording, &shift, self.conditions, changes);
    }

    /// The decisions of each monitor if the delayed streams are late by this much.
    fn decisions(&mut self, delay: SimTime) -> Vec<Vec<Step<State>>> {
        let mut changes = std::mem::take(&mut self.changes);
        changes.clear();
        changes.extend_from_slice(&self.in_time);
        changes.extend(self.late.iter().map(|change| Change { at: change.at + delay, ..*change }));
        for evidence in self.all_evidence() {
            if self.hears[evidence.index()] == Hears::Mixed {
                self.add_timeline(evidence, delay, &mut changes);
            }
        }
        let end = self.recording.end;
        changes.retain(|change| change.at <= end);
        changes.sort_unstable_by_key(|change| (change.event(), change.evidence));

        let mut deciding = Deciding::new(self.network);
        let begin = Step { at: SimTime::ZERO, state: State::Safe };
        let mut decisions = vec![vec![begin]; self.monitors.len()];
        for event in changes.chunk_by(|a, b| a.event() == b.event()) {
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
        for evidence in self.all_evidence().filter(|evidence| self.hears[evidence.index()] == Hears::Mixed) {
            let rule = self.network.rule(evidence);
            let stale = rule.stale.map(|(after, _)| after.saturating_add(1));
            let timers = [Some(0), Some(rule.held), stale];
            let streams = &self.recording.streams[evidence.index()];
            for message in self.recording.messages.iter().filter(|message| streams.contains(&message.stream)) {
                let times = timers.into_iter().flatten().map(|after| message.at + SimTime::from_nanos(after));
                if is_in(&self.is_delayed, message.stream) { late.extend(times) } else { in_time.extend(times) }
            }
        }
        Critical::new(late, in_time)
    }
}

fn is_in(is_delayed: &[bool], stream: u32) -> bool {
    is_delayed.get(stream as usize).copied().unwrap_or(false)
}
