//! Physical labs: how tests are chosen for one, run in it, and compared with simulation.

use sesame_plan::{Bound, OperationKind};
pub use sesame_plan::{LabBudget, LabCost, RankOrder};

use super::declaration::Declaration;
use super::fuzz::Target;
use super::ids::{MetricId, TopicId};
use super::metrics::Range;
use super::system::Simulator;

/// A lab.
#[derive(Debug, Clone, PartialEq)]
pub struct Physical {
    /// Its name and doc comment.
    pub declaration: Declaration,
    /// How the lab is reached; `None` for a lab whose results come in by hand.
    pub simulator: Option<Simulator>,
    /// How often each chosen test is run; at least 1. Default 1.
    pub repeats: u32,
    /// What running a test costs.
    pub cost: LabCost,
    /// Tests of which one of these holds are not run in the lab.
    pub exclude: Vec<(MetricId, Bound)>,
    /// What makes a test interesting, the most important first. Each metric once.
    pub rank: Vec<(MetricId, RankOrder)>,
    /// How many tests are chosen, and by what; `None` for a lab that chooses by hand.
    pub budget: Option<LabBudget>,
    /// Differences between simulation and lab that do not matter, in the metric's unit; 0 or more. Each metric once.
    pub tolerance: Vec<(MetricId, f64)>,
    /// Metrics of which only the presence is compared: in the lab an interlock ends the test.
    pub interlock: Vec<MetricId>,
    /// Bodies that are not in the lab, or only there.
    pub shapes: Vec<Shape>,
    /// What may be fitted to make simulation and lab agree.
    pub fits: Vec<Fit>,
}

impl Physical {
    /// Adds the metrics that it speaks of.
    pub fn metrics_into(&self, metrics: &mut impl Extend<MetricId>) {
        metrics.extend(self.exclude.iter().map(|&(metric, _)| metric));
        metrics.extend(self.rank.iter().map(|&(metric, _)| metric));
        metrics.extend(self.tolerance.iter().map(|&(metric, _)| metric));
        metrics.extend(self.interlock.iter().copied());
    }
}

/// A body.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Its name and doc comment; the name is the lab's own.
    pub declaration: Declaration,
    /// What it looks like.
    pub form: Form,
    /// Where it is.
    pub place: ShapePlace,
    /// How much larger it is taken to be on every side, in metres; 0 or more. Default 0.
    pub expand: f64,
}

/// What a body looks like. Lengths are in metres and positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// A sphere of this radius.
    Sphere(f64),
    /// A box with these edges.
    Box([f64; 3]),
}

/// Where a body is.
#[derive(Debug, Clone, PartialEq)]
pub enum ShapePlace {
    /// It moves with the pose of this name.
    Pose(String),
    /// Its centre is here, in metres.
    Point([f64; 3]),
}

/// Something that may be fitted within a range.
#[derive(Debug, Clone, PartialEq)]
pub enum Fit {
    /// A delay of the messages of a topic, in seconds; 0 or more. Without a topic, of all messages that nodes receive.
    RelayDelay(Option<TopicId>, Range),
    /// What the relay does to values in messages, as an operation of this kind: scale, bias or noise. The range is that
    /// of the operation's parameter.
    Relay {
        /// Scale, bias or noise.
        kind: OperationKind,
        /// Which values.
        target: Target,
        /// The permitted factor, bias or standard deviation, in the unit of the values.
        range: Range,
    },
    /// A parameter of the simulator, a plain number.
    Parameter(String, Range),
}
