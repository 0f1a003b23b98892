//! Disturbances of a plan's tests, as planned and as observed.

use sesame_plan::{Activation, CampaignPlan, Choice, OperationId, OperationKind, Span, Test};

use crate::observation::Observation;
use crate::sspr::{Class, Convention, Disturbance, Intensity, Point};

/// The class of a kind of operation.
pub fn class_of(kind: &OperationKind) -> Class {
    match kind {
        OperationKind::RandomValue { .. } => Class::Value,
        OperationKind::PacketLoss | OperationKind::Blackhole => Class::Loss,
        OperationKind::Latency { .. } => Class::Delay,
    }
}

/// An operation of the plan with these choices for its parameters, active in these intervals.
pub fn disturbance(
    plan: &CampaignPlan,
    operation: OperationId,
    choices: &[Choice],
    intervals: Vec<Span>,
) -> Disturbance {
    let operation = plan.operation(operation);
    let parameters = operation.parameters.iter().zip(choices).map(|(parameter, choice)| Intensity {
        permitted: (parameter.low, parameter.high),
        chosen: match *choice {
            Choice::Value { value } => (value, value),
            Choice::Range { low, high } => (low, high),
        },
        shape: parameter.shape,
    });
    Disturbance {
        class: class_of(&operation.kind),
        window: operation.within,
        intervals,
        parameters: parameters.collect(),
    }
}

/// A test as it is planned: what its run will show if it comes to its end. `None` where only a run can tell when its
/// operations are active.
pub fn planned(plan: &CampaignPlan, test: &Test) -> Option<Vec<Disturbance>> {
    let operations = test.operations.iter().map(|it| match it.activation {
        Activation::Time { start, end } => {
            let within = plan.operation(it.operation).within;
            let (start, end) = (start.max(within.start), end.min(within.end).min(plan.campaign.end_after));
            let intervals = if start < end { vec![Span { start, end }] } else { Vec::new() };
            Some(disturbance(plan, it.operation, &it.parameters, intervals))
        }
    });
    operations.collect()
}

/// A test as its run was observed.
pub fn observed(plan: &CampaignPlan, test: &Test, observation: &Observation) -> Vec<Disturbance> {
    let operations = test.operations.iter().zip(&observation.operations);
    operations.map(|(it, effect)| disturbance(plan, it.operation, &it.parameters, effect.intervals.clone())).collect()
}

/// Where a run lies in the reduced parameter space; `None` where no operation was active.
pub fn observed_point(plan: &CampaignPlan, test: &Test, observation: &Observation) -> Option<Point> {
    Point::of(&observed(plan, test, observation), Convention::Ours)
}
