//! What was observed in one run of a test: what a worker reports and the results repository keeps.

mod altered;
mod course;
mod monitor;
mod traffic;

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use sesame_plan::{RequirementId, Span, Trend};

pub use altered::{ALTERED_LISTED, AlteredMessage, AlteredMessages};
pub use course::{Course, Entered, Happening, Heard, RARE, Signal, SignalEvent, States};
pub use monitor::{CHANGES_KEPT, ChangeCause, EvidenceChange, MonitorDecision, MonitorHazard, MonitorObservation};
pub use traffic::{Traffic, Unreached};

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// It ran to its end, and an operation had an effect (or it has no operations by design).
    Completed,
    /// It ran to its end, but no operation had any effect.
    NoEffect,
    /// It ran to its end in another program, which did not count what operations did: whether they had any effect is
    /// not known, and its counters are all zero. Imported tests end so, and those of a search whose tests the user's
    /// own program carries out.
    Unknown,
    /// The simulator or a hook failed or panicked, or the worker process died.
    Crash {
        /// What is known of the cause.
        message: String,
    },
    /// It took longer than its wall-clock limit and was stopped.
    Timeout {
        /// The limit, in seconds of wall time.
        limit: f64,
    },
    /// A program that the space launches could not be started, or was not ready in time. It says nothing about the
    /// system, and neither do the next two.
    LaunchFailed {
        /// What is known of the cause.
        message: String,
    },
    /// The connection to the simulator was lost, although nothing says that the simulator has ended.
    Disconnect {
        /// What is known of the cause.
        message: String,
    },
    /// The clock of the simulator went back, or leapt ahead.
    WrongClock {
        /// From when to when.
        message: String,
    },
}

/// How much of what is known of a crash is kept, in bytes.
const CAUSE_BYTES: usize = 4096;

impl Outcome {
    /// A crash for this cause. A very long one, which simulators and panics can produce, is
    /// shortened, and says by how much.
    pub fn crash(cause: String) -> Self {
        Outcome::Crash { message: Outcome::message_of(cause) }
    }

    /// A cause as an outcome keeps it: a very long one is shortened.
    pub fn message_of(mut cause: String) -> String {
        if cause.len() > CAUSE_BYTES {
            let whole = cause.len();
            let kept = (0..=CAUSE_BYTES).rev().find(|&at| cause.is_char_boundary(at)).unwrap_or(0);
            cause.truncate(kept);
            write!(cause, "… ({} bytes more)", whole - kept).expect("text grows as needed");
        }
        cause
    }

    /// Whether it is the environment's fault that the run broke off: the run says nothing about the system, and is
    /// worth another try.
    pub fn is_of_environment(&self) -> bool {
        matches!(self, Outcome::LaunchFailed { .. } | Outcome::Disconnect { .. } | Outcome::WrongClock { .. })
    }

    /// What is known of the cause, as it is recorded.
    pub fn message(&self) -> Option<&str> {
        match self {
            Outcome::Completed | Outcome::NoEffect | Outcome::Unknown | Outcome::Timeout { .. } => None,
            Outcome::Crash { message }
            | Outcome::LaunchFailed { message }
            | Outcome::Disconnect { message }
            | Outcome::WrongClock { message } => Some(message),
        }
    }

    /// Whether the run came to its planned end.
    pub fn is_whole(&self) -> bool {
        matches!(self, Outcome::Completed | Outcome::NoEffect | Outcome::Unknown)
    }

    /// One word for tables and the database.
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Completed => "completed",
            Outcome::NoEffect => "no_effect",
            Outcome::Unknown => "unknown",
            Outcome::Crash { .. } => "crash",
            Outcome::Timeout { .. } => "timeout",
            Outcome::LaunchFailed { .. } => "launch_failed",
            Outcome::Disconnect { .. } => "disconnect",
            Outcome::WrongClock { .. } => "wrong_clock",
        }
    }

    /// What the word leaves out.
    pub fn detail(&self) -> Option<String> {
        match self {
            Outcome::Timeout { limit } => Some(format!("stopped after {limit} s of wall time")),
            _ => self.message().map(str::to_owned),
        }
    }
}

/// What one run of a test showed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// How it ended.
    pub outcome: Outcome,
    /// Simulation time at which it ended, in seconds.
    pub end: f64,
    /// Per operation of the test, in its order; empty after a crash of the worker.
    pub operations: Vec<OperationEffect>,
    /// In a run that came to its end: names on the wire that operations of the campaign act on and that nobody heard,
    /// in order of declaration. The simulator did not subscribe to them, and no outbound metric reads them.
    pub unheard: Vec<String>,
    /// In a run without operations: those of the campaign that would have found no message, in order of declaration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unreached: Vec<Unreached>,
    /// What was published on each wire that spoke, in order of declaration; empty after a crash of the worker. It
    /// explains what came of the run, and is not part of the digest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traffic: Vec<Traffic>,
    /// Of a run without operations: when messages came and when something happened in them. It says where windows of
    /// operations are worth a test, and is not part of the digest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course: Option<Course>,
    /// The messages that operations of the test altered, if the run was asked for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub altered: Option<AlteredMessages>,
    /// Per metric of the plan, in its order; empty after a crash of the worker.
    pub metrics: Vec<MetricObservation>,
    /// Per monitor of the plan, in its order; empty after a crash of the worker.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub monitors: Vec<MonitorObservation>,
    /// Messages the relay handled.
    pub messages: u64,
    /// What should be brought to the user's attention; in order, and bounded by the relay.
    pub warnings: Vec<String>,
    /// Wall time in seconds spent in the run; never part of the digest.
    pub wall: WallTime,
}

/// Where the wall time of a run went, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallTime {
    /// The whole run as its worker saw it, simulator and relay together.
    pub run: f64,
}

/// What one operation of a test did.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OperationEffect {
    /// Observed active intervals in seconds, clipped to the run, in order, none overlapping.
    pub intervals: Vec<Span>,
    /// Intervals in which it was not active and still held messages back, likewise.
    pub tails: Vec<Span>,
    /// What it counted.
    pub counters: Counters,
    /// Simulation time of its first effect, in seconds.
    pub first_touch: Option<f64>,
    /// Simulation time of its last effect, in seconds.
    pub last_touch: Option<f64>,
}

impl OperationEffect {
    /// When it was active or held messages back, in no particular order: what `fuzzing_time()` adds up.
    pub fn busy(&self) -> impl Iterator<Item = Span> + use<'_> {
        self.intervals.iter().chain(&self.tails).copied()
    }
}

/// What an operation counted. An operation had an effect when any but `seen` and `unheard` is above zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Messages that reached it while it was active.
    pub seen: u64,
    /// Messages it changed.
    pub changed: u64,
    /// Messages it dropped.
    pub dropped: u64,
    /// Messages it held back while it was active; never more than `seen`.
    pub delayed: u64,
    /// Messages that came while it was not active and waited behind those it still held.
    pub queued: u64,
    /// Messages it created.
    pub injected: u64,
    /// Side effects it had in addition to those on messages.
    pub side_effects: u64,
    /// Messages it changed, dropped, held back or created on wires without a receiver. No other counter contains them,
    /// and they do not count as effects.
    pub unheard: u64,
}

impl Counters {
    /// Whether the operation had any effect.
    pub fn any_effect(&self) -> bool {
        self.changed + self.dropped + self.delayed + self.queued + self.injected + self.side_effects > 0
    }
}

/// What a metric showed in one run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MetricObservation {
    /// Its value: the last one at or before the end, or its default; `None` where there is neither.
    pub value: Option<f64>,
    /// Whether the value was set; otherwise it is the default.
    pub set: bool,
    /// The values that it could have had at the end of the run.
    pub reach: Reach,
    /// Simulation time, in seconds, of the first number that was not finite in what it reads.
    pub not_finite: Option<f64>,
    /// Change points `(seconds, value)` in time order; the value holds until the next point. Always finite.
    pub series: Vec<(f64, f64)>,
    /// The [signal](crate::robustness) of the robustness of a formula, thinned: change points as in `series`, but the
    /// last one ends it and repeats the value before. Empty for other metrics. It follows from the run like everything
    /// else, and explains the value; it is neither part of the digest nor compared when a run is repeated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robustness: Vec<(f64, f64)>,
    /// When requirements on the robustness of a formula were lost before the run ended, in order of declaration. Empty
    /// for other metrics, whose series shows it. Like the signal, it explains the value, and is neither part of
    /// the digest nor compared when a run is repeated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost: Vec<Lost>,
}

/// When a run lost a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lost {
    /// The requirement.
    pub requirement: RequirementId,
    /// The first moment from which no continuation of the run could satisfy it, in seconds.
    pub at: f64,
}

impl MetricObservation {
    /// The metric of a run that came to its end, with nothing in it that was not finite.
    pub fn whole(value: Option<f64>, set: bool, series: Vec<(f64, f64)>) -> Self {
        MetricObservation {
            value,
            set,
            reach: Reach::of_whole_run(value),
            not_finite: None,
            series,
            robustness: Vec::new(),
            lost: Vec::new(),
        }
    }
}

/// The values that a metric could have had at the end of a run: for a run that came to its end, its value; for one that
/// broke off, all that the rest of the run might have made of it. It is never too narrow.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Reach {
    /// The least of them, finite; `None` where there is no least.
    pub low: Option<f64>,
    /// The greatest of them, finite; `None` where there is no greatest.
    pub high: Option<f64>,
}

impl Reach {
    /// All values.
    pub const ANY: Reach = Reach { low: None, high: None };

    /// This value only.
    pub fn only(value: f64) -> Self {
        Reach { low: Some(value), high: Some(value) }
    }

    /// The reach of a metric with this value in a run that came to its end. Without a value nothing is known.
    pub fn of_whole_run(value: Option<f64>) -> Self {
        value.map_or(Reach::ANY, Reach::only)
    }

    /// All values from the least to the greatest of both.
    #[must_use]
    pub fn or(self, other: Reach) -> Self {
        let both = |a: Option<f64>, b: Option<f64>, choose: fn(f64, f64) -> f64| a.zip(b).map(|(a, b)| choose(a, b));
        Reach { low: both(self.low, other.low, f64::min), high: both(self.high, other.high, f64::max) }
    }

    /// What is left for a metric that only goes one way and has come to this value; without a value, or where it may go
    /// both ways, everything.
    pub fn onwards(trend: Option<Trend>, value: Option<f64>) -> Self {
        match trend {
            Some(Trend::Rising) => Reach { low: value, high: None },
            Some(Trend::Falling) => Reach { low: None, high: value },
            None => Reach::ANY,
        }
    }
}

/// The value of a metric in one run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct MetricValue {
    /// The last value set, or the default; `None` where there is neither.
    pub value: Option<f64>,
    /// Whether the value was set; otherwise it is the default.
    pub set: bool,
    /// The values that it could have had at the end of the run.
    pub reach: Reach,
    /// Simulation time, in seconds, of the first number that was not finite in what it reads.
    pub not_finite: Option<f64>,
}

impl MetricValue {
    /// The value of a run that came to its end, with nothing in it that was not finite.
    pub fn whole(value: Option<f64>, set: bool) -> Self {
        MetricValue { value, set, reach: Reach::of_whole_run(value), not_finite: None }
    }
}

impl From<&MetricObservation> for MetricValue {
    fn from(shown: &MetricObservation) -> Self {
        let MetricObservation { value, set, reach, not_finite, series: _, robustness: _, lost: _ } = *shown;
        MetricValue { value, set, reach, not_finite }
    }
}

impl Observation {
    /// The observation of a run that left nothing but the cause of its crash.
    pub fn crashed(message: String) -> Self {
        Observation::without_run(Outcome::Crash { message })
    }

    /// The observation of a run of which only the outcome is known.
    pub fn without_run(outcome: Outcome) -> Self {
        Observation {
            outcome,
            end: 0.0,
            operations: Vec::new(),
            unheard: Vec::new(),
            unreached: Vec::new(),
            traffic: Vec::new(),
            course: None,
            altered: None,
            metrics: Vec::new(),
            monitors: Vec::new(),
            messages: 0,
            warnings: Vec::new(),
            wall: WallTime::default(),
        }
    }

    /// The same run without the series of its metrics, its traffic and what its monitors did, which are most of it.
    #[must_use]
    pub fn without_series(&self) -> Self {
        let metric = |&MetricObservation { value, set, reach, not_finite, .. }: &MetricObservation| MetricObservation {
            value,
            set,
            reach,
            not_finite,
            series: Vec::new(),
            robustness: Vec::new(),
            lost: Vec::new(),
        };
        Observation {
            outcome: self.outcome.clone(),
            end: self.end,
            operations: self.operations.clone(),
            unheard: self.unheard.clone(),
            unreached: self.unreached.clone(),
            traffic: Vec::new(),
            course: None,
            altered: self.altered.clone(),
            metrics: self.metrics.iter().map(metric).collect(),
            monitors: Vec::new(),
            messages: self.messages,
            warnings: self.warnings.clone(),
            wall: self.wall,
        }
    }

    /// The value of the plan's metric at this position; unmeasured when the run reported none.
    pub fn value(&self, metric: sesame_plan::MetricId) -> MetricValue {
        self.metrics.get(metric.index()).map(MetricValue::from).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cause_of_a_crash_is_shortened_between_two_characters() {
        let short = "ä".repeat(CAUSE_BYTES / 2);
        assert_eq!(Outcome::crash(short.clone()), Outcome::Crash { message: short });
        let long = format!("x{}", "ä".repeat(5 << 20));
        let kept = format!("x{}", "ä".repeat(CAUSE_BYTES / 2 - 1));
        let left = long.len() - kept.len();
        assert_eq!(Outcome::crash(long), Outcome::Crash { message: format!("{kept}… ({left} bytes more)") });
    }
}
