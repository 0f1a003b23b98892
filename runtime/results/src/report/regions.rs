//! Where tests fail, as a section of the page.

use crate::analysis::Selection;
use crate::analysis::regions::{Regions, all_regions};
use crate::record::{RecordError, Repository};
use crate::report::markup::Markup;
use crate::report::number;
use crate::report::page::heading_row;

/// Tests that a rule is worth being made of.
const FEWEST: usize = 20;

/// Draws the trees of everything in which tests of a search fail, with their rules.
pub(crate) fn section(body: &mut Markup, repository: &Repository) -> Result<(), RecordError> {
    let plan = repository.plan();
    // Elsewhere tests are not there to be compared with each other.
    if !repository.task().searches(plan) {
        return Ok(());
    }
    let mut found = all_regions(repository, &Selection::default())?;
    found.retain(|regions| regions.rules.len() > 1 && regions.all.tests >= FEWEST);
    if found.is_empty() {
        return Ok(());
    }
    body.open("section", &[("id", "regions")]);
    body.element("h2", &[], "Where tests fail");
    let caption = "Regions of tests that a small decision tree tells apart, from the reduced space (T1 to O3) and the \
                   operations; the redder, the more fail. Rules describe these tests: whether they hold for others, only \
                   tests can tell.";
    body.element("p", &[("class", "quiet")], caption);
    for regions in &found {
        of_one(body, regions, repository);
    }
    body.close();
    Ok(())
}

fn of_one(body: &mut Markup, regions: &Regions, repository: &Repository) {
    let tests = number::plural(regions.all.tests, "test fails", "tests fail");
    body.element("h3", &[], &format!("{}: {} of {tests}", regions.target, regions.all.failing));
    regions.draw(body, repository.plan());
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, &["Fail", "Tests", "Share", "95 %", "Region"], 0..4);
    body.open("tbody", &[]);
    for rule in &regions.rules {
        let percent = |share: f64| format!("{} %", number::fixed(100.0 * share, 0));
        let (share, interval) = rule.tally.share().map_or_else(
            || ("–".to_owned(), "–".to_owned()),
            |(share, [low, high])| (percent(share), format!("{} to {}", percent(low), percent(high))),
        );
        body.open("tr", &[]);
        let failing = if rule.tally.failing > 0 { "number bad" } else { "number" };
        body.element("td", &[("class", failing)], &rule.tally.failing.to_string());
        for cell in [rule.tally.tests.to_string(), share, interval] {
            body.element("td", &[("class", "number")], &cell);
        }
        body.element("td", &[("class", "sentence")], &rule.sentence());
        body.close();
    }
    body.close();
    body.close();
    body.close();
}
