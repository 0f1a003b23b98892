//! Decisions as they are made, each with what caused it, for those who want to be told at once.

use sesame_base::observation::ChangeCause;
use sesame_base::time::SimTime;
use sesame_monitor::{Decision, EvidenceChange, Network};
use sesame_plan::{MonitorId, MonitorState};

use super::record::holds;

/// A change of a monitor's state, or its state at time zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Decided {
    /// When.
    pub at: SimTime,
    /// Which monitor.
    pub monitor: MonitorId,
    /// Its state from then on.
    pub state: MonitorState,
    /// What changed at this moment in the evidence of all monitors, in order; empty at time zero.
    pub causes: Vec<Cause>,
}

/// A change of evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Whose evidence it is.
    pub monitor: MonitorId,
    /// Its position in [`Monitor::evidence`](sesame_plan::Monitor::evidence).
    pub evidence: u32,
    /// Whether it holds; `None` if it is unknown.
    pub holds: Option<bool>,
    /// What changed it.
    pub by: ChangeCause,
}

/// The decisions for whoever asked for them, and the changes behind them.
#[derive(Debug)]
pub(super) struct Told {
    asked: bool,
    decided: Vec<Decided>,
    /// The changes at hand.
    changes: Vec<(SimTime, Cause)>,
}

impl Told {
    /// Everything is kept, until it is [only if somebody asks](Told::only_if_asked).
    pub(super) fn new() -> Self {
        Told { asked: true, decided: Vec::new(), changes: Vec::new() }
    }

    pub(super) fn only_if_asked(&mut self) {
        self.asked = false;
    }

    pub(super) fn ask(&mut self) {
        self.asked = true;
    }

    /// Evidence changed. The changes of an event come before its decisions.
    pub(super) fn changed(&mut self, network: &Network, change: &EvidenceChange, by: &ChangeCause) {
        if self.asked {
            let (monitor, evidence) = network.owner(change.evidence);
            let cause = Cause { monitor, evidence, holds: holds(change.truth), by: by.clone() };
            self.changes.push((change.at, cause));
        }
    }

    pub(super) fn decided(&mut self, decision: &Decision) {
        if self.asked {
            let now = self.changes.iter().filter(|(at, _)| *at == decision.at);
            let causes = now.map(|(_, cause)| cause.clone()).collect();
            let (at, monitor) = (decision.at, decision.monitor);
            self.decided.push(Decided { at, monitor, state: decision.state.into(), causes });
        }
    }

    /// The changes at hand have been told.
    pub(super) fn end_changes(&mut self) {
        self.changes.clear();
    }

    pub(super) fn has_decided(&self) -> bool {
        !self.decided.is_empty()
    }

    pub(super) fn take(&mut self) -> Vec<Decided> {
        std::mem::take(&mut self.decided)
    }
}
