//! Signals as pieces, which operators pass to each other.
//!
//! Times are whole nanoseconds since the beginning of the trace. Pieces of a signal follow one another without a gap,
//! so that each needs only its end. A consumer asks for a span; what a producer says of earlier times is meaningless.

use std::collections::VecDeque;

/// A value, up to but not including a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// The first time at which it no longer holds.
    pub(super) end: i64,
    /// The value; never NaN.
    pub(super) value: f64,
}

/// Adds a piece, or extends the last one if the value is the same.
pub(super) fn put(pieces: &mut VecDeque<Piece>, end: i64, value: f64) {
    match pieces.back_mut() {
        Some(last) if last.value == value => last.end = end,
        _ => pieces.push_back(Piece { end, value }),
    }
}

/// A value or, if negated, its negative.
pub(super) fn signed(value: f64, negated: bool) -> f64 {
    if negated { -value } else { value }
}

/// Times from `start` up to but not including `end`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: i64,
    pub(super) end: i64,
}

impl Span {
    /// The time at which the whole formula is evaluated.
    pub(super) const FIRST_INSTANT: Span = Span { start: 0, end: 1 };

    /// The times in the windows of these times.
    pub(super) fn seen_through(self, window: Window) -> Span {
        Span {
            start: self.start.saturating_add(window.from),
            end: window.to.map_or(i64::MAX, |to| self.end.saturating_add(to)),
        }
    }
}

/// An operator's interval: at time `t` the times from `t + from` to `t + to`, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// At least 0.
    pub(super) from: i64,
    /// At least `from`; `None` for a window without end.
    pub(super) to: Option<i64>,
}

/// Two signals of which one may be known further than the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Pair {
    pub(super) left: VecDeque<Piece>,
    pub(super) right: VecDeque<Piece>,
}

impl Pair {
    /// The next stretch on which both are known and neither changes: its end and both values.
    pub(super) fn pop(&mut self) -> Option<(i64, f64, f64)> {
        let (&left, &right) = (self.left.front()?, self.right.front()?);
        if left.end <= right.end {
            self.left.pop_front();
        }
        if right.end <= left.end {
            self.right.pop_front();
        }
        Some((left.end.min(right.end), left.value, right.value))
    }

    /// Takes all that is known of both, and passes on the least of the two.
    pub(super) fn least(&mut self, out: &mut VecDeque<Piece>) {
        while let Some((end, left, right)) = self.pop() {
            put(out, end, left.min(right));
        }
    }
}
