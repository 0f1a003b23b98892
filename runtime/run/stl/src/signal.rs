//! The robustness signal of a formula on one trace, as it is recorded.

use std::collections::VecDeque;

use sesame_base::robustness::Quantifier;
use sesame_base::time::SimTime;

use crate::piece::Piece;

/// Columns into which the time of a run is divided: of each one the least and the greatest value are kept.
const COLUMNS: i64 = 200;

/// Change points in rising order of time. The last one ends the signal and repeats the value before. All finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signal(Vec<(SimTime, f64)>);

impl Signal {
    /// The signal of a trace that begins at `start`, from `from` nanoseconds later on, in a run that ends at `end`.
    pub(super) fn of(start: SimTime, from: i64, pieces: &VecDeque<Piece>, end: SimTime) -> Signal {
        let mut points: Vec<(SimTime, f64)> = Vec::with_capacity(pieces.len() + 1);
        let at = |nanos: i64| (start + SimTime::from_nanos(nanos)).min(end);
        let (mut begin, mut known_until) = (from, from);
        for piece in pieces {
            // An empty window has the robustness of nothing, which is infinite and says nothing of the run.
            if piece.value.is_finite() {
                points.push((at(begin), piece.value + 0.0));
                known_until = piece.end;
            }
            begin = piece.end;
        }
        points.extend(points.last().map(|&(_, value)| (at(known_until), value)));
        Signal(points)
    }

    /// The signal of a formula without a quantifier: its robustness, from the time at which it was known.
    pub(super) fn known_at(time: SimTime, robustness: f64, end: SimTime) -> Signal {
        let known = [(time.min(end), robustness), (end, robustness)];
        Signal(if robustness.is_finite() { known.to_vec() } else { Vec::new() })
    }

    /// The signal of several formulas, of which the least robustness counts; each comes with its robustness.
    pub fn of_least(signals: Vec<(f64, Signal)>, quantifier: Option<Quantifier>) -> Signal {
        if quantifier == Some(Quantifier::Always) {
            return signals.into_iter().map(|(_, signal)| signal).reduce(|a, b| a.least(&b)).unwrap_or_default();
        }
        let least = signals.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        least.map_or_else(Signal::default, |(_, signal)| signal)
    }

    /// The lesser of both at each time; where there is only one of them, that one.
    fn least(&self, other: &Signal) -> Signal {
        let mut times: Vec<SimTime> = self.0.iter().chain(&other.0).map(|point| point.0).collect();
        times.sort_unstable();
        times.dedup();
        let (mut first, mut second) = (self.cursor(), other.cursor());
        let mut points: Vec<(SimTime, f64)> = Vec::with_capacity(times.len());
        let last = times.last().copied();
        for time in times {
            let value = match (first(time), second(time)) {
                (Some(a), Some(b)) => a.min(b),
                (Some(value), None) | (None, Some(value)) => value,
                (None, None) => points.last().map_or(f64::INFINITY, |point| point.1),
            };
            if value.is_finite() && (points.last().is_none_or(|point| point.1 != value) || Some(time) == last) {
                points.push((time, value));
            }
        }
        Signal(points)
    }

    /// The value at each of some times in rising order; `None` before the first point and from the last one on.
    fn cursor(&self) -> impl FnMut(SimTime) -> Option<f64> + '_ {
        let mut at = 0;
        move |time| {
            while self.0.get(at).is_some_and(|point| point.0 <= time) {
                at += 1;
            }
            (at < self.0.len()).then(|| at.checked_sub(1).map(|at| self.0[at].1)).flatten()
        }
    }

    /// The points in seconds that make a difference to the eye, and all at which the signal crosses one of these
    /// values: so what is said of times at which it was beyond them is exact.
    pub fn thinned(&self, crossed: &[f64]) -> Vec<(f64, f64)> {
        let points = &self.0;
        let Some(&(end, _)) = points.last() else { return Vec::new() };
        let width = (end.nanos() / COLUMNS).max(1);
        let column = |at: &usize| points[*at].0.nanos() / width;
        let side = |value: f64| crossed.iter().map(move |&x| value.partial_cmp(&x));
        let crosses = |at: usize| at > 0 && !side(points[at].1).eq(side(points[at - 1].1));
        let all: Vec<usize> = (0..points.len()).collect();
        let mut kept = vec![0, points.len() - 1];
        for group in all.chunk_by(|a, b| column(a) == column(b)) {
            let value = |at: &&usize| points[**at].1;
            kept.extend(group.iter().min_by(|a, b| value(a).total_cmp(&value(b))));
            kept.extend(group.iter().rev().max_by(|a, b| value(a).total_cmp(&value(b))));
            kept.extend(group.iter().filter(|&&at| crosses(at)));
        }
        kept.sort_unstable();
        kept.dedup();
        kept.into_iter().map(|at| (points[at].0.seconds(), points[at].1)).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn signal(start: i64, values: &[i32]) -> Signal {
        let point = |(at, &value): (i64, &i32)| (SimTime::from_nanos(start + at), f64::from(value));
        let mut points: Vec<_> = (0..).zip(values).map(point).collect();
        if let Some(last) = points.last_mut() {
            last.1 = f64::from(values[values.len().saturating_sub(2)]);
        }
        Signal(points)
    }

    /// The value at a time, by looking at every point.
    fn at(signal: &[(SimTime, f64)], time: i64) -> Option<f64> {
        let ended = signal.last().is_none_or(|last| last.0.nanos() <= time);
        let mut before = signal.iter().filter(|point| point.0.nanos() <= time);
        before.next_back().filter(|_| !ended).map(|point| point.1)
    }

    proptest! {
        #[test]
        fn the_least_of_two_signals_is_the_least_at_each_time(
            a in prop::collection::vec(-9i32..9, 2..30), b in prop::collection::vec(-9i32..9, 2..30), late in 0..9i64,
        ) {
            let late = late.min(i64::try_from(a.len()).unwrap() - 1);
            let (a, b) = (signal(0, &a), signal(late, &b));
            let both = a.least(&b);
            for time in 0..40 {
                let expected = [at(&a.0, time), at(&b.0, time)].into_iter().flatten().reduce(f64::min);
                prop_assert_eq!(at(&both.0, time), expected, "at {}", time);
            }
        }

        #[test]
        fn thinning_keeps_extremes_and_the_times_beyond_a_bound(
            values in prop::collection::vec(-50i32..50, 2..900), bound in -50i32..50,
        ) {
            let whole = signal(0, &values);
            let bound = f64::from(bound);
            let thin: Vec<(SimTime, f64)> =
                whole.thinned(&[bound]).into_iter().map(|(time, value)| (SimTime::from_seconds(time), value)).collect();
            for time in 0..i64::try_from(values.len()).unwrap() {
                let side = |signal: &[(SimTime, f64)]| at(signal, time).map(|value| value < bound);
                prop_assert_eq!(side(&thin), side(&whole.0), "at {}", time);
            }
            let least = |points: &[(SimTime, f64)]| points.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(least(&thin), least(&whole.0));
        }
    }
}
