//! A campaign: what its tests hold, how they are found, and when it stops.

use serde::{Deserialize, Serialize};

use crate::condition::{Condition, ConditionSpace};
use crate::{Confirmation, CoverageGoal, Exploration, Lengths, MetricId, OperationId, Search, StopRule, Times};

/// A campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// What the search optimises; each has a direction. Empty for a campaign that only repeats.
    pub objectives: Vec<MetricId>,
    /// The operations a test may hold.
    pub operations: Vec<OperationId>,
    /// How many operations a test holds.
    pub count: Count,
    /// What holds of several copies of one operation in a test.
    #[serde(default, skip_serializing_if = "Copies::is_default")]
    pub copies: Copies,
    /// How tests switch their operations on and off.
    pub activation: ActivationMode,
    /// How tests are found.
    pub search: Search,
    /// How coverage of the space is counted; `None` for a campaign that does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<CoverageGoal>,
    /// What an evolution does to cover more cells; `None` for one that only counts them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exploration: Option<Exploration>,
    /// How tests that enter the front are confirmed; `None` for a campaign that believes each first run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirm: Option<Confirmation>,
    /// Over how many nearest tests the search averages what it is told of each; `None` for a search that is told what
    /// came out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<u32>,
    /// What stops the search besides its number of tests and its coverage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stop: Vec<StopRule>,
    /// The one seed that decides everything; `run --seed` overrides it.
    pub seed: u64,
    /// Simulation time at which a test ends, in seconds.
    pub end_after: f64,
    /// What ends a test before that time: weighed whenever the transport has advanced, after each step of a simulator
    /// that is stepped. `None` for a campaign that does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end_when: Option<Condition>,
    /// The tests whose messages and activity of operations are recorded; `None` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub record: Option<Recorded>,
    /// Whether reference runs record everything that happens in them, as is needed to describe when operations have to
    /// act, whatever the search reads.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub describes_when: bool,
}

/// The tests whose messages and activity of operations are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recorded {
    /// Those that violate a requirement, crash or time out, and the reference runs to compare them with.
    Failing,
    /// All tests.
    All,
}

/// Bounds of a count, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// At least.
    pub min: u32,
    /// At most.
    pub max: u32,
}

/// What holds of several copies of one operation in a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Copies {
    /// They are never active at the same time, so that together they stay within what the operation declares. By time
    /// their windows are disjoint; by condition a copy waits while another one is active.
    #[default]
    Apart,
    /// They may be active at the same time.
    MayOverlap,
    /// There is at most one.
    Once,
}

/// At most so many copies of one operation with disjoint windows are in one test: as short as they may be, they fill
/// half of what is permitted. So there is always room to move, unless the operation demands longer windows; then those
/// that fit are permitted.
const MOST_APART: u32 = 500;

impl Copies {
    /// How many copies of one operation a test by time may contain.
    pub fn most(self, times: Times) -> u32 {
        match (self, times) {
            (Copies::Once, _) | (Copies::Apart, Times::Offline) => 1,
            (Copies::Apart, Times::Windows { lengths: None, .. }) => MOST_APART,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts to integers saturate")]
            (Copies::Apart, Times::Windows { room, lengths: Some(Lengths { low, .. }) }) => {
                // Rounding must not lose the last of those that fit.
                MOST_APART.min((room / low + 1e-9) as u32).max(1)
            }
            (Copies::MayOverlap, _) => u32::MAX,
        }
    }

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Copies::default()
    }
}

/// How tests switch their operations on and off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ActivationMode {
    /// In windows of simulation time.
    Time,
    /// By conditions grown from this space.
    Condition {
        /// What they are made of.
        space: ConditionSpace,
    },
}
