//! What a campaign found, for people and build servers: text for a terminal, one page with pictures, JUnit XML.
//!
//! Everything is read from the results repository, so reports can be made again at any time. [`summary`], [`list`] and
//! [`show`] compute the facts, which serialise to JSON as they are. [`summary_text`] and its like render them as text,
//! and [`page()`] as HTML; both share their tables and sentences.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod export;
mod facts;
#[expect(clippy::disallowed_methods, reason = "an adapter: it writes files")]
mod file;
mod html;
mod junit;
mod monitors;
pub mod preparation;
mod sentences;
pub mod study;
mod tables;
mod text;
mod twin;

pub use self::twin::twin_text;
pub use export::{Expected, ExportError, Exported, export, export_causes};
pub use facts::causes::{CauseSummary, CausesSummary, causes};
pub use facts::certificate::before_after::{Mend, MendedTest, mend};
pub use facts::certificate::campaign::{HazardSummary, MissedHazard, MonitorSummary, MonitorsSummary, StateShare};
pub use facts::certificate::moment::{MomentError, MomentReport, MonitorMoment, PartReport, show_at};
pub use facts::certificate::test::{
    ChangeReport, DecisionReport, EvidenceReport, HazardReport, MonitorReport, StateReport,
};
pub use facts::certificate::why::{BecauseReport, WhyReport};
pub use facts::coverage::CoverageSummary;
pub use facts::monitors::{
    BrokenDecision, ComparedMonitor, ComparedRecording, DecisionDifference, DelayTolerance, EvidenceCause,
    EvidenceDeviation, EvidenceValue, MonitorDisagreement, MonitorsCompared, ShiftedDecision, TimedState, Tolerated,
};
pub use facts::readable::sentence as readable_sentence;
pub use facts::recording::{FedMetric, RecordingReplay, Sameness};
pub use facts::repetition::{Repetition, ViolationRate};
pub use facts::replay::Replay;
pub use facts::show::{
    ChoiceReport, FreshVerdicts, ListedTest, MetricReport, OperationReport, TestList, TestReport, VerdictReport, list,
    operations_of, show,
};
pub use facts::shrinking::{
    LeftMessage, ShrinkStep, ShrinkThreshold, ShrinkTrigger, Shrinking, ShrunkMessages, TestSize,
};
pub use facts::stacked::{Stacked, StackedSum};
pub use facts::summary::{
    CLOSING_RUN_DIFFERS, Counts, ExpectationSummary, Failure, FrontTest, NotFinite, Objective, Quarantined,
    RequirementSummary, Spread, Summary, WithoutEffect, Worst, summary,
};
pub use facts::twin::{MitigationVerdict, SentMitigation, Twin, TwinRequirement, twin};
pub use file::write_aside;
pub use html::{figures, page, write_page, write_page_against, write_page_with};
pub use junit::{junit, write_junit};
pub use monitors::monitors_text;
pub use sentences::headline;
pub use sesame_analysis::confirmed::{ConfirmedTest, FindingAgain};
pub use sesame_present::number::quantity;
pub use sesame_present::table::TextOptions;
pub use text::{
    causes_text, confirmed_text, list_text, moment_text, recording_text, replay_text, summary_text, test_text,
};

#[cfg(test)]
mod tests;
