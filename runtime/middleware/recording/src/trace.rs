//! Traces: the messages of one run and the actions of operations on them, in a file of the MCAP format.
//!
//! A trace contains every message as it was published, on a channel with the name of its topic; if an operation of the
//! campaign may act on a topic, also every message as it was delivered, on a channel `TOPIC/delivered`. The actions of
//! operations are on `sesame/operations`, the change points of each metric on `sesame/metrics/NAME`. Everything is JSON
//! with a JSON Schema; in traces of systems of ROS, everything is as ROS records it, with messages byte for byte as
//! they came where nobody changed them. Numbers are exact, and times are simulation time in nanoseconds. A metadata
//! record `sesame` identifies the run, a metadata record `sesame.run` says how it ended.
//!
//! A trace is written while the test runs, under a temporary name, and gets its own name when it is complete. If the
//! process dies during a run, the part that was written until then is recovered.

mod encoding;
mod recover;
mod schema;
mod writer;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::Metadata;

use sesame_base::observation::{Observation, Outcome};
use sesame_base::visible::{visible_json, visible_lines};
use sesame_plan::{CampaignPlan, Test};

use crate::pass::RecordedMetric;

pub use recover::recover;
pub use writer::TraceWriter;

/// Name of the metadata record that identifies the run of a trace.
pub(crate) const SUBJECT: &str = "sesame";

/// Name of the metadata record that says what the clock of the simulator's stamps showed at time zero; it is missing if
/// stamps are in simulation time.
pub(crate) const CLOCK: &str = "sesame.clock";
/// Its key for that, in seconds.
pub(crate) const ZERO: &str = "zero_s";

/// Name of the metadata record that says how the run ended.
pub(crate) const RUN: &str = "sesame.run";

/// Key of a channel's metadata for its contents: one of the `ROLE_…`.
pub(crate) const ROLE: &str = "sesame_role";
/// The topic of the plan; recordings of earlier versions do not say it.
pub(crate) const TOPIC: &str = "sesame_topic";

pub(crate) const ROLE_PUBLISHED: &str = "published";
pub(crate) const ROLE_DELIVERED: &str = "delivered";
const ROLE_OPERATIONS: &str = "operations";
const ROLE_METRIC: &str = "metric";

/// The run of a trace.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Its campaign.
    pub plan: &'a CampaignPlan,
    /// The test's number.
    pub number: u32,
    /// The test.
    pub test: &'a Test,
    /// Seed of the simulator's own randomness.
    pub simulator_seed: u64,
}

impl Subject<'_> {
    fn metadata(&self) -> Metadata {
        let Subject { plan, number, test, simulator_seed } = *self;
        let json = |value: serde_json::Result<String>| {
            visible_json(&value.expect("plans and tests are plain data with text keys")).into_owned()
        };
        let entries = [
            ("runtime", env!("CARGO_PKG_VERSION").to_owned()),
            ("space", plan.space.clone()),
            ("campaign", plan.campaign.name.clone()),
            ("test", format!("T{number}")),
            ("simulator_seed", simulator_seed.to_string()),
            ("definition", json(serde_json::to_string(test))),
            ("plan", json(serde_json::to_string(plan))),
        ];
        Metadata { name: SUBJECT.to_owned(), metadata: owned(entries) }
    }
}

/// How a run ended. The series of its metrics are on their channels.
fn ending(plan: &CampaignPlan, observation: &Observation) -> Metadata {
    let metrics: Vec<RecordedMetric> = plan
        .metrics
        .iter()
        .zip(&observation.metrics)
        .map(|(metric, observed)| RecordedMetric { name: metric.name.clone(), value: observed.value })
        .collect();
    let json = |value: serde_json::Result<String>| {
        visible_json(&value.expect("observations are plain data with text keys")).into_owned()
    };
    let mut metadata = how_it_ended(&observation.outcome);
    metadata.extend(owned([
        ("end_s", observation.end.to_string()),
        ("messages", observation.messages.to_string()),
        ("operations", json(serde_json::to_string(&observation.operations))),
        ("metrics", json(serde_json::to_string(&metrics))),
    ]));
    Metadata { name: RUN.to_owned(), metadata }
}

fn how_it_ended(outcome: &Outcome) -> BTreeMap<String, String> {
    let mut entries = owned([("outcome", outcome.word().to_owned())]);
    entries.extend(outcome.detail().map(|detail| ("outcome_detail".to_owned(), visible_lines(&detail).into_owned())));
    entries
}

fn owned<'a>(entries: impl IntoIterator<Item = (&'a str, String)>) -> BTreeMap<String, String> {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// A trace that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the trace: {reason}: {}", path.display())]
pub struct TraceError {
    /// The reason.
    pub reason: String,
    /// The file.
    pub path: PathBuf,
}

impl TraceError {
    fn new(path: &Path, error: McapError) -> Self {
        let reason = match error {
            McapError::Io(error) => error.to_string(),
            other => other.to_string(),
        };
        TraceError { reason, path: path.to_owned() }
    }
}

/// Gives a complete trace its name and replaces an older file of that name.
fn publish(unfinished: &Path, file: &Path) -> Result<(), TraceError> {
    fs::rename(unfinished, file).map_err(|error| TraceError::new(file, error.into()))
}

#[cfg(test)]
mod tests;
