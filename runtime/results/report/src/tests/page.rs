//! The page, as a browser and any XML parser see it.

use sesame_base::visible::is_hidden;
use sha2::Digest as _;

use super::*;

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
    let mut tests = document.descendants().filter(|node| node.attribute("class") == Some("test"));
    let mut next = || tests.next().unwrap().attribute("id").unwrap().to_owned();
    let found = causes(&repository).unwrap();
    let worst = found.worst().unwrap();
    assert_eq!(
        [next(), next()],
        [worst.test.to_string().as_str(), "T0"],
        "the test that shows the worst cause, then the reference run"
    );
    assert!(found.causes.iter().all(|cause| cause.requirement != worst.requirement || cause.outside <= worst.outside));
    let section = document.descendants().find(|node| node.text() == Some("Causes") && node.has_tag_name("h2")).unwrap();
    let paragraph = section.parent().unwrap().children().find(|node| node.has_tag_name("p")).unwrap();
    let said = paragraph.text().unwrap();
    assert!(said.starts_with(&format!("{}: {} (", worst.requirement, worst.text)), "{said}");
    assert!(said.ends_with(", in "), "{said}");
    let link = paragraph.children().find(|node| node.has_tag_name("a")).expect("a link to the worst test");
    assert!(link.next_sibling().unwrap().text().unwrap().starts_with(": "), "what it does");
    let contents = document.descendants().find(|node| node.attribute("class") == Some("contents")).unwrap();
    let sections: Vec<&str> = contents.children().filter_map(|link| link.text()).collect();
    assert_eq!(sections.first(), Some(&"Causes"));
    assert_eq!(sections.last(), Some(&"About this run"));
    assert_eq!(sections.len(), document.descendants().filter(|node| node.has_tag_name("h2")).count());
}

#[test]
fn hostile_names_are_shown_and_nothing_more() {
    // A plan whose names have control characters is not read.
    let name = "<script>alert('1')</script>\" onload=\"x\" {{body}} &";
    let hostile = format!("{name} \u{1b}[31m\u{202E}");
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
    let scripts: Vec<_> = document.descendants().filter(|node| node.tag_name().name() == "script").collect();
    let types: Vec<_> = scripts.iter().map(|script| script.attribute("type")).collect();
    assert_eq!(types, [Some("application/json"), None], "only our own");
    // An HTML parser ends a script where it finds an end tag, whatever stands around it.
    assert_eq!(html.to_lowercase().matches("</script").count(), 2);
    let data: serde_json::Value = serde_json::from_str(scripts[0].text().unwrap()).unwrap();
    assert_eq!(data["operations"][0], format!("0{name}"));
    assert!(document.descendants().all(|node| node.attribute("onload").is_none()));
    assert!(html.contains("&lt;script&gt;alert") && !html.contains(|c| is_hidden(c) && !matches!(c, '\n' | '\t')));
    assert!(document.descendants().any(|node| node.tag_name().name() == "h1" && node.text() == Some(name)));
    let tame = format!("{name} \u{FFFD}[31m\u{FFFD}");
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
    let reach: Vec<u64> = data["reach"].as_array().unwrap().iter().map(|value| value.as_u64().unwrap()).collect();
    assert_eq!(reach.iter().sum::<u64>(), 108);
    assert_eq!(reach.iter().skip(1).step_by(2).sum::<u64>(), summary.feasible as u64);
    // The worst values are those that a look at every test finds.
    let grid = sesame_search::coverage::Grid::new(plan.campaign.coverage.as_ref().unwrap().axes.clone()).unwrap();
    let collisions =
        data["metrics"].as_array().unwrap().iter().position(|metric| metric["name"] == "collision_occurrence");
    let column = 2 + 2 * collisions.unwrap();
    let mut counted = 0;
    repository
        .scan(&mut |test| {
            let point = test.covering_point(&plan, sesame_search::sspr::Convention::Ours);
            let Some(cell) = point.and_then(|point| grid.cell_of(&point)) else { return };
            if test.origin == sesame_record::Origin::Reference {
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
fn a_large_campaign_stays_a_page_of_a_few_megabytes() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = sesame_record::Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let mut record = sample::record(&plan, 0, sesame_record::Origin::Search, plan.tests[0].test.clone());
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
    let status = sesame_record::Status::Final;
    recorder
        .put_result_set(&sesame_record::ResultSet { name: "front".to_owned(), generation: None, status, members })
        .unwrap();
    let html = page(recorder.repository()).unwrap();
    assert!(html.len() < 4_000_000, "{} bytes", html.len());
    assert!(html.contains("24 of the 40 tests on the front"));
}

/// A page with all that pages have: fronts by generation, the map of cells, regions, timelines.
pub(super) fn full_page() -> String {
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
        // What is data for a browser is never run.
        let of = of.filter(|node| node.attribute("type") != Some("application/json"));
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
    let before = |node: &&roxmltree::Node<'_, '_>| matches!(node.tag_name().name(), "style" | "script" | "title");
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
fn where_tests_fail_is_shown_by_requirement_and_for_each_of_its_causes() {
    let folder = tempfile::tempdir().unwrap();
    let html = page(&sample::campaign(folder.path(), &sample::plan(), 300)).unwrap();
    let (_, section) = html.split_once("<section id=\"regions\">").unwrap();
    let (section, _) = section.split_once("</section>").unwrap();
    let headings = section.split("<h3>").skip(1).filter_map(|rest| rest.split_once("</h3>"));
    let headings: Vec<&str> = headings.map(|(heading, _)| heading).collect();
    let expected = [
        "R1: 150 of 298 tests fail",
        "R1, jitter_link1: 12 of 46 tests fail",
        "R1, lose_link0: 6 of 24 tests fail",
        "R3: 23 of 297 tests fail",
    ];
    assert_eq!(headings, expected, "trees without a question are left out");
}
