//! Finding what was recorded, and whether this runner can still do the same.

use std::path::{Path, PathBuf};

use sesame_record as record;
use sesame_record::Repository;

use crate::cli::execution::shown;
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::say;

/// The results in this folder, or those of the campaign's latest run, which is then named on standard error.
pub(super) fn open(results: &Path, folder: Option<&Path>) -> Result<Repository, Failure> {
    if let Some(folder) = folder {
        return Ok(Repository::open(&run_folder(results, folder))?);
    }
    let folder = record::latest_folder(results)?
        .ok_or_else(|| Failure(format!("there are no results yet in {}: `run` makes some", results.display())))?;
    let repository = Repository::open(&folder)?;
    say(format_args!("results of the latest run: {}", shown(&folder)));
    Ok(repository)
}

/// The folder of a run that the user names: by its path, or by its place in the folder of all results, such as `42`.
pub(super) fn run_folder(results: &Path, named: &Path) -> PathBuf {
    let inside = results.join(named);
    if !named.exists() && inside.is_dir() { inside } else { named.to_owned() }
}

/// Insists that a test of these results can be run by this runner.
pub(super) fn refuse_changed(session: &Session, repository: &Repository, test: u32) -> Result<(), Failure> {
    let Some(difference) = repository.plan().model_difference(&session.plan) else { return Ok(()) };
    Err(Failure(format!(
        "the model has changed since {} was recorded ({difference}), so T{test} cannot be run as it was. This writes it as a \
         `test` for the `.sesame` file, which runs in the current model:\n    {}",
        shown(repository.path()),
        session.caller.command("export", &[&format!("T{test}"), "--results", &shown(repository.folder())])
    )))
}

/// Insists that results are of the model of this runner.
pub(super) fn refuse_other_model(session: &Session, repository: &Repository) -> Result<(), Failure> {
    match repository.plan().model_difference(&session.plan) {
        None => Ok(()),
        Some(difference) => Err(Failure(format!(
            "the model has changed since {} was recorded ({difference})",
            shown(repository.path())
        ))),
    }
}
