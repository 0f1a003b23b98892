//! The opening: each operation alone, as strong as it can be, over all of the time that it may be active. Where windows
//! have a greatest length, copies of longest windows stand side by side, where most happens first.

use sesame_plan::{Activation, Span, Test};
use sesame_rng::Stream;

use super::setting::Setting;
use crate::space::range::Range;
use crate::space::test_space::ActivationSpace;

/// How many tests of bounded windows there are for an operation.
const TILED: usize = 2;

/// The tests of the opening, with the operation that each is about.
pub(super) fn opening(setting: &Setting, stream: &mut Stream) -> Vec<(usize, Test)> {
    let usable = setting.usable();
    let mut tests = Vec::new();
    for at in stream.permutation(usable.len()) {
        let kind = usable[at];
        let ways = setting.kind(kind).strongest.ways();
        let whole = |stream: &mut Stream| {
            setting.over(kind, Span { start: 0.0, end: setting.moments.end }, stream).into_iter().collect()
        };
        let windows: Vec<Vec<Activation>> = match &setting.kind(kind).activation {
            ActivationSpace::Time(range) if range.longest < range.high - range.low => {
                let mut tiled = tiles(setting, kind, *range, stream);
                tiled.truncate((TILED / ways).max(1));
                tiled
            }
            _ => vec![whole(stream)],
        };
        for way in 0..ways {
            for activations in windows.iter().filter(|activations| !activations.is_empty()) {
                let parameters = setting.kind(kind).strongest.way(way, stream);
                let operations = activations
                    .iter()
                    .map(|activation| setting.operation(kind, activation.clone(), parameters.clone(), stream));
                let mut test = Test { operations: operations.collect() };
                setting.space.settle(&mut test, stream);
                tests.push((kind, test));
            }
        }
    }
    tests
}

/// Longest windows that tile the time in which an operation may be active, as many per test as it may hold, those in
/// which most happens first.
fn tiles(setting: &Setting, kind: usize, range: Range, stream: &mut Stream) -> Vec<Vec<Activation>> {
    let room = range.high - range.low;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a thousand windows")]
    let count = libm::floor(room / range.longest).clamp(1.0, 1000.0) as usize;
    let mut tiles: Vec<(f64, f64)> = (0..count)
        .map(|at| {
            let start = range.low + room * at as f64 / count as f64;
            let weight = setting.moments.weight_in(start, start + range.longest);
            // Where nothing tells them apart, chance does.
            (weight + 1e-3 * stream.unit(), start)
        })
        .filter(|(_, start)| setting.kind(kind).heard.is_in((*start, start + range.longest)))
        .collect();
    tiles.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = setting.space.most().min(setting.space.most_copies(setting.kind(kind))).max(1);
    let window = |&(_, start): &(f64, f64)| Activation::Time { start, end: (start + range.longest).min(range.high) };
    tiles.chunks(most).map(|chunk| chunk.iter().map(window).collect()).collect()
}
