//! Where the declarations of a space are, after others came between them or after they changed places.

use sesame_plan::{
    Activation, FieldRef, Metric, MetricId, MetricSource, Monitor, MonitorId, Operation, OperationId, Requirement,
    RequirementId, Score, TestOperation, TopicId, condition as switch,
};

use super::Case;

/// The new position of each declaration.
#[derive(Debug, Clone, Default)]
pub(crate) struct Places {
    pub(crate) topics: Vec<usize>,
    pub(crate) metrics: Vec<usize>,
    pub(crate) operations: Vec<usize>,
    pub(crate) requirements: Vec<usize>,
    pub(crate) monitors: Vec<usize>,
}

fn number(position: usize) -> u32 {
    u32::try_from(position).unwrap()
}

impl Places {
    /// Lets everything in a case refer to the new positions. The declarations themselves stay where they are.
    pub(crate) fn refer(&self, case: &mut Case) {
        for metric in &mut case.plan.metrics {
            self.metric(metric);
        }
        for requirement in &mut case.plan.requirements {
            self.requirement(requirement);
        }
        for operation in &mut case.plan.operations {
            self.operation(operation);
        }
        for monitor in &mut case.plan.monitors {
            self.monitor(monitor);
        }
        for used in &mut case.test.operations {
            self.used(used);
        }
    }

    fn topic(&self, TopicId(topic): TopicId) -> TopicId {
        TopicId(number(self.topics[topic as usize]))
    }

    fn field(&self, field: &mut FieldRef) {
        field.topic = self.topic(field.topic);
    }

    pub(crate) fn metric(&self, metric: &mut Metric) {
        match &mut metric.source {
            MetricSource::FuzzingTime => {}
            MetricSource::Monitor { monitor, score } => {
                *monitor = MonitorId(number(self.monitors[monitor.index()]));
                match score {
                    Score::MissedHazards { requirement }
                    | Score::ForeseenHazards { requirement }
                    | Score::FalseAlarms { requirement, .. }
                    | Score::LeadTime { requirement } => {
                        *requirement = RequirementId(number(self.requirements[requirement.index()]));
                    }
                    _ => {}
                }
            }
            MetricSource::Hook { topics } => {
                for topic in topics {
                    *topic = self.topic(*topic);
                }
            }
            MetricSource::Last { input } => self.field(input),
            MetricSource::Robustness { robustness } => {
                for input in &mut robustness.inputs {
                    self.field(&mut input.field);
                }
            }
            MetricSource::Formula { formula } => {
                for input in &mut formula.inputs {
                    self.field(&mut input.field);
                }
                if let Some(per) = &mut formula.per {
                    self.field(per);
                }
            }
        }
    }

    fn requirement(&self, requirement: &mut Requirement) {
        requirement.metric = MetricId(number(self.metrics[requirement.metric.index()]));
    }

    pub(crate) fn operation(&self, operation: &mut Operation) {
        operation.topic = operation.topic.map(|topic| self.topic(topic));
    }

    pub(crate) fn monitor(&self, monitor: &mut Monitor) {
        monitor.publishes = monitor.publishes.map(|topic| self.topic(topic));
        for demand in &mut monitor.demands {
            demand.monitor = MonitorId(number(self.monitors[demand.monitor.index()]));
        }
        for input in monitor.evidence.iter_mut().flat_map(|evidence| &mut evidence.inputs) {
            self.field(&mut input.field);
        }
        if let Some(mitigation) = &mut monitor.otherwise.mitigation {
            self.field(&mut mitigation.field);
        }
    }

    pub(crate) fn used(&self, used: &mut TestOperation) {
        used.operation = OperationId(number(self.operations[used.operation.index()]));
        match &mut used.activation {
            Activation::Condition { start, end, .. } => {
                self.condition(start);
                self.condition(end);
            }
            Activation::ConditionFor { start, .. } => self.condition(start),
            Activation::Time { .. } | Activation::Offline => {}
        }
    }

    fn condition(&self, condition: &mut switch::Condition) {
        match condition {
            switch::Condition::Compare { left, right, .. } => {
                for side in [left, right] {
                    if let switch::Operand::Variable(metric) = side {
                        *metric = MetricId(number(self.metrics[metric.index()]));
                    }
                }
            }
            switch::Condition::And(a, b) | switch::Condition::Or(a, b) => {
                self.condition(a);
                self.condition(b);
            }
        }
    }
}

/// Things at their new places.
pub(crate) fn put<T>(places: impl IntoIterator<Item = usize>, things: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all: Vec<(usize, T)> = places.into_iter().zip(things).collect();
    all.sort_by_key(|timed| timed.0);
    all.into_iter().map(|timed| timed.1).collect()
}
