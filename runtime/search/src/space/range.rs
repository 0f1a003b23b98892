//! Drawing and moving numbers and intervals inside what is permitted: windows, sub-ranges and single values alike.

use sesame_plan::{Operation, Span};
use sesame_rng::Stream;

/// The share of a permitted window that a test's window has at least: shorter ones rarely meet a message, so trying
/// them would only make void tests.
pub(crate) const SHORTEST_WINDOW: f64 = 1e-3;

/// A permitted range of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least number, itself permitted.
    pub low: f64,
    /// The greatest number, at least `low`, itself permitted.
    pub high: f64,
    /// How long an interval inside is at least; at most `high - low`, and 0 for whole numbers.
    pub shortest: f64,
    /// How long an interval inside is at most, at least `shortest`; infinite where `low` and `high` are the only limit,
    /// as for whole numbers.
    pub longest: f64,
    /// Whether only whole numbers are permitted; then both ends are whole.
    pub integer: bool,
}

/// How far a local step goes: its standard deviation as a share of the permitted range is log-uniform between these
/// two, so that both careful and bold steps are always tried and no scale has to be right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSizes {
    /// The smallest standard deviation.
    pub finest: f64,
    /// The largest.
    pub boldest: f64,
}

impl Range {
    /// The permitted window of an operation, in seconds.
    pub fn window(start: f64, end: f64) -> Self {
        Range {
            low: start,
            high: end,
            shortest: (end - start) * SHORTEST_WINDOW,
            longest: f64::INFINITY,
            integer: false,
        }
    }

    /// The windows of an operation in tests that end at a time; `None` where it can never be active.
    pub fn windows_of(operation: &Operation, end_after: f64) -> Option<Self> {
        let Span { start, end } = operation.within;
        let end = end.min(end_after);
        if start >= end {
            return None;
        }
        let all = Range::window(start, end);
        let Some(lengths) = operation.lengths else { return Some(all) };
        let room = end - start;
        if lengths.low > room && !lengths.contain(room) {
            return None;
        }
        let longest = lengths.high.min(room);
        let shortest = lengths.low.min(room).max(longest * SHORTEST_WINDOW);
        Some(Range { shortest, longest, ..all })
    }

    /// How long an interval inside is at most, as a number.
    pub fn greatest_length(self) -> f64 {
        self.longest.min(self.high - self.low)
    }

    /// All numbers between two, both included.
    pub fn between(low: f64, high: f64) -> Self {
        Range { low, high, shortest: 0.0, longest: f64::INFINITY, integer: false }
    }

    /// A range of numbers; `None` where they must be whole and no whole number is in it.
    pub fn numbers(low: f64, high: f64, integer: bool) -> Option<Self> {
        let (low, high) = if integer { (libm::ceil(low), libm::floor(high)) } else { (low, high) };
        (low <= high).then_some(Range { low, high, shortest: 0.0, longest: f64::INFINITY, integer })
    }

    /// Whether a test has no number to choose.
    pub fn is_fixed(self) -> bool {
        self.low == self.high
    }

    /// A number, uniform over the range.
    pub fn number(self, stream: &mut Stream) -> f64 {
        if self.integer {
            // The count of whole numbers may exceed what an integer type holds, hence the detour by floor.
            (self.low + libm::floor(stream.uniform(0.0, self.high - self.low + 1.0))).min(self.high)
        } else {
            let share = stream.unit();
            (self.low * (1.0 - share) + self.high * share).clamp(self.low, self.high)
        }
    }

    /// The number at a share of the range in `0..=1`; shares that are uniform give numbers that are.
    pub fn at(self, share: f64) -> f64 {
        if self.integer {
            (self.low + libm::floor(share * (self.high - self.low + 1.0))).min(self.high)
        } else {
            (self.low * (1.0 - share) + self.high * share).clamp(self.low, self.high)
        }
    }

    /// An interval `low <= high`, uniform over all that fit (the triangle of feasible pairs).
    pub fn interval(self, stream: &mut Stream) -> (f64, f64) {
        if self.integer {
            // There are n (n + 1) / 2 pairs of n whole numbers. An n by n + 1 rectangle holds each twice: once on or
            // below its diagonal, once above.
            let n = self.high - self.low + 1.0;
            let row = libm::floor(stream.uniform(0.0, n)).min(n - 1.0);
            let column = libm::floor(stream.uniform(0.0, n + 1.0)).min(n);
            let (low, high) = if column <= row { (column, row) } else { (row, column - 1.0) };
            return ((self.low + low).min(self.high), (self.low + high).min(self.high));
        }
        if self.longest.is_finite() {
            return self.interval_at([stream.unit(), stream.unit()]);
        }
        let starts = Range { high: (self.high - self.shortest).max(self.low), ..self };
        let (a, b) = (starts.number(stream), starts.number(stream));
        (a.min(b), (a.max(b) + self.shortest).min(self.high))
    }

    /// The interval at two shares in `0..=1`: the first decides its length, the second where it lies. Shares that are
    /// uniform and independent give intervals that are uniform over all that fit.
    pub fn interval_at(self, [length, place]: [f64; 2]) -> (f64, f64) {
        let room = self.high - self.low - self.shortest;
        // The share of all pairs of ends that is longer than x is (1 - x)²; `beyond` is left out of those that are not
        // too long.
        let beyond = if self.longest.is_finite() {
            let left = 1.0 - ((self.longest - self.shortest) / room).clamp(0.0, 1.0);
            if room > 0.0 { left * left } else { 0.0 }
        } else {
            0.0
        };
        let length = self.shortest + room * (1.0 - libm::sqrt(1.0 - length * (1.0 - beyond)));
        let length = length.min(self.longest);
        let start = self.low + (self.high - self.low - length) * place;
        (start.max(self.low), (start + length).min(self.high))
    }

    /// A longest interval, at a share in `0..=1` of the places that it can have.
    pub fn longest_interval(self, place: f64) -> (f64, f64) {
        let length = self.greatest_length();
        let start = (self.low + (self.high - self.low - length) * place).max(self.low);
        (start, (start + length).min(self.high))
    }

    /// A number near another. It differs unless the step ends where it began, at an end of the range.
    pub fn number_near(self, number: f64, steps: StepSizes, stream: &mut Stream) -> f64 {
        (number + self.step(steps, stream)).clamp(self.low, self.high)
    }

    /// An interval near another: moved as a whole, or one end moved.
    pub fn interval_near(self, (low, high): (f64, f64), steps: StepSizes, stream: &mut Stream) -> (f64, f64) {
        let way = stream.below(3);
        let step = self.step(steps, stream);
        // Where lengths are bounded, the size of a change of length is a share of the longest.
        let step =
            if way > 0 && self.longest.is_finite() { step * self.longest / (self.high - self.low) } else { step };
        match way {
            0 => {
                let step = step.clamp(self.low - low, self.high - high);
                ((low + step).max(self.low), (high + step).min(self.high))
            }
            1 => ((low + step).min(high - self.shortest).max(high - self.longest).max(self.low), high),
            _ => (low, (high + step).max(low + self.shortest).min(low + self.longest).min(self.high)),
        }
    }

    fn step(self, steps: StepSizes, stream: &mut Stream) -> f64 {
        let ratio = steps.boldest / steps.finest;
        let deviation = (self.high - self.low) * steps.finest * libm::pow(ratio, stream.unit());
        let step = deviation * stream.normal();
        // Whole steps go away from zero, as a step of no length is none.
        if self.integer { libm::copysign(libm::ceil(step.abs()), step) } else { step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: StepSizes = StepSizes { finest: 0.01, boldest: 0.3 };

    #[test]
    fn intervals_are_uniform_over_the_triangle_of_feasible_pairs() {
        let range = Range { low: 10.0, high: 20.0, shortest: 0.0, longest: f64::INFINITY, integer: false };
        let mut stream = Stream::derive(1, "test", &[]);
        let n = 40_000;
        let pairs: Vec<(f64, f64)> = (0..n).map(|_| range.interval(&mut stream)).collect();
        let share = |holds: fn(f64, f64) -> bool| {
            pairs.iter().filter(|(low, high)| holds(*low, *high)).count() as f64 / f64::from(n)
        };
        // Areas of the triangle with both legs 10 and area 50.
        assert!((share(|low, _| low < 15.0) - 0.75).abs() < 0.01);
        assert!((share(|_, high| high > 15.0) - 0.75).abs() < 0.01);
        assert!((share(|low, high| high - low > 5.0) - 0.25).abs() < 0.01);
        assert!((share(|low, high| low + high > 30.0) - 0.5).abs() < 0.01);
    }

    /// Compares with intervals drawn anew until they are short enough, which are uniform by definition.
    #[test]
    fn intervals_of_bounded_lengths_are_as_uniform_as_rejected_ones() {
        let range = Range { shortest: 0.5, longest: 3.0, ..Range::between(10.0, 20.0) };
        let free = Range { longest: f64::INFINITY, ..range };
        let mut stream = Stream::derive(1, "test", &[]);
        let n = 40_000;
        let mut sums = [[0.0; 4]; 2];
        for _ in 0..n {
            let ours = range.interval(&mut stream);
            assert!(10.0 <= ours.0 && ours.1 <= 20.0 && (0.5..=3.0).contains(&(ours.1 - ours.0)), "{ours:?}");
            let naive = loop {
                let drawn = free.interval(&mut stream);
                if drawn.1 - drawn.0 <= 3.0 {
                    break drawn;
                }
            };
            for (sums, (low, high)) in sums.iter_mut().zip([ours, naive]) {
                let values = [low, high - low, (high - low) * (high - low), low * (high - low)];
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / f64::from(n));
            }
        }
        let [ours, naive] = sums;
        assert!(ours.iter().zip(naive).all(|(a, b)| (a / b - 1.0).abs() < 0.01), "{ours:?} {naive:?}");
    }

    #[test]
    fn moved_windows_keep_to_bounded_lengths_and_reach_both() {
        let range = Range { shortest: 0.002, longest: 2.0, ..Range::window(0.0, 65.0) };
        let mut stream = Stream::derive(1, "test", &[]);
        let mut window = (30.0, 31.0);
        let (mut short, mut long) = (false, false);
        for _ in 0..3_000 {
            window = range.interval_near(window, STEPS, &mut stream);
            let length = window.1 - window.0;
            assert!(0.0 <= window.0 && window.1 <= 65.0 && (0.001..=2.000_001).contains(&length), "{window:?}");
            short |= length < 0.01;
            long |= length > 1.99;
        }
        assert!(short && long);
    }

    #[test]
    fn whole_intervals_are_uniform_over_the_feasible_pairs() {
        let range = Range { low: -1.0, high: 2.0, shortest: 0.0, longest: f64::INFINITY, integer: true };
        let mut stream = Stream::derive(1, "test", &[]);
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..20_000 {
            let (low, high) = range.interval(&mut stream);
            assert!(low <= high);
            *counts.entry((low.to_string(), high.to_string())).or_insert(0u32) += 1;
        }
        assert_eq!(counts.len(), 10, "{counts:?}");
        assert!(counts.values().all(|n| (1_800..2_200).contains(n)), "{counts:?}");
    }

    #[test]
    fn whole_numbers_are_uniform_with_both_ends() {
        let range = Range { low: 3.0, high: 6.0, shortest: 0.0, longest: f64::INFINITY, integer: true };
        let mut stream = Stream::derive(1, "test", &[]);
        let mut counts = [0u32; 4];
        for _ in 0..20_000 {
            let number = range.number(&mut stream);
            let place = [3.0, 4.0, 5.0, 6.0].iter().position(|&n| n == number).expect("one of the whole numbers");
            counts[place] += 1;
        }
        assert!(counts.iter().all(|n| (4_700..5_300).contains(n)), "{counts:?}");
    }

    #[test]
    fn a_whole_number_in_the_middle_always_moves() {
        let range = Range { low: 0.0, high: 10.0, shortest: 0.0, longest: f64::INFINITY, integer: true };
        let mut stream = Stream::derive(1, "test", &[]);
        for _ in 0..1_000 {
            let near = range.number_near(5.0, STEPS, &mut stream);
            assert!(near != 5.0 && libm::trunc(near) == near && (0.0..=10.0).contains(&near), "{near}");
        }
    }

    #[test]
    fn moved_windows_reach_the_ends_and_stay_inside() {
        let range = Range::window(0.0, 65.0);
        let mut stream = Stream::derive(1, "test", &[]);
        let mut window = (30.0, 40.0);
        let (mut at_start, mut at_end) = (false, false);
        for _ in 0..3_000 {
            window = range.interval_near(window, STEPS, &mut stream);
            assert!(0.0 <= window.0 && window.1 <= 65.0 && window.1 - window.0 > 0.999 * range.shortest, "{window:?}");
            at_start |= window.0 == 0.0;
            at_end |= window.1 == 65.0;
        }
        assert!(at_start && at_end);
    }
}
