//! Whether a plan is one that the rest of the program can work with.
//!
//! A plan that comes from a file may say anything. Reading one therefore ends here: what deserializes is a plan in
//! which every id is in range, every number finite, every range in order, and every count that is divided by or looped
//! over positive. Later code indexes with these without asking again.
//!
//! Whether names inside messages exist and whether the parameters of an operation are those of its kind is asked where
//! they are looked up, at the start of a run: reports need neither.

mod campaign;
mod check;
mod formula;
mod lab;
mod monitor;
mod system;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::condition::{Condition, Constraint, Operand};
use crate::{
    Activation, Bound, CampaignPlan, Choice, ChoiceKind, Domain, Failing, FieldRef, KnownTest, KnownTestId, LabTask,
    MembersOf, MessageId, Messages, Metric, MetricId, MetricSource, NamedNumber, NewValue, Operation, OperationId,
    OperationKind, RequirementId, SCHEMA, Shrinking, Span, Target, Task, Test, TopicId, Type, Undisturbed, Variations,
    has_placeholder,
};

use check::{
    Checked, at, at_least_one, distinct, each, filled, finite, id, integers, lengths, name, ordered, positive, require,
    share, span, unit, wrong,
};

pub use check::PlanError;

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
        at("simulator", self.sound_simulator(&self.simulator))?;
        self.messages.iter().enumerate().try_for_each(|(index, message)| {
            let field = |field: &crate::Field| {
                at("name", name(&field.name))?;
                at("type", earlier(&field.ty, index))
            };
            at(&format!("messages[{index}].name"), name(&message.name))?;
            at(&format!("messages[{index}]"), each("fields", &message.fields, field))?;
            let constant = |constant: &NamedNumber| at("number", finite(constant.number));
            at(&format!("messages[{index}]"), each("constants", &message.constants, constant))
        })?;
        each("topics", &self.topics, |topic| {
            at("name", name(&topic.name))?;
            at("paths", filled(&topic.paths))?;
            at("type", self.ty(&topic.ty))?;
            at("interface", self.has_interface(topic.interface.as_deref()))
        })?;
        each("nodes", &self.nodes, |node| self.sound_node(node))?;
        at("metrics", distinct(self.metrics.iter().map(|metric| &metric.name)))?;
        each("metrics", &self.metrics, |metric| self.sound_metric(metric))?;
        at("requirements", distinct(self.requirements.iter().map(|requirement| &requirement.name)))?;
        each("requirements", &self.requirements, |requirement| {
            at("name", name(&requirement.name))?;
            at("metric", self.has_metric(requirement.metric))?;
            at("bound", bound(requirement.bound))
        })?;
        at("operations", distinct(self.operations.iter().map(|operation| &operation.name)))?;
        each("operations", &self.operations, |operation| self.sound_operation(operation))?;
        each("tests", &self.tests, |test| self.sound_known_test(test))?;
        at("campaign", self.sound_campaign(&self.campaign))?;
        at("monitors", self.sound_monitors())?;
        at("labs", distinct(self.labs.iter().map(|lab| &lab.name)))?;
        each("labs", &self.labs, |lab| self.sound_lab(lab))?;
        let compensation = self.compensation.as_ref();
        at("compensation", compensation.map_or(Ok(()), |compensation| self.sound_compensation(compensation)))
    }

    /// Makes sure that a test is one of this plan: its operations are there, each with a choice for every parameter,
    /// and all numbers are finite and in order. It need not lie within what the operations permit.
    pub fn validate_test(&self, test: &Test) -> Result<(), PlanError> {
        each("operations", &test.operations, |used| {
            at("operation", self.has_operation(used.operation))?;
            let operation = self.operation(used.operation);
            at("activation", self.sound_activation(&used.activation, operation))?;
            let (needed, chosen) = (operation.parameters.len(), used.parameters.len());
            at("parameters", require(needed == chosen, || format!("there are {chosen} instead of {needed}")))?;
            let mut domains = operation.parameters.iter().map(|parameter| &parameter.domain);
            each("parameters", &used.parameters, |choice| {
                domains.next().map_or(Ok(()), |domain| fits(choice, domain))
            })?;
            at("messages", used.messages.as_ref().map_or(Ok(()), |messages| self.sound_messages(messages, operation)))
        })
    }

    /// That an operation can meet the listed messages. It can be numbered as far as results can record.
    fn sound_messages(&self, messages: &Messages, operation: &Operation) -> Checked {
        let wires = self.wires_of(operation).len();
        messages.runs().iter().try_for_each(|run| {
            require((run.wire as usize) < wires, || format!("wire {} is not one of {wires}", run.wire))?;
            require(i64::try_from(run.last).is_ok(), || format!("{} is beyond 63 bits", run.last))
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
            MetricSource::Monitor { monitor, score } => self.sound_score(*monitor, *score),
        };
        at("source", sound)
    }

    fn field(&self, field: &FieldRef) -> Checked {
        at("topic", self.has_topic(field.topic))
    }

    fn sound_operation(&self, operation: &Operation) -> Checked {
        at("name", name(&operation.name))?;
        let beside = !operation.kind.acts_on_messages();
        at("kind.node", operation.kind.node().map_or(Ok(()), |id| self.has_node(id)))?;
        at("topic", operation.topic.map_or(Ok(()), |id| self.has_topic(id)))?;
        at("members", self.sound_members(operation, operation.topic, operation.members.as_ref()))?;
        each("further", &operation.further, |target| self.sound_target(operation, target))?;
        at("further", distinct(operation.topics()))?;
        at(
            "topic",
            require(operation.topic.is_some() != beside, || {
                if beside { "it acts on none".to_owned() } else { "it acts on one".to_owned() }
            }),
        )?;
        each("from", &operation.from, |&id| self.has_node(id))?;
        each("to", &operation.to, |&id| self.has_node(id))?;
        if let OperationKind::RandomText { texts } = &operation.kind {
            at("kind.texts", filled(texts))?;
        }
        if let OperationKind::RandomConstant { constants } = &operation.kind {
            at("kind.constants", require(!constants.is_empty(), || "there is none".to_owned()))?;
            at("kind.constants", distinct(constants.iter().map(|constant| &constant.name)))?;
            each("kind.constants", constants, |constant| finite(constant.number))?;
        }
        if let OperationKind::Scene { parameter, usual } = &operation.kind {
            let in_arguments = self
                .commands()
                .flat_map(|command| &command.arguments)
                .any(|text| has_placeholder(text, &operation.name));
            at("kind.usual", usual.map_or(Ok(()), finite))?;
            at(
                "kind.usual",
                require(parameter.is_some() || usual.is_some(), || {
                    "is not there, and programs are launched with it".to_owned()
                }),
            )?;
            at(
                "kind.parameter",
                require(parameter.is_none() == in_arguments, || {
                    let does = if in_arguments { "has both this and" } else { "has neither this nor" };
                    format!("`{}` {does} a place in the arguments of what is launched", operation.name)
                }),
            )?;
        }
        if let OperationKind::StuckAtConstant { numbers } = &operation.kind {
            each("kind.numbers", numbers, |number| finite(*number))?;
            let names = operation.parameters.first().and_then(|value| value.domain.items());
            let fits = names.is_some_and(|names| names.len() == numbers.len());
            at("kind.numbers", require(fits, || "there is not one for each name of a constant".to_owned()))?;
        }
        if let OperationKind::Set { values, .. } = &operation.kind {
            each("kind.values", values, |value| match value {
                NewValue::Number(number) => finite(*number),
                NewValue::Numbers(numbers) => numbers.iter().try_for_each(|&number| finite(number)),
                NewValue::Bool(_) | NewValue::Text(_) | NewValue::Bools(_) | NewValue::Texts(_) => Ok(()),
            })?;
            let texts = operation.parameters.first().and_then(|value| value.domain.items());
            let fits = texts.map_or(0, <[String]>::len) == values.len();
            at("kind.values", require(fits, || "there is not one for each text".to_owned()))?;
        }
        at("parameters", distinct(operation.parameters.iter().map(|parameter| &parameter.name)))?;
        each("parameters", &operation.parameters, |parameter| {
            at("name", name(&parameter.name))?;
            unit(parameter.unit.as_ref())?;
            at("domain", domain(&parameter.domain))
        })?;
        at("within", span(operation.within))?;
        at("lengths", operation.lengths.map_or(Ok(()), |found| lengths(found, operation.within)))?;
        at("inclusion", share(operation.inclusion))?;
        at("counted", sound_counts(operation))?;
        if let Some(turn) = operation.wrapped {
            let apart = turn.low < turn.high && (turn.high - turn.low).is_finite();
            at("wrapped", require(apart, || format!("{} to {} is no turn", turn.low, turn.high)))?;
            at("wrapped", require(operation.kind.adds(), || "it adds nothing to angles".to_owned()))?;
        }
        each("constraints", &operation.constraints, |constraint| match constraint {
            Constraint::Variable { metric } => at("metric", self.has_metric(*metric)),
            Constraint::Integer { bounds } => at("bounds", integers(*bounds)),
        })
    }

    /// That an operation can disturb another topic as it does its first.
    fn sound_target(&self, operation: &Operation, target: &Target) -> Checked {
        at("topic", self.has_topic(target.topic))?;
        at("members", self.sound_members(operation, Some(target.topic), target.members.as_ref()))?;
        let of_topics = operation.topic.is_some() && !matches!(operation.kind, OperationKind::Custom { .. });
        require(of_topics, || "it acts on one topic at most".to_owned())?;
        let chosen = |members: Option<&MembersOf>| matches!(members, Some(MembersOf::Chosen(_)));
        let same = chosen(operation.members.as_ref()) == chosen(target.members.as_ref());
        at("members", require(same, || "a test chooses those of all topics, or of none".to_owned()))?;
        let same = operation.places.is_empty() == target.places.is_empty();
        at("places", require(same, || "it acts on whole messages, or on values".to_owned()))
    }

    /// That the members on which an operation acts are there, with a text for each choice of them.
    fn sound_members(&self, operation: &Operation, topic: Option<TopicId>, members: Option<&MembersOf>) -> Checked {
        let Some(members) = members else { return Ok(()) };
        let count = match (topic, operation.kind.node()) {
            (Some(topic), _) => self.topic(topic).paths.len(),
            (None, Some(first)) => self.nodes.len() - first.index(),
            (None, None) => 0,
        };
        let these = |these: &Vec<u32>| {
            filled(these)?;
            require(these.is_sorted_by(|one, other| one < other), || "are not in ascending order".to_owned())?;
            these.iter().try_for_each(|&member| id("member", member as usize, count))
        };
        match members {
            MembersOf::These(members) => these(members),
            MembersOf::Chosen(choices) => {
                let texts = operation.choices_of_members();
                let fits = texts.is_some_and(|texts| texts.len() == choices.len());
                require(fits, || "are not chosen by the last parameter".to_owned())?;
                choices.iter().try_for_each(these)
            }
        }
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

    /// Checks that a task can be done with this plan: its tests, and what they refer to, are in the plan.
    pub fn validate_task(&self, task: &Task) -> Result<(), PlanError> {
        match task {
            Task::Campaign => Ok(()),
            Task::Known { tests, lab } => {
                at("lab", lab.as_deref().map_or(Ok(()), name))?;
                each("tests", tests, |&id| self.has_test(id))
            }
            Task::Undisturbed(Undisturbed { runs, relayed: _, equal_seeds: _, lab }) => {
                at("lab", lab.as_deref().map_or(Ok(()), name))?;
                at("runs", at_least_one(*runs))
            }
            Task::Repeat { test, .. } => at("test", self.validate_test(test)),
            Task::Shrink(shrinking) => self.sound_shrinking(shrinking),
            Task::ShrinkEach { each: tests } => {
                at("each", filled(tests))?;
                each("each", tests, |shrinking| self.sound_shrinking(shrinking))
            }
            Task::Variations(Variations { name: of, dimension: _, tests }) => {
                at("name", name(of))?;
                at("tests", filled(tests))?;
                each("tests", tests, |test| self.validate_test(test))
            }
            Task::Lab(of_lab) | Task::Compensated(of_lab) => {
                let LabTask { lab, results: _, tests, repeats } = of_lab;
                at("lab", name(lab))?;
                at("tests", filled(tests))?;
                at("tests", distinct(tests.iter().map(|test| test.number)))?;
                each("tests", tests, |test| at("test", self.validate_test(&test.test)))?;
                let repeated = |at: &usize| tests[..*at].iter().any(|before| before.test == tests[*at].test);
                if let Some(twice) = (1..tests.len()).find(repeated) {
                    return at(&format!("tests[{twice}].test"), wrong("is there twice"));
                }
                at("repeats", at_least_one(*repeats))
            }
        }
    }

    fn sound_shrinking(&self, shrinking: &Shrinking) -> Checked {
        let Shrinking { test, failing, runs, .. } = shrinking;
        at("test", self.validate_test(test))?;
        if let Failing::Violation { requirements, margins } = failing {
            at("failing.requirements", filled(requirements))?;
            each("failing.requirements", requirements, |&id| self.has_requirement(id))?;
            let sound = |&margin: &f64| margin.is_finite() && margin >= 0.0;
            if !(margins.is_empty() || margins.len() == requirements.len()) || !margins.iter().all(sound) {
                return at("failing.margins", wrong("is not one finite number of at least 0 for each requirement"));
            }
        }
        at("runs", at_least_one(*runs))
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

/// That the parameters by which a test counts messages are there, and are whole numbers from 1.
fn sound_counts(operation: &Operation) -> Checked {
    let counted = &operation.counted;
    require(counted.is_sorted_by(|one, other| one < other), || "are not in their order".to_owned())?;
    require(counted.is_empty() || operation.kind.acts_on_messages(), || "it acts on no messages".to_owned())?;
    let counting: Vec<_> = operation.counting_parameters().collect();
    require(counting.len() == counted.len(), || "lack a parameter".to_owned())?;
    counting.into_iter().try_for_each(|(counted, parameter)| {
        let is_count = |domain: &Domain| match domain {
            Domain::Number { low, shape: ChoiceKind::Value, integer: true, .. } => *low >= 1.0,
            _ => false,
        };
        let named = parameter.name == counted.name();
        require(named && is_count(&parameter.domain), || format!("`{}` counts no messages", parameter.name))
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LabTest;
    use crate::testing::{operation, plan, test_of, use_of};

    #[test]
    fn a_task_in_a_lab_has_different_tests_of_the_plan() {
        let plan = plan(vec![operation(0, OperationKind::Blackhole), operation(1, OperationKind::Blackhole)]);
        let of =
            |number, operation| LabTest { number, test: test_of(vec![use_of(operation, 1.0, 2.0, Vec::new(), 0)]) };
        let refused = |tests: Vec<LabTest>, repeats| {
            let task = Task::Lab(LabTask { lab: "hall".to_owned(), results: String::new(), tests, repeats });
            plan.validate_task(&task).map_err(|error| error.to_string())
        };
        assert_eq!(refused(vec![of(3, 0), of(4, 1)], 1), Ok(()));
        let said = |tests, repeats| refused(tests, repeats).unwrap_err();
        assert_eq!(said(vec![], 1), "tests: there is none");
        assert_eq!(said(vec![of(3, 0), of(3, 1)], 1), "tests: 3 is there twice");
        assert_eq!(said(vec![of(3, 0), of(4, 0)], 1), "tests[1].test: is there twice");
        assert_eq!(said(vec![of(3, 0)], 0), "repeats: must be at least 1");
        assert!(said(vec![of(3, 9)], 1).starts_with("tests[0].test.operations[0].operation: there is no operation 9"));
    }
}
