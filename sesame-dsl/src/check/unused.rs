//! Declarations that are never used.

use std::collections::BTreeSet;

use crate::diagnostic::{Code, Diagnostic};
use crate::model::eddi::{Gate, MonitorPart, Score};
use crate::model::{ActivationMode, MetricId, MetricSource, Operation, OperationId, ReadyWhen, Space, TopicId};
use crate::span::FileId;

/// Operations of the file itself that no campaign and no test uses.
pub(super) fn operations(space: &Space, root: FileId, diagnostics: &mut Vec<Diagnostic>) {
    let mut used: BTreeSet<OperationId> = BTreeSet::new();
    for campaign in space.campaigns.values() {
        if let Some(template) = campaign.search.template() {
            used.extend(&template.operations);
        }
    }
    used.extend(space.tests.values().flat_map(|test| &test.operations).map(|operation| operation.operation));
    for (id, operation) in space.operations.iter() {
        let declaration = &operation.declaration;
        if !used.contains(&id) && declaration.span.file == root {
            let title = format!("operation `{}` is never used", declaration.name);
            diagnostics.push(
                Diagnostic::new(Code::UNUSED_OPERATION, declaration.span, title)
                    .label("not used in any campaign or test"),
            );
        }
    }
}

/// Metrics of the file itself that are never measured.
pub(super) fn metrics(space: &Space, root: FileId, diagnostics: &mut Vec<Diagnostic>) {
    let used = used_metrics(space);
    for (id, metric) in space.metrics.iter() {
        let declaration = &metric.declaration;
        if !used.contains(&id) && declaration.span.file == root && !metric.is_of_part() {
            let title = format!("metric `{}` is never measured", declaration.name);
            let diagnostic = Diagnostic::new(Code::UNUSED_METRIC, declaration.span, title)
                .label("not used in any campaign, requirement, condition or expectation");
            diagnostics.push(diagnostic.note("add it to the `observes` of a campaign to measure it"));
        }
    }
}

fn used_metrics(space: &Space) -> BTreeSet<MetricId> {
    let mut used = BTreeSet::new();
    for campaign in space.campaigns.values() {
        used.extend(&campaign.objectives);
        used.extend(&campaign.observed);
        if let Some(template) = campaign.search.template()
            && let ActivationMode::Condition(grown) = &template.activation
        {
            used.extend(grown.variables.iter().map(|variable| variable.metric));
        }
        let mut compared = Vec::new();
        campaign.end_when.iter().for_each(|condition| condition.metrics_into(&mut compared));
        used.extend(compared);
    }
    for activation in space.tests.values().flat_map(|test| &test.operations).map(|operation| &operation.activation) {
        let mut compared = Vec::new();
        activation.conditions().for_each(|condition| condition.metrics_into(&mut compared));
        used.extend(compared);
    }
    used.extend(space.requirements.values().map(|requirement| requirement.metric));
    used.extend(space.tests.values().flat_map(|test| &test.expectations).map(|expectation| expectation.metric));
    for lab in space.physicals.values() {
        lab.metrics_into(&mut used);
    }
    used
}

/// Topics of the file itself that no node publishes or subscribes to and nothing else uses, if there are nodes. An
/// action is used if any of its topics is.
pub(super) fn topics(space: &Space, root: FileId, diagnostics: &mut Vec<Diagnostic>) {
    if space.nodes.is_empty() {
        return;
    }
    let used = used_topics(space);
    let mut actions: BTreeSet<&str> = used.iter().filter_map(|&topic| space.topics[topic].action.as_deref()).collect();
    for (id, topic) in space.topics.iter() {
        let declaration = &topic.declaration;
        if used.contains(&id) || declaration.span.file != root {
            continue;
        }
        let (title, label) = match topic.action.as_deref() {
            // Said once for all of its topics.
            Some(action) if !actions.insert(action) => continue,
            Some(action) => {
                (format!("action `{action}` is never used"), "no node serves or calls it, and nothing else uses it")
            }
            None => (
                format!("topic `{}` is never used", declaration.name),
                "no node publishes or subscribes to it, and nothing else uses it",
            ),
        };
        diagnostics.push(Diagnostic::new(Code::UNUSED_TOPIC, declaration.span, title).label(label));
    }
}

fn used_topics(space: &Space) -> BTreeSet<TopicId> {
    let mut used = BTreeSet::new();
    for node in space.nodes.values() {
        used.extend(node.publishes.iter().chain(&node.subscribes).map(|used| used.topic));
    }
    used.extend(space.operations.values().flat_map(Operation::topics));
    for metric in space.metrics.values() {
        match &metric.source {
            MetricSource::FuzzingTime | MetricSource::Monitor(..) => {}
            MetricSource::Hook(topics) => used.extend(topics),
            MetricSource::Last(input) => used.extend([input.topic]),
            MetricSource::Robustness(robustness) => {
                used.extend(robustness.inputs.iter().map(|input| input.field.topic));
            }
            MetricSource::Formula(formula) => used.extend(formula.inputs.iter().map(|input| input.field.topic)),
        }
    }
    for eddi in space.eddis.values() {
        used.extend(eddi.evidence.iter().flat_map(|evidence| &evidence.inputs).map(|input| input.field.topic));
        used.extend(eddi.otherwise.mitigation.iter().map(|mitigation| mitigation.field.topic));
    }
    used.extend(space.eddis.values().filter_map(|eddi| eddi.publishes));
    let launches = space.nodes.values().filter_map(|node| node.launch.as_ref()).chain(&space.lifecycle.launch);
    used.extend(launches.filter_map(|launch| launch.ready.as_ref()).filter_map(|ready| match ready.when {
        ReadyWhen::Topic(topic) => Some(topic),
        ReadyWhen::Port(_) | ReadyWhen::Clock | ReadyWhen::Line(_) => None,
    }));
    used
}

/// Evidence and demands that no guarantee of their monitor uses, and no metric or condition either.
pub(super) fn evidence(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let used = used_metrics(space);
    for (id, eddi) in space.eddis.iter() {
        let mut gates: Vec<&Gate> = eddi.guarantees.iter().map(|guarantee| &guarantee.gate).collect();
        let mut needed = BTreeSet::new();
        for (_, metric) in space.metrics.iter().filter(|(id, metric)| !metric.is_of_part() || used.contains(id)) {
            match metric.source {
                MetricSource::Monitor(of, Score::Holds { part: MonitorPart::Evidence(at) }) if of == id => {
                    needed.insert((false, at));
                }
                MetricSource::Monitor(of, Score::Holds { part: MonitorPart::Demand(at) }) if of == id => {
                    needed.insert((true, at));
                }
                _ => {}
            }
        }
        while let Some(gate) = gates.pop() {
            match gate {
                Gate::Evidence(at) => {
                    needed.insert((false, *at));
                }
                Gate::Demand(at) => {
                    needed.insert((true, *at));
                }
                Gate::All(_) | Gate::Any(_) | Gate::AtLeast { .. } => gates.extend(gate.parts()),
            }
        }
        let evidence = (0u32..).zip(&eddi.evidence).map(|(at, evidence)| ((false, at), &evidence.declaration));
        let demands = (0u32..).zip(&eddi.demands).map(|(at, demand)| ((true, at), &demand.declaration));
        for (key, declaration) in evidence.chain(demands).filter(|(key, _)| !needed.contains(key)) {
            let what = if key.0 { "demand" } else { "evidence" };
            let title = format!("no guarantee of `{}` uses {what} `{}`", eddi.declaration.name, declaration.name);
            let diagnostic = Diagnostic::new(Code::UNUSED_EVIDENCE, declaration.span, title);
            diagnostics.push(diagnostic.label("the monitor's state does not depend on it"));
        }
    }
}
