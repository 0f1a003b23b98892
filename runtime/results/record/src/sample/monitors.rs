//! Two monitors for the made-up campaign, and what they make of its tests.

use std::sync::Arc;

use sesame_base::observation::{
    ChangeCause, EvidenceChange, MetricObservation, MonitorDecision, MonitorHazard, MonitorObservation, Observation,
};
use sesame_base::time::SimTime;
use sesame_base::verdict::violation_spans;
use sesame_monitor::compare::Step;
use sesame_monitor::score::scorer;
use sesame_monitor::{Changes, EvidenceId, Network, Reading, Run, State, Truth};
use sesame_plan::testing::{demand, evidence_above, guarantee, monitor, score, topic};
use sesame_plan::{
    CampaignPlan, Evidence, FieldRef, Gate, MetricSource, Mitigation, MitigationValue, Monitor, MonitorId,
    OperationKind, RequirementId, SafeState, Score, Stale, StaleIs, Test, TopicId, Type,
};

use super::window;

/// Seconds between two messages of a topic, and after which a disturbance is noticed.
const PERIOD: f64 = 0.5;
const LAG: f64 = 0.8;

/// The [plan](super::plan) with a monitor `transport`, which relies on `perception`. It is to foresee the hazards of
/// the first requirement, and does not hear the second link.
pub fn monitored_plan() -> CampaignPlan {
    let mut plan = super::plan();
    let of = Type::Int { unit: None };
    plan.topics.push(topic("transport_state", &["eddi/transport"], of.clone()));
    plan.topics.push(topic("perception_state", &["eddi/perception"], of));
    plan.topics.push(topic("stop", &["plc/stop"], Type::Bool));
    let safe = |name: &str, mitigation| SafeState { name: name.to_owned(), doc: String::new(), mitigation };
    let stop =
        Mitigation { field: FieldRef { topic: TopicId(5), path: Vec::new() }, value: MitigationValue::Bool(true) };
    let guarantees = vec![
        guarantee("fast", 3, Gate::All(vec![Gate::Evidence(0), Gate::Demand(0)])),
        guarantee("slowly", 1, Gate::All(vec![Gate::Evidence(0), Gate::Evidence(1)])),
    ];
    let evidence =
        vec![Evidence { held: 1.0, ..evidence_above("brakes_ok", 0, -3.0) }, evidence_above("zone_is_clear", 2, 0.5)];
    let transport = Monitor {
        doc: "Whether parts may be carried between the stations.".to_owned(),
        demands: vec![demand("redundant", 1, 0)],
        otherwise: safe("cannot_transport", Some(stop)),
        ..monitor("transport", 3, evidence, guarantees)
    };
    let two = Gate::AtLeast { count: 2, of: (0..3).map(Gate::Evidence).collect() };
    let guarantees =
        vec![guarantee("redundant", 2, two), guarantee("single", 1, Gate::Any((0..3).map(Gate::Evidence).collect()))];
    let stale = Some(Stale { after: 1.0, is: StaleIs::Unknown, all: false });
    let evidence = vec![
        evidence_above("left", 0, 0.1),
        Evidence { stale, ..evidence_above("right", 1, 0.1) },
        evidence_above("radar", 2, 0.1),
    ];
    let perception = Monitor { otherwise: safe("blind", None), ..monitor("perception", 4, evidence, guarantees) };
    plan.monitors = vec![transport, perception];
    let requirement = RequirementId(0);
    plan.metrics.push(score("missed", 0, Score::MissedHazards { requirement }));
    plan.metrics.push(score("alarms", 0, Score::FalseAlarms { requirement, within: Some(5.0) }));
    plan
}

/// The plan after its certificate was mended: it needs both links, which `perception` hears.
pub fn mended_plan() -> CampaignPlan {
    let mut plan = monitored_plan();
    let transport = &mut plan.monitors[0];
    transport.evidence.push(evidence_above("arms_ok", 1, -3.0));
    for guarantee in &mut transport.guarantees {
        let Gate::All(parts) = &mut guarantee.gate else { continue };
        parts.push(Gate::Evidence(2));
    }
    plan
}

/// Adds what the monitors of a plan make of a test, and the values of metrics that score them.
pub(super) fn watch(plan: &CampaignPlan, test: &Test, observation: &mut Observation) {
    if plan.monitors.is_empty() {
        return;
    }
    let Ok(network) = Network::new(&plan.monitors) else { return };
    observation.metrics.truncate(5);
    let mut shown = run(plan, test, &Arc::new(network), observation.end);
    for (monitor, requirement) in plan.hazards_to_foresee() {
        let declared = plan.requirement(requirement);
        let series = observation.metrics.get(declared.metric.index()).map_or(&[][..], |shown| &shown.series);
        let spans = violation_spans(series, declared.bound, observation.end);
        let hazards: Vec<(u32, SimTime)> =
            spans.first().map(|span| (requirement.0, SimTime::from_seconds(span.start))).into_iter().collect();
        let shown = &mut shown[monitor.index()];
        let steps: Vec<Step<State>> = shown
            .decisions
            .iter()
            .map(|decision| Step { at: SimTime::from_seconds(decision.time), state: decision.state.into() })
            .collect();
        let judged = scorer(9, None, &steps, &hazards).end(SimTime::from_seconds(observation.end));
        shown.hazards.extend(judged.hazards.iter().map(|hazard| MonitorHazard {
            requirement,
            time: hazard.at.seconds(),
            lead: hazard.lead.map(SimTime::seconds),
        }));
    }
    for metric in plan.metrics.iter().skip(5) {
        let MetricSource::Monitor { monitor, score } = metric.source else { continue };
        let hazards = &shown[monitor.index()].hazards;
        let missed = hazards.iter().filter(|hazard| hazard.lead.is_none()).count();
        let value = if matches!(score, Score::MissedHazards { .. }) { missed as f64 } else { 0.0 };
        observation.metrics.push(MetricObservation::whole(Some(value), true, Vec::new()));
    }
    observation.monitors = shown;
}

fn run(plan: &CampaignPlan, test: &Test, network: &Arc<Network>, end: f64) -> Vec<MonitorObservation> {
    let mut shown = vec![MonitorObservation::default(); plan.monitors.len()];
    let mut changes = Changes::default();
    let mut run = Run::start(Arc::clone(network), &mut changes);
    take(&mut shown, network, &mut changes, None);
    let on = |topic: usize, time: f64, kind: &dyn Fn(&OperationKind) -> bool, lag: f64| {
        test.operations.iter().any(|used| {
            let (start, end) = window(used);
            let operation = plan.operation(used.operation);
            let of_topic = operation.topics().any(|own| own.index() == topic);
            of_topic && kind(&operation.kind) && start + lag <= time && time < end + lag
        })
    };
    let mut tick = 0_u64;
    loop {
        let time = tick as f64 * PERIOD;
        if time >= end {
            return shown;
        }
        let now = SimTime::from_seconds(time);
        run.advance(now, &mut changes);
        take(&mut shown, network, &mut changes, None);
        for (topic, declared) in plan.topics.iter().enumerate() {
            if on(topic, time, &|kind| *kind == OperationKind::Blackhole, 0.0) {
                continue;
            }
            let truth = Truth::from(!on(topic, time, &|_| true, LAG));
            let ids = (0..).map(EvidenceId).take(network.evidence_count());
            let reads = |id: &EvidenceId| {
                let (monitor, at) = network.owner(*id);
                let inputs = &plan.monitor(monitor).evidence[at as usize].inputs;
                inputs.iter().any(|input| input.field.topic.index() == topic)
            };
            let heard: Vec<Reading> = ids.filter(reads).map(|id| Reading::now(now, id, truth)).collect();
            run.observe(now, &heard, &mut changes);
            let message = ChangeCause::Message { topic: declared.paths[0].clone(), index: tick };
            take(&mut shown, network, &mut changes, Some(&message));
        }
        tick += 1;
    }
}

fn take(shown: &mut [MonitorObservation], network: &Network, changes: &mut Changes, message: Option<&ChangeCause>) {
    for change in &changes.evidence {
        let (MonitorId(monitor), evidence) = network.owner(change.evidence);
        let holds = match change.truth {
            Truth::Unknown => None,
            known => Some(known.holds()),
        };
        let own = if holds == Some(true) { ChangeCause::Held } else { ChangeCause::Stale };
        let cause = message.cloned().unwrap_or(own);
        shown[monitor as usize].evidence.push(EvidenceChange { time: change.at.seconds(), evidence, holds, cause });
    }
    for decision in &changes.decisions {
        let time = decision.at.seconds();
        shown[decision.monitor.index()].decisions.push(MonitorDecision { time, state: decision.state.into() });
    }
    changes.clear();
}
