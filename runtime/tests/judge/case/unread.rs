//! A case with more in it that nothing reads, which must not change what is said of the case.

use sesame_plan::testing;
use sesame_plan::{
    Metric, MetricSource, Monitor, Operation, OperationId, RequirementId, Side, TestOperation, Topic, TopicId,
};
use sesame_rng::Stream;

use super::Case;
use super::maker::{Maker, Watching};
use super::places::{Places, put};
use crate::robot::{Carries, Line};

/// A case and more that nothing reads.
pub(crate) struct Wider {
    pub(crate) case: Case,
    /// Where the metrics of the narrow one are.
    pub(crate) metrics: Vec<usize>,
    /// Where the operations of its test are.
    pub(crate) used: Vec<usize>,
}

/// What is added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Added {
    /// Topics with messages, and metrics.
    Metrics,
    /// Monitors with their scores, and operations with uses in the test, too.
    All,
}

/// Declarations that are added. They refer to topics, metrics and operations by the positions that these have once
/// everything that is added follows everything that is there.
#[derive(Default)]
struct Additions {
    topics: Vec<Topic>,
    carries: Vec<Carries>,
    lines: Vec<Line>,
    metrics: Vec<Metric>,
    monitors: Vec<Monitor>,
    operations: Vec<Operation>,
    used: Vec<TestOperation>,
}

impl Case {
    /// The same case with more that nothing reads, before, between and behind its own.
    pub(crate) fn with_unread(&self, added: Added) -> Wider {
        let stream = Stream::derive(self.number, "unread", &[]);
        let mut maker = Maker { stream, carries: Vec::new(), topics: Vec::new() };
        let mut more = self.unread(&mut maker);
        if added == Added::All {
            self.monitored(&mut maker, &mut more);
            self.operated(&mut maker, &mut more);
        }
        for (metric, at) in more.metrics.iter_mut().zip(0..) {
            metric.name = format!("unread{at}");
        }
        let mut woven = |old: usize, new: usize| {
            let (old, new) = maker.places(old, new);
            [old, new].concat()
        };
        let places = Places {
            topics: woven(self.plan.topics.len(), more.topics.len()),
            metrics: woven(self.plan.metrics.len(), more.metrics.len()),
            operations: woven(self.plan.operations.len(), more.operations.len()),
            requirements: (0..self.plan.requirements.len()).collect(),
            monitors: (0..more.monitors.len()).collect(),
        };
        let lines = woven(self.script.lines.len(), more.lines.len());
        let used = woven(self.test.operations.len(), more.used.len());
        let mut case = self.clone();
        case.plan.topics.extend(more.topics);
        case.carries.extend(more.carries);
        case.script.lines.extend(more.lines);
        case.plan.metrics.extend(more.metrics);
        case.plan.monitors.extend(more.monitors);
        case.plan.operations.extend(more.operations);
        case.test.operations.extend(more.used);
        places.refer(&mut case);
        for blank in &mut case.script.blanks {
            blank.line = lines[blank.line];
        }
        case.plan.topics = put(places.topics.clone(), case.plan.topics);
        case.carries = put(places.topics, case.carries);
        case.plan.metrics = put(places.metrics.clone(), case.plan.metrics);
        case.plan.operations = put(places.operations, case.plan.operations);
        case.test.operations = put(used.clone(), case.test.operations);
        case.script.lines = put(lines, case.script.lines);
        let first = |all: Vec<usize>, count: usize| all.into_iter().take(count).collect();
        Wider {
            case,
            metrics: first(places.metrics, self.plan.metrics.len()),
            used: first(used, self.test.operations.len()),
        }
    }

    /// Topics with messages, metrics of them, and further metrics of the topics that are there.
    fn unread(&self, maker: &mut Maker) -> Additions {
        let mut lines = maker.topics();
        for (line, at) in lines.iter_mut().zip(0..) {
            line.path = format!("unread/{at}");
            line.moves = false;
        }
        let mut paths = lines.iter().map(|line| line.path.clone());
        for (topic, at) in maker.topics.iter_mut().zip(0..) {
            topic.name = format!("unread{at}");
            for path in &mut topic.paths {
                *path = paths.next().unwrap();
            }
        }
        let undeclared = maker.line("unread/undeclared".to_owned(), Carries::Real);
        lines.push(Line { moves: false, ..undeclared });
        let mut metrics = maker.metrics().0;
        let places = self.behind(maker.topics.len());
        for metric in &mut metrics {
            places.metric(metric);
        }
        // What is delivered on the topics that are there was not heard by these metrics before.
        let (carries, topics) = (self.carries.clone(), self.plan.topics.clone());
        let readers = Maker { stream: maker.stream.clone(), carries, topics }.metrics().0;
        metrics.extend(readers.into_iter().filter(|metric| match &metric.source {
            MetricSource::Formula { formula } => formula.side == Side::Inbound,
            MetricSource::Robustness { robustness } => robustness.side == Side::Inbound,
            _ => true,
        }));
        metrics.retain(|metric| !matches!(metric.source, MetricSource::Hook { .. }));
        let (topics, carries) = (maker.topics.clone(), maker.carries.clone());
        Additions { topics, carries, lines, metrics, ..Additions::default() }
    }

    /// Monitors of topics that are added, which send mitigation there, and of topics that are there, as they are
    /// published: so no more of what is delivered is heard than before.
    fn monitored(&self, maker: &mut Maker, more: &mut Additions) {
        let own = more.topics.len();
        let ids: Vec<TopicId> = (own..own + 2).map(|at| TopicId(u32::try_from(at).unwrap())).collect();
        let carries_number = |&at: &usize| more.carries[at] == Carries::Real && more.topics[at].paths.len() == 1;
        let mitigated = (0..own).find(carries_number).map(|at| TopicId(u32::try_from(at).unwrap()));
        let mut monitors = maker.monitors(&ids, Watching { side: None, one_wire: false, mitigated });
        let places = Places { monitors: (0..2).collect(), ..self.behind(own + 2) };
        for monitor in &mut monitors {
            places.monitor(monitor);
        }
        let (carries, topics) = (self.carries.clone(), self.plan.topics.clone());
        let inbound = Watching { side: Some(Side::Inbound), one_wire: false, mitigated: None };
        let mut reader = Maker { stream: maker.stream.clone(), carries, topics };
        let before = u32::try_from(monitors.len()).unwrap();
        for mut monitor in reader.monitors(&ids, inbound) {
            for demand in &mut monitor.demands {
                demand.monitor.0 += before;
            }
            monitors.push(monitor);
        }
        for (monitor, at) in monitors.iter_mut().zip(0..) {
            monitor.name = format!("monitor{at}");
            monitor.publishes = Some(TopicId(u32::try_from(self.plan.topics.len() + own + at).unwrap()));
            let path = format!("unread/state/{at}");
            more.topics.push(testing::topic(&format!("unread_state{at}"), &[&path], Maker::state_type(at)));
            more.carries.push(if at.is_multiple_of(2) { Carries::Bool } else { Carries::Int });
        }
        let requirements = self.plan.requirements.len();
        for at in 0..u32::try_from(monitors.len()).unwrap() {
            let requirement =
                (requirements > 0).then(|| RequirementId(u32::try_from(maker.stream.below(requirements)).unwrap()));
            more.metrics.extend(maker.scores(at, requirement));
        }
        more.monitors = monitors;
    }

    /// Operations on the topics that are added, switched by time or by any metric. Their time does not count.
    fn operated(&self, maker: &mut Maker, more: &mut Additions) {
        let end = self.plan.campaign.end_after;
        let places = self.behind(more.topics.len());
        let by_condition = maker.chance(0.7);
        let metrics: Vec<Metric> = self.plan.metrics.iter().chain(&more.metrics).cloned().collect();
        let topics = maker.topics.len();
        for at in 0..maker.between(1, 2) {
            let topic = maker.stream.below(topics);
            let mut operation = maker.operation(at, topic, end);
            let id = self.plan.operations.len() + more.operations.len();
            let id = OperationId(u32::try_from(id).unwrap());
            more.used.push(maker.instance(id, &operation, end, by_condition, &metrics));
            operation.name = format!("unread{at}");
            operation.timed = false;
            places.operation(&mut operation);
            more.operations.push(operation);
        }
    }

    /// Where the added topics are, so many of them, if they follow those that are there.
    fn behind(&self, topics: usize) -> Places {
        let first = self.plan.topics.len();
        Places { topics: (first..first + topics).collect(), ..Places::default() }
    }
}
