//! When the comparisons of a formula change while nothing but time passes.

use sesame_base::time::SimTime;
use sesame_plan::{Aggregate, Comparison, Condition, Expression, Formula};

use crate::metric::expression::{Given, Held, Moment, number};

/// The first moment from now on at which a comparison in a formula changes, with these values of its inputs. Only
/// comparisons are looked at whose two sides change evenly, by the same amount each second: what else time does to a
/// formula is seen at messages. A comparison for equality holds for a moment only, which is not looked for.
pub(super) fn next_change(formula: &Formula, inputs: &[Held], given: Given<'_>) -> Option<SimTime> {
    let of = match &formula.aggregate {
        Aggregate::Duration { of } | Aggregate::Count { of } => Some(of),
        Aggregate::Last { .. } | Aggregate::Min { .. } | Aggregate::Max { .. } | Aggregate::Mean { .. } => None,
    };
    let mut first = None;
    for condition in of.into_iter().chain(&formula.when) {
        in_condition(condition, inputs, given, &mut first);
    }
    first
}

/// The first moment from now on at which an expression is above or below a number and was not before.
pub(super) fn next_crossing(of: &Expression, bound: f64, inputs: &[Held], given: Given<'_>) -> Option<SimTime> {
    let bound = Expression::Constant(bound);
    let crossing = |by| change(&Compared { left: of, by, right: &bound }, inputs, given);
    [Comparison::Above, Comparison::Below, Comparison::AtLeast, Comparison::AtMost]
        .into_iter()
        .filter_map(crossing)
        .min()
}

fn in_condition(condition: &Condition, inputs: &[Held], given: Given<'_>, first: &mut Option<SimTime>) {
    match condition {
        Condition::Constant(_) | Condition::Input(_) => {}
        Condition::Compare { left, by, right } => {
            let found = change(&Compared { left, by: *by, right }, inputs, given);
            *first = first.iter().copied().chain(found).min();
        }
        Condition::Same { left, right } => {
            in_condition(left, inputs, given, first);
            in_condition(right, inputs, given, first);
        }
        Condition::All(parts) | Condition::Any(parts) => {
            for part in parts {
                in_condition(part, inputs, given, first);
            }
        }
        Condition::Not(of) => in_condition(of, inputs, given, first),
    }
}

struct Compared<'a> {
    left: &'a Expression,
    by: Comparison,
    right: &'a Expression,
}

fn change(compared: &Compared<'_>, inputs: &[Held], given: Given<'_>) -> Option<SimTime> {
    /// More than rounding makes of a time in seconds, in nanoseconds.
    const MARGIN: i64 = 1 << 12;
    let Compared { left, by, right } = *compared;
    if matches!(by, Comparison::Equal | Comparison::NotEqual) {
        return None;
    }
    let holds_at = |nanos: i64| {
        let moment = Moment::new(inputs, Given { now: SimTime::from_nanos(nanos), ..given });
        by.holds(number(left, &moment), number(right, &moment))
    };
    let now = given.now.nanos();
    let moment = Moment::new(inputs, given);
    let pace = slope(left, &moment)? - slope(right, &moment)?;
    let away = number(right, &moment) - number(left, &moment);
    let seconds = away / pace;
    // Long after any test, or never.
    if !(-1e-3..1e9).contains(&seconds) {
        return None;
    }
    let before = holds_at(now);
    let (mut low, mut high) = (now, now.max(now + SimTime::from_seconds(seconds).nanos()) + MARGIN);
    if holds_at(high) == before {
        return None;
    }
    // It holds at one end and not at the other, and changes once in between.
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds_at(middle) == before { low = middle } else { high = middle }
    }
    Some(SimTime::from_nanos(high))
}

/// By how much an expression changes each second; `None` if that is not the same at all times.
fn slope(of: &Expression, at: &Moment<'_>) -> Option<f64> {
    match of {
        Expression::Time | Expression::Now => Some(1.0),
        Expression::Integral(input) => Some(at.pace(*input)),
        Expression::Negate(of) => slope(of, at).map(|slope| -slope),
        Expression::Sum(terms) => terms.iter().map(|term| slope(term, at)).sum(),
        Expression::Product(factors) => {
            let mut with_time = factors.iter().filter(|factor| factor.reads_time());
            let Some(of) = with_time.next() else { return Some(0.0) };
            let others = factors.iter().filter(|factor| !factor.reads_time()).map(|factor| number(factor, at));
            if with_time.next().is_some() { None } else { slope(of, at).map(|slope| slope * others.product::<f64>()) }
        }
        Expression::Divide { value, by } if !by.reads_time() => slope(value, at).map(|slope| slope / number(by, at)),
        other => (!other.reads_time()).then_some(0.0),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::metric::expression::holds;

    /// `time * factor - input`, by one of both clocks, and a number.
    fn compared(time: Expression, factor: f64, by: Comparison, bound: f64) -> Condition {
        let grown = Expression::Product(vec![time, Expression::Constant(factor)]);
        let left = Expression::Sum(vec![grown, Expression::Negate(Box::new(Expression::Input(0)))]);
        Condition::Compare { left, by, right: Expression::Constant(bound) }
    }

    proptest! {
        // Times are so small that every nanosecond can be looked at.
        #[test]
        fn a_change_is_found_at_its_nanosecond(
            time in prop::sample::select(vec![Expression::Time, Expression::Now]), zero in -100..100i32,
            now in 0..200i64, factor in -3..4i32, input in -200..200i32, bound in -200..200i32,
            by in prop::sample::select(vec![
                Comparison::Above, Comparison::AtLeast, Comparison::Below, Comparison::AtMost,
            ]),
        ) {
            let inputs = [[f64::from(input) * 1e-9, 0.0, 0.0]];
            let given =
                |nanos| Given { now: SimTime::from_nanos(nanos), zero: f64::from(zero) * 1e-9, scene: &[] };
            let condition = compared(time, f64::from(factor), by, f64::from(bound) * 1e-9);
            let at = |nanos| holds(&condition, &Moment::new(&inputs, given(nanos)));
            let expected = (now + 1..2_000).find(|&nanos| at(nanos) != at(now)).map(SimTime::from_nanos);
            let mut first = None;
            in_condition(&condition, &inputs, given(now), &mut first);
            prop_assert_eq!(first, expected);
        }
    }

    #[test]
    fn what_does_not_change_evenly_is_left_to_messages() {
        let square = Expression::Product(vec![Expression::Time, Expression::Time]);
        let moment = Moment::new(&[], Given { now: SimTime::ZERO, zero: 0.0, scene: &[] });
        assert_eq!(slope(&square, &moment), None);
        assert_eq!(
            slope(
                &Expression::Divide { value: Box::new(Expression::Constant(1.0)), by: Box::new(Expression::Time) },
                &moment
            ),
            None
        );
        assert_eq!(slope(&Expression::Constant(3.0), &moment), Some(0.0));
    }
}
