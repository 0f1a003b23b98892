//! Finding what was recorded, and whether this runner can still do the same.

use std::path::Path;

use sesame_plan::CampaignPlan;
use sesame_results::record::{self, Repository};

use crate::cli::execution::shown;
use crate::cli::failure::Failure;

/// The results in this folder, or those of the campaign's latest run.
pub(super) fn open(results: &Path, folder: Option<&Path>) -> Result<Repository, Failure> {
    let folder = match folder {
        Some(folder) => folder.to_owned(),
        None => record::latest_folder(results)?
            .ok_or_else(|| Failure(format!("there are no results yet in {}: `run` makes some", results.display())))?,
    };
    Ok(Repository::open(&folder)?)
}

/// Insists that a test of these results can be run by this runner.
pub(super) fn refuse_changed(repository: &Repository, plan: &CampaignPlan, test: u32) -> Result<(), Failure> {
    let Some(difference) = repository.plan().model_difference(plan) else { return Ok(()) };
    Err(Failure(format!(
        "the model has changed since {} was recorded ({difference}), so T{test} cannot be run as it was: `export T{test}` writes it as a \
         `test` for the `.sesame` file, which runs in the model of today",
        shown(repository.path())
    )))
}
