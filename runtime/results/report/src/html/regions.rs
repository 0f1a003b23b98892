//! Where tests fail, as a section of the page.

use sesame_analysis::Selection;
use sesame_analysis::regions::{Regions, all_regions, all_regions_by_cause};
use sesame_plan::Dimension;
use sesame_present::markup::Markup;
use sesame_present::number;
use sesame_record::{RecordError, Repository};

use crate::html::legend::legend;
use crate::tables;

/// Tests that a rule is worth being made of.
const FEWEST: usize = 20;

/// Draws the trees of everything in which tests of a search fail, with their rules.
pub(super) fn regions(body: &mut Markup, repository: &Repository) -> Result<(), RecordError> {
    let plan = repository.plan();
    // Elsewhere tests are not there to be compared with each other.
    if !repository.task().searches(plan) {
        return Ok(());
    }
    let all = Selection::default();
    let mut found = all_regions(repository, &all)?;
    // With a single cause, its tree would say what that of the requirement says.
    for causes in all_regions_by_cause(repository, &all)?.chunk_by(|a, b| a.target == b.target) {
        if causes.len() > 1 {
            found.extend_from_slice(causes);
        }
    }
    // Each requirement is followed by its causes; the sort keeps their order. Crashes and timeouts come last.
    found.sort_by_key(|regions| {
        let place = plan.requirements.iter().position(|requirement| requirement.name == regions.target);
        place.unwrap_or(plan.requirements.len())
    });
    found.retain(|regions| regions.rules.len() > 1 && regions.all.tests >= FEWEST);
    if found.is_empty() {
        return Ok(());
    }
    body.open("section", &[("id", "regions")]);
    body.heading("Where tests fail");
    let caption = "Regions of tests that a small decision tree separates, by the reduced space (T1 to O3) and the \
                   operations; the redder, the more fail. Where a requirement has several causes, the tests of each of \
                   them are divided too: those that hold its operations and no other cause. Rules describe these \
                   tests; only further tests can show whether they hold for others.";
    body.element("p", &[("class", "quiet")], caption);
    for regions in &found {
        of_one(body, regions, repository);
    }
    legend(body, &Dimension::ALL);
    body.close();
    Ok(())
}

fn of_one(body: &mut Markup, regions: &Regions, repository: &Repository) {
    let tests = number::plural(regions.all.tests, "test fails", "tests fail");
    body.element("h3", &[], &format!("{}: {} of {tests}", regions.title(), regions.all.failing));
    regions.draw(body, repository.plan());
    tables::regions(&regions.rules).html(body, &[]);
}
