//! The reduction and coverage on the original platform's own data, where it is at hand: `SESAME_LEGACY_DIR` names the
//! folder of its files. Without it these tests say so and check nothing; the numbers of our own beside them always run.

#![expect(clippy::disallowed_methods, reason = "reads data of the original platform")]

use std::path::PathBuf;

use roxmltree::{Document, Node};

use sesame_plan::{ChoiceKind, Dimension, GridAxis, Span};

use crate::coverage::{Coverage, Grid};
use crate::sspr::{Class, Convention, Disturbance, Intensity, Point};

/// A test of the original platform: its name and what it disturbs.
struct Performed {
    name: String,
    disturbances: Vec<Disturbance>,
}

/// The text of a file; `None`, with a word on it, where there is none.
fn read(file: &str) -> Option<String> {
    let Some(folder) = std::env::var_os("SESAME_LEGACY_DIR") else {
        eprintln!("skipped: SESAME_LEGACY_DIR is not set");
        return None;
    };
    let path = PathBuf::from(folder).join(file);
    Some(std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// An attribute that is a number; what has its default is left out there.
fn number(node: &Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).map_or(0.0, |text| text.parse().expect("numbers are written as numbers"))
}

/// The tests that a campaign performed, each of operations that shift values.
fn performed(text: &str, campaign: &str) -> Vec<Performed> {
    let document = Document::parse(text).expect("the file is well-formed");
    let named = |node: &Node<'_, '_>, tag: &str| node.tag_name().name() == tag;
    let id = ("http://www.omg.org/XMI", "id");
    let bounds = |operation: &Node<'_, '_>| {
        let activation =
            operation.children().find(|element| named(element, "activation")).expect("an operation has a window");
        let values = operation.children().find(|element| named(element, "valueSet")).expect("an operation has a range");
        let window = Span { start: number(&activation, "startTime"), end: number(&activation, "endTime") };
        (window, (number(&values, "lowerBound"), number(&values, "upperBound")))
    };
    let found = document
        .descendants()
        .find(|element| named(element, "campaigns") && element.attribute("name") == Some(campaign));
    let tests = found.expect("the campaign is there").children().filter(|element| named(element, "performedTests"));
    let disturbance = |operation: Node<'_, '_>| {
        let template = operation.attribute("fromTemplate").expect("an operation comes from a template");
        let template = document.descendants().find(|element| element.attribute(id) == Some(template));
        let (window, permitted) = bounds(&template.expect("the template is there"));
        let (interval, chosen) = bounds(&operation);
        let parameters = vec![Intensity { permitted, chosen, shape: ChoiceKind::Range }];
        Disturbance { class: Class::Value, window, intervals: vec![interval], parameters }
    };
    tests
        .map(|test| Performed {
            name: test.attribute("name").expect("a test has a name").to_owned(),
            disturbances: test.children().filter(|element| named(element, "operations")).map(disturbance).collect(),
        })
        .collect()
}

#[test]
fn the_originals_table_of_reduced_tests_is_reproduced() {
    let Some(table) = read("kuka-coverage-ga.sspr.csv") else { return };
    let tests = performed(&read("kuka-coverage-ga.model").expect("both files are there"), "coverageExperiment");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), tests.len()), (220, 220));
    let mut farthest: f64 = 0.0;
    for (row, test) in rows.iter().zip(&tests) {
        assert_eq!(row[0], test.name);
        let point = Point::from_disturbances(&test.disturbances, Convention::Original).expect("every test has windows");
        for (dimension, written) in Dimension::ALL.into_iter().zip(&row[2..11]) {
            let written: f64 = written.parse().expect("a number");
            farthest = farthest.max((written - point.get(dimension).expect("every test has parameters")).abs());
        }
    }
    assert!(farthest < 1e-12, "{farthest}");
}

/// Covered cells of the paper's grid (its Table 3) after so many tests.
fn covered(tests: &[Performed], after: &[usize]) -> Vec<usize> {
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    let axes = vec![axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6), axis(Dimension::P1, 1.0, 3)];
    let mut coverage = Coverage::new(Grid::new(axes).expect("it is a grid"), 1);
    let mut curve = Vec::new();
    for test in tests {
        coverage
            .add(&Point::from_disturbances(&test.disturbances, Convention::Original).expect("every test has windows"));
        curve.push(coverage.covered());
    }
    after.iter().map(|&tests| curve[tests - 1]).collect()
}

#[test]
fn the_originals_coverage_curves_are_reproduced() {
    let Some(example) = read("kuka-coverage-ga-example.model") else { return };
    assert_eq!(covered(&performed(&example, "coverageExperiment"), &[110, 210]), [45, 54]);
    let other = read("kuka-coverage-ga.model").expect("both files are there");
    assert_eq!(covered(&performed(&other, "coverageExperiment"), &[210, 220]), [53, 55]);
}
