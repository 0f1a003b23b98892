//! What charts have in common: axes with their ticks, and lines that hold each value until the next.
//!
//! Charts are fluid: places are shares of the width and height, so that a chart fills its column on any screen.

use std::fmt::Write as _;

use crate::axis::Axis;
use crate::markup::{Markup, coordinate, percent};

/// Draws the ticks of both axes with a line across the chart at each.
pub fn ticks(markup: &mut Markup, across: &Axis, up: &Axis) {
    for (tick, text) in up.ticks.iter().zip(up.labels()) {
        let y = percent(1.0 - up.share(*tick));
        markup.leaf("line", &[("class", "grid"), ("x1", "0"), ("x2", "100%"), ("y1", &y), ("y2", &y)]);
        markup.element("text", &[("class", "tick end"), ("x", "-8"), ("y", &y), ("dy", "4")], &text);
    }
    for (tick, text) in across.ticks.iter().zip(across.labels()) {
        let x = percent(across.share(*tick));
        markup.leaf("line", &[("class", "grid"), ("x1", &x), ("x2", &x), ("y1", "0"), ("y2", "100%")]);
        markup.element("text", &[("class", "tick middle"), ("x", &x), ("y", "100%"), ("dy", "18")], &text);
    }
}

/// Draws lines of these classes, each through places of the chart from left to right: a value holds until the next.
pub fn steps(markup: &mut Markup, across: &Axis, up: &Axis, lines: &[(&str, &[(f64, f64)])]) {
    markup.open("svg", &[("viewBox", "0 0 100 100"), ("preserveAspectRatio", "none"), ("aria-hidden", "true")]);
    for (class, points) in lines {
        let mut path = String::new();
        for (x, y) in *points {
            let x = coordinate(100.0 * across.share(*x));
            let y = coordinate(100.0 * (1.0 - up.share(*y)));
            let _ = if path.is_empty() { write!(path, "M{x} {y}") } else { write!(path, "H{x}V{y}") };
        }
        if !path.is_empty() {
            markup.leaf("path", &[("class", class), ("d", &path)]);
        }
    }
    markup.close();
}

/// At most so many of all, evenly chosen, first and last among them.
pub fn evenly<T: Clone>(all: &[T], limit: usize) -> Vec<T> {
    if all.len() <= limit {
        return all.to_vec();
    }
    (0..limit).map(|at| all[at * (all.len() - 1) / (limit - 1)].clone()).collect()
}
