//! Random cases: a space, a test and a robot, made of a number and of nothing else.

use sesame_plan::stl::{self, Interval, Robustness};
use sesame_plan::{
    Activation, Aggregate, Bound, CampaignPlan, Choice, Comparison, Condition, Copies, Distribution, Domain, Drain,
    Expression, FieldRef, Formula, Input, Members, Metric, MetricId, MetricSource, NotFinite, Operation, OperationId,
    OperationKind, Parameter, Requirement, Shape, Side, Span, Step, Test, TestOperation, Topic, TopicId, ValueMode,
    condition as switch,
};
use sesame_rng::Stream;

use crate::adapter;
use crate::hooks::HookKind;
use crate::robot::{Blank, Carries, Line, Script};

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
            let of = |inputs: &[Input], side| side == Side::Outbound && inputs.iter().any(|it| self.is_on(it, path));
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
        MetricSource::FuzzingTime => {}
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

/// The time between two ticks, in seconds; a step is two of them.
const TICK: f64 = 0.05;

struct Maker {
    stream: Stream,
    carries: Vec<Carries>,
    topics: Vec<Topic>,
}

impl Maker {
    fn chance(&mut self, probability: f64) -> bool {
        self.stream.chance(probability)
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.stream.below(of.len())]
    }

    /// A whole number between two, both included.
    fn between(&mut self, low: i32, high: i32) -> i32 {
        low + i32::try_from(self.stream.below(usize::try_from(high - low + 1).unwrap())).unwrap()
    }

    /// A number in quarters.
    fn quarters(&mut self, low: i32, high: i32) -> f64 {
        f64::from(self.between(low * 4, high * 4)) / 4.0
    }

    fn ticks(&mut self, low: i32, high: i32) -> f64 {
        f64::from(self.between(low, high)) / 20.0
    }

    /// Places for so many old things, in their order, and so many new ones among them.
    fn places(&mut self, old: usize, new: usize) -> (Vec<usize>, Vec<usize>) {
        let mut all: Vec<usize> = self.stream.permutation(old + new);
        let mut news = all.split_off(old);
        all.sort_unstable();
        news.sort_unstable();
        (all, news)
    }

    fn case(&mut self, number: u64) -> Case {
        let steps = self.between(6, 22);
        let beyond = if self.chance(0.3) { TICK } else { 0.0 };
        let end_after = f64::from(steps) / 10.0 + beyond;
        let mut lines = self.topics();
        if self.chance(0.5) {
            // A topic that the space does not name.
            let line = self.line("elsewhere".to_owned(), Carries::Real);
            lines.push(line);
        }
        let (metrics, hooked) = self.metrics();
        let by_condition = self.chance(0.5);
        let (operations, mut instances, copies) = self.operations(end_after, by_condition, &metrics);
        if instances.len() > 1 && self.chance(0.1) {
            instances.truncate(1);
        }
        let requirements = self.requirements(&metrics);
        let mut script = Script { lines, crash: None, over: None, blanks: Vec::new() };
        if self.chance(0.15) {
            script.over = Some(self.between(3, steps).unsigned_abs());
        }
        match self.between(0, 9) {
            0..=2 => {}
            3..=6 => {
                let after = self.stream.below(6);
                script.crash = Some((self.between(0, steps - 1).unsigned_abs(), after));
            }
            7..=8 => self.blanks(&mut script, steps, &metrics, &instances),
            _ => {
                let after = self.stream.below(6);
                script.crash = Some((self.between(1, steps - 1).unsigned_abs(), after));
                self.blanks(&mut script, steps, &metrics, &instances);
            }
        }
        let _ = hooked;
        let plan = adapter::plan(self.topics.clone(), metrics, requirements, &operations, copies, end_after);
        Case { number, plan, test: Test { operations: instances }, script, carries: self.carries.clone() }
    }

    fn line(&mut self, path: String, carries: Carries) -> Line {
        let subscribed = self.chance(0.6);
        Line {
            path,
            carries,
            subscribed,
            moves: subscribed && self.chance(0.6),
            most: self.between(1, 3).unsigned_abs(),
            holds: self.between(1, 4).unsigned_abs(),
            gain: self.one(&[0.0, 0.0, 0.5, 1.0]),
            seed: self.stream.bits(),
        }
    }

    fn topics(&mut self) -> Vec<Line> {
        let mut lines = Vec::new();
        for at in 0..self.between(2, 4) {
            let carries =
                self.one(&[Carries::Real, Carries::Real, Carries::Int, Carries::Bool, Carries::Zone, Carries::Zone]);
            let members = if self.chance(0.3) { self.between(2, 3) } else { 1 };
            let paths: Vec<String> = (0..members).map(|member| format!("robot/{at}/{member}")).collect();
            for path in &paths {
                let line = self.line(path.clone(), carries);
                lines.push(line);
            }
            self.carries.push(carries);
            self.topics.push(Topic { name: format!("t{at}"), doc: String::new(), paths, ty: adapter::ty(carries) });
        }
        lines
    }

    /// Numbers that the robot does not know, on topics that it does not hear and no condition reads: what is published
    /// there changes nothing else, so the rest of the run is the true one.
    fn blanks(&mut self, script: &mut Script, steps: i32, metrics: &[Metric], test: &[TestOperation]) {
        let mut read = vec![false; self.topics.len()];
        for metric in test.iter().flat_map(|operation| variables(&operation.activation)) {
            for topic in topics_of(&metrics[metric.index()]) {
                read[topic.index()] = true;
            }
        }
        let member = |topic: &Topic, path: &str| topic.paths.iter().any(|of| of == path);
        let free: Vec<usize> = (0..script.lines.len())
            .filter(|&at| {
                let line = &script.lines[at];
                let topic = self.topics.iter().position(|topic| member(topic, &line.path));
                matches!(line.carries, Carries::Real | Carries::Zone)
                    && !line.moves
                    && topic.is_none_or(|topic| !read[topic])
            })
            .collect();
        if free.is_empty() {
            return;
        }
        for _ in 0..self.between(1, 2) {
            let from = self.between(0, steps - 1);
            let to = self.between(from + 1, steps + 1);
            script.blanks.push(Blank {
                line: self.one(&free),
                from: from.unsigned_abs(),
                to: to.unsigned_abs(),
                share: self.one(&[0.3, 1.0]),
                number: self.one(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
            });
        }
    }

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
        Some(Input { field: FieldRef { topic: TopicId(u32::try_from(topic).unwrap()), path }, members })
    }

    /// Inputs of one or two topics, numbers first; how many are numbers. Always at least one number.
    fn inputs(&mut self, truths: bool) -> Option<(Vec<Input>, usize)> {
        let mut topics: Vec<usize> = Vec::new();
        for _ in 0..if self.chance(0.5) { 1 } else { 2 } {
            topics.push(self.stream.below(self.topics.len()));
        }
        topics.dedup();
        let mut numbers: Vec<Input> = Vec::new();
        let mut bools = Vec::new();
        for &topic in &topics {
            numbers.extend(self.input(topic, false));
            if truths && self.chance(0.5) {
                bools.extend(self.input(topic, true));
            }
        }
        let count = numbers.len();
        numbers.extend(bools);
        (count > 0).then_some((numbers, count))
    }

    fn side(&mut self) -> Side {
        if self.chance(0.4) { Side::Outbound } else { Side::Inbound }
    }

    fn expression(&mut self, numbers: usize, depth: u32) -> Expression {
        let input = Expression::Input(u32::try_from(self.stream.below(numbers)).unwrap());
        if depth == 0 {
            return input;
        }
        let inner = |maker: &mut Self| maker.expression(numbers, depth - 1);
        match self.between(0, 7) {
            0 => Expression::Sum(vec![inner(self), Expression::Negate(Box::new(inner(self)))]),
            1 => Expression::Absolute(Box::new(inner(self))),
            2 => Expression::Min(vec![inner(self), inner(self)]),
            3 => Expression::Max(vec![inner(self), inner(self)]),
            4 => Expression::Product(vec![inner(self), Expression::Constant(self.quarters(-2, 2))]),
            5 => Expression::Sum(vec![inner(self), Expression::Constant(self.quarters(-2, 2))]),
            _ => input,
        }
    }

    fn comparison(&mut self) -> Comparison {
        use Comparison::{Above, AtLeast, AtMost, Below, Equal, NotEqual};
        self.one(&[AtLeast, AtMost, Above, Below, Above, Below, Equal, NotEqual])
    }

    fn condition(&mut self, inputs: usize, numbers: usize, depth: u32) -> Condition {
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
        let (inputs, numbers) = self.inputs(true)?;
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
            Some(topic) if self.chance(0.3) => {
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
            6 => stl::Formula::Until { interval: self.interval(), left: inner(self), right: inner(self) },
            _ => stl::Formula::Always { interval: self.interval(), of: inner(self) },
        }
    }

    fn robustness(&mut self) -> Option<Robustness> {
        let (mut inputs, numbers) = self.inputs(false)?;
        // Members each may be of one group only.
        let mut each: Option<TopicId> = None;
        for input in &mut inputs {
            if input.members == Members::Each && each.is_some_and(|topic| topic != input.field.topic) {
                input.members = Members::Max;
            } else if input.members == Members::Each {
                each = Some(input.field.topic);
            }
        }
        let count = self.between(1, 2);
        let signals: Vec<Expression> = (0..count).map(|_| self.expression(numbers, 1)).collect();
        let formula = self.temporal(signals.len(), 3);
        let (side, whole_windows) = (self.side(), self.stream.clone().chance(0.3));
        Some(adapter::robustness(inputs, signals, formula, side, whole_windows))
    }

    fn metrics(&mut self) -> (Vec<Metric>, usize) {
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

    fn requirements(&mut self, metrics: &[Metric]) -> Vec<Requirement> {
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
                requirements.push(Requirement { name, text: String::new(), metric: MetricId(at), bound });
            }
        }
        requirements
    }

    fn operations(
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
            let timed = |it: &TestOperation| matches!(it.activation, Activation::Time { .. });
            let stacked = timed(&instance) && instances.iter().any(|it| it.operation == id);
            if copies == Copies::MayOverlap || !stacked {
                instances.push(instance);
            }
        }
        (operations, instances, copies)
    }

    fn operation(&mut self, at: i32, topic: usize, end: f64) -> Operation {
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
        let number = |name: &str, low: f64, high: f64, shape, integer| Parameter {
            name: name.to_owned(),
            unit: None,
            domain: Domain::Number { low, high, shape, integer },
        };
        let value = |name: &str, low, high| number(name, low, high, Shape::Value, false);
        let parameters = match &kind {
            Kind::RandomValue { mode, integer } => {
                let name = if *mode == ValueMode::Offset { "offset" } else { "value" };
                vec![number(name, -8.0, 8.0, Shape::Range, *integer)]
            }
            Kind::StuckAt { truth: None } => vec![number("value", -8.0, 8.0, Shape::Value, carries == Carries::Int)],
            Kind::Bias => vec![number("bias", -8.0, 8.0, Shape::Value, carries == Carries::Int)],
            Kind::Drift => vec![value("rate", -8.0, 8.0)],
            Kind::Noise | Kind::RandomWalk => vec![value("sigma", 0.0, 8.0)],
            Kind::Scale => vec![value("factor", -8.0, 8.0)],
            Kind::Stale => vec![value("age", 0.0, 5.0)],
            Kind::PacketLoss => vec![value("loss", 0.0, 1.0)],
            Kind::BurstLoss => ["enter", "leave"].map(|name| value(name, 0.0, 1.0)).to_vec(),
            Kind::RateLimit => vec![value("rate", 0.1, 100.0)],
            Kind::Latency { distribution: Distribution::Fixed, .. } => vec![value("delay", 0.0, 5.0)],
            Kind::Latency { .. } => vec![number("delay", 0.0, 5.0, Shape::Range, false)],
            Kind::Reorder { .. } => vec![value("window", 0.0, 5.0)],
            Kind::Duplicate => vec![number("copies", 1.0, 100.0, Shape::Value, true)],
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
        Operation {
            name: format!("o{at}"),
            doc: String::new(),
            topic: Some(TopicId(u32::try_from(topic).unwrap())),
            places,
            kind,
            parameters,
            within,
            priority: self.between(0, 1),
            inclusion: 1.0,
            timed: self.chance(0.8),
            constraints: Vec::new(),
        }
    }

    fn one_of(&mut self, mut kinds: Vec<OperationKind>) -> OperationKind {
        let at = self.stream.below(kinds.len());
        kinds.swap_remove(at)
    }

    fn instance(
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
                    Domain::Number { shape: Shape::Range, .. } => {
                        let width =
                            if parameter.name == "delay" { self.ticks(0, 6) } else { f64::from(self.between(0, 3)) };
                        Choice::Range { low: value, high: value + width }
                    }
                    _ => Choice::Value { value },
                }
            })
            .collect();
        // The robustness of a formula is no condition variable: it is known only when the run is over.
        let readable = |metric: &&(u32, &Metric)| !matches!(metric.1.source, MetricSource::Robustness { .. });
        let variables: Vec<MetricId> =
            (0u32..).zip(metrics).collect::<Vec<_>>().iter().filter(readable).map(|it| MetricId(it.0)).collect();
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
        TestOperation { operation: id, activation, parameters, operation_seed: self.stream.bits() }
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
        MetricSource::FuzzingTime => Vec::new(),
        MetricSource::Last { input } => vec![input.topic],
        MetricSource::Robustness { robustness } => robustness.inputs.iter().map(|it| it.field.topic).collect(),
        MetricSource::Formula { formula } => formula.inputs.iter().map(|it| it.field.topic).collect(),
    }
}
