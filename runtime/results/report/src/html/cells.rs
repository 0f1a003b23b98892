//! Coverage as pictures: over evaluations, and as a map of cells.

use std::fmt::Write as _;

use serde_json::{Value, json};

use sesame_plan::{CampaignPlan, Direction, GridAxis};
use sesame_present::axis::Axis;
use sesame_present::markup::{Markup, coordinate, percent};
use sesame_present::{chart, number};

use crate::facts::coverage::CoverageSummary;
use crate::html::legend::legend;
use crate::html::published::{BOOSTING, CELLS, TRACKING, is_published_grid};
use crate::sentences::coverage_sentence;

/// Cells that a map draws at most; of larger ones none is drawn.
const MOST_DRAWN: usize = 10_000;

/// Draws the coverage over evaluations and the map of its cells.
pub(crate) fn coverage(markup: &mut Markup, plan: &CampaignPlan, coverage: &CoverageSummary, drawn: &[u32]) {
    let published = is_published_grid(coverage);
    markup.open("section", &[("id", "coverage")]);
    markup.heading("Coverage");
    markup.element("p", &[], &format!("{}.", coverage_sentence(coverage)));
    markup.open("div", &[("class", "charts two")]);
    over_evaluations(markup, coverage, published);
    map(markup, plan, coverage, drawn);
    markup.close();
    let mut caption = String::new();
    if published {
        caption.push_str(
            "Grey, for comparison: the methodology's paper on these cells, counted only (line), and where boosting \
             reached half of them (ring). ",
        );
    }
    caption.push_str(
        "Map: the stronger the blue, the more tests; blank: none yet; grey: no test can get there. A square stands for its \
         cells of every dimension that is not shown.",
    );
    markup.element("p", &[("class", "quiet")], &caption);
    legend(markup, &coverage.axes.iter().map(|axis| axis.dimension).collect::<Vec<_>>());
    markup.close();
}

/// The share of covered cells after each test, as steps.
fn over_evaluations(markup: &mut Markup, coverage: &CoverageSummary, published: bool) {
    let mut last = coverage.curve.last().map_or(0.0, |point| f64::from(point.evaluations));
    let mut highest = coverage.stop_at.unwrap_or(0.0).max(coverage.coverage).max(0.01);
    let percent_of = |cells: f64| 100.0 * cells / CELLS;
    if published {
        last = last.max(TRACKING[TRACKING.len() - 1].0);
        highest = highest.max(percent_of(BOOSTING.1) / 100.0);
    }
    let across = Axis::exact(0.0, last.max(1.0), 5);
    let up = Axis::round([0.0, 100.0 * highest], 5);
    markup.open("div", &[("class", "chart small")]);
    markup.element("p", &[("class", "axis-title")], "coverage of all cells [%]");
    let label = format!("coverage over evaluations, {} % at the end", number::number(100.0 * coverage.coverage));
    markup.open("svg", &[("class", "scatter"), ("role", "img"), ("aria-label", &label)]);
    chart::ticks(markup, &across, &up);
    if let Some(share) = coverage.stop_at {
        let y = percent(1.0 - up.share(100.0 * share));
        markup.open("g", &[]);
        markup.element("title", &[], &format!("the search stops at {} %", number::number(100.0 * share)));
        markup.leaf("line", &[("class", "bound"), ("x1", "0"), ("x2", "100%"), ("y1", &y), ("y2", &y)]);
        markup.close();
    }
    let begin = std::iter::once((0.0, 0.0));
    let own: Vec<(f64, f64)> = begin
        .chain(coverage.curve.iter().map(|point| (f64::from(point.evaluations), 100.0 * point.coverage)))
        .collect();
    let tracking = TRACKING.map(|(evaluations, cells)| (evaluations, percent_of(cells)));
    let lines: [(&str, &[(f64, f64)]); 2] = [("line published", &tracking), ("line", &own)];
    chart::steps(markup, &across, &up, if published { &lines } else { &lines[1..] });
    if published {
        let (x, y) = (percent(across.share(BOOSTING.0)), percent(1.0 - up.share(percent_of(BOOSTING.1))));
        markup.open("circle", &[("class", "ring published"), ("cx", &x), ("cy", &y), ("r", "5")]);
        markup.element("title", &[], "the paper, with boosting: half of the cells at 110 evaluations");
        markup.close();
        let (x, y) = (percent(across.share(210.0)), percent(1.0 - up.share(50.0)));
        markup.open("circle", &[("class", "dot"), ("cx", &x), ("cy", &y), ("r", "4")]);
        markup.element("title", &[], "the paper, counted only: half of the cells at 210 evaluations");
        markup.close();
    }
    markup.close();
    markup.element("p", &[("class", "axis-title below")], "evaluations");
    markup.close();
}

/// A cell of the map: all cells of the grid that differ only in the dimensions that are not drawn.
#[derive(Debug, Clone, Copy, Default)]
struct MapCell {
    cells: usize,
    covered: usize,
    feasible: usize,
    hits: u64,
}

/// The map of the first two dimensions; a grid of one dimension is a row. What it needs to show others instead lies
/// beside it, for the page's script.
fn map(markup: &mut Markup, plan: &CampaignPlan, coverage: &CoverageSummary, drawn: &[u32]) {
    let axes = &coverage.axes;
    let [x, y] = [axes.first(), axes.get(1)];
    let Some(x) = x else { return };
    let (columns, rows) = (x.cells as usize, y.map_or(1, |y| y.cells as usize));
    if columns * rows > MOST_DRAWN {
        return;
    }
    let map_cells = map_cells(coverage, columns, rows);
    let most = map_cells.iter().map(|map_cell| map_cell.hits).max().unwrap_or(0).max(1) as f64;
    let data = map_data(plan, coverage, drawn);
    markup.open("div", &[("class", "map"), ("data-cells", &data)]);
    markup.open("div", &[("class", "chart small")]);
    let vertical = y.map_or_else(|| "all".to_owned(), |y| y.dimension.name().to_owned());
    markup.element("p", &[("class", "axis-title")], &vertical);
    let (across, up) = (x.dimension.name(), y.map_or("", |y| y.dimension.name()));
    let label = format!("cells of {across} {up}: how many tests hit each").replace(" :", ":");
    markup.open("svg", &[("class", "scatter"), ("role", "img"), ("aria-label", &label)]);
    for (at, map_cell) in map_cells.iter().enumerate() {
        let (column, row) = (at % columns, at / columns);
        let class = match map_cell {
            MapCell { feasible: 0, .. } => "cell infeasible",
            MapCell { hits: 0, .. } => "cell empty",
            _ => "cell",
        };
        let left = percent(column as f64 / columns as f64);
        // The first row is at the bottom.
        let top = percent(1.0 - (row + 1) as f64 / rows as f64);
        let (width, height) = (percent(1.0 / columns as f64), percent(1.0 / rows as f64));
        let opacity = coordinate(0.2 + 0.8 * libm::sqrt(map_cell.hits as f64 / most));
        markup.open("g", &[]);
        markup.element("title", &[], &title(x, y, column, row, *map_cell));
        let mut attributes = vec![("class", class), ("x", &left), ("y", &top), ("width", &width), ("height", &height)];
        if class == "cell" {
            attributes.push(("fill-opacity", &opacity));
        }
        markup.leaf("rect", &attributes);
        markup.close();
    }
    for (at, text) in edges(x) {
        let x = percent(at);
        markup.element("text", &[("class", "tick middle"), ("x", &x), ("y", "100%"), ("dy", "18")], &text);
    }
    for (at, text) in y.map_or_else(Vec::new, edges) {
        let y = percent(1.0 - at);
        markup.element("text", &[("class", "tick end"), ("x", "-8"), ("y", &y), ("dy", "4")], &text);
    }
    markup.close();
    markup.element("p", &[("class", "axis-title below")], x.dimension.name());
    markup.close();
    markup.close();
}

/// All that the map can show, as JSON: axes; per metric that is of interest one way its name, unit and that way; which
/// cells can be reached, as lengths of runs that begin with those that cannot; and per cell that was hit its number,
/// its hits, and per metric the worst value with its test. The tests that have a timeline on the page are `drawn`.
fn map_data(plan: &CampaignPlan, coverage: &CoverageSummary, drawn: &[u32]) -> String {
    let axes: Vec<Value> = coverage
        .axes
        .iter()
        .map(|axis| json!({"name": axis.dimension.name(), "low": axis.low, "high": axis.high, "cells": axis.cells}))
        .collect();
    let metrics: Vec<Value> = coverage
        .worst
        .metrics
        .iter()
        .map(|&id| {
            let metric = plan.metric(id);
            json!({"name": metric.name, "unit": metric.unit, "most": metric.direction == Some(Direction::Maximise)})
        })
        .collect();
    let mut reach = Vec::new();
    let (mut now, mut length) = (false, 0u32);
    for (cell, &hits) in coverage.counted.hits().iter().enumerate() {
        if (coverage.reachable.reaches(cell) || hits > 0) != now {
            reach.push(length);
            (now, length) = (!now, 0);
        }
        length += 1;
    }
    reach.push(length);
    let hit: Vec<Value> = coverage
        .counted
        .hits()
        .iter()
        .enumerate()
        .filter(|(_, hits)| **hits > 0)
        .map(|(cell, hits)| {
            let mut row = vec![json!(cell), json!(hits)];
            for worst in coverage.worst.of(cell) {
                match worst {
                    Some((value, test)) => row.extend([json!(rounded(*value)), json!(test)]),
                    None => row.extend([Value::Null, Value::Null]),
                }
            }
            Value::Array(row)
        })
        .collect();
    json!({
        "axes": axes, "metrics": metrics, "needed": coverage.hits, "reach": reach, "hit": hit,
        "drawn": drawn,
    })
    .to_string()
}

/// Four digits: what a colour and a hint can tell.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn map_cells(coverage: &CoverageSummary, columns: usize, rows: usize) -> Vec<MapCell> {
    let mut map_cells = vec![MapCell::default(); columns * rows];
    for (cell, &hits) in coverage.counted.hits().iter().enumerate() {
        let at = coverage.counted.grid().place(cell);
        let row = at.get(1).map_or(0, |&row| row as usize);
        let map_cell = &mut map_cells[row * columns + at[0] as usize];
        map_cell.cells += 1;
        map_cell.covered += usize::from(coverage.counted.is_covered(cell));
        map_cell.feasible += usize::from(coverage.reachable.reaches(cell) || hits > 0);
        map_cell.hits += u64::from(hits);
    }
    map_cells
}

fn title(x: &GridAxis, y: Option<&GridAxis>, column: usize, row: usize, map_cell: MapCell) -> String {
    let span = |axis: &GridAxis, at: usize| {
        let edge = |at: usize| number::number(axis.low + (axis.high - axis.low) * at as f64 / f64::from(axis.cells));
        format!("{} {} to {}", axis.dimension.name(), edge(at), edge(at + 1))
    };
    let mut text = span(x, column);
    if let Some(y) = y {
        let _ = write!(text, ", {}", span(y, row));
    }
    let tests = number::plural(usize::try_from(map_cell.hits).unwrap_or(usize::MAX), "test", "tests");
    match map_cell {
        MapCell { feasible: 0, .. } => format!("{text}: no test can get there"),
        MapCell { cells: 1, .. } => format!("{text}: {tests}"),
        MapCell { cells, covered, .. } => format!("{text}: {tests}, {covered} of {cells} cells covered"),
    }
}

/// Some edges between cells: where they stand, and their values.
fn edges(axis: &GridAxis) -> Vec<(f64, String)> {
    let every = axis.cells.div_ceil(6);
    let shown = (0..=axis.cells).filter(|at| at % every == 0);
    let values: Vec<(f64, f64)> = shown
        .map(|at| f64::from(at) / f64::from(axis.cells))
        .map(|share| (share, axis.low + (axis.high - axis.low) * share))
        .collect();
    let decimals = number::decimals(values.iter().map(|(_, value)| *value)).min(2);
    values.into_iter().map(|(share, value)| (share, number::fixed(value, decimals))).collect()
}
