//! Arithmetic and conditions over the values a formula holds. Nothing here allocates.

use std::cell::Cell;
use std::fmt;

use sesame_base::time::SimTime;
use sesame_plan::{BinaryFunction, Condition, Distance, Expression, Point, UnaryFunction};

use crate::angle::wrapped;
use crate::metric::region::signed_distance;

/// The values of a formula's inputs: a point, or a number (true is 1, false 0) followed by zeros. Of an integral it is
/// what it came to with the last message, the value by which it grows since, and the time of that message in seconds.
pub(crate) type Held = [f64; 3];

/// What a formula is given besides the values of messages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given<'a> {
    /// The simulation time.
    pub(crate) now: SimTime,
    /// What the clock of the simulator's stamps showed at time zero, in seconds.
    pub(crate) zero: f64,
    /// The parameters of the space for which the test chose a value.
    pub(crate) scene: &'a Scene,
}

/// Values that a test chose for parameters of the space, each with the parameter's name.
pub type Scene = [(String, f64)];

/// What a formula is computed from at one moment.
pub(crate) struct Moment<'a> {
    inputs: &'a [Held],
    /// The simulation time, in seconds.
    time: f64,
    /// What the clock of the simulator's stamps showed at time zero, in seconds.
    zero: f64,
    scene: &'a Scene,
    undefined: Cell<Option<Undefined>>,
}

impl<'a> Moment<'a> {
    /// With these values of a formula's inputs.
    pub(crate) fn new(inputs: &'a [Held], given: Given<'a>) -> Self {
        let Given { now, zero, scene } = given;
        Moment { inputs, time: now.seconds(), zero, scene, undefined: Cell::new(None) }
    }

    /// The first function that had no value, of all that was computed.
    pub(crate) fn undefined(&self) -> Option<Undefined> {
        self.undefined.get()
    }

    /// By how much an integral grows each second.
    pub(super) fn pace(&self, integral: u32) -> f64 {
        self.inputs[integral as usize][1]
    }

    /// What the test chose for a parameter of the space, if it did.
    fn chosen(&self, parameter: &str) -> Option<f64> {
        self.scene.iter().find(|(name, _)| name == parameter).map(|&(_, value)| value)
    }

    fn point(&self, point: Point) -> Held {
        match point {
            Point::Input(at) => self.inputs[at as usize],
            Point::Constant(point) => point,
        }
    }

    /// The value of a function, which is remembered if it is not finite although its arguments are.
    fn checked(&self, function: &'static str, arguments: (f64, Option<f64>), value: f64) -> f64 {
        let finite = arguments.0.is_finite() && arguments.1.is_none_or(f64::is_finite);
        if finite && !value.is_finite() && self.undefined.get().is_none() {
            self.undefined.set(Some(Undefined { function, arguments }));
        }
        value
    }
}

/// A function without a finite value, such as the square root of a negative number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Undefined {
    function: &'static str,
    arguments: (f64, Option<f64>),
}

impl fmt::Display for Undefined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Undefined { function, arguments: (first, second) } = self;
        match second {
            None => write!(f, "`{function}({first})` has no value"),
            Some(second) => write!(f, "`{function}({first}, {second})` has no value"),
        }
    }
}

/// The value of an expression; not finite if the arithmetic is not.
pub(super) fn number(of: &Expression, at: &Moment<'_>) -> f64 {
    match of {
        Expression::Constant(value) => *value,
        Expression::Input(input) => at.inputs[*input as usize][0],
        Expression::Integral(input) => integral(at.inputs[*input as usize], at.time),
        Expression::Negate(of) => -number(of, at),
        Expression::Sum(of) => of.iter().map(|term| number(term, at)).reduce(|sum, term| sum + term).unwrap_or(0.0),
        Expression::Product(of) => {
            of.iter().map(|factor| number(factor, at)).reduce(|product, factor| product * factor).unwrap_or(1.0)
        }
        Expression::Divide { value, by } => number(value, at) / number(by, at),
        Expression::Absolute(of) => number(of, at).abs(),
        Expression::Min(of) => of.iter().map(|operand| number(operand, at)).reduce(least).unwrap_or(f64::NAN),
        Expression::Max(of) => of.iter().map(|operand| number(operand, at)).reduce(greatest).unwrap_or(f64::NAN),
        Expression::Distance(distance) => {
            let Distance { from, to, scale } = **distance;
            let [from, to] = [from, to].map(|point| at.point(point));
            let square = |axis: usize| {
                let along = from[axis] - to[axis] * scale;
                along * along
            };
            libm::sqrt(square(0) + square(1) + square(2))
        }
        Expression::SignedDistance(distance) => signed_distance(at.point(distance.from), &distance.to),
        Expression::Time => at.time,
        Expression::Now => at.zero + at.time,
        Expression::Scene { operation, usual } => at.chosen(operation).unwrap_or(*usual),
        Expression::Unary { function, of } => {
            let of = number(of, at);
            at.checked(function.name(), (of, None), unary(*function, of))
        }
        Expression::Binary { function, left, right } => {
            let (left, right) = (number(left, at), number(right, at));
            at.checked(function.name(), (left, Some(right)), binary(*function, left, right))
        }
    }
}

fn unary(function: UnaryFunction, of: f64) -> f64 {
    match function {
        UnaryFunction::Sqrt => libm::sqrt(of),
        UnaryFunction::Sin => libm::sin(of),
        UnaryFunction::Cos => libm::cos(of),
        UnaryFunction::Tan => libm::tan(of),
        UnaryFunction::Asin => libm::asin(of),
        UnaryFunction::Acos => libm::acos(of),
        UnaryFunction::Atan => libm::atan(of),
        UnaryFunction::Exp => libm::exp(of),
        UnaryFunction::Ln => libm::log(of),
    }
}

fn binary(function: BinaryFunction, left: f64, right: f64) -> f64 {
    match function {
        BinaryFunction::Atan2 => libm::atan2(left, right),
        BinaryFunction::Hypot => libm::hypot(left, right),
        BinaryFunction::Pow => libm::pow(left, right),
        BinaryFunction::Wrapped => wrapped(left, -right / 2.0, right),
    }
}

/// What an integral has come to at a time in seconds.
pub(super) fn integral([sum, value, since]: Held, time: f64) -> f64 {
    sum + value * (time - since)
}

/// Whether a condition holds.
pub(crate) fn holds(of: &Condition, at: &Moment<'_>) -> bool {
    match of {
        Condition::Constant(value) => *value,
        Condition::Input(input) => at.inputs[*input as usize][0] != 0.0,
        Condition::Compare { left, by, right } => by.holds(number(left, at), number(right, at)),
        Condition::Same { left, right } => holds(left, at) == holds(right, at),
        Condition::All(of) => of.iter().all(|part| holds(part, at)),
        Condition::Any(of) => of.iter().any(|part| holds(part, at)),
        Condition::Not(of) => !holds(of, at),
    }
}

/// The lesser of two numbers; a NaN if one of them is.
pub(super) fn least(a: f64, b: f64) -> f64 {
    if b < a || b.is_nan() { b } else { a }
}

/// The greater of two numbers; a NaN if one of them is.
pub(super) fn greatest(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

#[cfg(test)]
mod tests {
    use sesame_plan::Comparison;

    use super::*;

    /// At so many seconds, where the clock of stamps showed 1000 s at time zero.
    fn at(inputs: &[Held], seconds: f64) -> Moment<'_> {
        Moment::new(inputs, Given { now: SimTime::from_seconds(seconds), zero: 1000.0, scene: &[] })
    }

    fn number(of: &Expression, inputs: &[Held]) -> f64 {
        super::number(of, &at(inputs, 0.0))
    }

    fn holds(of: &Condition, inputs: &[Held]) -> bool {
        super::holds(of, &at(inputs, 0.0))
    }

    const INPUTS: [Held; 3] = [[6.0, 0.0, 0.0], [3.0, 4.0, 12.0], [1.0, 0.0, 0.0]];

    fn constant(value: f64) -> Expression {
        Expression::Constant(value)
    }

    #[test]
    fn chains_are_computed_from_left_to_right() {
        let quotient = Expression::Divide { value: Box::new(Expression::Input(0)), by: Box::new(constant(3.0)) };
        let product = Expression::Product(vec![quotient, constant(10.0)]);
        assert_eq!(number(&product, &INPUTS), 20.0);
        let sum = Expression::Sum(vec![product, Expression::Negate(Box::new(constant(50.0))), Expression::Input(2)]);
        assert_eq!(number(&sum, &INPUTS), -29.0);
        assert_eq!(number(&Expression::Absolute(Box::new(sum)), &INPUTS), 29.0);
    }

    #[test]
    fn a_distance_is_in_the_unit_of_the_first_point() {
        let zero: Held = [0.0; 3];
        let apart =
            |scale| Expression::Distance(Box::new(Distance { from: Point::Input(0), to: Point::Input(1), scale }));
        assert_eq!(number(&apart(1.0), &[zero, INPUTS[1]]), 13.0);
        assert_eq!(number(&apart(1000.0), &[zero, INPUTS[1]]), 13000.0);
    }

    #[test]
    fn a_written_point_is_as_good_as_one_of_a_message() {
        let from = Point::Constant([3.0, 0.0, 12.0]);
        let distance = Box::new(Distance { from, to: Point::Input(1), scale: 1.0 });
        assert_eq!(number(&Expression::Distance(distance), &INPUTS), 4.0);
    }

    #[test]
    fn time_is_that_of_the_moment() {
        assert_eq!(super::number(&Expression::Time, &at(&[], 2.5)), 2.5);
        assert_eq!(super::number(&Expression::Now, &at(&[], 2.5)), 1002.5);
    }

    #[test]
    fn a_parameter_of_the_space_is_what_the_test_chose_or_its_usual_value() {
        let start = Expression::Scene { operation: "start_x".to_owned(), usual: 0.5 };
        for (chosen, value) in [("start_x", -2.0), ("start_y", 0.5)] {
            let scene = [("load".to_owned(), 9.0), (chosen.to_owned(), -2.0)];
            let given = Given { now: SimTime::ZERO, zero: 0.0, scene: &scene };
            assert_eq!(super::number(&start, &Moment::new(&[], given)), value, "{chosen}");
        }
    }

    #[test]
    fn functions_compute_what_their_names_say() {
        use BinaryFunction::{Atan2, Hypot, Pow, Wrapped};
        use UnaryFunction::{Acos, Asin, Atan, Cos, Exp, Ln, Sin, Sqrt, Tan};
        let half_turn = std::f64::consts::PI;
        let unary = [
            (Sqrt, 9.0, 3.0),
            (Sin, half_turn / 2.0, 1.0),
            (Cos, half_turn, -1.0),
            (Tan, half_turn / 4.0, 1.0),
            (Asin, 1.0, half_turn / 2.0),
            (Acos, -1.0, half_turn),
            (Atan, 1.0, half_turn / 4.0),
            (Exp, 1.0, std::f64::consts::E),
            (Ln, std::f64::consts::E, 1.0),
        ];
        for (function, of, value) in unary {
            let found = number(&Expression::Unary { function, of: Box::new(constant(of)) }, &[]);
            assert!((found - value).abs() < 1e-15, "{} {found}", function.name());
        }
        let binary = [
            (Atan2, 1.0, -1.0, 0.75 * half_turn),
            (Hypot, 3.0, 4.0, 5.0),
            (Pow, 2.0, 10.0, 1024.0),
            (Wrapped, 190.0, 360.0, -170.0),
        ];
        for (function, left, right, value) in binary {
            let [left, right] = [left, right].map(|argument| Box::new(constant(argument)));
            assert_eq!(number(&Expression::Binary { function, left, right }, &[]), value, "{}", function.name());
        }
    }

    #[test]
    fn a_function_without_a_value_is_remembered_and_what_was_no_number_before_is_not() {
        let root = |of: f64| Expression::Unary { function: UnaryFunction::Sqrt, of: Box::new(constant(of)) };
        let said = |of: &Expression| {
            let moment = at(&[], 0.0);
            super::number(of, &moment);
            moment.undefined().map(|undefined| undefined.to_string())
        };
        assert_eq!(said(&root(-4.0)).as_deref(), Some("`sqrt(-4)` has no value"));
        let (left, right) = (Box::new(constant(-1.0)), Box::new(constant(0.5)));
        let power = Expression::Binary { function: BinaryFunction::Pow, left, right };
        assert_eq!(said(&Expression::Sum(vec![power, root(-4.0)])).as_deref(), Some("`pow(-1, 0.5)` has no value"));
        assert_eq!(said(&root(4.0)), None);
        assert_eq!(said(&root(f64::NAN)), None);
    }

    #[test]
    fn the_least_and_greatest_of_what_is_no_number_is_none() {
        for of in [vec![constant(f64::NAN), constant(1.0)], vec![constant(1.0), constant(f64::NAN)]] {
            assert!(number(&Expression::Min(of.clone()), &[]).is_nan());
            assert!(number(&Expression::Max(of), &[]).is_nan());
        }
        assert_eq!(number(&Expression::Min(vec![constant(2.0), constant(1.0), constant(3.0)]), &[]), 1.0);
        assert_eq!(number(&Expression::Max(vec![constant(2.0), constant(3.0), constant(1.0)]), &[]), 3.0);
    }

    #[test]
    fn conditions_join_and_a_nan_compares_with_nothing() {
        let compare =
            |left: f64, by, right: f64| Condition::Compare { left: constant(left), by, right: constant(right) };
        let yes = || compare(1.0, Comparison::AtMost, 1.0);
        let no = || compare(f64::NAN, Comparison::Equal, f64::NAN);
        assert!(holds(&yes(), &[]) && !holds(&no(), &[]));
        assert!(!holds(&Condition::All(vec![yes(), no()]), &[]));
        assert!(holds(&Condition::Any(vec![no(), yes()]), &[]));
        assert!(holds(&Condition::Same { left: Box::new(no()), right: Box::new(Condition::Constant(false)) }, &[]));
        assert!(holds(&Condition::Input(2), &INPUTS));
        assert!(holds(&Condition::Not(Box::new(no())), &[]));
        let different = |left, right| holds(&compare(left, Comparison::NotEqual, right), &[]);
        assert!(different(1.0, 2.0) && !different(1.0, 1.0) && !different(f64::NAN, 1.0));
    }
}
