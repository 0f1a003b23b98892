//! Why a plan cannot be searched.

use thiserror::Error;

use crate::coverage::GridError;

/// Why a plan cannot be searched. The generator refuses such campaigns, so such a plan was edited.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SearchError {
    /// No operation can be active in a test.
    #[error(
        "campaign `{campaign}` has no operation that may be active before its end; add one, or end the campaign later"
    )]
    NoOperation {
        /// The campaign.
        campaign: String,
    },
    /// The bounds on the number of operations permit no number.
    #[error(
        "campaign `{campaign}` permits {min} to {max} operations per test; permit at least one, and at most no fewer"
    )]
    Count {
        /// The campaign.
        campaign: String,
        /// The lower bound.
        min: u32,
        /// The upper bound.
        max: u32,
    },
    /// The least number of operations of a test is more than a test can contain.
    #[error(
        "campaign `{campaign}` requires {min} operations per test, but a test can contain at most {most}; require fewer, \
         add operations, or let copies overlap"
    )]
    TooFew {
        /// The campaign.
        campaign: String,
        /// The lower bound.
        min: u32,
        /// How many operations a test can contain.
        most: usize,
    },
    /// The range of an integer parameter contains no integer.
    #[error("the range of `{parameter}` in operation `{operation}` contains no whole number; widen it to include one")]
    NoWholeNumber {
        /// The operation.
        operation: String,
        /// The parameter.
        parameter: String,
    },
    /// Every start condition that could be grown is always true or never true.
    #[error(
        "no start condition of operation `{operation}` in campaign `{campaign}` can be both true and false; add variables, \
         widen the integers, allow more depth, or require less of the condition"
    )]
    NoCondition {
        /// The campaign.
        campaign: String,
        /// The operation.
        operation: String,
    },
    /// A strategy or exploration needs cells, but the campaign does not count coverage.
    #[error("campaign `{campaign}` searches by cells but has no `coverage`; add one")]
    NoCoverage {
        /// The campaign.
        campaign: String,
    },
    /// A strategy that chooses when operations are active, in a campaign in which conditions do so.
    #[error("campaign `{campaign}` is by condition, but its search chooses the times at which operations are active")]
    NotByTime {
        /// The campaign.
        campaign: String,
    },
    /// A strategy that predicts when conditions hold, in a campaign without conditions.
    #[error("campaign `{campaign}` is by time, so it has no conditions whose outcome could be predicted")]
    NotByCondition {
        /// The campaign.
        campaign: String,
    },
    /// The axes of the coverage do not form a grid.
    #[error("the coverage of campaign `{campaign}` cannot be counted: {reason}")]
    Grid {
        /// The campaign.
        campaign: String,
        /// Why not.
        reason: GridError,
    },
    /// A falsification in a space without requirements.
    #[error("campaign `{campaign}` has no requirement to violate; add a `requirement` to its space")]
    NoRequirement {
        /// The campaign.
        campaign: String,
    },
    /// A setting with which its strategy cannot work.
    #[error("campaign `{campaign}` has a {setting} of {value}; it must be {permitted}")]
    Setting {
        /// The campaign.
        campaign: String,
        /// The setting, as a noun.
        setting: &'static str,
        /// Its value.
        value: u32,
        /// The values that are permitted, in words.
        permitted: String,
    },
}
