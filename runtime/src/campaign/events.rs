//! What a campaign tells its listeners while it runs: a progress bar today, a live view later.

use std::time::Duration;

use sesame_optimise::front::Front;
use sesame_record::TestRecord;
use sesame_search::coverage::Coverage;

use crate::campaign::executor::Machines;

/// Something that happened in a campaign.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum CampaignEvent<'a> {
    /// The first reference run has not ended yet; told several times a second.
    ReferenceRunAwaited {
        /// How long it has been awaited.
        waited: Duration,
        /// After how long it is stopped.
        limit: Duration,
        /// What the start of the system waits for, if that takes long.
        missing: Option<&'a str>,
    },
    /// The first reference run has not ended yet, and agents run it; told several times a second.
    AgentsAwaited {
        /// What is waited for, if that is more than the run.
        missing: Option<&'a str>,
    },
    /// Something has happened to a machine whose agents run tests, or the campaign waits for agents. It is recorded
    /// too.
    Told {
        /// What, in a sentence.
        text: &'a str,
    },
    /// The machines whose agents run tests are as busy as this now.
    Machines(Machines),
    /// The first reference run has shown something that a user should know before the search. It is recorded too.
    Warned {
        /// What, in a sentence.
        text: &'a str,
    },
    /// The first reference run has ended, and the search begins.
    SearchStarted {
        /// How long the reference run took, in wall time.
        reference: Duration,
        /// After how long a test is stopped, in wall time.
        timeout: Duration,
    },
    /// A test has ended and is recorded; in a resumed campaign also one that was recorded before.
    TestEnded(&'a TestRecord),
    /// Runs to confirm tests have begun, or one of them has ended and is recorded.
    ConfirmationAdvanced,
    /// All tests of a generation have ended, and those to be confirmed are confirmed.
    GenerationEnded {
        /// Which, from 0.
        generation: u32,
    },
    /// No more tests are asked for.
    SearchEnded {
        /// Why, in words.
        reason: &'a str,
    },
}

/// How far a campaign is.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Tests evaluated, without reference runs.
    pub done: u32,
    /// Tests to be evaluated in total; a search may stop earlier.
    pub total: u32,
    /// The tests that were recorded when a stopped campaign was taken up again. They are told first.
    pub earlier: u32,
    /// Runs to confirm tests so far. They are not tests, and `done` leaves them out.
    pub confirmation_runs: u32,
    /// The front so far.
    pub front: &'a Front,
    /// The cells covered so far, if the campaign counts them.
    pub coverage: Option<&'a Coverage>,
}

/// Hears each event of a campaign, in order, with how far the campaign is after it.
pub type Listener<'l> = dyn FnMut(CampaignEvent<'_>, Progress<'_>) + 'l;
