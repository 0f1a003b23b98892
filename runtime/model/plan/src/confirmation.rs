//! How a campaign confirms what it finds with a simulator that is not deterministic.

use serde::{Deserialize, Serialize};

/// How tests are confirmed: each is run again, the same disturbance with fresh seeds of the simulator, and its fitness
/// is then what these runs say. Tests that enter the front are, and those that violate a requirement where it is asked
/// for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Confirmation {
    /// How often each is run again; at least 1.
    pub times: u32,
    /// How the values of these runs become one.
    pub by: Statistic,
    /// Whether each test that violates a requirement is confirmed too, on the front or not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub violations: bool,
}

/// How the values of an objective in several runs become one. The run that selected the test is not among them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Statistic {
    /// Their mean.
    Mean,
    /// Their median; with an even number of values, the mean of the two in the middle.
    Median,
    /// The value that this share of the runs reach or go beyond in the objective's direction.
    Quantile {
        /// In `0..=1` and above 0.
        share: f64,
    },
}
