//! Conditions that are always true or always false, for all values of their variables: a run with one is wasted.
//!
//! Comparisons and known ranges bound differences between two variables, or between one and a number, and whether a set
//! of such bounds contradicts itself is decided exactly. So a search through the alternatives of `or` decides the
//! question exactly.

use sesame_plan::MetricId;
use sesame_plan::condition::{Comparison, Condition, Operand, Variable};

use crate::differences::{Bound, Differences};

/// Parts of a condition looked at before a question is given up. Conditions of five levels and more can be made that
/// need more; those a search grows need a few dozen.
const PATIENCE: u32 = 20_000;

/// The one truth value that a condition can have while all its variables have values in their known ranges; `None` for
/// one that can have both. Variables that are not listed may have any value. A condition too tangled to decide counts
/// as one that can have both.
pub fn constant(condition: &Condition, variables: &[Variable]) -> Option<bool> {
    let possible = |holds| {
        let bounds = Bounds::new(condition, variables)?;
        satisfiable(Some(&Goals { condition, holds, rest: None }), &bounds, &mut { PATIENCE }).then_some(())
    };
    match (possible(true), possible(false)) {
        (Some(()), Some(())) => None,
        (Some(()), None) => Some(true),
        (None, _) => Some(false),
    }
}

/// Whether a condition or any part of it is constant: such a part could be omitted.
pub fn has_constant_part(condition: &Condition, variables: &[Variable]) -> bool {
    let parts = match condition {
        Condition::Compare { .. } => false,
        Condition::And(a, b) | Condition::Or(a, b) => {
            has_constant_part(a, variables) || has_constant_part(b, variables)
        }
    };
    parts || constant(condition, variables).is_some()
}

/// Conditions that must all hold, or not hold, at the same time.
struct Goals<'a> {
    condition: &'a Condition,
    holds: bool,
    rest: Option<&'a Goals<'a>>,
}

/// Whether there are values within the bounds for which all goals hold.
fn satisfiable(goals: Option<&Goals<'_>>, bounds: &Bounds, patience: &mut u32) -> bool {
    let Some(&Goals { condition, holds, rest }) = goals else { return true };
    if *patience == 0 {
        return true;
    }
    *patience -= 1;
    match (condition, holds) {
        (Condition::And(a, b), true) | (Condition::Or(a, b), false) => {
            let rest = Goals { condition: b, holds, rest };
            satisfiable(Some(&Goals { condition: a, holds, rest: Some(&rest) }), bounds, patience)
        }
        (Condition::And(a, b), false) | (Condition::Or(a, b), true) => {
            [a, b].into_iter().any(|condition| satisfiable(Some(&Goals { condition, holds, rest }), bounds, patience))
        }
        (Condition::Compare { left, by, right }, _) => {
            let (l, r) = (*left, *right);
            let mut go_on = |bounds: Option<Bounds>| bounds.is_some_and(|bounds| satisfiable(rest, &bounds, patience));
            match (by, holds) {
                (Comparison::Below, true) => go_on(bounds.with(l, r, true)),
                (Comparison::Below, false) => go_on(bounds.with(r, l, false)),
                (Comparison::Above, true) => go_on(bounds.with(r, l, true)),
                (Comparison::Above, false) => go_on(bounds.with(l, r, false)),
                (Comparison::Equal, true) => {
                    go_on(bounds.with(l, r, false).and_then(|bounds| bounds.with(r, l, false)))
                }
                (Comparison::Equal, false) => go_on(bounds.with(l, r, true)) || go_on(bounds.with(r, l, true)),
            }
        }
    }
}

/// What is known of the variables of a condition.
#[derive(Clone)]
struct Bounds {
    /// The variables: that at `n` has place `n + 1` among the differences.
    metrics: Vec<MetricId>,
    differences: Differences,
}

impl Bounds {
    /// What the ranges of a condition's variables say; `None` where they are empty.
    fn new(condition: &Condition, variables: &[Variable]) -> Option<Self> {
        let mut metrics = Vec::new();
        collect(condition, &mut metrics);
        let differences = Differences::new(metrics.len());
        let mut bounds = Bounds { metrics, differences };
        for variable in
            variables.iter().filter(|variable| bounds.metrics.contains(&variable.metric)).collect::<Vec<_>>()
        {
            let metric = Operand::Variable(variable.metric);
            if let Some(low) = variable.low {
                bounds = bounds.with(Operand::Number(low), metric, false)?;
            }
            if let Some(high) = variable.high {
                bounds = bounds.with(metric, Operand::Number(high), false)?;
            }
        }
        Some(bounds)
    }

    /// These bounds with one more: that one operand is at most another, or below it; `None` where that contradicts
    /// them.
    fn with(&self, left: Operand, right: Operand, below: bool) -> Option<Self> {
        let place = |operand| match operand {
            Operand::Variable(metric) => {
                let at = self.metrics.iter().position(|&known| known == metric);
                (at.expect("the variables of a condition were collected from it") + 1, 0.0)
            }
            Operand::Number(number) => (0, number),
        };
        let ((row, plus), (column, minus)) = (place(left), place(right));
        let differences = self.differences.with(row, column, Bound { most: minus - plus, below })?;
        Some(Bounds { metrics: self.metrics.clone(), differences })
    }
}

/// The variables of a condition, each once.
fn collect(condition: &Condition, metrics: &mut Vec<MetricId>) {
    match condition {
        Condition::Compare { left, right, .. } => {
            for operand in [left, right] {
                match operand {
                    Operand::Variable(metric) if !metrics.contains(metric) => metrics.push(*metric),
                    _ => {}
                }
            }
        }
        Condition::And(a, b) | Condition::Or(a, b) => {
            collect(a, metrics);
            collect(b, metrics);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::condition::holds;
    use crate::condition::testing::{above, and, any_condition, below, compare, or, variable};

    fn ranges(ranges: &[(Option<f64>, Option<f64>)]) -> Vec<Variable> {
        (0u32..)
            .zip(ranges)
            .map(|(n, &(low, high))| Variable { metric: MetricId(n), unit: None, low, high, step: None })
            .collect()
    }

    #[test]
    fn comparisons_that_cannot_change_are_found() {
        let known = ranges(&[(Some(0.0), Some(10.0)), (Some(10.0), Some(20.0)), (None, None)]);
        let equal = |n| compare(variable(0), Comparison::Equal, Operand::Number(n));
        for (condition, truth) in [
            (compare(variable(2), Comparison::Below, variable(2)), Some(false)),
            (compare(variable(2), Comparison::Equal, variable(2)), Some(true)),
            (above(0, 10.0), Some(false)),
            (above(0, -1.0), Some(true)),
            (below(0, 10.0), None),
            (above(0, 9.0), None),
            (equal(11.0), Some(false)),
            (equal(10.0), None),
            (compare(variable(0), Comparison::Above, variable(1)), Some(false)),
            (compare(variable(0), Comparison::Equal, variable(1)), None),
            (compare(variable(0), Comparison::Below, variable(2)), None),
        ] {
            assert_eq!(constant(&condition, &known), truth, "{condition:?}");
        }
    }

    #[test]
    fn contradictions_and_tautologies_between_comparisons_are_found() {
        let known = ranges(&[(Some(0.0), None)]);
        let a_below_b = compare(variable(1), Comparison::Below, variable(2));
        for (condition, truth) in [
            (and(below(0, 3.0), above(0, 5.0)), Some(false)),
            (and(below(0, 5.0), above(0, 3.0)), None),
            (or(below(0, 5.0), above(0, 3.0)), Some(true)),
            (or(below(0, 3.0), above(0, 5.0)), None),
            (and(below(1, 3.0), below(0, 0.0)), Some(false)),
            (or(below(1, 3.0), above(0, -1.0)), Some(true)),
            (and(a_below_b.clone(), and(above(1, 4.0), below(2, 4.0))), Some(false)),
            (and(a_below_b, and(above(1, 4.0), below(2, 5.0))), None),
        ] {
            assert_eq!(constant(&condition, &known), truth, "{condition:?}");
        }
        let half = or(and(below(0, 3.0), above(0, 5.0)), above(1, 2.0));
        assert!(constant(&half, &known).is_none() && has_constant_part(&half, &known));
    }

    proptest! {
        // Numbers are whole and from 0 to 5, so that quarters hold a value between any two of them for each of three
        // variables: the samples distinguish all values that differ for the condition.
        #[test]
        fn constants_are_those_of_all_values(
            condition in any_condition(3),
            ends in prop::collection::vec((prop::option::of(-1i32..4), prop::option::of(0i32..3)), 3),
        ) {
            let ends: Vec<(Option<f64>, Option<f64>)> = ends.into_iter().map(|(low, more)| {
                (low.map(f64::from), more.map(|more| f64::from(low.unwrap_or(2) + more)))
            }).collect();
            let samples = |(low, high): (Option<f64>, Option<f64>)| {
                let inside = move |x: &f64| low.is_none_or(|low| low <= *x) && high.is_none_or(|high| *x <= high);
                (-8..32).map(|quarter| f64::from(quarter) * 0.25).filter(inside)
            };
            let (mut ever, mut always) = (false, true);
            for a in samples(ends[0]) {
                for b in samples(ends[1]) {
                    for c in samples(ends[2]) {
                        let now = holds(&condition, &|metric: MetricId| Some([a, b, c][metric.index()]));
                        (ever, always) = (ever || now, always && now);
                    }
                }
            }
            let expected = match (ever, always) { (false, _) => Some(false), (_, true) => Some(true), _ => None };
            prop_assert_eq!(constant(&condition, &ranges(&ends)), expected);
        }
    }
}
