//! Campaigns: how tests are found and run.

use super::condition::ConditionSpace;
use super::{CampaignId, Declaration, MetricId, OperationId, TestId};

/// A campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The campaign that clauses it does not write come from. They are in their places here.
    pub from: Option<CampaignId>,
    /// What the search optimises, in written order; each has a direction. Empty exactly for a campaign without a search.
    pub objectives: Vec<MetricId>,
    /// Metrics measured besides the objectives, those of all requirements, and those of expectations.
    pub observed: Vec<MetricId>,
    /// How its tests are found.
    pub search: Search,
    /// The one seed that decides everything. Default 1.
    pub seed: u64,
    /// Simulation time at which a test ends, in seconds; positive.
    pub end_after: f64,
    /// Of which tests the messages are recorded. Default none.
    pub record: Option<Recorded>,
}

/// Of which tests the messages and the activity of operations are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recorded {
    /// Of those that violate a requirement, crash or time out, and of the undisturbed runs to compare them with.
    Failing,
    /// Of all.
    All,
}

/// How the tests of a campaign are found.
#[derive(Debug, Clone, PartialEq)]
pub enum Search {
    /// NSGA-II over tests of these operations.
    Nsga2 {
        /// What a test holds.
        content: Content,
        /// Tests per generation: even, at least 2.
        population: u32,
        /// Tests in total: at least `population`.
        evaluations: u32,
    },
    /// Independent random tests of these operations.
    Random {
        /// What a test holds.
        content: Content,
        /// Tests in total: at least 1.
        evaluations: u32,
    },
    /// One known test again and again.
    Repeat {
        /// Which.
        test: TestId,
        /// How often: at least 1.
        times: u32,
    },
    /// Undisturbed runs: nothing but observation.
    Passive {
        /// How often: at least 1.
        times: u32,
    },
}

/// What a searched test holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// The operations it may hold, in written order; at least one, each once.
    pub operations: Vec<OperationId>,
    /// At least so many operations: 1 or more.
    pub min: u32,
    /// At most so many operations: `min` or more.
    pub max: u32,
    /// How tests switch their operations on and off.
    pub activation: ActivationMode,
}

/// How tests switch their operations on and off.
#[derive(Debug, Clone, PartialEq)]
pub enum ActivationMode {
    /// In windows of simulation time. The default.
    Time,
    /// By conditions that are grown from this.
    Condition(ConditionSpace),
}
