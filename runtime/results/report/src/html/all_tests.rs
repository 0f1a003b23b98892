//! All tests as data for the page's script: the table of tests, the parallel coordinates, and what links them with the
//! charts.
//!
//! The data is one block of JSON, by columns, so that ten thousand tests take about a megabyte; the script makes rows
//! and lines from it when they are looked at.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use sesame_plan::{CampaignPlan, Dimension, Direction, MetricId};
use sesame_present::chart::evenly;
use sesame_present::markup::Markup;
use sesame_present::number;
use sesame_record::{Judge, Origin, RecordError, Repository, TestRow, Verdict, not_imported};
use sesame_search::sspr::Convention;

use crate::facts::summary::{Summary, shown_value};
use crate::facts::wording::outcome_words;
use crate::html::command;
use crate::html::legend::legend;

/// The most tests that the page holds data of.
const MOST: usize = 20_000;

/// The section with the table of all tests.
pub(super) fn all_tests(
    body: &mut Markup,
    repository: &Repository,
    summary: &Summary,
    rows: &[TestRow],
    drawn: &[u32],
) -> Result<(), RecordError> {
    if rows.is_empty() {
        return Ok(());
    }
    let judge = repository.judge()?;
    let violated = |row: &TestRow| -> Vec<usize> {
        let requirements = repository.plan().requirements.iter().enumerate();
        requirements
            .filter(|(_, requirement)| judge.verdict(row, requirement) == Verdict::Violated)
            .map(|(at, _)| at)
            .collect()
    };
    let shown = chosen(summary, &judge, repository.plan(), rows, drawn, MOST);
    let data = data(repository, summary, &shown, drawn, violated)?;
    body.open("section", &[("id", "tests")]);
    body.heading("All tests");
    if shown.len() < rows.len() {
        let words = format!(
            "{} of {} tests: the front, the tests with a timeline, and evenly chosen others, half of which violate a \
             requirement or broke off if there are so many.",
            shown.len(),
            rows.len()
        );
        body.element("p", &[("class", "quiet")], &words);
    }
    body.open("noscript", &[]);
    body.open("p", &[]);
    body.text("This table needs JavaScript. In a terminal, ");
    body.element("code", &[], &command::list(repository.plan(), repository.folder()));
    body.text(" lists all tests.");
    body.close();
    body.close();
    // The script puts the table here, and the parallel coordinates below it.
    body.element("div", &[("id", "table-of-tests")], "");
    body.element("div", &[("id", "parallel-coordinates")], "");
    let used = dimensions(&data);
    if !used.is_empty() {
        legend(body, &used);
    }
    body.json("all-tests", &data);
    body.close();
    Ok(())
}

/// The tests that the page has data of: all, or at most so many: the front, those that are drawn, and evenly chosen
/// others, half of them such that matter if there are so many.
fn chosen<'r>(
    summary: &Summary,
    judge: &Judge<'_>,
    plan: &CampaignPlan,
    rows: &'r [TestRow],
    drawn: &[u32],
    most: usize,
) -> Vec<&'r TestRow> {
    if rows.len() <= most {
        return rows.iter().collect();
    }
    let front: BTreeSet<u32> = summary.front.iter().map(|test| test.number).collect();
    let always =
        |row: &&TestRow| front.contains(&row.number) || drawn.contains(&row.number) || row.origin != Origin::Search;
    let matters = |row: &&TestRow| {
        !row.outcome.is_whole()
            || plan.requirements.iter().any(|requirement| judge.verdict(row, requirement) == Verdict::Violated)
    };
    let (always, rest): (Vec<&TestRow>, Vec<&TestRow>) = rows.iter().partition(always);
    let (first, others): (Vec<&TestRow>, Vec<&TestRow>) = rest.into_iter().partition(matters);
    let always = evenly(&always, most);
    let room = most - always.len();
    let first = evenly(&first, (room / 2).max(room.saturating_sub(others.len())));
    let mut kept = [evenly(&others, room - first.len()), first, always].concat();
    kept.sort_unstable_by_key(|row| row.number);
    kept
}

fn data(
    repository: &Repository,
    summary: &Summary,
    rows: &[&TestRow],
    drawn: &[u32],
    violated: impl Fn(&TestRow) -> Vec<usize>,
) -> Result<Value, RecordError> {
    let plan = repository.plan();
    let front: BTreeSet<u32> = summary.front.iter().map(|test| test.number).collect();
    let objectives = summary.objectives.iter().map(|objective| objective.id);
    let others = (0u32..).take(plan.metrics.len()).map(MetricId).filter(|id| !plan.campaign.objectives.contains(id));
    let metrics: Vec<MetricId> = objectives.chain(others).collect();
    let value = |row: &TestRow, at: usize| match summary.objectives.get(at) {
        Some(_) => shown_value(summary, row, at),
        None => row.value(metrics[at]).value,
    };
    let column = |at: usize| Value::Array(rows.iter().map(|row| rounded(value(row, at))).collect());
    let metric = |(at, id): (usize, &MetricId)| {
        let metric = plan.metric(*id);
        json!({
            "name": metric.name,
            "unit": metric.unit,
            "objective": at < summary.objectives.len(),
            "maximise": metric.direction == Some(Direction::Maximise),
            "bounded": plan.requirements.iter().any(|requirement| requirement.metric == *id),
            "values": column(at),
        })
    };
    let requirement = |requirement: &sesame_plan::Requirement| {
        let metric = plan.metric(requirement.metric);
        let bound = number::bound(requirement.bound, metric.unit.as_deref());
        json!({"name": requirement.name, "text": requirement.text, "bound": format!("{} {bound}", metric.name)})
    };
    let mut outcomes: Vec<String> = Vec::new();
    let of_outcomes: Vec<usize> = rows
        .iter()
        .map(|row| {
            let word =
                if row.duplicate_of.is_some() { "duplicate".to_owned() } else { outcome_words(row.outcome.word()) };
            outcomes.iter().position(|known| *known == word).unwrap_or_else(|| {
                outcomes.push(word);
                outcomes.len() - 1
            })
        })
        .collect();
    let used = |row: &&TestRow| row.test.operations.iter().map(|used| used.operation.0).collect::<Vec<u32>>();
    let (before, after) = command::show(plan, repository.folder());
    let mut data = json!({
        "numbers": rows.iter().map(|row| row.number).collect::<Vec<_>>(),
        "generations": rows.iter().map(|row| row.generation).collect::<Vec<_>>(),
        "outcomes": outcomes,
        "outcome": of_outcomes,
        "front": front,
        "drawn": drawn,
        "metrics": metrics.iter().enumerate().map(metric).collect::<Vec<_>>(),
        "requirements": plan.requirements.iter().map(requirement).collect::<Vec<_>>(),
        "violates": rows.iter().map(|row| violated(row)).collect::<Vec<_>>(),
        "operations": plan.operations.iter().map(|operation| &operation.name).collect::<Vec<_>>(),
        "uses": rows.iter().map(used).collect::<Vec<_>>(),
        "points": points(repository, rows)?,
        "command": [before, after],
    });
    if rows.iter().any(|row| row.left_out > 0) {
        data["not_imported"] = rows.iter().map(|row| not_imported(row.left_out)).collect();
    }
    Ok(data)
}

/// Per dimension of the reduced space its name and the coordinate of each of these tests; only dimensions in which
/// tests differ.
fn points(repository: &Repository, rows: &[&TestRow]) -> Result<Vec<Value>, RecordError> {
    let plan = repository.plan();
    let mut found = BTreeMap::new();
    if repository.task().searches(plan) {
        repository.scan(&mut |test| {
            if let Some(point) = test.point(plan, Convention::Ours) {
                found.insert(test.number, Dimension::ALL.map(|dimension| point.get(dimension)));
            }
        })?;
    }
    let columns = Dimension::ALL.iter().enumerate().filter_map(|(at, dimension)| {
        let of = |row: &&TestRow| found.get(&row.number).and_then(|point| point[at]);
        let values: Vec<Option<f64>> = rows.iter().map(of).collect();
        let mut known = values.iter().flatten();
        let first = known.next()?;
        known.any(|other| other != first).then(|| {
            let values: Vec<Value> = values.into_iter().map(rounded).collect();
            json!({"name": dimension.name(), "values": values})
        })
    });
    Ok(columns.collect())
}

/// The dimensions that the data has.
fn dimensions(data: &Value) -> Vec<Dimension> {
    let names = data["points"].as_array().into_iter().flatten();
    names.filter_map(|column| Dimension::named(column["name"].as_str()?)).collect()
}

/// Nine digits, which is more than a table shows, so that its rounding is that of the rest of the page.
fn rounded(value: Option<f64>) -> Value {
    let value = value.filter(|value| value.is_finite()).map(|value| {
        let short: f64 = format!("{value:.8e}").parse().unwrap_or(value);
        short + 0.0
    });
    match value {
        // Whole numbers without `.0`.
        #[expect(clippy::cast_possible_truncation, reason = "a whole number of nine digits")]
        Some(value) if value.fract() == 0.0 && value.abs() < 1e9 => json!(value as i64),
        Some(value) => json!(value),
        None => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;
    use crate::facts::summary::summarise;

    fn with_tests<T>(count: u32, look: impl FnOnce(&Repository, &Summary, &[TestRow]) -> T) -> T {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), count);
        let rows = repository.tests().unwrap();
        let members = repository.latest_result_set().unwrap().unwrap().members;
        let summary = summarise(&repository, &rows, &members).unwrap();
        look(&repository, &summary, &rows)
    }

    #[test]
    fn of_very_many_tests_those_that_matter_are_kept() {
        with_tests(90, |repository, summary, rows| {
            let plan = repository.plan();
            let judge = repository.judge().unwrap();
            let of = |most| chosen(summary, &judge, plan, rows, &[1, 2], most);
            assert_eq!(of(rows.len()).len(), rows.len());
            let violating = |kept: &[&TestRow]| {
                let violates = |row: &&&TestRow| {
                    plan.requirements.iter().any(|requirement| judge.verdict(row, requirement) == Verdict::Violated)
                };
                kept.iter().filter(violates).count()
            };
            let kept = of(40);
            assert_eq!(kept.len(), 40);
            assert!(kept.is_sorted_by_key(|row| row.number));
            assert!([1, 2].iter().all(|drawn| kept.iter().any(|row| row.number == *drawn)));
            assert!(violating(&kept) >= 10 && violating(&kept) < 40, "{}", violating(&kept));
        });
    }

    #[test]
    fn a_test_takes_little_of_the_page() {
        with_tests(300, |repository, summary, rows| {
            let all: Vec<&TestRow> = rows.iter().collect();
            let data = data(repository, summary, &all, &[], |_| vec![0, 1]).unwrap();
            let each = data.to_string().len() / rows.len();
            assert!(each < 180, "{each} bytes");
            assert_eq!(data["numbers"].as_array().unwrap().len(), rows.len());
            for metric in data["metrics"].as_array().unwrap() {
                assert_eq!(metric["values"].as_array().unwrap().len(), rows.len());
            }
        });
    }

    #[test]
    fn numbers_have_nine_digits() {
        let short = |value| rounded(value).to_string();
        assert_eq!(
            [Some(1.0 / 3.0), Some(-0.0), Some(123_456.7), Some(70.0), Some(f64::NAN), None].map(short),
            ["0.333333333", "0", "123456.7", "70", "null", "null"]
        );
    }
}
