//! Repetition of one test: how often it violated each requirement, and how sure that is.

use serde::Serialize;

use sesame_plan::{CampaignPlan, Task};

use crate::analysis::statistics::wilson;
use crate::record::{Origin, Tally, TestRow};

/// The results of repeating one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repetition {
    /// The test that was repeated.
    pub test: String,
    /// How often each requirement was violated, in the space's order.
    pub requirements: Vec<ViolationRate>,
}

/// How often a requirement was violated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViolationRate {
    /// Its name.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// Runs that violate it.
    pub violated: usize,
    /// Runs that are conclusive about it: those that satisfy it, and those that violate it.
    pub conclusive: usize,
    /// The 95 % Wilson interval of the probability that a run violates it; `None` if all runs are inconclusive.
    pub interval: Option<[f64; 2]>,
}

/// The results of a run that repeats a test; `None` for any other.
pub(crate) fn repetition(plan: &CampaignPlan, task: &Task, rows: &[TestRow]) -> Option<Repetition> {
    let repeated = task.repeated(plan)?;
    let requirements = plan.requirements.iter().map(|requirement| {
        let runs = rows.iter().filter(|row| row.origin == Origin::Search);
        let tally = Tally::of(runs.map(|row| row.verdict(requirement)));
        ViolationRate {
            requirement: requirement.name.clone(),
            text: requirement.text.clone(),
            violated: tally.violated,
            conclusive: tally.conclusive(),
            interval: wilson(tally.violated, tally.conclusive()),
        }
    });
    Some(Repetition { test: repeated.name.to_owned(), requirements: requirements.collect() })
}
