//! What the monitors of a test did.

use std::collections::BTreeMap;

use serde::Serialize;

use sesame_base::observation::{ChangeCause, MonitorDecision, MonitorHazard, MonitorObservation, Observation};
use sesame_base::time::SimTime;
use sesame_monitor::compare::Step;
use sesame_monitor::score::scorer;
use sesame_monitor::why::{Depth, Why, why_state};
use sesame_monitor::{State, Truth};
use sesame_notation as notation;
use sesame_plan::{CampaignPlan, MonitorId};
use sesame_present::number::join_words;

use crate::facts::certificate::history::History;
use crate::facts::certificate::why::{WhyReport, cause_text, explained, named, word};

/// What a monitor did in a test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorReport {
    /// Its name.
    pub monitor: String,
    /// Whether it is a part of the system, which the runner only observes.
    pub external: bool,
    /// Its states, the strongest first; the last one is the safe state.
    pub states: Vec<StateReport>,
    /// How often its state changed.
    pub changes: u32,
    /// How often a guarantee was lost and none was left.
    pub alarms: u32,
    /// The shortest stay in a state that ended, in seconds.
    pub shortest_stay: Option<f64>,
    /// The hazards that it should foresee.
    pub hazards: Vec<HazardReport>,
    /// Its decisions, in order of time.
    pub decisions: Vec<DecisionReport>,
    /// Its evidence, in order of declaration.
    pub evidence: Vec<EvidenceReport>,
    /// How many later decisions and changes of evidence are left out because a run had too many.
    pub omitted: u64,
}

/// A state of a monitor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateReport {
    /// Its name.
    pub state: String,
    /// Its integrity; 0 for the safe state.
    pub integrity: u32,
    /// The time that the monitor spent in it, in seconds.
    pub time: f64,
}

/// The first violation of a requirement in a test, and what a monitor made of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HazardReport {
    /// The requirement.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// When, in seconds.
    pub at: f64,
    /// Whether the monitor had been in its safe state before.
    pub foreseen: bool,
    /// Whether it went into its safe state in the same instant.
    pub detected: bool,
    /// For how long it had been in its safe state, in seconds; `None` if it was not.
    pub lead: Option<f64>,
}

/// A decision of a monitor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecisionReport {
    /// When, in seconds.
    pub at: f64,
    /// Until when it was in this state, in seconds.
    pub until: f64,
    /// The state from then on.
    pub state: String,
    /// Its integrity; 0 for the safe state.
    pub integrity: u32,
    /// The mitigation that was sent, as in `drive.speed = 0m/s`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mitigation: Option<String>,
    /// What changed the evidence that led to it; `None` for the decision at time zero.
    pub cause: Option<ChangeCause>,
    /// The evidence that changed then, with the monitor's name before a dot.
    pub changed: Vec<String>,
    /// Why no stronger guarantee held, and why this one did, the strongest first.
    pub why: Vec<WhyReport>,
}

/// A piece of evidence in a test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvidenceReport {
    /// Its name.
    pub evidence: String,
    /// Its condition, as in `gap > 0.5m held 0.3s`.
    pub condition: String,
    /// When its value changed; before that it is unknown.
    pub changes: Vec<ChangeReport>,
}

/// A change of evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangeReport {
    /// When, in seconds.
    pub at: f64,
    /// The value from then on: `true`, `false` or `unknown`.
    pub is: String,
    /// What made it so.
    pub cause: ChangeCause,
}

impl MonitorReport {
    /// The hazards at which it was not in its safe state.
    pub fn missed(&self) -> impl Iterator<Item = &HazardReport> {
        self.hazards.iter().filter(|hazard| hazard.is_missed())
    }
}

impl HazardReport {
    /// Whether the monitor was not in its safe state.
    pub fn is_missed(&self) -> bool {
        self.lead.is_none()
    }
}

impl DecisionReport {
    /// Why, in sentences: why this state's guarantee holds, and why no stronger one does.
    pub(crate) fn reason(&self) -> String {
        let (own, stronger): (Vec<&WhyReport>, Vec<&WhyReport>) = self.why.iter().partition(|why| why.holds == "true");
        own.into_iter().chain(stronger).map(|why| why.sentence.as_str()).collect::<Vec<_>>().join("; ")
    }

    /// What led to it, in words: a message, or the evidence that changed without one.
    pub(crate) fn cause_text(&self) -> String {
        let names = join_words(&self.changed.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>());
        match &self.cause {
            Some(ChangeCause::Held) => format!("{names} held for long enough"),
            Some(ChangeCause::Stale) => format!("silence about {names}"),
            Some(cause) => cause_text(cause),
            None => "the beginning".to_owned(),
        }
    }

    /// Whether it is the safe state.
    pub(crate) fn is_safe(&self) -> bool {
        self.integrity == 0
    }
}

/// What the monitors of a plan did in a run; nothing if that is not known.
pub(crate) fn monitors(plan: &CampaignPlan, observation: &Observation) -> Vec<MonitorReport> {
    let shown = &observation.monitors;
    let mut reasons = reasons(plan, shown);
    let reports = (0..).map(MonitorId).zip(plan.monitors.iter().zip(shown)).map(|(id, (monitor, shown))| {
        let MonitorObservation { decisions, evidence, hazards, omitted } = shown;
        let end = observation.end;
        let steps: Vec<Step<State>> = decisions
            .iter()
            .map(|decision| Step { at: SimTime::from_seconds(decision.time), state: State::from(decision.state) })
            .collect();
        let guarantees = u32::try_from(monitor.guarantees.len()).unwrap_or(u32::MAX);
        let score = scorer(guarantees, None, &steps, &[]).so_far(SimTime::from_seconds(end));
        let states = (0..guarantees).map(State::Guarantee).chain([State::Safe]).zip(&score.time_in);
        let states = states.map(|(state, time)| {
            let (state, integrity) = named(monitor, state);
            StateReport { state: state.to_owned(), integrity, time: time.seconds() }
        });
        let decided = decisions.iter().enumerate().map(|(at, decision)| {
            let (state, integrity) = named(monitor, decision.state.into());
            let mitigation = monitor.otherwise.mitigation.as_ref().filter(|_| integrity == 0 && at > 0);
            let Reason { cause, changed, why } = reasons.remove(&(id, at)).unwrap_or_default();
            DecisionReport {
                at: decision.time,
                until: decisions.get(at + 1).map_or(end, |next| next.time),
                state: state.to_owned(),
                integrity,
                mitigation: mitigation.map(|mitigation| notation::mitigation(plan, mitigation)),
                cause,
                changed,
                why,
            }
        });
        MonitorReport {
            monitor: monitor.name.clone(),
            external: monitor.publishes.is_none(),
            states: states.collect(),
            changes: score.changes,
            alarms: score.mitigations,
            shortest_stay: score.shortest_stay.map(SimTime::seconds),
            hazards: hazards.iter().map(|hazard| hazard_report(plan, hazard)).collect(),
            decisions: decided.collect(),
            evidence: monitor
                .evidence
                .iter()
                .zip(0..)
                .map(|(declared, at)| EvidenceReport {
                    evidence: declared.name.clone(),
                    condition: notation::evidence(plan, declared),
                    changes: evidence
                        .iter()
                        .filter(|change| change.evidence == at)
                        .map(|change| ChangeReport {
                            at: change.time,
                            is: word(change.holds),
                            cause: change.cause.clone(),
                        })
                        .collect(),
                })
                .collect(),
            omitted: *omitted,
        }
    });
    reports.collect()
}

fn hazard_report(plan: &CampaignPlan, hazard: &MonitorHazard) -> HazardReport {
    let requirement = plan.requirement(hazard.requirement);
    HazardReport {
        requirement: requirement.name.clone(),
        text: requirement.text.clone(),
        at: hazard.time,
        foreseen: hazard.lead.is_some_and(|lead| lead > 0.0),
        detected: hazard.lead == Some(0.0),
        lead: hazard.lead,
    }
}

/// What caused a decision, and why it was made.
#[derive(Default)]
struct Reason {
    cause: Option<ChangeCause>,
    changed: Vec<String>,
    why: Vec<WhyReport>,
}

/// The reason of each decision, by monitor and position.
fn reasons(plan: &CampaignPlan, shown: &[MonitorObservation]) -> BTreeMap<(MonitorId, usize), Reason> {
    let mut reasons = BTreeMap::new();
    let Some(history) = History::new(plan, shown) else { return reasons };
    let mut places = vec![0; shown.len()];
    // Certificates come to the same few moments again and again.
    let mut known: BTreeMap<(MonitorId, Vec<Truth>), Vec<Why>> = BTreeMap::new();
    history.play(|event, values| {
        let time = event.map_or(SimTime::ZERO, |event| event.time);
        let mut moment = None;
        for ((id, shown), place) in (0..).map(MonitorId).zip(shown).zip(&mut places) {
            let waiting = &shown.decisions[*place..];
            // What was decided for no reason that is recorded has none.
            *place += waiting.iter().take_while(|decision| SimTime::from_seconds(decision.time) < time).count();
            let of_now = |decision: &&MonitorDecision| SimTime::from_seconds(decision.time) == time;
            let Some(decision) = shown.decisions.get(*place).filter(of_now) else { continue };
            let moment = moment.get_or_insert_with(|| values.moment());
            if moment.state(id) != State::from(decision.state) {
                continue;
            }
            let whys = known.entry((id, values.truths.clone()));
            let whys = whys.or_insert_with(|| why_state(moment, id, Depth::Evidence));
            let why = whys.iter().map(|why| explained(why, values)).collect();
            let changed = event.into_iter().flat_map(|event| history.changes(event)).map(|(monitor, change)| {
                let monitor = plan.monitor(monitor);
                format!("{}.{}", monitor.name, monitor.evidence[change.evidence as usize].name)
            });
            let cause = event.map(|event| history.cause(event).clone());
            reasons.insert((id, *place), Reason { cause, changed: changed.collect(), why });
            *place += 1;
        }
    });
    reasons
}
