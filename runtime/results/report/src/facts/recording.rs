//! What metrics make of a recording.

use serde::Serialize;

use sesame_record::MetricValue;

/// What came of feeding a recording to a campaign's metrics.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingReplay {
    /// The recording.
    pub recording: std::path::PathBuf,
    /// The run that it records, as in `T17 of coverage_experiment (completed)`; `None` if no runner recorded it.
    pub run: Option<String>,
    /// Messages fed.
    pub messages: u64,
    /// Whether no metric differs from what was recorded.
    pub same: bool,
    /// Per metric of the campaign.
    pub metrics: Vec<FedMetric>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A metric, now and when it was recorded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FedMetric {
    /// Its name.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Its value now.
    pub now: MetricValue,
    /// Its recorded value; `None` if the recording does not contain it, or for no value.
    pub recorded: Option<f64>,
    /// How the two compare, bit for bit.
    pub sameness: Sameness,
}

/// How a metric compares with what was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sameness {
    /// The same, bit for bit.
    Equal,
    /// Another value, or one where there was none.
    Differs,
    /// The recording has nothing to compare with.
    NotRecorded,
}
