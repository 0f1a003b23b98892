//! Physical labs, as far as results speak of them: how tests are chosen for one, and how what comes out of it is
//! compared with simulation.

use serde::{Deserialize, Serialize};

use crate::{Bound, Dimension, Fit, MetricId, Simulator};

/// A lab in which chosen tests are run on real robots.
///
/// It changes nothing of what a campaign does, so it is not part of a plan's [meaning](crate::CampaignPlan::meaning).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lab {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// How the robots are reached; `None` if results are entered by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub simulator: Option<Simulator>,
    /// How often each chosen test is run there; at least 1.
    pub repeats: u32,
    /// What running a test costs.
    pub cost: LabCost,
    /// Tests of which one of these holds must not be run there.
    pub exclude: Vec<LabExclusion>,
    /// What makes a test interesting, the most important first. Each metric once.
    pub rank: Vec<RankKey>,
    /// How many tests are chosen, and by what; `None` for a lab whose tests are chosen by hand.
    pub budget: Option<LabBudget>,
    /// Differences between simulation and lab that do not matter. Each metric once.
    pub tolerances: Vec<LabTolerance>,
    /// Metrics of which only the presence is compared: in the lab an interlock ends the test. Each metric once.
    pub interlock: Vec<MetricId>,
    /// Bodies that are not in the lab, or only there. Names are distinct.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<LabShape>,
    /// What of the simulation may be fitted to the lab. Each thing once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fits: Vec<Fit>,
}

/// What running a test costs, in the unit of the budget. One of the two is positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LabCost {
    /// Any test; 0 or more. Default 1.
    pub base: f64,
    /// Each of its operations; 0 or more. Default 0.
    pub per_operation: f64,
}

impl LabCost {
    /// The cost of a test with this many operations.
    pub fn of(self, operations: usize) -> f64 {
        self.base + self.per_operation * operations as f64
    }
}

impl Default for LabCost {
    fn default() -> Self {
        LabCost { base: 1.0, per_operation: 0.0 }
    }
}

/// What is too dangerous for a lab.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LabExclusion {
    /// A metric of the campaign.
    pub metric: MetricId,
    /// A test whose value keeps this bound is not run.
    pub bound: Bound,
}

/// A metric by which tests are ranked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RankKey {
    /// The metric.
    pub metric: MetricId,
    /// Which of its values come first.
    pub order: RankOrder,
}

/// Which values come first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RankOrder {
    /// Small ones.
    Ascending,
    /// Large ones.
    Descending,
    /// Those closest to a value, for example to the bound of a requirement [SESAME 2023, §4.4.2].
    ClosestTo {
        /// The value, in the metric's unit.
        value: f64,
    },
}

impl RankOrder {
    /// A number for a value that is smaller the earlier it comes.
    pub fn place(self, value: f64) -> f64 {
        match self {
            RankOrder::Ascending => value,
            RankOrder::Descending => -value,
            RankOrder::ClosestTo { value: target } => (value - target).abs(),
        }
    }
}

/// How tests are chosen: as different and as interesting as the budget allows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabBudget {
    /// The sum of costs at most; positive.
    pub limit: f64,
    /// The weight of difference against interest, in `0..=1`.
    pub lambda: f64,
    /// What tests differ in; at least one, each once.
    pub over: Vec<Dimension>,
}

/// A difference that does not matter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LabTolerance {
    /// The metric.
    pub metric: MetricId,
    /// The difference, in the metric's unit; 0 or more.
    pub value: f64,
}

/// A body whose contacts with others are found in recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabShape {
    /// Its name in the lab.
    pub name: String,
    /// Its doc comment.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub doc: String,
    /// What it looks like.
    pub form: ShapeForm,
    /// Where it is.
    pub place: ShapePlace,
    /// How much larger it is taken to be on every side, in metres; 0 or more.
    pub expand: f64,
}

/// What a body looks like. Lengths are in metres and positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShapeForm {
    /// A sphere around its place.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A box with its centre at its place.
    Box {
        /// Its whole edges along x, y and z.
        edges: [f64; 3],
    },
}

/// Where a body is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShapePlace {
    /// It moves with a recorded pose.
    Pose {
        /// The pose: a topic, perhaps with a field of its messages, such as `robots/east/pose.position`.
        pose: String,
    },
    /// It does not move.
    Fixed {
        /// Its centre, in metres.
        centre: [f64; 3],
    },
}
