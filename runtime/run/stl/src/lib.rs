//! Robustness of signal temporal logic: by how much a trace satisfies a formula (positive) or violates it (negative).
//!
//! A [`Monitor`] gets the samples of a run in order and gives the robustness of the whole trace at its end. It
//! implements the usual definition [Donzé and Maler 2010]. Its choices where that definition leaves one:
//!
//! **Signals** hold their last value: a sample counts from its own time on, that time included, until the next one. Of
//! several samples of a signal at one time the last counts.
//!
//! **The trace** begins when every signal of the formula has had a sample, and the formula is evaluated at that time.
//! What signals did before is not part of the trace, except for the values they hold when it begins. The trace ends at
//! the time given to [`Monitor::finish`], that time included: a sample at the very end counts.
//!
//! **Predicates**: `x > c` and `x >= c` have the robustness `x - c`, `x < c` and `x <= c` have `c - x`; `x == c` has
//! `-|x - c|` and `x != c` has `|x - c|`. A signal that is NaN violates every comparison: negative infinity.
//!
//! **Windows** are closed: at time `t`, an interval from `a` to `b` is `t + a <= s <= t + b`, both ends included, so a
//! jump at `t + b` is seen. They are cut at the end of the trace: times after it neither satisfy nor violate anything.
//! An operator whose window is completely after the end has no robustness at that time, nor has anything that is
//! computed from it at that time. Operators around it go over the times at which there is one. So `always (request
//! implies eventually [a, b] answer)` says nothing of requests in the last `a` of the trace, whether they were answered
//! or not. A formula without a robustness at the beginning of the trace has infinite robustness, as nothing was asked.
//!
//! **Whole windows** are the other interpretation of the end, by [`Monitor::over_whole_windows`]: an operator with a
//! bounded window has no robustness as soon as its window would be cut. An unbounded window has no end that could be
//! cut. So `always (request implies eventually [a, b] answer)` says nothing of requests in the last `b` of the trace.
//!
//! **Until** is non-strict at both ends: for `left until right` at `t` there is a time `s` in the window at which
//! `right` holds, and `left` holds for `t <= r <= s`. So `left` has to hold at `s` too: a trace on which `left` ends at
//! the moment at which `right` begins does not satisfy it. (It is this that keeps every subformula continuous from
//! the right, like the signals, so that nothing happens between samples.)
//!
//! **Weak until** is the greater of the two: `left` gets to `right` in a window from `a` to `b`, or `left` holds from
//! `t` to `t + b`, or to the end of the trace. It begins at `t` and not at `t + a`, since `left` has to hold from there
//! in the other case too: what breaks before the window begins is never made good by it.
//!
//! **Time is dense**, as far as that can be told: simulation time is whole nanoseconds, so all signals jump at whole
//! nanoseconds, and so do the robustness signals of all subformulas. For windows that are cut this holds since the last
//! instant of a trace lasts one nanosecond, as any other does: were the trace to end with the instant itself, a window
//! that begins there would be empty for all times in between. Nothing is lost by computing on these alone, and
//! nothing is rounded but the ends of intervals, to the nearest nanosecond.
//!
//! The cost is constant per sample and operator, amortised, for windows of any length: minima and maxima slide on
//! monotonic deques (Lemire 2006), `until` on a queue made of two stacks. The memory of an operator is bounded by the
//! samples in its window, and constant for an outermost operator, bounded or not: that one is asked for one time only.
//! An unbounded operator inside another temporal one (`always (request implies eventually granted)`) has a value at
//! every time that depends on the end of the trace; it keeps the jumps of the trace over which the outer operator asks
//! for it.

use std::collections::VecDeque;

use node::{FormulaNode, Stretch, Unknown};
use piece::{Piece, Span};
use thiserror::Error;

use sesame_base::robustness::{Quantifier, quantifier};
use sesame_base::time::SimTime;
use sesame_plan::stl::Formula;

mod minimum;
mod node;
mod piece;
mod signal;
#[cfg(test)]
mod tests;
mod until;

pub use signal::Signal;

/// A time after everything, in nanoseconds.
const FOREVER: i64 = i64::MAX / 2;

/// Why a formula cannot be monitored. The generator writes none of these, so a plan with one was edited.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum FormulaError {
    /// An invalid interval.
    #[error(
        "an operator has an interval from {from} s to {to} s; its ends must be finite and in rising order from 0 on \
         (leave out the end of an unbounded one)"
    )]
    Interval {
        /// Its lower end.
        from: f64,
        /// Its upper end; infinite when it has none.
        to: f64,
    },
    /// A constant that is not finite.
    #[error("signal {signal} is compared with {constant}; compare it with a finite number")]
    Constant {
        /// The signal it is compared with.
        signal: u32,
        /// The constant.
        constant: f64,
    },
    /// A signal that the metric does not have.
    #[error("the formula names signal {signal} of {count}; name one below {count}")]
    Signal {
        /// The signal.
        signal: u32,
        /// How many there are.
        count: usize,
    },
}

/// The robustness of one formula on one trace, computed as samples come.
///
/// ```
/// use sesame_plan::Comparison;
/// use sesame_plan::stl::{Formula, Interval};
/// use sesame_base::time::SimTime;
/// use sesame_stl::Monitor;
///
/// let clear = Formula::Predicate { signal: 0, comparison: Comparison::Above, constant: 0.5 };
/// let always_clear = Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(clear) };
/// let mut monitor = Monitor::new(&always_clear, 1)?;
/// monitor.push(SimTime::from_seconds(0.0), 0, 2.0);
/// monitor.push(SimTime::from_seconds(1.5), 0, 0.75);
/// monitor.push(SimTime::from_seconds(3.0), 0, 1.0);
/// assert_eq!(monitor.finish(SimTime::from_seconds(10.0)), Some(0.25));
/// # Ok::<(), sesame_stl::FormulaError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Monitor {
    root: FormulaNode,
    used: Vec<bool>,
    values: Vec<f64>,
    /// How many signals of the formula have had no sample yet, and which have.
    unknown: usize,
    known: Vec<bool>,
    /// When the trace began: when the last of the signals got its first sample.
    start: Option<SimTime>,
    now: SimTime,
    robustness: VecDeque<Piece>,
    /// Whether only windows count that are completely within the trace.
    whole: bool,
    quantifier: Option<Quantifier>,
    /// Up to where the trace was known when the robustness was.
    decided: Option<i64>,
}

impl Monitor {
    /// A monitor without samples, for a formula over this many signals.
    pub fn new(formula: &Formula, signals: usize) -> Result<Self, FormulaError> {
        let mut used = vec![false; signals];
        let root = FormulaNode::new(formula, Span::FIRST_INSTANT, &mut used)?;
        Ok(Monitor {
            root,
            unknown: used.iter().filter(|&&used| used).count(),
            used,
            values: vec![f64::NAN; signals],
            known: vec![false; signals],
            start: None,
            now: SimTime::from_nanos(i64::MIN),
            robustness: VecDeque::new(),
            whole: false,
            quantifier: quantifier(formula),
            decided: None,
        })
    }

    /// The same monitor, which keeps the signal of its formula for [`Monitor::finish_with_signal`].
    pub fn keeping_its_signal(mut self) -> Self {
        if self.quantifier.is_some() {
            self.root.keep_signal();
        }
        self
    }

    /// The same monitor, for which windows that the end of the trace would cut do not count: see the module's words on
    /// whole windows.
    pub fn over_whole_windows(self) -> Self {
        Monitor { whole: true, ..self }
    }

    /// Takes a sample: from `time` on, `signal` has this `value`. Samples come in the order of their times; a signal
    /// that the formula does not name changes nothing.
    pub fn push(&mut self, time: SimTime, signal: usize, value: f64) {
        assert!(time >= self.now, "samples come in the order of their times, and {time} is before {}", self.now);
        if !self.used[signal] {
            return;
        }
        if let Some(start) = self.start
            && time > self.now
        {
            self.extend((time - start).nanos(), false, None);
        }
        self.now = time;
        self.values[signal] = value;
        if !self.known[signal] {
            self.known[signal] = true;
            self.unknown -= 1;
            if self.unknown == 0 {
                self.start = Some(time);
            }
        }
    }

    /// The robustness of the trace that ends at `end`, which is no earlier than the last sample; `None` if there is no
    /// trace, since a signal of the formula never had a sample. It is infinite when the trace ends before anything is
    /// asked of it, or by a signal that is infinite or NaN.
    pub fn finish(mut self, end: SimTime) -> Option<f64> {
        self.close(end).map(|(_, robustness)| robustness)
    }

    /// The same with the signal of the formula, if the monitor [keeps](Monitor::keeping_its_signal) it.
    pub fn finish_with_signal(mut self, end: SimTime) -> Option<(f64, Signal)> {
        let (start, robustness) = self.close(end)?;
        let signal = match self.quantifier {
            Some(_) => {
                let (from, pieces) = self.root.signal()?;
                Signal::of(start, from, &pieces, end)
            }
            None => Signal::known_at(
                self.decided.map_or(end, |decided| start + SimTime::from_nanos(decided)),
                robustness,
                end,
            ),
        };
        Some((robustness, signal))
    }

    /// Ends the trace: when it began, and its robustness.
    fn close(&mut self, end: SimTime) -> Option<(SimTime, f64)> {
        assert!(end >= self.now, "a trace ends no earlier than its last sample, and {end} is before {}", self.now);
        let start = self.start?;
        self.extend((end - start).nanos().saturating_add(1), true, None);
        // Without it nothing is left of the windows that the formula asks for. The sum turns the zero that is
        // negative, a matter of how often it was negated, into the other.
        Some((start, self.robustness.front().map_or(f64::INFINITY, |first| first.value + 0.0)))
    }

    /// The least and the greatest robustness that the trace may still come to, when it breaks off at `now`, which is no
    /// earlier than the last sample: for all values of the signals from `now` on, that time included, and whenever the
    /// trace then ends. Never too narrow.
    pub fn reach(&self, now: SimTime) -> (f64, f64) {
        assert!(
            now >= self.now,
            "a trace breaks off no earlier than its last sample, and {now} is before {}",
            self.now
        );
        let Some(start) = self.start else { return (f64::NEG_INFINITY, f64::INFINITY) };
        let known = (now - start).nanos();
        let extreme = |extreme: f64| {
            let mut ahead = self.clone();
            if known > 0 {
                ahead.extend(known, false, None);
            }
            ahead.extend(FOREVER, true, Some(&Unknown { known, extreme }));
            let value = ahead.robustness.front().map_or(extreme, |first| first.value + 0.0);
            if value.abs() == f64::MAX { extreme } else { value }
        };
        (extreme(f64::NEG_INFINITY), extreme(f64::INFINITY))
    }

    fn extend(&mut self, end: i64, last: bool, unknown: Option<&Unknown>) {
        let stretch = Stretch { end, last, unknown, whole: self.whole };
        self.root.extend(stretch, &self.values, &mut self.robustness);
        if self.decided.is_none() && !self.robustness.is_empty() {
            self.decided = Some(end);
        }
    }
}
