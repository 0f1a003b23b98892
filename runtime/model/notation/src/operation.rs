//! Operations of the space: what they do, what they permit, and the clauses behind it.

use sesame_plan::condition::{Constraint, Integers};
use sesame_plan::{
    CampaignPlan, Counted, Distribution, Domain, Drain, FieldRef, Lengths, MembersOf, Metric, NewValue, Operation,
    OperationKind, Parameter, Span, TargetRef, Topic, value_path_in_words, without_member,
};

use crate::monitor::unit_in;
use crate::text::{list, one_of, quoted};
use crate::unit::Unit;

/// An operation of a plan in one line, with every clause that it can have: no default is left out.
pub fn operation(plan: &CampaignPlan, operation: &Operation) -> String {
    if let OperationKind::Scene { parameter, usual } = &operation.kind {
        return scene(operation, parameter.as_deref(), *usual);
    }
    let mut line = format!("operation {}", operation.name);
    let targets: Vec<String> =
        operation.targets().flat_map(|target| written(plan.topic(target.topic), operation, target)).collect();
    if !targets.is_empty() {
        line = format!("{line} on {}{}", chosen(operation), targets.join(", "));
    }
    if let Some(resource) = resource(plan, operation) {
        line = format!("{line} on {resource}");
    }
    for (word, nodes) in [("from", &operation.from), ("to", &operation.to)] {
        let names: Vec<&str> = nodes.iter().map(|node| plan.nodes[node.index()].name.as_str()).collect();
        if !names.is_empty() {
            line = format!("{line} {word} {}", names.join(", "));
        }
    }
    let clauses = Clauses {
        within: (!operation.kind.is_offline()).then_some(operation.within),
        lengths: operation.lengths,
        priority: Some(operation.priority),
        inclusion: Some(operation.inclusion),
        counted: operation.counting_parameters().map(|(counted, parameter)| count(counted, parameter)).collect(),
        untimed: !operation.timed,
        wrapped: operation.wrapped.map(|turn| unit_of_places(plan, operation).range(turn.low, turn.high)),
        start_contains: operation.constraints.iter().map(|comparison| constraint(comparison, &plan.metrics)).collect(),
    };
    format!("{line} = {}{}", disturbance(operation), clauses.write())
}

/// How many messages a test may count out.
fn count(counted: Counted, parameter: &Parameter) -> String {
    let range = match &parameter.domain {
        Domain::Number { low, high, .. } => Unit::None.range(*low, *high),
        _ => String::new(),
    };
    format!("{} {range} messages", counted.name())
}

/// The unit of the values that an operation changes.
fn unit_of_places<'a>(plan: &'a CampaignPlan, operation: &Operation) -> Unit<'a> {
    let field = operation.topic.map(|topic| FieldRef { topic, path: Vec::new() });
    let place = operation.places.first().map_or(&[][..], Vec::as_slice);
    field.and_then(|field| unit_in(plan, &field, place)).unwrap_or(Unit::None)
}

/// A parameter of the simulator that tests choose.
fn scene(operation: &Operation, known_as: Option<&str>, usual: Option<f64>) -> String {
    let known_as = known_as.filter(|&known_as| known_as != operation.name);
    let known_as = known_as.map_or(String::new(), |known_as| format!(" {}", quoted(known_as)));
    let domain = operation.parameters.first().map(|value| {
        let unit = Unit::named(value.unit.as_deref());
        let Domain::Number { low, high, integer, .. } = &value.domain else { return String::new() };
        let of = value.unit.as_ref().map_or(String::new(), |unit| format!("[{unit}]"));
        let usual = usual.map_or(String::new(), |usual| format!(" default {}", unit.number(usual)));
        format!("{}{of} in {}{usual}", if *integer { "int" } else { "real" }, unit.range(*low, *high))
    });
    format!("parameter {}{known_as}: {}", operation.name, domain.unwrap_or_default())
}

/// The places in the messages of a topic that an operation changes, with the members of a group on which it acts.
fn written(topic: &Topic, operation: &Operation, target: TargetRef<'_>) -> Vec<String> {
    let members = (0u32..).zip(&topic.paths).map(|(member, _)| member);
    let candidates: Vec<u32> = members.filter(|&member| operation.may_act_on(target.topic, member as usize)).collect();
    let topics: Vec<String> = if candidates.len() == topic.paths.len() {
        vec![topic.name.clone()]
    } else {
        candidates.into_iter().map(|member| topic.member_in_words(member)).collect()
    };
    let places = || target.places.iter().map(|place| value_path_in_words(place));
    if target.places.is_empty() {
        return topics;
    }
    topics.iter().flat_map(|topic| places().map(move |place| format!("{topic}{place}"))).collect()
}

/// How many members of a group a test chooses, as it is written before their names; empty where it chooses none.
fn chosen(operation: &Operation) -> String {
    let Some(MembersOf::Chosen(choices)) = &operation.members else { return String::new() };
    let sizes = || choices.iter().map(Vec::len);
    match (sizes().min().unwrap_or(1), sizes().max().unwrap_or(1)) {
        (1, 1) => "one of ".to_owned(),
        (least, most) if least == most => format!("{least} of "),
        (least, most) => format!("{least}..{most} of "),
    }
}

/// The node or the parameter on which an operation acts, if it acts on one instead of messages: with how many of the
/// members of a group a test chooses.
pub fn resource(plan: &CampaignPlan, operation: &Operation) -> Option<String> {
    let node = plan.node(operation.kind.node()?).name.as_str();
    let node = match &operation.members {
        None => node.to_owned(),
        // A group is written by its name alone.
        Some(_) => format!("{}{}", chosen(operation), without_member(node)),
    };
    Some(match &operation.kind {
        OperationKind::Set { parameter, .. } => format!("parameter {} of {node}", quoted(parameter)),
        _ => format!("node {node}"),
    })
}

/// The clauses behind an operation. One that is `None`, false or empty is not written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Clauses {
    /// The time outside of which it is never active.
    pub within: Option<Span>,
    /// How long it is active at a time.
    pub lengths: Option<Lengths>,
    /// Its priority.
    pub priority: Option<i32>,
    /// The probability, a fraction, that a fresh test contains it.
    pub inclusion: Option<f64>,
    /// Which messages of an activation it alters.
    pub counted: Vec<String>,
    /// Whether its active time does not count.
    pub untimed: bool,
    /// The turn in which angles stay.
    pub wrapped: Option<String>,
    /// What its start conditions contain.
    pub start_contains: Vec<String>,
}

impl Clauses {
    /// The clauses, each after a space.
    pub fn write(&self) -> String {
        let clauses = [
            (!self.counted.is_empty()).then(|| format!(" {}", self.counted.join(" "))),
            self.lengths.map(|lengths| format!(" for {}", Unit::SECONDS.range(lengths.low, lengths.high))),
            self.within.map(|within| format!(" within {}", Unit::SECONDS.range(within.start, within.end))),
            self.priority.map(|priority| format!(" priority {priority}")),
            self.inclusion.map(|inclusion| format!(" inclusion {}", Unit::Share.number(inclusion))),
            self.untimed.then(|| " untimed".to_owned()),
            self.wrapped.as_ref().map(|turn| format!(" wrapped {turn}")),
            (!self.start_contains.is_empty()).then(|| format!(" start contains {}", self.start_contains.join(", "))),
        ];
        clauses.into_iter().flatten().collect()
    }
}

/// What a start condition has to contain: a variable, or an integer within bounds.
pub fn constraint(constraint: &Constraint, metrics: &[Metric]) -> String {
    match *constraint {
        Constraint::Variable { metric } => metrics[metric.index()].name.clone(),
        Constraint::Integer { bounds } => integer_constraint(bounds),
    }
}

/// The constraint that a start condition contains an integer within bounds.
pub fn integer_constraint(bounds: Integers) -> String {
    format!("integer [{}, {}]", bounds.lowest, bounds.highest)
}

/// What an operation does and permits.
fn disturbance(operation: &Operation) -> String {
    let words = operation.kind.words();
    // Which members a test chooses stands before their names, and which messages behind the kind.
    let parameters = operation.own_parameters();
    let permitted: Vec<String> = match (&operation.kind, axes(parameters)) {
        (OperationKind::RandomValue { .. }, Some((unit, low, high))) => vec![unit.corners(low, high)],
        _ => parameters.iter().map(|parameter| permitted(&operation.kind, parameter)).collect(),
    };
    match &operation.kind {
        OperationKind::Custom { .. } => {
            let parameters = parameters.iter().map(|parameter| {
                format!(
                    "{}: {}  ",
                    parameter.name,
                    custom_domain(&parameter.domain, Unit::named(parameter.unit.as_deref()))
                )
            });
            format!("{words} {{ {}}}", parameters.collect::<String>())
        }
        OperationKind::RandomText { texts } => format!("{words} {}", list(texts)),
        OperationKind::RandomConstant { constants } => {
            let names: Vec<&str> = constants.iter().map(|constant| constant.name.as_str()).collect();
            format!("{words} {}", names.join(", "))
        }
        // Names of constants stand without quotes.
        OperationKind::StuckAtConstant { .. } => {
            let names = operation.parameters.first().and_then(|value| value.domain.items()).unwrap_or_default();
            format!("{words} {}{}", if names.len() > 1 { "one of " } else { "" }, names.join(", "))
        }
        OperationKind::Set { values, .. } if !values.is_empty() => {
            let texts = operation.parameters.first().and_then(|value| value.domain.items()).unwrap_or_default();
            let written = values.iter().zip(texts).map(|(value, text)| match value {
                NewValue::Text(text) => quoted(text),
                _ => text.clone(),
            });
            let written: Vec<String> = written.collect();
            format!("{words} {}{}", if written.len() > 1 { "one of " } else { "" }, written.join(", "))
        }
        OperationKind::BurstLoss => {
            let clauses =
                parameters.iter().zip(&permitted).map(|(parameter, range)| format!("{} {range}  ", parameter.name));
            format!("{words} {{ {}}}", clauses.collect::<String>())
        }
        OperationKind::Latency { distribution, drain } => {
            let distribution = match distribution {
                Distribution::Fixed => "fixed",
                Distribution::Uniform => "uniform",
                Distribution::Normal => "normal",
            };
            format!("{words} {} {distribution} drain {}", permitted.join(" "), drain_word(*drain))
        }
        OperationKind::Reorder { drain } => format!("{words} {} drain {}", permitted.join(" "), drain_word(*drain)),
        _ if permitted.is_empty() => words.to_owned(),
        _ => format!("{words} {}", permitted.join(" ")),
    }
}

/// The corners of the box that three parameters of a random point span, and their unit.
fn axes(parameters: &[Parameter]) -> Option<(Unit<'_>, [f64; 3], [f64; 3])> {
    let ends = parameters.iter().map(|parameter| match parameter.domain {
        Domain::Number { low, high, .. } => Some((low, high)),
        _ => None,
    });
    let ends: [(f64, f64); 3] = ends.collect::<Option<Vec<_>>>()?.try_into().ok()?;
    let unit = Unit::named(parameters[0].unit.as_deref());
    Some((unit, ends.map(|(low, _)| low), ends.map(|(_, high)| high)))
}

fn drain_word(drain: Drain) -> &'static str {
    match drain {
        Drain::Finish => "finish",
        Drain::Flush => "flush",
        Drain::Drop => "drop",
    }
}

/// What is permitted for a parameter of any operation but a custom one.
fn permitted(kind: &OperationKind, parameter: &Parameter) -> String {
    let unit = Unit::of_parameter(kind, parameter);
    match &parameter.domain {
        Domain::Number { low, high, .. } => unit.range(*low, *high),
        Domain::Point { low, high } => unit.corners(*low, *high),
        Domain::Texts { texts: items } | Domain::Files { files: items } => one_of(items),
    }
}

/// What a parameter of a custom operation permits, behind its name and colon.
pub fn custom_domain(domain: &Domain, unit: Unit<'_>) -> String {
    match domain {
        Domain::Number { low, high, integer, .. } => {
            format!("{} {}", if *integer { "int" } else { "real" }, unit.range(*low, *high))
        }
        Domain::Point { low, high } => format!("point {}", unit.corners(*low, *high)),
        Domain::Texts { texts } => one_of(texts),
        Domain::Files { files } => format!("file {}", one_of(files)),
    }
}
