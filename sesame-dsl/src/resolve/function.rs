//! The functions inside formulas: their arguments and units.

use super::Resolver;
use super::formula::{AGGREGATES, Number, scaled};
use super::score::scores;
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{BinaryFunction, Expression, Input, UnaryFunction};
use crate::similar::most_similar;
use crate::span::Span;
use crate::synonyms::meanings;
use crate::syntax::ast::{self, Name};
use crate::units::{Dimension, Unit, convert, dimension, square_root};

/// What a function computes.
#[derive(Clone, Copy)]
enum Computes {
    Absolute,
    Least,
    Greatest,
    Distance,
    SignedDistance,
    /// From the values of successive messages.
    Memory,
    /// An angle without whole turns.
    Wrapped,
    AngleBetween,
    Unary(UnaryFunction, Takes, Gives),
    /// A function of two numbers of one dimension, unless it takes plain ones.
    Binary(BinaryFunction, Takes, Gives),
}

/// What a number must be to be an argument.
#[derive(Clone, Copy)]
enum Takes {
    /// In any unit.
    Any,
    /// In a unit that is a square.
    Square,
    Plain,
    /// An angle, which is converted to radians.
    Angle,
}

/// The unit of a value.
#[derive(Clone, Copy)]
enum Gives {
    /// The unit of the arguments; for a square, the unit of its root.
    Same,
    Plain,
    Angle,
}

/// All functions. `sesamec` lists them in this order.
const FUNCTIONS: &[(&str, Computes)] = &[
    ("abs", Computes::Absolute),
    ("min", Computes::Least),
    ("max", Computes::Greatest),
    ("distance", Computes::Distance),
    ("signed_distance", Computes::SignedDistance),
    ("previous", Computes::Memory),
    ("rate", Computes::Memory),
    ("integral", Computes::Memory),
    ("wrapped", Computes::Wrapped),
    ("unwrapped", Computes::Memory),
    ("angle_between", Computes::AngleBetween),
    ("sqrt", Computes::Unary(UnaryFunction::Sqrt, Takes::Square, Gives::Same)),
    ("hypot", Computes::Binary(BinaryFunction::Hypot, Takes::Any, Gives::Same)),
    ("sin", Computes::Unary(UnaryFunction::Sin, Takes::Angle, Gives::Plain)),
    ("cos", Computes::Unary(UnaryFunction::Cos, Takes::Angle, Gives::Plain)),
    ("tan", Computes::Unary(UnaryFunction::Tan, Takes::Angle, Gives::Plain)),
    ("asin", Computes::Unary(UnaryFunction::Asin, Takes::Plain, Gives::Angle)),
    ("acos", Computes::Unary(UnaryFunction::Acos, Takes::Plain, Gives::Angle)),
    ("atan", Computes::Unary(UnaryFunction::Atan, Takes::Plain, Gives::Angle)),
    ("atan2", Computes::Binary(BinaryFunction::Atan2, Takes::Any, Gives::Angle)),
    ("exp", Computes::Unary(UnaryFunction::Exp, Takes::Plain, Gives::Plain)),
    ("ln", Computes::Unary(UnaryFunction::Ln, Takes::Plain, Gives::Plain)),
    ("pow", Computes::Binary(BinaryFunction::Pow, Takes::Plain, Gives::Plain)),
];

/// Whether a function inside formulas has this name.
pub(super) fn is_function(name: &str) -> bool {
    FUNCTIONS.iter().any(|(known, _)| *known == name)
}

impl Gives {
    /// The unit of a value computed from arguments in a unit.
    fn unit(self, of_arguments: Option<Unit>) -> Option<Unit> {
        match self {
            Gives::Same => of_arguments,
            Gives::Plain => None,
            Gives::Angle => Some(Unit::radians()),
        }
    }
}

impl<'a> Resolver<'a> {
    pub(super) fn call(
        &mut self,
        inputs: &mut Vec<Input>,
        call: &'a ast::Expression,
        name: &'a Name,
        arguments: &'a [ast::Expression],
    ) -> Option<Number> {
        let computes = FUNCTIONS.iter().find(|(known, _)| *known == name.text).map(|(_, computes)| *computes);
        let all: Vec<&ast::Expression> = arguments.iter().collect();
        let takes = match (computes, arguments) {
            (Some(Computes::Absolute), [of]) => {
                let (of, unit) = self.number(inputs, of)?;
                return Some((Expression::Absolute(Box::new(of)), unit));
            }
            (Some(Computes::Least), [_, _, ..]) => {
                return self.common(inputs, &all).map(|(of, unit)| (Expression::Min(of), unit));
            }
            (Some(Computes::Greatest), [_, _, ..]) => {
                return self.common(inputs, &all).map(|(of, unit)| (Expression::Max(of), unit));
            }
            (Some(Computes::Distance), _) => return self.distance(inputs, call.span, arguments),
            (Some(Computes::SignedDistance), [from, to]) => return self.signed_distance(inputs, from, to),
            (Some(Computes::Wrapped), [of]) => {
                let (number, unit) = self.number(inputs, of)?;
                let turn = self.turn(&name.text, of.span, unit.as_ref())?;
                return Some((without_turns(number, turn), unit));
            }
            (Some(Computes::AngleBetween), [from, to]) => {
                let (numbers, unit) = self.common(inputs, &[from, to])?;
                let turn = self.turn(&name.text, from.span, unit.as_ref())?;
                let [from, to] = <[Expression; 2]>::try_from(numbers).expect("two arguments give two numbers");
                let apart = Expression::Sum(vec![from, Expression::Negate(Box::new(to))]);
                return Some((Expression::Absolute(Box::new(without_turns(apart, turn))), unit));
            }
            (Some(Computes::Memory), [_]) => return self.remembered(inputs, call),
            (Some(Computes::Unary(function, takes, gives)), [of]) => {
                let (number, unit) = self.number(inputs, of)?;
                let (number, unit) = self.argument(&name.text, takes, of.span, number, unit)?;
                return Some((Expression::Unary { function, of: Box::new(number) }, gives.unit(unit)));
            }
            (Some(Computes::Binary(function, takes, gives)), [left, right]) => {
                return self.binary(inputs, &name.text, function, takes, gives, [left, right]);
            }
            (Some(Computes::Least | Computes::Greatest), [_]) => {
                self.over_time(call.span, name, None);
                return None;
            }
            (Some(Computes::Absolute | Computes::Memory | Computes::Wrapped | Computes::Unary(..)), _) => "one value",
            (Some(Computes::AngleBetween | Computes::Binary(..)), _) => "two values",
            (Some(Computes::SignedDistance), _) => "two arguments",
            (Some(Computes::Least | Computes::Greatest), _) => "two values or more",
            (None, _) if AGGREGATES.contains(&name.text.as_str()) || scores().any(|score| score == name.text) => {
                self.over_time(call.span, name, None);
                return None;
            }
            (None, _) => {
                let known: Vec<&str> = FUNCTIONS.iter().map(|(known, _)| *known).collect();
                self.unknown_function(name, &known);
                return None;
            }
        };
        self.wrong_count(call.span, &name.text, takes, arguments.len());
        None
    }

    /// A whole turn in the unit of an angle; reports what is none.
    pub(super) fn turn(&mut self, name: &str, span: Span, unit: Option<&Unit>) -> Option<f64> {
        self.argument(name, Takes::Angle, span, Expression::Constant(0.0), unit.cloned())?;
        Some(convert(1.0, Some(&Unit::revolutions()), unit))
    }

    pub(super) fn wrong_count(&mut self, call: Span, name: &str, takes: &str, count: usize) {
        let title = format!("`{name}(…)` takes {takes}, not {count}");
        self.report(Diagnostic::new(Code::NOT_A_FORMULA, call, title).label(format!("expected {takes}")));
    }

    /// Reports an aggregate over time inside of a formula, and how to write it if that is known.
    pub(super) fn over_time(&mut self, call: Span, name: &Name, better: Option<Suggestion>) {
        let title = format!("`{}(…)` over time cannot be nested in a formula", name.text);
        let mut diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, call, title)
            .label("only allowed as the outermost function of a formula")
            .note("inside a formula, the name of a topic stands for its last value");
        if name.text == "min" || name.text == "max" {
            diagnostic = diagnostic.note(format!("to compare several values, use `{}(a, b)`", name.text));
        }
        diagnostic.suggestions.extend(better);
        self.report(diagnostic);
    }

    pub(super) fn unknown_function(&mut self, name: &Name, known: &[&'static str]) {
        let title = format!("no function named `{}`", name.text);
        let mut diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label("unknown function");
        if matches!(name.text.as_str(), "norm" | "magnitude" | "length") {
            let note = "the length of a vector is its distance from the origin, such as \
                        `distance(velocity, (0, 0, 0)m/s)`; that of a number is `abs`";
            self.report(diagnostic.note(note));
            return;
        }
        // Operators over time are written before what they apply to.
        let expected = |word: &str| known.contains(&word) || word == "always" || word == "eventually";
        let aggregate = meanings(&name.text, |word| AGGREGATES.contains(&word)).first().map(|synonym| synonym.meant);
        if let Some(meant) = aggregate.filter(|meant| !known.contains(meant)) {
            let note = format!("`{}` is `{meant}`, which is only allowed as the outermost function", name.text);
            self.report(diagnostic.note(note));
            return;
        }
        let synonym = meanings(&name.text, expected).first().map(|synonym| synonym.meant);
        diagnostic = match synonym.or_else(|| most_similar(&name.text, known.iter().copied())) {
            Some(similar) => diagnostic.did_you_mean(name.span, similar),
            None => diagnostic.note(format!("the functions allowed here are {}", super::words::list(known))),
        };
        self.report(diagnostic);
    }

    fn binary(
        &mut self,
        inputs: &mut Vec<Input>,
        name: &str,
        function: BinaryFunction,
        takes: Takes,
        gives: Gives,
        arguments: [&'a ast::Expression; 2],
    ) -> Option<Number> {
        let (numbers, unit) = if let Takes::Any = takes {
            self.common(inputs, &arguments)?
        } else {
            // Both are resolved, so that a mistake in one does not hide one in the other.
            let numbers = arguments.map(|argument| {
                let (number, unit) = self.number(inputs, argument)?;
                self.argument(name, takes, argument.span, number, unit)
            });
            let [left, right] = numbers;
            let ((left, unit), (right, _)) = (left?, right?);
            (vec![left, right], unit)
        };
        let [left, right] = <[Expression; 2]>::try_from(numbers).expect("two arguments give two numbers");
        Some((Expression::Binary { function, left: Box::new(left), right: Box::new(right) }, gives.unit(unit)))
    }

    /// A number as the argument of a function, in the unit in which the function computes; with the unit of the value
    /// if that is the same.
    fn argument(
        &mut self,
        name: &str,
        takes: Takes,
        span: Span,
        number: Expression,
        unit: Option<Unit>,
    ) -> Option<Number> {
        let found = dimension(unit.as_ref());
        let (label, note) = match takes {
            Takes::Any => return Some((number, unit)),
            Takes::Square => match square_root(unit.as_ref()) {
                Some((root, factor)) => return Some((scaled(number, factor), root)),
                None => ("expected a plain number or a square such as `m^2`", None),
            },
            Takes::Plain if found == Dimension::NONE => {
                return Some((scaled(number, convert(1.0, unit.as_ref(), None)), None));
            }
            Takes::Plain => {
                ("expected a plain number", Some("divide it by a quantity, for example `near1.level / 1m`"))
            }
            Takes::Angle if found == Dimension::ANGLE => {
                let radians = Unit::radians();
                return Some((scaled(number, convert(1.0, unit.as_ref(), Some(&radians))), Some(radians)));
            }
            Takes::Angle => ("expected an angle, such as `link0` or `90deg`", None),
        };
        let title = format!("`{}` is {}, which `{name}` does not take", self.text(span), found.name());
        let mut diagnostic = Diagnostic::new(Code::WRONG_UNIT, span, title).label(label);
        if let Some(note) = note {
            diagnostic = diagnostic.note(note);
        }
        self.report(diagnostic);
        None
    }
}

/// What is left of an angle without whole turns.
fn without_turns(angle: Expression, turn: f64) -> Expression {
    let (left, right) = (Box::new(angle), Box::new(Expression::Constant(turn)));
    Expression::Binary { function: BinaryFunction::Wrapped, left, right }
}
