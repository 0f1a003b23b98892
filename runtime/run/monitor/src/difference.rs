//! Why two runs of a network decide differently: from when until when a monitor is in different states, and the
//! evidence that made the difference.
//!
//! **What explains a disagreement.** At its beginning some evidence differs. Of this a set is taken without which the
//! two would agree: if exactly this evidence had been in the second run as it was in the first, the monitor would have
//! been in the same state. No part of the set can be left out. If there are several such sets, it is always the same
//! one, which prefers evidence that is declared earlier.
//!
//! **How late.** Of evidence that differs, one run has changed and the other has not. If the other changes to the same
//! value later, it is that much later.

use sesame_base::time::SimTime;
use sesame_plan::MonitorId;

use crate::network::{Changes, Decision, EvidenceChange, EvidenceId, Network, State};
use crate::truth::Truth;
use crate::why::Moment;

/// What happened in a run of a network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Course {
    /// Changes of evidence, in the order in which they happened.
    pub evidence: Vec<EvidenceChange>,
    /// Decisions, likewise.
    pub decisions: Vec<Decision>,
    /// When the run ended.
    pub end: SimTime,
}

impl Course {
    /// Takes what has changed since.
    pub fn take(&mut self, changes: &mut Changes) {
        self.evidence.append(&mut changes.evidence);
        self.decisions.append(&mut changes.decisions);
    }
}

/// A time in which a monitor was in different states in two runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Disagreement {
    /// When it began.
    pub from: SimTime,
    /// When it was over: with another state of one of the two, or with the end of the run that ended first.
    pub to: SimTime,
    /// The state in the first run.
    pub first: State,
    /// The state in the second run.
    pub second: State,
    /// The evidence that made the difference, in the order of evidence; at least one piece.
    pub because: Vec<Deviation>,
}

/// A piece of evidence that had different values in two runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deviation {
    /// Which.
    pub evidence: EvidenceId,
    /// What it was in the first run.
    pub first: Value,
    /// What it was in the second run.
    pub second: Value,
    /// Which run changed to the value that the other did not have yet, or any more.
    pub leads: Leads,
    /// The position, among the changes of the run that does not lead, of its next change to that value.
    pub follows: Option<usize>,
}

/// The value of evidence in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Value {
    /// The value.
    pub truth: Truth,
    /// The position, among the changes of the run, of the one with which it had this value; `None` since the beginning.
    pub since: Option<usize>,
}

/// One of two runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leads {
    /// The first.
    First,
    /// The second.
    Second,
}

impl Deviation {
    /// By how much the second run was later than the first; negative if it was earlier. `None` if the other did not
    /// follow.
    pub fn late(&self, first: &Course, second: &Course) -> Option<SimTime> {
        let at = |course: &Course, position: Option<usize>| Some(course.evidence[position?].at);
        match self.leads {
            Leads::First => Some(at(second, self.follows)? - at(first, self.first.since)?),
            Leads::Second => Some(at(second, self.second.since)? - at(first, self.follows)?),
        }
    }
}

/// When a monitor was in different states in two runs of a network, in the order of time, until the earlier of their
/// ends. The state at an instant is the last one decided at it.
pub fn disagreements(network: &Network, monitor: MonitorId, first: &Course, second: &Course) -> Vec<Disagreement> {
    let end = first.end.min(second.end);
    let mut sides = [Walk::new(network, first, monitor), Walk::new(network, second, monitor)];
    let mut found: Vec<Disagreement> = Vec::new();
    let mut open = false;
    let mut now = Some(SimTime::ZERO);
    while let Some(at) = now.filter(|&at| at < end || at == SimTime::ZERO) {
        for side in &mut sides {
            side.advance(at);
        }
        let [a, b] = &sides;
        if let Some(last) = found.last_mut().filter(|last| open && (last.first, last.second) != (a.state, b.state)) {
            last.to = at;
            open = false;
        }
        if a.state != b.state && !open {
            let because = deviations(network, monitor, a, b);
            found.push(Disagreement { from: at, to: end, first: a.state, second: b.state, because });
            open = true;
        }
        now = sides.iter().filter_map(Walk::next).min();
    }
    found
}

/// The evidence that makes the difference between the states of a monitor.
fn deviations(network: &Network, monitor: MonitorId, a: &Walk<'_>, b: &Walk<'_>) -> Vec<Deviation> {
    let ids = (0..).map(EvidenceId).take(network.evidence_count());
    let mut set: Vec<EvidenceId> = ids.filter(|id| a.truth(*id) != b.truth(*id)).collect();
    // Those that are declared last are left out first. What could not be left out may be when others are: a state is
    // also lost to a stronger guarantee.
    let mut before = usize::MAX;
    while set.len() < before {
        before = set.len();
        for at in (0..set.len()).rev() {
            let left_out = set.remove(at);
            let replaced = |id| if set.contains(&id) { a.truth(id) } else { b.truth(id) };
            if Moment::new(network, replaced).state(monitor) != a.state {
                set.insert(at, left_out);
            }
        }
    }
    set.into_iter().map(|id| deviation(id, a, b)).collect()
}

fn deviation(evidence: EvidenceId, a: &Walk<'_>, b: &Walk<'_>) -> Deviation {
    let (first, second) = (a.values[evidence.index()], b.values[evidence.index()]);
    let at = |walk: &Walk<'_>, since: Option<usize>| since.map(|position| walk.course.evidence[position].at);
    let (leads, other, truth) = if at(a, first.since) >= at(b, second.since) {
        (Leads::First, b, first.truth)
    } else {
        (Leads::Second, a, second.truth)
    };
    let later = other.course.evidence.iter().enumerate().skip(other.changes);
    let mut follows = later.filter(|(_, change)| change.evidence == evidence && change.truth == truth);
    Deviation { evidence, first, second, leads, follows: follows.next().map(|(position, _)| position) }
}

/// One run, up to some instant.
struct Walk<'a> {
    course: &'a Course,
    monitor: MonitorId,
    /// How many changes have happened.
    changes: usize,
    /// How many decisions have been taken, those of other monitors included.
    decisions: usize,
    values: Vec<Value>,
    state: State,
}

impl<'a> Walk<'a> {
    fn new(network: &Network, course: &'a Course, monitor: MonitorId) -> Self {
        let values = vec![Value { truth: Truth::Unknown, since: None }; network.evidence_count()];
        Walk { course, monitor, changes: 0, decisions: 0, values, state: State::Safe }
    }

    fn truth(&self, evidence: EvidenceId) -> Truth {
        self.values[evidence.index()].truth
    }

    /// Everything until an instant, and at it.
    fn advance(&mut self, to: SimTime) {
        while let Some(change) = self.course.evidence.get(self.changes).filter(|change| change.at <= to) {
            self.values[change.evidence.index()] = Value { truth: change.truth, since: Some(self.changes) };
            self.changes += 1;
        }
        while let Some(decision) = self.course.decisions.get(self.decisions).filter(|decision| decision.at <= to) {
            if decision.monitor == self.monitor {
                self.state = decision.state;
            }
            self.decisions += 1;
        }
    }

    /// The next instant at which something is decided.
    fn next(&self) -> Option<SimTime> {
        self.course.decisions.get(self.decisions).map(|decision| decision.at)
    }
}
