//! Arithmetic and conditions over the values a formula holds. Nothing here allocates.

use sesame_plan::{Condition, Expression};

/// The values of a formula's inputs: a point, or a number (true is 1, false 0) followed by zeros.
pub(super) type Held = [f64; 3];

/// The value of an expression; not finite if the arithmetic is not.
pub(super) fn number(of: &Expression, inputs: &[Held]) -> f64 {
    match of {
        Expression::Constant(value) => *value,
        Expression::Input(at) => inputs[*at as usize][0],
        Expression::Negate(of) => -number(of, inputs),
        Expression::Sum(of) => of.iter().map(|term| number(term, inputs)).reduce(|sum, term| sum + term).unwrap_or(0.0),
        Expression::Product(of) => {
            of.iter().map(|factor| number(factor, inputs)).reduce(|product, factor| product * factor).unwrap_or(1.0)
        }
        Expression::Divide { value, by } => number(value, inputs) / number(by, inputs),
        Expression::Absolute(of) => number(of, inputs).abs(),
        Expression::Min(of) => of.iter().map(|operand| number(operand, inputs)).reduce(least).unwrap_or(f64::NAN),
        Expression::Max(of) => of.iter().map(|operand| number(operand, inputs)).reduce(greatest).unwrap_or(f64::NAN),
        Expression::Distance { from, to, scale } => {
            let [from, to] = [from, to].map(|at| inputs[*at as usize]);
            let square = |axis: usize| {
                let along = from[axis] - to[axis] * scale;
                along * along
            };
            libm::sqrt(square(0) + square(1) + square(2))
        }
    }
}

/// Whether a condition holds.
pub(super) fn holds(of: &Condition, inputs: &[Held]) -> bool {
    match of {
        Condition::Constant(value) => *value,
        Condition::Input(at) => inputs[*at as usize][0] != 0.0,
        Condition::Compare { left, by, right } => by.holds(number(left, inputs), number(right, inputs)),
        Condition::Same { left, right } => holds(left, inputs) == holds(right, inputs),
        Condition::All(of) => of.iter().all(|part| holds(part, inputs)),
        Condition::Any(of) => of.iter().any(|part| holds(part, inputs)),
        Condition::Not(of) => !holds(of, inputs),
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
        let apart = |scale| Expression::Distance { from: 0, to: 1, scale };
        assert_eq!(number(&apart(1.0), &[zero, INPUTS[1]]), 13.0);
        assert_eq!(number(&apart(1000.0), &[zero, INPUTS[1]]), 13000.0);
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
