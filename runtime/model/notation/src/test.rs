//! Tests: the operations of a test with what it chose for each, when they are active, and what is expected of it.

use sesame_plan::{
    Activation, CampaignPlan, Expectation, MessageRun, Messages, Metric, MetricId, Moment, OperationKind, TestOperation,
};

use crate::condition;
use crate::text::block;
use crate::unit::Unit;

/// A `test` block of a name, with a line for each member.
pub fn test_block(doc: &str, name: &str, members: impl IntoIterator<Item = String>) -> String {
    block(doc, &format!("test {name}"), members)
}

/// An operation of a test of this plan, as a member of its block.
pub fn test_operation(plan: &CampaignPlan, used: &TestOperation) -> String {
    let operation = plan.operation(used.operation);
    let parameters = operation.parameters.iter();
    let choices = parameters.zip(&used.parameters).map(|(parameter, choice)| {
        (parameter.name.as_str(), Unit::of_parameter(&operation.kind, parameter).choice(choice))
    });
    let member = test_member(&operation.name, choices, &activation(plan, used), Some(used.operation_seed));
    let listed = used.messages.iter().map(|listed| format!(" messages {}", messages(listed)));
    std::iter::once(member).chain(listed).collect()
}

/// Messages that an operation of a test alters: `248..250, 12 on 2`. Wires count from 1, and the first is not written.
pub fn messages(messages: &Messages) -> String {
    let words = messages.runs().iter().map(|&MessageRun { wire, first, last }| {
        let last = if first == last { String::new() } else { format!("..{last}") };
        let wire = if wire == 0 { String::new() } else { format!(" on {}", u64::from(wire) + 1) };
        format!("{first}{last}{wire}")
    });
    words.collect::<Vec<_>>().join(", ")
}

/// The member of a `test` block of an operation's name, its choices by the names of parameters, its activation, and the
/// seed of its draws, which is 0 if none is written.
pub fn test_member<'a>(
    name: &str,
    choices: impl IntoIterator<Item = (&'a str, String)>,
    activation: &str,
    seed: Option<u64>,
) -> String {
    let mut words = vec![name.to_owned()];
    words.extend(choices.into_iter().flat_map(|(parameter, chosen)| [parameter.to_owned(), chosen]));
    words.push(activation.to_owned());
    words.extend(seed.map(|seed| format!("seed {seed}")));
    words.join(" ")
}

/// When an operation of a test of this plan is active.
pub fn activation(plan: &CampaignPlan, used: &TestOperation) -> String {
    activation_named(&used.activation, &plan.operation(used.operation).kind, &condition::named(&plan.metrics))
}

/// When an operation of a kind is active, with metrics of the names and units that a function gives.
pub fn activation_named<'a>(
    activation: &Activation,
    kind: &OperationKind,
    metric: &impl Fn(MetricId) -> (&'a str, Unit<'a>),
) -> String {
    let seconds = |time: &f64| Unit::SECONDS.number(*time);
    let words = |condition| condition::write_named(condition, metric);
    let often = |times: &u32| if *times == 1 { String::new() } else { format!(" at most {times} times") };
    match activation {
        Activation::Time { start, end } => format!("from {} to {}", seconds(start), seconds(end)),
        Activation::Condition { start, end, times } => {
            format!("when {} until {}{}", words(start), words(end), often(times))
        }
        Activation::ConditionFor { start, length, times } => {
            format!("when {} for {}{}", words(start), seconds(length), often(times))
        }
        Activation::Offline => match kind {
            OperationKind::Custom { moment: Moment::AfterEnd } => "after end".to_owned(),
            _ => "before start".to_owned(),
        },
    }
}

/// The seed of the simulator, as a member of a `test` block.
pub fn simulator_seed(seed: u64) -> String {
    format!("simulator seed {seed}")
}

/// That a requirement of this name is expected to be satisfied, as a member of a `test` block.
pub fn expected_requirement(requirement: &str) -> String {
    format!("expect {requirement}")
}

/// What is expected of a metric, as a member of a `test` block.
pub fn expectation(expected: &Expectation, metrics: &[Metric]) -> String {
    let metric = &metrics[expected.metric.index()];
    format!("expect {} {}", metric.name, Unit::named(metric.unit.as_deref()).bound(expected.bound))
}
