//! Finding what was recorded, and whether this runner can still do the same.

use std::path::{Path, PathBuf};

use sesame_plan::CampaignPlan;
use sesame_results::record::{self, Repository};

use crate::cli::execution::shown;
use crate::cli::failure::Failure;
use crate::cli::session::Session;

/// The results in this folder, or those of the campaign's latest run.
pub(super) fn open(results: &Path, folder: Option<&Path>) -> Result<Repository, Failure> {
    let folder = match folder {
        Some(folder) => run_folder(results, folder),
        None => record::latest_folder(results)?
            .ok_or_else(|| Failure(format!("there are no results yet in {}: `run` makes some", results.display())))?,
    };
    Ok(Repository::open(&folder)?)
}

/// The folder of a run that the user names: by its path, or by its place in the folder of all results, such as `42`.
pub(super) fn run_folder(results: &Path, named: &Path) -> PathBuf {
    let inside = results.join(named);
    if !named.exists() && inside.is_dir() { inside } else { named.to_owned() }
}

/// Insists that a test of these results can be run by this runner.
pub(super) fn refuse_changed(session: &Session, repository: &Repository, test: u32) -> Result<(), Failure> {
    if same_model(repository.plan(), &session.plan) {
        return Ok(());
    }
    Err(Failure(format!(
        "the model has changed since {} was recorded, so T{test} cannot be run as it was. This writes it as a `test` for the \
         `.sesame` file, which runs in the model of today:\n    {}",
        shown(repository.path()),
        session.caller.command("export", &[&format!("T{test}"), "--results", &shown(repository.folder())])
    )))
}

/// Whether a runner of this plan disturbs and measures as the runner did that recorded. What is searched for, known
/// tests, and where and how things are described make no difference to that.
pub(super) fn same_model(recorded: &CampaignPlan, plan: &CampaignPlan) -> bool {
    let mut comparable = recorded.clone();
    comparable.tests.clone_from(&plan.tests);
    comparable.campaign.search = plan.campaign.search.clone();
    comparable.campaign.objectives.clone_from(&plan.campaign.objectives);
    comparable.campaign.coverage.clone_from(&plan.campaign.coverage);
    comparable.campaign.confirm = plan.campaign.confirm;
    comparable.campaign.neighbours = plan.campaign.neighbours;
    comparable.campaign.exploration.clone_from(&plan.campaign.exploration);
    comparable.campaign.stop.clone_from(&plan.campaign.stop);
    comparable.campaign.seed = plan.campaign.seed;
    comparable.campaign.doc.clone_from(&plan.campaign.doc);
    for (metric, today) in comparable.metrics.iter_mut().zip(&plan.metrics) {
        metric.line = today.line;
        metric.doc.clone_from(&today.doc);
    }
    comparable == *plan
}

#[cfg(test)]
mod tests {
    use sesame_plan::{CoverageGoal, Dimension, GridAxis, Task};
    use sesame_results::record::sample;

    use super::*;

    #[test]
    fn what_is_run_and_how_it_is_described_may_change_but_not_what_is_disturbed_or_measured() {
        let plan = sample::plan();
        let changed = |change: fn(&mut CampaignPlan)| {
            let mut changed = plan.clone();
            change(&mut changed);
            same_model(&plan, &changed)
        };
        assert!(changed(|plan| plan.tests.clear()));
        assert!(changed(|plan| plan.campaign.objectives.clear()));
        assert!(changed(|plan| plan.campaign.search.set_evaluations(7)));
        assert!(changed(|plan| plan.metrics[0].line += 7));
        // What a command does instead of the campaign changes nothing of the model, so that `resume` goes on with it.
        assert!(same_model(&Task::Known { tests: Vec::new() }.plan(&plan), &plan));
        let axes = || vec![GridAxis { dimension: Dimension::T1, low: 0.0, high: 1.0, cells: 6 }];
        let goal = || CoverageGoal { axes: axes(), hits: 1, stop_at: None };
        assert!(same_model(&plan, &{
            let mut counting = plan.clone();
            counting.campaign.coverage = Some(goal());
            counting
        }));
        assert!(changed(|plan| plan.campaign.seed += 1));
        assert!(!changed(|plan| plan.metrics[0].default = None));
        assert!(!changed(|plan| plan.operations[0].within.end += 1.0));
        assert!(!changed(|plan| plan.operations.swap(0, 1)));
        assert!(!changed(|plan| plan.campaign.end_after += 1.0));
        assert!(!changed(|plan| plan.requirements.truncate(1)));
        assert!(!changed(|plan| plan.metrics.truncate(1)));
    }
}
