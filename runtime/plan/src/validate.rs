//! Whether a plan is one that the rest of the program can work with.
//!
//! A plan that comes from a file may say anything. Reading one therefore ends here: what deserializes is a plan in
//! which every id is in range, every number finite, every range in order, and every count that is divided by or looped
//! over positive. Later code indexes with these without asking again.
//!
//! Whether names inside messages exist and whether the parameters of an operation are those of its kind is asked where
//! they are looked up, at the start of a run: reports need neither.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::condition::{Condition, ConditionEnd, ConditionSpace, Constraint, Integers, Operand};
use crate::stl::{self, Robustness};
use crate::{
    Activation, ActivationMode, Aggregate, BoostedChildren, Bound, Campaign, CampaignPlan, Choice, Confirmation,
    CoverageGoal, Domain, Exploration, Expression, Failing, FieldRef, Formula, KnownTest, KnownTestId, MessageId,
    Metric, MetricId, MetricSource, Operation, OperationId, OperationKind, RequirementId, SCHEMA, Search, Shrinking,
    Span, Statistic, StopRule, Task, Test, TopicId, Transport, Type,
};

/// What is wrong with a plan, and where in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanError {
    /// The place, as one would write it in JavaScript: `campaign.objectives[0]`; empty for the plan as a whole.
    pub place: String,
    /// What is wrong there.
    pub problem: String,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PlanError { place, problem } = self;
        if place.is_empty() { f.write_str(problem) } else { write!(f, "{place}: {problem}") }
    }
}

impl std::error::Error for PlanError {}

type Checked = Result<(), PlanError>;

/// Reads the schema of a plan, and refuses another than this release's before anything else is read.
pub(crate) fn this_schema<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let schema = u32::deserialize(deserializer)?;
    at("schema", known_schema(schema)).map_err(D::Error::custom)?;
    Ok(schema)
}

fn known_schema(schema: u32) -> Checked {
    require(schema == SCHEMA, || {
        format!(
            "is {schema}, this release knows {SCHEMA}; run `sesamec generate` again to write a plan of this release"
        )
    })
}

fn wrong(problem: impl Into<String>) -> Checked {
    Err(PlanError { place: String::new(), problem: problem.into() })
}

fn require(holds: bool, problem: impl FnOnce() -> String) -> Checked {
    if holds { Ok(()) } else { wrong(problem()) }
}

/// Says of a problem inside a part where that part is.
fn at(part: &str, checked: Checked) -> Checked {
    checked.map_err(|PlanError { place, problem }| {
        let joined = match place.chars().next() {
            None => part.to_owned(),
            Some('[') => format!("{part}{place}"),
            Some(_) => format!("{part}.{place}"),
        };
        PlanError { place: joined, problem }
    })
}

fn each<T>(part: &str, items: &[T], mut check: impl FnMut(&T) -> Checked) -> Checked {
    items.iter().enumerate().try_for_each(|(index, item)| at(part, at(&format!("[{index}]"), check(item))))
}

fn id(of: &str, index: usize, count: usize) -> Checked {
    require(index < count, || format!("there is no {of} {index}, there are {count}"))
}

fn finite(number: f64) -> Checked {
    require(number.is_finite(), || format!("{number} is not finite"))
}

fn positive(number: f64) -> Checked {
    require(number.is_finite() && number > 0.0, || format!("{number} is not above 0"))
}

fn share(number: f64) -> Checked {
    require((0.0..=1.0).contains(&number), || format!("{number} is not in 0..=1"))
}

fn positive_share(number: f64) -> Checked {
    share(number)?;
    positive(number)
}

fn at_least_one(count: u32) -> Checked {
    require(count >= 1, || "must be at least 1".to_owned())
}

fn ordered(low: f64, high: f64) -> Checked {
    finite(low)?;
    finite(high)?;
    finite(high - low)?;
    require(low <= high, || format!("runs from {low} to {high}"))
}

fn span(span: Span) -> Checked {
    require(span.start >= 0.0, || format!("begins at {}, before the start", span.start))?;
    ordered(span.start, span.end)
}

fn integers(integers: Integers) -> Checked {
    /// Beyond it, not every whole number is an `f64`.
    const MOST: i64 = 1 << 53;
    let Integers { lowest, highest } = integers;
    require(-MOST <= lowest && lowest <= highest && highest <= MOST, || {
        format!("there are no whole numbers from {lowest} to {highest} within 2^53")
    })
}

fn filled<T>(list: &[T]) -> Checked {
    require(!list.is_empty(), || "there is none".to_owned())
}

/// Names and units are shown on terminals, and written into files of other formats.
fn name(name: &str) -> Checked {
    require(!name.is_empty(), || "is empty".to_owned())?;
    require(!name.chars().any(char::is_control), || format!("{name:?} has control characters"))
}

/// A unit, where there is one.
fn unit(unit: Option<&String>) -> Checked {
    at("unit", unit.map_or(Ok(()), |unit| name(unit)))
}

fn distinct<T: Ord + fmt::Debug>(items: impl IntoIterator<Item = T>) -> Checked {
    let mut seen = BTreeSet::new();
    for item in items {
        if seen.contains(&item) {
            return wrong(format!("{item:?} is there twice"));
        }
        seen.insert(item);
    }
    Ok(())
}

impl<'de> Deserialize<'de> for CampaignPlan {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        // Not this function: the one that is derived, which checks nothing.
        let plan = CampaignPlan::deserialize(deserializer)?;
        plan.validate().map_err(D::Error::custom)?;
        Ok(plan)
    }
}

impl Serialize for CampaignPlan {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        CampaignPlan::serialize(self, serializer)
    }
}

impl CampaignPlan {
    /// Makes sure of what the fields promise. A plan that was deserialized has passed.
    pub fn validate(&self) -> Result<(), PlanError> {
        at("schema", known_schema(self.schema))?;
        at("space", name(&self.space))?;
        at("simulator.name", name(&self.simulator.name))?;
        let step_ns = match self.simulator.transport {
            Transport::InProcess { step_ns, .. } => Some(step_ns),
            Transport::Process { step_ns, .. } => step_ns,
        };
        at("simulator.transport.step_ns", require(step_ns != Some(0), || "must be positive".to_owned()))?;
        self.messages.iter().enumerate().try_for_each(|(index, message)| {
            let field = |field: &crate::Field| {
                at("name", name(&field.name))?;
                at("type", earlier(&field.ty, index))
            };
            at(&format!("messages[{index}].name"), name(&message.name))?;
            at(&format!("messages[{index}]"), each("fields", &message.fields, field))
        })?;
        each("topics", &self.topics, |topic| {
            at("name", name(&topic.name))?;
            at("paths", filled(&topic.paths))?;
            at("type", self.ty(&topic.ty))
        })?;
        each("nodes", &self.nodes, |node| {
            at("name", name(&node.name))?;
            each("publishes", &node.publishes, |&id| self.has_topic(id))?;
            each("subscribes", &node.subscribes, |&id| self.has_topic(id))
        })?;
        at("metrics", distinct(self.metrics.iter().map(|it| &it.name)))?;
        each("metrics", &self.metrics, |metric| self.sound_metric(metric))?;
        at("requirements", distinct(self.requirements.iter().map(|it| &it.name)))?;
        each("requirements", &self.requirements, |requirement| {
            at("name", name(&requirement.name))?;
            at("metric", self.has_metric(requirement.metric))?;
            at("bound", bound(requirement.bound))
        })?;
        at("operations", distinct(self.operations.iter().map(|it| &it.name)))?;
        each("operations", &self.operations, |operation| self.sound_operation(operation))?;
        each("tests", &self.tests, |test| self.sound_known_test(test))?;
        at("campaign", self.sound_campaign(&self.campaign))
    }

    /// Makes sure that a test is one of this plan: its operations are there, each with a choice for every parameter,
    /// and all numbers are finite and in order. It need not lie within what the operations permit.
    pub fn validate_test(&self, test: &Test) -> Result<(), PlanError> {
        each("operations", &test.operations, |it| {
            at("operation", self.has_operation(it.operation))?;
            let operation = self.operation(it.operation);
            at("activation", self.sound_activation(&it.activation, operation))?;
            let (needed, chosen) = (operation.parameters.len(), it.parameters.len());
            at("parameters", require(needed == chosen, || format!("there are {chosen} instead of {needed}")))?;
            let mut domains = operation.parameters.iter().map(|parameter| &parameter.domain);
            each("parameters", &it.parameters, |choice| domains.next().map_or(Ok(()), |domain| fits(choice, domain)))
        })
    }

    fn has_topic(&self, topic: TopicId) -> Checked {
        id("topic", topic.index(), self.topics.len())
    }
    fn has_message(&self, message: MessageId) -> Checked {
        id("message", message.index(), self.messages.len())
    }
    fn has_metric(&self, metric: MetricId) -> Checked {
        id("metric", metric.index(), self.metrics.len())
    }
    fn has_operation(&self, operation: OperationId) -> Checked {
        id("operation", operation.index(), self.operations.len())
    }
    fn has_requirement(&self, requirement: RequirementId) -> Checked {
        id("requirement", requirement.index(), self.requirements.len())
    }
    fn has_test(&self, test: KnownTestId) -> Checked {
        id("test", test.index(), self.tests.len())
    }

    fn ty(&self, ty: &Type) -> Checked {
        match ty {
            Type::Message { id } => at("id", self.has_message(*id)),
            Type::List { of } => at("of", self.ty(of)),
            Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Text | Type::Point { .. } => Ok(()),
        }
    }

    fn sound_metric(&self, metric: &Metric) -> Checked {
        at("name", name(&metric.name))?;
        unit(metric.unit.as_ref())?;
        at("default", metric.default.map_or(Ok(()), finite))?;
        at("initial", metric.initial.map_or(Ok(()), finite))?;
        let sound = match &metric.source {
            MetricSource::Hook { topics } => each("topics", topics, |&id| self.has_topic(id)),
            MetricSource::FuzzingTime => Ok(()),
            MetricSource::Last { input } => at("input", self.field(input)),
            MetricSource::Robustness { robustness } => at("robustness", self.sound_robustness(robustness)),
            MetricSource::Formula { formula } => at("formula", self.sound_formula(formula)),
        };
        at("source", sound)
    }

    fn field(&self, field: &FieldRef) -> Checked {
        at("topic", self.has_topic(field.topic))
    }

    fn sound_formula(&self, formula: &Formula) -> Checked {
        let inputs = formula.inputs.len();
        at("inputs", filled(&formula.inputs))?;
        each("inputs", &formula.inputs, |input| at("field", self.field(&input.field)))?;
        let aggregate = match &formula.aggregate {
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
                expression(of, inputs)
            }
            Aggregate::Count { of } | Aggregate::Duration { of } => proposition(of, inputs),
        };
        at("aggregate.of", aggregate)?;
        at("when", formula.when.as_ref().map_or(Ok(()), |when| proposition(when, inputs)))?;
        at("every", formula.every.map_or(Ok(()), positive))?;
        at("per", formula.per.as_ref().map_or(Ok(()), |per| self.field(per)))
    }

    fn sound_robustness(&self, robustness: &Robustness) -> Checked {
        let inputs = robustness.inputs.len();
        at("inputs", filled(&robustness.inputs))?;
        each("inputs", &robustness.inputs, |input| at("field", self.field(&input.field)))?;
        let mut groups = robustness.inputs.iter().filter(|input| input.members == crate::Members::Each);
        let group = groups.next().map(|input| input.field.topic);
        let other = groups.find(|input| Some(input.field.topic) != group);
        at("inputs", require(other.is_none(), || "members of more than one group are to be told apart".to_owned()))?;
        each("signals", &robustness.signals, |signal| expression(signal, inputs))?;
        at("formula", temporal(&robustness.formula, robustness.signals.len()))
    }

    fn sound_operation(&self, operation: &Operation) -> Checked {
        at("name", name(&operation.name))?;
        let beside = operation.kind.is_offline();
        at("topic", operation.topic.map_or(Ok(()), |id| self.has_topic(id)))?;
        at(
            "topic",
            require(operation.topic.is_some() != beside, || {
                if beside { "it acts on none".to_owned() } else { "it acts on one".to_owned() }
            }),
        )?;
        if let OperationKind::RandomText { texts } = &operation.kind {
            at("kind.texts", filled(texts))?;
        }
        at("parameters", distinct(operation.parameters.iter().map(|it| &it.name)))?;
        each("parameters", &operation.parameters, |parameter| {
            at("name", name(&parameter.name))?;
            unit(parameter.unit.as_ref())?;
            at("domain", domain(&parameter.domain))
        })?;
        at("within", span(operation.within))?;
        at("inclusion", share(operation.inclusion))?;
        each("constraints", &operation.constraints, |constraint| match constraint {
            Constraint::Variable { metric } => at("metric", self.has_metric(*metric)),
            Constraint::Integer { bounds } => at("bounds", integers(*bounds)),
        })
    }

    fn sound_known_test(&self, known: &KnownTest) -> Checked {
        at("name", name(&known.name))?;
        at("test", self.validate_test(&known.test))?;
        each("expectations", &known.expectations, |expectation| {
            at("metric", self.has_metric(expectation.metric))?;
            at("bound", bound(expectation.bound))
        })
    }

    fn sound_activation(&self, activation: &Activation, operation: &Operation) -> Checked {
        let beside = *activation == Activation::Offline;
        require(beside == operation.kind.is_offline(), || {
            let when = if beside { "during" } else { "before or after" };
            format!("`{}` acts {when} the run", operation.name)
        })?;
        match activation {
            Activation::Time { start, end } => span(Span { start: *start, end: *end }),
            Activation::Condition { start, end, times } => {
                at("start", self.condition(start))?;
                at("end", self.condition(end))?;
                at("times", at_least_one(*times))
            }
            Activation::ConditionFor { start, length, times } => {
                at("start", self.condition(start))?;
                at("length", positive(*length))?;
                at("times", at_least_one(*times))
            }
            Activation::Offline => Ok(()),
        }
    }

    fn condition(&self, condition: &Condition) -> Checked {
        let operand = |operand: &Operand| match *operand {
            Operand::Variable(metric) => self.has_metric(metric),
            Operand::Number(number) => finite(number),
        };
        match condition {
            Condition::Compare { left, right, by: _ } => {
                at("left", operand(left))?;
                at("right", operand(right))
            }
            Condition::And(left, right) | Condition::Or(left, right) => {
                self.condition(left)?;
                self.condition(right)
            }
        }
    }

    fn sound_campaign(&self, campaign: &Campaign) -> Checked {
        at("name", name(&campaign.name))?;
        each("objectives", &campaign.objectives, |&id| {
            self.has_metric(id)?;
            let metric = self.metric(id);
            require(metric.direction.is_some(), || format!("the metric `{}` has no direction", metric.name))
        })?;
        at("objectives", distinct(&campaign.objectives))?;
        each("operations", &campaign.operations, |&id| self.has_operation(id))?;
        at("operations", distinct(&campaign.operations))?;
        let (min, max) = (campaign.count.min, campaign.count.max);
        at("count", require(min <= max, || format!("runs from {min} to {max}")))?;
        if let ActivationMode::Condition { space } = &campaign.activation {
            at("activation.space", self.condition_space(space))?;
        }
        at("search", self.sound_search(&campaign.search))?;
        at("coverage", campaign.coverage.as_ref().map_or(Ok(()), coverage))?;
        at("exploration", campaign.exploration.as_ref().map_or(Ok(()), exploration))?;
        at("confirm", campaign.confirm.as_ref().map_or(Ok(()), confirmation))?;
        at("neighbours", campaign.neighbours.map_or(Ok(()), at_least_one))?;
        each("stop", &campaign.stop, stop_rule)?;
        at("end_after", positive(campaign.end_after))
    }

    fn condition_space(&self, space: &ConditionSpace) -> Checked {
        let ConditionSpace { variables, depth, integers: whole, end, times } = space;
        at("variables", filled(variables))?;
        each("variables", variables, |variable| {
            unit(variable.unit.as_ref())?;
            at("metric", self.has_metric(variable.metric))?;
            at("low", variable.low.map_or(Ok(()), finite))?;
            at("high", variable.high.map_or(Ok(()), finite))?;
            let ends = variable.low.zip(variable.high);
            ends.map_or(Ok(()), |(low, high)| require(low <= high, || format!("runs from {low} to {high}")))
        })?;
        at("depth", at_least_one(*depth))?;
        let most = ConditionSpace::MOST_DEPTH;
        at("depth", require(*depth <= most, || format!("is {depth}, more than {most}")))?;
        at("integers", integers(*whole))?;
        if let ConditionEnd::Length { low, high } = *end {
            at("end", positive(low))?;
            at("end", ordered(low, high))?;
        }
        at("times", at_least_one(*times))
    }

    fn sound_search(&self, search: &Search) -> Checked {
        match search {
            Search::Strategy { strategy, evaluations: _ } => match strategy.not_permitted() {
                None => Ok(()),
                Some((setting, _)) => {
                    at("strategy", at(setting.keyword(), require(false, || format!("must be {}", setting.bounds()))))
                }
            },
            Search::Repeat { test, times: _ } => at("test", self.has_test(*test)),
        }
    }

    /// Checks that a task can be done with this plan: its tests, and what they refer to, are in the plan.
    pub fn validate_task(&self, task: &Task) -> Result<(), PlanError> {
        match task {
            Task::Campaign => Ok(()),
            Task::Known { tests } => each("tests", tests, |&id| self.has_test(id)),
            Task::Repeat { test, .. } => at("test", self.validate_test(test)),
            Task::Shrink(Shrinking { test, failing, runs, .. }) => {
                at("test", self.validate_test(test))?;
                if let Failing::Violation { requirements } = failing {
                    at("failing.requirements", filled(requirements))?;
                    each("failing.requirements", requirements, |&id| self.has_requirement(id))?;
                }
                at("runs", at_least_one(*runs))
            }
        }
    }
}

/// A type of a field of the message at this position: messages contain those before them, so that none contains itself.
fn earlier(ty: &Type, position: usize) -> Checked {
    match ty {
        Type::Message { id } => at(
            "id",
            require(id.index() < position, || format!("message {position} contains message {}, not before it", id.0)),
        ),
        Type::List { of } => at("of", earlier(of, position)),
        Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Text | Type::Point { .. } => Ok(()),
    }
}

fn bound(bound: Bound) -> Checked {
    match bound {
        Bound::AtMost { value }
        | Bound::Below { value }
        | Bound::AtLeast { value }
        | Bound::Above { value }
        | Bound::Equal { value } => finite(value),
        Bound::Within { low, high } => ordered(low, high),
    }
}

fn domain(domain: &Domain) -> Checked {
    match domain {
        Domain::Number { low, high, shape: _, integer: _ } => ordered(*low, *high),
        Domain::Point { low, high } => low.iter().zip(high).try_for_each(|(&low, &high)| ordered(low, high)),
        Domain::Texts { texts: items } | Domain::Files { files: items } => {
            filled(items)?;
            distinct(items)
        }
    }
}

fn fits(choice: &Choice, domain: &Domain) -> Checked {
    match (choice, domain) {
        (Choice::Value { value }, Domain::Number { .. }) => finite(*value),
        (Choice::Range { low, high }, Domain::Number { .. }) => ordered(*low, *high),
        (Choice::Point { point }, Domain::Point { .. }) => point.iter().try_for_each(|&axis| finite(axis)),
        (Choice::Text { .. }, Domain::Texts { .. } | Domain::Files { .. }) => Ok(()),
        _ => wrong("is of another kind than its parameter"),
    }
}

fn expression(of: &Expression, inputs: usize) -> Checked {
    let input = |index: u32| id("input", index as usize, inputs);
    match of {
        Expression::Constant(number) => finite(*number),
        Expression::Input(index) => input(*index),
        Expression::Negate(of) | Expression::Absolute(of) => expression(of, inputs),
        Expression::Sum(of) | Expression::Product(of) => of.iter().try_for_each(|of| expression(of, inputs)),
        Expression::Min(of) | Expression::Max(of) => {
            filled(of)?;
            of.iter().try_for_each(|of| expression(of, inputs))
        }
        Expression::Divide { value, by } => {
            expression(value, inputs)?;
            expression(by, inputs)
        }
        Expression::Distance { from, to, scale } => {
            input(*from)?;
            input(*to)?;
            finite(*scale)
        }
    }
}

fn proposition(of: &crate::formula::Condition, inputs: usize) -> Checked {
    use crate::formula::Condition;
    match of {
        Condition::Constant(_) => Ok(()),
        Condition::Input(index) => id("input", *index as usize, inputs),
        Condition::Compare { left, right, by: _ } => {
            expression(left, inputs)?;
            expression(right, inputs)
        }
        Condition::Same { left, right } => {
            proposition(left, inputs)?;
            proposition(right, inputs)
        }
        Condition::All(of) | Condition::Any(of) => of.iter().try_for_each(|of| proposition(of, inputs)),
        Condition::Not(of) => proposition(of, inputs),
    }
}

fn temporal(formula: &stl::Formula, signals: usize) -> Checked {
    use stl::Formula;
    match formula {
        Formula::Predicate { signal, constant, comparison: _ } => {
            id("signal", *signal as usize, signals)?;
            finite(*constant)
        }
        Formula::Not { of } => temporal(of, signals),
        Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
            temporal(left, signals)?;
            temporal(right, signals)
        }
        Formula::Always { interval: within, of } | Formula::Eventually { interval: within, of } => {
            interval(*within)?;
            temporal(of, signals)
        }
        Formula::Until { interval: within, left, right } => {
            interval(*within)?;
            temporal(left, signals)?;
            temporal(right, signals)
        }
    }
}

fn interval(interval: stl::Interval) -> Checked {
    span(Span { start: interval.from, end: interval.to.unwrap_or(interval.from) })
}

fn coverage(goal: &CoverageGoal) -> Checked {
    at("axes", filled(&goal.axes))?;
    at("axes", distinct(goal.axes.iter().map(|axis| axis.dimension)))?;
    each("axes", &goal.axes, |axis| {
        ordered(axis.low, axis.high)?;
        require(axis.low < axis.high, || "ends where it begins".to_owned())?;
        at("cells", at_least_one(axis.cells))
    })?;
    at("hits", at_least_one(goal.hits))?;
    at("stop_at", goal.stop_at.map_or(Ok(()), share))
}

fn exploration(exploration: &Exploration) -> Checked {
    match exploration {
        Exploration::Boost { every_generations, children, tries: _ } => {
            at("every_generations", at_least_one(*every_generations))?;
            match children {
                BoostedChildren::Every { iterations } => at("children.iterations", at_least_one(*iterations)),
                BoostedChildren::Falling { .. } => Ok(()),
            }
        }
        Exploration::Construct { share: some, until } => {
            at("share", share(*some))?;
            at("until", until.map_or(Ok(()), share))
        }
        Exploration::Novelty { neighbours, over } => {
            at("neighbours", at_least_one(*neighbours))?;
            at("over", filled(over))
        }
        Exploration::Predict { candidates } => at("candidates", at_least_one(*candidates)),
    }
}

fn confirmation(confirmation: &Confirmation) -> Checked {
    at("times", at_least_one(confirmation.times))?;
    match confirmation.by {
        Statistic::Mean | Statistic::Median => Ok(()),
        Statistic::Quantile { share } => at("by.share", positive_share(share)),
    }
}

fn stop_rule(rule: &StopRule) -> Checked {
    match *rule {
        StopRule::WallTime { seconds } => at("seconds", positive(seconds)),
        StopRule::Stagnation { generations, below } => {
            at("generations", at_least_one(generations))?;
            at("below", positive(below))
        }
        StopRule::Discovery { below } => at("below", positive_share(below)),
        StopRule::Completeness { share } => at("share", positive_share(share)),
    }
}
