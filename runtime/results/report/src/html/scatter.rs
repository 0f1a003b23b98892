//! Tests as points in the plane of two objectives, with the front among them.
//!
//! Charts are fluid: places are shares of the width and height, sizes of dots and letters are pixels, so that a chart
//! fills its column on any screen and stays readable on a small one.

use std::fmt::Write as _;

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Direction};
use sesame_present::axis::Axis;
use sesame_present::chart;
use sesame_present::markup::{Markup, coordinate, percent};
use sesame_present::names::{Screen, place_names};
use sesame_present::number::{self, titled, with_unit};
use sesame_record::{Origin, TestRow};

use crate::facts::summary::{Objective, Summary, shown_value};
use crate::facts::wording::operations;

/// One axis of a chart.
#[derive(Debug, Clone)]
pub(crate) struct Dimension {
    /// What is along it, with its unit, as in `fuzzing_time [s]`.
    pub(crate) title: String,
    /// Which way is of interest to a tester.
    pub(crate) direction: Option<Direction>,
}

/// What a point stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Some test.
    Plain,
    /// A test on the front.
    Front,
    /// The reference run.
    Reference,
}

/// A test as a point.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) kind: Kind,
    /// The test's name.
    pub(crate) test: TestNumber,
    /// Its tooltip.
    pub(crate) title: String,
    /// Whether the page has a timeline of it to jump to.
    pub(crate) linked: bool,
}

/// How much a chart shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Detail {
    /// Whether points of the front carry their names and are joined by a line.
    pub(crate) named: bool,
    /// Plain points drawn at most; beyond that, of points close together one stands for all.
    pub(crate) points: usize,
}

/// Draws a chart.
pub(crate) fn scatter(markup: &mut Markup, x: &Dimension, y: &Dimension, points: &[Point], detail: Detail) {
    let horizontal = Axis::round(points.iter().map(|point| point.x), 7);
    let vertical = Axis::round(points.iter().map(|point| point.y), 5);
    let place = |point: &Point| (horizontal.share(point.x), 1.0 - vertical.share(point.y));
    markup.open("div", &[("class", if detail.named { "chart" } else { "chart small" })]);
    markup.element("p", &[("class", "axis-title")], &y.axis_title());
    let label = format!("{} against {}, {} tests", y.title, x.title, points.len());
    markup.open("svg", &[("class", "scatter"), ("role", "img"), ("aria-label", &label)]);
    chart::ticks(markup, &horizontal, &vertical);
    let plain: Vec<&Point> = points.iter().filter(|point| point.kind == Kind::Plain).collect();
    for point in thin(&plain, detail.points, place) {
        dot(markup, point, place(point), "3", "dot");
    }
    let front: Vec<&Point> = points.iter().filter(|point| point.kind == Kind::Front).collect();
    if detail.named {
        step_line(markup, &front, x.direction, place);
    }
    for point in points.iter().filter(|point| point.kind == Kind::Reference) {
        dot(markup, point, place(point), "5", "dot reference");
    }
    for point in &front {
        dot(markup, point, place(point), if detail.named { "6" } else { "4" }, "dot front");
    }
    if detail.named {
        let occupied: Vec<(f64, f64)> = front.iter().map(|point| place(point)).collect();
        names(markup, &front, &occupied, Screen { width: 980.0, height: 400.0 }, "name wide");
        names(markup, &front, &occupied, Screen { width: 300.0, height: 280.0 }, "name narrow");
    }
    markup.close();
    markup.element("p", &[("class", "axis-title below")], &x.axis_title());
    markup.close();
}

/// The tooltip of a dot: the test, its operations, and the values of its objectives.
pub(crate) fn dot_title(plan: &CampaignPlan, summary: &Summary, row: &TestRow) -> String {
    let values = summary.objectives.iter().enumerate().map(|(at, objective)| {
        let value = shown_value(summary, row, at).map_or("–".to_owned(), number::number);
        format!("{} {}", objective.metric, with_unit(value, objective.unit.as_deref()))
    });
    let values = values.collect::<Vec<String>>().join(", ");
    match row.origin {
        Origin::Reference => format!("reference run: {values}"),
        Origin::Known(_) | Origin::Search => {
            format!("{} ({}): {values}", TestNumber(row.number), operations(plan, row))
        }
    }
}

/// The axis of an objective.
pub(crate) fn dimension(objective: &Objective) -> Dimension {
    let title = titled(&objective.metric, objective.unit.as_deref());
    Dimension { title, direction: Some(objective.direction) }
}

impl Dimension {
    /// The title, and which way is of interest.
    pub(crate) fn axis_title(&self) -> String {
        match self.direction {
            Some(Direction::Maximise) => format!("{}, maximised", self.title),
            Some(Direction::Minimise) => format!("{}, minimised", self.title),
            None => self.title.clone(),
        }
    }
}

fn dot(markup: &mut Markup, point: &Point, (x, y): (f64, f64), radius: &str, class: &str) {
    let (x, y) = (percent(x), percent(y));
    let link = format!("#{}", point.test);
    if point.linked {
        markup.open("a", &[("href", &link)]);
    }
    markup.open("circle", &[("class", class), ("cx", &x), ("cy", &y), ("r", radius)]);
    markup.element("title", &[], &point.title);
    markup.close();
    if point.linked {
        markup.close();
    }
}

/// The edge of what the front dominates: from the best point along the horizontal axis, each step goes to what is
/// worse in both.
fn step_line(markup: &mut Markup, front: &[&Point], x: Option<Direction>, place: impl Fn(&Point) -> (f64, f64)) {
    let mut places: Vec<(f64, f64)> = front.iter().map(|point| place(point)).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    if x == Some(Direction::Maximise) {
        places.reverse();
    }
    let Some(first) = places.first() else { return };
    let mut path = format!("M{} {}", coordinate(first.0 * 1000.0), coordinate(first.1 * 1000.0));
    for (x, y) in &places[1..] {
        let _ = write!(path, "H{}V{}", coordinate(x * 1000.0), coordinate(y * 1000.0));
    }
    markup.open("svg", &[("viewBox", "0 0 1000 1000"), ("preserveAspectRatio", "none"), ("aria-hidden", "true")]);
    markup.leaf("path", &[("class", "front-line"), ("d", &path)]);
    markup.close();
}

/// At most so many points: where there are more, the first of each cell of the finest grid that makes few enough.
fn thin<'a>(points: &[&'a Point], limit: usize, place: impl Fn(&Point) -> (f64, f64)) -> Vec<&'a Point> {
    let mut kept = points.to_vec();
    let mut cells = 256.0;
    while kept.len() > limit.max(1) {
        let mut taken = std::collections::BTreeSet::new();
        kept = points
            .iter()
            .copied()
            .filter(|point| {
                let (x, y) = place(point);
                taken.insert((libm::floor(x * cells).to_bits(), libm::floor(y * cells).to_bits()))
            })
            .collect();
        if cells < 1.0 {
            break;
        }
        cells *= 0.8;
    }
    kept
}

/// Writes the names of points where they cover no other name and no point of the front; a name without such a place
/// is left out (the dot still tells it when pointed at).
fn names(markup: &mut Markup, points: &[&Point], places: &[(f64, f64)], screen: Screen, class: &str) {
    let lengths: Vec<f64> = points.iter().map(|point| point.test.to_string().len() as f64 * 7.5).collect();
    for ((point, (x, y)), placed) in points.iter().zip(places).zip(place_names(places, &lengths, screen)) {
        let Some(placed) = placed else { continue };
        let class = format!("{class}{}", placed.anchor);
        let (x, y, dx, dy) = (percent(*x), percent(*y), coordinate(placed.dx), coordinate(placed.dy));
        let attributes = [("class", class.as_str()), ("x", &x), ("y", &y), ("dx", &dx), ("dy", &dy)];
        markup.element("text", &attributes, &point.test.to_string());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, kind: Kind, number: u32) -> Point {
        let test = TestNumber(number);
        Point { x, y, kind, test, title: format!("{test}: {x}, {y}"), linked: kind == Kind::Front }
    }

    fn along(title: &str, direction: Direction) -> Dimension {
        Dimension { title: title.to_owned(), direction: Some(direction) }
    }

    #[test]
    fn a_small_chart_reads_as_it_should() {
        let points = [
            point(1.0, 0.0, Kind::Front, 1),
            point(4.0, 3.0, Kind::Front, 2),
            point(9.0, 8.0, Kind::Front, 3),
            point(8.0, 2.0, Kind::Plain, 4),
            point(0.0, 0.0, Kind::Reference, 0),
        ];
        let mut markup = Markup::default();
        let detail = Detail { named: true, points: 100 };
        let (x, y) = (along("fuzzing_time [s]", Direction::Minimise), along("hits", Direction::Maximise));
        scatter(&mut markup, &x, &y, &points, detail);
        insta::assert_snapshot!("scatter", markup.finish().replace("><", ">\n<"));
    }

    #[test]
    fn many_points_are_thinned_and_the_front_is_not() {
        let mut points: Vec<Point> =
            (0..10_000u32).map(|n| point(f64::from(n % 100), f64::from(n / 100), Kind::Plain, 9)).collect();
        points.extend((0..50).map(|n| point(f64::from(n), f64::from(n), Kind::Front, 1)));
        let mut markup = Markup::default();
        let (x, y) = (along("x", Direction::Minimise), along("y", Direction::Maximise));
        scatter(&mut markup, &x, &y, &points, Detail { named: true, points: 800 });
        let text = markup.finish();
        assert_eq!(text.matches("\"dot front\"").count(), 50);
        assert!((300..=800).contains(&text.matches("\"dot\"").count()));
    }
}
