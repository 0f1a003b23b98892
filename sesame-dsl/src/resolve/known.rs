//! What is known of the values of metrics from their declarations alone.

use sesame_plan::Score;

use super::Resolver;
use crate::model::condition::ValueRange;
use crate::model::{Aggregate, BinaryFunction, EddiId, Expression, Id as _, Metric, MetricSource, UnaryFunction};

impl Resolver<'_> {
    /// What is known of a metric's values before any test, its initial value included.
    pub(super) fn known_of(&self, metric: &Metric) -> ValueRange {
        let from_zero = match &metric.source {
            // It needs no message, so it has a value from the beginning.
            MetricSource::FuzzingTime => return ValueRange { low: 0.0, high: f64::INFINITY },
            MetricSource::Formula(formula) => match &formula.aggregate {
                Aggregate::Count { .. } | Aggregate::Duration { .. } => true,
                // Over groups and keys these are the least, the greatest or the sum of values that are not negative.
                Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
                    never_negative(of)
                }
            },
            MetricSource::Monitor(eddi, score) => {
                let high = match score {
                    Score::MissedHazards { .. } | Score::ForeseenHazards { .. } | Score::Holds { .. } => 1.0,
                    Score::Integrity => self.highest_integrity(*eddi),
                    _ => f64::INFINITY,
                };
                let initial = metric.initial.unwrap_or(0.0);
                return ValueRange { low: initial.min(0.0), high: initial.max(high) };
            }
            MetricSource::Hook(_) | MetricSource::Last(_) | MetricSource::Robustness(_) => false,
        };
        if !from_zero {
            return ValueRange::NOTHING;
        }
        ValueRange { low: metric.initial.map_or(0.0, |initial| initial.min(0.0)), high: f64::INFINITY }
    }

    /// The integrity of the strongest guarantee of a monitor.
    fn highest_integrity(&self, eddi: EddiId) -> f64 {
        let strongest = self.eddis[eddi.index()].as_ref().and_then(|eddi| eddi.guarantees.first());
        strongest.map_or(f64::INFINITY, |guarantee| f64::from(guarantee.integrity))
    }
}

fn never_negative(expression: &Expression) -> bool {
    match expression {
        Expression::Constant(value) => *value >= 0.0,
        Expression::Absolute(_)
        | Expression::Distance(_)
        | Expression::Time
        | Expression::Now
        | Expression::Unary { function: UnaryFunction::Sqrt | UnaryFunction::Exp | UnaryFunction::Acos, .. }
        | Expression::Binary { function: BinaryFunction::Hypot, .. } => true,
        Expression::Sum(of) | Expression::Product(of) | Expression::Min(of) => of.iter().all(never_negative),
        Expression::Max(of) => of.iter().any(never_negative),
        Expression::Divide { value, by } => never_negative(value) && never_negative(by),
        Expression::Input(_)
        | Expression::Integral(_)
        | Expression::Scene { .. }
        | Expression::Negate(_)
        | Expression::SignedDistance(_)
        | Expression::Unary { .. }
        | Expression::Binary { .. } => false,
    }
}
