//! Random metrics, with their formulas, and requirements on them.

use sesame_plan::stl::{self, Interval, Robustness};
use sesame_plan::testing;
use sesame_plan::{
    Aggregate, Bound, Comparison, Condition, Expression, FieldRef, Formula, Input, Members, Metric, MetricSource,
    Requirement, Side, TopicId,
};

use super::Maker;
use crate::adapter;
use crate::hooks::HookKind;
use crate::robot::Carries;

impl Maker {
    /// Something that a formula hears: a number, or true and false.
    fn input(&mut self, topic: usize, truth: bool) -> Option<Input> {
        let path: Option<&[&str]> = match (self.carries[topic], truth) {
            (Carries::Real | Carries::Int, false) | (Carries::Bool, true) => Some(&[]),
            (Carries::Zone, false) => Some(if self.chance(0.7) { &["level"] } else { &["count"] }),
            (Carries::Zone, true) => Some(&["inside"]),
            _ => None,
        };
        let group = self.topics[topic].paths.len() > 1;
        let members = match (group, truth) {
            (false, _) => Members::Min,
            (true, true) => self.one(&[Members::Min, Members::Max, Members::Each]),
            (true, false) => self.one(&[Members::Min, Members::Max, Members::Sum, Members::Each]),
        };
        let path: Vec<String> = path?.iter().map(|&name| name.to_owned()).collect();
        Some(Input::new(FieldRef { topic: TopicId(u32::try_from(topic).unwrap()), path }, members))
    }

    /// Inputs of one or two topics, numbers first; how many are numbers. Always at least one number.
    pub(super) fn inputs(&mut self, truths: bool) -> Option<(Vec<Input>, usize)> {
        let mut topics: Vec<usize> = Vec::new();
        for _ in 0..if self.chance(0.5) { 1 } else { 2 } {
            topics.push(self.stream.below(self.topics.len()));
        }
        topics.dedup();
        let mut numbers: Vec<Input> = Vec::new();
        let mut bools = Vec::new();
        for &topic in &topics {
            numbers.extend(self.input(topic, false));
            if self.chance(0.25) {
                numbers.extend(self.input(topic, false));
            }
            if truths && self.chance(0.5) {
                bools.extend(self.input(topic, true));
            }
        }
        let count = numbers.len();
        numbers.extend(bools);
        (count > 0).then_some((numbers, count))
    }

    pub(super) fn side(&mut self) -> Side {
        if self.chance(0.4) { Side::Outbound } else { Side::Inbound }
    }

    fn expression(&mut self, numbers: usize, depth: u32) -> Expression {
        let input = Expression::Input(u32::try_from(self.stream.below(numbers)).unwrap());
        if depth == 0 {
            return input;
        }
        let inner = |maker: &mut Self| maker.expression(numbers, depth - 1);
        match self.between(0, 9) {
            0 => Expression::Sum(vec![inner(self), Expression::Negate(Box::new(inner(self)))]),
            1 => Expression::Absolute(Box::new(inner(self))),
            2 => Expression::Min(vec![inner(self), inner(self)]),
            3 => Expression::Max(vec![inner(self), inner(self)]),
            4 => Expression::Product(vec![inner(self), Expression::Constant(self.quarters(-2, 2))]),
            5 => Expression::Sum(vec![inner(self), Expression::Constant(self.quarters(-2, 2))]),
            6 if self.chance(0.5) => Expression::Sum(vec![Expression::Time, Expression::Negate(Box::new(inner(self)))]),
            _ => input,
        }
    }

    fn comparison(&mut self) -> Comparison {
        use Comparison::{Above, AtLeast, AtMost, Below, Equal, NotEqual};
        self.one(&[AtLeast, AtMost, Above, Below, Above, Below, Equal, NotEqual])
    }

    pub(super) fn condition(&mut self, inputs: usize, numbers: usize, depth: u32) -> Condition {
        if depth > 0 && self.chance(0.4) {
            let (a, b) = (self.condition(inputs, numbers, depth - 1), self.condition(inputs, numbers, depth - 1));
            return match self.between(0, 3) {
                0 => Condition::All(vec![a, b]),
                1 => Condition::Any(vec![a, b]),
                2 => Condition::Same { left: Box::new(a), right: Box::new(b) },
                _ => Condition::Not(Box::new(a)),
            };
        }
        if inputs > numbers && self.chance(0.5) {
            return Condition::Input(u32::try_from(numbers + self.stream.below(inputs - numbers)).unwrap());
        }
        let (left, by) = (self.expression(numbers, 1), self.comparison());
        Condition::Compare { left, by, right: Expression::Constant(self.quarters(-3, 3)) }
    }

    fn formula(&mut self) -> Option<Formula> {
        let (mut inputs, numbers) = self.inputs(true)?;
        let paired = self.in_groups(&mut inputs);
        let of = self.expression(numbers, 2);
        let held = self.condition(inputs.len(), numbers, 1);
        let aggregate = match self.between(0, 6) {
            0 => Aggregate::Last { of },
            1 => Aggregate::Min { of },
            2 => Aggregate::Max { of },
            3 => Aggregate::Mean { of },
            4 => Aggregate::Count { of: held },
            _ => Aggregate::Duration { of: held },
        };
        let limited = matches!(aggregate, Aggregate::Last { .. } | Aggregate::Mean { .. } | Aggregate::Count { .. });
        let when = self.chance(0.25).then(|| self.condition(inputs.len(), numbers, 1));
        let every = (limited && self.chance(0.25)).then(|| self.ticks(2, 8));
        let zone = inputs.iter().find(|input| self.carries[input.field.topic.index()] == Carries::Zone);
        let zone = zone.map(|input| input.field.topic);
        let per = match zone {
            Some(topic) if !paired && self.chance(0.3) => {
                let path = vec![self.one(&["name", "count"]).to_owned()];
                Some(FieldRef { topic, path })
            }
            _ => None,
        };
        Some(Formula { inputs, aggregate, when, every, per, side: self.side() })
    }

    fn interval(&mut self) -> Interval {
        if self.chance(0.4) {
            return Interval::UNBOUNDED;
        }
        let from = self.between(0, 8);
        let to = if self.chance(0.2) { None } else { Some(f64::from(from + self.between(0, 12)) / 20.0) };
        Interval { from: f64::from(from) / 20.0, to }
    }

    fn temporal(&mut self, signals: usize, depth: u32) -> stl::Formula {
        let inner = |maker: &mut Self| Box::new(maker.temporal(signals, depth - 1));
        if depth == 0 || self.chance(0.15) {
            let signal = u32::try_from(self.stream.below(signals)).unwrap();
            let comparison = self.comparison();
            return stl::Formula::Predicate { signal, comparison, constant: self.quarters(-3, 3) };
        }
        match self.between(0, 9) {
            0 => stl::Formula::Not { of: inner(self) },
            1 => stl::Formula::And { left: inner(self), right: inner(self) },
            2 => stl::Formula::Or { left: inner(self), right: inner(self) },
            3 => stl::Formula::Implies { left: inner(self), right: inner(self) },
            4..=5 => stl::Formula::Eventually { interval: self.interval(), of: inner(self) },
            6 => stl::Formula::Until {
                interval: self.interval(),
                weak: self.chance(0.5),
                left: inner(self),
                right: inner(self),
            },
            _ => stl::Formula::Always { interval: self.interval(), of: inner(self) },
        }
    }

    fn robustness(&mut self) -> Option<Robustness> {
        let (mut inputs, numbers) = self.inputs(false)?;
        self.in_groups(&mut inputs);
        let count = self.between(1, 2);
        let signals: Vec<Expression> = (0..count).map(|_| self.expression(numbers, 1)).collect();
        let formula = self.temporal(signals.len(), 3);
        let (side, whole_windows) = (self.side(), self.stream.clone().chance(0.3));
        Some(adapter::robustness(inputs, signals, formula, side, whole_windows))
    }

    pub(in crate::case) fn metrics(&mut self) -> (Vec<Metric>, usize) {
        let mut metrics: Vec<Metric> = Vec::new();
        let mut hooks: Vec<HookKind> = Vec::new();
        for at in 0..self.between(3, 7) {
            let source = match self.between(0, 19) {
                0..=1 => Some((MetricSource::FuzzingTime, None)),
                2..=3 => {
                    let topic = self.stream.below(self.topics.len());
                    self.input(topic, false).map(|input| (MetricSource::Last { input: input.field }, None))
                }
                4..=6 => {
                    let kind = self.one(&HookKind::ALL);
                    let used = hooks.iter().filter(|&&of| of == kind).count();
                    let topic = TopicId(u32::try_from(self.stream.below(self.topics.len())).unwrap());
                    (used < 2).then(|| {
                        hooks.push(kind);
                        (MetricSource::Hook { topics: vec![topic] }, Some(kind.names()[used]))
                    })
                }
                7..=12 => self.robustness().map(|robustness| (MetricSource::Robustness { robustness }, None)),
                _ => self.formula().map(|formula| (MetricSource::Formula { formula }, None)),
            };
            let Some((source, name)) = source else { continue };
            let default = self.chance(0.5).then(|| self.quarters(-5, 5));
            let initial = self.chance(0.5).then(|| self.quarters(-3, 3));
            let name = name.map_or_else(|| format!("m{at}"), str::to_owned);
            metrics.push(adapter::metric(&name, default, initial, source));
        }
        (metrics, hooks.len())
    }

    pub(super) fn requirements(&mut self, metrics: &[Metric]) -> Vec<Requirement> {
        let mut requirements = Vec::new();
        for (at, metric) in (0u32..).zip(metrics) {
            for _ in 0..self.between(0, 2) {
                let value = match &metric.source {
                    MetricSource::FuzzingTime => self.ticks(0, 30),
                    MetricSource::Formula { formula } => match formula.aggregate {
                        Aggregate::Count { .. } => f64::from(self.between(0, 20)),
                        Aggregate::Duration { .. } => self.ticks(0, 40),
                        _ => self.quarters(-4, 4),
                    },
                    _ => self.quarters(-4, 4),
                };
                let bound = match self.between(0, 7) {
                    0 | 6 => Bound::AtMost { value },
                    1 => Bound::Below { value },
                    2 | 7 => Bound::AtLeast { value },
                    3 => Bound::Above { value },
                    4 => Bound::Equal { value },
                    _ => Bound::Within { low: value, high: value + self.quarters(0, 4) },
                };
                let name = format!("R{}", requirements.len() + 1);
                requirements.push(testing::requirement(&name, at, bound));
            }
        }
        requirements
    }

    /// Lets only groups of one size be read member by member, or the pairs of a single group. Returns whether they are
    /// pairs.
    fn in_groups(&mut self, inputs: &mut [Input]) -> bool {
        let size = |maker: &Self, input: &Input| maker.topics[input.field.topic.index()].paths.len();
        let Some(first) = inputs.iter().find(|input| input.members == Members::Each).cloned() else { return false };
        let members = size(self, &first);
        for input in inputs.iter_mut().filter(|input| input.members == Members::Each) {
            if size(self, input) != members {
                input.members = Members::Max;
            }
        }
        let own = |input: &&Input| input.members == Members::Each && input.field.topic == first.field.topic;
        if inputs.iter().filter(own).count() < 2 || !self.chance(0.5) {
            return false;
        }
        let mut next = Members::First;
        for input in inputs.iter_mut().filter(|input| input.members == Members::Each) {
            if input.field.topic == first.field.topic {
                input.members = std::mem::replace(&mut next, Members::Second);
            } else {
                input.members = Members::Max;
            }
        }
        true
    }
}
