//! Time series, and rows of values that are sampled alike: distance, correlation, the line that leads from one to the
//! other.

use std::fmt;

use crate::samples::Undefined;

/// Values over time.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    times: &'a [f64],
    values: &'a [f64],
    between: Between,
}

/// What a series is between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// The last value: what a receiver of messages knows.
    #[default]
    Held,
    /// On the straight line to the next one: nearer to a quantity that moves continuously, and needed to take out a lag
    /// that is shorter than the time between samples.
    Linear,
}

/// Why numbers are not series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotASeries {
    /// There are no samples.
    Empty,
    /// There are not as many values as times.
    Lengths {
        /// How many times.
        times: usize,
        /// How many values.
        values: usize,
    },
    /// The sample with this index, from 0 on, is not finite.
    NotFinite(usize),
    /// The time with this index, from 0 on, is less than the one before.
    Unordered(usize),
}

impl fmt::Display for NotASeries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NotASeries::Empty => write!(f, "the series has no samples"),
            NotASeries::Lengths { times, values } => write!(f, "the series has {times} times and {values} values"),
            NotASeries::NotFinite(at) => write!(f, "sample {at} of the series is not a finite number"),
            NotASeries::Unordered(at) => write!(f, "sample {at} of the series is earlier than the one before"),
        }
    }
}

impl std::error::Error for NotASeries {}

impl<'a> Series<'a> {
    /// Takes times in seconds, ascending, with a value each. If samples have the same time, the last one counts.
    pub fn new(times: &'a [f64], values: &'a [f64], between: Between) -> Result<Self, NotASeries> {
        if times.len() != values.len() {
            return Err(NotASeries::Lengths { times: times.len(), values: values.len() });
        }
        if times.is_empty() {
            return Err(NotASeries::Empty);
        }
        if let Some(at) = times.iter().zip(values).position(|(time, value)| !time.is_finite() || !value.is_finite()) {
            return Err(NotASeries::NotFinite(at));
        }
        if let Some(at) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(NotASeries::Unordered(at + 1));
        }
        Ok(Series { times, values, between })
    }

    /// The time of the first sample.
    pub fn start(&self) -> f64 {
        self.times[0]
    }

    /// The time of the last sample.
    pub fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// The median time between two samples, above 0; `None` if all have one time.
    pub fn interval(&self) -> Option<f64> {
        let mut intervals: Vec<f64> =
            self.times.windows(2).map(|pair| pair[1] - pair[0]).filter(|&d| d > 0.0).collect();
        intervals.sort_by(f64::total_cmp);
        intervals.get(intervals.len() / 2).copied()
    }

    /// The value at a time; before the first sample the first value, after the last one the last. A sample up to a
    /// nanosecond later counts, since that is the resolution of simulation time, and sums of steps are rounded.
    pub fn at(&self, time: f64) -> f64 {
        self.after(time, self.times.partition_point(|&other| other <= time + NANOSECOND))
    }

    /// The values at `count` times from `start` on, one every `step` seconds, from 0 on.
    pub fn resampled(&self, start: f64, step: f64, count: usize) -> Vec<f64> {
        // Times only grow, so the sample before them is found once and then followed.
        let mut next = self.times.partition_point(|&other| other <= start + NANOSECOND);
        let value = |i: usize| {
            let time = start + step * i as f64;
            while self.times.get(next).is_some_and(|&other| other <= time + NANOSECOND) {
                next += 1;
            }
            self.after(time, next)
        };
        (0..count).map(value).collect()
    }

    /// The value at a time that the sample of index `next` and no earlier one comes after.
    fn after(&self, time: f64, next: usize) -> f64 {
        if next == 0 {
            return self.values[0];
        }
        let (before, value) = (self.times[next - 1], self.values[next - 1]);
        match self.between {
            Between::Linear if next < self.times.len() => {
                value + (self.values[next] - value) * ((time - before) / (self.times[next] - before))
            }
            _ => value,
        }
    }
}

/// In seconds.
const NANOSECOND: f64 = 1e-9;

/// The least number of common samples that any statement needs.
const LEAST: usize = 4;
/// The greatest number of samples on a common grid: some hours at a thousand samples per second.
const MOST: f64 = 2e7;

/// How many samples, `step` seconds apart, fit from `start` to `end`.
pub(crate) fn samples_between(start: f64, end: f64, step: f64) -> Result<usize, Undefined> {
    assert!(step > 0.0 && step.is_finite(), "samples are some time apart");
    // A grid that ends at the last sample has that sample, whatever rounding says.
    let count = libm::floor((end - start) / step + 1e-9) + 1.0;
    assert!(count < MOST, "a common grid has at most {MOST} samples: choose a greater step");
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was just bounded")]
    let count = count.max(0.0) as usize;
    if count < LEAST { Err(Undefined::TooShort) } else { Ok(count) }
}

/// Both series on one grid over the time that they have in common, with a lag taken out: the simulation at `t` beside
/// the lab at `t + lag`.
pub fn aligned(simulation: &Series<'_>, lab: &Series<'_>, step: f64, lag: f64) -> Result<[Vec<f64>; 2], Undefined> {
    let start = simulation.start().max(lab.start() - lag);
    let count = samples_between(start, simulation.end().min(lab.end() - lag), step)?;
    Ok([simulation.resampled(start, step, count), lab.resampled(start + lag, step, count)])
}

/// The root mean square of the differences of two rows with as many values, at least one.
pub fn rms(a: &[f64], b: &[f64]) -> f64 {
    assert!(a.len() == b.len() && !a.is_empty(), "rows that are compared have values, as many in each");
    let squares: f64 = a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum();
    libm::sqrt(squares / a.len() as f64)
}

/// Sums of products around the means of two rows with as many values.
#[derive(Debug, Clone, Copy)]
struct Products {
    means: [f64; 2],
    squares: [f64; 2],
    product: f64,
}

impl Products {
    fn of(a: &[f64], b: &[f64]) -> Result<Products, Undefined> {
        assert!(a.len() == b.len(), "rows that are compared have as many values each");
        if a.len() < 2 {
            return Err(Undefined::TooShort);
        }
        let n = a.len() as f64;
        let means = [a, b].map(|row| row[0] + row.iter().map(|x| (x - row[0]) / n).sum::<f64>());
        let (mut squares, mut product) = ([0.0, 0.0], 0.0);
        for (x, y) in a.iter().zip(b) {
            let (x, y) = (x - means[0], y - means[1]);
            squares[0] += x * x;
            squares[1] += y * y;
            product += x * y;
        }
        Ok(Products { means, squares, product })
    }

    /// Whether a row varies by more than rounding.
    fn varies(&self, row: usize) -> bool {
        self.squares[row] > 0.0 && libm::sqrt(self.squares[row]) > 1e-14 * self.means[row].abs()
    }
}

/// Pearson's correlation coefficient of two rows with as many values, in `-1..=1`; undefined if one does not vary.
pub fn pearson(a: &[f64], b: &[f64]) -> Result<f64, Undefined> {
    let products = Products::of(a, b)?;
    if !products.varies(0) || !products.varies(1) {
        return Err(Undefined::NoSpread);
    }
    let scale = libm::sqrt(products.squares[0]) * libm::sqrt(products.squares[1]);
    Ok((products.product / scale).clamp(-1.0, 1.0))
}

/// The lab as a line of the simulation: `lab ≈ gain · simulation + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// By what the simulation's values are multiplied.
    pub gain: f64,
    /// What is added, in the unit of the values.
    pub offset: f64,
    /// The standard deviation of what is left: noise, and whatever else a line does not describe.
    pub noise: f64,
}

impl Line {
    /// The line of least squares through three values or more; undefined if the simulation does not vary.
    pub fn of(simulation: &[f64], lab: &[f64]) -> Result<Line, Undefined> {
        let products = Products::of(simulation, lab)?;
        if simulation.len() < 3 {
            return Err(Undefined::TooShort);
        }
        if !products.varies(0) {
            return Err(Undefined::NoSpread);
        }
        let gain = products.product / products.squares[0];
        let offset = products.means[1] - gain * products.means[0];
        let residual = |(x, y): (&f64, &f64)| {
            let left = (y - products.means[1]) - gain * (x - products.means[0]);
            left * left
        };
        let squares: f64 = simulation.iter().zip(lab).map(residual).sum();
        Ok(Line { gain, offset, noise: libm::sqrt(squares / (simulation.len() as f64 - 2.0)) })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_last_value_is_held_or_the_next_one_is_approached() {
        let (times, values) = ([1.0, 2.0, 2.0, 4.0], [10.0, 20.0, 30.0, 50.0]);
        let held = Series::new(&times, &values, Between::Held).unwrap();
        assert_eq!([0.0, 1.0, 1.9, 2.0, 3.0, 4.0, 9.0].map(|t| held.at(t)), [10.0, 10.0, 10.0, 30.0, 30.0, 50.0, 50.0]);
        let linear = Series::new(&times, &values, Between::Linear).unwrap();
        assert_eq!([1.5, 3.0, 4.0, 9.0].map(|t| linear.at(t)), [15.0, 40.0, 50.0, 50.0]);
        assert_eq!(held.interval(), Some(2.0));
    }

    #[test]
    fn numbers_that_are_no_series_are_refused_by_name() {
        let of = |times: &[f64], values: &[f64]| Series::new(times, values, Between::Held).map(|_| ());
        assert_eq!(of(&[], &[]), Err(NotASeries::Empty));
        assert_eq!(of(&[1.0], &[]), Err(NotASeries::Lengths { times: 1, values: 0 }));
        assert_eq!(of(&[1.0, 2.0], &[1.0, f64::NAN]), Err(NotASeries::NotFinite(1)));
        assert_eq!(of(&[2.0, 1.0], &[1.0, 1.0]), Err(NotASeries::Unordered(1)));
    }

    #[test]
    fn a_line_and_a_correlation_are_what_the_textbook_computes() {
        let (x, y) = ([1.0, 2.0, 3.0, 4.0], [2.0, 3.0, 5.0, 6.0]);
        let line = Line::of(&x, &y).unwrap();
        assert!((line.gain - 1.4).abs() < 1e-12 && (line.offset - 0.5).abs() < 1e-12);
        // Residuals 0.1, -0.3, 0.3, -0.1: their squares are 0.2, over two degrees of freedom.
        assert!((line.noise - libm::sqrt(0.1)).abs() < 1e-12, "{line:?}");
        assert!((pearson(&x, &y).unwrap() - 7.0 / libm::sqrt(50.0)).abs() < 1e-12);
        assert_eq!(pearson(&x, &[3.0; 4]), Err(Undefined::NoSpread));
        assert!((rms(&x, &y) - libm::sqrt(10.0 / 4.0)).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn a_row_is_the_value_at_each_time(
            steps in prop::collection::vec(0.0..2.0f64, 1..20), start in -3.0..3.0f64, step in 0.0..2.0f64,
            linear in any::<bool>(),
        ) {
            let mut at = 0.0;
            let times: Vec<f64> = steps.iter().map(|step| { at += step; at }).collect();
            let between = if linear { Between::Linear } else { Between::Held };
            let series = Series::new(&times, &steps, between).unwrap();
            let row = series.resampled(start, step, 30);
            let one_by_one: Vec<f64> = (0..30).map(|i| series.at(start + step * f64::from(i))).collect();
            prop_assert_eq!(row, one_by_one);
        }

        #[test]
        fn swapped_and_scaled_rows_have_the_same_correlation(
            rows in prop::collection::vec((-5.0..5.0f64, -5.0..5.0f64), 3..30), gain in 0.1..10.0f64,
        ) {
            let (a, b): (Vec<f64>, Vec<f64>) = rows.into_iter().unzip();
            let scaled: Vec<f64> = a.iter().map(|x| -gain * x + 3.0).collect();
            let near = |x: f64, y: f64| (x - y).abs() < 1e-9;
            if let (Ok(one), Ok(other), Ok(turned)) = (pearson(&a, &b), pearson(&b, &a), pearson(&scaled, &b)) {
                prop_assert!(near(one, other) && near(one, -turned));
            }
            prop_assert!(near(rms(&a, &b), rms(&b, &a)));
            if let Ok(line) = Line::of(&a, &scaled) {
                prop_assert!(near(line.gain, -gain) && near(line.offset, 3.0) && line.noise < 1e-9);
            }
        }
    }
}
