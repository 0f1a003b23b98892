//! What a campaign found, for people: tables for a terminal, the same as data, and one page with pictures.
//!
//! All of it is read from the results repository, so that it can be made again at any time, and each form says the
//! same: [`summary`], [`list`] and [`show`] gather the facts (they serialise to JSON as they are), [`summary_text`] and its like
//! lay them out, [`page()`] draws them.

mod axis;
mod cells;
mod chart;
mod confirmed;
mod coverage;
mod export;
mod generations;
mod junit;
mod markup;
pub(crate) mod number;
mod page;
mod policy;
mod published;
mod recording;
mod regions;
mod repetition;
mod replay;
mod scatter;
mod show;
mod shrinking;
mod stacked;
mod summary;
mod table;
mod text;
mod timeline;

pub use confirmed::{ConfirmedTest, FindingAgain};
pub(crate) use confirmed::{confirmed_tests, failed, failed_tally};
pub use coverage::CoverageSummary;
pub use export::{ExportError, Exported, export, is_name};
pub use junit::{junit, write_junit};
pub(crate) use markup::{Markup, percent};
pub use page::{page, write_page, write_page_with};
pub use recording::{FedMetric, RecordingReplay, Sameness, recording_text};
pub(crate) use repetition::wilson;
pub use repetition::{Repetition, ViolationRate};
pub use replay::{Replay, replay_text};
pub use show::{
    ChoiceReport, FreshVerdicts, ListedTest, MetricReport, OperationReport, TestList, TestReport, VerdictReport, list,
    show,
};
pub use shrinking::{ShrinkStep, Shrinking, TestSize};
pub use stacked::{Stacked, StackedSum};
pub use summary::{
    Counts, ExpectationSummary, Failure, FrontTest, NotFinite, Objective, RequirementSummary, Spread, Summary, Worst,
    summary,
};
pub use table::TextOptions;
pub(crate) use table::text_table;
pub use text::{confirmed_text, headline, list_text, summary_text, test_text};

#[cfg(test)]
mod tests;
