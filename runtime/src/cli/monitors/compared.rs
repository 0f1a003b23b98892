//! Two recordings and what monitors decide on them, put into words.

use std::path::Path;
use std::sync::Arc;

use sesame_base::observation::ChangeCause;
use sesame_base::time::SimTime;
use sesame_base::visible::visible;
use sesame_monitor::compare::{Comparison, Difference, Step, compare, steps};
use sesame_monitor::difference::{Deviation, Disagreement, Leads, Value, disagreements};
use sesame_monitor::tolerance::{Limit, Tolerance};
use sesame_monitor::{EvidenceId, Network, State};
use sesame_plan::{CampaignPlan, MonitorId, MonitorState};
use sesame_recording::{self as trace, Heard, RecordedMonitors, RecordedRun};
use sesame_relay::wire::WireTable;
use sesame_report::{
    BrokenDecision, ComparedMonitor, ComparedRecording, DecisionDifference, DelayTolerance, EvidenceCause,
    EvidenceDeviation, EvidenceValue, MonitorDisagreement, MonitorsCompared, ShiftedDecision, TimedState, Tolerated,
};

use crate::cli::failure::Failure;

/// How many times in which states differ are kept of each monitor.
const KEPT: usize = 1_000;

/// Compares what monitors decide on two recordings. The times of a decision may differ by any time, or by this one.
pub(in crate::cli) fn compared(
    plan: &CampaignPlan,
    files: [&Path; 2],
    chosen: &[MonitorId],
    within: Option<f64>,
) -> Result<MonitorsCompared, Failure> {
    let network = Arc::new(Network::new(&plan.monitors)?);
    let wires = WireTable::new(plan);
    let mut warnings = Vec::new();
    let mut sides: Vec<Side<'_>> = Vec::new();
    for (name, file) in ["first", "second"].into_iter().zip(files) {
        let (recorded, run, said) = trace::monitors(file, plan, &wires, &network)?;
        warnings.extend(said.into_iter().map(|warning| format!("on the {name} recording: {warning}")));
        sides.push(Side { file, heard: recorded.decide(), recorded, run });
    }
    let Ok([first, second]): Result<[Side<'_>; 2], _> = sides.try_into() else { unreachable!("there are two files") };
    let words = Words { plan, network: &network, sides: [&first.heard, &second.heard] };
    let ordered: Vec<MonitorId> = network.order().iter().copied().filter(|id| chosen.contains(id)).collect();
    let monitors: Vec<ComparedMonitor> = ordered.iter().map(|&monitor| words.monitor(monitor)).collect();
    let tolerances = [&first, &second].map(|side| side.recorded.tolerances(&ordered));
    let topics = first.recorded.topics().into_iter().zip(tolerances[0].iter().zip(&tolerances[1]));
    let topics = topics.map(|((topic, evidence), (on_first, on_second))| DelayTolerance {
        topic: topic.to_owned(),
        evidence: evidence.into_iter().map(|id| words.evidence(id).join(".")).collect(),
        first: words.tolerated(on_first),
        second: words.tolerated(on_second),
    });
    let topics = topics.collect();
    let mut found = MonitorsCompared {
        first: first.about(),
        second: second.about(),
        within,
        same: false,
        monitors,
        topics,
        warnings,
    };
    found.same = found.objections().is_empty();
    Ok(found)
}

/// A recording.
struct Side<'a> {
    file: &'a Path,
    recorded: RecordedMonitors<'a>,
    heard: Heard,
    run: Option<RecordedRun>,
}

impl Side<'_> {
    fn about(&self) -> ComparedRecording {
        let run = self.run.as_ref().map(|run| visible(&format!("{} of {} ({})", run.test, run.campaign, run.outcome)));
        ComparedRecording {
            recording: self.file.to_owned(),
            run,
            messages: self.recorded.messages(),
            end: self.heard.course.end.seconds(),
        }
    }
}

struct Words<'a> {
    plan: &'a CampaignPlan,
    network: &'a Network,
    sides: [&'a Heard; 2],
}

impl Words<'_> {
    fn monitor(&self, monitor: MonitorId) -> ComparedMonitor {
        let [first, second] = self.sides;
        let decided = self.sides.map(|side| steps(&side.course.decisions, monitor));
        let compared = compare(&decided[0], &decided[1]);
        let mut found = disagreements(self.network, monitor, &first.course, &second.course);
        let difference = compared.difference.as_ref().filter(|difference| !self.is_beyond_the_end(difference));
        let difference = difference.map(|difference| self.difference(monitor, difference, &found));
        let omitted = found.len().saturating_sub(KEPT);
        found.truncate(KEPT);
        ComparedMonitor {
            monitor: self.plan.monitor(monitor).name.clone(),
            first: decided[0].len(),
            second: decided[1].len(),
            difference,
            furthest: self.furthest(monitor, &compared, &decided[0]),
            disagreements: found.iter().map(|disagreement| self.disagreement(monitor, disagreement)).collect(),
            omitted,
        }
    }

    /// Whether one recording had ended when the other had a further decision.
    fn is_beyond_the_end(&self, difference: &Difference<State>) -> bool {
        let [first, second] = self.sides.map(|side| side.course.end);
        match (&difference.first, &difference.second) {
            (Some(step), None) => step.at > second,
            (None, Some(step)) => step.at > first,
            _ => false,
        }
    }

    fn difference(
        &self,
        monitor: MonitorId,
        difference: &Difference<State>,
        found: &[Disagreement],
    ) -> DecisionDifference {
        let Difference { position, first, second } = difference;
        let at = [first, second].into_iter().flatten().map(|step| step.at).min();
        let covering =
            found.iter().find(|disagreement| at.is_some_and(|at| disagreement.from <= at && at < disagreement.to));
        DecisionDifference {
            decision: *position,
            first: first.map(|step| self.step(monitor, step)),
            second: second.map(|step| self.step(monitor, step)),
            because: covering.map_or_else(Vec::new, |disagreement| self.because(disagreement)),
        }
    }

    fn furthest(
        &self,
        monitor: MonitorId,
        compared: &Comparison<State>,
        decided: &[Step<State>],
    ) -> Option<ShiftedDecision> {
        let (decision, late) = compared.greatest_shift().filter(|(_, late)| *late != SimTime::ZERO)?;
        let TimedState { state, at } = self.step(monitor, decided[decision]);
        Some(ShiftedDecision { decision, state, at, late: late.seconds() })
    }

    fn disagreement(&self, monitor: MonitorId, disagreement: &Disagreement) -> MonitorDisagreement {
        MonitorDisagreement {
            from: disagreement.from.seconds(),
            to: disagreement.to.seconds(),
            first: self.state(monitor, disagreement.first),
            second: self.state(monitor, disagreement.second),
            because: self.because(disagreement),
        }
    }

    fn because(&self, disagreement: &Disagreement) -> Vec<EvidenceDeviation> {
        disagreement.because.iter().map(|deviation| self.deviation(deviation)).collect()
    }

    fn deviation(&self, deviation: &Deviation) -> EvidenceDeviation {
        let [first, second] = self.sides;
        let [monitor, evidence] = self.evidence(deviation.evidence);
        let behind = if deviation.leads == Leads::First { second } else { first };
        EvidenceDeviation {
            monitor,
            evidence,
            first: value(first, deviation.first),
            second: value(second, deviation.second),
            follows: deviation.follows.map(|position| cause(behind, position)),
            late: deviation.late(&first.course, &second.course).map(SimTime::seconds),
        }
    }

    fn tolerated(&self, tolerance: &Tolerance) -> Tolerated {
        let breaks = match tolerance.limit {
            Limit::Decision(broken) => Some(BrokenDecision {
                monitor: self.plan.monitor(broken.monitor).name.clone(),
                decision: broken.position,
                recorded: broken.recorded.map(|step| self.step(broken.monitor, step)),
                delayed: broken.delayed.map(|step| self.step(broken.monitor, step)),
            }),
            Limit::None | Limit::GivenUp => None,
        };
        Tolerated {
            delay: (tolerance.delay != SimTime::MAX).then(|| tolerance.delay.seconds()),
            breaks,
            given_up: tolerance.limit == Limit::GivenUp,
        }
    }

    /// The monitor and the name of a piece of evidence.
    fn evidence(&self, id: EvidenceId) -> [String; 2] {
        let (monitor, at) = self.network.owner(id);
        let monitor = self.plan.monitor(monitor);
        [monitor.name.clone(), monitor.evidence[at as usize].name.clone()]
    }

    fn step(&self, monitor: MonitorId, step: Step<State>) -> TimedState {
        TimedState { state: self.state(monitor, step.state), at: step.at.seconds() }
    }

    fn state(&self, monitor: MonitorId, state: State) -> String {
        let state = match state {
            State::Guarantee(at) => MonitorState::Guarantee(at),
            State::Safe => MonitorState::Otherwise,
        };
        self.plan.monitor(monitor).state_name(state).to_owned()
    }
}

fn value(side: &Heard, value: Value) -> EvidenceValue {
    EvidenceValue { value: value.truth.to_string(), since: value.since.map(|position| cause(side, position)) }
}

fn cause(side: &Heard, position: usize) -> EvidenceCause {
    let by = match &side.causes[position] {
        ChangeCause::Message { topic, index } => format!("message {index} on {}", visible(topic)),
        ChangeCause::Held => "held for long enough".to_owned(),
        ChangeCause::Stale => "stale".to_owned(),
    };
    EvidenceCause { at: side.course.evidence[position].at.seconds(), by }
}
