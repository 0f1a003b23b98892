//! What expressions over inputs are, as far as their comparison can be decided: constants, and chains of steps from one
//! number to another in which a greater number never gives a smaller one, or never a greater one.

use sesame_plan::Expression;

/// A step of a chain. Constants are finite, and neither factors nor divisors are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Negate,
    Add(f64),
    Multiply(f64),
    Divide(f64),
}

/// Where a chain begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Core {
    /// An input, by position.
    Input(u32),
    /// The first input less the second.
    Difference(u32, u32),
}

/// A number made from one other number, in floating point, as formulas compute it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    pub(super) core: Core,
    steps: Vec<Step>,
}

impl Chain {
    /// What becomes of a number.
    pub(super) fn apply(&self, number: f64) -> f64 {
        self.steps.iter().fold(number, |number, step| match step {
            Step::Negate => -number,
            Step::Add(by) => number + by,
            Step::Multiply(by) => number * by,
            Step::Divide(by) => number / by,
        })
    }

    /// The constant that is added to an input, if nothing else is done to it.
    pub(super) fn sum(&self) -> Option<(u32, f64)> {
        match (self.core, &self.steps[..]) {
            (Core::Input(input), []) => Some((input, 0.0)),
            (Core::Input(input), [Step::Add(by)]) => Some((input, *by)),
            _ => None,
        }
    }
}

/// The chain that an expression is.
pub(super) fn chain(of: &Expression) -> Option<Chain> {
    if let Some(core) = core(of) {
        return Some(Chain { core, steps: Vec::new() });
    }
    // The one part that is not constant, and the steps that the constants before and after it are.
    let fold = |parts: &[Expression], join: fn(f64, f64) -> f64, step: fn(f64) -> Step| {
        let at = parts.iter().position(|part| constant(part).is_none())?;
        let mut chain = chain(&parts[at])?;
        let before = parts[..at].iter().map(constant).collect::<Option<Vec<f64>>>()?;
        let after = parts[at + 1..].iter().map(constant).collect::<Option<Vec<f64>>>()?;
        let numbers: Vec<f64> = before.into_iter().reduce(join).into_iter().chain(after).collect();
        numbers.iter().all(|number| number.is_finite()).then_some(())?;
        chain.steps.extend(numbers.into_iter().map(step));
        Some(chain)
    };
    let chain = match of {
        Expression::Negate(of) => {
            let mut chain = chain(of)?;
            chain.steps.push(Step::Negate);
            chain
        }
        Expression::Sum(parts) => fold(parts, |a, b| a + b, Step::Add)?,
        Expression::Product(parts) => fold(parts, |a, b| a * b, Step::Multiply)?,
        Expression::Divide { value, by } => {
            let mut chain = chain(value)?;
            chain.steps.push(Step::Divide(constant(by).filter(|by| by.is_finite())?));
            chain
        }
        _ => return None,
    };
    let vanishes = |step: &Step| matches!(step, Step::Multiply(by) | Step::Divide(by) if *by == 0.0);
    (!chain.steps.iter().any(vanishes)).then_some(chain)
}

fn core(of: &Expression) -> Option<Core> {
    let negated = |of: &Expression| match of {
        Expression::Negate(of) => match **of {
            Expression::Input(input) => Some(input),
            _ => None,
        },
        _ => None,
    };
    match of {
        Expression::Input(input) => Some(Core::Input(*input)),
        Expression::Sum(parts) => match &parts[..] {
            [Expression::Input(a), b] => negated(b).map(|b| Core::Difference(*a, b)),
            [b, Expression::Input(a)] => negated(b).map(|b| Core::Difference(*a, b)),
            _ => None,
        },
        _ => None,
    }
}

/// The value of an expression that reads nothing.
pub(super) fn constant(of: &Expression) -> Option<f64> {
    number(of, &|_| None)
}

/// The value of an expression, given those of its inputs; `None` if it needs one that is not given, the time, or a
/// function.
pub(super) fn number(of: &Expression, input: &dyn Fn(u32) -> Option<f64>) -> Option<f64> {
    let all = |parts: &[Expression]| parts.iter().map(|part| number(part, input)).collect::<Option<Vec<f64>>>();
    match of {
        Expression::Constant(value) => Some(*value),
        Expression::Input(at) => input(*at),
        Expression::Negate(of) => number(of, input).map(|value| -value),
        Expression::Sum(parts) => all(parts)?.into_iter().reduce(|a, b| a + b),
        Expression::Product(parts) => all(parts)?.into_iter().reduce(|a, b| a * b),
        Expression::Divide { value, by } => Some(number(value, input)? / number(by, input)?),
        Expression::Absolute(of) => number(of, input).map(f64::abs),
        Expression::Min(parts) => all(parts)?.into_iter().reduce(|a, b| if b < a || b.is_nan() { b } else { a }),
        Expression::Max(parts) => all(parts)?.into_iter().reduce(|a, b| if b > a || b.is_nan() { b } else { a }),
        Expression::Distance(_)
        | Expression::SignedDistance(_)
        | Expression::Time
        | Expression::Now
        | Expression::Scene { .. }
        | Expression::Integral(_)
        | Expression::Unary { .. }
        | Expression::Binary { .. } => None,
    }
}

/// Whether an expression is a finite number for all inputs, which are finite.
fn is_finite(of: &Expression) -> bool {
    match of {
        Expression::Input(_)
        | Expression::Integral(_)
        | Expression::Time
        | Expression::Now
        | Expression::Scene { .. } => true,
        Expression::Negate(of) | Expression::Absolute(of) => is_finite(of),
        Expression::Min(parts) | Expression::Max(parts) => parts.iter().all(is_finite),
        _ => constant(of).is_some_and(f64::is_finite),
    }
}

/// Whether an expression is a number, or infinite, for all inputs: never a NaN.
pub(super) fn is_number(of: &Expression) -> bool {
    match of {
        // Infinities of both signs do not meet.
        Expression::Sum(parts) => parts.iter().all(is_finite),
        Expression::Product(parts) => parts.len() <= 2 && parts.iter().all(is_finite),
        Expression::Negate(of) | Expression::Absolute(of) => is_number(of),
        Expression::Min(parts) | Expression::Max(parts) => parts.iter().all(is_number),
        Expression::Distance(distance) => distance.scale.is_finite(),
        _ => is_finite(of) || chain(of).is_some(),
    }
}

/// Expressions as text: the same for those that compute the same from the same inputs in the same way.
pub(super) fn text(of: &Expression, input: &dyn Fn(u32) -> usize) -> String {
    let point = |point: sesame_plan::Point| match point {
        sesame_plan::Point::Input(at) => format!("#{}", input(at)),
        sesame_plan::Point::Constant(at) => format!("{at:?}"),
    };
    let name = match of {
        Expression::Constant(value) => format!("{value:?}"),
        Expression::Input(at) => format!("#{}", input(*at)),
        Expression::Negate(_) => "-".to_owned(),
        Expression::Sum(_) => "+".to_owned(),
        Expression::Product(_) => "*".to_owned(),
        Expression::Divide { .. } => "/".to_owned(),
        Expression::Absolute(_) => "abs".to_owned(),
        Expression::Min(_) => "min".to_owned(),
        Expression::Max(_) => "max".to_owned(),
        Expression::Distance(distance) => {
            format!("distance {} {} {:?}", point(distance.from), point(distance.to), distance.scale)
        }
        Expression::SignedDistance(distance) => format!("{} {:?}", point(distance.from), distance.to),
        Expression::Integral(at) => format!("integral #{}", input(*at)),
        Expression::Time => "time".to_owned(),
        Expression::Now => "now".to_owned(),
        Expression::Scene { operation, .. } => format!("scene {operation}"),
        Expression::Unary { function, .. } => function.name().to_owned(),
        Expression::Binary { function, .. } => function.name().to_owned(),
    };
    let parts: Vec<String> = of.parts().into_iter().map(|part| text(part, input)).collect();
    format!("{name}({})", parts.join(","))
}

/// Where a property that all numbers below some number have or lack changes: the greatest number of a range of which it
/// is as of the least one; `None` if it does not change. Numbers are those of floating point.
pub(super) fn boundary(range: (f64, f64), holds: &dyn Fn(f64) -> bool) -> Option<f64> {
    // The order of numbers as whole numbers, and back.
    let turn = |bits: i64| if bits < 0 { bits ^ i64::MAX } else { bits };
    let rank = |number: f64| turn(number.to_bits().cast_signed());
    let number = |rank: i64| f64::from_bits(turn(rank).cast_unsigned());
    let first = holds(range.0);
    if holds(range.1) == first {
        return None;
    }
    let (mut same, mut other) = (rank(range.0), rank(range.1));
    while other.wrapping_sub(same) != 1 {
        let middle = i64::try_from(i128::midpoint(i128::from(same), i128::from(other))).expect("it is between them");
        if holds(number(middle)) == first { same = middle } else { other = middle }
    }
    Some(number(same))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn input() -> Expression {
        Expression::Input(0)
    }

    fn c(value: f64) -> Expression {
        Expression::Constant(value)
    }

    #[test]
    fn boundaries_are_exact_in_floating_point() {
        let all = (f64::MIN, f64::MAX);
        assert_eq!(boundary(all, &|x| x <= 0.3), Some(0.3));
        assert_eq!(boundary(all, &|x| x < 0.0), Some(-f64::from_bits(1)));
        assert_eq!(boundary(all, &|x| x <= f64::MAX), None);
        assert_eq!(boundary((f64::NEG_INFINITY, f64::INFINITY), &|x| x > 1e300), Some(1e300));
        let tenth = boundary(all, &|x| x * 0.1 <= 1.0).unwrap();
        assert!(tenth * 0.1 <= 1.0 && tenth.next_up() * 0.1 > 1.0);
    }

    #[test]
    fn chains_compute_what_formulas_do() {
        let sum = Expression::Sum(vec![c(0.1), c(0.2), input(), c(0.3)]);
        let of = Expression::Divide { value: Box::new(Expression::Negate(Box::new(sum))), by: Box::new(c(3.0)) };
        let chain = chain(&of).unwrap();
        for value in [0.7, -1e17, 1e-9] {
            assert_eq!(Some(chain.apply(value)), number(&of, &|_| Some(value)));
        }
        let product = Expression::Product(vec![input(), c(0.0)]);
        assert_eq!(super::chain(&product), None);
        let two = Expression::Sum(vec![input(), Expression::Negate(Box::new(Expression::Input(1)))]);
        assert_eq!(super::chain(&two).unwrap().core, Core::Difference(0, 1));
    }

    proptest! {
        #[test]
        fn a_boundary_is_where_the_property_changes(at in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            let found = boundary((f64::NEG_INFINITY, f64::INFINITY), &|x| x > at).unwrap();
            prop_assert!(found <= at && found.next_up() > at);
        }
    }
}
