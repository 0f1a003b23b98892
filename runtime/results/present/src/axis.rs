//! Axes: round ticks, and where a value stands between the ends.

use crate::number;

/// An axis from one round number to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Where it begins.
    pub low: f64,
    /// Where it ends; above `low`.
    pub high: f64,
    /// Round numbers on it, evenly spaced, both ends included.
    pub ticks: Vec<f64>,
}

impl Axis {
    /// The shortest axis with round ends that holds all values, with about so many ticks.
    pub fn round(values: impl IntoIterator<Item = f64>, ticks: u32) -> Axis {
        let (low, high) = ends(values);
        let step = step(high - low, ticks);
        let (first, last) = (libm::floor(low / step + 1e-9), libm::ceil(high / step - 1e-9));
        let ticks = positions(first, last).map(|n| n * step).collect();
        Axis { low: first * step, high: last * step, ticks }
    }

    /// An axis with these very ends, and the round numbers between them.
    pub fn exact(low: f64, high: f64, ticks: u32) -> Axis {
        let (low, high) = ends([low, high]);
        let step = step(high - low, ticks);
        let (first, last) = (libm::ceil(low / step - 1e-9), libm::floor(high / step + 1e-9));
        Axis { low, high, ticks: positions(first, last).map(|n| n * step).collect() }
    }

    /// Where a value stands: 0 at the low end, 1 at the high one.
    pub fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// The ticks in words.
    pub fn labels(&self) -> Vec<String> {
        let decimals = number::decimals(self.ticks.iter().copied());
        self.ticks.iter().map(|&tick| number::fixed(tick, decimals)).collect()
    }
}

/// Least and largest of the finite values, apart.
fn ends(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    if low > high {
        (0.0, 1.0)
    } else if high - low <= 1e-9 * high.abs().max(low.abs()) {
        let margin = if low == 0.0 { 1.0 } else { low.abs() * 0.1 };
        if low == 0.0 { (0.0, margin) } else { (low - margin, high + margin) }
    } else {
        (low, high)
    }
}

fn positions(first: f64, last: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(first), |n| Some(n + 1.0)).take_while(move |&n| n <= last)
}

/// 1, 2 or 5 times a power of ten, so that about so many steps make the length.
fn step(length: f64, ticks: u32) -> f64 {
    let raw = length / f64::from(ticks);
    let power = libm::exp10(libm::floor(libm::log10(raw)));
    let times = raw / power;
    power
        * if times <= 1.0 {
            1.0
        } else if times <= 2.0 {
            2.0
        } else if times <= 5.0 {
            5.0
        } else {
            10.0
        }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(Axis::round([0.2, 64.0], 6).ticks, [0.0, 20.0, 40.0, 60.0, 80.0]);
        assert_eq!(Axis::exact(0.0, 70.0, 8).ticks, [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0]);
        assert_eq!(Axis::exact(0.0, 70.0, 8).labels()[1], "10");
        assert_eq!(Axis::round([], 5), Axis::round([0.0, 1.0], 5));
    }

    proptest! {
        #[test]
        fn an_axis_holds_its_values_and_few_ticks(
            values in prop::collection::vec(-1e6f64..1e6, 1..20), scale in -3i32..4, ticks in 3u32..10,
        ) {
            let values: Vec<f64> = values.iter().map(|value| value * libm::exp10(f64::from(scale))).collect();
            let axis = Axis::round(values.iter().copied(), ticks);
            prop_assert!(axis.low < axis.high);
            prop_assert!((2..=2 + ticks as usize).contains(&axis.ticks.len()), "{:?}", axis.ticks);
            for value in values {
                prop_assert!((-1e-6..=1.0 + 1e-6).contains(&axis.share(value)));
            }
        }
    }
}
