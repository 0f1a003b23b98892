//! Commands on the page, for a reader to copy into a terminal.
//!
//! Names come from the results, which may be anyone's, so each argument that is more than a plain name is quoted.

use std::fmt::Write as _;
use std::path::Path;

use sesame_base::shell::{quoted, quoted_file};
use sesame_plan::CampaignPlan;

/// What shows one test in full, in the folder of the space: what stands before its name, and what after.
pub(super) fn show(plan: &CampaignPlan, run: &Path) -> (String, String) {
    let mut after = format!(" --campaign {}", quoted(&plan.campaign.name));
    let _ = write!(after, " --results {}", quoted_file(&results(run)));
    (format!("sesamec show {} ", quoted_file(&plan.source)), after)
}

/// What lists all tests.
pub(super) fn list(plan: &CampaignPlan, run: &Path) -> String {
    let (_, after) = show(plan, run);
    format!("sesamec list {}{after}", quoted_file(&plan.source))
}

/// The folder of a run, as seen from the folder of its space if it lies where runners put it: `runners/NAME/results/1`.
/// A folder elsewhere is named in full.
fn results(run: &Path) -> String {
    let run = std::path::absolute(run).unwrap_or_else(|_| run.to_owned());
    let parts: Vec<&str> = run.iter().filter_map(|part| part.to_str()).collect();
    match parts.as_slice() {
        [.., runners @ "runners", name, results @ "results", run] => [*runners, *name, *results, *run].join("/"),
        _ => run.display().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    #[test]
    fn the_command_can_be_pasted_in_the_folder_of_the_space() {
        let run = Path::new("/home/ada/cell/runners/coverage_experiment/results/3");
        let (before, after) = show(&sample::plan(), run);
        assert_eq!(
            format!("{before}T5{after}"),
            "sesamec show kuka_cell.sesame T5 --campaign coverage_experiment \
             --results runners/coverage_experiment/results/3"
        );
        let elsewhere = show(&sample::plan(), Path::new("/tmp/sent_by_ada")).1;
        assert_eq!(elsewhere, " --campaign coverage_experiment --results /tmp/sent_by_ada");
        let named = show(&sample::plan(), Path::new("/home/ada/out/coverage_experiment/results/3")).1;
        assert_eq!(named, " --campaign coverage_experiment --results /home/ada/out/coverage_experiment/results/3");
    }

    #[test]
    fn names_of_others_run_nothing() {
        let mut plan = sample::plan();
        "a'; rm -rf ~; '.sesame\n".clone_into(&mut plan.source);
        let (before, _) = show(&plan, Path::new("run"));
        assert_eq!(before, r"sesamec show 'a'\''; rm -rf ~; '\''.sesame' ");
    }
}
