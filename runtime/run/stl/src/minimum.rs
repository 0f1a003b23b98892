//! The least value in a sliding window, on a monotonic deque (Lemire, "Streaming maximum-minimum filter using no more
//! than three comparisons per element", 2006) of pieces instead of single elements.

use std::collections::VecDeque;

use crate::piece::{Piece, Span, Window, put, signed};

/// The minimum of a signal over a window, at each time of a span. Constant time per piece, amortised: a piece enters
/// and leaves the deque once.
#[derive(Debug, Clone)]
pub(super) struct SlidingMinimum {
    window: Window,
    /// Whether the negative of the minimum is told.
    pub(super) negated: bool,
    /// The next time to be told, and the end of all that is asked.
    asked: Span,
    /// Values in strictly rising order: each is the least from the end of the one before it on.
    rising: VecDeque<Piece>,
}

impl SlidingMinimum {
    pub(super) fn new(window: Window, asked: Span) -> Self {
        SlidingMinimum { window, negated: false, asked, rising: VecDeque::new() }
    }

    /// Takes the next piece of the signal, and tells what follows for the minimum.
    pub(super) fn push(&mut self, piece: Piece, out: &mut VecDeque<Piece>) {
        if piece.end <= self.asked.start.saturating_add(self.window.from) {
            return;
        }
        while self.rising.back().is_some_and(|last| last.value >= piece.value) {
            self.rising.pop_back();
        }
        // A last value that is in every window still asked for hides all greater ones behind it.
        let in_all = self.asked.end.saturating_add(self.window.from);
        if self.rising.back().is_none_or(|last| last.end < in_all) {
            self.rising.push_back(piece);
        }
        if let Some(to) = self.window.to {
            self.tell(piece.end.saturating_sub(to), out);
        }
    }

    /// Whether the window has an end.
    pub(super) fn is_bounded(&self) -> bool {
        self.window.to.is_some()
    }

    /// Tells the rest of the times whose windows begin before the signal ends, which is here.
    pub(super) fn finish(&mut self, end: i64, out: &mut VecDeque<Piece>) {
        self.tell(end.saturating_sub(self.window.from), out);
    }

    /// How far behind the end of the signal the times end that have a minimum.
    pub(super) fn reaches_ahead(&self, whole: bool) -> i64 {
        if whole { self.window.to.unwrap_or(self.window.from) } else { self.window.from }
    }

    /// Tells the minimum for the times before `end`, the windows of which are known.
    #[expect(clippy::inline_always, reason = "once per sample, and the call costs as much as the work")]
    #[inline(always)]
    fn tell(&mut self, end: i64, out: &mut VecDeque<Piece>) {
        let end = end.min(self.asked.end);
        while self.asked.start < end {
            let window_start = self.asked.start.saturating_add(self.window.from);
            while self.rising.front().is_some_and(|first| first.end <= window_start) {
                self.rising.pop_front();
            }
            let least = match self.rising.front() {
                Some(first) => Piece { end: end.min(first.end - self.window.from), value: first.value },
                None => Piece { end, value: f64::INFINITY },
            };
            put(out, least.end, signed(least.value, self.negated));
            self.asked.start = least.end;
        }
    }

    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.rising.len()
    }
}
