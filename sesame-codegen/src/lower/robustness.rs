//! Temporal formulas of metrics, from the model to the plan.

use sesame_dsl::model::{self, Temporal};
use sesame_plan::stl::{Formula, Robustness};

use super::formula::{inputs, side};
use super::id::raw;

pub(super) fn robustness(of: &model::Robustness) -> Robustness {
    Robustness {
        inputs: inputs(&of.inputs),
        signals: of.signals.clone(),
        formula: formula(&of.formula),
        side: side(of.outbound),
        whole_windows: of.whole_windows,
    }
}

fn formula(of: &Temporal) -> Formula {
    let boxed = |of: &Temporal| Box::new(formula(of));
    match of {
        Temporal::Predicate(signal, by, constant) => {
            Formula::Predicate { signal: raw(*signal), comparison: *by, constant: *constant }
        }
        Temporal::Not(of) => Formula::Not { of: boxed(of) },
        Temporal::All(of) => joined(of, |left, right| Formula::And { left, right }),
        Temporal::Any(of) => joined(of, |left, right| Formula::Or { left, right }),
        Temporal::Implies(left, right) => Formula::Implies { left: boxed(left), right: boxed(right) },
        Temporal::Always(when, of) => Formula::Always { interval: *when, of: boxed(of) },
        Temporal::Eventually(when, of) => Formula::Eventually { interval: *when, of: boxed(of) },
        Temporal::Until(when, left, right) => {
            Formula::Until { interval: *when, weak: false, left: boxed(left), right: boxed(right) }
        }
        Temporal::WeakUntil(when, left, right) => {
            Formula::Until { interval: *when, weak: true, left: boxed(left), right: boxed(right) }
        }
    }
}

/// Many as pairs of pairs, so that a long chain is not a deep formula.
fn joined(of: &[Temporal], join: fn(Box<Formula>, Box<Formula>) -> Formula) -> Formula {
    if let [one] = of {
        return formula(one);
    }
    let (left, right) = of.split_at(of.len() / 2);
    join(Box::new(joined(left, join)), Box::new(joined(right, join)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn predicate(signal: usize) -> Temporal {
        Temporal::Predicate(signal, model::Comparison::AtLeast, 2.0)
    }

    /// The signals of a formula from left to right, and how deep it is.
    fn signals(of: &Formula) -> (Vec<u32>, usize) {
        match of {
            Formula::Predicate { signal, .. } => (vec![*signal], 1),
            Formula::And { left, right } => {
                let ((left, a), (right, b)) = (signals(left), signals(right));
                ([left, right].concat(), a.max(b) + 1)
            }
            _ => panic!("{of:?} is not a chain"),
        }
    }

    #[test]
    fn a_long_chain_keeps_its_order_and_is_no_deep_formula() {
        for length in [2, 3, 7, 1_000] {
            let (found, depth) = signals(&formula(&Temporal::All((0..length).map(predicate).collect())));
            assert_eq!(found, (0..u32::try_from(length).unwrap()).collect::<Vec<_>>());
            assert!(depth <= 11, "{depth}");
        }
    }

    #[test]
    fn operators_keep_their_sides_and_intervals() {
        let when = model::Interval { from: 1.0, to: Some(2.5) };
        let until = Temporal::Until(when, Box::new(predicate(0)), Box::new(predicate(1)));
        let found = formula(&Temporal::Implies(Box::new(Temporal::Not(Box::new(predicate(2)))), Box::new(until)));
        let expected =
            |signal| Box::new(Formula::Predicate { signal, comparison: model::Comparison::AtLeast, constant: 2.0 });
        let interval = model::Interval { from: 1.0, to: Some(2.5) };
        let right = Box::new(Formula::Until { interval, weak: false, left: expected(0), right: expected(1) });
        assert_eq!(found, Formula::Implies { left: Box::new(Formula::Not { of: expected(2) }), right });
    }
}
