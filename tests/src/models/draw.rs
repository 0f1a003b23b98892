//! Random choices, from which a space is made.

use sesame_rng::Stream;

/// Random choices.
pub(super) struct Draw(pub(super) Stream);

impl Draw {
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// From `low` to `high`, both included.
    pub(super) fn between(&mut self, low: usize, high: usize) -> usize {
        low + self.0.below(high - low + 1)
    }

    pub(super) fn chance(&mut self, probability: f64) -> bool {
        self.0.chance(probability)
    }

    pub(super) fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.0.below(of.len())]
    }

    /// Two different positions below `n` at most, ascending; at least one.
    pub(super) fn some(&mut self, n: usize, most: usize) -> Vec<usize> {
        let count = self.between(1, most.min(n));
        let mut chosen = self.0.permutation(n);
        chosen.truncate(count);
        chosen
    }

    /// A decimal number from -20 to 20, sometimes a great or a tiny one.
    pub(super) fn number(&mut self) -> f64 {
        match self.below(12) {
            0 => 1e6 * self.0.uniform(-1.0, 1.0).round(),
            1 => 1e-6,
            2 => 0.0,
            3..=6 => self.0.uniform(-20.0, 20.0).round(),
            _ => (100.0 * self.0.uniform(-20.0, 20.0)).round() / 100.0,
        }
    }

    /// Two numbers, ascending.
    pub(super) fn range(&mut self) -> (f64, f64) {
        let (a, b) = (self.number(), self.number());
        (a.min(b), a.max(b))
    }

    /// A part of a range: an end, or both of it.
    pub(super) fn part(&mut self, (low, high): (f64, f64)) -> (f64, f64) {
        *self.one(&[(low, high), (low, low), (high, high)])
    }
}
