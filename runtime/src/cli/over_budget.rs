//! Whether the relay was found too slow for a campaign.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sesame_plan::Undisturbed;
use sesame_record::{DATABASE, Repository};
use sesame_report::preparation;

use crate::cli::execution::shown;
use crate::cli::failure::Failure;
use crate::cli::session::Session;
use crate::cli::terminal::say;

/// Refuses to go on if the latest `mitm` of this plan, in simulation, exceeded the relay budget. Without one there is
/// nothing to refuse.
pub(super) fn refuse_over_budget(session: &Session, results: &Path) -> Result<(), Failure> {
    if session.plan.simulator.lifecycle.relay_budget.is_none() {
        return Ok(());
    }
    for folder in latest_first(results) {
        let stages = match stages(session, &folder) {
            Ok(stages) => stages,
            Err(Failure(words)) => {
                say(format_args!("note: {} cannot be read and is skipped: {words}", shown(&folder)));
                continue;
            }
        };
        if stages.is_empty() {
            continue;
        }
        let found = preparation::mitm(&stages)?;
        let Some(stage) = found.stages.iter().find(|stage| stage.over_budget) else { return Ok(()) };
        let why = stage.objections.first().map_or("", String::as_str);
        return Err(Failure(format!(
            "the latest `mitm` of this plan, {}, exceeded the relay budget: {why}. What a test shows might be the relay's \
             doing. Make the relay faster, raise the `relay budget`, measure again with `mitm`, or run anyway:\n    {}",
            shown(&folder),
            session.caller.command("run", &["--over-budget"])
        )));
    }
    Ok(())
}

/// The stages of a `mitm` of this plan in simulation, as far as they are recorded; none of anything else.
fn stages(session: &Session, folder: &Path) -> Result<Vec<Repository>, Failure> {
    let mut stages = Vec::new();
    for relayed in 0u32.. {
        let stage = folder.join(relayed.to_string());
        if !stage.join(DATABASE).exists() {
            break;
        }
        let repository = Repository::open(&stage)?;
        let is_stage = |task: &Undisturbed| task.relayed == relayed && task.equal_seeds && task.lab.is_none();
        let same = repository.plan().same_model(&session.plan.relaying(relayed));
        if !same || !repository.task().undisturbed().is_some_and(is_stage) {
            return Ok(Vec::new());
        }
        stages.push(repository);
    }
    Ok(stages)
}

/// The folders of all `mitm`, alone or as a step of `prepare`, the latest first.
fn latest_first(results: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(results).into_iter().flatten().filter_map(Result::ok);
    let of = |entry: std::fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        let base = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '-');
        match base {
            "mitm" => Some(entry.path()),
            "prepare" => Some(entry.path().join("mitm")),
            _ => None,
        }
    };
    let mut found: Vec<(SystemTime, PathBuf)> =
        entries.filter_map(of).filter_map(|folder| Some((written_at(&folder)?, folder))).collect();
    // Equal times are told apart by name, so that the answer does not depend on the order of the listing.
    found.sort();
    found.into_iter().rev().map(|(_, folder)| folder).collect()
}

/// When the first stage was recorded, if there is one.
fn written_at(folder: &Path) -> Option<SystemTime> {
    std::fs::metadata(folder.join("0").join(DATABASE)).ok()?.modified().ok()
}
