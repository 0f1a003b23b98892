//! The page with pictures: one file that needs nothing but itself.

use std::path::Path;

use sesame_analysis::causes::Fewer;
use sesame_present::chart::evenly;
use sesame_present::markup::{Heading, Markup, fill};
use sesame_present::table::{Table, link_to_test};
use sesame_record::{Origin, RecordError, Repository, TestRow};

use crate::facts::causes::{CauseSummary, CausesSummary};
use crate::facts::shrinking::Shrinking;
use crate::facts::summary::{Summary, summarise};
use crate::facts::violated::{Violated, violated_requirement};
use crate::file::write_aside;
use crate::html::all_tests::all_tests;
use crate::html::front::front;
use crate::html::generations::generations;
use crate::html::header::{about, header};
use crate::html::policy::policy;
use crate::html::test::test;
use crate::html::{before_after, cells, monitors, pairs, regions, shrinking, tree};
use crate::sentences::{QUARANTINED, causes_sentence, once_sentence};
use crate::tables;

/// Causes whose smallest tests are drawn at most.
const CAUSES: usize = 16;

/// Timelines drawn at most; of a larger front evenly chosen ones.
const TIMELINES: usize = 24;

/// Writes the page to this path, beside the results or elsewhere.
pub fn write_page(repository: &Repository, path: &Path) -> Result<(), RecordError> {
    write_page_with(repository, path, &repository.digest()?)
}

/// The same for results whose digest is known already.
pub fn write_page_with(repository: &Repository, path: &Path, digest: &str) -> Result<(), RecordError> {
    write_page_against(repository, None, path, digest)
}

/// The same with results of before the certificates were mended: the page shows the same tests before and after.
pub fn write_page_against(
    repository: &Repository,
    before: Option<&Repository>,
    path: &Path,
    digest: &str,
) -> Result<(), RecordError> {
    let beside = path.parent() == Some(repository.folder());
    let folder = if beside { Path::new("") } else { repository.folder() };
    let page = page_in(repository, before, folder, digest)?;
    write_aside(path, &page).map_err(|e| RecordError::io("write the page", path, e))
}

/// The page, from a campaign's results; a run may still be going on. Links to traces lead from the run's folder.
pub fn page(repository: &Repository) -> Result<String, RecordError> {
    page_in(repository, None, Path::new(""), &repository.digest()?)
}

/// The page; `folder` is the path of the run's folder relative to the page.
fn page_in(
    repository: &Repository,
    before: Option<&Repository>,
    folder: &Path,
    digest: &str,
) -> Result<String, RecordError> {
    let rows = repository.tests()?;
    let members = repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members);
    let summary = summarise(repository, &rows, &members)?;
    let groups = chosen(&summary, &rows);
    let worst = worst_of_causes(&summary);
    let drawn: Vec<u32> =
        worst.into_iter().chain(groups.iter().flat_map(|group| group.tests.iter().copied())).collect();

    let mut body = Markup::default();
    body.open("main", &[("id", "main")]);
    for shrinking in summary.shrunk() {
        shrinking::shrinking(&mut body, shrinking, &drawn);
    }
    causes(&mut body, &summary, &drawn);
    if let Some(number) = worst {
        test(&mut body, repository, &summary, number, folder)?;
    }
    monitors::monitors(&mut body, &summary, &drawn);
    if let Some(before) = before {
        before_after::before_and_after(&mut body, repository, before, &drawn)?;
    }
    requirements(&mut body, &summary, &drawn);
    front(&mut body, repository, &summary, &rows, &drawn);
    all_tests(&mut body, repository, &summary, &rows, &drawn)?;
    generations(&mut body, repository, &summary, &rows, &drawn)?;
    if let Some(coverage) = &summary.coverage {
        cells::coverage(&mut body, repository.plan(), coverage, &drawn);
    }
    pairs::combinations(&mut body, repository.plan(), &summary);
    regions::regions(&mut body, repository)?;
    tree::certificates(&mut body, repository.plan());
    sections(&mut body, &summary, &drawn);
    for group in groups.iter().filter(|group| !group.tests.is_empty()) {
        body.open("section", &[]);
        body.heading(group.title);
        body.element("p", &[("class", "quiet")], &group.caption);
        for &number in &group.tests {
            test(&mut body, repository, &summary, number, folder)?;
        }
        body.close();
    }
    about(&mut body, repository, digest)?;
    body.close();
    let mut whole = Markup::default();
    whole.element("a", &[("class", "skip"), ("href", "#main")], "Skip to the results");
    header(&mut whole, repository, &summary);
    contents(&mut whole, &body);
    whole.append(body);
    let title = format!("{} of {}, seed {}", summary.campaign, summary.space, summary.seed);
    let mut escaped = Markup::default();
    escaped.text(&title);
    let shell = sesame_templates::report::page();
    // The policy is of the shell alone: what is filled in is not permitted to hold styles or scripts.
    let policy = policy(&shell);
    Ok(fill(&shell, &[("policy", &policy), ("title", &escaped.finish()), ("body", &whole.finish())]))
}

/// What the marks of a timeline mean.
const MARKS: &str =
    "Outlined: planned; filled: active. Red: the value up to then is outside the bound of a requirement.";

/// What the lanes of a certificate mean.
const MISSED: &str = "Of each monitor its state over time, the higher the stronger; dashed: its safe state. Below it its \
                      evidence: filled: true; a line at the bottom: false; dashed: unknown. Vertical: a requirement was \
                      violated, solid where the monitor had not foreseen it. ▼: mitigation was sent. Point at a state to \
                      see why it was so.";

/// Tests that get a timeline because monitors missed hazards in them.
const MOST_MISSED: usize = 8;

/// Tests in which monitors missed hazards.
fn missed(summary: &Summary) -> Vec<u32> {
    let mut tests: Vec<u32> =
        summary.monitors.iter().flat_map(|monitors| &monitors.missed).map(|missed| missed.test.0).collect();
    tests.dedup();
    tests.truncate(MOST_MISSED);
    tests
}

/// Tests that get a timeline, under a heading.
struct Group {
    title: &'static str,
    caption: String,
    tests: Vec<u32>,
}

fn chosen(summary: &Summary, rows: &[TestRow]) -> Vec<Group> {
    let reference: Vec<u32> =
        rows.iter().filter(|row| row.origin == Origin::Reference).map(|row| row.number).take(1).collect();
    let all: Vec<u32> = summary.front.iter().map(|test| test.number).collect();
    let missed = missed(summary);
    let all: Vec<u32> = all.into_iter().filter(|number| !missed.contains(number)).collect();
    let front = evenly(&all, TIMELINES);
    let worst = summary.requirements.iter().filter_map(|requirement| requirement.worst.as_ref());
    let worst = worst.filter_map(|worst| rows.iter().find(|row| row.number == worst.test.0));
    let causes = summary.causes.iter().flat_map(|found| &found.causes).take(CAUSES);
    let causes = causes.filter_map(|cause| rows.iter().find(|row| row.number == cause.test.0));
    let failed = rows.iter().filter(|row| !row.outcome.is_whole()).take(4);
    let known = rows.iter().filter(|row| matches!(row.origin, Origin::Known(_))).take(8);
    let mut more: Vec<u32> = Vec::new();
    for row in causes.chain(worst).chain(failed).chain(known) {
        if ![&front, &more, &missed].iter().any(|others| others.contains(&row.number)) {
            more.push(row.number);
        }
    }
    let front_caption = if front.len() < all.len() {
        format!("{} of the {} tests on the front, evenly chosen. {MARKS}", front.len(), all.len())
    } else {
        MARKS.to_owned()
    };
    let shrunk: Vec<u32> = summary.shrunk().flat_map(Shrinking::ends).collect();
    more.retain(|number| !shrunk.contains(number));
    let missed: Vec<u32> =
        missed.into_iter().filter(|number| !shrunk.contains(number) && !reference.contains(number)).collect();
    let shrunk_caption = "Tests before and after they were shrunk.".to_owned();
    let mut groups = vec![
        Group { title: "Before and after", caption: shrunk_caption, tests: shrunk },
        Group {
            title: "Reference run",
            caption: "The run without disturbance, for comparison.".to_owned(),
            tests: reference,
        },
        Group { title: "Tests with missed hazards", caption: MISSED.to_owned(), tests: missed },
        Group { title: "Tests on the front", caption: front_caption, tests: front },
        Group {
            title: "More tests to look at",
            caption:
                "The smallest test of each cause, the worst violation of each requirement, crashes and timeouts, and \
                      regression tests."
                    .to_owned(),
            tests: more,
        },
    ];
    let worst = worst_of_causes(summary);
    for group in &mut groups {
        group.tests.retain(|number| Some(*number) != worst);
    }
    groups
}

/// The causes of violations: what each requirement asks for, its causes, and what is known of others.
pub(super) fn causes(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    let Some(found) = summary.causes.as_ref().filter(|found| !found.causes.is_empty()) else { return };
    body.open("section", &[]);
    body.heading("Causes");
    for (requirement, causes) in summary.violated_by_causes() {
        let Violated { before, worst, after } = violated_requirement(requirement, &causes);
        body.open("p", &[]);
        body.text(&before);
        if let Some(test) = worst {
            link_to_test(body, test, drawn);
        }
        body.text(&after);
        body.close();
    }
    let mut table = tables::causes(found);
    let more = table.truncate(FAILURES);
    table.html_stacking(body, drawn);
    left_out(body, more);
    let mut caption = vec![COLUMNS_OF_CAUSES.to_owned()];
    caption.extend(found.causes.iter().any(|cause| cause.fewer != Fewer::Single).then(|| WITH_FEWER.to_owned()));
    caption.extend(causes_sentence(found));
    body.element("p", &[("class", "quiet")], &caption.join(" "));
    if let Some(worst) = found.worst().filter(|_| found.causes.len() > 1) {
        let CauseSummary { test, requirement, .. } = worst;
        let name = worst.name();
        body.open("p", &[]);
        body.prose(&format!(
            "{test}, the smallest test of `{name}`: no other smallest test violates {requirement} by more."
        ));
        body.close();
    }
    body.close();
}

/// What a cause is, and what the columns of the table of causes mean.
const COLUMNS_OF_CAUSES: &str = "A cause is a smallest set of operations with which a requirement is violated, as far as tests were run; a test may \
     show several. In its smallest test no other operation had an effect. Violating: of all conclusive tests with its \
     operations, those that violate the requirement; first: the first of them.";

/// What the column means that only causes of several operations have.
const WITH_FEWER: &str =
    "With fewer: what came of a violating test of just these operations when each of them was left out.";

/// The test that shows the worst cause; it is drawn next to the table.
pub(super) fn worst_of_causes(summary: &Summary) -> Option<u32> {
    summary.causes.as_ref().and_then(CausesSummary::worst).map(|cause| cause.test.0)
}

/// What is on the page, to jump to.
fn contents(body: &mut Markup, main: &Markup) {
    body.open("nav", &[("class", "contents"), ("aria-label", "Contents")]);
    for Heading { id, title } in main.headings() {
        body.element("a", &[("href", &format!("#{id}"))], title);
    }
    body.close();
}

/// Rows of failures shown at most.
const FAILURES: usize = 50;

/// The requirements, with a sentence on violations that were seen once only.
pub(super) fn requirements(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    let table = tables::requirements(summary);
    if table.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.heading("Requirements");
    table.html(body, drawn);
    if let Some(sentence) = once_sentence(summary) {
        body.element("p", &[("class", "quiet")], &format!("{sentence}."));
    }
    body.close();
}

/// The sections that are a table each.
fn sections(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    if let Some(repetition) = &summary.repetition {
        let caption = "How often each requirement was violated, with the 95 % Wilson interval.";
        let table = tables::violation_rates(&repetition.requirements);
        section(body, &repetition.title, Some(caption), table, drawn);
    }
    section(body, "Regression tests", None, tables::expectations(&summary.expectations), drawn);
    section(body, tables::failures_title(&summary.failures), None, tables::failures(&summary.failures), drawn);
    section(body, QUARANTINED, None, tables::quarantined(&summary.quarantined), drawn);
    section(body, "Numbers that are not finite", None, tables::not_finite(&summary.not_finite), drawn);
}

/// A table under its title, with at most [`FAILURES`] rows; nothing if it has none.
fn section(body: &mut Markup, title: &str, caption: Option<&str>, mut table: Table, drawn: &[u32]) {
    if table.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.heading(title);
    if let Some(caption) = caption {
        body.element("p", &[("class", "quiet")], caption);
    }
    let more = table.truncate(FAILURES);
    table.html(body, drawn);
    left_out(body, more);
    body.close();
}

/// How many rows a table lacks, if any.
fn left_out(body: &mut Markup, more: usize) {
    if more > 0 {
        body.element("p", &[("class", "quiet")], &format!("And {more} more; the report in JSON has all."));
    }
}
