//! When a requirement on a robustness was violated, as reports say it.

use sesame_base::observation::{MetricObservation, Observation, Outcome};
use sesame_plan::stl::{Formula, Interval, Robustness};
use sesame_plan::{
    Bound, CampaignPlan, Comparison, Expression, FieldRef, Input, Members, MetricSource, Side, Span, TopicId,
};
use sesame_record::{Recorder, TestRecord};

use super::*;

/// The sample's plan, in which R3 bounds a robustness, and one run of it.
fn sampled(signal: &[(f64, f64)], eventually: bool) -> (CampaignPlan, TestRecord) {
    let mut plan = sample::plan();
    let above = Box::new(Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: 0.0 });
    let interval = Interval::UNBOUNDED;
    let formula =
        if eventually { Formula::Eventually { interval, of: above } } else { Formula::Always { interval, of: above } };
    let field = FieldRef { topic: TopicId(2), path: Vec::new() };
    let robustness = Robustness {
        inputs: vec![Input::new(field, Members::Min)],
        signals: vec![Expression::Input(0)],
        formula,
        side: Side::Inbound,
        whole_windows: false,
    };
    plan.metrics[4].source = MetricSource::Robustness { robustness };
    plan.requirements[2].bound = Bound::AtLeast { value: 150.0 };
    let mut record = sample::record(&plan, 3, Origin::Search, plan.tests[0].test.clone());
    let values = signal.iter().map(|point| point.1);
    let value = if eventually { values.fold(f64::MIN, f64::max) } else { values.fold(f64::MAX, f64::min) };
    let Observation { metrics, end, .. } = &mut record.observation;
    metrics[4] = MetricObservation::whole(Some(value), true, vec![(*end, value)]);
    metrics[4].robustness = signal.to_vec();
    (plan, record)
}

fn reported(plan: &CampaignPlan, record: &TestRecord) -> (TestReport, String) {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), plan, 1, 1).unwrap();
    let mut reference = sample::record(plan, 0, Origin::Reference, sesame_plan::Test::default());
    reference.observation.metrics[4] = record.observation.metrics[4].clone();
    recorder.commit(&reference).unwrap();
    recorder.commit(record).unwrap();
    let repository = recorder.finish("done").unwrap();
    (show(&repository, "T3").unwrap(), page(&repository).unwrap())
}

const SIGNAL: [(f64, f64); 4] = [(0.02, 640.0), (30.1, 120.5), (31.0, 400.0), (70.0, 400.0)];

#[test]
fn show_and_the_timeline_say_when_a_robustness_was_lost() {
    let (plan, record) = sampled(&SIGNAL, false);
    let (report, page) = reported(&plan, &record);
    assert_eq!(report.requirements[2].outside, [Span { start: 30.1, end: 31.0 }]);
    let text = test_text(&report, WIDE);
    let row = text.lines().find(|line| line.trim_start().starts_with("R3")).unwrap();
    assert!(row.contains("120.5 mm at 30.10 s") && row.contains("30.10–31.00 s"), "{row}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["requirements"][2]["outside"][0]["start"], 30.1);
    assert_eq!(json["requirements"][2]["decided_at"], 30.1);
    assert_eq!(json["metrics"][4]["robustness"][1], serde_json::json!([30.1, 120.5]));
    assert_eq!(json["metrics"][0].get("robustness"), None, "other metrics have no such field");
    // The row of the metric has its line, the bound beside it, and a red stretch.
    let timeline = page.split("id=\"T3\"").nth(1).unwrap().split("class=\"row\"");
    let row = timeline.into_iter().find(|row| row.contains("<b>arm_distance</b>")).unwrap();
    assert!(row.contains("120.5 mm at 30.10 s") && row.contains("R3 ≥ 150 mm"), "{row}");
    assert!(row.contains("outside its bound 30.10–31.00 s") && row.contains("class=\"line bad\" d=\"M30.1 "), "{row}");
    assert!(row.contains("class=\"line\" d=\"M0.02 ") && row.contains("H70"), "{row}");
}

#[test]
fn an_eventuality_that_never_came_is_lost_all_along() {
    let (plan, record) = sampled(&[(0.0, 20.0), (10.0, 140.0), (12.0, 30.0), (70.0, 30.0)], true);
    let (report, page) = reported(&plan, &record);
    assert_eq!(report.requirements[2].outside, [Span { start: 0.0, end: 70.0 }]);
    assert_eq!(report.requirements[2].decided_at, Some(10.0), "it came nearest then");
    assert!(page.contains("140 mm at 10.00 s"));
    let (plan, record) = sampled(&[(0.0, 20.0), (10.0, 160.0), (12.0, 30.0), (70.0, 30.0)], true);
    assert_eq!(reported(&plan, &record).0.requirements[2].outside, [], "once is enough");
}

#[test]
fn results_without_signals_say_that_it_is_not_recorded() {
    let (plan, mut record) = sampled(&SIGNAL, false);
    record.observation.metrics[4].robustness.clear();
    let (report, page) = reported(&plan, &record);
    let text = test_text(&report, WIDE);
    let row = text.lines().find(|line| line.trim_start().starts_with("R3")).unwrap();
    assert!(row.contains("120.5 mm") && row.contains("not recorded"), "{row}");
    assert!(!page.contains("<b>arm_distance</b>"));
}

#[test]
fn a_robustness_of_a_run_that_broke_off_is_drawn_as_far_as_it_went() {
    let (plan, mut record) = sampled(&[(0.02, 640.0), (30.1, 120.5), (33.0, 120.5)], false);
    record.observation.outcome = Outcome::Crash { message: "gone".to_owned() };
    record.observation.end = 33.5;
    let (report, page) = reported(&plan, &record);
    assert_eq!(report.requirements[2].outside, [Span { start: 30.1, end: 33.0 }]);
    assert!(page.contains("outside its bound 30.10–33.00 s"));
}
