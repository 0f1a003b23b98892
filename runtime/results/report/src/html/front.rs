//! The front of a campaign as pictures and a table, or the ranges of metrics if there are no objectives.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_plan::CampaignPlan;
use sesame_present::markup::Markup;
use sesame_present::number;
use sesame_record::{Origin, Repository, TestRow};

use crate::facts::summary::{Summary, shown_value};
use crate::html::scatter::{Detail, Dimension, Kind, Point, dimension, dot_title, scatter};
use crate::sentences::{confirmation_sentence, values_sentence};
use crate::tables;

pub(super) fn front(body: &mut Markup, repository: &Repository, summary: &Summary, rows: &[TestRow], drawn: &[u32]) {
    // Tests of a shrink differ in a step or two from each other, so how far metrics went means nothing.
    if summary.shrunk().next().is_some() {
        return;
    }
    body.open("section", &[("id", "front")]);
    if summary.objectives.is_empty() {
        body.heading("Values");
        tables::spreads(&summary.spreads).html(body, drawn);
        body.close();
        return;
    }
    body.heading("Front");
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
    tables::front(summary).html(body, drawn);
    if let Some(sentence) = confirmation_sentence(&summary.confirmed) {
        let sentence =
            format!("{sentence}. In brackets the 95 % Wilson interval of the probability that a run shows it again.");
        body.element("p", &[("class", "quiet")], &sentence);
    }
    body.close();
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
                test: TestNumber(row.number),
                title: dot_title(plan, summary, row),
                linked: drawn.contains(&row.number),
            })
        })
        .collect()
}

fn caption(summary: &Summary, repository: &Repository) -> String {
    let counts = &summary.counts;
    let mut hidden = Vec::new();
    for (count, word) in [
        (counts.no_effect, "with no effect"),
        (counts.unmeasured, "unmeasured"),
        (counts.crashes, "crashed"),
        (counts.timeouts, "timed out"),
        (counts.environment, "broken off by the environment"),
        (counts.duplicates, if counts.duplicates == 1 { "duplicate" } else { "duplicates" }),
    ] {
        if count > 0 {
            hidden.push(format!("{count} {word}"));
        }
    }
    let mut caption =
        "Each dot is a test; emphasised: no other test is better in one objective without being worse in another. \
         The ring is the reference run. Point at a dot to see its operations and values. Click it to select the test \
         everywhere on this page."
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
