//! What a campaign permits its tests: which operations, how many, when, and how strong.

use sesame_plan::{CampaignPlan, Count, OperationId, Shape};
use thiserror::Error;

use crate::search::range::Range;

/// Why a plan cannot be searched. The generator refuses such campaigns, so a plan that is one was edited.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SearchError {
    /// No operation can be active in a test.
    #[error("campaign `{campaign}` has no operation that may be active before its end; give it one, or end it later")]
    NoOperation {
        /// The campaign.
        campaign: String,
    },
    /// The bounds on the number of operations leave none.
    #[error("campaign `{campaign}` permits {min} to {max} operations per test; permit at least one, in rising order")]
    Count {
        /// The campaign.
        campaign: String,
        /// The lower bound.
        min: u32,
        /// The upper bound.
        max: u32,
    },
    /// A parameter must be whole, and no whole number is permitted.
    #[error("operation `{operation}` permits no whole number for `{parameter}`; widen its range to include one")]
    NoWholeNumber {
        /// The operation.
        operation: String,
        /// The parameter.
        parameter: String,
    },
    /// A population of nobody.
    #[error("campaign `{campaign}` has a population of 0; give it at least 1")]
    NoPopulation {
        /// The campaign.
        campaign: String,
    },
}

/// All that a campaign's tests may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Permitted {
    operations: Vec<PermittedOperation>,
    count: Count,
}

/// One operation as far as a campaign permits it.
#[derive(Debug, Clone, PartialEq)]
pub struct PermittedOperation {
    /// Which.
    pub operation: OperationId,
    /// Its windows: inside `within` and the campaign.
    pub window: Range,
    /// Its parameters, in the operation's order.
    pub parameters: Vec<(Range, Shape)>,
    /// Probability that a fresh test includes it.
    pub inclusion: f64,
}

impl Permitted {
    /// What a plan's campaign permits. Operations that could only begin at or after its end are left out.
    pub fn of(plan: &CampaignPlan) -> Result<Self, SearchError> {
        let campaign = &plan.campaign;
        let name = || campaign.name.clone();
        let count = Count { min: campaign.count.min.max(1), max: campaign.count.max };
        if count.min > count.max {
            return Err(SearchError::Count { campaign: name(), min: campaign.count.min, max: campaign.count.max });
        }
        let mut operations = Vec::new();
        for &id in &campaign.operations {
            let operation = plan.operation(id);
            let end = operation.within.end.min(campaign.end_after);
            if operation.within.start >= end {
                continue;
            }
            let mut parameters = Vec::new();
            for parameter in &operation.parameters {
                let range = Range::parameter(parameter).ok_or_else(|| SearchError::NoWholeNumber {
                    operation: operation.name.clone(),
                    parameter: parameter.name.clone(),
                })?;
                parameters.push((range, parameter.shape));
            }
            operations.push(PermittedOperation {
                operation: id,
                window: Range::window(operation.within.start, end),
                parameters,
                inclusion: operation.inclusion,
            });
        }
        if operations.is_empty() {
            return Err(SearchError::NoOperation { campaign: name() });
        }
        Ok(Permitted { operations, count })
    }

    /// The operations, in the campaign's order; at least one.
    pub fn operations(&self) -> &[PermittedOperation] {
        &self.operations
    }

    /// The least number of operations of a test, at least 1.
    pub fn fewest(&self) -> usize {
        self.count.min as usize
    }

    /// The greatest number of operations of a test, at least [`Permitted::fewest`].
    pub fn most(&self) -> usize {
        self.count.max as usize
    }

    /// What is permitted of an operation; `None` for one that the campaign does not use.
    pub fn find(&self, operation: OperationId) -> Option<&PermittedOperation> {
        self.operations.iter().find(|permitted| permitted.operation == operation)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;
    use sesame_plan::{Activation, Choice, Drain, Operation, OperationKind, Parameter, Search, Span, Test};

    use super::*;
    use crate::search::landscape::LANDSCAPES;

    /// Plans with up to five operations of varied windows and parameters, and varied counts.
    pub(crate) fn any_plan() -> impl Strategy<Value = CampaignPlan> {
        let ends = || (0.0..100.0f64, 0.0..100.0f64).prop_map(|(a, b)| (a.min(b), a.max(b)));
        let parameter =
            (ends(), any::<bool>(), any::<bool>(), any::<bool>()).prop_map(|((a, b), value, integer, fixed)| {
                Parameter {
                    name: "p".to_owned(),
                    unit: None,
                    low: if integer { libm::floor(a) - 50.0 } else { a - 50.0 },
                    high: if fixed {
                        if integer { libm::floor(a) - 50.0 } else { a - 50.0 }
                    } else {
                        b - 50.0 + f64::from(integer)
                    },
                    shape: if value { Shape::Value } else { Shape::Range },
                    integer,
                }
            });
        let operation = (ends(), proptest::collection::vec(parameter, 0..4), 0.0..=1.0f64).prop_map(
            |((start, end), parameters, inclusion)| Operation {
                name: "o".to_owned(),
                doc: String::new(),
                topic: sesame_plan::TopicId(0),
                // What is varied follows from the parameters alone, whatever the kind.
                kind: OperationKind::Latency { distribution: sesame_plan::Distribution::Fixed, drain: Drain::Finish },
                parameters,
                within: Span { start, end: end + 0.01 },
                priority: 0,
                inclusion,
                timed: true,
            },
        );
        (proptest::collection::vec(operation, 1..6), 1u32..4, 0u32..6, 0.5..120.0f64).prop_map(
            |(operations, min, more, end_after)| {
                let mut plan = LANDSCAPES[0].plan(Search::Nsga2 { population: 7, evaluations: 40 });
                plan.campaign.operations = (0u32..).map(OperationId).take(operations.len()).collect();
                plan.campaign.count = Count { min, max: min + more };
                plan.campaign.end_after = end_after;
                plan.operations = operations;
                plan.operations[0].within.start = plan.operations[0].within.start.min(end_after / 2.0);
                plan
            },
        )
    }

    /// What of the plan a test breaks, if anything: read off the plan itself.
    pub(crate) fn broken_rule(plan: &CampaignPlan, test: &Test) -> Option<String> {
        let count = plan.campaign.count;
        if !(count.min.max(1)..=count.max).contains(&u32::try_from(test.operations.len()).ok()?) {
            return Some(format!("{} operations", test.operations.len()));
        }
        for applied in &test.operations {
            let operation = plan.operation(applied.operation);
            let Activation::Time { start, end } = applied.activation;
            let within = operation.within;
            if !(within.start <= start && start < end && end <= within.end && start < plan.campaign.end_after) {
                return Some(format!("window {start} to {end}"));
            }
            if applied.parameters.len() != operation.parameters.len() {
                return Some("number of parameters".to_owned());
            }
            for (choice, parameter) in applied.parameters.iter().zip(&operation.parameters) {
                let (low, high) = match (*choice, parameter.shape) {
                    (Choice::Value { value }, Shape::Value) => (value, value),
                    (Choice::Range { low, high }, Shape::Range) => (low, high),
                    _ => return Some("shape of a parameter".to_owned()),
                };
                let whole = !parameter.integer || (libm::trunc(low) == low && libm::trunc(high) == high);
                if !(parameter.low <= low && low <= high && high <= parameter.high && whole) {
                    return Some(format!("choice {low} to {high} of {parameter:?}"));
                }
            }
        }
        None
    }

    #[test]
    fn what_cannot_be_searched_is_refused_with_its_reason() {
        let plan = || LANDSCAPES[0].plan(Search::Random { evaluations: 10 });
        let refusal = |plan: &CampaignPlan| Permitted::of(plan).map_err(|e| e.to_string()).unwrap_err();

        let mut ends_early = plan();
        ends_early.operations.iter_mut().for_each(|op| op.within = Span { start: 70.0, end: 80.0 });
        assert!(refusal(&ends_early).contains("no operation that may be active before its end"));

        let mut none_allowed = plan();
        none_allowed.campaign.count = Count { min: 0, max: 0 };
        assert!(refusal(&none_allowed).contains("permits 0 to 0 operations per test"));

        let mut no_number = plan();
        let offset = &mut no_number.operations[1].parameters[0];
        (offset.integer, offset.low, offset.high) = (true, 0.2, 0.8);
        assert!(refusal(&no_number).contains("`jitter1` permits no whole number for `offset`"));
    }

    #[test]
    fn operations_that_begin_after_the_campaign_are_left_out_and_others_are_clipped() {
        let mut plan = LANDSCAPES[0].plan(Search::Random { evaluations: 10 });
        plan.operations[0].within = Span { start: 70.0, end: 80.0 };
        plan.operations[1].within = Span { start: 60.0, end: 90.0 };
        let permitted = Permitted::of(&plan).unwrap();
        let [only] = permitted.operations() else { panic!("{permitted:?}") };
        assert_eq!((only.operation, only.window.low, only.window.high), (OperationId(1), 60.0, 70.0));
    }
}
