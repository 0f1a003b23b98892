//! Activations and conditions, from the model to the plan.

use sesame_dsl::model;
use sesame_dsl::model::condition as from;
use sesame_plan as plan;
use sesame_plan::condition as to;

use super::selection::Selection;
use super::system::unit;

impl Selection {
    /// When an operation of a known test is active. Nothing is active after the end, so a window cut there is the same
    /// test.
    pub(super) fn activation(&self, activation: &model::Activation, last: f64) -> plan::Activation {
        match activation {
            model::Activation::Window(window) => {
                plan::Activation::Time { start: window.low, end: window.high.min(last) }
            }
            model::Activation::Offline => plan::Activation::Offline,
            model::Activation::Condition { start, end, times } => match end {
                model::End::Condition(end) => plan::Activation::Condition {
                    start: self.condition(start),
                    end: self.condition(end),
                    times: *times,
                },
                model::End::Length(length) => {
                    plan::Activation::ConditionFor { start: self.condition(start), length: *length, times: *times }
                }
            },
        }
    }

    pub(super) fn condition(&self, condition: &from::Condition) -> to::Condition {
        let both = |left: &from::Condition, right: &from::Condition| {
            (Box::new(self.condition(left)), Box::new(self.condition(right)))
        };
        match condition {
            from::Condition::Compare { left, by, right } => {
                to::Condition::Compare { left: self.operand(left), by: *by, right: self.operand(right) }
            }
            from::Condition::And(left, right) => {
                let (left, right) = both(left, right);
                to::Condition::And(left, right)
            }
            from::Condition::Or(left, right) => {
                let (left, right) = both(left, right);
                to::Condition::Or(left, right)
            }
        }
    }

    fn operand(&self, operand: &from::Operand) -> to::Operand {
        match *operand {
            from::Operand::Variable(metric) => to::Operand::Variable(self.metric(metric)),
            from::Operand::Number(number) => to::Operand::Number(number),
        }
    }

    /// How the tests of a search switch operations on and off.
    pub(super) fn activation_mode(
        &self,
        measured: &model::Space,
        mode: &model::ActivationMode,
    ) -> plan::ActivationMode {
        let space = match mode {
            model::ActivationMode::Time => return plan::ActivationMode::Time,
            model::ActivationMode::Condition(space) => space,
        };
        let bound = |bound: f64| bound.is_finite().then_some(bound);
        let variables = space.variables.iter().map(|variable| to::Variable {
            metric: self.metric(variable.metric),
            unit: unit(measured.metrics[variable.metric].unit.as_ref()),
            low: bound(variable.known.low),
            high: bound(variable.known.high),
            step: variable.step,
        });
        plan::ActivationMode::Condition {
            space: to::ConditionSpace {
                variables: variables.collect(),
                depth: space.depth,
                integers: space.integers,
                end: match space.lengths {
                    None => to::ConditionEnd::Condition,
                    Some(range) => to::ConditionEnd::Length { low: range.low, high: range.high },
                },
                times: space.times,
            },
        }
    }

    pub(super) fn constraint(&self, constraint: &from::Constraint) -> to::Constraint {
        match *constraint {
            from::Constraint::Variable(metric) => to::Constraint::Variable { metric: self.metric(metric) },
            from::Constraint::Integer(bounds) => to::Constraint::Integer { bounds },
        }
    }
}
