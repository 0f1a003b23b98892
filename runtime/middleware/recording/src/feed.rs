//! Replays a recording: feeds metrics from it instead of a simulator.

use std::path::Path;

use sesame_base::observation::{MetricObservation, MonitorObservation};
use sesame_plan::CampaignPlan;
use sesame_relay::feed::{Feeder, Found, Tell, asks_for_busy};
use sesame_relay::metric::MetricTable;
use sesame_relay::wire::WireTable;

use crate::error::RecordingError;
use crate::pass::{self, Ending, Read, RecordedRun};
use crate::payload::Reads;

/// The result of feeding a recording to a campaign's metrics.
#[derive(Debug)]
pub struct Fed {
    /// The recorded run, if a runner recorded it.
    pub run: Option<RecordedRun>,
    /// Per metric of the plan. Without a run, the actions of operations are unknown, and so is `fuzzing_time()`.
    pub metrics: Vec<MetricObservation>,
    /// Per monitor of the plan.
    pub monitors: Vec<MonitorObservation>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Messages fed, as published.
    pub messages: u64,
}

/// Feeds the messages of a recording to the metrics of a plan, in order of time and without a simulator.
///
/// The trace of a runner is fed in the same order as in its run. In any other recording, the messages on topics of the
/// space count, with times since the first of them, both as published and as delivered. Memory is bounded.
pub fn feed(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    table: &MetricTable<'_>,
) -> Result<Fed, RecordingError> {
    feed_telling(path, plan, wires, table, None)
}

/// As [`feed`], and tells what monitors decide, in order of time.
pub fn feed_telling(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    table: &MetricTable<'_>,
    decided: Option<Tell<'_>>,
) -> Result<Fed, RecordingError> {
    // The fuzzing time at each moment follows from what is said at the end of a trace.
    let busy = if asks_for_busy(plan) { pass::busy(path)? } else { None };
    let mut feeder = Feeder::new(plan, wires, table, busy.as_deref().unwrap_or_default(), decided);
    let ending = pass::pass(path, plan, wires, Reads::Used, &mut |read| {
        match read {
            Read::Scene(scene) => feeder.set_scene(&scene),
            Read::ClockAtZero(seconds) => feeder.clock_at_zero(seconds),
            Read::Message(message) => feeder.message(&message),
        }
        Ok(())
    })?;
    let Ending { run, end, busy, warnings: about_topics, damage: _, messages } = ending;
    let Found { metrics, monitors, mut warnings } = feeder.finish(end, busy.as_deref());
    warnings.extend(about_topics);
    Ok(Fed { run, metrics, monitors, warnings, messages })
}
