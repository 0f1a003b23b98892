//! Elements of lists in messages: which of them the steps of a path choose.

use std::ops::Range;

use sesame_plan::{Compared, Filter, FilterKey, Step};

use crate::value::{Record, Value};

/// What a path leads to.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Found<'v> {
    /// A value.
    Value(&'v Value),
    /// A coordinate of a point.
    Coordinate(f64),
}

/// Visits what a path of steps leads to, in order, from a value that lies in the record `beside`, if it lies in one.
/// What is not there is not visited: elements beyond the end of a list, and values that are not of their declared type.
pub(crate) fn visit<'v>(
    value: &'v Value,
    beside: Option<&'v Record>,
    steps: &[Step],
    found: &mut impl FnMut(Found<'v>),
) {
    let Some((step, rest)) = steps.split_first() else { return found(Found::Value(value)) };
    match (step, value) {
        (Step::Field(name), Value::Record(record)) => {
            if let Some(field) = record.get(name) {
                visit(field, Some(record), rest, found);
            }
        }
        (Step::Field(axis), Value::Point(point)) if rest.is_empty() => {
            if let Some(axis) = ["x", "y", "z"].iter().position(|name| name == axis) {
                found(Found::Coordinate(point[axis]));
            }
        }
        (step, Value::List(items)) => {
            for at in chosen(step, items, beside) {
                visit(&items[at], None, rest, found);
            }
        }
        _ => {}
    }
}

/// The positions of the elements that a step chooses, of a list that lies in the record `beside`, if it lies in one.
pub(crate) fn chosen<'a>(
    step: &'a Step,
    items: &'a [Value],
    beside: Option<&'a Record>,
) -> impl Iterator<Item = usize> + 'a {
    let passes = move |&at: &usize| match step {
        Step::Filter(filter) => passes(filter, at, &items[at], beside),
        _ => true,
    };
    positions(step, items.len()).filter(passes)
}

/// The positions of the elements that a step chooses without regard to their values.
pub(crate) fn positions(step: &Step, length: usize) -> Range<usize> {
    let (first, end) = match step {
        Step::Field(_) => (0, 0),
        Step::Element(at) => (*at as usize, (*at as usize).saturating_add(1)),
        Step::Elements { first, last } => (*first as usize, (*last as usize).saturating_add(1)),
        Step::Each | Step::Filter(_) => (0, length),
    };
    first.min(length)..end.min(length)
}

fn passes(filter: &Filter, at: usize, element: &Value, beside: Option<&Record>) -> bool {
    match &filter.key {
        FilterKey::Own(path) => match element.at(path) {
            Some(value) => is_so(filter, Found::Value(value)),
            None => element.coordinate_at(path).is_some_and(|number| is_so(filter, Found::Coordinate(number))),
        },
        FilterKey::Parallel(name) => match beside.and_then(|record| record.get(name)) {
            Some(Value::List(keys)) => keys.get(at).is_some_and(|key| is_so(filter, Found::Value(key))),
            _ => false,
        },
    }
}

/// Whether a value compares as a filter wants it.
fn is_so(filter: &Filter, value: Found<'_>) -> bool {
    use sesame_plan::Comparison::{Equal, NotEqual};
    let equality = |equal: bool| match filter.by {
        Equal => equal,
        NotEqual => !equal,
        _ => false,
    };
    match (&filter.with, value) {
        (Compared::Text(wanted), Found::Value(Value::Text(text))) => equality(text == wanted.as_str()),
        (Compared::Truth(wanted), Found::Value(Value::Bool(truth))) => equality(truth == wanted),
        (Compared::Number { value: wanted, .. }, Found::Value(value)) => {
            value.number().is_some_and(|number| filter.by.holds(number, wanted.0))
        }
        (Compared::Number { value: wanted, .. }, Found::Coordinate(number)) => filter.by.holds(number, wanted.0),
        _ => false,
    }
}
