//! The same tests before and after a certificate was mended, each on one time axis.

use sesame_present::axis::Axis;
use sesame_present::markup::{Markup, coordinate};
use sesame_record::{RecordError, Repository, TestRecord};

use crate::facts::certificate::before_after::{MendedTest, mend};
use crate::facts::certificate::test::monitors;
use crate::html::certificate;
use crate::html::timeline::time_axis;
use crate::sentences::mend_sentence;
use crate::tables::monitors::mended;

/// Tests that are drawn at most, and rows of the table.
const DRAWN: usize = 12;
const ROWS: usize = 50;

/// The section on the tests in which hazards were missed in the results of before, or are missed now.
pub(super) fn before_and_after(
    body: &mut Markup,
    repository: &Repository,
    before: &Repository,
    drawn: &[u32],
) -> Result<(), RecordError> {
    let mend = mend(repository, before)?;
    body.open("section", &[("id", "mend")]);
    body.heading("Before and after the mend");
    body.open("p", &[("class", "headline")]);
    body.prose(&format!("{}.", mend_sentence(&mend)));
    body.close();
    if let Some(difference) = &mend.difference {
        body.open("p", &[("class", "warning")]);
        body.prose(&format!("Warning: not only the monitors differ: {difference}."));
        body.close();
    }
    let folder = mend.before.display();
    body.element("p", &[("class", "quiet")], &format!("Before: {}, in {folder}.", before.plan().source));
    let mut table = mended(&mend);
    let more = table.truncate(ROWS);
    if !table.is_empty() {
        table.html(body, drawn);
    }
    if more > 0 {
        body.element("p", &[("class", "quiet")], &format!("And {more} more; the report in JSON has all."));
    }
    for test in mend.changed.iter().take(DRAWN) {
        let records = [before.test(test.before.0)?, repository.test(test.test.0)?];
        both(body, test, [before, repository], &records);
    }
    body.close();
    Ok(())
}

/// The certificates of a test, above each other on one time axis.
fn both(body: &mut Markup, test: &MendedTest, repositories: [&Repository; 2], records: &[TestRecord; 2]) {
    let ends = repositories.map(|of| of.plan().campaign.end_after).into_iter();
    let end = ends.chain(records.iter().map(|record| record.observation.end)).fold(0.0, f64::max);
    let time = Axis::exact(0.0, end, 8);
    body.open("article", &[("class", "test"), ("id", &format!("mend-{}", test.test))]);
    body.open("h3", &[]);
    body.text(&test.test.to_string());
    if test.before != test.test {
        body.element("span", &[("class", "quiet")], &format!(" {} before", test.before));
    }
    body.close();
    let label = format!("{} before and after the mend", test.test);
    let until = coordinate(time.high);
    body.open("figure", &[("class", "timeline"), ("aria-label", &label), ("data-end", &until)]);
    let sides = [("Before", &test.missed_before), ("After", &test.missed_after)];
    for ((title, missed), (repository, record)) in sides.into_iter().zip(repositories.into_iter().zip(records)) {
        let observation = &record.observation;
        let words = match missed.as_slice() {
            [] => format!("{title}: no hazard missed"),
            missed => format!("{title}: hazard of {} MISSED", missed.join(", ")),
        };
        body.element("h4", &[("class", if missed.is_empty() { "side" } else { "side bad" })], &words);
        let broke_off = (!observation.outcome.is_whole()).then_some(observation.end);
        certificate::lanes(body, &time, &monitors(repository.plan(), observation), (observation.end, broke_off));
    }
    time_axis(body, &time);
    body.close();
    body.close();
}
