//! How often what was tried: each operation at each moment, how strong, how long, and which two act together then.

use std::collections::{BTreeMap, BTreeSet};

use sesame_plan::{Span, Test, TestOperation};

use super::setting::Setting;

/// A window begins or ends at a moment if it does so within this share of the run.
const AT_A_MOMENT: f64 = 0.02;
/// A window is short if it is shorter than this share of the run.
const SHORT: f64 = 0.12;
/// How much the end of a window at a moment counts, beside its begin.
const ENDS: f64 = 0.7;

/// How strong an operation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    /// As strong as it can be, in one of the ways.
    Strongest(usize),
    High,
    Low,
}

/// Something that a test tries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Item {
    /// An operation that is so strong.
    Strength(usize, Level),
    /// A window of an operation that begins at a moment.
    Begins(usize, usize),
    /// A window of an operation that ends at a moment.
    Ends(usize, usize),
    /// An operation that is so strong at a moment, and whether its window is short.
    Holds(usize, usize, Level, bool),
    /// An operation that is so strong at one of the few messages of its topic.
    Message(usize, usize, Level),
    /// Two operations that are active together at a moment.
    Together(usize, usize, usize),
}

/// Counts of what was tried.
#[derive(Debug, Clone, Default)]
pub(super) struct Tried(BTreeMap<Item, u32>);

impl Tried {
    /// Takes a test.
    pub(super) fn add(&mut self, setting: &Setting, test: &Test) {
        for item in items(setting, test).into_keys() {
            *self.0.entry(item).or_default() += 1;
        }
    }

    /// How much a test tries that was not tried, or seldom.
    pub(super) fn worth(&self, setting: &Setting, test: &Test) -> f64 {
        let worth = |(item, weight): (Item, f64)| {
            let times = f64::from(self.0.get(&item).copied().unwrap_or(0));
            weight / ((1.0 + times) * (1.0 + times))
        };
        items(setting, test).into_iter().map(worth).sum()
    }
}

fn items(setting: &Setting, test: &Test) -> BTreeMap<Item, f64> {
    let moments = &setting.moments.all;
    let all: f64 = moments.iter().map(|moment| moment.weight).sum();
    let weight = |at: usize| moments[at].weight / all * moments.len() as f64;
    let near = AT_A_MOMENT * setting.moments.end;
    let mut items = BTreeMap::new();
    let mut acting: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for (&kind, used) in setting.kinds_of(test).iter().zip(&test.operations) {
        let level = level(setting, kind, used);
        items.insert(Item::Strength(kind, level), 1.0);
        for Span { start, end } in setting.spans_of(kind, &used.activation) {
            let short = end - start < SHORT * setting.moments.end;
            for (at, moment) in moments.iter().enumerate() {
                if (start - moment.at).abs() <= near {
                    items.insert(Item::Begins(kind, at), weight(at));
                }
                if (end - moment.at).abs() <= near {
                    items.insert(Item::Ends(kind, at), ENDS * weight(at));
                }
                if start <= moment.at && moment.at < end {
                    items.insert(Item::Holds(kind, at, level, short), weight(at));
                    acting.entry(at).or_default().insert(kind);
                }
            }
            for (at, &message) in setting.kind(kind).heard.rare().iter().enumerate() {
                if start <= message && message < end {
                    items.insert(Item::Message(kind, at, level), 1.0);
                }
            }
        }
    }
    for (at, kinds) in acting {
        for &first in &kinds {
            for &second in kinds.range(first + 1..) {
                items.insert(Item::Together(first, second, at), weight(at));
            }
        }
    }
    items
}

fn level(setting: &Setting, kind: usize, used: &TestOperation) -> Level {
    match setting.kind(kind).strongest.which(&used.parameters) {
        Some(way) => Level::Strongest(way),
        None if setting.strength(used) > 0.5 => Level::High,
        None => Level::Low,
    }
}
