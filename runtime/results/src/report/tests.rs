//! Reports on a made-up campaign, read as a user reads them.

use sha2::Digest as _;

use sesame_plan::Task;

use super::*;
use crate::record::{Origin, Repository, Standing, sample};

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
fn the_summary_fits_a_terminal() {
    let (_folder, repository) = repository();
    let text = summary_text(&summary(&repository).unwrap(), TextOptions { width: Some(100), colour: false });
    insta::assert_snapshot!("summary_100_columns", text);
}

#[test]
fn numbers_that_are_not_finite_are_a_finding_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = crate::record::Recorder::create(folder.path(), &plan, 42, 1).unwrap();
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
    let xml = crate::report::junit(&summary);
    assert!(xml.contains("T5 has finite numbers only") && xml.contains("type=\"not_finite\""), "{xml}");
    let page = crate::report::page(&repository).unwrap();
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

/// The page as any XML parser sees it.
fn parsed(html: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    roxmltree::Document::parse_with_options(html, options).unwrap()
}

#[test]
fn the_page_is_well_formed_and_needs_nothing_but_itself() {
    let (folder, repository) = repository();
    let path = folder.path().join("report.html");
    write_page(&repository, &path).unwrap();
    let html = std::fs::read_to_string(&path).unwrap();
    let document = parsed(&html);
    let mut ids = std::collections::BTreeSet::new();
    for node in document.descendants() {
        assert!(!["link", "img", "iframe", "object"].contains(&node.tag_name().name()), "{:?}", node.tag_name());
        assert!(node.attribute("src").is_none());
        if let Some(id) = node.attribute("id") {
            assert!(ids.insert(id.to_owned()), "`{id}` occurs twice");
        }
    }
    assert!(!html.contains("http://") && !html.contains("https://") && !html.contains("url("));
    for link in document.descendants().filter_map(|node| node.attribute("href")) {
        assert!(ids.contains(link.strip_prefix('#').unwrap()), "`{link}` leads nowhere");
    }
    for svg in document.descendants().filter(|node| node.tag_name().name() == "svg") {
        let spoken = svg.attribute("aria-label").is_some() || svg.attribute("aria-hidden") == Some("true");
        assert!(spoken, "a picture without words");
    }
    let first = document.descendants().find(|node| node.attribute("class") == Some("test")).unwrap();
    assert_eq!(first.attribute("id"), Some("T0"), "the reference run comes first");
}

#[test]
fn hostile_names_are_shown_and_nothing_more() {
    // A plan whose names have control characters is not read.
    let name = "<script>alert('1')</script>\" onload=\"x\" {{body}} &";
    let hostile = format!("{name} \u{1b}[31m");
    let mut plan = sample::plan();
    for text in [&mut plan.doc, &mut plan.source, &mut plan.generator, &mut plan.campaign.doc] {
        text.clone_from(&hostile);
    }
    for text in [&mut plan.space, &mut plan.campaign.name] {
        name.clone_into(text);
    }
    plan.topics.iter_mut().for_each(|topic| name.clone_into(&mut topic.name));
    plan.tests.iter_mut().for_each(|test| name.clone_into(&mut test.name));
    for (at, operation) in plan.operations.iter_mut().enumerate() {
        operation.name = format!("{at}{name}");
        operation.parameters.iter_mut().for_each(|parameter| parameter.unit = Some(name.to_owned()));
    }
    for (at, requirement) in plan.requirements.iter_mut().enumerate() {
        requirement.name = format!("{at}{name}");
        requirement.text.clone_from(&hostile);
    }
    for (at, metric) in plan.metrics.iter_mut().enumerate() {
        metric.name = format!("{at}{name}");
        metric.unit = Some(name.to_owned());
    }
    let folder = tempfile::tempdir().unwrap();
    let html = page(&sample::campaign(folder.path(), &plan, 40)).unwrap();
    let document = parsed(&html);
    assert_eq!(document.descendants().filter(|node| node.tag_name().name() == "script").count(), 1, "only our own");
    assert!(document.descendants().all(|node| node.attribute("onload").is_none()));
    assert!(html.contains("&lt;script&gt;alert") && !html.contains('\u{1b}'));
    assert!(document.descendants().any(|node| node.tag_name().name() == "h1" && node.text() == Some(name)));
    let tame = format!("{name} \u{FFFD}[31m");
    assert!(document.descendants().any(|node| node.text().is_some_and(|text| text.contains(&tame))));
}

#[test]
fn campaigns_with_any_number_of_objectives_have_a_page() {
    for objectives in 0..=4u32 {
        let mut plan = sample::plan();
        plan.campaign.objectives = (0..objectives).map(sesame_plan::MetricId).collect();
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &plan, 30);
        let html = page(&repository).unwrap();
        let document = parsed(&html);
        let front = document.descendants().find(|node| node.attribute("id") == Some("front")).unwrap();
        let charts = front.descendants().filter(|node| node.attribute("class") == Some("scatter")).count();
        assert_eq!(charts, [0, 1, 1, 3, 6][objectives as usize]);
        assert_eq!(summary_text(&summary(&repository).unwrap(), WIDE).contains("median"), objectives == 0);
    }
}

/// The sample plan with the grid of the paper's Table 3.
fn plan_on_the_published_grid() -> sesame_plan::CampaignPlan {
    let mut plan = sample::plan();
    let grid = sesame_search::coverage::Grid::parse("T1:0:1:6,T2:0:0.5:6,P1:0:1:3").unwrap();
    plan.campaign.coverage = Some(sesame_plan::CoverageGoal { axes: grid.axes().to_vec(), hits: 1, stop_at: None });
    plan
}

#[test]
fn the_page_shows_fronts_and_indicators_by_generation() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::campaign_with_fronts(folder.path(), &sample::plan(), 60);
    let html = page(&repository).unwrap();
    let document = parsed(&html);
    let section = document.descendants().find(|node| node.attribute("id") == Some("generations")).unwrap();
    let titles: Vec<&str> = section
        .descendants()
        .filter(|node| node.attribute("class") == Some("axis-title"))
        .map(|node| node.text().unwrap())
        .collect();
    let indicators = ["hypervolume", "IGD⁺ to the final front", "tests on the front", "share of all tests so far [%]"];
    assert_eq!(titles, [&["collision_occurrence, maximised"][..], &indicators].concat());
    // Every front is there to be moved to, and each dot says when it was on one.
    let sets = repository.result_sets().unwrap();
    let fronts: Vec<_> = sets.iter().filter(|set| set.generation.is_some()).collect();
    let told = section.descendants().find_map(|node| node.attribute("data-fronts")).unwrap();
    let told: Vec<(u32, usize)> = serde_json::from_str(told).unwrap();
    assert_eq!(told, fronts.iter().map(|set| (set.generation.unwrap(), set.members.len())).collect::<Vec<_>>());
    for (at, set) in fronts.iter().enumerate() {
        let stays = |node: &roxmltree::Node<'_, '_>| -> Option<bool> {
            let bound = |name: &str| node.attribute(name)?.parse::<usize>().ok();
            Some((bound("data-from")?..=bound("data-to")?).contains(&at))
        };
        let on = section.descendants().filter(|node| stays(node) == Some(true));
        let mut named: Vec<u32> = on
            .filter_map(|dot| dot.first_element_child()?.text()?.strip_prefix('T')?.split(' ').next()?.parse().ok())
            .collect();
        named.sort_unstable();
        assert_eq!(named, set.members, "{}", set.name);
    }
}

#[test]
fn the_map_of_cells_has_all_that_its_script_shows() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan_on_the_published_grid();
    let repository = sample::campaign(folder.path(), &plan, 60);
    let html = page(&repository).unwrap();
    let document = parsed(&html);
    let data = document.descendants().find_map(|node| node.attribute("data-cells")).unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    let summary = summary(&repository).unwrap().coverage.unwrap();
    let hits: u64 = data["hit"].as_array().unwrap().iter().map(|row| row[1].as_u64().unwrap()).sum();
    assert_eq!(data["hit"].as_array().unwrap().len(), summary.covered);
    let reach: Vec<u64> = data["reach"].as_array().unwrap().iter().map(|it| it.as_u64().unwrap()).collect();
    assert_eq!(reach.iter().sum::<u64>(), 108);
    assert_eq!(reach.iter().skip(1).step_by(2).sum::<u64>(), summary.feasible as u64);
    // The worst values are those that a look at every test finds.
    let grid = sesame_search::coverage::Grid::new(plan.campaign.coverage.as_ref().unwrap().axes.clone()).unwrap();
    let collisions = data["metrics"].as_array().unwrap().iter().position(|it| it["name"] == "collision_occurrence");
    let column = 2 + 2 * collisions.unwrap();
    let mut counted = 0;
    repository
        .scan(&mut |test| {
            let point = test.covering_point(&plan, sesame_search::sspr::Convention::Ours);
            let Some(cell) = point.and_then(|point| grid.cell_of(&point)) else { return };
            if test.origin == crate::record::Origin::Reference {
                return;
            }
            counted += 1;
            let row = data["hit"].as_array().unwrap().iter().find(|row| row[0] == cell).unwrap();
            let value = test.value(sesame_plan::MetricId(0)).value;
            assert!(value.is_none_or(|value| value <= row[column].as_f64().unwrap()), "T{}", test.number);
            if row[column + 1] == test.number {
                assert_eq!(value, row[column].as_f64());
            }
        })
        .unwrap();
    assert_eq!(hits, counted);
    assert!(html.contains("the paper, with boosting: half of the cells at 110 evaluations"));
    let mut other = plan;
    other.campaign.coverage.as_mut().unwrap().hits = 2;
    let folder = tempfile::tempdir().unwrap();
    assert!(!page(&sample::campaign(folder.path(), &other, 20)).unwrap().contains("boosting: half"), "other cells");
}

#[test]
fn an_unfinished_run_without_any_test_has_its_reports() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let recorder = crate::record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let text = summary_text(&summary(recorder.repository()).unwrap(), WIDE);
    assert!(text.starts_with("Front of 0 tests, no requirement violated\n"), "{text}");
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
    let recorder = crate::record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
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
    let mut recorder = crate::record::Recorder::create_for(folder.path(), &plan, task, 1, 1).unwrap();
    let test = plan.tests[0].test.clone();
    let known = sesame_plan::KnownTestId(0);
    match task {
        Task::Repeat { times, .. } => {
            for number in 1..=*times {
                recorder.commit(&sample::record(&plan, number, crate::record::Origin::Search, test.clone())).unwrap();
            }
        }
        _ => recorder.commit(&sample::record(&plan, 1, crate::record::Origin::Known(known), test)).unwrap(),
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
}

#[test]
fn known_tests_are_compared_with_what_they_expect() {
    let (_folder, repository) = instead(&Task::Known { tests: vec![sesame_plan::KnownTestId(0)] });
    insta::assert_snapshot!("known", summary_text(&summary(&repository).unwrap(), WIDE));
    let html = page(&repository).unwrap();
    assert!(parsed(&html).descendants().any(|node| node.text() == Some("= 49.00000000000001 s")));
}

#[test]
fn a_large_campaign_stays_a_page_of_a_few_megabytes() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = crate::record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let mut record = sample::record(&plan, 0, crate::record::Origin::Search, plan.tests[0].test.clone());
    for metric in &mut record.observation.metrics {
        metric.series = (0..2000u32).map(|n| (f64::from(n) * 0.035, f64::from(n * 7919 % 1000))).collect();
    }
    let many = 40;
    for number in 0..500 {
        record.number = number;
        record.observation.metrics[0].value = Some(f64::from(number % 97));
        record.observation.metrics[1].value = Some(f64::from(number % 89));
        if number == many {
            record.observation.metrics.iter_mut().for_each(|metric| metric.series.clear());
        }
        recorder.commit(&record).unwrap();
    }
    let members = (0..many).collect();
    let status = crate::record::Status::Final;
    recorder
        .put_result_set(&crate::record::ResultSet { name: "front".to_owned(), generation: None, status, members })
        .unwrap();
    let html = page(recorder.repository()).unwrap();
    assert!(html.len() < 4_000_000, "{} bytes", html.len());
    assert!(html.contains("24 of the 40 tests on the front"));
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

/// The sample's campaign, which confirms by three runs each: some findings come again always, some sometimes, some never.
fn confirmed() -> (tempfile::TempDir, Repository) {
    use sesame_base::observation::Outcome;

    use crate::record::{MetricValue, Recorder, Repetition};

    let folder = tempfile::tempdir().unwrap();
    let mut plan = sample::plan();
    plan.campaign.confirm =
        Some(sesame_plan::Confirmation { times: 3, by: sesame_plan::Statistic::Mean, violations: false });
    let first = sample::campaign(folder.path(), &plan, 60);
    let members = first.latest_result_set().unwrap().unwrap().members;
    let rows = first.tests().unwrap();
    drop(first);
    let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
    let crash = members.len() - 1;
    for (at, &test) in members.iter().enumerate() {
        for position in 1..=3 {
            let mut values = rows[test as usize].values.clone();
            let mut outcome = Outcome::Completed;
            match (at, position) {
                (1, 2) => values.iter_mut().for_each(|it| *it = MetricValue::default()),
                (2, _) | (4, 2) => {
                    values[0] = MetricValue::whole(Some(0.0), false);
                    values[2] = MetricValue::whole(Some(1.0), true);
                    values[3] = MetricValue::whole(Some(60.0), true);
                    values[4] = MetricValue::whole(Some(200.0), true);
                }
                (at, 3) if at == crash => outcome = Outcome::Crash { message: "it fell over".to_owned() },
                _ => {}
            }
            let seed = u64::from(position);
            let run = Repetition { test, position, simulator_seed: seed, outcome, end: 70.0, messages: 1, values };
            recorder.put_repetition(&run, &[]).unwrap();
        }
    }
    // A crash is a finding too, whether or not a front has it.
    let crash = || Outcome::Crash { message: "index out of bounds".to_owned() };
    for (position, outcome) in [(4, crash()), (5, Outcome::Completed)] {
        let values = rows[17].values.clone();
        let run = Repetition { test: 17, position, simulator_seed: 9, outcome, end: 70.0, messages: 1, values };
        recorder.put_repetition(&run, &[]).unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    (folder, repository)
}

#[test]
fn findings_that_were_run_again_say_how_often_they_came_again() {
    let (_folder, repository) = confirmed();
    let summary = summary(&repository).unwrap();
    insta::assert_snapshot!("confirmed_summary", summary_text(&summary, WIDE));
    let first = summary.confirmed[0].clone();
    insta::assert_snapshot!("confirmed_test", test_text(&show(&repository, &first.test).unwrap(), WIDE));
    insta::assert_snapshot!("confirmed_tests", confirmed_text(&summary.confirmed, WIDE));
    let standings: std::collections::BTreeSet<&str> =
        summary.confirmed.iter().filter_map(|test| test.standing).map(Standing::words).collect();
    assert_eq!(standings.into_iter().collect::<Vec<_>>(), ["confirmed", "flaky", "not confirmed"]);
    let junit = junit(&summary);
    assert!(junit.contains("; in fresh runs: T"), "{junit}");
    let page = page(&repository).unwrap();
    parsed(&page);
    assert!(page.contains("Values are means of 3 fresh runs of each test.") && page.contains("not confirmed"));
}

#[test]
fn the_views_of_findings_agree_with_the_report() {
    let (folder, repository) = confirmed();
    let summary = summary(&repository).unwrap();
    let count = |count: usize| u32::try_from(count).unwrap();
    let is_failure = |finding: &str| ["crash", "timeout"].contains(&finding);
    let mut told = Vec::new();
    for test in &summary.confirmed {
        for it in test.findings.iter().filter(|it| !is_failure(&it.finding)) {
            told.push((
                test.number,
                it.finding.clone(),
                count(it.again),
                count(it.conclusive),
                count(test.repetitions),
            ));
        }
    }
    assert!(told.len() > 3);
    let open = rusqlite::Connection::open(folder.path().join(crate::record::DATABASE)).unwrap();
    let mut statement =
        open.prepare("SELECT test, requirement, confirmed, conclusive, repetitions FROM confirmations").unwrap();
    let rows =
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?))).unwrap();
    assert_eq!(rows.collect::<Result<Vec<(u32, String, u32, u32, u32)>, _>>().unwrap(), told);

    // What each test violates, crashes that stand among it.
    let mut told: Vec<(String, String)> = list(&repository)
        .unwrap()
        .tests
        .into_iter()
        .filter(|test| test.duplicate_of.is_none())
        .flat_map(|test| test.violates.into_iter().map(move |requirement| (test.test.clone(), requirement)))
        .collect();
    let failures = summary.failures.iter().filter(|failure| failure.stands());
    told.extend(failures.map(|failure| (failure.test.clone(), failure.outcome.clone())));
    told.sort();
    let mut statement = open.prepare("SELECT test_name, coalesce(requirement, finding) FROM findings").unwrap();
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    let mut found = rows.collect::<Result<Vec<(String, String)>, _>>().unwrap();
    found.sort();
    assert_eq!(found, told);
}

/// The results of a test that violates R1 in exactly these of its runs, the first one and fresh ones; `None` is a crash at the
/// very beginning.
fn run_again(first: bool, fresh: &[Option<bool>]) -> (tempfile::TempDir, Repository) {
    use sesame_base::observation::{MetricObservation, Outcome};

    use crate::record::{MetricValue, Recorder, Repetition};

    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    let collisions = |violates: bool| MetricValue::whole(Some(f64::from(u8::from(violates))), true);
    let reference = sample::record(&plan, 0, Origin::Reference, sesame_plan::Test::default());
    recorder.commit(&reference).unwrap();
    let mut record = sample::record(&plan, 1, Origin::Known(sesame_plan::KnownTestId(0)), plan.tests[0].test.clone());
    record.observation.metrics = reference.observation.metrics.clone();
    record.observation.metrics[0] = MetricObservation::whole(collisions(first).value, true, Vec::new());
    recorder.commit(&record).unwrap();
    for (position, violates) in (1..).zip(fresh) {
        let mut values: Vec<MetricValue> =
            record.observation.metrics.iter().map(|shown| MetricValue::whole(shown.value, shown.set)).collect();
        values[0] = collisions(*violates == Some(true));
        let mut outcome = Outcome::Completed;
        if violates.is_none() {
            values.clear();
            outcome = Outcome::Crash { message: "it fell over".to_owned() };
        }
        let seed = u64::from(position);
        let run = Repetition { test: 1, position, simulator_seed: seed, outcome, end: 70.0, messages: 1, values };
        recorder.put_repetition(&run, &[]).unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    (folder, repository)
}

#[test]
fn a_requirement_that_only_the_first_run_satisfied_is_violated_in_every_report() {
    let (_folder, repository) = run_again(false, &[Some(true), Some(true), Some(false), Some(true)]);
    let summary = summary(&repository).unwrap();
    let r1 = &summary.requirements[0];
    assert_eq!((r1.violated, r1.flaky, r1.fresh_only, r1.satisfied), (1, 1, 1, 0));
    assert!(headline(&summary).contains("1 requirement violated (R1 by 1 test)"), "{}", headline(&summary));
    let said = "3 of 4 (0.30–0.95) flaky, not in its first run";
    assert_eq!(summary.confirmed[0].words(), format!("R1 {said}"));
    assert_eq!(list(&repository).unwrap().tests[1].violates, ["R1"]);
    let text = test_text(&show(&repository, "T1").unwrap(), WIDE);
    assert!(text.contains(said) && text.contains("3 of 4 (0.30–0.95)"), "{text}");
    let junit = junit(&summary);
    assert!(junit.contains("<failure message=\"violated by 1 test") && junit.contains(said), "{junit}");
    assert!(page(&repository).unwrap().contains(">1 flaky<"));
}

#[test]
fn a_violation_that_no_fresh_run_shows_fails_nothing_and_stays_listed() {
    let (_folder, repository) = run_again(true, &[Some(false), None, Some(false)]);
    let summary = summary(&repository).unwrap();
    let r1 = &summary.requirements[0];
    assert_eq!((r1.violated, r1.not_confirmed, r1.satisfied), (0, 1, 1));
    let text = summary_text(&summary, WIDE);
    assert!(text.contains("1 not confirmed"), "{text}");
    assert_eq!(summary.confirmed[0].findings[0].words(), "0 of 2 (0.00–0.66) not confirmed, 1 run inconclusive");
    let junit = junit(&summary);
    assert!(!junit.contains("<failure") && junit.contains("T1 0 of 2"), "{junit}");
    // The crash of a fresh run is a finding, though the first run came to its end.
    assert_eq!(summary.failures.iter().filter(|failure| failure.stands()).count(), 1);
}

#[test]
fn violations_that_were_seen_in_one_run_only_are_counted() {
    let (_folder, repository) = confirmed();
    let found = summary(&repository).unwrap();
    let rows = list(&repository).unwrap().tests;
    let again: Vec<&str> = found.confirmed.iter().map(|test| test.test.as_str()).collect();
    let once = rows.iter().filter(|row| {
        !row.violates.is_empty()
            && row.duplicate_of.is_none()
            && row.origin != "reference"
            && !again.contains(&row.test.as_str())
    });
    let sentence = format!("{} tests that violate a requirement were run once only", once.count());
    assert!(summary_text(&found, WIDE).contains(&sentence), "{sentence}");
    assert!(page(&repository).unwrap().contains(&sentence));
}

/// A page with all that pages have: fronts by generation, the map of cells, regions, timelines.
fn full_page() -> String {
    let folder = tempfile::tempdir().unwrap();
    let html = page(&sample::campaign_with_fronts(folder.path(), &plan_on_the_published_grid(), 60)).unwrap();
    for part in ["data-fronts", "data-cells", "class=\"regions\"", "class=\"test\""] {
        assert!(html.contains(part), "the page has no {part}");
    }
    html
}

#[test]
fn the_page_permits_its_own_style_and_script_and_nothing_else() {
    let html = full_page();
    let document = parsed(&html);
    let texts = |element: &str| -> Vec<String> {
        let of = document.descendants().filter(|node| node.tag_name().name() == element);
        of.inspect(|node| assert_eq!(node.attributes().len(), 0)).map(|node| node.text().unwrap().to_owned()).collect()
    };
    assert_eq!((texts("style").len(), texts("script").len()), (1, 1));
    // The hashes of what is emitted, by another way to write them.
    let hash = |element: &str| {
        let text = html.split_once(&format!("<{element}>")).unwrap().1.split_once(&format!("</{element}>")).unwrap().0;
        let bits = sha2::Sha256::digest(text).iter().map(|byte| format!("{byte:08b}")).collect::<Vec<_>>().concat();
        let digits: Vec<char> = ('A'..='Z').chain('a'..='z').chain('0'..='9').chain(['+', '/']).collect();
        let six = |at: usize| usize::from_str_radix(&format!("{:0<6}", &bits[at..(at + 6).min(256)]), 2).unwrap();
        format!("{}=", (0..256).step_by(6).map(|at| digits[six(at)]).collect::<String>())
    };
    let expected = format!(
        "default-src 'none'; style-src 'sha256-{}'; script-src 'sha256-{}'; base-uri 'none'; form-action 'none'",
        hash("style"),
        hash("script")
    );
    let meta = document.descendants().find(|node| node.has_attribute("http-equiv")).unwrap();
    assert_eq!(meta.attribute("http-equiv"), Some("Content-Security-Policy"));
    assert_eq!(meta.attribute("content"), Some(expected.as_str()));
    let before = |it: &&roxmltree::Node<'_, '_>| matches!(it.tag_name().name(), "style" | "script" | "title");
    let first = document.descendants().find(|node| before(&node)).unwrap();
    assert!(meta.range().end < first.range().start, "a policy holds for what follows it");
    // What the policy would keep from working.
    for node in document.descendants() {
        for attribute in node.attributes() {
            let name = attribute.name();
            assert!(name != "style" && name != "src" && !name.starts_with("on"), "{name} in {:?}", node.tag_name());
        }
    }
}

#[test]
fn a_browser_finds_nothing_on_the_page_that_its_policy_forbids() {
    let Some(browser) = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| {
        std::process::Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success())
    }) else {
        println!("skipped: there is no Chromium to open the page with");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let opened = |name: &str, html: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, html).unwrap();
        let output = std::process::Command::new(browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom"])
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg(format!("file://{}", file.display()))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let refused = said.lines().filter(|line| line.contains("Content Security Policy")).count();
        (String::from_utf8_lossy(&output.stdout).into_owned(), refused)
    };
    let html = full_page();
    assert!(!html.contains("<select"));
    let (shown, refused) = opened("page.html", &html);
    assert!(shown.contains("<select"), "the script did its work: {shown}");
    assert_eq!(refused, 0);
    // It is looked for where it would be: what has no hash is refused, and does nothing.
    let foreign = "<script>document.title = 'taken'</script><p style=\"color: red\" onclick=\"1\">x</p>\
                   <img src=\"data:image/gif;base64,R0lGODlhAQABAAAAACw=\"/>";
    let (shown, refused) = opened("foreign.html", &html.replace("<main>", &format!("<main>{foreign}")));
    assert!(!shown.contains("<title>taken"));
    assert!(refused >= 3, "{refused}");
}
