//! Reports on a made-up campaign, read as a user reads them.

#![expect(clippy::disallowed_methods, reason = "they read files that were written, and show one to a browser")]

use sesame_base::observation::Counters;
use sesame_plan::{Activation, Choice, NodeId, OperationId, OperationKind, Task, Test, TestOperation};
use sesame_record::{Origin, Repository, Standing, Verdict, sample};

use super::*;

mod analyses;
mod browser;
mod earlier;
mod environment;
mod monitors;
mod page;
mod pairs;
mod robustness;
mod run_again;

const WIDE: TextOptions = TextOptions { width: None, colour: false };

fn repository() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign(folder.path(), &sample::plan(), 60);
    (folder, repository)
}

#[test]
fn the_summary_shows_the_front_the_requirements_and_what_failed() {
    let (_folder, repository) = repository();
    insta::assert_snapshot!("summary", summary_text(&summary(&repository).unwrap(), WIDE));
}

#[test]
fn the_sentence_of_a_requirement_says_no_more_than_its_tests() {
    let (_folder, repository) = repository();
    let mut requirement = summary(&repository).unwrap().requirements.remove(0);
    let causes = ["a", "b", "c", "d", "e", "f"].map(str::to_owned);
    let begins = |requirement: &facts::summary::RequirementSummary, causes: &[String]| {
        let sentence = facts::violated::violated_requirement(requirement, causes).before;
        sentence.split_once("). ").unwrap().1.split_once(" The worst").unwrap().0.to_owned()
    };
    let undisturbed = "; the run without disturbance does not";
    assert_eq!(
        begins(&requirement, &causes[..1]),
        format!("30 of 58 conclusive tests violate it{undisturbed}. 1 cause: a.")
    );
    requirement.inconclusive = 0;
    requirement.reference = Some(Verdict::Inconclusive);
    assert_eq!(begins(&requirement, &causes), "30 of 58 tests violate it. 6 causes: a, b, c, d and 2 more.");
    requirement.reference = None;
    assert_eq!(begins(&requirement, &causes[..4]), "30 of 58 tests violate it. 4 causes: a, b, c, d.");
}

#[test]
fn the_summary_fits_a_terminal() {
    let (_folder, repository) = repository();
    let text = summary_text(&summary(&repository).unwrap(), TextOptions { width: Some(100), colour: false });
    insta::assert_snapshot!("summary_100_columns", text);
}

#[test]
fn numbers_that_are_not_finite_are_a_finding_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    for mut record in sample::records(&plan, 8) {
        if record.number == 5 {
            for (metric, time) in [(0, 12.5), (4, 3.25)] {
                let shown = &mut record.observation.metrics[metric];
                (shown.not_finite, shown.reach) = (Some(time), sesame_base::observation::Reach::ANY);
            }
        }
        recorder.commit(&record).unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    let summary = summary(&repository).unwrap();
    assert_eq!(summary.requirements[0].inconclusive, 1, "it bounds one of these metrics");
    let text = summary_text(&summary, WIDE);
    let (_, table) = text.split_once("Numbers that are not finite\n").unwrap();
    let row: Vec<&str> = table.lines().nth(1).unwrap().split_whitespace().collect();
    assert_eq!(row, ["T5", "3.25", "s", "collision_occurrence,", "arm_distance"]);
    let xml = crate::junit(&summary);
    assert!(xml.contains("T5 has finite numbers only") && xml.contains("type=\"not_finite\""), "{xml}");
    let page = crate::page(&repository).unwrap();
    assert!(page.contains("Numbers that are not finite"));
    let json = serde_json::to_value(&summary).unwrap();
    assert_eq!(json["not_finite"][0]["at"], 3.25);
}

#[test]
fn the_list_has_a_line_for_each_test() {
    let (_folder, repository) = repository();
    insta::assert_snapshot!("list", list_text(&list(&repository).unwrap(), WIDE));
}

#[test]
fn everything_on_one_test_is_shown() {
    let (_folder, repository) = repository();
    for name in ["reference", "known_jitter", "T17", "T23", "T44"] {
        insta::assert_snapshot!(format!("test_{name}"), test_text(&show(&repository, name).unwrap(), WIDE));
    }
}

#[test]
fn what_acts_on_nodes_is_shown_with_the_node_or_the_parameter() {
    let mut plan = sample::plan();
    plan.nodes = vec![sesame_plan::testing::node("cell_node")];
    let node = NodeId(0);
    let kinds = [
        OperationKind::Set { node, parameter: "limits.payload".to_owned(), values: vec![] },
        OperationKind::Pause { node },
        OperationKind::Slow { node },
        OperationKind::Kill { node },
    ];
    let used = kinds.into_iter().map(|kind| {
        let operation = sesame_plan::testing::operation(0, kind);
        let id = OperationId(u32::try_from(plan.operations.len()).unwrap());
        let parameters = operation.parameters.iter().map(|_| Choice::Value { value: 0.25 }).collect();
        plan.operations.push(operation);
        let activation = Activation::Time { start: 1.0, end: 2.0 };
        TestOperation { operation: id, parameters, activation, operation_seed: 0, messages: None }
    });
    let test = Test { operations: used.collect() };
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    let mut record = sample::records(&plan, 2).remove(1);
    record.observation = sample::observe(&plan, &test, 1);
    record.test = test;
    for operation in &mut record.observation.operations {
        operation.counters = Counters { side_effects: 1, ..Counters::default() };
    }
    let number = record.number;
    recorder.commit(&record).unwrap();
    let repository = recorder.finish("all evaluations done").unwrap();
    let report = show(&repository, &format!("T{number}")).unwrap();
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["operations"][0]["resource"], "parameter \"limits.payload\" of cell_node");
    assert!(json["operations"][0]["topic"].is_null());
    let text = test_text(&report, WIDE);
    for part in ["node cell_node", "parameter \"limits.payload\" of cell_node", "share 25 %", "value 0.25"] {
        assert!(text.contains(part), "{text}");
    }
    assert!(text.contains("1 side effects") && !text.contains("seen"), "{text}");
}

/// The page as any XML parser sees it.
fn parsed(html: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    roxmltree::Document::parse_with_options(html, options).unwrap()
}

/// The sample plan with the grid of the paper's Table 3.
fn plan_on_the_published_grid() -> sesame_plan::CampaignPlan {
    let mut plan = sample::plan();
    let grid = sesame_search::coverage::Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
    plan.campaign.coverage = Some(sesame_plan::CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
    plan
}

#[test]
fn an_unfinished_run_without_any_test_has_its_reports() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let recorder = sesame_record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let text = summary_text(&summary(recorder.repository()).unwrap(), WIDE);
    assert!(text.starts_with("Nothing was tested\n"), "{text}");
    assert!(text.contains("0 evaluations; the run is unfinished"), "{text}");
    parsed(&page(recorder.repository()).unwrap());
}

/// The paper's grid, with half of the cells as the target.
fn counting() -> sesame_plan::CampaignPlan {
    let axis = |dimension, high, cells| sesame_plan::GridAxis { dimension, low: 0.0, high, cells };
    let mut plan = sample::plan();
    plan.campaign.coverage = Some(sesame_plan::CoverageGoal {
        axes: vec![
            axis(sesame_plan::Dimension::T1, 1.0, 6),
            axis(sesame_plan::Dimension::T2, 0.5, 6),
            axis(sesame_plan::Dimension::P1, 1.0, 3),
        ],
        hits: 1,
        stop_at: Some(0.5),
    });
    plan
}

#[test]
fn coverage_is_told_in_words_as_data_and_as_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign(folder.path(), &counting(), 60);
    let summary = summary(&repository).unwrap();
    let text = summary_text(&summary, WIDE);
    let sentence = text.lines().find(|line| line.contains("cells covered")).unwrap();
    insta::assert_snapshot!("coverage", sentence);

    let coverage = summary.coverage.as_ref().unwrap();
    let data = serde_json::to_value(coverage).unwrap();
    assert_eq!(data["covered"], coverage.covered);
    assert_eq!(data["axes"][1]["dimension"], "T2");
    let curve = data["curve"].as_array().unwrap();
    let evaluations = summary.counts.evaluations;
    assert_eq!(
        curve.last().unwrap(),
        &serde_json::json!({
            "evaluations": evaluations, "covered": coverage.covered, "coverage": coverage.coverage
        })
    );
    assert!(curve.is_sorted_by_key(|point| point["covered"].as_u64().unwrap()));

    let html = page(&repository).unwrap();
    let document = parsed(&html);
    let cells: Vec<_> = document
        .descendants()
        .filter(|node| node.attribute("class").is_some_and(|class| class.split(' ').any(|class| class == "cell")))
        .collect();
    assert_eq!(cells.len(), 36);
    assert!(html.contains("210 evaluations at most, until 50 % of the cells are covered"));
    let said = |word: &str| {
        let titles = cells.iter().map(|cell| cell.prev_sibling_element().unwrap().text().unwrap());
        titles.filter(|title| title.ends_with(word)).count()
    };
    assert_eq!(said("no test can get there"), 4, "an interval at the edge is short");
    insta::assert_snapshot!("coverage_cell", cells[0].prev_sibling_element().unwrap().text().unwrap());
}

#[test]
fn a_grid_of_one_dimension_is_a_row_and_one_without_a_test_is_empty() {
    let mut plan = counting();
    let goal = plan.campaign.coverage.as_mut().unwrap();
    goal.axes.truncate(1);
    goal.stop_at = None;
    let folder = tempfile::tempdir().unwrap();
    let recorder = sesame_record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let html = page(recorder.repository()).unwrap();
    let document = parsed(&html);
    let empty = document.descendants().filter(|node| node.attribute("class") == Some("cell empty"));
    assert_eq!(empty.count(), 6);
    assert!(summary_text(&summary(recorder.repository()).unwrap(), WIDE).contains("0 of 6 cells covered (0.0 %)"));
}

/// What a campaign shows that does so instead of searching.
fn instead(task: &Task) -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = sample::plan();
    let expect = |metric, bound| sesame_plan::Expectation { metric: sesame_plan::MetricId(metric), bound };
    plan.tests[0].expectations = vec![
        expect(0, sesame_plan::Bound::Within { low: 1.0, high: 40.0 }),
        expect(1, sesame_plan::Bound::Equal { value: 49.0f64.next_up() }),
    ];
    let plan = task.plan(&plan);
    let mut recorder = sesame_record::Recorder::create_for(folder.path(), &plan, task, 1, 1).unwrap();
    let test = plan.tests[0].test.clone();
    let known = sesame_plan::KnownTestId(0);
    match task {
        Task::Repeat { times, .. } => {
            for number in 1..=*times {
                recorder.commit(&sample::record(&plan, number, sesame_record::Origin::Search, test.clone())).unwrap();
            }
        }
        _ => recorder.commit(&sample::record(&plan, 1, sesame_record::Origin::Known(known), test)).unwrap(),
    }
    (folder, recorder.finish("all tests were evaluated").unwrap())
}

#[test]
fn a_repetition_says_how_often_each_requirement_was_violated() {
    let (_folder, repository) = instead(&Task::Repeat {
        name: "known_jitter".to_owned(),
        test: sample::plan().tests[0].test.clone(),
        times: 10,
    });
    insta::assert_snapshot!("repeated", summary_text(&summary(&repository).unwrap(), WIDE));
    assert!(page(&repository).unwrap().contains("95 % Wilson interval"));
    let shown = test_text(&show(&repository, "T3").unwrap(), WIDE);
    assert!(shown.starts_with("T3 (repetition)\n") && !shown.contains("generation"), "{shown}");
    assert!(!list_text(&list(&repository).unwrap(), WIDE).contains("search"));
    assert_eq!(serde_json::to_value(show(&repository, "T3").unwrap()).unwrap()["origin"], "search", "as in results");
}

#[test]
fn runs_of_a_passive_campaign_are_observations() {
    let folder = tempfile::tempdir().unwrap();
    let task = Task::Repeat { name: "undisturbed".to_owned(), test: sesame_plan::Test::default(), times: 2 };
    let plan = task.plan(&sample::plan());
    let mut recorder = sesame_record::Recorder::create_for(folder.path(), &plan, &task, 1, 1).unwrap();
    for number in 1..=2 {
        let test = sesame_plan::Test::default();
        recorder.commit(&sample::record(&plan, number, sesame_record::Origin::Search, test)).unwrap();
    }
    let repository = recorder.finish("all tests were evaluated").unwrap();
    let text = summary_text(&summary(&repository).unwrap(), WIDE);
    assert!(text.contains("Observed without disturbance") && !text.contains("undisturbed repeated"), "{text}");
    assert!(test_text(&show(&repository, "T2").unwrap(), WIDE).starts_with("T2 (observation)\n"));
    assert_eq!(list_text(&list(&repository).unwrap(), WIDE).matches("observation").count(), 2);
    let page = page(&repository).unwrap();
    assert!(page.contains("2 observations") && !page.contains("undisturbed repeated"));
}

#[test]
fn only_a_violated_requirement_says_when_its_metric_was_beyond_the_bound() {
    let (_folder, repository) = repository();
    let mut report = show(&repository, "T1").unwrap();
    let beyond = sesame_plan::Span { start: 0.1, end: 8.0 };
    let violated = report.requirements.iter_mut().find(|shown| shown.first == Verdict::Violated).unwrap();
    violated.outside = vec![beyond];
    let note = "Beyond bound: when";
    let text = test_text(&report, WIDE);
    assert!(text.contains("beyond bound") && text.contains("0.10–8.00 s") && text.contains(note), "{text}");
    for shown in &mut report.requirements {
        shown.first = Verdict::Satisfied;
        shown.outside = vec![beyond];
    }
    let text = test_text(&report, WIDE);
    assert!(!text.contains("0.10–8.00 s") && !text.contains(note), "{text}");
}

#[test]
fn known_tests_are_compared_with_what_they_expect() {
    let (_folder, repository) = instead(&Task::Known { tests: vec![sesame_plan::KnownTestId(0)], lab: None });
    insta::assert_snapshot!("known", summary_text(&summary(&repository).unwrap(), WIDE));
    let html = page(&repository).unwrap();
    assert!(parsed(&html).descendants().any(|node| node.text() == Some("= 49.00000000000001 s")));
}

#[test]
fn reports_serialise_with_names_and_units() {
    let (_folder, repository) = repository();
    let json = serde_json::to_value(show(&repository, "T1").unwrap()).unwrap();
    assert_eq!(json["operations"][0]["choices"][0]["unit"], "rad");
    assert_eq!(json["operations"][0]["choices"][0]["choice"]["low"], 0.27);
    assert_eq!(json["requirements"][0]["verdict"], "violated");
    let json = serde_json::to_value(summary(&repository).unwrap()).unwrap();
    assert_eq!(json["objectives"][0]["metric"], "fuzzing_time");
    assert_eq!(json["objectives"][0]["direction"], "minimise");
    assert_eq!(json["requirements"][0]["worst"]["test"], "T1");
    let json = serde_json::to_value(list(&repository).unwrap()).unwrap();
    assert_eq!(json["tests"][5]["outcome"], "no_effect");
}
