//! Tests that keep crashing an external simulator: they are named, and not run again.
//!
//! Whether a test is one follows from what is recorded of it, so results of any release say it, and equal campaigns
//! quarantine equal tests. A simulator inside the runner costs nothing to start, so none of its tests is left out.

use sesame_base::observation::Outcome;
use sesame_plan::CampaignPlan;

use crate::Repetition;

/// How many runs of a test must crash: its first, and the first of those that run it again. All others are then left
/// out.
pub const QUARANTINE: usize = 3;

/// Whether a test that ended so, and so when it was run again, is not to be run once more.
pub fn is_quarantined(plan: &CampaignPlan, first: &Outcome, repetitions: &[Repetition]) -> bool {
    may_be_quarantined(plan, first)
        && repetitions.len() >= QUARANTINE - 1
        && repetitions[..QUARANTINE - 1].iter().all(|run| matches!(run.outcome, Outcome::Crash { .. }))
}

/// Whether a test that ended so is quarantined if the next runs end so, too.
pub fn may_be_quarantined(plan: &CampaignPlan, first: &Outcome) -> bool {
    !plan.simulator.properties().in_runner && matches!(first, Outcome::Crash { .. })
}
