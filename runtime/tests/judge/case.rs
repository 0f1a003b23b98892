//! Cases: a space, a test and a robot, made of a number and of nothing else.

mod maker;
mod monitored;
pub(crate) mod places;
mod unread;

use sesame_plan::{
    Activation, CampaignPlan, Input, Metric, MetricId, MetricSource, Side, Test, TopicId, condition as switch,
};
use sesame_rng::Stream;

use self::maker::Maker;
pub(crate) use self::unread::Added;
use crate::robot::{Carries, Script};

/// A space with a test and a robot.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) number: u64,
    pub(crate) plan: CampaignPlan,
    pub(crate) test: Test,
    pub(crate) script: Script,
    pub(crate) carries: Vec<Carries>,
}

impl Case {
    /// The case of a number.
    pub(crate) fn of(number: u64) -> Case {
        let mut maker = Maker { stream: Stream::derive(number, "judge", &[]), carries: Vec::new(), topics: Vec::new() };
        maker.case(number)
    }

    /// The robot without its faults.
    pub(crate) fn truth(&self) -> Script {
        Script { crash: None, blanks: Vec::new(), ..self.script.clone() }
    }

    /// Whether the robot never fails and always knows its numbers.
    pub(crate) fn behaves(&self) -> bool {
        self.script.crash.is_none() && self.script.blanks.is_empty()
    }

    /// Whether somebody hears what is delivered on a wire: the robot, or a metric.
    pub(crate) fn is_heard(&self, path: &str) -> bool {
        let subscribed = self.script.lines.iter().any(|line| line.path == path && line.subscribed);
        let measured = |metric: &Metric| {
            let of =
                |inputs: &[Input], side| side == Side::Outbound && inputs.iter().any(|input| self.is_on(input, path));
            match &metric.source {
                MetricSource::Formula { formula } => of(&formula.inputs, formula.side),
                MetricSource::Robustness { robustness } => of(&robustness.inputs, robustness.side),
                _ => false,
            }
        };
        subscribed || self.plan.metrics.iter().any(measured)
    }

    fn is_on(&self, input: &Input, path: &str) -> bool {
        self.plan.topic(input.field.topic).paths.iter().any(|of| of == path)
    }
}

/// The metrics that switch an operation.
pub(crate) fn variables(activation: &Activation) -> Vec<MetricId> {
    fn of(condition: &switch::Condition, found: &mut Vec<MetricId>) {
        match condition {
            switch::Condition::Compare { left, right, .. } => {
                for side in [left, right] {
                    if let switch::Operand::Variable(metric) = side {
                        found.push(*metric);
                    }
                }
            }
            switch::Condition::And(a, b) | switch::Condition::Or(a, b) => {
                of(a, found);
                of(b, found);
            }
        }
    }
    let mut found = Vec::new();
    match activation {
        Activation::Condition { start, end, .. } => {
            of(start, &mut found);
            of(end, &mut found);
        }
        Activation::ConditionFor { start, .. } => of(start, &mut found),
        Activation::Time { .. } | Activation::Offline => {}
    }
    found
}

/// The topics that a metric hears.
pub(crate) fn topics_of(metric: &Metric) -> Vec<TopicId> {
    match &metric.source {
        MetricSource::Hook { topics } => topics.clone(),
        MetricSource::FuzzingTime | MetricSource::Monitor { .. } => Vec::new(),
        MetricSource::Last { input } => vec![input.topic],
        MetricSource::Robustness { robustness } => robustness.inputs.iter().map(|input| input.field.topic).collect(),
        MetricSource::Formula { formula } => formula.inputs.iter().map(|input| input.field.topic).collect(),
    }
}
