//! Tests whose windows are aligned with what happens in the undisturbed system: they last from one moment to another,
//! or begin at one, or end there.

use sesame_plan::{Activation, Choice, Span, Test, TestOperation};
use sesame_rng::Stream;

use super::setting::Setting;
use super::tried::Tried;
use crate::space::initial::fresh_window;
use crate::space::range::Range;
use crate::space::test_space::ActivationSpace;

/// How many draws are compared for the one that tries most that is new.
const DRAWS: usize = 20;
/// How often a window is drawn again that meets no message.
const TRIES: usize = 12;
/// The shares of windows from moment to moment, and of those with a length that is log-uniform.
const FROM_MOMENT_TO_MOMENT: f64 = 0.45;
const OF_ANY_LENGTH: f64 = 0.44;
/// The share of choices that are a strongest one.
const STRONGEST: f64 = 0.5;
/// How often a moment is one of the few messages of the operation's own topic, where there are few.
const OWN_MESSAGE: f64 = 0.6;

/// The test that tries most that is new, of several with operations out of a pool.
pub(super) fn aligned(
    setting: &Setting,
    tried: &Tried,
    mut pool: impl FnMut(&mut Stream) -> Vec<usize>,
    stream: &mut Stream,
) -> Test {
    let mut best: Option<(f64, Test)> = None;
    for _ in 0..DRAWS {
        let kinds = pool(stream);
        let test = draw(setting, &kinds, stream);
        let worth = tried.worth(setting, &test);
        if best.as_ref().is_none_or(|(most, _)| worth > *most) {
            best = Some((worth, test));
        }
    }
    best.expect("there are several draws").1
}

/// A test with operations out of a pool; half of the time they meet at one moment.
fn draw(setting: &Setting, pool: &[usize], stream: &mut Stream) -> Test {
    let (fewest, most) = (setting.space.fewest(), setting.space.most());
    let count = if stream.chance(0.5) { most } else { fewest + stream.below(most - fewest + 1) };
    let count = count.min(pool.len().max(2)).max(fewest);
    let meeting = stream.chance(0.5).then(|| moment(setting, pool[0], stream));
    let mut operations: Vec<TestOperation> = Vec::with_capacity(count);
    let order = stream.permutation(pool.len());
    for place in 0..count {
        let kind = order.get(place).map_or_else(|| pool[stream.below(pool.len())], |&at| pool[at]);
        if setting.space.has_room(&operations, setting.kind(kind)) {
            let at = meeting.filter(|_| stream.chance(0.7));
            operations.push(operation(setting, kind, at, stream));
        }
    }
    let mut test = Test { operations };
    setting.space.settle(&mut test, stream);
    test
}

/// An operation with an aligned activation; one that is active at a time, if one is given.
pub(super) fn operation(setting: &Setting, kind: usize, at: Option<f64>, stream: &mut Stream) -> TestOperation {
    let activation = activation(setting, kind, at, stream);
    let count = setting.kind(kind).parameters.len();
    let parameters = (0..count).map(|parameter| choice(setting, kind, parameter, stream)).collect();
    setting.operation(kind, activation, parameters, stream)
}

/// A choice for a parameter of an operation: half of the time a strongest one.
pub(super) fn choice(setting: &Setting, kind: usize, parameter: usize, stream: &mut Stream) -> Choice {
    if stream.chance(STRONGEST) {
        setting.kind(kind).strongest.choice(parameter, stream)
    } else {
        setting.kind(kind).parameters[parameter].fresh(stream)
    }
}

/// An aligned activation. Where conditions switch, one that is active at all in the undisturbed system, and at the
/// given time, if several tries find one.
pub(super) fn activation(setting: &Setting, kind: usize, at: Option<f64>, stream: &mut Stream) -> Activation {
    match &setting.kind(kind).activation {
        ActivationSpace::Offline => Activation::Offline,
        ActivationSpace::Time(range) => {
            let (start, end) = window(setting, kind, *range, at, stream);
            Activation::Time { start, end }
        }
        ActivationSpace::Condition { .. } => {
            // Of those that will do each is as likely, whatever its length.
            let luck = stream.unit();
            let suits = |activation: &Activation| {
                let spans = setting.spans_of(kind, activation);
                let hits = |span: &Span| at.is_none_or(|at| span.start <= at && at < span.end);
                if spans.iter().any(hits) { 2.0 } else { f64::from(u8::from(!spans.is_empty())) * luck }
            };
            setting.best_condition(kind, suits, stream).expect("there are conditions to choose from")
        }
    }
}

/// A moment for an operation: often one of the few messages of its own topic.
fn moment(setting: &Setting, kind: usize, stream: &mut Stream) -> f64 {
    let own = setting.kind(kind).heard.rare();
    if !own.is_empty() && stream.chance(OWN_MESSAGE) {
        return own[stream.below(own.len())];
    }
    setting.moments.draw(stream)
}

/// A window of an operation that meets a message; one around a time, if one is given.
pub(super) fn window(setting: &Setting, kind: usize, range: Range, at: Option<f64>, stream: &mut Stream) -> (f64, f64) {
    let heard = &setting.kind(kind).heard;
    let shortest = range.shortest.max(setting.moments.grain).min(range.greatest_length());
    for _ in 0..TRIES {
        let share = stream.unit();
        let (start, end) = if share < FROM_MOMENT_TO_MOMENT {
            from_moment_to_moment(setting, kind, range, at, stream)
        } else if share < FROM_MOMENT_TO_MOMENT + OF_ANY_LENGTH || at.is_some() {
            of_any_length(setting, kind, range, at, stream)
        } else {
            range.interval(stream)
        };
        let (start, end) = (start.max(range.low), end.min(range.high));
        let end = end.min(start + range.longest);
        if end - start >= shortest && heard.is_in((start, end)) {
            return (start, end);
        }
    }
    fresh_window(range, heard, stream)
}

fn from_moment_to_moment(
    setting: &Setting,
    kind: usize,
    range: Range,
    at: Option<f64>,
    stream: &mut Stream,
) -> (f64, f64) {
    let moments = setting.moments.all.iter().map(|moment| moment.at);
    let own = setting.kind(kind).heard.rare().iter().copied();
    let mut ends = vec![range.low];
    ends.extend(moments.chain(own).filter(|at| range.low < *at && *at < range.high));
    ends.push(range.high);
    let one_of = |keep: &dyn Fn(f64) -> bool, otherwise: f64, stream: &mut Stream| {
        let kept: Vec<f64> = ends.iter().copied().filter(|end| keep(*end)).collect();
        if kept.is_empty() { otherwise } else { kept[stream.below(kept.len())] }
    };
    let (start, end) = if let Some(at) = at {
        (one_of(&|end| end <= at, range.low, stream), one_of(&|end| end > at, range.high, stream))
    } else {
        let (a, b) = (one_of(&|_| true, range.low, stream), one_of(&|_| true, range.high, stream));
        if a == b { (range.low, range.high) } else { (a.min(b), a.max(b)) }
    };
    // Most often it begins just before what happens, so that it is disturbed; it ends just before or just after.
    let half = setting.moments.grain / 2.0;
    let start = start + if stream.chance(1.0 / 3.0) { half } else { -half };
    let end = end + if stream.chance(0.5) { half } else { -half };
    let longest = range.longest;
    if end - start <= longest {
        return (start, end);
    }
    let way = stream.unit();
    match at {
        Some(at) if way < 0.5 => {
            let start = start.max((end - longest).min(at - longest * stream.unit()));
            (start, start + longest)
        }
        _ if way < 0.75 => (start, start + longest),
        _ => (end - longest, end),
    }
}

/// Around a moment, from it on, or up to it, with a length that is log-uniform.
fn of_any_length(setting: &Setting, kind: usize, range: Range, at: Option<f64>, stream: &mut Stream) -> (f64, f64) {
    let moments = &setting.moments;
    let longest = range.greatest_length();
    let period = setting.kind(kind).heard.period().unwrap_or(moments.grain);
    let usual = (1.5 * period).min(0.1 * moments.end);
    let shortest = longest.min(range.shortest.max(2.0 * moments.grain).max(usual));
    let length = shortest * libm::pow(longest / shortest, stream.unit());
    let at = at.unwrap_or_else(|| moment(setting, kind, stream));
    let near = stream.uniform(-2.0, 2.0) * moments.grain.max(period.min(0.01 * moments.end));
    let way = stream.unit();
    let start = if way < 0.45 {
        at - length * stream.unit()
    } else if way < 0.8 {
        at + near - moments.grain / 2.0
    } else {
        at + near + moments.grain / 2.0 - length
    };
    (start, start + length)
}
