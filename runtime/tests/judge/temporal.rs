//! The robustness of a temporal formula on a whole trace, by its definition: at each time at which anything may change,
//! the least or greatest over all of the window.
//!
//! Time is whole nanoseconds. A signal is a list of pieces `(from, value)`, each up to the next one, the last up to the
//! end of the trace, that time included. A signal ends earlier where the whole window of its operator, or of one
//! inside, would lie after the end of what it is about; over whole windows, as soon as the window would go beyond that
//! end.

use sesame_plan::Comparison;
use sesame_plan::stl::{Formula, Interval};

type Pieces = Vec<(i64, f64)>;

/// The robustness at the beginning of a trace: samples `(time, value of each signal)` in the order of their times, each
/// at a time of its own, and the end. `None` without a sample.
pub(crate) fn robustness(formula: &Formula, samples: &[(i64, Vec<f64>)], end: i64, whole: bool) -> Option<f64> {
    samples.first()?;
    let trace = Trace { samples, end, whole };
    Some(trace.of(formula).first()?.1)
}

struct Trace<'a> {
    samples: &'a [(i64, Vec<f64>)],
    end: i64,
    whole: bool,
}

fn bounds(interval: &Interval) -> (i64, Option<i64>) {
    let nanos = |seconds: f64| (seconds * 1e9).round() as i64;
    (nanos(interval.from), interval.to.map(nanos))
}

/// The value of a signal at a time.
fn at(pieces: &Pieces, time: i64) -> f64 {
    pieces.iter().rev().find(|piece| piece.0 <= time).expect("a trace has a value from its beginning on").1
}

impl Trace<'_> {
    fn start(&self) -> i64 {
        self.samples[0].0
    }

    /// Up to when a signal has a value, that time included.
    fn ends(&self, formula: &Formula) -> i64 {
        let of = |interval: &Interval, inner: i64| {
            let (from, to) = bounds(interval);
            inner - if self.whole { to.unwrap_or(from) } else { from }
        };
        match formula {
            Formula::Predicate { .. } => self.end,
            Formula::Not { of } => self.ends(of),
            Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
                self.ends(left).min(self.ends(right))
            }
            Formula::Always { interval, of: inner } | Formula::Eventually { interval, of: inner } => {
                of(interval, self.ends(inner))
            }
            Formula::Until { interval, left, right, weak: _ } => of(interval, self.ends(left).min(self.ends(right))),
        }
    }

    /// All values of a signal from one time to another, both included; each with the first time at which it is there.
    fn between<'p>(&self, pieces: &'p Pieces, from: i64, to: i64) -> impl Iterator<Item = (i64, f64)> + 'p {
        let ends = pieces.iter().skip(1).map(|piece| piece.0).chain([self.end + 1]);
        let inside = pieces.iter().zip(ends.collect::<Vec<_>>());
        inside
            .filter(move |(piece, end)| from <= to && piece.0 <= to && *end > from)
            .map(move |(piece, _)| (piece.0.max(from), piece.1))
    }

    /// A signal at these times, as far as it has a value there.
    fn pieces(&self, mut times: Vec<i64>, end: i64, value: impl Fn(i64) -> f64) -> Pieces {
        times.push(self.start());
        times.retain(|&time| (self.start()..=end).contains(&time));
        times.sort_unstable();
        times.dedup();
        times.into_iter().map(|time| (time, value(time))).collect()
    }

    fn both(&self, left: &Formula, right: &Formula, join: fn(f64, f64) -> f64) -> Pieces {
        let end = self.ends(left).min(self.ends(right));
        let (left, right) = (self.of(left), self.of(right));
        let times = left.iter().chain(&right).map(|piece| piece.0).collect();
        self.pieces(times, end, |time| join(at(&left, time), at(&right, time)))
    }

    fn window(&self, interval: &Interval, of: &Formula, none: f64, join: fn(f64, f64) -> f64) -> Pieces {
        let (from, to) = bounds(interval);
        let (inner, end) = (self.of(of), self.ends(of));
        let until = end - if self.whole { to.unwrap_or(from) } else { from };
        let changes: Vec<i64> = inner.iter().map(|piece| piece.0).chain([end + 1]).collect();
        let times =
            changes.iter().flat_map(|&change| [Some(change - from), to.map(|to| change - to)]).flatten().collect();
        self.pieces(times, until, |time| {
            let last = to.map_or(end, |to| (time + to).min(end));
            self.between(&inner, time + from, last).map(|(_, value)| value).fold(none, join)
        })
    }

    fn of(&self, formula: &Formula) -> Pieces {
        match formula {
            Formula::Predicate { signal, comparison, constant } => {
                let value = |x: f64| match comparison {
                    Comparison::Above | Comparison::AtLeast => x - constant,
                    Comparison::Below | Comparison::AtMost => constant - x,
                    Comparison::Equal => -(x - constant).abs(),
                    Comparison::NotEqual => (x - constant).abs(),
                };
                self.samples.iter().map(|(time, values)| (*time, value(values[*signal as usize]))).collect()
            }
            Formula::Not { of } => self.of(of).into_iter().map(|(time, value)| (time, -value)).collect(),
            Formula::And { left, right } => self.both(left, right, f64::min),
            Formula::Or { left, right } => self.both(left, right, f64::max),
            Formula::Implies { left, right } => self.both(left, right, |left, right| f64::max(-left, right)),
            Formula::Always { interval, of } => self.window(interval, of, f64::INFINITY, f64::min),
            Formula::Eventually { interval, of } => self.window(interval, of, f64::NEG_INFINITY, f64::max),
            Formula::Until { interval, weak, left, right } => {
                let (from, to) = bounds(interval);
                let end = self.ends(left).min(self.ends(right));
                let until = self.ends(formula);
                let (left, right) = (self.of(left), self.of(right));
                let changes: Vec<i64> = left.iter().chain(&right).map(|piece| piece.0).chain([end + 1]).collect();
                let moved = |change: &i64| [Some(*change), Some(change - from), to.map(|to| change - to)];
                let times = changes.iter().flat_map(moved).flatten().collect();
                self.pieces(times, until, |time| {
                    let last = to.map_or(end, |to| (time + to).min(end));
                    self.between(&right, time + from, last)
                        .map(|(s, right)| self.between(&left, time, s).map(|(_, left)| left).fold(right, f64::min))
                        .fold(f64::NEG_INFINITY, f64::max)
                        .max(if *weak {
                            self.between(&left, time, last).map(|(_, left)| left).fold(f64::INFINITY, f64::min)
                        } else {
                            f64::NEG_INFINITY
                        })
                })
            }
        }
    }
}
