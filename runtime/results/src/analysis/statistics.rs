//! Intervals of probabilities, and samples of numbers.

use serde::Serialize;

/// The 0.975 quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// The 95 % Wilson score interval of a probability, from `k` of `n` independent trials (Wilson 1927); `None` without a
/// trial. Both ends are in `0..=1`.
pub(crate) fn wilson(k: usize, n: usize) -> Option<[f64; 2]> {
    if n == 0 {
        return None;
    }
    let (k, n) = (k as f64, n as f64);
    let share = k / n;
    let centre = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * libm::sqrt(share * (1.0 - share) / n + Z * Z / (4.0 * n * n));
    // At its ends the interval is exact, which rounding would hide.
    let low = if k == 0.0 { 0.0 } else { (centre - half).max(0.0) };
    let high = if k == n { 1.0 } else { (centre + half).min(1.0) };
    Some([low, high])
}

/// A sample of numbers at a glance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Sample {
    /// How many there are.
    pub(crate) count: usize,
    /// Their mean.
    pub(crate) mean: f64,
    /// Their standard deviation, of a sample (with `n − 1`); `None` of a single number.
    pub(crate) deviation: Option<f64>,
    /// The smallest.
    pub(crate) min: f64,
    /// The median; the mean of the two in the middle of an even number.
    pub(crate) median: f64,
    /// The largest.
    pub(crate) max: f64,
}

impl Sample {
    /// Of finite numbers in any order, which makes no difference; `None` without one.
    pub(crate) fn of(numbers: impl IntoIterator<Item = f64>) -> Option<Sample> {
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
    fn wilson_intervals_are_those_of_the_literature() {
        let rounded = |k, n| wilson(k, n).map(|ends| ends.map(|end| libm::round(end * 1e4) / 1e4));
        assert_eq!(rounded(7, 10), Some([0.3968, 0.8922]));
        assert_eq!(rounded(0, 10), Some([0.0, 0.2775]));
        assert_eq!(rounded(10, 10), Some([0.7225, 1.0]));
        assert_eq!(rounded(1, 2), Some([0.0945, 0.9055]));
        // Newcombe 1998, table I, method 3.
        assert_eq!(rounded(81, 263), Some([0.2553, 0.3662]));
        assert_eq!(rounded(15, 148), Some([0.0624, 0.1605]));
        assert_eq!(wilson(0, 0), None);
    }

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

        /// The oracle: the ends are where the score test of a probability `p` just rejects.
        #[test]
        fn the_ends_are_where_the_score_test_rejects(n in 1usize..400, share in 0.0..=1.0f64) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a small count")]
            let k = (share * n as f64) as usize;
            let [low, high] = wilson(k, n).unwrap();
            let observed = k as f64 / n as f64;
            prop_assert!(0.0 <= low && low <= observed && observed <= high && high <= 1.0);
            for p in [low, high].into_iter().filter(|&p| p > 0.0 && p < 1.0) {
                let score = (observed - p).abs() / (p * (1.0 - p) / n as f64).sqrt();
                prop_assert!((score - Z).abs() < 1e-6, "{} of {}: {} at {}", k, n, score, p);
            }
        }
    }
}
