//! Values in units: numbers, ranges, points, boxes, and what a test chose.

use sesame_plan::{Bound, Choice, OperationKind, Parameter};

use crate::number::decimal;
use crate::text::quoted;

/// What the numbers of a plan are in. Each is written so that it reads back as the same number in the same unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit<'a> {
    /// Plain numbers.
    None,
    /// Numbers of this unit.
    Symbol(&'a str),
    /// Fractions, written as percentages: the plan has 0.3 where the language has `30%`.
    Share,
}

impl<'a> Unit<'a> {
    /// Seconds, the unit of simulation time.
    pub const SECONDS: Unit<'static> = Unit::Symbol("s");

    /// The unit of a metric, a field or a topic.
    pub fn named(symbol: Option<&'a str>) -> Unit<'a> {
        symbol.map_or(Unit::None, Unit::Symbol)
    }

    /// The unit of a parameter of an operation of this kind.
    pub fn of_parameter(kind: &OperationKind, parameter: &'a Parameter) -> Unit<'a> {
        if parameter.is_probability(kind) { Unit::Share } else { Unit::named(parameter.unit.as_deref()) }
    }

    /// What stands behind a number.
    pub fn symbol(self) -> &'a str {
        match self {
            Unit::None => "",
            Unit::Symbol(symbol) => symbol,
            Unit::Share => "%",
        }
    }

    fn digits(self, x: f64) -> String {
        decimal(x, if self == Unit::Share { 2 } else { 0 })
    }

    /// A number: `-0.3rad`.
    pub fn number(self, x: f64) -> String {
        format!("{}{}", self.digits(x), self.symbol())
    }

    /// A range: `[0s, 65s]`.
    pub fn range(self, low: f64, high: f64) -> String {
        format!("[{}, {}]", self.number(low), self.number(high))
    }

    /// A point: `(1, 2, 0.5)m`.
    pub fn point(self, point: [f64; 3]) -> String {
        let [x, y, z] = point.map(|coordinate| self.digits(coordinate));
        format!("({x}, {y}, {z}){}", self.symbol())
    }

    /// A box between two corners: `[(0, 0, 0)m, (1, 1, 1)m]`.
    pub fn corners(self, low: [f64; 3], high: [f64; 3]) -> String {
        format!("[{}, {}]", self.point(low), self.point(high))
    }

    /// What a test chose for a parameter of this unit.
    pub fn choice(self, choice: &Choice) -> String {
        match choice {
            Choice::Value { value } => self.number(*value),
            Choice::Range { low, high } => self.range(*low, *high),
            Choice::Point { point } => self.point(*point),
            Choice::Text { text } => quoted(text),
        }
    }

    /// A bound on a metric of this unit: `<= 0`, `in [1s, 2s]`.
    pub fn bound(self, bound: Bound) -> String {
        let (sign, value) = match bound {
            Bound::AtMost { value } => ("<=", value),
            Bound::Below { value } => ("<", value),
            Bound::AtLeast { value } => (">=", value),
            Bound::Above { value } => (">", value),
            Bound::Equal { value } => ("==", value),
            Bound::Within { low, high } => return format!("in {}", self.range(low, high)),
        };
        format!("{sign} {}", self.number(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_written_with_their_unit() {
        let metres = Unit::named(Some("m"));
        assert_eq!(metres.number(-0.25), "-0.25m");
        assert_eq!(Unit::SECONDS.range(0.0, 65.0), "[0s, 65s]");
        assert_eq!(metres.corners([-1.0, 0.0, 1e-9], [1.0, 2.0, 3.0]), "[(-1, 0, 1e-9)m, (1, 2, 3)m]");
        assert_eq!(Unit::None.choice(&Choice::Text { text: "a \"b\"".to_owned() }), r#""a \"b\"""#);
        assert_eq!(Unit::None.bound(Bound::Within { low: 1.0, high: 2.0 }), "in [1, 2]");
        assert_eq!(metres.bound(Bound::AtMost { value: 0.1 }), "<= 0.1m");
    }

    #[test]
    fn fractions_are_written_as_percentages_without_noise() {
        let written = [0.0, 0.07, 0.123, 0.999, 1.0].map(|share| Unit::Share.number(share));
        assert_eq!(written, ["0%", "7%", "12.3%", "99.9%", "100%"]);
    }
}
