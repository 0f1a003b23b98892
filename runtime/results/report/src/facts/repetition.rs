//! Repetition of one test: how often it violated each requirement, and how sure that is.

use serde::Serialize;

use sesame_gap::proportion::wilson;
use sesame_plan::{CampaignPlan, Task};
use sesame_present::number::plural;
use sesame_record::{Origin, Tally, TestRow};

/// The results of repeating one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repetition {
    /// The test that was repeated.
    pub test: String,
    /// How often each requirement was violated, in the space's order.
    pub requirements: Vec<ViolationRate>,
    /// The heading of these results.
    #[serde(skip)]
    pub(crate) title: String,
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

/// What a run that is not a reference run is called where a test is repeated instead of searched for: an observation
/// if the test has no operations, else a repetition.
pub(crate) fn run_word(plan: &CampaignPlan, task: &Task) -> Option<&'static str> {
    task.repeated(plan).map(|repeated| if repeated.test.operations.is_empty() { "observation" } else { "repetition" })
}

/// How often which test is repeated, in words; `None` if none is.
pub(crate) fn repeated_words(plan: &CampaignPlan, task: &Task) -> Option<String> {
    let repeated = task.repeated(plan)?;
    Some(if repeated.test.operations.is_empty() {
        plural(repeated.times as usize, "observation", "observations")
    } else {
        format!("{} repeated {} times", repeated.name, repeated.times)
    })
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
    let title = match repeated.test.operations[..] {
        [] => "Observed without disturbance".to_owned(),
        _ => format!("{} repeated", repeated.name),
    };
    Some(Repetition { test: repeated.name.to_owned(), requirements: requirements.collect(), title })
}
