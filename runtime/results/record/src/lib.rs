//! The results repository: what a campaign run leaves behind, in one SQLite file.
//!
//! It guarantees: a test is there completely or not at all, even if the process is killed; one process writes at a
//! time; what is read equals what was written, bit for bit; equal campaigns have equal digests, with any number of
//! workers and interruptions. The file is meant to be read by others too: its schema is documented in
//! the file itself, and its views answer the common questions.
//!
//! A [`Recorder`] writes while a campaign runs; a [`Repository`] reads, during a run or after it.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod added_latency;
mod altered_messages;
mod columns;
mod course;
mod cursor;
mod difference;
mod digest;
mod each_test;
mod entered;
mod error;
mod files;
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it claims folders and locks files"
)]
mod folder;
mod imported;
mod lab_runs;
mod left_out_operations;
mod listed_messages;
mod lost_requirements;
mod machines;
mod monitors;
mod original_extents;
mod plan;
mod quarantine;
mod read_courses;
mod read_messages;
mod read_monitors;
mod read_tests;
mod recognise;
#[expect(clippy::disallowed_methods, reason = "an adapter: it makes the files of a run")]
mod recorder;
mod relay_latencies;
mod repetitions;
#[expect(clippy::disallowed_methods, reason = "an adapter: it opens the files of a run")]
mod repository;
#[cfg(any(test, feature = "testing"))]
pub mod sample;
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it reads the head of a file")]
mod schema;
mod series;
mod series_views;
mod split_operations;
mod standing;
#[cfg(test)]
mod tests;
mod traffic;
mod where_tests_ran;
mod write_tests;

use serde::Serialize;

use sesame_base::observation::{MonitorHazard, Observation};
use sesame_plan::{KnownTestId, MonitorId, Requirement, RequirementId, Test};

pub use difference::{Difference, differences};
pub use each_test::{NoPoint, ScannedOperation, ScannedTest};
pub use entered::{ENTERED_OUTCOMES, Entered, EnteredRun, Provenance, entered_outcome};
pub use error::RecordError;
pub use files::{DATABASE, LOCK, TRACES, recording, trace_file};
pub use folder::{Claim, claim_folder, latest_folder, latest_unfinished};
pub use left_out_operations::{LeftOutOperations, NOT_IMPORTED, not_imported};
pub use original_extents::OriginalExtent;
pub use quarantine::{QUARANTINE, is_quarantined, may_be_quarantined};
pub use read_tests::Uses;
pub use recorder::Recorder;
pub use repetitions::{Judge, confirmed_fitness, confirming_runs, missed};
pub use repository::{CampaignFacts, Repository, digest};
pub use schema::SCHEMA;
pub use sesame_base::observation::{MetricValue, Outcome};
pub use sesame_base::verdict::{Verdict, fails, verdict, violation_spans};
pub use split_operations::SplitOperation;
pub use standing::{Standing, Tally};

/// One test with everything that is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRecord {
    /// Its number in the campaign; its name is `T` and the number.
    pub number: u32,
    /// Where it comes from.
    pub origin: Origin,
    /// The generation of the search it belongs to.
    pub generation: Option<u32>,
    /// Numbers of the tests it was made of.
    pub parents: Vec<u32>,
    /// What it disturbs.
    pub test: Test,
    /// The simulator's seed in its run.
    pub simulator_seed: u64,
    /// The equal test whose result stands for this one, which was not simulated again. The observation must be that
    /// test's own: its series are kept once, and read from there.
    pub duplicate_of: Option<u32>,
    /// What its run showed.
    pub observation: Observation,
}

/// A run of a recorded test again, with a fresh seed of the simulator and all else the same: to confirm what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Repetition {
    /// The test's number.
    pub test: u32,
    /// Which of its repetitions, from 1.
    pub position: u32,
    /// The simulator's seed.
    pub simulator_seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulation time at which it ended, in seconds.
    pub end: f64,
    /// Messages the relay handled.
    pub messages: u64,
    /// Per metric of the plan, in its order; empty after a crash of the worker.
    pub values: Vec<MetricValue>,
    /// Per monitor of the plan, in its order: the hazards that it was to foresee; empty after a crash of the worker.
    pub hazards: Vec<Vec<MonitorHazard>>,
}

impl Repetition {
    /// A repetition from what its run showed. Time series are not kept.
    pub fn of(test: u32, position: u32, simulator_seed: u64, observation: &Observation) -> Repetition {
        let values = observation.metrics.iter().map(MetricValue::from);
        Repetition {
            test,
            position,
            simulator_seed,
            outcome: observation.outcome.clone(),
            end: observation.end,
            messages: observation.messages,
            values: values.collect(),
            hazards: observation.monitors.iter().map(|monitor| monitor.hazards.clone()).collect(),
        }
    }

    /// The value of the plan's metric at this position; unmeasured when the run reported none.
    pub fn value(&self, metric: sesame_plan::MetricId) -> MetricValue {
        self.values.get(metric.index()).copied().unwrap_or_default()
    }

    /// What this run says about a requirement.
    pub fn verdict(&self, requirement: &Requirement) -> Verdict {
        verdict(requirement.bound, &self.outcome, self.value(requirement.metric))
    }

    /// The hazard of a requirement that a monitor was to foresee, if there was one.
    pub fn hazard(&self, monitor: MonitorId, requirement: RequirementId) -> Option<MonitorHazard> {
        let of_monitor = self.hazards.get(monitor.index())?;
        of_monitor.iter().copied().find(|hazard| hazard.requirement == requirement)
    }
}

/// Where a test comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// A run without disturbance, for comparison.
    Reference,
    /// A regression test of the space.
    Known(KnownTestId),
    /// The campaign's search.
    Search,
}

impl Origin {
    /// One word for tables and the database.
    pub fn word(self) -> &'static str {
        match self {
            Origin::Reference => "reference",
            Origin::Known(_) => "known",
            Origin::Search => "search",
        }
    }
}

/// One test without its time series and effects: what tables over all tests need.
#[derive(Debug, Clone, PartialEq)]
pub struct TestRow {
    /// Its number in the campaign.
    pub number: u32,
    /// Where it comes from.
    pub origin: Origin,
    /// The generation of the search it belongs to.
    pub generation: Option<u32>,
    /// What it disturbs.
    pub test: Test,
    /// Per operation of the test: whether it is known to have had no effect.
    pub idle: Vec<bool>,
    /// How its run ended.
    pub outcome: Outcome,
    /// Simulation time at which it ended, in seconds.
    pub end: f64,
    /// The equal test whose result stands for this one.
    pub duplicate_of: Option<u32>,
    /// Per metric of the plan, in its order; empty after a crash of the worker.
    pub values: Vec<MetricValue>,
    /// How many of its operations could not be imported, so that it did more than its operations say.
    pub left_out: u32,
}

impl TestRow {
    /// The value of the plan's metric at this position; unmeasured when the run reported none.
    pub fn value(&self, metric: sesame_plan::MetricId) -> MetricValue {
        self.values.get(metric.index()).copied().unwrap_or_default()
    }

    /// What this run says about a requirement.
    pub fn verdict(&self, requirement: &Requirement) -> Verdict {
        verdict(requirement.bound, &self.outcome, self.value(requirement.metric))
    }
}

/// Whether a set of results is on the way or the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// On the way, after some generation.
    Intermediate,
    /// The campaign's result.
    Final,
}

impl Status {
    /// One word for tables and the database.
    pub fn word(self) -> &'static str {
        match self {
            Status::Intermediate => "intermediate",
            Status::Final => "final",
        }
    }
}

/// A named set of tests: the front after a generation, or at the end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResultSet {
    /// Its name, unique in the campaign.
    pub name: String,
    /// The generation after which it was taken.
    pub generation: Option<u32>,
    /// Whether it is the result.
    pub status: Status,
    /// Numbers of its tests, in its order.
    pub members: Vec<u32>,
}

/// How much of the space was looked at after a generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct GenerationCoverage {
    /// The generation.
    pub generation: u32,
    /// Tests evaluated by then.
    pub evaluations: u32,
    /// Cells that enough tests have hit.
    pub covered: usize,
    /// All cells.
    pub cells: usize,
    /// Cells that a test can reach, as far as known, or has hit.
    pub feasible: usize,
}

/// Whether an event belongs to what the campaign found or to one way of getting there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// Part of the content: an equal campaign has the same warnings.
    Warning,
    /// Part of one session (interrupted, resumed, a worker restarted), and not of the digest.
    Session,
}

impl EventKind {
    fn word(self) -> &'static str {
        match self {
            EventKind::Warning => "warning",
            EventKind::Session => "session",
        }
    }
}

/// Something that happened in the campaign that a user should know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// What it belongs to.
    pub kind: EventKind,
    /// The test it is about, if about one.
    pub test: Option<u32>,
    /// What happened.
    pub text: String,
}

/// A stretch of wall time in which a process worked on the campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// When it began, in seconds since 1970 UTC.
    pub started_at: f64,
    /// When it ended; `None` while it runs, or when it was killed.
    pub ended_at: Option<f64>,
    /// The machine's name, where it is known.
    pub host: Option<String>,
    /// The process.
    pub pid: u32,
    /// How many workers it ran.
    pub workers: u32,
}
