//! Changes of a value in place: of numbers, and of points coordinate by coordinate.

use sesame_plan::Choice;

use crate::value::Value;

/// The nearest whole number, with halves rounded away from zero; numbers beyond 64 bits are clamped.
#[expect(clippy::cast_possible_truncation, reason = "`as` clamps to the integer's range")]
fn nearest(x: f64) -> i64 {
    libm::round(x) as i64
}

/// A choice for a number, or for a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Amount {
    /// For each number.
    Number(f64),
    /// For each point.
    Point([f64; 3]),
}

impl Amount {
    /// The choice of a test; `None` for texts and ranges.
    pub(super) fn from_choice(choice: &Choice) -> Option<Self> {
        match choice {
            Choice::Value { value } => Some(Amount::Number(*value)),
            Choice::Point { point } => Some(Amount::Point(*point)),
            Choice::Range { .. } | Choice::Text { .. } => None,
        }
    }

    /// The amount on an axis; a number is the same on all axes.
    pub(super) fn on(self, axis: usize) -> f64 {
        match self {
            Amount::Number(number) => number,
            Amount::Point(point) => point[axis],
        }
    }
}

/// Adds to a number or to each coordinate, and returns whether this changed anything.
pub(super) fn add(value: &mut Value, mut by: impl FnMut(usize) -> f64) -> bool {
    match value {
        Value::Real(x) => put_real(x, *x + by(0)),
        Value::Int(n) => put(n, n.saturating_add(nearest(by(0)))),
        Value::Point(point) => each_axis(point, |axis, x| x + by(axis)),
        _ => false,
    }
}

/// Replaces a number or each coordinate by the result of `new`, and returns whether this changed anything.
pub(super) fn map(value: &mut Value, mut new: impl FnMut(usize, f64) -> f64) -> bool {
    match value {
        Value::Real(x) => put_real(x, new(0, *x)),
        Value::Int(n) => put(n, nearest(new(0, *n as f64))),
        Value::Point(point) => each_axis(point, new),
        _ => false,
    }
}

fn each_axis(point: &mut [f64; 3], mut new: impl FnMut(usize, f64) -> f64) -> bool {
    let mut changed = false;
    for (axis, x) in point.iter_mut().enumerate() {
        changed |= put_real(x, new(axis, *x));
    }
    changed
}

/// Numbers differ if they compare unequal: zeros of both signs are equal, and so are all NaNs.
fn put_real(place: &mut f64, new: f64) -> bool {
    let changed = *place != new && !(place.is_nan() && new.is_nan());
    *place = new;
    changed
}

pub(super) fn put<T: PartialEq>(place: &mut T, new: T) -> bool {
    let changed = *place != new;
    *place = new;
    changed
}
