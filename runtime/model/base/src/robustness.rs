//! The robustness signal of a temporal formula: its robustness over time, and when a run lost a bound on it.
//!
//! A formula is evaluated at the beginning of a run, which gives one number. What leads to it is the signal of what its
//! outermost `always` or `eventually` quantifies over: `always (distance > 3m)` has the signal `distance - 3m`, whose
//! least value is the robustness.

use sesame_plan::stl::Formula;
use sesame_plan::{Bound, Span};

use crate::verdict::{ends, violation_spans};

/// How the robustness of a formula follows from its signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantifier {
    /// It is the least value of the signal: every time has to satisfy the formula.
    Always,
    /// It is the greatest value of the signal: one time that satisfies the formula is enough.
    Eventually,
}

impl Quantifier {
    fn dual(self) -> Self {
        match self {
            Quantifier::Always => Quantifier::Eventually,
            Quantifier::Eventually => Quantifier::Always,
        }
    }
}

/// The outermost quantifier of a formula; `None` for one that is not a combination of equal quantifiers, such as an
/// `until`. The signal of such a formula is its robustness, from the time at which it was known.
pub fn quantifier(formula: &Formula) -> Option<Quantifier> {
    let both = |left: Option<Quantifier>, right: Option<Quantifier>, both| {
        (left == Some(both) && right == Some(both)).then_some(both)
    };
    match formula {
        Formula::Predicate { .. } | Formula::Until { .. } => None,
        Formula::Not { of } => quantifier(of).map(Quantifier::dual),
        Formula::And { left, right } => both(quantifier(left), quantifier(right), Quantifier::Always),
        Formula::Or { left, right } => both(quantifier(left), quantifier(right), Quantifier::Eventually),
        Formula::Implies { left, right } => {
            both(quantifier(left).map(Quantifier::dual), quantifier(right), Quantifier::Eventually)
        }
        Formula::Always { .. } => Some(Quantifier::Always),
        Formula::Eventually { .. } => Some(Quantifier::Eventually),
    }
}

/// When a robustness violated a bound, from its signal: change points `(seconds, value)`, the last of which ends it.
///
/// If the value is beyond the bound on the side that single times decide, these are the times at which the signal is
/// beyond it; on the other side no time satisfied the bound, and the whole signal counts. Empty where the value
/// satisfies the bound.
pub fn lost(signal: &[(f64, f64)], quantifier: Option<Quantifier>, bound: Bound, value: f64) -> Vec<Span> {
    let (Some(first), Some(last)) = (signal.first(), signal.last()) else { return Vec::new() };
    if bound.holds(value) {
        return Vec::new();
    }
    let (low, low_excluded, high, high_excluded) = ends(bound);
    let too_low = low.filter(|&low| value < low || (low_excluded && value == low));
    let too_high = high.filter(|&high| value > high || (high_excluded && value == high));
    let decisive = match (quantifier, too_low, too_high) {
        (Some(Quantifier::Always), Some(value), _) if low_excluded => Some(Bound::Above { value }),
        (Some(Quantifier::Always), Some(value), _) => Some(Bound::AtLeast { value }),
        (Some(Quantifier::Eventually), _, Some(value)) if high_excluded => Some(Bound::Below { value }),
        (Some(Quantifier::Eventually), _, Some(value)) => Some(Bound::AtMost { value }),
        _ => None,
    };
    match decisive {
        Some(bound) => violation_spans(signal, bound, last.0),
        None => vec![Span { start: first.0, end: last.0 }],
    }
}

/// When the signal was the robustness of the whole: the first time of its least or greatest value.
pub fn decided_at(signal: &[(f64, f64)], quantifier: Option<Quantifier>) -> Option<f64> {
    let sign = if quantifier == Some(Quantifier::Eventually) { -1.0 } else { 1.0 };
    signal.iter().min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).map(|point| point.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::Comparison;
    use sesame_plan::stl::Interval;

    use super::*;

    const PREDICATE: Formula = Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: 0.0 };

    fn always() -> Formula {
        Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(PREDICATE) }
    }

    fn eventually() -> Formula {
        Formula::Eventually { interval: Interval::UNBOUNDED, of: Box::new(PREDICATE) }
    }

    #[test]
    fn the_outermost_quantifier_is_seen_through_connectives() {
        use Quantifier::{Always, Eventually};
        let and = |left, right| Formula::And { left: Box::new(left), right: Box::new(right) };
        let or = |left, right| Formula::Or { left: Box::new(left), right: Box::new(right) };
        let implies = |left, right| Formula::Implies { left: Box::new(left), right: Box::new(right) };
        assert_eq!(quantifier(&always()), Some(Always));
        assert_eq!(quantifier(&eventually()), Some(Eventually));
        assert_eq!(quantifier(&Formula::Not { of: Box::new(eventually()) }), Some(Always));
        assert_eq!(quantifier(&and(always(), always())), Some(Always));
        assert_eq!(quantifier(&and(always(), eventually())), None);
        assert_eq!(quantifier(&or(eventually(), eventually())), Some(Eventually));
        assert_eq!(quantifier(&implies(always(), eventually())), Some(Eventually));
        assert_eq!(quantifier(&PREDICATE), None);
    }

    #[test]
    fn a_bound_is_lost_where_the_signal_is_beyond_it_or_everywhere() {
        let signal = [(1.0, 2.0), (3.0, -1.0), (4.0, 0.5), (6.0, -0.5), (7.0, -0.5)];
        let positive = Bound::AtLeast { value: 0.0 };
        let at = |start, end| Span { start, end };
        assert_eq!(lost(&signal, Some(Quantifier::Always), positive, -1.0), [at(3.0, 4.0), at(6.0, 7.0)]);
        assert_eq!(decided_at(&signal, Some(Quantifier::Always)), Some(3.0));
        assert_eq!(lost(&signal, Some(Quantifier::Always), positive, 0.0), []);
        // One time above three was asked for, and there is none.
        let three = Bound::AtLeast { value: 3.0 };
        assert_eq!(lost(&signal, Some(Quantifier::Eventually), three, 2.0), [at(1.0, 7.0)]);
        assert_eq!(decided_at(&signal, Some(Quantifier::Eventually)), Some(1.0));
        assert_eq!(lost(&[], Some(Quantifier::Always), positive, -1.0), [], "what was not recorded is not known");
    }

    proptest! {
        #[test]
        fn a_violated_bound_is_lost_at_some_time_and_a_satisfied_one_at_none(
            values in prop::collection::vec(-5i32..5, 2..12), bound in -5i32..5, low in any::<bool>(), always in any::<bool>(),
        ) {
            let signal: Vec<(f64, f64)> = (0u32..).zip(&values).map(|(at, &x)| (f64::from(at), f64::from(x))).collect();
            let quantified = &values[..values.len() - 1];
            let value = if always { quantified.iter().min() } else { quantified.iter().max() };
            let value = f64::from(*value.unwrap());
            let bound = f64::from(bound);
            let bound = if low { Bound::AtLeast { value: bound } } else { Bound::AtMost { value: bound } };
            let quantifier = if always { Quantifier::Always } else { Quantifier::Eventually };
            let lost = lost(&signal, Some(quantifier), bound, value);
            prop_assert_eq!(lost.is_empty(), bound.holds(value));
        }
    }
}
