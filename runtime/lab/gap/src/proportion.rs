//! Shares of runs: how sure one is, and whether two differ.

/// The 0.975 quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;

/// The 95 % Wilson score interval of a probability, from `k` of `n` independent trials [Wilson 1927]; `None` without a
/// trial. Both ends are in `0..=1`.
pub fn wilson(k: usize, n: usize) -> Option<[f64; 2]> {
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

/// A share of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// How many of the trials.
    pub count: usize,
    /// How many trials, at least 1.
    pub of: usize,
    /// The 95 % Wilson interval of the probability.
    pub interval: [f64; 2],
}

impl Share {
    /// The share in this many trials; `None` without a trial.
    pub fn new(count: usize, of: usize) -> Option<Share> {
        assert!(count <= of, "a share is at most the whole");
        Some(Share { count, of, interval: wilson(count, of)? })
    }

    /// The share as a number in `0..=1`.
    pub fn value(self) -> f64 {
        self.count as f64 / self.of as f64
    }
}

/// The p value of Fisher's exact test, two-sided, that `a.0` of `a.1` trials and `b.0` of `b.1` have one probability:
/// of all tables with the same margins, those that are at most as likely as the observed one [Fisher 1935]. 1 if a side
/// has no trials.
pub fn fisher(a: (usize, usize), b: (usize, usize)) -> f64 {
    assert!(a.0 <= a.1 && b.0 <= b.1, "a share is at most the whole");
    let seen = a.0 + b.0;
    let log = |n: usize| libm::lgamma(n as f64 + 1.0);
    let choose = |n: usize, k: usize| log(n) - log(k) - log(n - k);
    let all = choose(a.1 + b.1, seen);
    let probability = |k: usize| libm::exp(choose(a.1, k) + choose(b.1, seen - k) - all);
    // Tables that are equally likely differ by rounding.
    let observed = probability(a.0) * (1.0 + 1e-7);
    let tables = seen.saturating_sub(b.1)..=seen.min(a.1);
    tables.map(probability).filter(|&p| p <= observed).sum::<f64>().min(1.0)
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
    fn fishers_test_counts_tables() {
        // The lady tasting tea: 3 of 4 and 1 of 4. Tables with 0 to 4: 1, 16, 36, 16, 1 of 70.
        assert!((fisher((3, 4), (1, 4)) - 34.0 / 70.0).abs() < 1e-12);
        assert!((fisher((4, 4), (0, 4)) - 2.0 / 70.0).abs() < 1e-12);
        assert_eq!(fisher((0, 0), (3, 5)), 1.0);
        assert!((fisher((0, 7), (0, 9)) - 1.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn sides_and_complements_can_be_swapped(n in 0usize..40, m in 0usize..40, i in 0usize..40, j in 0usize..40) {
            let (a, b) = ((i.min(n), n), (j.min(m), m));
            let not = |(k, n): (usize, usize)| (n - k, n);
            let p = fisher(a, b);
            prop_assert!((0.0..=1.0).contains(&p));
            prop_assert!((p - fisher(b, a)).abs() < 1e-9 && (p - fisher(not(a), not(b))).abs() < 1e-9);
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
