//! `until` over a sliding window, on a queue made of two stacks.
//!
//! What `left until right` says of a stretch of time is two numbers: how well `left` holds all through it, and how
//! well it gets to `right` within it. A weak `until` is content with either. Both follow from those of its parts, so
//! they can be summed up in any grouping: on the stack that grows, all of it is one sum; on the stack that shrinks,
//! each entry is the sum of all behind it.

use std::collections::VecDeque;

use crate::piece::{Piece, Span, put};

/// What is known of a stretch of time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Passage {
    /// The least robustness of `left` on it.
    hold: f64,
    /// The robustness of `left until right` at its beginning, with `right` sought on it.
    arrive: f64,
}

impl Passage {
    /// A passage that takes no time at all.
    const EMPTY: Passage = Passage { hold: f64::INFINITY, arrive: f64::NEG_INFINITY };

    fn new(left: f64, right: f64) -> Self {
        Passage { hold: left, arrive: left.min(right) }
    }

    /// The robustness of what is asked of it.
    fn value(self, weak: bool) -> f64 {
        if weak { self.arrive.max(self.hold) } else { self.arrive }
    }

    /// This stretch and one right after it.
    fn then(self, later: Passage) -> Self {
        Passage { hold: self.hold.min(later.hold), arrive: self.arrive.max(self.hold.min(later.arrive)) }
    }
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    end: i64,
    passage: Passage,
}

/// The robustness of `left until right` with a window that begins at once, at each time of a span. Constant time per
/// piece, amortised: a piece enters each stack once.
#[derive(Debug, Clone)]
pub(super) struct SlidingUntil {
    /// Length of the window; `None` for one without end.
    length: Option<i64>,
    /// Whether `left` may hold all through the window instead.
    weak: bool,
    /// The next time to be told, and the end of all that is asked.
    asked: Span,
    /// The earlier part of the window, earliest last; each passage reaches to the end of this part.
    leaving: Vec<Entry>,
    /// The later part of the window, earliest first; each passage is its own.
    entering: Vec<Entry>,
    /// All that is entering.
    entered: Passage,
}

impl SlidingUntil {
    pub(super) fn new(length: Option<i64>, weak: bool, asked: Span) -> Self {
        SlidingUntil { length, weak, asked, leaving: Vec::new(), entering: Vec::new(), entered: Passage::EMPTY }
    }

    /// Whether the window has an end.
    pub(super) fn is_bounded(&self) -> bool {
        self.length.is_some()
    }

    /// How long the window is, if it has an end.
    pub(super) fn length(&self) -> Option<i64> {
        self.length
    }

    /// Whether a piece that ends there is in any window still to be told.
    pub(super) fn asks(&self, end: i64) -> bool {
        end > self.asked.start
    }

    /// Takes the next stretch on which neither signal changes, and tells what follows.
    pub(super) fn push(&mut self, end: i64, left: f64, right: f64, out: &mut VecDeque<Piece>) {
        if !self.asks(end) {
            return;
        }
        let passage = Passage::new(left, right);
        match self.entering.last_mut() {
            // It begins no window still asked for, so it need not be told apart from the one before it.
            Some(last) if last.end >= self.asked.end => last.passage = last.passage.then(passage),
            Some(last) if last.passage == passage => last.end = end,
            _ => self.entering.push(Entry { end, passage }),
        }
        self.entered = self.entered.then(passage);
        if let Some(length) = self.length {
            self.tell(end.saturating_sub(length), out);
        }
    }

    /// Tells the rest, for signals that end here.
    pub(super) fn finish(&mut self, end: i64, out: &mut VecDeque<Piece>) {
        self.tell(end, out);
    }

    /// Tells the robustness for the times before `end`, the windows of which are known.
    fn tell(&mut self, end: i64, out: &mut VecDeque<Piece>) {
        let end = end.min(self.asked.end);
        while self.asked.start < end {
            let told = match self.first() {
                Some(first) => {
                    Piece { end: end.min(first.end), value: first.passage.then(self.entered).value(self.weak) }
                }
                None => Piece { end, value: Passage::EMPTY.value(self.weak) },
            };
            put(out, told.end, told.value);
            self.asked.start = told.end;
        }
    }

    /// The first entry in the window, after those before it have left.
    fn first(&mut self) -> Option<Entry> {
        loop {
            match self.leaving.last() {
                Some(first) if first.end > self.asked.start => return Some(*first),
                Some(_) => {
                    self.leaving.pop();
                }
                None if self.entering.is_empty() => return None,
                None => self.turn_over(),
            }
        }
    }

    /// Makes all that is entering leaving.
    fn turn_over(&mut self) {
        let mut behind = Passage::EMPTY;
        while let Some(Entry { end, passage }) = self.entering.pop() {
            behind = passage.then(behind);
            self.leaving.push(Entry { end, passage: behind });
        }
        self.entered = Passage::EMPTY;
    }

    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.leaving.len() + self.entering.len()
    }
}
