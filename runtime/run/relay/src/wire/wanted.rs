//! What of each message somebody reads: a codec decodes only that.

use std::collections::BTreeMap;

use sesame_plan::{CampaignPlan, FieldRef, Filter, FilterKey, MetricSource, OperationKind, Step, TopicId};

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
            .any(|operation| operation.disturbs(topic) && matches!(operation.kind, OperationKind::Custom { .. }))
        || plan.is_published_by_monitor(topic);
    if seen_whole {
        return Wanted::All;
    }
    let mut wanted = Wanted::nothing();
    let mut read = |field: &FieldRef, steps: &[Step]| {
        if field.topic == topic {
            let path: Vec<&str> = field.path.iter().map(String::as_str).collect();
            add(&mut wanted, &path, steps);
        }
    };
    let evidence = plan.monitors.iter().flat_map(|monitor| &monitor.evidence);
    let of_monitors = evidence.flat_map(|evidence| &evidence.inputs);
    let of_metrics = plan.metrics.iter().flat_map(|metric| match &metric.source {
        MetricSource::Formula { formula } => formula.inputs.as_slice(),
        MetricSource::Robustness { robustness } => &robustness.inputs,
        MetricSource::Last { .. }
        | MetricSource::Hook { .. }
        | MetricSource::FuzzingTime
        | MetricSource::Monitor { .. } => &[],
    });
    for input in of_metrics.chain(of_monitors) {
        read(&input.field, input.list.as_ref().map_or(&[], |list| &list.steps));
    }
    for metric in &plan.metrics {
        match &metric.source {
            MetricSource::Last { input } => read(input, &[]),
            MetricSource::Formula { formula } => formula.per.iter().for_each(|per| read(per, &[])),
            _ => {}
        }
    }
    let targets = plan.operations.iter().filter_map(|operation| operation.target_on(topic));
    for place in targets.flat_map(|(_, target)| target.places) {
        add(&mut wanted, &[], place);
    }
    wanted
}

/// Adds what a path leads to: the fields up to its first list with everything in it, and the list beside it that says
/// which elements are meant.
fn add<'a>(wanted: &mut Wanted, fields: &[&'a str], steps: &'a [Step]) {
    let mut path = fields.to_vec();
    let mut rest = steps;
    while let [Step::Field(name), inner @ ..] = rest {
        path.push(name);
        rest = inner;
    }
    wanted.add(path.iter().copied());
    if let [Step::Filter(Filter { key: FilterKey::Parallel(name), .. }), ..] = rest {
        path.pop();
        wanted.add(path.into_iter().chain([name.as_str()]));
    }
}
