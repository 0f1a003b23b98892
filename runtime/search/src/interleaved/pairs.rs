//! Pairwise interaction testing: each two operations act together, as strong as they can be, over the whole run; then
//! in each half of it, each quarter, each eighth.

use std::collections::BTreeSet;

use sesame_plan::{Activation, Span, Test};
use sesame_rng::Stream;

use super::moments::weighted;
use super::setting::Setting;
use crate::space::test_space::ActivationSpace;

/// Into how many parts the run is divided, one level after the other.
const LEVELS: [usize; 4] = [1, 2, 4, 8];
/// How many choices are compared for the one that covers most new pairs.
const CHOICES: usize = 20;
/// How far short windows that belong together are moved against each other, as a share of their length.
const SHIFT: f64 = 0.3;

/// Two operations in a part of the run, at a level.
type Pair = (usize, usize, usize, usize);

/// The pairs that were tried.
#[derive(Debug, Clone, Default)]
pub(super) struct Pairs(BTreeSet<Pair>);

impl Pairs {
    /// The pairs of these operations that were not tried at a level.
    fn missing(
        &self,
        setting: &Setting,
        kinds: &[usize],
        level: usize,
        is_known: &dyn Fn(usize, usize) -> bool,
    ) -> Vec<Pair> {
        let parts = setting.moments.parts(level).len();
        let mut missing = Vec::new();
        for (at, &first) in kinds.iter().enumerate() {
            for &second in &kinds[at + 1..] {
                // What acts before the start or after the end has no part in any part of the run.
                let offline =
                    [first, second].iter().any(|&kind| setting.kind(kind).activation == ActivationSpace::Offline);
                // Two choices of members of one operation are copies of it, which need not be permitted together.
                let copies = setting.kind(first).operation == setting.kind(second).operation;
                if is_known(first, second) || copies || (offline && level > 1) {
                    continue;
                }
                let of_parts = (0..parts).map(|part| (level, first, second, part));
                missing.extend(of_parts.filter(|pair| !self.0.contains(pair)));
            }
        }
        missing
    }

    /// Whether each two of these operations were tried together over the whole run. Pairs that are known to be causes
    /// need not be.
    pub(super) fn first_level_is_complete(
        &self,
        setting: &Setting,
        kinds: &[usize],
        is_known: &dyn Fn(usize, usize) -> bool,
    ) -> bool {
        setting.space.most() < 2 || self.missing(setting, kinds, 1, is_known).is_empty()
    }

    /// The next test of pairs; `None` when all were tried. `kinds` are those to be paired, in rising order.
    pub(super) fn next(
        &mut self,
        setting: &Setting,
        kinds: &[usize],
        is_known: &dyn Fn(usize, usize) -> bool,
        stream: &mut Stream,
    ) -> Option<Test> {
        if setting.space.most() < 2 {
            return None;
        }
        for level in LEVELS {
            let missing = self.missing(setting, kinds, level, is_known);
            if missing.is_empty() {
                continue;
            }
            let mut best: Option<(usize, Vec<usize>, usize)> = None;
            for _ in 0..CHOICES {
                let (_, first, second, part) = missing[stream.below(missing.len())];
                let mut chosen = vec![first, second];
                if setting.space.most() > 2 && kinds.len() > 2 && stream.chance(0.5) {
                    let others: Vec<usize> = kinds.iter().copied().filter(|kind| !chosen.contains(kind)).collect();
                    chosen.push(others[stream.below(others.len())]);
                }
                let new = pairs_of(&chosen, level, part).filter(|pair| !self.0.contains(pair)).count();
                if best.as_ref().is_none_or(|(most, ..)| new > *most) {
                    best = Some((new, chosen, part));
                }
            }
            let (_, chosen, part) = best?;
            self.0.extend(pairs_of(&chosen, level, part));
            let stretch = setting.moments.parts(level)[part];
            return Some(together(setting, &chosen, stretch, stream));
        }
        None
    }
}

fn pairs_of(kinds: &[usize], level: usize, part: usize) -> impl Iterator<Item = Pair> {
    let mut sorted = kinds.to_vec();
    sorted.sort_unstable();
    let count = sorted.len();
    let pairs = (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)));
    pairs.map(move |(a, b)| (level, sorted[a], sorted[b], part))
}

/// A test of these operations over a part of the run. Those with short windows meet at a moment at which much happens.
fn together(setting: &Setting, kinds: &[usize], stretch: Span, stream: &mut Stream) -> Test {
    let mut meeting: Option<f64> = None;
    let mut operations = Vec::with_capacity(kinds.len());
    for &kind in kinds {
        let whole = Span { start: 0.0, end: setting.moments.end };
        let activation = match setting.window(kind) {
            Some(range) => {
                let (mut low, mut high) = (stretch.start.max(range.low), stretch.end.min(range.high));
                if high - low < range.shortest.max(setting.moments.grain) {
                    (low, high) = (range.low, range.high);
                }
                if high - low > range.longest {
                    let longest = range.longest;
                    let at = *meeting
                        .get_or_insert_with(|| moment_in(setting, low, high, stream) - 0.9 * longest * stream.unit());
                    let start = at + stream.uniform(-SHIFT, SHIFT) * longest;
                    let start = start.min(range.high - longest).max(range.low);
                    Some(Activation::Time { start, end: start + longest })
                } else {
                    Some(Activation::Time { start: low, end: high })
                }
            }
            None => setting.over(kind, stretch, stream).or_else(|| setting.over(kind, whole, stream)),
        };
        let Some(activation) = activation else { continue };
        let parameters = setting.kind(kind).strongest.any(stream);
        operations.push(setting.operation(kind, activation, parameters, stream));
    }
    let mut test = Test { operations };
    setting.space.settle(&mut test, stream);
    test
}

/// A moment in a stretch of time, likelier the more happens then; any time if nothing does.
fn moment_in(setting: &Setting, low: f64, high: f64, stream: &mut Stream) -> f64 {
    let inside: Vec<_> = setting.moments.all.iter().filter(|moment| low <= moment.at && moment.at <= high).collect();
    if inside.is_empty() {
        return stream.uniform(low, high);
    }
    inside[weighted(inside.iter().map(|moment| moment.weight), stream)].at
}
