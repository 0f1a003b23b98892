//! What is found in runs that are made up, and how it is shown.

use std::path::Path;
use std::time::Duration;

use sesame_base::latency::Latencies;
use sesame_base::observation::{MetricObservation, Outcome};
use sesame_plan::testing::lab;
use sesame_plan::{
    Bound, CampaignPlan, Expectation, KnownTestId, Lab, LabTolerance, MetricId, RelayBudget, Task, Test, Transport,
    Undisturbed,
};
use sesame_present::table::TextOptions;
use sesame_record::{Origin, Recorder, Repository, TestRecord, sample};

use super::*;
use crate::monitors::tests::sample as compared_monitors;

const OPTIONS: TextOptions = TextOptions { width: Some(100), colour: false };

/// The sample's plan as one of a simulator that runs freely, with this budget for latency in seconds.
fn plan(latency: Option<f64>) -> CampaignPlan {
    let mut plan = sample::plan();
    plan.simulator.transport = Transport::Process { program: "sim".to_owned(), arguments: Vec::new(), step_ns: None };
    plan.simulator.lifecycle.relay_budget = latency.map(|latency| RelayBudget { latency: Some(latency), jitter: None });
    plan
}

/// A run without disturbance in which `cycle_time` has this value.
fn record(plan: &CampaignPlan, number: u32, cycle_time: f64) -> TestRecord {
    let origin = if number == 0 { Origin::Reference } else { Origin::Search };
    let mut record = sample::record(plan, number, origin, Test::default());
    record.observation.metrics[3] = MetricObservation::whole(Some(cycle_time), true, vec![(1.0, cycle_time)]);
    record
}

/// Results of runs with these cycle times. `added` is what the relay added on a wire, in milliseconds.
fn recorded(
    folder: &Path,
    plan: &CampaignPlan,
    relayed: u32,
    cycle_times: &[f64],
    added: &[(&str, &[u64])],
) -> Repository {
    let runs = u32::try_from(cycle_times.len()).unwrap();
    let task = Task::Undisturbed(Undisturbed { runs, relayed, equal_seeds: true, lab: None });
    let mut recorder = Recorder::create_for(folder, &task.plan(plan), &task, 1, 0).unwrap();
    for (number, &cycle_time) in (0..).zip(cycle_times) {
        recorder.commit(&record(plan, number, cycle_time)).unwrap();
    }
    for (path, milliseconds) in added {
        let mut latencies = Latencies::default();
        milliseconds.iter().for_each(|&latency| latencies.record(Duration::from_millis(latency)));
        recorder.put_relay_latencies(0, [(*path, &latencies)]).unwrap();
    }
    recorder.finish("all tests were evaluated").unwrap()
}

/// A lab that tolerates a second of `cycle_time`.
fn hall() -> Lab {
    Lab { tolerances: vec![LabTolerance { metric: MetricId(3), value: 1.0 }], ..lab("hall") }
}

fn compared(simulation: &[f64], in_lab: &[f64], lab: &Lab) -> NullTesting {
    let plan = plan(None);
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let simulation = recorded(folders[0].path(), &plan, 0, simulation, &[]);
    let in_lab = recorded(folders[1].path(), &plan, 0, in_lab, &[]);
    null(&simulation, Some((lab, &in_lab))).unwrap()
}

#[test]
fn a_metric_fails_beyond_its_tolerance_and_not_at_it() {
    let found = compared(&[60.0, 61.0, 62.0], &[62.0, 62.0, 62.0], &hall());
    let metric = &found.metrics[3];
    let simulation = metric.simulation.unwrap();
    assert_eq!((simulation.mean, simulation.deviation, simulation.min, simulation.max), (61.0, Some(1.0), 60.0, 62.0));
    assert_eq!((metric.difference, metric.tolerance, metric.beyond), (Some(1.0), Some(1.0), false));
    assert_eq!(found.objections, [""; 0]);
    let found = compared(&[60.0, 61.0, 62.0], &[62.0, 62.0, 62.5], &hall());
    let [objection] = &found.objections[..] else { panic!("{:?}", found.objections) };
    assert!(
        objection.starts_with("`cycle_time` differs by 1.167 s between the simulation and lab `hall`"),
        "{objection}"
    );
    // What is not tolerated expressly is not judged, and neither are metrics of an interlock.
    assert_eq!(compared(&[60.0], &[65.0], &lab("hall")).objections, [""; 0]);
    let interlocked = Lab { interlock: vec![MetricId(3)], ..hall() };
    assert_eq!(compared(&[60.0], &[65.0], &interlocked).objections, [""; 0]);
}

#[test]
fn a_violated_requirement_a_crash_and_a_requirement_that_nothing_says_anything_about_fail() {
    let found = compared(&[60.0, 60.0], &[60.0, 80.0], &lab("hall"));
    assert_eq!(found.objections, ["R4 is violated in 1 of 2 runs in lab `hall`"]);
    assert_eq!(found.requirements[3].lab.unwrap().words(), "1 violated, 1 satisfied");
    let (plan, folder) = (plan(None), tempfile::tempdir().unwrap());
    let task = Task::Undisturbed(Undisturbed { runs: 1, relayed: 0, equal_seeds: false, lab: None });
    let mut recorder = Recorder::create_for(folder.path(), &plan, &task, 1, 0).unwrap();
    let mut crashed = record(&plan, 0, 60.0);
    crashed.observation.outcome = Outcome::crash("it fell over".to_owned());
    for shown in &mut crashed.observation.metrics {
        shown.reach = sesame_base::observation::Reach::ANY;
    }
    recorder.commit(&crashed).unwrap();
    let found = null(&recorder.finish("done").unwrap(), None).unwrap();
    assert_eq!(found.objections[0], "run 1 in the simulation ended by crash: it fell over");
    assert!(found.objections.contains(&"no run in the simulation is conclusive about R1".to_owned()));
}

/// What is found in two stages; in the second one, this was added to messages of `link0`.
fn stages(latency: Option<f64>, cycle_times: [&[f64]; 2], added: &[u64]) -> MitmTesting {
    let plan = plan(latency);
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let link0 = "joints/R3200ProductMove/Link0/R/position";
    let stages = [
        // Not relayed, so it is not looked at.
        recorded(folders[0].path(), &plan, 0, cycle_times[0], &[(link0, &[900; 200])]),
        recorded(folders[1].path(), &plan, 1, cycle_times[1], &[(link0, added)]),
    ];
    mitm(&stages).unwrap()
}

const SAME: [&[f64]; 2] = [&[60.0, 60.0], &[60.0, 60.0]];

#[test]
fn a_budget_is_judged_by_one_message_in_a_hundred_and_with_few_messages_by_every_second_one() {
    let slow = |share: usize| (0..1000).map(|at| if at % 100 < share { 20 } else { 1 }).collect::<Vec<u64>>();
    let found = stages(Some(0.005), SAME, &slow(1));
    assert!(!found.over_budget && found.objections.is_empty(), "{found:?}");
    assert_eq!(found.stages[0].added, []);
    let found = stages(Some(0.005), SAME, &slow(2));
    let [objection] = &found.objections[..] else { panic!("{:?}", found.objections) };
    assert!(objection.starts_with("with 1 topic relayed, the relay added 19."), "{objection}");
    assert!(
        objection.ends_with("ms to one message in a hundred of `link0`; the budget is 5 ms latency"),
        "{objection}"
    );
    assert!(found.over_budget && found.stages[1].over_budget && !found.stages[0].over_budget);
    assert!(!stages(None, SAME, &[900; 200]).over_budget, "without a budget nothing is judged");

    let few = stages(Some(0.005), SAME, &[1, 1, 1, 1, 1, 1, 20]);
    assert_eq!((few.over_budget, few.stages[1].added[0].p99), (false, None), "one late message of seven says nothing");
    let few = stages(Some(0.005), SAME, &[20; 7]);
    assert!(few.objections[0].contains("to every second message of `link0`; the budget is 5 ms"), "{few:?}");
}

#[test]
fn stages_in_which_a_metric_is_equal_share_a_row() {
    let shown = |found: &MitmTesting| {
        let table = tables::drifts(found).text(OPTIONS);
        let rows = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
        rows.filter(|row| row.starts_with("cycle_time")).collect::<Vec<_>>()
    };
    assert_eq!(
        shown(&stages(None, [&[60.0, 62.0], &[60.0, 62.0]], &[])),
        ["cycle_time 0 to 1 61.00 ± 1.41 s 0 s 1.414 s"]
    );
    let moved = stages(None, [&[60.0, 62.0], &[64.0, 64.0]], &[]);
    assert_eq!(shown(&moved), ["cycle_time 0 61.00 ± 1.41 s – 1.414 s", "cycle_time 1 64 s 3 s 1.414 s"]);
}

#[test]
fn drift_determinism_and_requirements_that_only_the_relay_violates_are_found() {
    let found = stages(None, [&[60.0, 62.0], &[64.0, 64.0]], &[]);
    let drift = &found.stages[1].metrics[3];
    assert_eq!((drift.drift, drift.spread_before), (Some(3.0), Some(std::f64::consts::SQRT_2)));
    assert_eq!(found.stages.iter().map(|stage| stage.deterministic).collect::<Vec<_>>(), [Some(false), Some(true)]);
    let difference = found.stages[0].difference.as_deref().unwrap();
    assert!(difference.starts_with("metric `cycle_time`"), "{difference}");
    assert_eq!(found.objections, [""; 0], "drift fails nothing");
    let found = stages(None, [&[60.0], &[80.0]], &[]);
    let why = "R4 is violated in 1 of 1 run in the simulation with 1 topic relayed, and not without relay";
    assert_eq!(found.objections, [why]);
    assert!(!found.over_budget);
    assert_eq!(found.stages[1].deterministic, None, "a single run equals no other");
    assert_eq!(stages(None, [&[80.0], &[80.0]], &[]).objections, [""; 0], "it is not the relay's fault");
}

#[test]
fn regression_tests_must_be_as_expected_on_both_sides_and_say_the_same() {
    let mut plan = plan(None);
    plan.tests[0].expectations =
        vec![Expectation { metric: MetricId(3), bound: Bound::Within { low: 59.0, high: 75.0 } }];
    // Its jitter is known to violate it.
    let collisions = Expectation { metric: MetricId(0), bound: Bound::AtLeast { value: 1.0 } };
    plan.tests[0].expectations.push(collisions);
    let side = |plan: &CampaignPlan, cycle_time: f64| {
        let folder = tempfile::tempdir().unwrap();
        let task = Task::Known { tests: vec![KnownTestId(0)], lab: None };
        let mut recorder = Recorder::create_for(folder.path(), plan, &task, 1, 0).unwrap();
        let mut record = TestRecord {
            test: plan.tests[0].test.clone(),
            ..sample::record(plan, 1, Origin::Known(KnownTestId(0)), plan.tests[0].test.clone())
        };
        record.observation.metrics[3] = MetricObservation::whole(Some(cycle_time), true, vec![(1.0, cycle_time)]);
        recorder.commit(&record).unwrap();
        (folder, recorder.finish("done").unwrap())
    };
    let of = |plan: &CampaignPlan, simulation: f64, in_lab: f64| {
        let ((_one, simulation), (_other, in_lab)) = (side(plan, simulation), side(plan, in_lab));
        known(&simulation, Some((&hall(), &in_lab))).unwrap()
    };
    let expecting = plan.clone();
    let said = |simulation: f64, in_lab: f64| of(&expecting, simulation, in_lab);
    assert_eq!(said(60.0, 69.0).objections, [""; 0], "a difference of single runs fails nothing");
    assert!(said(60.0, 69.0).tests[0].metrics[3].beyond);
    assert_eq!(
        said(60.0, 72.0).objections,
        ["R4 in `known_jitter` is satisfied in simulation and violated in lab `hall`"]
    );
    let both = said(60.0, 50.0).objections;
    assert_eq!(both, ["the expectation of `known_jitter` about cycle_time is violated in lab `hall`"]);
    // That it is expected does not make it satisfied.
    assert_eq!(said(60.0, 69.0).unsatisfied(), ["R1 by known_jitter"]);
    plan.tests[0].expectations.pop();
    let found = of(&plan, 60.0, 69.0).objections;
    let unexpected =
        |place: &str| format!("R1 is violated by `known_jitter` in {place}, and the test does not expect it");
    assert_eq!(found, [unexpected("the simulation"), unexpected("lab `hall`")]);
}

#[test]
fn text_and_page_show_everything_and_the_page_needs_nothing_but_itself() {
    let plan = plan(Some(0.005));
    let folder = tempfile::tempdir().unwrap();
    let results = recorded(folder.path(), &plan, 0, &[60.0, 61.0], &[]);
    let mut preparation = Preparation {
        null: Some(compared(&[60.0, 61.0], &[70.5, 70.5], &hall())),
        mitm: Some(stages(Some(0.005), SAME, &[20; 200])),
        known: None,
        monitors: Some(monitors(
            "hall",
            vec![MonitorTest { test: "<leaning>".to_owned(), compared: compared_monitors() }],
        )),
        left_out: vec!["`known` is left out: <none>.".to_owned()],
    };
    assert_eq!(preparation.steps(), [("null", false), ("mitm", false), ("monitors", false)]);
    assert_eq!(preparation.objections().len(), 5, "{:?}", preparation.objections());
    let said = text(&preparation, OPTIONS);
    for part in [
        "hall",
        "60.50 ± 0.71 s",
        "link0",
        "null failed",
        "mitm failed",
        "monitors failed",
        "camera/light",
        "`known` is left out",
        "violated",
    ] {
        assert!(said.contains(part), "{part}:\n{said}");
    }
    preparation.known = Some(KnownTesting { lab: None, tests: Vec::new(), objections: Vec::new() });
    let html = page(&plan, &preparation, &[("Without disturbance, <simulation>", &results)]).unwrap();
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    let document = roxmltree::Document::parse_with_options(&html, options).unwrap();
    let ids: Vec<&str> = document.descendants().filter_map(|node| node.attribute("id")).collect();
    for id in ["objections", "null", "mitm", "known", "monitors", "provenance"] {
        assert_eq!(ids.iter().filter(|known| **known == id).count(), 1, "{id}");
    }
    let items = document.descendants().filter(|node| node.has_tag_name("li")).count();
    assert_eq!(items, 5, "each objection is named");
    assert!(document.descendants().filter(|node| node.has_tag_name("figure")).count() > 1, "series are drawn");
    assert!(!html.contains("http://") && !html.contains("https://") && !html.contains("<none>"));
    let json = serde_json::to_value(&preparation).unwrap();
    assert!(json["null"].get("figures").is_none());
    assert_eq!(json["mitm"]["stages"][1]["added"][0]["over_budget"], true);
}
