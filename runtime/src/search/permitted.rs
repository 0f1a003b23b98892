//! What a campaign permits its tests: which operations, how many, when, and how strong.

use sesame_plan::{Activation, CampaignPlan, Choice, Count, OperationId, Shape, Test, TestOperation};
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

    /// Whether a test is one that the campaign permits.
    pub fn permits(&self, test: &Test) -> bool {
        (self.fewest()..=self.most()).contains(&test.operations.len())
            && test.operations.iter().all(|op| self.find(op.operation).is_some_and(|permitted| permitted.permits(op)))
    }
}

impl PermittedOperation {
    fn permits(&self, operation: &TestOperation) -> bool {
        let Activation::Time { start, end } = operation.activation;
        self.window.low <= start
            && start < end
            && end <= self.window.high
            && operation.parameters.len() == self.parameters.len()
            && operation.parameters.iter().zip(&self.parameters).all(|(choice, &(range, shape))| {
                let may_be = |x: f64| range.low <= x && x <= range.high && (!range.integer || libm::trunc(x) == x);
                match (*choice, shape) {
                    (Choice::Value { value }, Shape::Value) => may_be(value),
                    (Choice::Range { low, high }, Shape::Range) => may_be(low) && may_be(high) && low <= high,
                    _ => false,
                }
            })
    }
}
