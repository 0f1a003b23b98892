//! What is wrong with a plan, and the checks of single numbers, names and lists.

use std::collections::BTreeSet;
use std::fmt;

use crate::condition::Integers;
use crate::{Lengths, Span};

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

pub(super) type Checked = Result<(), PlanError>;

pub(super) fn wrong(problem: impl Into<String>) -> Checked {
    Err(PlanError { place: String::new(), problem: problem.into() })
}

pub(super) fn require(holds: bool, problem: impl FnOnce() -> String) -> Checked {
    if holds { Ok(()) } else { wrong(problem()) }
}

/// Says of a problem inside a part where that part is.
pub(super) fn at(part: &str, checked: Checked) -> Checked {
    checked.map_err(|PlanError { place, problem }| {
        let joined = match place.chars().next() {
            None => part.to_owned(),
            Some('[') => format!("{part}{place}"),
            Some(_) => format!("{part}.{place}"),
        };
        PlanError { place: joined, problem }
    })
}

pub(super) fn each<'t, T>(part: &str, items: &'t [T], mut check: impl FnMut(&'t T) -> Checked) -> Checked {
    items.iter().enumerate().try_for_each(|(index, item)| at(part, at(&format!("[{index}]"), check(item))))
}

pub(super) fn id(of: &str, index: usize, count: usize) -> Checked {
    require(index < count, || format!("there is no {of} {index}, there are {count}"))
}

pub(super) fn finite(number: f64) -> Checked {
    require(number.is_finite(), || format!("{number} is not finite"))
}

pub(super) fn positive(number: f64) -> Checked {
    require(number.is_finite() && number > 0.0, || format!("{number} is not above 0"))
}

pub(super) fn share(number: f64) -> Checked {
    require((0.0..=1.0).contains(&number), || format!("{number} is not in 0..=1"))
}

pub(super) fn positive_share(number: f64) -> Checked {
    share(number)?;
    positive(number)
}

pub(super) fn at_least_one(count: u32) -> Checked {
    require(count >= 1, || "must be at least 1".to_owned())
}

pub(super) fn ordered(low: f64, high: f64) -> Checked {
    finite(low)?;
    finite(high)?;
    finite(high - low)?;
    require(low <= high, || format!("runs from {low} to {high}"))
}

pub(super) fn span(span: Span) -> Checked {
    require(span.start >= 0.0, || format!("begins at {}, before the start", span.start))?;
    ordered(span.start, span.end)
}

pub(super) fn lengths(lengths: Lengths, within: Span) -> Checked {
    let Lengths { low, high } = lengths;
    ordered(low, high)?;
    require(low >= 0.0, || format!("{low} is below 0"))?;
    positive(high)?;
    let room = within.length();
    require(low <= room || lengths.contain(room), || format!("windows of {low} s do not fit into {room} s"))
}

pub(super) fn integers(integers: Integers) -> Checked {
    /// Beyond it, not every whole number is an `f64`.
    const MOST: i64 = 1 << 53;
    let Integers { lowest, highest } = integers;
    require(-MOST <= lowest && lowest <= highest && highest <= MOST, || {
        format!("there are no whole numbers from {lowest} to {highest} within 2^53")
    })
}

pub(super) fn filled<T>(list: &[T]) -> Checked {
    require(!list.is_empty(), || "there is none".to_owned())
}

/// Names and units are shown on terminals, and written into files of other formats.
pub(super) fn name(name: &str) -> Checked {
    require(!name.is_empty(), || "is empty".to_owned())?;
    require(!name.chars().any(char::is_control), || format!("{name:?} has control characters"))
}

/// A unit, where there is one.
pub(super) fn unit(unit: Option<&String>) -> Checked {
    at("unit", unit.map_or(Ok(()), |unit| name(unit)))
}

pub(super) fn distinct<T: Ord + fmt::Debug>(items: impl IntoIterator<Item = T>) -> Checked {
    let mut seen = BTreeSet::new();
    for item in items {
        if seen.contains(&item) {
            return wrong(format!("{item:?} is there twice"));
        }
        seen.insert(item);
    }
    Ok(())
}
