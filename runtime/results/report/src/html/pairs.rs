//! Which operations acted together, as a picture: a square for each two of them, divided by the quarters of the run.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use sesame_analysis::pairs::{Acted, PARTS};
use sesame_plan::{CampaignPlan, without_member};
use sesame_present::markup::{Markup, coordinate};
use sesame_present::number::{join_words, plural};

use crate::facts::pairs::PairsSummary;
use crate::facts::summary::Summary;
use crate::tables;

/// Operations that are drawn at most; of more, a table says what is missing.
const MOST: usize = 24;

/// Rows of that table at most.
const ROWS: usize = 20;

/// Operations whose squares are large, so that they fit a narrow screen.
const FEW: usize = 8;

/// About the width of a letter, in pixels.
const LETTER: f64 = 6.8;

/// Letters of a name at most; the tooltip of each square has all of it.
const LETTERS: usize = 24;

/// Between a name and the squares, in pixels.
const GAP: f64 = 8.0;

/// The section on pairs of operations.
pub(super) fn combinations(body: &mut Markup, plan: &CampaignPlan, summary: &Summary) {
    let Some(pairs) = &summary.pairs else { return };
    let Some(sentence) = pairs.found.sentence() else { return };
    body.open("section", &[("id", "combinations")]);
    body.heading("Combinations");
    body.element("p", &[], &format!("{sentence}."));
    if pairs.operations.len() > MOST {
        missing(body, pairs);
    } else {
        body.open("div", &[("class", "scroll")]);
        draw(body, plan, pairs, summary, &sentence);
        body.close();
        let caption = "A square stands for the operation of its row with that of its column, the last square of a row for \
                       that operation in any company. Its columns are the quarters of the run: the stronger the blue, the \
                       more tests in which both acted then; grey: they may not be active then. A square is blank if no \
                       test had both act, and pale where both acted, but not in the same quarter. Red dot: a test with both violates a requirement that no reference run \
                       violates; red frame: just these operations are a cause.";
        body.element("p", &[("class", "quiet")], caption);
    }
    body.close();
}

/// The pairs that did not act together in each quarter in which they may.
fn missing(body: &mut Markup, pairs: &PairsSummary) {
    let mut table = tables::untried_pairs(pairs);
    if table.is_empty() {
        body.element("p", &[("class", "quiet")], "No pair is missing in any quarter in which it may act.");
        return;
    }
    body.element("p", &[("class", "quiet")], "What is missing, first the pairs that never acted together.");
    let more = table.truncate(ROWS);
    table.html(body, &[]);
    if more > 0 {
        body.open("p", &[("class", "quiet")]);
        body.prose(&format!("And {more} more; `sesamec results pairs` has all pairs."));
        body.close();
    }
}

fn draw(body: &mut Markup, plan: &CampaignPlan, pairs: &PairsSummary, summary: &Summary, sentence: &str) {
    let names: Vec<String> = pairs.operations.iter().map(|name| short(name)).collect();
    let letters = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let count = names.len() as f64;
    let side = if names.len() > FEW { 20.0 } else { 28.0 };
    let length = letters as f64 * LETTER;
    let (left, below) = (length + GAP, count * side);
    // Half of the width of what stands at an angle of 45° lies below.
    let (width, height) = (left + below, below + GAP + length * std::f64::consts::FRAC_1_SQRT_2 + GAP);
    let (width, height) = (coordinate(width), coordinate(height));
    let view = format!("0 0 {width} {height}");
    let attributes = [
        ("class", "pairs"),
        ("width", width.as_str()),
        ("height", &height),
        ("viewBox", &view),
        ("role", "img"),
        ("aria-label", sentence),
    ];
    body.open("svg", &attributes);
    let most = pairs.found.pairs().flat_map(|(first, second)| pairs.found.of(first, second).parts).max();
    let most = f64::from(most.unwrap_or(0).max(1));
    let causes = causes_by_operations(summary);
    for (row, name) in names.iter().enumerate() {
        let middle = (row as f64 + 0.5) * side;
        let (x, y) = (coordinate(length), coordinate(middle));
        body.element("text", &[("class", "end"), ("x", &x), ("y", &y), ("dy", "4")], name);
        let (x, y) = (coordinate(left + middle + 4.0), coordinate(below + GAP + 4.0));
        let turned = format!("rotate(-45 {x} {y})");
        body.element("text", &[("class", "end"), ("x", &x), ("y", &y), ("transform", &turned)], name);
        for column in 0..=row {
            let of = BTreeSet::from([pairs.operations[row].as_str(), pairs.operations[column].as_str()]);
            let cause_of: Vec<&str> = causes
                .iter()
                .filter(|(operations, _)| *operations == of)
                .map(|(_, requirement)| *requirement)
                .collect();
            let square = Square { pairs, first: column, second: row, cause_of };
            square.draw(body, plan, [left + column as f64 * side, row as f64 * side], side, most);
        }
    }
    body.close();
}

/// The names of each cause's operations, with the name of its requirement.
fn causes_by_operations(summary: &Summary) -> Vec<(BTreeSet<&str>, &str)> {
    let causes = summary.causes.iter().flat_map(|found| &found.causes);
    // A pair is of operations, whatever members of a group they act on.
    causes
        .map(|cause| (cause.operations.iter().map(|name| without_member(name)).collect(), cause.requirement.as_str()))
        .collect()
}

/// A name that is not too long.
fn short(name: &str) -> String {
    if name.chars().count() > LETTERS {
        name.chars().take(LETTERS - 1).chain(['…']).collect()
    } else {
        name.to_owned()
    }
}

/// Two operations, or one if both are the same.
struct Square<'a> {
    pairs: &'a PairsSummary,
    first: usize,
    second: usize,
    /// The requirements of which just these operations are a cause.
    cause_of: Vec<&'a str>,
}

impl Square<'_> {
    /// Draws it at a place; so many tests have the strongest colour.
    fn draw(&self, body: &mut Markup, plan: &CampaignPlan, [x, y]: [f64; 2], side: f64, most: f64) {
        let Acted { tests, parts, violating, .. } = self.pairs.found.of(self.first, self.second);
        body.open("g", &[]);
        body.element("title", &[], &self.title(plan));
        let mut class = "pair".to_owned();
        class.push_str(if *tests > 0 { " met" } else { "" });
        class.push_str(if self.cause_of.is_empty() { "" } else { " cause" });
        let inner = side - 4.0;
        let (left, top, size) = (coordinate(x + 1.5), coordinate(y + 1.5), coordinate(side - 3.0));
        body.leaf("rect", &[("class", &class), ("x", &left), ("y", &top), ("width", &size), ("height", &size)]);
        let may = self.pairs.found.reach(self.first, self.second);
        let width = inner / PARTS as f64;
        for (at, (&tests, may)) in parts.iter().zip(may).enumerate() {
            // What acts before the start or after the end may act in no quarter, which needs no mark.
            let out = !may && self.may_act();
            if tests == 0 && !out {
                continue;
            }
            let left = coordinate(x + 2.0 + at as f64 * width);
            let (top, width, height) = (coordinate(y + 2.0), coordinate(width), coordinate(inner));
            let opacity = coordinate((0.25 + 0.75 * libm::sqrt(f64::from(tests) / most)).min(1.0));
            let class = if out { "quarter out" } else { "quarter" };
            let mut attributes =
                vec![("class", class), ("x", &left), ("y", &top), ("width", &width), ("height", &height)];
            if !out {
                attributes.push(("fill-opacity", &opacity));
            }
            body.leaf("rect", &attributes);
        }
        if *violating > 0 {
            let (x, y) = (coordinate(x + side / 2.0), coordinate(y + side / 2.0));
            let radius = coordinate(side / 7.0);
            body.leaf("circle", &[("class", "violating"), ("cx", &x), ("cy", &y), ("r", &radius)]);
        }
        body.close();
    }

    /// Whether both may act in a quarter, each in one of its own.
    fn may_act(&self) -> bool {
        [self.first, self.second].iter().all(|&at| self.pairs.found.reach(at, at).contains(&true))
    }

    fn title(&self, plan: &CampaignPlan) -> String {
        let Square { pairs, first, second, cause_of } = self;
        let (found, is_alone) = (&pairs.found, first == second);
        let acted = found.of(*first, *second);
        let name = if is_alone {
            pairs.operations[*first].clone()
        } else {
            format!("{} + {}", pairs.operations[*first], pairs.operations[*second])
        };
        let how = if is_alone { "acted" } else { "acted together" };
        if acted.tests == 0 {
            return format!("{name}: never {how}");
        }
        let mut title = format!("{name}: {how} in {}", plural(acted.tests as usize, "test", "tests"));
        let may = found.reach(*first, *second);
        if may.contains(&true) {
            let quarters = acted.parts.iter().zip(may);
            let words: Vec<String> =
                quarters.map(|(tests, may)| if may { tests.to_string() } else { "–".to_owned() }).collect();
            let _ = write!(title, ", in the quarters of the run in {}", join_words(&words));
        }
        let violated = found.requirements.iter().zip(&acted.of_requirements).filter(|(_, tests)| **tests > 0);
        let violated: Vec<String> =
            violated.map(|(&id, tests)| format!("{} in {tests}", plan.requirement(id).name)).collect();
        if !violated.is_empty() {
            let _ = write!(title, "; violated: {}", join_words(&violated));
        }
        if !cause_of.is_empty() {
            let names: Vec<String> = cause_of.iter().map(|&name| name.to_owned()).collect();
            let _ = write!(title, "; a cause of {}", join_words(&names));
        }
        title
    }
}
