//! Samples of numbers.

use serde::Serialize;

/// A sample of numbers at a glance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sample {
    /// How many there are.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation, of a sample (with `n − 1`); `None` of a single number.
    pub deviation: Option<f64>,
    /// The smallest.
    pub min: f64,
    /// The median; with an even number of values, the mean of the two in the middle.
    pub median: f64,
    /// The largest.
    pub max: f64,
}

impl Sample {
    /// Summarises finite numbers in any order, which makes no difference; `None` without a number.
    pub fn of(numbers: impl IntoIterator<Item = f64>) -> Option<Sample> {
        let mut sorted: Vec<f64> = numbers.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len();
        let n = count as f64;
        // From the smallest number on, so that large ones cost no digits of equal numbers.
        let mean = min + sorted.iter().map(|x| (x - min) / n).sum::<f64>();
        let squares: f64 = sorted.iter().map(|x| (x - mean) * (x - mean)).sum();
        let deviation = (count > 1).then(|| libm::sqrt(squares / (n - 1.0)));
        let median = f64::midpoint(sorted[(count - 1) / 2], sorted[count / 2]);
        Some(Sample { count, mean, deviation, min, median, max })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_sample_is_described_as_textbooks_do() {
        let sample = Sample::of([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        assert_eq!((sample.count, sample.mean, sample.median), (8, 5.0, 4.5));
        assert!((sample.deviation.unwrap() - libm::sqrt(32.0 / 7.0)).abs() < 1e-12);
        assert_eq!((sample.min, sample.max), (2.0, 9.0));
        assert_eq!(Sample::of([]), None);
        assert_eq!(Sample::of([3.5]).unwrap().deviation, None);
        let equal = Sample::of([1e15 + 0.3; 7]).unwrap();
        assert_eq!((equal.mean, equal.deviation), (1e15 + 0.3, Some(0.0)));
    }

    proptest! {
        #[test]
        fn a_sample_is_what_the_definitions_say(numbers in prop::collection::vec(-1e3..1e3f64, 2..40)) {
            let sample = Sample::of(numbers.iter().copied()).unwrap();
            let n = numbers.len() as f64;
            let mean = numbers.iter().sum::<f64>() / n;
            let variance = numbers.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0);
            prop_assert!((sample.mean - mean).abs() < 1e-9);
            prop_assert!((sample.deviation.unwrap() - libm::sqrt(variance)).abs() < 1e-9);
            prop_assert!(sample.min <= sample.median && sample.median <= sample.max);
            let backwards = numbers.iter().rev().copied();
            prop_assert_eq!(Sample::of(backwards), Some(sample), "the order makes no difference");
        }
    }
}
