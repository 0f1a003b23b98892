//! Campaigns: how tests are found and run.

use super::condition::{Condition, ConditionSpace};
use sesame_plan::{Confirmation, Copies, Dimension, Exploration, Recorded, StopRule, Strategy};

use super::declaration::Declaration;
use super::ids::{CampaignId, MetricId, OperationId, TestId};
use super::metrics::Range;

/// A campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// The campaign that clauses it does not write come from. They are in their places here.
    pub from: Option<CampaignId>,
    /// What the search optimises, in written order; each has a direction. Empty exactly for a campaign without a
    /// search.
    pub objectives: Vec<MetricId>,
    /// Metrics measured besides the objectives, those of all requirements, and those of expectations.
    pub observed: Vec<MetricId>,
    /// How its tests are found.
    pub search: Search,
    /// How coverage is counted; `None` where the campaign does not say.
    pub coverage: Option<Coverage>,
    /// What the search does to cover more cells. Default nothing.
    pub exploration: Option<Exploration>,
    /// How tests that enter the front are confirmed. Default not at all.
    pub confirm: Option<Confirmation>,
    /// Over how many nearest tests the search averages what it is told of each, 1 or more; only where a search learns.
    /// Default it does not.
    pub neighbours: Option<u32>,
    /// What else stops the search, in the order of [`StopRule`].
    pub stop: Vec<StopRule>,
    /// The one seed that decides everything. Default 1.
    pub seed: u64,
    /// Simulation time at which a test ends, in seconds; positive.
    pub end_after: f64,
    /// What ends a test before that time. Default nothing.
    pub end_when: Option<Condition>,
    /// The tests whose messages are recorded. Default none.
    pub record: Option<Recorded>,
}

/// How the tests of a campaign are found.
#[derive(Debug, Clone, PartialEq)]
pub enum Search {
    /// A strategy chooses tests of these operations. The campaign has what the strategy needs.
    Strategy {
        /// What a test holds.
        template: TestTemplate,
        /// Which, with its settings: a population that is bred in pairs is even and at least 2, another is at least 1.
        strategy: Strategy,
        /// Tests in total: at least 1, and at least a population that is bred.
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

impl Search {
    /// What its tests hold; `None` where nothing is searched.
    pub fn template(&self) -> Option<&TestTemplate> {
        match self {
            Search::Strategy { template, .. } => Some(template),
            Search::Repeat { .. } | Search::Passive { .. } => None,
        }
    }
}

/// How a search's coverage of the reduced parameter space is counted, and when it suffices.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// The grid, in written order: at least one axis, each of another dimension, at most 100,000 cells together.
    pub axes: Vec<CoverageAxis>,
    /// Tests that a cell must have seen to be covered: 1 or more. Default 1.
    pub hits: u32,
    /// The share of all cells, in `0..=1` and above 0, at which the search stops.
    pub stop_at: Option<f64>,
    /// Tests in total after which a search that stops at a share gives up: at least its evaluations, in whose place it
    /// stands. Only with `stop_at`.
    pub failsafe: Option<u32>,
}

/// A dimension divided into cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoverageAxis {
    /// Which.
    pub dimension: Dimension,
    /// From the beginning of the first cell to the end of the last, not empty.
    pub range: Range,
    /// How many cells: 1 or more.
    pub cells: u32,
}

/// What a searched test holds.
#[derive(Debug, Clone, PartialEq)]
pub struct TestTemplate {
    /// The operations it may hold, in written order; at least one, each once.
    pub operations: Vec<OperationId>,
    /// At least so many operations: 1 or more.
    pub min: u32,
    /// At most so many operations: `min` or more.
    pub max: u32,
    /// What holds of several copies of one operation in a test. Default that they are never active at the same time.
    pub copies: Copies,
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
