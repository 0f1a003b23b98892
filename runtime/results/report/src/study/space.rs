//! The reduced space with the tests that are chosen for a lab [SESAME 2023, Figures 8, 16 and 17].

use serde_json::{Value, json};

use sesame_analysis::choice::Choosing;
use sesame_analysis::{Candidate, Terms};
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Dimension};
use sesame_present::axis::Axis;
use sesame_present::chart::evenly;
use sesame_present::markup::Markup;
use sesame_present::number::{number, quantity, with_unit};
use sesame_select::sweep::{Stretch, Sweep};

use crate::study::figure::{Figure, dot, line, names, text};

/// How many tests that are not candidates are drawn at most; of more, evenly chosen ones.
const OTHERS: usize = 1500;

/// How the cube is seen at first: turned about the vertical axis, and from above, in radians.
const TURN: f64 = 0.6;
const TILT: f64 = 0.45;

/// The size of the figure, in pixels.
const SIZE: [f64; 2] = [560.0, 460.0];

/// The smallest and the largest radius of a candidate, in pixels.
const RADII: [f64; 2] = [3.5, 10.0];

/// Tests in the reduced space, and which are chosen at each weight of difference.
#[derive(Debug, Clone)]
pub struct Space {
    dimensions: Vec<Axis>,
    names: Vec<&'static str>,
    tests: Vec<Drawn>,
    others: Vec<[f64; 3]>,
    sizes: Vec<String>,
    stretches: Vec<Stretch>,
    lambda: f64,
}

#[derive(Debug, Clone)]
struct Drawn {
    number: u32,
    /// Shares of the axes.
    at: [f64; 3],
    /// For each key of the rank, how interesting the test is among the candidates: from 0 to 1.
    interest: Vec<f64>,
    /// Whether it was run in the lab.
    ran: bool,
    tip: String,
}

impl Space {
    /// The candidates of a choice in the first three of its dimensions. `others` are the points of tests that are not
    /// candidates; `ran` are the numbers of those that the lab ran.
    pub fn new(
        plan: &CampaignPlan,
        terms: &Terms,
        choosing: &Choosing<'_>,
        sweep: &Sweep,
        lambda: f64,
        ran: &[u32],
        others: &[Vec<f64>],
    ) -> Space {
        let candidates = &choosing.candidates().tests;
        let count = terms.over.len().min(3);
        let points = || candidates.iter().map(|candidate| &candidate.point).chain(others);
        let dimensions: Vec<Axis> =
            (0..count).map(|at| Axis::round(points().filter_map(|point| point.get(at).copied()), 2)).collect();
        let place = |point: &[f64]| {
            let mut at = [0.0; 3];
            for ((at, axis), value) in at.iter_mut().zip(&dimensions).zip(point) {
                *at = axis.share(*value);
            }
            at
        };
        let tests = candidates.iter().map(|candidate| Drawn {
            number: candidate.number,
            at: place(&candidate.point),
            interest: (0..terms.rank.len()).map(|key| interest(terms, candidates, candidate, key)).collect(),
            ran: ran.contains(&candidate.number),
            tip: tip(plan, terms, candidate),
        });
        let sizes = terms.rank.iter().map(|key| plan.metric(key.metric).name.clone());
        Space {
            tests: tests.collect(),
            others: evenly(others, OTHERS).iter().map(|point| place(point)).collect(),
            sizes: sizes.collect(),
            names: terms.over.iter().take(3).map(|dimension: &Dimension| dimension.name()).collect(),
            stretches: sweep.stretches.clone(),
            lambda,
            dimensions,
        }
    }

    /// The positions of the tests that are chosen at this weight.
    fn chosen(&self, lambda: f64) -> &[usize] {
        let found = self.stretches.iter().find(|stretch| lambda <= stretch.to);
        found.or(self.stretches.last()).map_or(&[], |stretch| &stretch.chosen)
    }

    /// What the script of the page draws anew.
    pub(super) fn data(&self) -> Value {
        let axes = self.dimensions.iter().zip(&self.names).map(|(axis, name)| {
            let labels = axis.labels();
            json!({ "name": name, "low": labels.first(), "high": labels.last() })
        });
        let tests = self.tests.iter().map(|test| {
            json!({
                "name": TestNumber(test.number).to_string(),
                "at": test.at,
                "interest": test.interest,
                "ran": test.ran,
                "tip": test.tip,
            })
        });
        let stretches = self
            .stretches
            .iter()
            .map(|stretch| json!({ "from": stretch.from, "to": stretch.to, "chosen": stretch.chosen }));
        json!({
            "axes": axes.collect::<Vec<_>>(),
            "tests": tests.collect::<Vec<_>>(),
            "others": self.others,
            "sizes": self.sizes,
            "stretches": stretches.collect::<Vec<_>>(),
            "lambda": self.lambda,
            "turn": TURN,
            "tilt": TILT,
            "radii": RADII,
        })
    }

    /// The picture as it is seen at first.
    pub(super) fn figure(&self) -> Figure {
        let mut drawn = Markup::default();
        self.cube(&mut drawn);
        for other in &self.others {
            dot(&mut drawn, "other", place(*other), 2.0, "");
        }
        let chosen = self.chosen(self.lambda);
        for (nth, &one) in chosen.iter().enumerate() {
            for &other in &chosen[nth + 1..] {
                line(&mut drawn, "between", place(self.tests[one].at), place(self.tests[other].at));
            }
            let [x, y, _] = self.tests[one].at;
            line(&mut drawn, "drop", place(self.tests[one].at), place([x, y, 0.0]));
        }
        let mut order: Vec<usize> = (0..self.tests.len()).collect();
        // What is nearer covers what is further away.
        order.sort_by(|&one, &other| depth(self.tests[other].at).total_cmp(&depth(self.tests[one].at)));
        for at in order {
            let test = &self.tests[at];
            let [least, most] = RADII;
            let radius = least + test.interest.first().copied().unwrap_or(0.5) * (most - least);
            let class = if chosen.contains(&at) { "chosen" } else { "candidate" };
            dot(&mut drawn, class, place(test.at), radius, &test.tip);
            if test.ran {
                dot(&mut drawn, "ran", place(test.at), radius + 3.0, &test.tip);
            }
        }
        let named = chosen.iter().map(|&at| {
            let test = &self.tests[at];
            (place(test.at), TestNumber(test.number).to_string())
        });
        let [width, height] = SIZE;
        // Dots are larger than those that names are placed for.
        names(&mut drawn, [0.0, 0.0, width, height], &named.collect::<Vec<_>>(), 1.4);
        let title = format!("The tests that are chosen at λ = {}, among the candidates", number(self.lambda));
        Figure::new("space", title, SIZE, drawn)
    }

    /// The edges of the cube, and the names of its axes.
    fn cube(&self, drawn: &mut Markup) {
        let count = self.dimensions.len();
        for bits in 0..(1usize << count) {
            for axis in (0..count).filter(|axis| bits & (1 << axis) == 0) {
                let (from, to) = (corner(bits), corner(bits | (1 << axis)));
                line(drawn, "cube", place(from), place(to));
            }
        }
        for (at, (axis, name)) in self.dimensions.iter().zip(&self.names).enumerate() {
            let [from, to] = outer_edge(at, count);
            let middle = [0, 1, 2].map(|nth| f64::midpoint(from[nth], to[nth]));
            let labels = axis.labels();
            let [low, high] = [labels.first(), labels.last()].map(|label| label.map(String::as_str));
            let words = [(from, low), (middle, Some(*name)), (to, high)];
            for ((point, words), class) in words.into_iter().zip(["tick middle", "axis middle", "tick middle"]) {
                let Some(words) = words else { continue };
                text(drawn, class, outwards(place(point), place(middle)), words);
            }
        }
    }
}

/// The edge along a dimension beside which its name covers nothing: the leftmost of upright edges, the lowest of the
/// others.
fn outer_edge(dimension: usize, count: usize) -> [[f64; 3]; 2] {
    let corners = (0..1usize << count).filter(|bits| bits & (1 << dimension) == 0);
    let edge = |bits: usize| [corner(bits), corner(bits | (1 << dimension))];
    let outside = |edge: &[[f64; 3]; 2]| {
        let [x, y] = [0, 1].map(|at| place(edge[0])[at] + place(edge[1])[at]);
        if dimension == 2 { x } else { -y }
    };
    let edges = corners.map(edge);
    edges.min_by(|one, other| outside(one).total_cmp(&outside(other))).expect("a cube has edges")
}

/// A place beside an edge: away from the centre of the figure, in the direction in which the edge's middle is.
fn outwards([x, y]: [f64; 2], middle: [f64; 2]) -> [f64; 2] {
    let [width, height] = SIZE;
    let away = [middle[0] - width / 2.0, middle[1] - height / 2.0];
    let length = libm::hypot(away[0], away[1]).max(1.0);
    [x + 20.0 * away[0] / length, y + 18.0 * away[1] / length + 4.0]
}

/// The corner of the cube of which these bits say where it is.
fn corner(bits: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(u8::from(bits & (1 << axis) != 0)))
}

/// How interesting a candidate is by one key of the rank: 1 for the first, 0 for the last.
fn interest(terms: &Terms, all: &[Candidate], candidate: &Candidate, key: usize) -> f64 {
    let place = |candidate: &Candidate| terms.rank[key].order.place(candidate.values[key]);
    let (least, most) = all
        .iter()
        .map(place)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), place| (least.min(place), most.max(place)));
    if most > least { (most - place(candidate)) / (most - least) } else { 0.5 }
}

fn tip(plan: &CampaignPlan, terms: &Terms, candidate: &Candidate) -> String {
    let values = terms.rank.iter().zip(&candidate.values).map(|(key, &value)| {
        let metric = plan.metric(key.metric);
        format!("{} {}", metric.name, quantity(value, metric.unit.as_deref()))
    });
    let places = terms
        .over
        .iter()
        .zip(&candidate.point)
        .map(|(dimension, &value)| format!("{} {}", dimension.name(), with_unit(number(value), None)));
    format!("{}: {}", TestNumber(candidate.number), values.chain(places).collect::<Vec<_>>().join(", "))
}

/// Where a point of the unit cube is seen in the figure.
fn place(point: [f64; 3]) -> [f64; 2] {
    let [x, y, z] = turned(point);
    let [width, height] = SIZE;
    let scale = width.min(height) / 1.75;
    let up = z * libm::cos(TILT) + y * libm::sin(TILT);
    [width / 2.0 + x * scale, height / 2.0 - up * scale]
}

/// How far away it is.
fn depth(point: [f64; 3]) -> f64 {
    let [_, y, z] = turned(point);
    y * libm::cos(TILT) - z * libm::sin(TILT)
}

fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = [x - 0.5, y - 0.5, z - 0.5];
    let (sine, cosine) = (libm::sin(TURN), libm::cos(TURN));
    [x * cosine + y * sine, y * cosine - x * sine, z]
}
