//! Preparatory testing as text for a terminal.

use sesame_base::gathered::gathered;
use sesame_present::number::plural;
use sesame_present::table::{Table, TextOptions, wrap};

use crate::monitors::{conclusion, decisions, tolerances};
use crate::preparation::mitm::MitmTesting;
use crate::preparation::{Preparation, tables};
use sesame_base::visible::visible;

/// What was found, step by step, and at the end what is not as required.
pub fn text(preparation: &Preparation, options: TextOptions) -> String {
    let mut text = String::new();
    let Preparation { null, mitm, known, monitors, left_out } = preparation;
    if let Some(null) = null {
        heading(&mut text, "Without disturbance", options);
        let lab = null.lab.as_deref();
        let on_sides =
            lab.map_or_else(String::new, |lab| format!(" in simulation, and as many in lab {}", visible(lab)));
        sentence(&mut text, &format!("{}{on_sides}", plural(null.runs, "run", "runs")), options);
        section(&mut text, "Requirements", &tables::requirements(lab, &null.requirements), options);
        section(&mut text, "Metrics", &tables::metrics(lab, &null.metrics), options);
    }
    if let Some(mitm) = mitm {
        heading(&mut text, "Topics through the relay", options);
        sentence(&mut text, &about_latency(mitm), options);
        if let Some(about) = about_stages(mitm) {
            sentence(&mut text, about, options);
        }
        section(&mut text, "Stages", &tables::stages(mitm), options);
        section(&mut text, "Added by the relay", &tables::added(mitm), options);
        section(&mut text, "Drift of metrics", &tables::drifts(mitm), options);
        for difference in gathered(unequal_runs(mitm)) {
            sentence(&mut text, &visible(&difference), options);
        }
    }
    if let Some(known) = known {
        heading(&mut text, "Regression tests", options);
        let lab = known.lab.as_deref();
        section(&mut text, "Expectations", &tables::expectations(known), options);
        if lab.is_some() {
            section(&mut text, "Requirements", &tables::known_requirements(known), options);
        }
        section(&mut text, "Metrics", &tables::known_metrics(known), options);
    }
    if let Some(monitors) = monitors {
        heading(&mut text, "Decisions of monitors", options);
        for test in &monitors.tests {
            section(&mut text, &visible(&test.test), &decisions(&test.compared), options);
            section(&mut text, "Delay tolerance", &tolerances(&test.compared), options);
            sentence(&mut text, &conclusion(&test.compared), options);
        }
    }
    text.push('\n');
    for left_out in gathered(left_out) {
        sentence(&mut text, &visible(&left_out), options);
    }
    for (step, passed) in preparation.steps() {
        sentence(&mut text, &format!("{step} {}", if passed { "passed" } else { "failed" }), options);
    }
    text
}

/// What the report says of latency as a whole.
pub(super) fn about_latency(mitm: &MitmTesting) -> String {
    let judged = mitm.budget.is_some_and(|budget| budget.latency.is_some() || budget.jitter.is_some());
    if mitm.lock_stepped {
        "The simulator is stepped: its time stands still while the relay works, so what the relay adds is neither \
         measured nor judged."
            .to_owned()
    } else if judged {
        "Times are wall time, from the arrival of a message until it is passed on.".to_owned()
    } else {
        "Times are wall time, from the arrival of a message until it is passed on. The system has no `relay budget`, so \
         they are not judged."
            .to_owned()
    }
}

/// What the report says of a simulator for which all stages are alike.
pub(super) fn about_stages(mitm: &MitmTesting) -> Option<&'static str> {
    const ALIKE: &str = "This simulator has no way for its messages but the runner, so a stage only says which topics are \
                         measured; of ROS 2 nodes, topics that are not relayed go past the relay.";
    (!mitm.bypass).then_some(ALIKE)
}

/// The stages whose runs are not equal, a sentence each.
pub(super) fn unequal_runs(mitm: &MitmTesting) -> Vec<String> {
    let unequal = mitm.stages.iter().filter_map(|stage| {
        let relayed = plural(stage.relayed, "topic", "topics");
        Some(format!("With {relayed} relayed, runs differ: {}.", stage.difference.as_ref()?))
    });
    unequal.collect()
}

fn heading(text: &mut String, title: &str, options: TextOptions) {
    if !text.is_empty() {
        text.push('\n');
    }
    text.push_str(&options.heading(title));
    text.push('\n');
}

fn sentence(text: &mut String, sentence: &str, options: TextOptions) {
    for line in wrap(sentence, options.width.map_or(usize::MAX, |width| width.saturating_sub(4).max(20))) {
        text.push_str("    ");
        text.push_str(&line);
        text.push('\n');
    }
}

fn section(text: &mut String, title: &str, table: &Table, options: TextOptions) {
    if !table.is_empty() {
        text.push('\n');
        text.push_str(&options.heading(title));
        text.push('\n');
        text.push_str(&table.text(options));
    }
}
