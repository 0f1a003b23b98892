//! What metrics make of a recording.

use serde::Serialize;

use crate::record::MetricValue;
use crate::report::number::plural;
use crate::report::summary::value_text;
use crate::report::table::{Align, Table, TextOptions};

/// What came of feeding a recording to a campaign's metrics.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingReplay {
    /// The recording.
    pub recording: std::path::PathBuf,
    /// The run it is of, as in `T17 of coverage_experiment (completed)`; `None` where no runner recorded it.
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
    /// What it is now.
    pub now: MetricValue,
    /// What it was; `None` where the recording does not say, or for no value.
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

/// The same in words.
pub fn recording_text(replay: &RecordingReplay, options: TextOptions) -> String {
    let name = replay.run.clone().unwrap_or_else(|| "a recording that no runner made".to_owned());
    let messages = usize::try_from(replay.messages).unwrap_or(usize::MAX);
    let mut text = format!("{name}: {} fed\n", plural(messages, "message", "messages"));
    let mut table = Table::new(["metric", "value", "recorded", ""].map(|title| (title.to_owned(), Align::Left)));
    for FedMetric { metric, unit, now, recorded, sameness } in &replay.metrics {
        let value = |value: MetricValue| value_text(value, unit.as_deref());
        let (recorded, word) = match sameness {
            Sameness::Equal => (value(MetricValue::whole(*recorded, true)), "equal"),
            Sameness::Differs => (value(MetricValue::whole(*recorded, true)), "differs"),
            Sameness::NotRecorded => (String::new(), "not recorded"),
        };
        table.row([metric.clone(), value(*now), recorded, word.to_owned()]);
    }
    text.push_str(&table.render(options));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_metric_stands_beside_what_was_recorded() {
        let metric = |name: &str, now: Option<f64>, recorded, sameness| FedMetric {
            metric: name.to_owned(),
            unit: (name == "cycle_time").then(|| "s".to_owned()),
            now: MetricValue::whole(now, now.is_some()),
            recorded,
            sameness,
        };
        let replay = RecordingReplay {
            recording: "T5.mcap".into(),
            run: Some("T5 of coverage_experiment (completed)".to_owned()),
            messages: 1_200,
            same: false,
            metrics: vec![
                metric("collisions", Some(18.0), Some(17.0), Sameness::Differs),
                metric("cycle_time", Some(68.2), Some(68.2), Sameness::Equal),
                metric("clearance", None, None, Sameness::NotRecorded),
            ],
            warnings: vec![],
        };
        insta::assert_snapshot!(recording_text(&replay, TextOptions { width: None, colour: false }));
    }
}
