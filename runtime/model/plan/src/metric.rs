//! Metrics, and the requirements that bound them.

use serde::{Deserialize, Serialize};

use crate::stl::Robustness;
use crate::{Aggregate, Expression, FieldRef, Formula, Input, Members, MetricId, MonitorId, Score, Source, TopicId};

/// Which end of a metric is of interest to a tester.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Larger is more dangerous.
    Maximise,
    /// Smaller is more dangerous (or cheaper).
    Minimise,
}

/// A number computed from the messages of a test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Its name in the space.
    pub name: String,
    /// Its doc comment.
    pub doc: String,
    /// The unit of its value; `None` for a plain number.
    pub unit: Option<String>,
    /// Which way an objective on it goes; objectives always have one.
    pub direction: Option<Direction>,
    /// The value of a test in which it was never set.
    pub default: Option<f64>,
    /// Its value for conditions before it is first set.
    pub initial: Option<f64>,
    /// Where its value comes from.
    pub source: MetricSource,
    /// The only way in which its value changes during a run, where that is known; `None` where it may go both ways.
    /// What a hook declares is checked while it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trend: Option<Trend>,
    /// Whether infinity and NaN are ordinary values of what its hook reads, as in laser scans. Default false, and then
    /// not written.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub accepts_not_finite: bool,
    /// Line of its declaration, from 1.
    pub line: u32,
}

/// The only way in which a metric's value changes during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trend {
    /// It never gets smaller.
    Rising,
    /// It never gets greater.
    Falling,
}

/// Where a metric's value comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum MetricSource {
    /// The user's Rust code, called with each message of these topics.
    Hook {
        /// Its inputs, in declaration order.
        topics: Vec<TopicId>,
    },
    /// The sum over operations of observed active time, clipped to the run, in seconds.
    FuzzingTime,
    /// The last value received.
    Last {
        /// Which value of which message.
        input: FieldRef,
    },
    /// By how much a formula of signal temporal logic is kept over the whole run; known when it is over.
    Robustness {
        /// The formula.
        robustness: Robustness,
    },
    /// Computed from messages as the space says.
    Formula {
        /// How.
        formula: Formula,
    },
    /// What there is to say of a runtime monitor.
    Monitor {
        /// Which monitor.
        monitor: MonitorId,
        /// What it measures.
        score: Score,
    },
}

impl MetricSource {
    /// The field whose values its own are, unchanged: its last one, its least or its greatest.
    pub fn field(&self) -> Option<&FieldRef> {
        let formula = match self {
            MetricSource::Last { input } => return Some(input),
            MetricSource::Formula { formula } => formula,
            _ => return None,
        };
        let (Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of }) = &formula.aggregate else {
            return None;
        };
        let Expression::Input(at) = of else { return None };
        let input = &formula.inputs[*at as usize];
        (input.list.is_none() && input.memory.is_empty() && input.members != Members::Sum).then_some(&input.field)
    }

    /// What it reads itself. A topic may be there several times.
    pub fn sources(&self) -> Vec<Source> {
        match self {
            MetricSource::Hook { topics } => topics.iter().copied().map(Source::whole).collect(),
            MetricSource::FuzzingTime | MetricSource::Monitor { .. } => Vec::new(),
            MetricSource::Last { input } => vec![Source::whole(input.topic)],
            MetricSource::Robustness { robustness: Robustness { inputs, .. } }
            | MetricSource::Formula { formula: Formula { inputs, .. } } => inputs.iter().map(Input::source).collect(),
        }
    }
}

/// What must hold of a metric's value. Bounds are in the metric's unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Bound {
    /// `<= value`
    AtMost {
        /// The bound.
        value: f64,
    },
    /// `< value`
    Below {
        /// The bound.
        value: f64,
    },
    /// `>= value`
    AtLeast {
        /// The bound.
        value: f64,
    },
    /// `> value`
    Above {
        /// The bound.
        value: f64,
    },
    /// `== value`
    Equal {
        /// The bound.
        value: f64,
    },
    /// `in [low, high]`, both ends included
    Within {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

impl Bound {
    /// The number with which values are compared, if it is one.
    pub fn number(self) -> Option<f64> {
        match self {
            Bound::AtMost { value }
            | Bound::Below { value }
            | Bound::AtLeast { value }
            | Bound::Above { value }
            | Bound::Equal { value } => Some(value),
            Bound::Within { .. } => None,
        }
    }

    /// Whether a value keeps the bound. A NaN keeps none.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Bound::AtMost { value } => x <= value,
            Bound::Below { value } => x < value,
            Bound::AtLeast { value } => x >= value,
            Bound::Above { value } => x > value,
            Bound::Equal { value } => x == value,
            Bound::Within { low, high } => (low..=high).contains(&x),
        }
    }
}

/// What must hold in every test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Requirement {
    /// Its name in the space, for example `R1`.
    pub name: String,
    /// Its sentence.
    pub text: String,
    /// The metric it bounds.
    pub metric: MetricId,
    /// The bound.
    pub bound: Bound,
}
