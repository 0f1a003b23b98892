//! Random operations, and how a test uses them.

use sesame_plan::testing;
use sesame_plan::{
    Activation, Choice, ChoiceKind, Copies, Distribution, Domain, Drain, Metric, MetricId, MetricSource, NotFinite,
    Operation, OperationId, OperationKind, Span, Step, TestOperation, ValueMode, condition as switch,
};

use super::Maker;
use crate::robot::Carries;

impl Maker {
    pub(super) fn operations(
        &mut self,
        end: f64,
        by_condition: bool,
        metrics: &[Metric],
    ) -> (Vec<Operation>, Vec<TestOperation>, Copies) {
        let mut operations = Vec::new();
        for at in 0..self.between(1, 3) {
            let topic = self.stream.below(self.topics.len());
            let operation = self.operation(at, topic, end);
            operations.push(operation);
        }
        let mut instances: Vec<TestOperation> = Vec::new();
        let copies = if self.chance(0.5) { Copies::MayOverlap } else { Copies::Apart };
        for _ in 0..self.between(1, 4) {
            let at = self.stream.below(operations.len());
            let id = OperationId(u32::try_from(at).unwrap());
            // By time, copies that stay apart are given disjoint windows by whoever makes a test.
            let instance = self.instance(id, &operations[at], end, by_condition, metrics);
            let timed = |operation: &TestOperation| matches!(operation.activation, Activation::Time { .. });
            let stacked = timed(&instance) && instances.iter().any(|other| other.operation == id);
            if copies == Copies::MayOverlap || !stacked {
                instances.push(instance);
            }
        }
        (operations, instances, copies)
    }

    pub(in crate::case) fn operation(&mut self, at: i32, topic: usize, end: f64) -> Operation {
        use OperationKind as Kind;
        let carries = self.carries[topic];
        let drain = self.one(&[Drain::Finish, Drain::Flush, Drain::Drop]);
        let real = matches!(carries, Carries::Real | Carries::Zone);
        let on_values = self.chance(0.45);
        let kind = match (carries, on_values) {
            (Carries::Bool, true) => self.one_of(vec![
                Kind::StuckAt { truth: Some(true) },
                Kind::StuckAt { truth: Some(false) },
                Kind::Freeze,
                Kind::Stale,
            ]),
            (_, true) => {
                let mut kinds = vec![
                    Kind::RandomValue { mode: ValueMode::Offset, integer: !real },
                    Kind::RandomValue { mode: ValueMode::Absolute, integer: !real },
                    Kind::StuckAt { truth: None },
                    Kind::Bias,
                    Kind::Drift,
                    Kind::Noise,
                    Kind::RandomWalk,
                    Kind::Scale,
                    Kind::Freeze,
                    Kind::Stale,
                ];
                if real {
                    kinds.push(Kind::NotFinite { number: NotFinite::Nan });
                }
                self.one_of(kinds)
            }
            (_, false) => self.one_of(vec![
                Kind::PacketLoss,
                Kind::BurstLoss,
                Kind::RateLimit,
                Kind::Latency { distribution: Distribution::Fixed, drain },
                Kind::Latency { distribution: Distribution::Fixed, drain },
                Kind::Latency { distribution: Distribution::Uniform, drain },
                Kind::Latency { distribution: Distribution::Normal, drain },
                Kind::Reorder { drain },
                Kind::Duplicate,
                Kind::Blackhole,
                Kind::Blackhole,
            ]),
        };
        let number = |name: &str, low: f64, high: f64, shape, integer| {
            testing::parameter(name, Domain::Number { low, high, shape, integer })
        };
        let value = |name: &str, low, high| number(name, low, high, ChoiceKind::Value, false);
        let parameters = match &kind {
            Kind::RandomValue { mode, integer } => {
                let name = if *mode == ValueMode::Offset { "offset" } else { "value" };
                vec![number(name, -8.0, 8.0, ChoiceKind::Range, *integer)]
            }
            Kind::StuckAt { truth: None } => {
                vec![number("value", -8.0, 8.0, ChoiceKind::Value, carries == Carries::Int)]
            }
            Kind::Bias => vec![number("bias", -8.0, 8.0, ChoiceKind::Value, carries == Carries::Int)],
            Kind::Drift => vec![value("rate", -8.0, 8.0)],
            Kind::Noise | Kind::RandomWalk => vec![value("sigma", 0.0, 8.0)],
            Kind::Scale => vec![value("factor", -8.0, 8.0)],
            Kind::Stale => vec![value("age", 0.0, 5.0)],
            Kind::PacketLoss => vec![value("loss", 0.0, 1.0)],
            Kind::BurstLoss => ["enter", "leave"].map(|name| value(name, 0.0, 1.0)).to_vec(),
            Kind::RateLimit => vec![value("rate", 0.1, 100.0)],
            Kind::Latency { distribution: Distribution::Fixed, .. } => vec![value("delay", 0.0, 5.0)],
            Kind::Latency { .. } => vec![number("delay", 0.0, 5.0, ChoiceKind::Range, false)],
            Kind::Reorder { .. } => vec![value("window", 0.0, 5.0)],
            Kind::Duplicate => vec![number("copies", 1.0, 100.0, ChoiceKind::Value, true)],
            _ => Vec::new(),
        };
        let whole = matches!(
            kind,
            Kind::PacketLoss
                | Kind::BurstLoss
                | Kind::RateLimit
                | Kind::Latency { .. }
                | Kind::Reorder { .. }
                | Kind::Duplicate
                | Kind::Blackhole
        ) || (matches!(kind, Kind::Freeze | Kind::Stale) && self.chance(0.5));
        let places = match carries {
            Carries::Zone if !whole => vec![vec![Step::Field("level".to_owned())]],
            _ if whole => Vec::new(),
            _ => vec![Vec::new()],
        };
        let within = if self.chance(0.5) {
            Span { start: 0.0, end }
        } else {
            let start = self.ticks(0, 6);
            Span { start, end: start + self.ticks(2, 30) }
        };
        let topic = u32::try_from(topic).unwrap();
        Operation {
            places,
            within,
            priority: self.between(0, 1),
            timed: self.chance(0.8),
            counted: Vec::new(),
            wrapped: None,
            ..testing::operation_with(&format!("o{at}"), topic, kind, parameters)
        }
    }

    fn one_of(&mut self, mut kinds: Vec<OperationKind>) -> OperationKind {
        let at = self.stream.below(kinds.len());
        kinds.swap_remove(at)
    }

    pub(in crate::case) fn instance(
        &mut self,
        id: OperationId,
        operation: &Operation,
        end: f64,
        by_condition: bool,
        metrics: &[Metric],
    ) -> TestOperation {
        let parameters = operation
            .parameters
            .iter()
            .map(|parameter| {
                let whole = matches!(parameter.domain, Domain::Number { integer: true, .. });
                let value = match parameter.name.as_str() {
                    "age" | "delay" | "window" => self.ticks(0, 10),
                    "sigma" => self.quarters(0, 2),
                    "loss" | "enter" | "leave" => f64::from(self.between(0, 4)) / 4.0,
                    "rate" if operation.kind == OperationKind::RateLimit => self.one(&[2.0, 4.0, 10.0, 20.0]),
                    "copies" => f64::from(self.between(1, 3)),
                    _ if whole => f64::from(self.between(-3, 3)),
                    _ => self.quarters(-4, 4),
                };
                match parameter.domain {
                    Domain::Number { shape: ChoiceKind::Range, .. } => {
                        let width =
                            if parameter.name == "delay" { self.ticks(0, 6) } else { f64::from(self.between(0, 3)) };
                        Choice::Range { low: value, high: value + width }
                    }
                    _ => Choice::Value { value },
                }
            })
            .collect();
        // The robustness of a formula is not a condition variable: it is known only when the run is over.
        let readable = |metric: &&(u32, &Metric)| !matches!(metric.1.source, MetricSource::Robustness { .. });
        let variables: Vec<MetricId> = (0u32..)
            .zip(metrics)
            .collect::<Vec<_>>()
            .iter()
            .filter(readable)
            .map(|metric| MetricId(metric.0))
            .collect();
        let activation = if by_condition && !variables.is_empty() {
            let start = self.switch(&variables, 2);
            let times = self.between(1, 3).unsigned_abs();
            if self.chance(0.5) {
                Activation::Condition { start, end: self.switch(&variables, 1), times }
            } else {
                Activation::ConditionFor { start, length: self.ticks(1, 12), times }
            }
        } else {
            let (low, high) = (operation.within.start, operation.within.end.min(end).max(operation.within.start));
            let (a, b) = (self.ticks(0, 40), self.ticks(0, 40));
            let (a, b) = (a.clamp(low, high), b.clamp(low, high));
            Activation::Time { start: a.min(b), end: a.max(b) }
        };
        TestOperation { operation: id, activation, parameters, operation_seed: self.stream.bits(), messages: None }
    }

    fn switch(&mut self, variables: &[MetricId], depth: u32) -> switch::Condition {
        if depth > 0 && self.chance(0.35) {
            let (a, b) = (self.switch(variables, depth - 1), self.switch(variables, depth - 1));
            let (a, b) = (Box::new(a), Box::new(b));
            return if self.chance(0.5) { switch::Condition::And(a, b) } else { switch::Condition::Or(a, b) };
        }
        let left = switch::Operand::Variable(self.one(variables));
        let by = self.one(&[switch::Comparison::Below, switch::Comparison::Above, switch::Comparison::Equal]);
        let right = if self.chance(0.2) {
            switch::Operand::Variable(self.one(variables))
        } else {
            switch::Operand::Number(f64::from(self.between(-2, 3)))
        };
        if self.chance(0.5) {
            switch::Condition::Compare { left, by, right }
        } else {
            switch::Condition::Compare { left: right, by, right: left }
        }
    }
}
