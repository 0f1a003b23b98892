//! Temporal formulas of metrics, from the model to the plan.

use sesame_dsl::model::{self, Temporal};
use sesame_plan::stl::{Comparison, Formula, Interval, Robustness};

use super::formula::{expression, inputs, side};
use super::raw;

pub(super) fn robustness(of: &model::Robustness) -> Robustness {
    Robustness {
        inputs: inputs(&of.inputs),
        signals: of.signals.iter().map(expression).collect(),
        formula: formula(&of.formula),
        side: side(of.outbound),
    }
}

fn formula(of: &Temporal) -> Formula {
    let boxed = |of: &Temporal| Box::new(formula(of));
    match of {
        Temporal::Predicate(signal, by, constant) => {
            Formula::Predicate { signal: raw(*signal), comparison: comparison(*by), constant: *constant }
        }
        Temporal::Not(of) => Formula::Not { of: boxed(of) },
        Temporal::All(of) => joined(of, |left, right| Formula::And { left, right }),
        Temporal::Any(of) => joined(of, |left, right| Formula::Or { left, right }),
        Temporal::Implies(left, right) => Formula::Implies { left: boxed(left), right: boxed(right) },
        Temporal::Always(when, of) => Formula::Always { interval: interval(*when), of: boxed(of) },
        Temporal::Eventually(when, of) => Formula::Eventually { interval: interval(*when), of: boxed(of) },
        Temporal::Until(when, left, right) => {
            Formula::Until { interval: interval(*when), left: boxed(left), right: boxed(right) }
        }
    }
}

/// Many as pairs of pairs, so that a long chain is not a deep formula.
fn joined(of: &[Temporal], join: fn(Box<Formula>, Box<Formula>) -> Formula) -> Formula {
    match of {
        [one] => formula(one),
        _ => {
            let (left, right) = of.split_at(of.len() / 2);
            join(Box::new(joined(left, join)), Box::new(joined(right, join)))
        }
    }
}

fn comparison(by: model::Comparison) -> Comparison {
    match by {
        model::Comparison::AtMost => Comparison::AtMost,
        model::Comparison::Below => Comparison::Below,
        model::Comparison::AtLeast => Comparison::AtLeast,
        model::Comparison::Above => Comparison::Above,
        model::Comparison::Equal => Comparison::Equal,
        model::Comparison::NotEqual => Comparison::NotEqual,
    }
}

fn interval(interval: model::Interval) -> Interval {
    Interval { from: interval.from, to: interval.to }
}
