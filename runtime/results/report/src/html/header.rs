//! The head of the page, and how its results were made.

use sesame_base::gathered::gathered;
use sesame_plan::{Search, Task};
use sesame_present::markup::Markup;
use sesame_present::number::{self, plural};
use sesame_record::{RecordError, Repository};

use crate::facts::repetition::repeated_words;
use crate::facts::summary::Summary;
use crate::sentences::{counts_sentence, headline};

/// The head: the campaign, what was found in a sentence, and the warnings.
pub(super) fn header(body: &mut Markup, repository: &Repository, summary: &Summary) {
    let plan = repository.plan();
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
    for warning in gathered(&summary.warnings) {
        body.open("p", &[("class", "warning")]);
        body.prose(&format!("Warning: {warning}"));
        body.close();
    }
    body.close();
}

/// How the results were made.
pub(super) fn about(body: &mut Markup, repository: &Repository, digest: &str) -> Result<(), RecordError> {
    let facts = repository.campaign();
    let plan = &facts.plan;
    let sessions = repository.sessions()?;
    body.open("section", &[]);
    body.heading("About this run");
    let budget = |what: &str| format!("{what}, {} evaluations", facts.task.evaluations(plan));
    let search = match (&facts.task, &plan.campaign.search) {
        (Task::Campaign, Search::Strategy { strategy, .. }) => budget(&strategy.title()),
        (Task::Known { tests, lab }, _) => {
            let place = lab.as_ref().map_or_else(String::new, |lab| format!(" in lab {lab}"));
            format!("{}{place}", plural(tests.len(), "regression test", "regression tests"))
        }
        (Task::Undisturbed(task), _) => {
            let place = task.lab.as_ref().map_or_else(String::new, |lab| format!(" in lab {lab}"));
            let runs = plural(usize::try_from(task.runs).unwrap_or(usize::MAX), "run", "runs");
            let topics = plural(usize::try_from(task.relayed).unwrap_or(usize::MAX), "topic", "topics");
            format!("{runs} without disturbance{place}, {topics} relayed")
        }
        (Task::Shrink(shrinking), _) => format!("{} at most", budget(&format!("{} shrunk", shrinking.name))),
        (Task::ShrinkEach { each }, _) => {
            format!("{} at most", budget(&format!("{} shrunk", plural(each.len(), "cause", "causes"))))
        }
        (Task::Variations(variations), _) => {
            let count = plural(variations.tests.len(), "variation", "variations");
            format!("{count} of {} along {}", variations.name, variations.dimension.name())
        }
        (Task::Lab(lab) | Task::Compensated(lab), _) => {
            let each = if lab.repeats == 1 { String::new() } else { format!(", each {} times", lab.repeats) };
            let place = if facts.task.in_lab().is_some() { "in" } else { "simulated again for" };
            format!("{} {place} lab {}{each}", plural(lab.tests.len(), "test", "tests"), lab.lab)
        }
        (Task::Campaign, Search::Repeat { .. }) | (Task::Repeat { .. }, _) => {
            repeated_words(plan, &facts.task).unwrap_or_default()
        }
    };
    let search = match plan.campaign.coverage.as_ref().and_then(|goal| goal.stop_at) {
        Some(share) => format!("{search} at most, until {} % of the cells are covered", number::number(100.0 * share)),
        None => search,
    };
    let wall: f64 = sessions.iter().filter_map(|session| Some(session.ended_at? - session.started_at)).sum();
    let workers = sessions.last().map_or(0, |session| session.workers);
    let workers = plural(usize::try_from(workers).unwrap_or(usize::MAX), "worker", "workers");
    let mut rows = vec![
        ("Search", search),
        ("Seed", facts.seed.to_string()),
        ("One test", format!("{} of simulation", number::quantity(plan.campaign.end_after, Some("s")))),
        ("Took", format!("{} s on {workers}", number::fixed(wall, 1))),
        ("Made by", format!("{}, sesame-runtime {}", plan.generator, facts.runtime)),
        ("Source", plan.source.clone()),
        ("Ended", facts.stop.clone().unwrap_or_else(|| "unfinished".to_owned())),
    ];
    rows.extend(entered(repository)?);
    rows.push(("Digest", digest.to_owned()));
    let compensation = plan.compensation.as_ref();
    rows.extend(
        compensation.map(|compensation| ("Compensated", sesame_analysis::compensation::in_words(plan, compensation))),
    );
    body.open("dl", &[]);
    for (name, value) in &rows {
        body.open("div", &[("class", if *name == "Digest" { "digest" } else { "fact" })]);
        body.element("dt", &[], name);
        body.element("dd", &[], value);
        body.close();
    }
    body.close();
    body.close();
    Ok(())
}

/// Who made runs that were entered by hand, with what and when: each entry once.
fn entered(repository: &Repository) -> Result<Vec<(&'static str, String)>, RecordError> {
    let runs = repository.entered_runs()?;
    let rows = ["Operator", "Hardware", "Software", "Date"].into_iter().enumerate().map(|(at, name)| {
        let mut texts: Vec<&str> = Vec::new();
        for text in runs.iter().filter_map(|run| run.provenance.texts()[at]) {
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        (name, texts.join(", "))
    });
    Ok(rows.filter(|(_, texts)| !texts.is_empty()).collect())
}
