//! Copies of one operation in a row: what one of them holds back until the next is active is held back again. So a
//! message can be later than the operation's longest delay, if the next copy begins soon after it.

use sesame_plan::{Activation, Choice, OperationKind, Test, TestOperation};
use sesame_rng::Stream;

use super::moments::Moment;
use super::setting::Setting;

/// How many moments are tried per operation: the weightiest ones.
const MOMENTS: usize = 6;

/// Tests of an operation over all of its time, in copies of which one follows the other soon after a moment: while what
/// came at that moment is held back. None for operations that hold nothing back, or may not be copied.
pub(super) fn in_a_row(setting: &Setting, kind: usize, stream: &mut Stream) -> Vec<Test> {
    let space = &setting.space;
    let most = space.most().min(space.most_copies(setting.kind(kind)));
    let parameters = setting.kind(kind).strongest.any(stream);
    let (Some(range), Some(held)) = (setting.window(kind), held(setting, kind, &parameters)) else { return Vec::new() };
    if most < 2 || held <= 0.0 {
        return Vec::new();
    }
    let inside = |moment: &&Moment| range.low < moment.at && moment.at + held / 2.0 < range.high;
    let mut moments: Vec<&Moment> = setting.moments.all.iter().filter(inside).collect();
    moments.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    moments.truncate(MOMENTS);
    // Short windows reach from one moment to another by chance only.
    let at_once = if range.longest < range.high - range.low { 1 } else { most - 1 };
    let mut tests = Vec::new();
    for moments in moments.chunks(at_once) {
        let mut borders: Vec<f64> = moments.iter().map(|moment| moment.at + held / 2.0).collect();
        borders.sort_by(f64::total_cmp);
        let first = range.low.max(borders[0] - range.longest);
        let last = range.high.min(borders[borders.len() - 1] + range.longest);
        let ends: Vec<f64> = [&[first][..], &borders, &[last]].concat();
        let windows = ends.windows(2).map(|ends| Activation::Time { start: ends[0], end: ends[1] });
        let operations = windows.map(|window| setting.operation(kind, window, parameters.clone(), stream));
        tests.push(Test { operations: operations.collect() });
    }
    tests.retain(|test| is_permitted(setting, test));
    tests
}

/// Whether a campaign permits a test of copies whose windows lie in what their operation permits, if they are not too
/// short.
pub(super) fn is_permitted(setting: &Setting, test: &Test) -> bool {
    let (space, kinds) = (&setting.space, setting.kinds_of(test));
    let is_long_enough = |(&kind, used): (&usize, &TestOperation)| match (&used.activation, setting.window(kind)) {
        (Activation::Time { start, end }, Some(range)) => end - start >= range.shortest.max(setting.moments.grain),
        _ => true,
    };
    (space.fewest()..=space.most()).contains(&test.operations.len())
        && kinds.iter().zip(&test.operations).all(is_long_enough)
        && space.permits_copies(test)
}

/// For how long an operation with these choices holds messages back at most, in seconds; `None` if it holds none back.
fn held(setting: &Setting, kind: usize, parameters: &[Choice]) -> Option<f64> {
    let operation = setting.plan.operation(setting.kind(kind).operation);
    match (&operation.kind, parameters.first()?) {
        (OperationKind::Latency { .. } | OperationKind::Reorder { .. }, Choice::Value { value }) => Some(*value),
        (OperationKind::Latency { .. }, Choice::Range { high, .. }) => Some(*high),
        _ => None,
    }
}
