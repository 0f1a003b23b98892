//! A page of a made-up study: what it holds, and its figures as files.

use std::collections::BTreeSet;

use sesame_analysis::choice::Choosing;
use sesame_analysis::gap::{gap, gap_after, points};
use sesame_analysis::sample::{study, tolerant};
use sesame_analysis::traces::{Signal, Signals, TracedTest, compare};
use sesame_analysis::{Selection, Terms, candidates};
use sesame_plan::{Dimension, Lab, LabBudget, MetricId, RankKey, RankOrder};

use crate::study::{Figure, Space, Study, Traces};

/// The page of a study with a gap that is local and one that a compensation takes away, and its figures.
pub(crate) fn page() -> (String, Vec<Figure>) {
    let folder = tempfile::tempdir().unwrap();
    let (runs, campaign) =
        study(folder.path(), |value, t1| if t1 > 0.5 { value - 3.0 } else { value }, |value, _| value + 4.0);
    let over = vec![Dimension::T1, Dimension::T2, Dimension::P1];
    let key = |metric, order| RankKey { metric: MetricId(metric), order };
    let lab = Lab {
        name: "hall </script>".to_owned(),
        doc: "Where robots are <real>.".to_owned(),
        rank: vec![key(0, RankOrder::Descending), key(1, RankOrder::Ascending)],
        budget: Some(LabBudget { limit: 5.0, lambda: 0.5, over: over.clone() }),
        ..tolerant()
    };
    let plan = campaign.plan();
    let terms = Terms::of_lab(plan, &lab).unwrap();
    let found = candidates(&campaign, &Selection::default(), &terms).unwrap();
    let none = BTreeSet::new();
    let choosing = Choosing::new(&found, &terms, 0.5, &none).unwrap();
    let (best, sweep) = (choosing.best(&mut || false), choosing.sweep(&mut || false));
    let before = gap(&campaign, &runs, Some(&lab)).unwrap();
    let after = gap_after(&campaign, &runs, &runs, Some(&lab)).unwrap();
    let others = vec![vec![0.1, 0.2, 0.3], vec![0.9, 0.4, 0.5]];
    let space = Space::new(plan, &terms, &choosing, &sweep, 0.5, &before.tests[..4], &others);

    let tests: BTreeSet<u32> = before.tests.iter().copied().take(3).collect();
    let at = points(&campaign, &tests, &over).unwrap();
    let traced = |later: f64| -> Vec<TracedTest> {
        let signals = |lag: f64| -> Signals {
            let times: Vec<f64> = (0..300).map(|at| f64::from(at) * 0.02).collect();
            let values = times.iter().map(|time| libm::sin(2.0 * (time - lag))).collect();
            Signals::from([("arm/<joint>".to_owned(), Signal { times, values })])
        };
        let lab = || (1..=3u8).map(|run| signals(later + 0.001 * f64::from(run))).collect();
        tests
            .iter()
            .map(|test| TracedTest { test: *test, at: at[test].clone(), simulation: signals(0.0), lab: lab() })
            .collect()
    };
    let tests = traced(0.1);
    let simulated_after = tests.iter().map(|test| (test.test, test.simulation.clone())).collect();
    let traces = Traces { gap: compare(&tests, &over), tests };
    let sheet = "<section class=\"briefing\">\n<h1>T1 of cell</h1>\n<h2>Stop when</h2>\n<p class=\"empty\">Never.</p>\n</section>\n";
    let study = Study {
        campaign: &campaign,
        lab: &lab,
        labs: &[],
        again: Some(&campaign),
        space: &space,
        choices: &choosing.sweep_table(&sweep),
        chosen: &choosing.table(plan, &terms, &best, &tests_of(&before)),
        gap: Some(&before),
        after: Some(&after),
        traces: Some(&traces),
        simulated_after: &simulated_after,
        sheets: &[sheet.to_owned()],
    };
    study.page().unwrap()
}

fn tests_of(gap: &sesame_analysis::gap::Gap) -> BTreeSet<u32> {
    gap.tests.iter().copied().take(4).collect()
}

#[test]
fn a_page_is_well_formed_and_has_every_part_and_nothing_foreign() {
    let (html, figures) = page();
    let text = html.strip_prefix("<!DOCTYPE html>\n").unwrap();
    let document = roxmltree::Document::parse(text).unwrap();
    let ids: Vec<&str> = document.descendants().filter_map(|node| node.attribute("id")).collect();
    for id in ["choice", "space", "space-data", "gap", "traces", "compensation", "provenance", "sheets"] {
        assert_eq!(ids.iter().filter(|known| **known == id).count(), 1, "{id}");
    }
    assert!(html.contains(Study::MARK));
    assert!(!html.contains("http://") && !html.contains("https://") && !html.contains("url("));
    for picture in document.descendants().filter(|node| node.has_tag_name("svg")) {
        assert!(picture.attribute("aria-label").is_some(), "a picture without words");
    }
    assert!(!html.contains("NaN") && !html.contains("inf\""), "coordinates are numbers");
    let drawn = document.descendants().filter(|node| node.has_tag_name("svg")).count();
    assert_eq!(drawn, figures.len());
}

#[test]
fn figures_are_files_that_need_nothing_else() {
    let (_, figures) = page();
    let names: BTreeSet<&str> = figures.iter().map(|figure| figure.name.as_str()).collect();
    assert_eq!(names.len(), figures.len(), "each has a name of its own");
    for name in ["space", "gap-collision_occurrence-T1", "compensation-fuzzing_time"] {
        assert!(names.contains(name), "{name}: {names:?}");
    }
    assert_eq!(names.iter().filter(|name| name.starts_with("trace-T") && name.ends_with("-arm__joint_")).count(), 3);
    for figure in &figures {
        let svg = figure.svg();
        let document = roxmltree::Document::parse(&svg).unwrap_or_else(|error| panic!("{}: {error}", figure.name));
        let root = document.root_element();
        assert_eq!(root.tag_name().namespace(), Some("http://www.w3.org/2000/svg"));
        assert!(root.attribute("width").is_some() && !svg.contains("var(") && !svg.contains("NaN"), "{}", figure.name);
    }
    let local = figures.iter().find(|figure| figure.name == "gap-collision_occurrence-T1").unwrap();
    assert!(local.svg().contains("class=\"local\""), "the range of the gap is tinted");
}
