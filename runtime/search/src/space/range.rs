//! Drawing and moving numbers and intervals inside what is permitted: windows, sub-ranges and single values alike.

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
        Range { low: start, high: end, shortest: (end - start) * SHORTEST_WINDOW, integer: false }
    }

    /// All numbers between two, both included.
    pub fn between(low: f64, high: f64) -> Self {
        Range { low, high, shortest: 0.0, integer: false }
    }

    /// A range of numbers; `None` where they must be whole and no whole number is in it.
    pub fn numbers(low: f64, high: f64, integer: bool) -> Option<Self> {
        let (low, high) = if integer { (libm::ceil(low), libm::floor(high)) } else { (low, high) };
        (low <= high).then_some(Range { low, high, shortest: 0.0, integer })
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
            // Of n whole numbers there are n (n + 1) / 2 pairs. An n by n + 1 rectangle holds each twice: once on or
            // below its diagonal, once above.
            let n = self.high - self.low + 1.0;
            let row = libm::floor(stream.uniform(0.0, n)).min(n - 1.0);
            let column = libm::floor(stream.uniform(0.0, n + 1.0)).min(n);
            let (low, high) = if column <= row { (column, row) } else { (row, column - 1.0) };
            return ((self.low + low).min(self.high), (self.low + high).min(self.high));
        }
        let starts = Range { high: (self.high - self.shortest).max(self.low), ..self };
        let (a, b) = (starts.number(stream), starts.number(stream));
        (a.min(b), (a.max(b) + self.shortest).min(self.high))
    }

    /// A number near another. It differs unless the step ends where it began, at an end of the range.
    pub fn number_near(self, number: f64, steps: StepSizes, stream: &mut Stream) -> f64 {
        (number + self.step(steps, stream)).clamp(self.low, self.high)
    }

    /// An interval near another: moved as a whole, or one end moved.
    pub fn interval_near(self, (low, high): (f64, f64), steps: StepSizes, stream: &mut Stream) -> (f64, f64) {
        let way = stream.below(3);
        let step = self.step(steps, stream);
        match way {
            0 => {
                let step = step.clamp(self.low - low, self.high - high);
                ((low + step).max(self.low), (high + step).min(self.high))
            }
            1 => ((low + step).min(high - self.shortest).max(self.low), high),
            _ => (low, (high + step).max(low + self.shortest).min(self.high)),
        }
    }

    fn step(self, steps: StepSizes, stream: &mut Stream) -> f64 {
        let ratio = steps.boldest / steps.finest;
        let deviation = (self.high - self.low) * steps.finest * libm::pow(ratio, stream.unit());
        let step = deviation * stream.normal();
        match self.integer {
            // Away from zero, as a step of no length is none.
            true if step < 0.0 => libm::floor(step),
            true => libm::ceil(step),
            false => step,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: StepSizes = StepSizes { finest: 0.01, boldest: 0.3 };

    #[test]
    fn intervals_are_uniform_over_the_triangle_of_feasible_pairs() {
        let range = Range { low: 10.0, high: 20.0, shortest: 0.0, integer: false };
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

    #[test]
    fn whole_intervals_are_uniform_over_the_feasible_pairs() {
        let range = Range { low: -1.0, high: 2.0, shortest: 0.0, integer: true };
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
        let range = Range { low: 3.0, high: 6.0, shortest: 0.0, integer: true };
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
        let range = Range { low: 0.0, high: 10.0, shortest: 0.0, integer: true };
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
