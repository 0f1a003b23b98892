//! Why a campaign could not go on.

use sesame_record::RecordError;
use sesame_search::SearchError;
use sesame_search::coverage::GridError;

use crate::campaign::executor::ExecutorError;
use crate::campaign::reference::Ineffective;

/// Why a campaign could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// The plan leaves nothing to search.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// The axes of the plan's coverage do not make a grid.
    #[error("the campaign's coverage cannot be counted: {0}")]
    Grid(#[from] GridError),
    /// Tests cannot be run.
    #[error(transparent)]
    Executor(#[from] ExecutorError),
    /// Results could not be kept.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The reference run crashed or timed out, so nothing that follows would mean anything.
    #[error(
        "the reference run failed: {0}\nnothing was fuzzed: a campaign needs a system that works without disturbance"
    )]
    Reference(String),
    /// A reference run was killed, and killed again when it was repeated. It is not recorded, so that `resume` runs it
    /// again.
    #[error(
        "the reference run failed: {reason}\nT{test} is not recorded, and what was recorded before is kept: resuming the run runs it \
         again. If you did not kill it, give it more memory, or the campaign fewer `--workers`"
    )]
    Killed {
        /// The test.
        test: u32,
        /// What is known of it.
        reason: String,
    },
    /// Operations disturb what no part of the system receives, or act when there is nothing to disturb, so tests with
    /// them would show nothing.
    #[error(
        "{}\nnothing was fuzzed: such tests would pass without having disturbed anything. {}. With `--allow-unheard`, \
         such tests run all the same",
        .0.iter().map(Ineffective::to_string).collect::<Vec<_>>().join("\n"),
        Ineffective::remedies(.0)
    )]
    Ineffective(Vec<Ineffective>),
    /// A trace could not be written. The test is not recorded, so that `resume` runs it again with its trace.
    #[error(
        "{reason}\nT{test} is not recorded without its trace, and what was recorded before is kept: when this is mended, \
         the run can be resumed"
    )]
    Trace {
        /// The test.
        test: u32,
        /// Why not.
        reason: String,
    },
    /// A resumed campaign asks for other tests than those recorded.
    #[error(
        "test T{0} of these results is not the one that this runner asks for: the results come from another model or \
         version; start a new run with `run`"
    )]
    OtherCampaign(u32),
}

impl CampaignError {
    /// Whether the run can be resumed once the cause is gone.
    pub fn leaves_the_run_resumable(&self) -> bool {
        match self {
            CampaignError::Executor(_)
            | CampaignError::Record(_)
            | CampaignError::Killed { .. }
            | CampaignError::Trace { .. } => true,
            CampaignError::Search(_)
            | CampaignError::Grid(_)
            | CampaignError::Reference(_)
            | CampaignError::Ineffective(_)
            | CampaignError::OtherCampaign(_) => false,
        }
    }
}

/// Why a campaign halts before its end.
#[derive(Debug)]
pub(super) enum Halt {
    /// The user stopped it. What had ended by then is recorded.
    Stopped,
    /// It cannot go on.
    Failed(CampaignError),
}

impl<E: Into<CampaignError>> From<E> for Halt {
    fn from(error: E) -> Self {
        Halt::Failed(error.into())
    }
}
