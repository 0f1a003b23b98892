//! Pairs of operations in the summary, as data and as a picture.

use super::*;

/// The section of the page on pairs.
fn section<'a>(document: &'a roxmltree::Document<'a>) -> Option<roxmltree::Node<'a, 'a>> {
    document.descendants().find(|node| node.attribute("id") == Some("combinations"))
}

fn of_class<'a>(section: roxmltree::Node<'a, 'a>, wanted: &str) -> Vec<roxmltree::Node<'a, 'a>> {
    let is_wanted = |node: &roxmltree::Node<'_, '_>| {
        node.attribute("class").is_some_and(|class| class.split(' ').any(|class| class == wanted))
    };
    section.descendants().filter(is_wanted).collect()
}

/// The sample with so many operations, of which the last ones are in no test.
pub(super) fn plan_of(count: u32) -> sesame_plan::CampaignPlan {
    let mut plan = sample::plan();
    for number in 4..count {
        let mut more = plan.operations[3].clone();
        more.name = format!("cut_{number}");
        plan.operations.push(more);
        plan.campaign.operations.push(OperationId(number));
    }
    plan
}

#[test]
fn pairs_of_operations_are_told_in_words_as_data_and_as_a_picture() {
    let (_folder, repository) = repository();
    let summary = summary(&repository).unwrap();
    let text = summary_text(&summary, WIDE);
    let sentence = text.lines().find(|line| line.contains("acted together")).unwrap();
    let json = serde_json::to_value(&summary).unwrap();
    insta::assert_snapshot!("pairs_json", json["pairs"]);

    let html = page(&repository).unwrap();
    let document = parsed(&html);
    let section = section(&document).unwrap();
    assert!(section.descendants().any(|node| node.text() == Some(&format!("{sentence}."))));
    let squares = of_class(section, "pair");
    assert_eq!(squares.len(), 4 + 6);
    let titles: Vec<&str> =
        squares.iter().map(|square| square.prev_sibling_element().unwrap().text().unwrap()).collect();
    insta::assert_snapshot!("pairs_squares", titles.join("\n"));
    let met = json["pairs"]["tests"].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
    assert_eq!(of_class(section, "met").len(), met.filter(|tests| **tests != 0).count());
    let quarters = json["pairs"]["quarters"].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
    let quarters: u64 = quarters.map(|quarters| quarters.as_u64().unwrap()).sum();
    assert_eq!(of_class(section, "quarter").len() as u64, quarters);
    let causes = titles.iter().filter(|title| title.contains("a cause of R1")).count();
    assert_eq!((causes, of_class(section, "cause").len()), (4, 4));
    // Each operation is named beside its row and below its column.
    for operation in &repository.plan().operations {
        let named = section.descendants().filter(|node| node.has_tag_name("text"));
        assert_eq!(named.filter(|node| node.text() == Some(&operation.name)).count(), 2);
    }
}

#[test]
fn a_square_says_where_a_window_does_not_reach_and_what_never_acted() {
    let mut plan = plan_of(6);
    plan.operations[1].within = sesame_plan::Span { start: 0.0, end: 30.0 };
    let known = &mut plan.tests[0].test.operations[0];
    known.activation = Activation::Time { start: 8.0, end: 29.0 };
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    for number in 0..4 {
        let test = plan.tests[0].test.clone();
        recorder.commit(&sample::record(&plan, number, Origin::Search, test)).unwrap();
    }
    let html = page(recorder.repository()).unwrap();
    let document = parsed(&html);
    let section = section(&document).unwrap();
    assert_eq!(of_class(section, "out").len(), 2 * 6, "two quarters of each square of the second operation");
    let says = |title: &str| section.descendants().any(|node| node.text() == Some(title));
    assert!(says(
        "jitter_link1: acted in 4 tests, in the quarters of the run in 4, 4, – and –; violated: R1 in 4; a cause of R1"
    ));
    assert!(says("jitter_link0 + cut_5: never acted together"));
    assert!(says("cut_5: never acted"));
}

#[test]
fn of_many_operations_the_page_lists_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign(folder.path(), &plan_of(40), 60);
    let html = page(&repository).unwrap();
    let document = parsed(&html);
    let section = section(&document).unwrap();
    assert!(of_class(section, "pair").is_empty());
    let rows: Vec<_> = section.descendants().filter(|node| node.has_tag_name("tr")).collect();
    assert_eq!(rows.len(), 1 + 20);
    let cells: Vec<&str> = rows[1].children().filter_map(|cell| cell.text()).collect();
    assert_eq!(cells, ["jitter_link0 + cut_4", "0", "1, 2, 3, 4"]);
    assert!(html.contains("And 7") && html.contains("<code>sesamec results pairs</code> has all pairs"));
    let json = serde_json::to_string(&summary(&repository).unwrap().pairs).unwrap();
    assert!(json.len() < 10_000, "{} bytes for 780 pairs", json.len());

    let few = sample::campaign(&folder.path().join("few"), &plan_of(24), 10);
    assert_eq!(of_class(self::section(&parsed(&page(&few).unwrap())).unwrap(), "pair").len(), 24 * 25 / 2);
}

#[test]
fn only_searches_whose_tests_may_hold_two_operations_have_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = sample::plan();
    plan.campaign.count.max = 1;
    let repository = sample::campaign(folder.path(), &plan, 10);
    let summary = summary(&repository).unwrap();
    assert_eq!(summary.pairs, None);
    assert!(!summary_text(&summary, WIDE).contains("pairs of operations"));
    assert!(section(&parsed(&page(&repository).unwrap())).is_none());

    let (_folder, known) = instead(&Task::Known { tests: vec![sesame_plan::KnownTestId(0)], lab: None });
    let json = serde_json::to_value(crate::summary(&known).unwrap()).unwrap();
    assert!(json.get("pairs").is_none());
    assert!(!page(&known).unwrap().contains("id=\"combinations\""));
}

#[test]
fn a_search_without_any_test_has_an_empty_picture() {
    let folder = tempfile::tempdir().unwrap();
    let recorder = sesame_record::Recorder::create(folder.path(), &sample::plan(), 1, 1).unwrap();
    let text = summary_text(&summary(recorder.repository()).unwrap(), WIDE);
    assert!(
        text.contains("0 of 6 pairs of operations acted together, 0 of 24 in the same quarter of the run"),
        "{text}"
    );
    let html = page(recorder.repository()).unwrap();
    let document = parsed(&html);
    let section = section(&document).unwrap();
    assert_eq!((of_class(section, "pair").len(), of_class(section, "met").len()), (10, 0));
}
