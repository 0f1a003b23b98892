//! The page of preparatory testing: one file that needs nothing but itself.

use sesame_base::gathered::gathered;
use sesame_plan::CampaignPlan;
use sesame_present::markup::{Markup, fill};
use sesame_present::number::plural;
use sesame_present::table::Table;
use sesame_record::{RecordError, Repository};

use crate::html::policy;
use crate::monitors::{conclusion, decisions, disagreements, tolerances};
use crate::preparation::known::KnownTesting;
use crate::preparation::mitm::MitmTesting;
use crate::preparation::monitors::{MonitorTest, MonitorTesting};
use crate::preparation::null::NullTesting;
use crate::preparation::text::{about_latency, about_stages, unequal_runs};
use crate::preparation::{Preparation, tables};
use crate::study::figure;
use crate::study::provenance::provenance;

/// The results that a preparation is made of, each with what it is called in the table of origins.
pub type Files<'a> = [(&'a str, &'a Repository)];

/// The page, from what was found and the results it was found in.
pub fn page(plan: &CampaignPlan, preparation: &Preparation, files: &Files<'_>) -> Result<String, RecordError> {
    let mut body = Markup::default();
    header(&mut body, plan, preparation);
    body.open("main", &[]);
    if let Some(testing) = &preparation.null {
        null(&mut body, testing);
    }
    if let Some(testing) = &preparation.mitm {
        mitm(&mut body, testing);
    }
    if let Some(testing) = &preparation.known {
        known(&mut body, testing);
    }
    if let Some(testing) = &preparation.monitors {
        monitors(&mut body, testing);
    }
    body.open("section", &[("id", "provenance")]);
    body.element("h2", &[], "Where this comes from");
    provenance(&mut body, files)?;
    body.close();
    body.close();
    let mut title = Markup::default();
    title.text(&format!("Preparation of {}", plan.campaign.name));
    let shell = sesame_templates::report::study(figure::style());
    let policy = policy(&shell);
    Ok(fill(&shell, &[("policy", &policy), ("title", &title.finish()), ("body", &body.finish())]))
}

fn header(body: &mut Markup, plan: &CampaignPlan, preparation: &Preparation) {
    body.open("header", &[]);
    body.element("p", &[("class", "kicker")], &format!("{} · campaign {}", plan.space, plan.campaign.name));
    body.element("h1", &[], "Preparatory testing");
    let objections = preparation.objections();
    let headline = match objections.len() {
        0 => match preparation.unsatisfied() {
            open if open.is_empty() => "Everything is as required.".to_owned(),
            open => format!("Everything is as expected. Not satisfied: {}.", open.join(", ")),
        },
        count => format!("{} not as required.", plural(count, "thing is", "things are")),
    };
    body.element("p", &[("class", "headline")], &headline);
    if !objections.is_empty() {
        body.open("ul", &[("id", "objections")]);
        for objection in gathered(objections) {
            body.open("li", &[]);
            body.prose(&objection);
            body.close();
        }
        body.close();
    }
    for left_out in gathered(&preparation.left_out) {
        said(body, &left_out);
    }
    body.close();
}

fn null(body: &mut Markup, testing: &NullTesting) {
    let lab = testing.lab.as_deref();
    section(body, "null", "Without disturbance", &testing.objections);
    let sides = match lab {
        Some(lab) => format!("{} in simulation and as many in lab {lab}", plural(testing.runs, "run", "runs")),
        None => format!("{} in simulation; no lab", plural(testing.runs, "run", "runs")),
    };
    said(body, &format!("{sides}. Nothing is disturbed, and no topic is relayed."));
    part(body, "Requirements", &tables::requirements(lab, &testing.requirements));
    part(body, "Metrics", &tables::metrics(lab, &testing.metrics));
    if lab.is_some() {
        said(body, "Differences are the lab's mean minus the simulation's.");
    }
    details(body, "Runs and ranges", &tables::ranges(lab, &testing.metrics));
    if !testing.figures.is_empty() {
        body.element("h3", &[], "In the course of the runs");
        said(body, if lab.is_some() { "Black: simulation; orange: lab." } else { "Runs of the simulation." });
        body.open("div", &[("class", "drawings")]);
        for figure in &testing.figures {
            figure.show(body);
        }
        body.close();
    }
    body.close();
}

fn mitm(body: &mut Markup, testing: &MitmTesting) {
    section(body, "mitm", "Topics through the relay", &testing.objections);
    said(body, &about_latency(testing));
    if let Some(sentence) = about_stages(testing) {
        said(body, sentence);
    }
    part(body, "Stages", &tables::stages(testing));
    for difference in gathered(unequal_runs(testing)) {
        said(body, &difference);
    }
    part(body, "Added by the relay", &tables::added(testing));
    part(body, "Drift of metrics", &tables::drifts(testing));
    said(
        body,
        "Drift is the mean minus that of the runs in which nothing was relayed; beside it is how far these are apart.",
    );
    body.close();
}

fn known(body: &mut Markup, testing: &KnownTesting) {
    section(body, "known", "Regression tests", &testing.objections);
    part(body, "Expectations", &tables::expectations(testing));
    if testing.lab.is_some() {
        part(body, "Requirements", &tables::known_requirements(testing));
    }
    details(body, "Metrics", &tables::known_metrics(testing));
    body.close();
}

fn monitors(body: &mut Markup, testing: &MonitorTesting) {
    section(body, "monitors", "Decisions of monitors", &testing.objections);
    said(
        body,
        &format!("The first recording of each test is that of the simulation, the second that of lab {}.", testing.lab),
    );
    for MonitorTest { test, compared } in &testing.tests {
        part(body, test, &decisions(compared));
        said(body, &conclusion(compared));
        details(body, "Different states", &disagreements(compared));
        details(body, "Delay tolerance", &tolerances(compared));
    }
    body.close();
}

/// Opens a section with its heading, and says what is not as required in it.
fn section(body: &mut Markup, id: &str, title: &str, objections: &[String]) {
    body.open("section", &[("id", id)]);
    body.element("h2", &[], title);
    body.element("p", &[("class", "headline")], if objections.is_empty() { "Passed." } else { "Failed." });
}

fn said(body: &mut Markup, sentence: &str) {
    body.open("p", &[("class", "quiet")]);
    body.prose(sentence);
    body.close();
}

fn part(body: &mut Markup, title: &str, table: &Table) {
    if !table.is_empty() {
        body.element("h3", &[], title);
        table.html(body, &[]);
    }
}

fn details(body: &mut Markup, title: &str, table: &Table) {
    if !table.is_empty() {
        body.open("details", &[]);
        body.element("summary", &[], title);
        table.html(body, &[]);
        body.close();
    }
}
