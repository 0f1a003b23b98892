//! A case with more in it that nothing reads, which must not change what is said of the case.

use sesame_plan::{Activation, FieldRef, MetricId, MetricSource, Side, TopicId, condition as switch};
use sesame_rng::Stream;

use super::Case;
use super::maker::Maker;
use crate::robot::{Carries, Line};

/// A case and more that nothing reads.
pub(crate) struct Wider {
    pub(crate) case: Case,
    /// Where the metrics of the narrow one are.
    pub(crate) metrics: Vec<usize>,
}

impl Case {
    /// The same case with topics, metrics and messages that nothing reads, before, between and behind its own.
    pub(crate) fn with_unread(&self) -> Wider {
        let stream = Stream::derive(self.number, "unread", &[]);
        let mut maker = Maker { stream, carries: Vec::new(), topics: Vec::new() };
        let mut lines = maker.topics();
        for (line, at) in lines.iter_mut().zip(0..) {
            line.path = format!("unread/{at}");
            line.moves = false;
        }
        let mut paths = lines.iter().map(|line| line.path.clone());
        for (topic, at) in maker.topics.iter_mut().zip(0..) {
            topic.name = format!("unread{at}");
            topic.paths.iter_mut().for_each(|path| *path = paths.next().unwrap());
        }
        let undeclared = maker.line("unread/undeclared".to_owned(), Carries::Real);
        lines.push(Line { moves: false, ..undeclared });
        let mut unread = maker.metrics().0;
        // Further metrics of the topics that are read; what is delivered there was not heard by them before.
        let (carries, topics) = (self.carries.clone(), self.plan.topics.clone());
        let mut reader = Maker { stream: maker.stream.clone(), carries, topics };
        let readers = reader.metrics().0;
        unread.retain(|metric| !matches!(metric.source, MetricSource::Hook { .. }));
        let own = unread.len();
        unread.extend(readers.into_iter().filter(|metric| match &metric.source {
            MetricSource::Hook { .. } => false,
            MetricSource::Formula { formula } => formula.side == Side::Inbound,
            MetricSource::Robustness { robustness } => robustness.side == Side::Inbound,
            _ => true,
        }));
        for (metric, at) in unread.iter_mut().zip(0..) {
            metric.name = format!("unread{at}");
        }
        let topics = maker.places(self.plan.topics.len(), maker.topics.len());
        let metrics = maker.places(self.plan.metrics.len(), unread.len());
        let places = maker.places(self.script.lines.len(), lines.len());
        let topic = |old: TopicId| TopicId(u32::try_from(topics.0[old.index()]).unwrap());
        let new_topic = |old: TopicId| TopicId(u32::try_from(topics.1[old.index()]).unwrap());
        let metric = |old: MetricId| MetricId(u32::try_from(metrics.0[old.index()]).unwrap());
        let mut case = self.clone();
        for metric in &mut case.plan.metrics {
            move_topics(&mut metric.source, &topic);
        }
        for (at, metric) in unread.iter_mut().enumerate() {
            if at < own { move_topics(&mut metric.source, &new_topic) } else { move_topics(&mut metric.source, &topic) }
        }
        for operation in &mut case.plan.operations {
            operation.topic = operation.topic.map(topic);
        }
        for requirement in &mut case.plan.requirements {
            requirement.metric = metric(requirement.metric);
        }
        for used in &mut case.test.operations {
            match &mut used.activation {
                Activation::Condition { start, end, .. } => {
                    move_metrics(start, &metric);
                    move_metrics(end, &metric);
                }
                Activation::ConditionFor { start, .. } => move_metrics(start, &metric),
                Activation::Time { .. } | Activation::Offline => {}
            }
        }
        for blank in &mut case.script.blanks {
            blank.line = places.0[blank.line];
        }
        case.plan.topics = woven(&topics, case.plan.topics, maker.topics.clone());
        case.carries = woven(&topics, case.carries, maker.carries.clone());
        case.plan.metrics = woven(&metrics, case.plan.metrics, unread);
        case.script.lines = woven(&places, case.script.lines, lines);
        Wider { case, metrics: metrics.0 }
    }
}

fn move_topics(source: &mut MetricSource, to: &impl Fn(TopicId) -> TopicId) {
    let one = |field: &mut FieldRef| field.topic = to(field.topic);
    match source {
        MetricSource::FuzzingTime | MetricSource::Monitor { .. } => {}
        MetricSource::Hook { topics } => topics.iter_mut().for_each(|topic| *topic = to(*topic)),
        MetricSource::Last { input } => one(input),
        MetricSource::Robustness { robustness } => robustness.inputs.iter_mut().for_each(|it| one(&mut it.field)),
        MetricSource::Formula { formula } => {
            formula.inputs.iter_mut().for_each(|it| one(&mut it.field));
            formula.per.iter_mut().for_each(one);
        }
    }
}

fn move_metrics(condition: &mut switch::Condition, to: &impl Fn(MetricId) -> MetricId) {
    match condition {
        switch::Condition::Compare { left, right, .. } => {
            for side in [left, right] {
                if let switch::Operand::Variable(metric) = side {
                    *metric = to(*metric);
                }
            }
        }
        switch::Condition::And(a, b) | switch::Condition::Or(a, b) => {
            move_metrics(a, to);
            move_metrics(b, to);
        }
    }
}

/// Old things and new ones at their places.
fn woven<T>(places: &(Vec<usize>, Vec<usize>), old: Vec<T>, new: Vec<T>) -> Vec<T> {
    let mut all: Vec<(usize, T)> = places.0.iter().copied().zip(old).chain(places.1.iter().copied().zip(new)).collect();
    all.sort_by_key(|it| it.0);
    all.into_iter().map(|it| it.1).collect()
}
