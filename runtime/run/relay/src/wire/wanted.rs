//! What of each message somebody reads: a codec decodes only that.

use std::collections::BTreeMap;

use sesame_plan::{CampaignPlan, FieldRef, Input, MetricSource, OperationKind, Step, TopicId, ValuePath};

/// Which fields of a message are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wanted {
    /// All of them.
    All,
    /// These, each with what of it is read.
    Fields(BTreeMap<String, Wanted>),
}

impl Wanted {
    /// No field at all.
    pub fn nothing() -> Self {
        Wanted::Fields(BTreeMap::new())
    }

    /// Adds the field at the end of a path, with everything in it.
    pub fn add<'a>(&mut self, mut path: impl Iterator<Item = &'a str>) {
        let Wanted::Fields(fields) = self else { return };
        match path.next() {
            None => *self = Wanted::All,
            Some(field) => fields.entry(field.to_owned()).or_insert_with(Wanted::nothing).add(path),
        }
    }
}

/// The fields of a topic's messages that metrics and monitors of the plan read and that its operations change. All of
/// them where the user's code sees the message, where traces are recorded, or where a monitor publishes.
pub fn wanted(plan: &CampaignPlan, topic: TopicId) -> Wanted {
    let seen_whole = plan.campaign.record.is_some()
        || plan
            .metrics
            .iter()
            .any(|metric| matches!(&metric.source, MetricSource::Hook { topics } if topics.contains(&topic)))
        || plan
            .operations
            .iter()
            .any(|operation| operation.topic == Some(topic) && matches!(operation.kind, OperationKind::Custom { .. }))
        || plan.is_published_by_monitor(topic);
    if seen_whole {
        return Wanted::All;
    }
    let mut wanted = Wanted::nothing();
    let mut read = |field: &FieldRef| {
        if field.topic == topic {
            wanted.add(field.path.iter().map(String::as_str));
        }
    };
    for metric in &plan.metrics {
        let inputs: &[Input] = match &metric.source {
            MetricSource::Last { input } => {
                read(input);
                &[]
            }
            MetricSource::Formula { formula } => {
                formula.per.iter().for_each(&mut read);
                &formula.inputs
            }
            MetricSource::Robustness { robustness } => &robustness.inputs,
            MetricSource::Hook { .. } | MetricSource::FuzzingTime | MetricSource::Monitor { .. } => &[],
        };
        for input in inputs {
            read(&input.field);
        }
    }
    for evidence in plan.monitors.iter().flat_map(|monitor| &monitor.evidence) {
        for input in &evidence.inputs {
            read(&input.field);
        }
    }
    for operation in plan.operations.iter().filter(|operation| operation.topic == Some(topic)) {
        for place in &operation.places {
            wanted.add(fields(place));
        }
    }
    wanted
}

/// The fields up to the first list of a path.
fn fields(path: &ValuePath) -> impl Iterator<Item = &str> {
    path.iter().map_while(|step| match step {
        Step::Field(name) => Some(name.as_str()),
        Step::Element(_) | Step::Each => None,
    })
}
