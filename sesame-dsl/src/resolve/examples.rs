//! Examples in messages: what they write can be pasted, so they are made of what the space declares.

use sesame_notation::quoted;

use super::quantity::percent;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, ChoiceKind, Domain, Moment, OperationKind, Parameter, Range};
use crate::span::Span;
use crate::syntax::ast::eddi::{Eddi, State};
use crate::units::{Unit, convert};

/// When an operation that may act at any time does so in an example, in seconds.
const ALL_ALONG: Range = Range { low: 8.0, high: 57.0 };

impl Resolver<'_> {
    /// Reports that something lacks a clause. The example fits into the block that begins after `at`.
    pub(super) fn missing(&mut self, at: Span, of: &str, what: &str, example: &str) {
        let title = format!("`{of}` is missing {what}");
        let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, at, title).label(format!("add {what}"));
        self.report(diagnostic.note(format!("for example `{example}`")));
    }

    /// A name of a kind that the space declares, or another one for an example where it declares none.
    pub(super) fn declared_or<'n>(&'n self, kind: Kind, otherwise: &'n str) -> &'n str {
        self.names_of(kind).first().copied().unwrap_or(otherwise)
    }

    /// The objectives of a campaign: a metric with a direction.
    pub(super) fn example_of_objectives(&self) -> String {
        let directed = self.file.metrics.iter().find(|metric| !metric.directions.is_empty());
        format!("objectives {}", directed.map_or("fuzzing_time", |metric| metric.head.name.text.as_str()))
    }

    /// An operation in a test.
    pub(super) fn example_of_use(&self) -> String {
        let used = self.operations.iter().flatten().find_map(use_in_a_test);
        used.unwrap_or_else(|| "jitter offset [0.1rad, 0.2rad] from 8s to 57s".to_owned())
    }
}

/// How a test uses an operation at a time; nothing for one that needs a condition.
fn use_in_a_test(operation: &model::Operation) -> Option<String> {
    let written = operation.parameters.iter().map(|parameter| choice(parameter, &operation.kind));
    let mut words = vec![operation.declaration.name.clone()];
    words.extend(written);
    if !operation.constraints.is_empty() {
        return None;
    }
    words.push(match &operation.kind {
        OperationKind::Custom { moment: Moment::BeforeStart } | OperationKind::Scene { .. } => {
            "before start".to_owned()
        }
        OperationKind::Custom { moment: Moment::AfterEnd } => "after end".to_owned(),
        _ => {
            let within = operation.within.unwrap_or(ALL_ALONG);
            let lasts = operation.lengths.map_or(f64::INFINITY, |lengths| lengths.high);
            format!("from {}s to {}s", within.low, within.high.min(within.low + lasts))
        }
    });
    Some(words.join(" "))
}

/// A guarantee of a monitor, with what it needs unless a topic says whether it holds; nothing if there is no evidence.
pub(super) fn of_guarantee(eddi: &Eddi) -> Option<String> {
    if matches!(eddi.state, State::External(_, Some(_))) {
        return Some("guarantee safe  integrity 1".to_owned());
    }
    Some(format!("guarantee safe  integrity 1 = {}", of_evidence(eddi)?))
}

/// Evidence of a monitor, or a demand.
pub(super) fn of_evidence(eddi: &Eddi) -> Option<&str> {
    let evidence = eddi.evidence.first().map(|evidence| &evidence.head);
    let head = evidence.or_else(|| eddi.demands.first().map(|demand| &demand.head));
    head.map(|head| head.name.text.as_str())
}

/// What a test chooses for a parameter, with its name.
pub(super) fn choice(parameter: &Parameter, kind: &OperationKind) -> String {
    format!("{} {}", parameter.name, value(parameter, kind))
}

/// A value that is permitted for a parameter.
pub(super) fn value(parameter: &Parameter, kind: &OperationKind) -> String {
    let count = matches!(parameter.domain, Domain::Number { integer: true, .. });
    let probability = kind.has_probabilities() && !count;
    let unit = parameter.unit.as_ref().map_or("", Unit::text);
    let number = |value: f64| {
        if probability { format!("{}%", convert(value, None, Some(&percent()))) } else { format!("{value}{unit}") }
    };
    match &parameter.domain {
        Domain::Number { range, shape: ChoiceKind::Value, .. } => number(range.low),
        Domain::Number { range, shape: ChoiceKind::Range, .. } => {
            format!("[{}, {}]", number(range.low), number(range.high))
        }
        Domain::Point { low: [x, y, z], .. } => format!("({x}, {y}, {z}){unit}"),
        Domain::Texts(items) | Domain::Files(items) => quoted(items.first().map_or("", String::as_str)),
    }
}

/// Whether a test can choose only one value for a parameter.
pub(super) fn is_fixed(parameter: &Parameter) -> bool {
    match &parameter.domain {
        Domain::Number { range, .. } => range.low == range.high,
        Domain::Point { low, high } => low == high,
        Domain::Texts(items) | Domain::Files(items) => items.len() == 1,
    }
}
