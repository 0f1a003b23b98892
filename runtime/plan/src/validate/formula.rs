//! Whether the formulas of metrics mention only inputs and signals that they have.

use crate::stl::{self, Robustness};
use crate::{Aggregate, CampaignPlan, Expression, Formula, Span};

use super::check::{Checked, at, each, filled, finite, id, positive, require, span};

impl CampaignPlan {
    pub(super) fn sound_formula(&self, formula: &Formula) -> Checked {
        let inputs = formula.inputs.len();
        at("inputs", filled(&formula.inputs))?;
        each("inputs", &formula.inputs, |input| at("field", self.field(&input.field)))?;
        let aggregate = match &formula.aggregate {
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
                expression(of, inputs)
            }
            Aggregate::Count { of } | Aggregate::Duration { of } => proposition(of, inputs),
        };
        at("aggregate.of", aggregate)?;
        at("when", formula.when.as_ref().map_or(Ok(()), |when| proposition(when, inputs)))?;
        at("every", formula.every.map_or(Ok(()), positive))?;
        at("per", formula.per.as_ref().map_or(Ok(()), |per| self.field(per)))
    }

    pub(super) fn sound_robustness(&self, robustness: &Robustness) -> Checked {
        let inputs = robustness.inputs.len();
        at("inputs", filled(&robustness.inputs))?;
        each("inputs", &robustness.inputs, |input| at("field", self.field(&input.field)))?;
        let mut groups = robustness.inputs.iter().filter(|input| input.members == crate::Members::Each);
        let group = groups.next().map(|input| input.field.topic);
        let other = groups.find(|input| Some(input.field.topic) != group);
        at("inputs", require(other.is_none(), || "members of more than one group are to be told apart".to_owned()))?;
        each("signals", &robustness.signals, |signal| expression(signal, inputs))?;
        at("formula", temporal(&robustness.formula, robustness.signals.len()))
    }
}

fn expression(of: &Expression, inputs: usize) -> Checked {
    let input = |index: u32| id("input", index as usize, inputs);
    match of {
        Expression::Constant(number) => finite(*number),
        Expression::Input(index) => input(*index),
        Expression::Negate(of) | Expression::Absolute(of) => expression(of, inputs),
        Expression::Sum(of) | Expression::Product(of) => of.iter().try_for_each(|of| expression(of, inputs)),
        Expression::Min(of) | Expression::Max(of) => {
            filled(of)?;
            of.iter().try_for_each(|of| expression(of, inputs))
        }
        Expression::Divide { value, by } => {
            expression(value, inputs)?;
            expression(by, inputs)
        }
        Expression::Distance { from, to, scale } => {
            input(*from)?;
            input(*to)?;
            finite(*scale)
        }
    }
}

fn proposition(of: &crate::formula::Condition, inputs: usize) -> Checked {
    use crate::formula::Condition;
    match of {
        Condition::Constant(_) => Ok(()),
        Condition::Input(index) => id("input", *index as usize, inputs),
        Condition::Compare { left, right, by: _ } => {
            expression(left, inputs)?;
            expression(right, inputs)
        }
        Condition::Same { left, right } => {
            proposition(left, inputs)?;
            proposition(right, inputs)
        }
        Condition::All(of) | Condition::Any(of) => of.iter().try_for_each(|of| proposition(of, inputs)),
        Condition::Not(of) => proposition(of, inputs),
    }
}

fn temporal(formula: &stl::Formula, signals: usize) -> Checked {
    use stl::Formula;
    match formula {
        Formula::Predicate { signal, constant, comparison: _ } => {
            id("signal", *signal as usize, signals)?;
            finite(*constant)
        }
        Formula::Not { of } => temporal(of, signals),
        Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
            temporal(left, signals)?;
            temporal(right, signals)
        }
        Formula::Always { interval: within, of } | Formula::Eventually { interval: within, of } => {
            interval(*within)?;
            temporal(of, signals)
        }
        Formula::Until { interval: within, left, right } => {
            interval(*within)?;
            temporal(left, signals)?;
            temporal(right, signals)
        }
    }
}

fn interval(interval: stl::Interval) -> Checked {
    span(Span { start: interval.from, end: interval.to.unwrap_or(interval.from) })
}
