//! Disturbances of a plan's tests, as planned and as observed.

use sesame_base::observation::{Observation, Outcome};
use sesame_plan::{Activation, CampaignPlan, Choice, ChoiceKind, Domain, OperationId, Parameter, Span, Test};

use crate::sspr::{Convention, Disturbance, Intensity, Point};

/// An operation of the plan with these choices for its parameters, active in these intervals.
pub fn disturbance(
    plan: &CampaignPlan,
    operation: OperationId,
    choices: &[Choice],
    intervals: Vec<Span>,
) -> Disturbance {
    let operation = plan.operation(operation);
    let parameters =
        operation.parameters.iter().zip(choices).flat_map(|(parameter, choice)| intensities(parameter, choice));
    Disturbance { class: operation.kind.class(), window: operation.within, intervals, parameters: parameters.collect() }
}

/// What was chosen for a parameter, in numbers: one for a number, three for a point, none for a text or a file.
fn intensities(parameter: &Parameter, choice: &Choice) -> Vec<Intensity> {
    match (&parameter.domain, choice) {
        (&Domain::Number { low, high, shape, .. }, &Choice::Value { value }) => {
            vec![Intensity { permitted: (low, high), chosen: (value, value), shape }]
        }
        (&Domain::Number { low, high, shape, .. }, &Choice::Range { low: from, high: to }) => {
            vec![Intensity { permitted: (low, high), chosen: (from, to), shape }]
        }
        (Domain::Point { low, high }, Choice::Point { point }) => (0..3)
            .map(|axis| Intensity {
                permitted: (low[axis], high[axis]),
                chosen: (point[axis], point[axis]),
                shape: ChoiceKind::Value,
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// A test as it is planned: what its run will show if it comes to its end. `None` where only a run can tell when its
/// operations are active, since conditions switch them. Operations that act before the start or after the end have no
/// interval.
pub fn planned(plan: &CampaignPlan, test: &Test) -> Option<Vec<Disturbance>> {
    let operations = test.operations.iter().map(|operation| match &operation.activation {
        &Activation::Time { start, end } => {
            let within = plan.operation(operation.operation).within;
            let (start, end) = (start.max(within.start), end.min(within.end).min(plan.campaign.end_after));
            let intervals = if start < end { vec![Span { start, end }] } else { Vec::new() };
            Some(disturbance(plan, operation.operation, &operation.parameters, intervals))
        }
        Activation::Offline => Some(disturbance(plan, operation.operation, &operation.parameters, Vec::new())),
        Activation::Condition { .. } | Activation::ConditionFor { .. } => None,
    });
    operations.collect()
}

/// A test as its run was observed. An operation without effect was as good as never active, and has no interval; of an
/// imported run nobody knows the effects, and what was active counts.
pub fn observed(plan: &CampaignPlan, test: &Test, observation: &Observation) -> Vec<Disturbance> {
    let operations = test.operations.iter().zip(&observation.operations);
    let disturbances = operations.map(|(operation, effect)| {
        let acted = effect.counters.any_effect() || observation.outcome == Outcome::Unknown;
        let intervals = if acted { effect.intervals.clone() } else { Vec::new() };
        disturbance(plan, operation.operation, &operation.parameters, intervals)
    });
    disturbances.collect()
}

/// Where a run lies in the reduced parameter space; `None` where no operation was active with an effect.
pub fn observed_point(plan: &CampaignPlan, test: &Test, observation: &Observation) -> Option<Point> {
    Point::from_disturbances(&observed(plan, test, observation), Convention::Ours)
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::{Counters, OperationEffect};
    use sesame_plan::Dimension;
    use sesame_plan::testing::{operation, plan, test_of, use_of};

    use super::*;

    #[test]
    fn an_operation_without_effect_is_no_part_of_the_point_unless_nobody_counted() {
        let plan = plan(vec![operation(0, sesame_plan::OperationKind::Blackhole)]);
        let test = test_of(vec![use_of(0, 1.0, 2.0, vec![], 1), use_of(0, 5.0, 9.0, vec![], 2)]);
        let effect = |dropped, start, end| OperationEffect {
            intervals: vec![Span { start, end }],
            counters: Counters { seen: 10, dropped, unheard: 3, ..Counters::default() },
            ..OperationEffect::default()
        };
        // Thousands of O0 and T1.
        let of = |outcome, first, second| {
            let operations = vec![effect(first, 1.0, 2.0), effect(second, 5.0, 9.0)];
            let run = Observation { end: 10.0, operations, messages: 100, ..Observation::without_run(outcome) };
            observed_point(&plan, &test, &run).map(|point| {
                [Dimension::O0, Dimension::T1]
                    .map(|dimension| libm::round(1000.0 * point.get(dimension).unwrap_or(f64::NAN)))
            })
        };
        assert_eq!(of(Outcome::Completed, 7, 7), Some([2000.0, 425.0]));
        assert_eq!(of(Outcome::Completed, 0, 7), Some([1000.0, 700.0]));
        assert_eq!(of(Outcome::Crash { message: String::new() }, 7, 0), Some([1000.0, 150.0]));
        assert_eq!(of(Outcome::NoEffect, 0, 0), None);
        assert_eq!(of(Outcome::Unknown, 0, 0), Some([2000.0, 425.0]), "imported");
    }
}
