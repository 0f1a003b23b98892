//! What monitors decide on two recordings.

use serde::Serialize;

/// What the monitors of a plan decide on two recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorsCompared {
    /// The first recording, for example of a simulation.
    pub first: ComparedRecording,
    /// The second recording, for example of a lab, which is compared with the first.
    pub second: ComparedRecording,
    /// How far the times of a decision may differ, in seconds; `None` if only the decisions count.
    pub within: Option<f64>,
    /// Whether all monitors decide the same in the same order, at times that differ by no more.
    pub same: bool,
    /// Per monitor, in the order of their demands.
    pub monitors: Vec<ComparedMonitor>,
    /// Per topic of evidence, by its name on the wire.
    pub topics: Vec<DelayTolerance>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A recording on which monitors decide.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedRecording {
    /// The file.
    pub recording: std::path::PathBuf,
    /// The run that it records, as in `T17 of coverage_experiment (completed)`; `None` if no runner recorded it.
    pub run: Option<String>,
    /// Messages that evidence hears.
    pub messages: usize,
    /// When it ends, in seconds.
    pub end: f64,
}

/// A monitor on both recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedMonitor {
    /// The monitor.
    pub monitor: String,
    /// How often it decides on the first recording; at least once, at time zero.
    pub first: usize,
    /// How often it decides on the second.
    pub second: usize,
    /// The first decision that differs; `None` if all decisions are the same, whatever their times.
    pub difference: Option<DecisionDifference>,
    /// The decision before that whose times are furthest apart; `None` if all are at the same time.
    pub furthest: Option<ShiftedDecision>,
    /// The periods in which it is in different states, in order; the first 1,000.
    pub disagreements: Vec<MonitorDisagreement>,
    /// How many more there are.
    pub omitted: usize,
}

/// The first decision that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecisionDifference {
    /// Its position, counted from 0, the decision at time zero.
    pub decision: usize,
    /// The decision on the first recording; `None` if there are no more.
    pub first: Option<TimedState>,
    /// The decision on the second.
    pub second: Option<TimedState>,
    /// The evidence that made the difference; none if only the order within one instant did.
    pub because: Vec<EvidenceDeviation>,
}

/// A monitor changes its state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimedState {
    /// The new state.
    pub state: String,
    /// When, in seconds.
    pub at: f64,
}

/// A decision that is taken on both recordings, at different times.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShiftedDecision {
    /// Its position, counted from 0.
    pub decision: usize,
    /// The new state.
    pub state: String,
    /// When it is taken on the first recording, in seconds.
    pub at: f64,
    /// By how much it is later on the second, in seconds; negative if it is earlier.
    pub late: f64,
}

/// A time in which a monitor is in different states.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorDisagreement {
    /// Its beginning, in seconds.
    pub from: f64,
    /// Its end, in seconds.
    pub to: f64,
    /// The state on the first recording.
    pub first: String,
    /// The state on the second.
    pub second: String,
    /// The evidence that makes the difference: with it as on the first recording, the states would be the same.
    pub because: Vec<EvidenceDeviation>,
}

/// Evidence that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvidenceDeviation {
    /// Its monitor.
    pub monitor: String,
    /// The evidence.
    pub evidence: String,
    /// Its value on the first recording.
    pub first: EvidenceValue,
    /// Its value on the second.
    pub second: EvidenceValue,
    /// The change by which the later recording reaches the value of the other, if it does.
    pub follows: Option<EvidenceCause>,
    /// By how much the second is later, in seconds; negative if it is earlier; `None` if nothing follows.
    pub late: Option<f64>,
}

/// The value of evidence at a moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvidenceValue {
    /// `true`, `false` or `unknown`.
    pub value: String,
    /// What gave it this value; `None` if it has it since the beginning.
    pub since: Option<EvidenceCause>,
}

/// A change of evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvidenceCause {
    /// When, in seconds.
    pub at: f64,
    /// The message or the timer that caused it, in words: `message 42 on brakes/pressure`.
    pub by: String,
}

/// By how much the messages of a topic may be late.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DelayTolerance {
    /// Its name on the wire.
    pub topic: String,
    /// What reads it, as `MONITOR.EVIDENCE`.
    pub evidence: Vec<String>,
    /// On the first recording.
    pub first: Tolerated,
    /// On the second.
    pub second: Tolerated,
}

/// A delay that changes no decision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tolerated {
    /// Every delay up to this one, in seconds, keeps all decisions; `None` if every delay does.
    pub delay: Option<f64>,
    /// The decision that a delay of a nanosecond more changes; `None` if it changes none.
    pub breaks: Option<BrokenDecision>,
    /// Whether the search was given up: then longer delays may keep all decisions, too.
    pub given_up: bool,
}

/// A decision that a delay changes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BrokenDecision {
    /// The monitor.
    pub monitor: String,
    /// Its position, counted from 0.
    pub decision: usize,
    /// The decision as recorded; `None` if there is none at this position.
    pub recorded: Option<TimedState>,
    /// The decision with the delay.
    pub delayed: Option<TimedState>,
}

impl MonitorsCompared {
    /// The topic whose messages may be late the least, on the first recording or on the second, with the delay; `None`
    /// if every delay of every single topic keeps all decisions.
    pub fn least(&self, of: impl Fn(&DelayTolerance) -> &Tolerated) -> Option<(&str, f64)> {
        let limited = self.topics.iter().filter_map(|topic| Some((topic.topic.as_str(), of(topic).delay?)));
        limited.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// What is not as required, a sentence for each monitor.
    pub fn objections(&self) -> Vec<String> {
        let sentence = |monitor: &ComparedMonitor| {
            let name = &monitor.monitor;
            if let Some(difference) = &monitor.difference {
                return Some(format!("monitor `{name}` decides differently: {}", difference.sentence()));
            }
            let (furthest, within) = (monitor.furthest.as_ref()?, self.within?);
            (furthest.late.abs() > within).then(|| {
                let ShiftedDecision { decision, state, late, .. } = furthest;
                let apart = seconds(late.abs());
                format!(
                    "decision {decision} of monitor `{name}`, `{state}`, is {apart} apart, which is more than {}",
                    seconds(within)
                )
            })
        };
        self.monitors.iter().filter_map(sentence).collect()
    }
}

impl DecisionDifference {
    /// What differs and why, in words.
    pub fn sentence(&self) -> String {
        let said = |state: &Option<TimedState>| match state {
            Some(TimedState { state, at }) => format!("`{state}` at {}", seconds(*at)),
            None => "none".to_owned(),
        };
        let (first, second) = (said(&self.first), said(&self.second));
        let because: Vec<String> = self.because.iter().map(EvidenceDeviation::sentence).collect();
        let because = if because.is_empty() {
            "because what happens at that instant comes in another order".to_owned()
        } else {
            format!("because {}", because.join("; and "))
        };
        format!("decision {} is {first} on the first recording and {second} on the second, {because}", self.decision)
    }
}

impl EvidenceDeviation {
    /// How the evidence differs, in words.
    pub fn sentence(&self) -> String {
        let EvidenceDeviation { monitor, evidence, first, second, follows, late } = self;
        let is = |value: &EvidenceValue| match &value.since {
            Some(EvidenceCause { at, by }) => format!("{} since {} ({by})", value.value, seconds(*at)),
            None => format!("{} since the beginning", value.value),
        };
        let then = match (late, follows) {
            (Some(late), Some(EvidenceCause { at, by })) if *late >= 0.0 => {
                format!("where it follows {} later, at {} ({by})", seconds(*late), seconds(*at))
            }
            (Some(late), Some(EvidenceCause { at, by })) => {
                format!("which is {} earlier: the first follows at {} ({by})", seconds(-*late), seconds(*at))
            }
            _ => "and the other does not follow".to_owned(),
        };
        let (first, second) = (is(first), is(second));
        format!("`{monitor}.{evidence}` is {first} on the first and {second} on the second, {then}")
    }
}

/// A time with all its digits: it is exact to the nanosecond.
pub(crate) fn seconds(seconds: f64) -> String {
    // Times of a run are whole nanoseconds, and a difference of them is not much more than that.
    format!("{} s", sesame_present::number::exact(libm::rint(seconds * 1e9) / 1e9))
}
