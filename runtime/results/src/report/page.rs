//! The page with pictures: one file that needs nothing but itself.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use sesame_base::observation::Outcome;
use sesame_plan::{CampaignPlan, Search, Task};

use crate::record::{MetricValue, Origin, RecordError, Repository, TestRow, Verdict, trace_file};
use crate::report::chart::evenly;
use crate::report::confirmed::{confirmation_sentence, once_sentence, tally_words, values_sentence};
use crate::report::generations::generations;
use crate::report::markup::{Markup, coordinate, fill};
use crate::report::number::{self, plural, with_unit};
use crate::report::policy::policy;
use crate::report::scatter::{Detail, Dimension, Kind, Point, dimension, scatter};
use crate::report::show::{TestReport, report_on};
use crate::report::shrinking::{self, Shrinking};
use crate::report::summary::{RequirementSummary, Summary, operations, summarise, value_text};
use crate::report::text::{
    came_out, choices_text, confirmed_column, counts_sentence, effect_text, expectation_value, headline,
    objective_columns, outcome_sentence, planned_text, rate_text, spans_text, stacked_column,
};
use crate::report::timeline::timeline;
use crate::report::{cells, regions};

/// Timelines drawn at most; of a larger front evenly chosen ones.
const TIMELINES: usize = 24;

/// Writes the page beside the results, or wherever it is wanted.
pub fn write_page(repository: &Repository, path: &Path) -> Result<(), RecordError> {
    write_page_with(repository, path, &repository.digest()?)
}

/// The same for results whose digest is known already.
pub fn write_page_with(repository: &Repository, path: &Path, digest: &str) -> Result<(), RecordError> {
    let beside = path.parent() == Some(repository.folder());
    let folder = if beside { Path::new("") } else { repository.folder() };
    write_aside(path, &page_in(repository, folder, digest)?).map_err(|e| RecordError::io("write the page", path, e))
}

/// Writes a file aside and renames it, so that nobody who reads it meanwhile sees half of it.
pub(crate) fn write_aside(path: &Path, content: &str) -> std::io::Result<()> {
    let mut aside = path.as_os_str().to_owned();
    aside.push(".tmp");
    std::fs::write(&aside, content).and_then(|()| std::fs::rename(&aside, path))
}

/// The page, from a campaign's results; a run may still be going on. Links to traces lead from the run's folder.
pub fn page(repository: &Repository) -> Result<String, RecordError> {
    page_in(repository, Path::new(""), &repository.digest()?)
}

/// The page, with the run's folder as it is seen from the page's place.
fn page_in(repository: &Repository, folder: &Path, digest: &str) -> Result<String, RecordError> {
    let rows = repository.tests()?;
    let members = repository.latest_result_set()?.map_or_else(Vec::new, |set| set.members);
    let summary = summarise(repository, &rows, &members)?;
    let judge = repository.judge()?;
    let groups = chosen(&summary, &rows);
    let drawn: Vec<u32> = groups.iter().flat_map(|group| group.tests.iter().copied()).collect();

    let mut body = Markup::default();
    header(&mut body, repository, &summary, digest)?;
    body.open("main", &[]);
    if let Some(shrinking) = &summary.shrinking {
        shrinking::section(&mut body, shrinking, &drawn);
    }
    requirements(&mut body, &summary, &drawn);
    front(&mut body, repository, &summary, &rows, &drawn);
    generations(&mut body, repository, &summary, &rows, &drawn)?;
    if let Some(coverage) = &summary.coverage {
        cells::coverage(&mut body, repository.plan(), coverage, &drawn);
    }
    regions::section(&mut body, repository)?;
    repetition(&mut body, &summary);
    expectations(&mut body, &summary, &drawn);
    failures(&mut body, &summary, &drawn);
    not_finite(&mut body, &summary, &drawn);
    for group in groups.iter().filter(|group| !group.tests.is_empty()) {
        body.open("section", &[]);
        body.element("h2", &[], group.title);
        body.element("p", &[("class", "quiet")], &group.caption);
        for &number in &group.tests {
            let record = repository.test(number)?;
            let on_front = summary.front.iter().any(|test| test.number == number);
            let fresh = judge.runs(record.duplicate_of.unwrap_or(number));
            let report = report_on(repository.plan(), &record, fresh, on_front);
            body.open("article", &[("class", "test"), ("id", &report.test)]);
            test_heading(&mut body, &summary, &report);
            timeline(&mut body, repository.plan(), &record, &report);
            figures(&mut body, &report);
            if repository.trace(number, record.duplicate_of).is_some() {
                trace_link(&mut body, &trace_file(folder, record.duplicate_of.unwrap_or(number)));
            }
            body.close();
        }
        body.close();
    }
    body.close();
    let title = format!("{} of {}, seed {}", summary.campaign, summary.space, summary.seed);
    let mut escaped = Markup::default();
    escaped.text(&title);
    let shell = sesame_templates::report::PAGE;
    // The policy is of the shell alone: what is filled in is not permitted to hold styles or scripts.
    let policy = policy(shell);
    Ok(fill(shell, &[("policy", &policy), ("title", &escaped.finish()), ("body", &body.finish())]))
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
    let front = evenly(&all, TIMELINES);
    let worst = summary.requirements.iter().filter_map(|requirement| requirement.worst.as_ref());
    let worst = worst.filter_map(|worst| rows.iter().find(|row| format!("T{}", row.number) == worst.test));
    let failed =
        rows.iter().filter(|row| matches!(row.outcome, Outcome::Crash { .. } | Outcome::Timeout { .. })).take(4);
    let known = rows.iter().filter(|row| matches!(row.origin, Origin::Known(_))).take(8);
    let mut more: Vec<u32> = Vec::new();
    for row in worst.chain(failed).chain(known) {
        if !front.contains(&row.number) && !more.contains(&row.number) {
            more.push(row.number);
        }
    }
    let front_caption = if front.len() < all.len() {
        format!("{} of the {} tests on the front, evenly chosen; use `show` for the others.", front.len(), all.len())
    } else {
        "Outlined: planned; filled: active. Red: outside the bound of a requirement.".to_owned()
    };
    let shrunk = summary.shrinking.as_ref().map_or_else(Vec::new, Shrinking::ends);
    more.retain(|number| !shrunk.contains(number));
    let shrunk_caption = "The test before and after it was shrunk.".to_owned();
    vec![
        Group { title: "Before and after", caption: shrunk_caption, tests: shrunk },
        Group {
            title: "Reference run",
            caption: "The run without disturbance, for comparison.".to_owned(),
            tests: reference,
        },
        Group { title: "Tests on the front", caption: front_caption, tests: front },
        Group {
            title: "More tests to look at",
            caption: "The worst violation of each requirement, crashes and timeouts, and regression tests.".to_owned(),
            tests: more,
        },
    ]
}

fn header(body: &mut Markup, repository: &Repository, summary: &Summary, digest: &str) -> Result<(), RecordError> {
    let facts = repository.campaign();
    let plan = &facts.plan;
    let sessions = repository.sessions()?;
    body.open("header", &[]);
    body.element("p", &[("class", "kicker")], &plan.space);
    body.element("h1", &[], &plan.campaign.name);
    for doc in [&plan.campaign.doc, &plan.doc] {
        if !doc.is_empty() {
            body.element("p", &[("class", "doc")], doc);
        }
    }
    body.element("p", &[("class", "headline")], &format!("{}.", headline(summary)));
    body.element("p", &[], &format!("{}.", counts_sentence(summary)));
    let budget = |what: &str| format!("{what}, {} evaluations", facts.task.evaluations(plan));
    let search = match (&facts.task, &plan.campaign.search) {
        (Task::Campaign, Search::Strategy { strategy, .. }) => budget(&strategy.title()),
        (Task::Known { tests }, _) => plural(tests.len(), "regression test", "regression tests"),
        (Task::Shrink(shrinking), _) => format!("{} at most", budget(&format!("{} shrunk", shrinking.name))),
        (Task::Campaign, Search::Repeat { .. }) | (Task::Repeat { .. }, _) => {
            let repeated = facts.task.repeated(plan);
            repeated.map_or_else(String::new, |it| format!("{} repeated {} times", it.name, it.times))
        }
    };
    let search = match plan.campaign.coverage.as_ref().and_then(|goal| goal.stop_at) {
        Some(share) => format!("{search} at most, until {} % of the cells are covered", number::number(100.0 * share)),
        None => search,
    };
    let wall: f64 = sessions.iter().filter_map(|session| Some(session.ended_at? - session.started_at)).sum();
    let workers = sessions.last().map_or(0, |session| session.workers);
    let workers = plural(usize::try_from(workers).unwrap_or(usize::MAX), "worker", "workers");
    let rows = [
        ("Search", search),
        ("Seed", facts.seed.to_string()),
        ("One test", format!("{} of simulation", number::quantity(plan.campaign.end_after, Some("s")))),
        ("Took", format!("{} s on {workers}", number::fixed(wall, 1))),
        ("Made by", format!("{}, sesame-runtime {}", plan.generator, facts.runtime)),
        ("Source", plan.source.clone()),
        ("Ended", facts.stop.clone().unwrap_or_else(|| "unfinished".to_owned())),
        ("Digest", digest.to_owned()),
    ];
    body.open("dl", &[]);
    for (name, value) in &rows {
        body.open("div", &[("class", if *name == "Digest" { "digest" } else { "fact" })]);
        body.element("dt", &[], name);
        body.element("dd", &[], value);
        body.close();
    }
    body.close();
    for warning in &summary.warnings {
        body.element("p", &[("class", "warning")], &format!("Warning: {warning}"));
    }
    body.close();
    Ok(())
}

fn requirements(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    if summary.requirements.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.element("h2", &[], "Requirements");
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    let mut titles =
        vec!["", "Requirement", "Tests", "Violated", "Satisfied", "Inconclusive", "Bound", "Reference run", "Worst"];
    let again = !summary.confirmed.is_empty();
    titles.extend(again.then_some("Run again"));
    heading_row(body, &titles, 3..6);
    body.open("tbody", &[]);
    for requirement in &summary.requirements {
        body.open("tr", &[]);
        body.element("th", &[("scope", "row")], &requirement.requirement);
        body.element("td", &[("class", "sentence")], &requirement.text);
        body.open("td", &[]);
        verdict_bar(body, requirement);
        body.close();
        let broken = if requirement.violated > 0 { "number bad" } else { "number" };
        body.element("td", &[("class", broken)], &requirement.violated.to_string());
        body.element("td", &[("class", "number")], &requirement.satisfied.to_string());
        body.element("td", &[("class", "number")], &requirement.inconclusive.to_string());
        body.element("td", &[("class", "keep")], &format!("{} {}", requirement.metric, requirement.bound));
        let reference = if requirement.reference == Some(Verdict::Violated) { "bad" } else { "quiet" };
        body.element("td", &[("class", reference)], requirement.reference.map_or("–", Verdict::word));
        body.open("td", &[("class", "keep")]);
        match &requirement.worst {
            Some(worst) => {
                test_link(body, &worst.test, drawn);
                body.text(&format!(" {}", worst.text));
            }
            None => body.text("–"),
        }
        body.close();
        if again {
            body.element("td", &[("class", "words")], &requirement.standings());
        }
        body.close();
    }
    body.close();
    body.close();
    body.close();
    if let Some(sentence) = once_sentence(summary.once, again || summary.confirmation.is_some()) {
        body.element("p", &[("class", "quiet")], &format!("{sentence}."));
    }
    body.close();
}

/// The shares of tests that violate a requirement, that satisfy it, and that are inconclusive.
fn verdict_bar(body: &mut Markup, requirement: &RequirementSummary) {
    let total = (requirement.violated + requirement.satisfied + requirement.inconclusive).max(1) as f64;
    let label = format!(
        "{} violated, {} satisfied, {} inconclusive",
        requirement.violated, requirement.satisfied, requirement.inconclusive
    );
    body.open("svg", &[("class", "bar"), ("viewBox", "0 0 100 10"), ("role", "img"), ("aria-label", &label)]);
    let mut left = 0.0;
    for (count, class) in [
        (requirement.violated, "violated"),
        (requirement.satisfied, "satisfied"),
        (requirement.inconclusive, "inconclusive"),
    ] {
        let width = 100.0 * count as f64 / total;
        let (x, width_text) = (coordinate(left), coordinate(width));
        body.leaf("rect", &[("class", class), ("x", &x), ("y", "0"), ("width", &width_text), ("height", "10")]);
        left += width;
    }
    body.close();
}

fn front(body: &mut Markup, repository: &Repository, summary: &Summary, rows: &[TestRow], drawn: &[u32]) {
    // Tests of a shrink differ in a step or two from each other, so how far metrics went means nothing.
    if summary.shrinking.is_some() {
        return;
    }
    body.open("section", &[("id", "front")]);
    if summary.objectives.is_empty() {
        body.element("h2", &[], "Values");
        spreads(body, summary);
        body.close();
        return;
    }
    body.element("h2", &[], "Front");
    let plan = repository.plan();
    let objectives = &summary.objectives;
    let pairs: Vec<(usize, usize)> = (0..objectives.len()).flat_map(|y| (0..y).map(move |x| (x, y))).take(10).collect();
    if objectives.len() == 1 {
        let x = Dimension { title: "test".to_owned(), direction: None };
        let points =
            points(plan, summary, rows, drawn, |row| Some((f64::from(row.number), shown_value(summary, row, 0)?)));
        scatter(body, &x, &dimension(&objectives[0]), &points, Detail { named: true, points: 2500 });
    }
    let detail = Detail { named: pairs.len() == 1, points: 2500 / pairs.len().max(1) };
    body.open("div", &[("class", if pairs.len() > 1 { "charts" } else { "charts one" })]);
    for (x, y) in pairs {
        let value = |row: &TestRow, at: usize| shown_value(summary, row, at);
        let points = points(plan, summary, rows, drawn, |row| Some((value(row, x)?, value(row, y)?)));
        scatter(body, &dimension(&objectives[x]), &dimension(&objectives[y]), &points, detail);
    }
    body.close();
    body.element("p", &[("class", "quiet")], &caption(summary, repository));
    front_table(body, summary, drawn);
    body.close();
}

/// The value of an objective by which a test is judged: that of its repetitions where the campaign confirmed it.
pub(crate) fn shown_value(summary: &Summary, row: &TestRow, objective: usize) -> Option<f64> {
    let repeated = summary.confirmed.iter().find(|test| test.number == row.number);
    match repeated.and_then(|test| test.values.as_ref()) {
        Some(values) => values.get(objective).copied(),
        None => row.value(summary.objectives[objective].id).value,
    }
}

fn points(
    plan: &CampaignPlan,
    summary: &Summary,
    rows: &[TestRow],
    drawn: &[u32],
    place: impl Fn(&TestRow) -> Option<(f64, f64)>,
) -> Vec<Point> {
    let front: BTreeSet<u32> = summary.front.iter().map(|test| test.number).collect();
    let measured =
        |row: &&TestRow| matches!(row.outcome, Outcome::Completed | Outcome::Unknown) && row.duplicate_of.is_none();
    rows.iter()
        .filter(measured)
        .filter_map(|row| {
            let (x, y) = place(row)?;
            let kind = if front.contains(&row.number) {
                Kind::Front
            } else if row.origin == Origin::Reference {
                Kind::Reference
            } else {
                Kind::Plain
            };
            Some(Point {
                x,
                y,
                kind,
                test: format!("T{}", row.number),
                title: dot_title(plan, summary, row),
                linked: drawn.contains(&row.number),
            })
        })
        .collect()
}

/// The tooltip of a dot: the test, its operations, and the values of its objectives.
pub(crate) fn dot_title(plan: &CampaignPlan, summary: &Summary, row: &TestRow) -> String {
    let values = summary.objectives.iter().enumerate().map(|(at, objective)| {
        let value = shown_value(summary, row, at).map_or("–".to_owned(), number::number);
        format!("{} {}", objective.metric, with_unit(value, objective.unit.as_deref()))
    });
    let values = values.collect::<Vec<String>>().join(", ");
    match row.origin {
        Origin::Reference => format!("reference run: {values}"),
        Origin::Known(_) | Origin::Search => format!("T{} ({}): {values}", row.number, operations(plan, row)),
    }
}

fn caption(summary: &Summary, repository: &Repository) -> String {
    let counts = &summary.counts;
    let mut hidden = Vec::new();
    for (count, word) in [
        (counts.no_effect, "with no effect"),
        (counts.unmeasured, "unmeasured"),
        (counts.crashes, "crashed"),
        (counts.timeouts, "timed out"),
        (counts.duplicates, if counts.duplicates == 1 { "duplicate" } else { "duplicates" }),
    ] {
        if count > 0 {
            hidden.push(format!("{count} {word}"));
        }
    }
    let mut caption =
        "Each dot is a test; emphasised: no other test is better in one objective without being worse in another. \
         The ring is the reference run. Point at a dot to see its operations and values. Click a dot to see its timeline, \
         if it is on this page; use `show` for other tests."
            .to_owned();
    if let Some(confirmation) = summary.confirmation {
        let _ = write!(
            caption,
            " {} Tests that never came near the front are shown with the values of their only run.",
            values_sentence(confirmation)
        );
    }
    if !hidden.is_empty() {
        let _ = write!(caption, " Not shown: {}.", number::join_words(&hidden));
    }
    if repository.campaign().stop.is_none() {
        caption.push_str(" The run is unfinished: this is the front so far.");
    }
    caption
}

fn front_table(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    let columns = objective_columns(summary);
    let mut titles = vec!["Test"];
    titles.extend(summary.objectives.iter().map(|objective| objective.metric.as_str()));
    titles.push("Violates");
    let again = confirmed_column(summary);
    titles.extend(again.is_some().then_some("Confirmed"));
    let stacked = stacked_column(summary);
    titles.extend(stacked.is_some().then_some("At once"));
    titles.push("Operations");
    heading_row(body, &titles, 1..1 + columns.len());
    body.open("tbody", &[]);
    for (at, test) in summary.front.iter().enumerate() {
        body.open("tr", &[]);
        body.open("th", &[("scope", "row")]);
        test_link(body, &test.test, drawn);
        body.close();
        for column in &columns {
            body.element("td", &[("class", "number")], &column[at]);
        }
        body.element("td", &[("class", "bad keep")], &test.violates.join(" "));
        if let Some(column) = &again {
            body.element("td", &[("class", "keep")], &column[at]);
        }
        if let Some(column) = &stacked {
            body.element("td", &[("class", "sentence")], &column[at]);
        }
        body.element("td", &[("class", "sentence")], &test.operations);
        body.close();
    }
    body.close();
    body.close();
    body.close();
    if let Some(sentence) = confirmation_sentence(&summary.confirmed) {
        let sentence =
            format!("{sentence}. In brackets the 95 % Wilson interval of the probability that a run shows it again.");
        body.element("p", &[("class", "quiet")], &sentence);
    }
}

fn spreads(body: &mut Markup, summary: &Summary) {
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, &["Metric", "Unit", "Tests", "Least", "Median", "Most"], 2..6);
    body.open("tbody", &[]);
    for spread in &summary.spreads {
        let decimals = number::decimals([spread.min, spread.median, spread.max]);
        body.open("tr", &[]);
        body.element("th", &[("scope", "row")], &spread.metric);
        body.element("td", &[], spread.unit.as_deref().unwrap_or_default());
        body.element("td", &[("class", "number")], &spread.count.to_string());
        for value in [spread.min, spread.median, spread.max] {
            body.element("td", &[("class", "number")], &number::fixed(value, decimals));
        }
        body.close();
    }
    body.close();
    body.close();
    body.close();
}

fn repetition(body: &mut Markup, summary: &Summary) {
    let Some(repetition) = summary.repetition.as_ref().filter(|repetition| !repetition.requirements.is_empty()) else {
        return;
    };
    body.open("section", &[]);
    body.element("h2", &[], &format!("{} repeated", repetition.test));
    body.element("p", &[("class", "quiet")], "How often each requirement was violated, with the 95 % Wilson interval.");
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, &["Requirement", "Violated", "Sentence"], 0..0);
    body.open("tbody", &[]);
    for requirement in &repetition.requirements {
        body.open("tr", &[]);
        body.element("th", &[("scope", "row")], &requirement.requirement);
        let class = if requirement.violated > 0 { "bad" } else { "words" };
        body.element("td", &[("class", class)], &rate_text(requirement));
        body.element("td", &[("class", "sentence")], &requirement.text);
        body.close();
    }
    body.close();
    body.close();
    body.close();
    body.close();
}

fn expectations(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    if summary.expectations.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.element("h2", &[], "Regression tests");
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, &["Regression test", "Test", "Metric", "Value", "Expected", "As expected"], 3..4);
    body.open("tbody", &[]);
    for expectation in &summary.expectations {
        body.open("tr", &[]);
        body.element("th", &[("scope", "row")], &expectation.known_test);
        body.open("td", &[]);
        test_link(body, &expectation.test, drawn);
        body.close();
        body.element("td", &[], &expectation.metric);
        body.element("td", &[("class", "number")], &expectation_value(expectation));
        body.element("td", &[], &expectation.bound);
        let class = if expectation.verdict == Verdict::Satisfied { "words" } else { "bad" };
        body.element("td", &[("class", class)], came_out(expectation.verdict));
        body.close();
    }
    body.close();
    body.close();
    body.close();
    body.close();
}

fn failures(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    if summary.failures.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.element("h2", &[], "Crashes and timeouts");
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    let mut titles = vec!["Test", "Outcome", "At", "Cause"];
    let again = summary.failures.iter().any(|failure| failure.again.is_some());
    titles.extend(again.then_some("Seen again"));
    heading_row(body, &titles, 2..3);
    body.open("tbody", &[]);
    for failure in summary.failures.iter().take(50) {
        body.open("tr", &[]);
        body.open("th", &[("scope", "row")]);
        test_link(body, &failure.test, drawn);
        body.close();
        body.element("td", &[("class", "bad")], &failure.outcome);
        body.element("td", &[("class", "number")], &number::quantity(failure.at, Some("s")));
        body.element("td", &[("class", "sentence")], &failure.detail);
        if again {
            body.element("td", &[("class", "words")], &failure.again_words());
        }
        body.close();
    }
    body.close();
    body.close();
    body.close();
    if summary.failures.len() > 50 {
        body.element(
            "p",
            &[("class", "quiet")],
            &format!("And {} more; `list` shows all.", summary.failures.len() - 50),
        );
    }
    body.close();
}

fn not_finite(body: &mut Markup, summary: &Summary, drawn: &[u32]) {
    if summary.not_finite.is_empty() {
        return;
    }
    body.open("section", &[]);
    body.element("h2", &[], "Numbers that are not finite");
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, &["Test", "At", "Read by"], 1..2);
    body.open("tbody", &[]);
    for found in summary.not_finite.iter().take(50) {
        body.open("tr", &[]);
        body.open("th", &[("scope", "row")]);
        test_link(body, &found.test, drawn);
        body.close();
        body.element("td", &[("class", "number")], &number::quantity(found.at, Some("s")));
        body.element("td", &[("class", "sentence")], &found.metrics.join(", "));
        body.close();
    }
    body.close();
    body.close();
    body.close();
    if summary.not_finite.len() > 50 {
        let more = format!("And {} more.", summary.not_finite.len() - 50);
        body.element("p", &[("class", "quiet")], &more);
    }
    body.close();
}

fn test_heading(body: &mut Markup, summary: &Summary, report: &TestReport) {
    body.open("h3", &[]);
    body.text(&report.test);
    if report.origin != "search" {
        body.element("span", &[("class", "quiet")], &format!(" {}", report.origin));
    }
    for requirement in report.requirements.iter().filter(|requirement| requirement.verdict == Verdict::Violated) {
        body.element("span", &[("class", "chip"), ("title", &requirement.text)], &requirement.requirement);
    }
    body.close();
    let values: Vec<String> = summary
        .objectives
        .iter()
        .filter_map(|objective| {
            let metric = report.metrics.iter().find(|metric| metric.metric == objective.metric)?;
            let shown = MetricValue::whole(metric.value, metric.set);
            Some(format!("{} {}", metric.metric, value_text(shown, metric.unit.as_deref())))
        })
        .collect();
    body.element("p", &[("class", "values")], &values.join(" · "));
}

/// Everything on a test as tables, folded away.
fn figures(body: &mut Markup, report: &TestReport) {
    body.open("details", &[]);
    body.element("summary", &[], "Figures");
    body.element(
        "p",
        &[("class", "quiet")],
        &format!("{}. Simulator seed {}.", outcome_sentence(report), report.simulator_seed),
    );
    if !report.operations.is_empty() {
        table(body, &["Operation", "Kind", "Topic", "Choices", "Planned", "Observed", "Effect"], |body| {
            for operation in &report.operations {
                let observed = operation.observed.as_deref().map_or("unknown".to_owned(), spans_text);
                let cells = [
                    operation.kind.clone(),
                    operation.topic.clone().unwrap_or_default(),
                    choices_text(operation),
                    planned_text(operation),
                    observed,
                    effect_text(operation),
                ];
                row(body, &operation.operation, &cells);
            }
        });
    }
    for stacked in &report.stacked {
        body.element("p", &[("class", "quiet")], &stacked.words());
    }
    table(body, &["Metric", "Value", "Changes"], |body| {
        for metric in &report.metrics {
            let shown = MetricValue::whole(metric.value, metric.set);
            row(body, &metric.metric, &[value_text(shown, metric.unit.as_deref()), metric.changes.to_string()]);
        }
    });
    if !report.requirements.is_empty() {
        let again = report.requirements.iter().any(|requirement| requirement.fresh.is_some());
        let titles: &[&str] = if again {
            &["Requirement", "Verdict", "Bound", "Violated in fresh runs", "In the first run", "Value", "Outside"]
        } else {
            &["Requirement", "Verdict", "Bound", "Value", "Outside"]
        };
        table(body, titles, |body| {
            for requirement in &report.requirements {
                let mut cells = vec![
                    requirement.verdict.word().to_owned(),
                    format!("{} {}", requirement.metric, requirement.bound),
                ];
                if let Some(fresh) = &requirement.fresh {
                    cells.extend([tally_words(fresh.tally), requirement.first.word().to_owned()]);
                }
                cells.extend([requirement.value.clone(), spans_text(&requirement.outside)]);
                row(body, &requirement.requirement, &cells);
            }
        });
    }
    for warning in &report.warnings {
        body.element("p", &[("class", "warning")], &format!("Warning: {warning}"));
    }
    body.close();
}

/// A link to a trace, for tools that read MCAP.
fn trace_link(body: &mut Markup, file: &Path) {
    body.open("p", &[("class", "quiet")]);
    body.element("a", &[("href", &file.display().to_string())], "Trace (MCAP)");
    body.close();
}

fn table(body: &mut Markup, titles: &[&str], rows: impl FnOnce(&mut Markup)) {
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    heading_row(body, titles, 0..0);
    body.open("tbody", &[]);
    rows(body);
    body.close();
    body.close();
    body.close();
}

fn row(body: &mut Markup, name: &str, cells: &[String]) {
    body.open("tr", &[]);
    body.element("th", &[("scope", "row")], name);
    for cell in cells {
        body.element("td", &[], cell);
    }
    body.close();
}

/// A heading per column; those of columns of numbers stand to the right, as the numbers do.
pub(super) fn heading_row(body: &mut Markup, titles: &[&str], numbers: std::ops::Range<usize>) {
    body.open("thead", &[]);
    body.open("tr", &[]);
    for (column, title) in titles.iter().enumerate() {
        let class = if numbers.contains(&column) { "number" } else { "words" };
        body.element("th", &[("scope", "col"), ("class", class)], title);
    }
    body.close();
    body.close();
}

pub(super) fn test_link(body: &mut Markup, test: &str, drawn: &[u32]) {
    if drawn.iter().any(|number| format!("T{number}") == test) {
        let link = format!("#{test}");
        body.element("a", &[("href", &link)], test);
    } else {
        body.text(test);
    }
}
