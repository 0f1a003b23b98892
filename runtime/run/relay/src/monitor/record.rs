//! What monitors did in a run, up to a limit.

use sesame_base::observation::{CHANGES_KEPT, ChangeCause, EvidenceChange, MonitorDecision, MonitorObservation};
use sesame_monitor::{Decision, Network, Truth};
use sesame_plan::CampaignPlan;

/// Decisions and changes of evidence, as they come.
pub(super) struct Record {
    monitors: Vec<MonitorObservation>,
    kept: usize,
    omitted: u64,
}

impl Record {
    pub(super) fn new(plan: &CampaignPlan) -> Self {
        Record { monitors: vec![MonitorObservation::default(); plan.monitors.len()], kept: 0, omitted: 0 }
    }

    pub(super) fn decision(&mut self, decision: &Decision) {
        let monitor = &mut self.monitors[decision.monitor.index()];
        if self.kept == CHANGES_KEPT {
            monitor.omitted += 1;
            self.omitted += 1;
            return;
        }
        self.kept += 1;
        let decision = MonitorDecision { time: decision.at.seconds(), state: decision.state.into() };
        monitor.decisions.push(decision);
    }

    pub(super) fn change(&mut self, network: &Network, change: &sesame_monitor::EvidenceChange, cause: ChangeCause) {
        let (monitor, evidence) = network.owner(change.evidence);
        let monitor = &mut self.monitors[monitor.index()];
        if self.kept == CHANGES_KEPT {
            monitor.omitted += 1;
            self.omitted += 1;
            return;
        }
        self.kept += 1;
        let holds = holds(change.truth);
        monitor.evidence.push(EvidenceChange { time: change.at.seconds(), evidence, holds, cause });
    }

    pub(super) fn finish(self, warnings: &mut Vec<String>) -> Vec<MonitorObservation> {
        if self.omitted > 0 {
            let omitted = self.omitted;
            warnings.push(format!(
                "monitors decided and their evidence changed more than {CHANGES_KEPT} times; the last {omitted} times \
                 are not kept, but count in scores"
            ));
        }
        self.monitors
    }
}

/// Whether something holds; `None` if it is unknown.
pub(super) fn holds(truth: Truth) -> Option<bool> {
    match truth {
        Truth::False => Some(false),
        Truth::Unknown => None,
        Truth::True => Some(true),
    }
}
