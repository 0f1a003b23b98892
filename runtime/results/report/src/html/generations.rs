//! How a search went, generation by generation: its indicators over evaluations, and its fronts.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sesame_analysis::{Indicator, IndicatorAnalysis, indicators};
use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_optimise::front::Front;
use sesame_plan::Direction;
use sesame_present::axis::Axis;
use sesame_present::chart::{self, evenly};
use sesame_present::markup::{Markup, coordinate, percent};
use sesame_present::number::{self, plural};
use sesame_record::{RecordError, Repository, TestRow};
use sesame_search::fitness_of;

use crate::facts::summary::{Summary, shown_value};
use crate::html::scatter::{dimension, dot_title};

/// Points of a line at most, evenly chosen: more than a chart has pixels would show nothing new.
const POINTS: usize = 400;
/// Places of a chart that say their values when pointed at.
const HINTS: usize = 60;
/// Fronts among which the page's slider moves at most, evenly chosen.
const FRONTS: usize = 100;
/// Fronts drawn as lines at once, and shades of blue.
const SHADES: usize = 5;
/// Pairs of objectives for which fronts are drawn.
const PAIRS: usize = 3;
/// Dots drawn at most, over all pairs: of more evenly chosen ones.
const DOTS: usize = 1500;

/// Draws indicators and fronts by generation, of a search that has had two generations.
pub(crate) fn generations(
    markup: &mut Markup,
    repository: &Repository,
    summary: &Summary,
    rows: &[TestRow],
    drawn: &[u32],
) -> Result<(), RecordError> {
    if summary.objectives.is_empty() {
        return Ok(());
    }
    let mut analysis = indicators(repository, None)?;
    // An imported campaign has two sets for the same evaluations: all survivors, and the front among them.
    let imported: Vec<Indicator> = std::mem::take(&mut analysis.generations);
    for generation in imported {
        match analysis.generations.last_mut() {
            Some(last) if last.evaluations == generation.evaluations => *last = generation,
            _ => analysis.generations.push(generation),
        }
    }
    analysis.generations.retain(|generation| generation.evaluations.is_some());
    if analysis.generations.len() < 2 {
        return Ok(());
    }
    markup.open("section", &[("id", "generations")]);
    markup.heading("By generation");
    fronts(markup, repository, summary, rows, drawn)?;
    markup.open("div", &[("class", "charts two")]);
    charts(markup, &analysis);
    markup.close();
    markup.element("p", &[("class", "quiet")], &caption(&analysis));
    markup.close();
    Ok(())
}

fn caption(analysis: &IndicatorAnalysis) -> String {
    let mut text = String::new();
    if !analysis.reference.is_empty() {
        let point: Vec<String> =
            analysis.reference.iter().map(|(metric, value)| format!("{metric} {}", number::number(*value))).collect();
        let _ = write!(text, "Hypervolumes are measured from {}; more is better. ", number::join_words(&point));
    }
    if analysis.generations.iter().any(|generation| generation.standard_error.is_some()) {
        let share = |generation: &Indicator| {
            generation.hypervolume.zip(generation.standard_error).map(|(volume, error)| error / volume)
        };
        let worst = analysis.generations.iter().filter_map(share).fold(0.0, f64::max);
        let _ = write!(
            text,
            "Some of them are estimates with standard errors of {} of the value at most, as exact ones would have taken \
             too long. ",
            percent(worst)
        );
    }
    text.push_str(
        "IGD⁺ is how far a front is, on average, from the front of all tests, in shares of its extent; less is better.",
    );
    text
}

const HYPERVOLUME: &str = "hypervolume";

/// A line of a chart: its class, what it is called where there are several, and its value after each generation.
type Line<'a> = (&'static str, &'static str, &'a dyn Fn(&Indicator) -> Option<f64>);

/// A line with something to draw: its class, its name, and its points.
type DrawnLine = (&'static str, &'static str, Vec<(f64, f64)>);

fn charts(markup: &mut Markup, analysis: &IndicatorAnalysis) {
    chart(markup, analysis, HYPERVOLUME, &[("line", HYPERVOLUME, &|generation| generation.hypervolume)]);
    chart(markup, analysis, "IGD⁺ to the final front", &[("line", "IGD⁺", &|generation| generation.igd_plus)]);
    chart(
        markup,
        analysis,
        "tests on the front",
        &[("line", "on the front", &|generation| Some(f64::from(generation.front)))],
    );
    let share = |count: Option<u32>, generation: &Indicator| {
        let all = generation.evaluations.filter(|&all| all > 0)?;
        Some(100.0 * f64::from(count?) / f64::from(all))
    };
    let no_effect = |generation: &Indicator| share(generation.no_effect, generation);
    let duplicates =
        |generation: &Indicator| share(generation.evaluations?.checked_sub(generation.unique?), generation);
    let failed = |generation: &Indicator| {
        share(generation.crashes.zip(generation.timeouts).map(|(crashes, timeouts)| crashes + timeouts), generation)
    };
    chart(
        markup,
        analysis,
        "share of all tests so far [%]",
        &[
            ("line no-effect", "no effect", &no_effect),
            ("line same", "duplicates", &duplicates),
            ("line bad", "failed", &failed),
        ],
    );
}

/// Draws a chart over evaluations; nothing where there are no values, or nothing but zeros.
fn chart(markup: &mut Markup, analysis: &IndicatorAnalysis, title: &str, lines: &[Line<'_>]) {
    let place = |generation: &Indicator| f64::from(generation.evaluations.unwrap_or_default());
    let mut drawn: Vec<DrawnLine> = Vec::new();
    for &(class, name, value) in lines {
        let points: Vec<(f64, f64)> = analysis
            .generations
            .iter()
            .filter_map(|generation| Some((place(generation), value(generation)?)))
            .collect();
        if points.iter().any(|point| point.1 != 0.0) {
            drawn.push((class, name, evenly(&points, POINTS)));
        }
    }
    if drawn.is_empty() {
        return;
    }
    let across = Axis::exact(0.0, analysis.generations.last().map_or(1.0, place), 5);
    // A hypervolume has no meaningful zero: it depends on where it is measured from.
    let zero = (title != HYPERVOLUME).then_some(0.0);
    let heights = drawn.iter().flat_map(|(_, _, points)| points.iter().map(|point| point.1));
    let up = Axis::round(heights.chain(zero), 4);
    markup.open("div", &[("class", "chart small")]);
    markup.open("p", &[("class", "axis-title")]);
    markup.text(title);
    if lines.len() > 1 {
        for (class, name, _) in &drawn {
            markup.element("span", &[("class", &class.replace("line", "key"))], name);
        }
    }
    markup.close();
    let ends: Vec<String> = drawn
        .iter()
        .filter_map(|(_, name, points)| Some(format!("{name} {}", number::number(points.last()?.1))))
        .collect();
    let label = format!("{title} over evaluations; at the end {}", number::join_words(&ends));
    markup.open("svg", &[("class", "scatter"), ("role", "img"), ("aria-label", &label)]);
    chart::ticks(markup, &across, &up);
    let paths: Vec<(&str, &[(f64, f64)])> =
        drawn.iter().map(|(class, _, points)| (*class, points.as_slice())).collect();
    chart::steps(markup, &across, &up, &paths);
    let mut left = 0.0;
    for indicator in evenly(&analysis.generations, HINTS) {
        let right = across.share(place(&indicator));
        let values: Vec<String> = lines
            .iter()
            .filter_map(|(_, name, value)| Some(format!("{name} {}", number::number(value(&indicator)?))))
            .collect();
        let named = indicator.generation.map_or(String::new(), |generation| format!("generation {generation}, "));
        let tests = plural(indicator.evaluations.unwrap_or_default() as usize, "test", "tests");
        let (x, width) = (percent(left), percent((right - left).max(0.0)));
        markup.open("rect", &[("class", "hint"), ("x", &x), ("y", "0"), ("width", &width), ("height", "100%")]);
        markup.element("title", &[], &format!("{named}{tests}: {}", values.join(", ")));
        markup.close();
        left = right;
    }
    markup.close();
    markup.element("p", &[("class", "axis-title below")], "evaluations");
    markup.close();
}

/// The front after some generation.
struct GenerationFront {
    generation: u32,
    members: Vec<u32>,
}

/// A test that was on a front: from which to which of those that are shown, counted from 0.
#[derive(Clone, Copy)]
struct Stay {
    from: usize,
    to: usize,
}

fn fronts(
    markup: &mut Markup,
    repository: &Repository,
    summary: &Summary,
    rows: &[TestRow],
    drawn: &[u32],
) -> Result<(), RecordError> {
    let shown = generation_fronts(repository, rows)?;
    let objectives = &summary.objectives;
    if shown.len() < 2 || objectives.len() < 2 {
        return Ok(());
    }
    let mut stays: BTreeMap<u32, Stay> = BTreeMap::new();
    for (at, front) in shown.iter().enumerate() {
        for &number in &front.members {
            stays.entry(number).or_insert(Stay { from: at, to: at }).to = at;
        }
    }
    let members: Vec<(&TestRow, Stay)> =
        stays.iter().filter_map(|(number, stay)| Some((row_of(rows, *number)?, *stay))).collect();
    let told: Vec<String> = shown.iter().map(|set| format!("[{},{}]", set.generation, set.members.len())).collect();
    let told = format!("[{}]", told.join(","));
    markup.open("div", &[("class", "fronts"), ("data-fronts", &told)]);
    let pairs: Vec<(usize, usize)> =
        (0..objectives.len()).flat_map(|y| (0..y).map(move |x| (x, y))).take(PAIRS).collect();
    markup.open("div", &[("class", if pairs.len() > 1 { "charts" } else { "charts one" })]);
    for &(x, y) in &pairs {
        let value = |row: &TestRow, at: usize| shown_value(summary, row, at).filter(|value| value.is_finite());
        let places: Vec<(&TestRow, Stay, (f64, f64))> =
            members.iter().filter_map(|(row, stay)| Some((*row, *stay, (value(row, x)?, value(row, y)?)))).collect();
        let across = Axis::round(places.iter().map(|place| place.2.0), 6);
        let up = Axis::round(places.iter().map(|place| place.2.1), 4);
        let (title_x, title_y) = (dimension(&objectives[x]).axis_title(), dimension(&objectives[y]).axis_title());
        markup.open("div", &[("class", "chart small")]);
        markup.element("p", &[("class", "axis-title")], &title_y);
        let label = format!("fronts of {} generations: {title_y} against {title_x}", shown.len());
        let best = if objectives[x].direction == Direction::Maximise { "right" } else { "left" };
        markup.open("svg", &[("class", "scatter"), ("role", "img"), ("aria-label", &label), ("data-best", best)]);
        chart::ticks(markup, &across, &up);
        if pairs.len() == 1 {
            lines(markup, &shown, &places, best, &across, &up);
        }
        for (row, stay, (x, y)) in &evenly(&places, DOTS / pairs.len()) {
            let (cx, cy) = (percent(across.share(*x)), percent(1.0 - up.share(*y)));
            let class = format!("dot w{}", shade(stay.from, shown.len()));
            let (from, to) = (stay.from.to_string(), stay.to.to_string());
            let link = format!("#{}", TestNumber(row.number));
            let linked = drawn.contains(&row.number);
            if linked {
                markup.open("a", &[("href", &link)]);
            }
            let attributes = [("class", class.as_str()), ("cx", &cx), ("cy", &cy), ("r", "4")];
            let stayed = [("data-from", from.as_str()), ("data-to", &to)];
            markup.open("circle", &[attributes.as_slice(), &stayed].concat());
            let since = match (shown[stay.from].generation, shown[stay.to].generation) {
                (first, last) if first == last => format!("on the front after generation {first}"),
                (first, last) => format!("on the front from generation {first} to {last}"),
            };
            let title = format!("{}; {since}", dot_title(repository.plan(), summary, row));
            markup.element("title", &[], &title);
            markup.close();
            if linked {
                markup.close();
            }
        }
        markup.close();
        markup.element("p", &[("class", "axis-title below")], &title_x);
        markup.close();
    }
    markup.close();
    let some = if members.len() > DOTS / pairs.len() { "Some of the tests that were" } else { "Every test that was" };
    let chosen = if shown.len() == FRONTS { ", of evenly chosen generations" } else { "" };
    let words = format!("{some} on a front{chosen}: the bluer, the later it came. Click one to see it over time.");
    markup.element("p", &[("class", "quiet")], &words);
    markup.close();
    Ok(())
}

/// Some fronts as lines, in their shades, and one for the page's script to draw.
fn lines(
    markup: &mut Markup,
    shown: &[GenerationFront],
    places: &[(&TestRow, Stay, (f64, f64))],
    best: &str,
    across: &Axis,
    up: &Axis,
) {
    markup.open("svg", &[("viewBox", "0 0 100 100"), ("preserveAspectRatio", "none"), ("aria-hidden", "true")]);
    let all: Vec<usize> = (0..shown.len()).collect();
    for at in evenly(&all, SHADES) {
        let on = |place: &&(&TestRow, Stay, (f64, f64))| place.1.from <= at && at <= place.1.to;
        let mut points: Vec<(f64, f64)> = places.iter().filter(on).map(|place| place.2).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if best == "right" {
            points.reverse();
        }
        let mut path = String::new();
        for (x, y) in points {
            let (x, y) = (coordinate(100.0 * across.share(x)), coordinate(100.0 * (1.0 - up.share(y))));
            let _ = if path.is_empty() { write!(path, "M{x} {y}") } else { write!(path, "H{x}V{y}") };
        }
        let class = format!("front-line w{}", shade(at, shown.len()));
        markup.leaf("path", &[("class", &class), ("d", &path)]);
    }
    markup.leaf("path", &[("class", "front-line live"), ("d", "")]);
    markup.close();
}

fn shade(at: usize, of: usize) -> usize {
    if of < 2 { 0 } else { at * (SHADES - 1) / (of - 1) }
}

fn row_of(rows: &[TestRow], number: u32) -> Option<&TestRow> {
    rows.binary_search_by_key(&number, |row| row.number).ok().map(|at| &rows[at])
}

/// The fronts that were recorded, one per generation, some of them if there are many.
fn generation_fronts(repository: &Repository, rows: &[TestRow]) -> Result<Vec<GenerationFront>, RecordError> {
    let mut sets: Vec<(u32, String)> = Vec::new();
    for (set, size) in repository.result_set_sizes()? {
        let Some(generation) = set.generation.filter(|_| size > 0) else { continue };
        match sets.last_mut() {
            // In an imported campaign the second is the front among the first.
            Some(last) if last.0 == generation => last.1 = set.name,
            _ => sets.push((generation, set.name)),
        }
    }
    let plan = repository.plan();
    let mut fronts = Vec::new();
    for (generation, name) in evenly(&sets, FRONTS) {
        let mut members = repository.members(&name)?;
        let of_import = |number: &u32| row_of(rows, *number).is_some_and(|row| row.outcome == Outcome::Unknown);
        if members.iter().any(of_import) {
            let fitness: Vec<_> = members
                .iter()
                .filter_map(|&number| row_of(rows, number))
                .map(|row| (row.number, fitness_of(plan, &row.outcome, |id| row.value(id).value)))
                .collect();
            members = Front::from_tests(fitness.iter().map(|(number, fitness)| (*number, fitness))).numbers();
        }
        fronts.push(GenerationFront { generation, members });
    }
    Ok(fronts)
}
