//! Figures that are part of the page, and files of their own.
//!
//! A figure has a size in pixels at which its letters can be read. On the page it fills its column.

use sesame_present::axis::Axis;
use sesame_present::markup::{Markup, coordinate};
use sesame_present::names::{Placed, Screen, place_names};

/// What figures look like, in the colours of the page.
const STYLE: &str = include_str!("figure.css");

/// The colours of the page where it is light. A file of its own has no page around it, and many programs that show such
/// files do not know variables.
const COLOURS: [(&str, &str); 9] = [
    ("var(--paper)", "#ffffff"),
    ("var(--ink)", "#1b2330"),
    ("var(--quiet)", "#5d6878"),
    ("var(--grid)", "#edf0f3"),
    ("var(--rule)", "#e3e7ec"),
    ("var(--dot)", "#9aa5b4"),
    ("var(--accent)", "#0a62a8"),
    ("var(--bad)", "#c2410c"),
    ("var(--satisfied)", "#b9c6d3"),
];

/// About the width of a letter of a name, in pixels.
const LETTER: f64 = 7.0;

/// The style of figures on the page.
pub(crate) fn style() -> &'static str {
    STYLE
}

/// A picture with a title.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it is called as a file, without `.svg`: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// What it shows.
    pub(crate) title: String,
    /// Its size in pixels.
    pub(crate) size: [f64; 2],
    /// What is drawn.
    pub(crate) drawn: Markup,
}

impl Figure {
    /// A name is made a file name: other characters become `_`.
    pub(crate) fn new(name: &str, title: String, size: [f64; 2], drawn: Markup) -> Figure {
        let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
        let name: String = name.chars().take(80).map(plain).collect();
        Figure { name, title, size, drawn }
    }

    /// Puts it on the page, with its title below.
    pub(crate) fn show(&self, body: &mut Markup) {
        body.open("figure", &[("class", "drawn")]);
        self.picture(body, &[]);
        body.element("figcaption", &[("class", "quiet")], &self.title);
        body.close();
    }

    /// Only the picture, with these attributes besides.
    pub(crate) fn picture(&self, body: &mut Markup, attributes: &[(&'static str, &str)]) {
        let [width, height] = self.size.map(coordinate);
        let frame = format!("0 0 {width} {height}");
        let own = [("class", "figure"), ("viewBox", frame.as_str()), ("role", "img"), ("aria-label", &self.title)];
        body.open("svg", &[&own[..], attributes].concat());
        body.append(self.drawn.clone());
        body.close();
    }

    /// The figure as a file, which needs no other.
    pub fn svg(&self) -> String {
        let [width, height] = self.size.map(coordinate);
        let frame = format!("0 0 {width} {height}");
        let style = COLOURS.iter().fold(STYLE.to_owned(), |style, (name, colour)| style.replace(name, colour));
        let mut file = Markup::default();
        let namespace = ("xmlns", "http://www.w3.org/2000/svg");
        let size = [("viewBox", frame.as_str()), ("width", &width), ("height", &height), ("class", "figure")];
        file.open("svg", &[&[namespace][..], &size].concat());
        file.element("title", &[], &self.title);
        file.element("style", &[], &style);
        file.leaf("rect", &[("class", "paper"), ("width", &width), ("height", &height)]);
        file.append(self.drawn.clone());
        file.close();
        file.finish()
    }
}

/// An area with two axes.
#[derive(Debug, Clone)]
pub(crate) struct Plot {
    /// The axis from left to right.
    pub(crate) across: Axis,
    /// The axis from bottom to top.
    pub(crate) up: Axis,
    /// Left, top, right and bottom edges, in pixels of the figure.
    pub(crate) edges: [f64; 4],
}

impl Plot {
    /// Where a value on the horizontal axis is.
    pub(crate) fn x(&self, value: f64) -> f64 {
        let [left, _, right, _] = self.edges;
        left + self.across.share(value) * (right - left)
    }

    /// Where a value on the vertical axis is.
    pub(crate) fn y(&self, value: f64) -> f64 {
        let [_, top, _, bottom] = self.edges;
        bottom - self.up.share(value) * (bottom - top)
    }

    /// Draws the grid with its numbers, the title of the vertical axis above it and that of the horizontal one below.
    pub(crate) fn frame(&self, drawn: &mut Markup, across: &str, up: &str) {
        let [left, top, right, bottom] = self.edges;
        for (tick, text) in self.up.ticks.iter().zip(self.up.labels()) {
            let y = self.y(*tick);
            line(drawn, "grid", [left, y], [right, y]);
            self::text(drawn, "tick end", [left - 6.0, y + 4.0], &text);
        }
        for (tick, text) in self.across.ticks.iter().zip(self.across.labels()) {
            let x = self.x(*tick);
            line(drawn, "grid", [x, top], [x, bottom]);
            self::text(drawn, "tick middle", [x, bottom + 15.0], &text);
        }
        text(drawn, "axis", [4.0, top - 9.0], up);
        text(drawn, "axis end", [right, bottom + 30.0], across);
    }

    /// Draws a band between two values of the vertical axis, as far as it is in the plot.
    pub(crate) fn band(&self, drawn: &mut Markup, class: &str, [low, high]: [f64; 2]) {
        let [left, _, right, _] = self.edges;
        let (top, bottom) = (self.y(high.min(self.up.high)), self.y(low.max(self.up.low)));
        rectangle(drawn, class, [left, top], [right, bottom]);
    }
}

/// Draws a straight line.
pub(crate) fn line(drawn: &mut Markup, class: &str, from: [f64; 2], to: [f64; 2]) {
    let ([x1, y1], [x2, y2]) = (from.map(coordinate), to.map(coordinate));
    drawn.leaf("line", &[("class", class), ("x1", &x1), ("y1", &y1), ("x2", &x2), ("y2", &y2)]);
}

/// Draws a filled rectangle; nothing if its corners are the wrong way round.
pub(crate) fn rectangle(drawn: &mut Markup, class: &str, [left, top]: [f64; 2], [right, bottom]: [f64; 2]) {
    if right <= left || bottom <= top {
        return;
    }
    let [x, y, width, height] = [left, top, right - left, bottom - top].map(coordinate);
    drawn.leaf("rect", &[("class", class), ("x", &x), ("y", &y), ("width", &width), ("height", &height)]);
}

/// Writes words.
pub(crate) fn text(drawn: &mut Markup, class: &str, place: [f64; 2], words: &str) {
    let [x, y] = place.map(coordinate);
    drawn.element("text", &[("class", class), ("x", &x), ("y", &y)], words);
}

/// Draws a dot with a tooltip.
pub(crate) fn dot(drawn: &mut Markup, class: &str, place: [f64; 2], radius: f64, tip: &str) {
    let ([x, y], r) = (place.map(coordinate), coordinate(radius));
    drawn.open("circle", &[("class", class), ("cx", &x), ("cy", &y), ("r", &r)]);
    drawn.element("title", &[], tip);
    drawn.close();
}

/// Writes names beside their dots, within these edges, where they cover neither each other nor a dot. `apart` is how
/// many times further from the middle of a dot they stand than usual.
pub(crate) fn names(drawn: &mut Markup, [left, top, right, bottom]: [f64; 4], dots: &[([f64; 2], String)], apart: f64) {
    let screen = Screen { width: right - left, height: bottom - top };
    let shares = dots.iter().map(|([x, y], _)| ((x - left) / screen.width, (y - top) / screen.height));
    let lengths: Vec<f64> = dots.iter().map(|(_, name)| name.len() as f64 * LETTER).collect();
    let placed = place_names(&shares.collect::<Vec<_>>(), &lengths, screen);
    for (([x, y], name), placed) in dots.iter().zip(placed) {
        let Some(Placed { dx, dy, anchor, .. }) = placed else { continue };
        text(drawn, &format!("test{anchor}"), [x + apart * dx, y + apart * dy], name);
    }
}

/// Draws a line through points.
pub(crate) fn path(drawn: &mut Markup, class: &str, points: impl IntoIterator<Item = [f64; 2]>) {
    let places = points.into_iter().map(|place| place.map(coordinate).join(" "));
    let places: Vec<String> = places.collect();
    if places.len() > 1 {
        drawn.leaf("path", &[("class", class), ("d", &format!("M{}", places.join("L")))]);
    }
}
