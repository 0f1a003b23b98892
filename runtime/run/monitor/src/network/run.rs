//! One run of a network: what is observed and when, and what is decided.

use std::sync::Arc;

use sesame_base::time::SimTime;
use sesame_plan::MonitorId;

use super::timers::Timers;
use super::{Deciding, Decision, EvidenceId, Network, State};
use crate::evidence::Automaton;
use crate::truth::Truth;

/// The value of evidence has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EvidenceChange {
    /// Which.
    pub evidence: EvidenceId,
    /// Its new value.
    pub truth: Truth,
    /// When.
    pub at: SimTime,
}

/// What the condition of evidence says when something that it reads had a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// Which evidence.
    pub evidence: EvidenceId,
    /// What its condition says.
    pub truth: Truth,
    /// The last message of the source, a topic or a member of a group, that has been silent longest.
    pub oldest: SimTime,
}

impl Reading {
    /// All sources of the evidence had a message now, as when it has only one.
    pub fn now(at: SimTime, evidence: EvidenceId, truth: Truth) -> Self {
        Reading { evidence, truth, oldest: at }
    }
}

/// What a run came to, in the order of time. Callers clear and reuse it, so that a run allocates nothing.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Changes {
    /// Changes of evidence.
    pub evidence: Vec<EvidenceChange>,
    /// Decisions.
    pub decisions: Vec<Decision>,
}

impl Changes {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.evidence.is_empty() && self.decisions.is_empty()
    }

    /// Forgets all changes.
    pub fn clear(&mut self) {
        self.evidence.clear();
        self.decisions.clear();
    }
}

/// A run of a network.
///
/// Time does not go back: what is said to be earlier than what was said before counts as of that time.
///
/// An event is a message, or an instant at which evidence changes without one (all that changes so at one instant is
/// one event, before messages of that instant). It changes evidence first; then each monitor that it concerns is
/// decided once. A message that does not change the value of any evidence costs the same for each piece of evidence
/// that listens to it, however many others there are.
#[derive(Debug, Clone)]
pub struct Run {
    network: Arc<Network>,
    now: SimTime,
    automata: Vec<Automaton>,
    deciding: Deciding,
    timers: Timers,
}

/// What is near enough for its time to be known exactly, in nanoseconds.
const NEAR: i64 = 100_000_000;

impl Run {
    /// Time zero: no evidence is known, and each monitor decides for its safe state, which does not lose a
    /// guarantee.
    pub fn start(network: Arc<Network>, changes: &mut Changes) -> Self {
        let first = |&monitor| Decision { monitor, state: State::Safe, at: SimTime::ZERO, mitigate: false };
        changes.decisions.extend(network.order().iter().map(first));
        Run {
            now: SimTime::ZERO,
            automata: vec![Automaton::new(); network.evidence_count()],
            deciding: Deciding::new(&network),
            timers: Timers::new(network.evidence_count()),
            network,
        }
    }

    /// A message: what the conditions of all evidence that listens to its topic say now, each piece of evidence at most
    /// once. A condition with a number that is not finite is unknown. Evidence whose condition says the same as before
    /// must be listed too, because it is fresh again, and evidence of which a source had no message yet must not.
    ///
    /// What was due until then comes first.
    pub fn observe(&mut self, at: SimTime, heard: &[Reading], changes: &mut Changes) {
        self.take(at, heard.iter().copied(), changes);
    }

    /// As [`Run::observe`], of evidence that listens to no other topic.
    pub fn observe_alone(&mut self, at: SimTime, heard: &[(EvidenceId, Truth)], changes: &mut Changes) {
        let readings = heard.iter().map(|&(evidence, truth)| Reading::now(at, evidence, truth));
        self.take(at, readings, changes);
    }

    #[inline]
    fn take(&mut self, at: SimTime, readings: impl Iterator<Item = Reading>, changes: &mut Changes) {
        self.advance(at, changes);
        let at = self.now;
        for Reading { evidence, truth, oldest } in readings {
            let rule = &self.network.rules[evidence.index()];
            let automaton = &mut self.automata[evidence.index()];
            let before = automaton.value();
            automaton.observe(rule, at, truth, oldest);
            self.timers.by(evidence.0, automaton.due(rule));
            let truth = automaton.value();
            if truth != before {
                changes.evidence.push(EvidenceChange { evidence, truth, at });
                self.deciding.set(&self.network, evidence, truth);
            }
        }
        self.deciding.decide(&self.network, at, |decision| changes.decisions.push(decision));
    }

    /// When evidence will change if nothing is heard until then; `None` for never. (It may change to the value that it
    /// has.)
    pub fn due(&mut self) -> Option<SimTime> {
        while let Some((evidence, time)) = self.timers.first() {
            let due = self.automata[evidence as usize].due(&self.network.rules[evidence as usize]);
            if due <= time {
                return Some(SimTime::from_nanos(time));
            }
            self.timers.put_off_first(due);
        }
        None
    }

    /// An instant before which nothing changes if nothing is heard until then, and most often the one of [`Run::due`]:
    /// what is further away than 0.1 s may be later. Messages put timers off, so that most times that are far away
    /// never come, and need not be known exactly.
    pub fn due_not_before(&mut self) -> Option<SimTime> {
        match self.timers.first() {
            Some((_, time)) if time.saturating_sub(self.now.nanos()) > NEAR => Some(SimTime::from_nanos(time)),
            _ => self.due(),
        }
    }

    /// Time passes: all that is due until this instant, and at it, happens.
    pub fn advance(&mut self, to: SimTime, changes: &mut Changes) {
        if self.timers.first().is_none_or(|(_, time)| time > to.nanos()) {
            self.now = self.now.max(to);
            return;
        }
        while let Some(at) = self.due().filter(|&at| at <= to) {
            while self.due() == Some(at) {
                let Some((evidence, _)) = self.timers.first() else { break };
                let rule = &self.network.rules[evidence as usize];
                let automaton = &mut self.automata[evidence as usize];
                let before = automaton.value();
                automaton.pass(rule, at);
                self.timers.put_off_first(automaton.due(rule));
                let truth = automaton.value();
                if truth != before {
                    let evidence = EvidenceId(evidence);
                    changes.evidence.push(EvidenceChange { evidence, truth, at });
                    self.deciding.set(&self.network, evidence, truth);
                }
            }
            self.deciding.decide(&self.network, at, |decision| changes.decisions.push(decision));
        }
        self.now = self.now.max(to);
    }

    /// The latest time that it was told.
    pub fn now(&self) -> SimTime {
        self.now
    }

    /// The network that runs.
    pub fn network(&self) -> &Arc<Network> {
        &self.network
    }

    /// The value of a piece of evidence.
    pub fn evidence(&self, evidence: EvidenceId) -> Truth {
        self.automata[evidence.index()].value()
    }

    /// What the condition of evidence said at the last message, whatever its age and however long it must be held.
    pub fn condition(&self, evidence: EvidenceId) -> Truth {
        self.automata[evidence.index()].raw()
    }

    /// The value of a guarantee's gate, whether or not a stronger guarantee holds.
    pub fn guarantee(&self, monitor: MonitorId, position: u32) -> Truth {
        self.deciding.get(self.network.guarantee_node(monitor, position))
    }

    /// The value of a demand: whether its guarantee or a stronger one of that monitor holds.
    pub fn demand(&self, monitor: MonitorId, position: u32) -> Truth {
        self.deciding.get(self.network.demand_nodes(monitor)[position as usize])
    }

    /// The state of a monitor.
    pub fn state(&self, monitor: MonitorId) -> State {
        self.deciding.state(monitor)
    }
}
