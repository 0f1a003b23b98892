//! What repeating one test says about it: how often each requirement was violated, and how sure that is.

use serde::Serialize;

use sesame_plan::{CampaignPlan, Task};

use crate::record::{Origin, Tally, TestRow};

/// What the repetitions of one test say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repetition {
    /// The test that was repeated.
    pub test: String,
    /// How often each requirement was violated, in the space's order.
    pub requirements: Vec<ViolationRate>,
}

/// How often a requirement was violated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViolationRate {
    /// Its name.
    pub requirement: String,
    /// Its sentence.
    pub text: String,
    /// Runs that violate it.
    pub violated: usize,
    /// Runs that say anything about it: those that keep it, and those that violate it.
    pub conclusive: usize,
    /// The 95 % Wilson interval of the probability that a run violates it; `None` when no run says anything.
    pub interval: Option<[f64; 2]>,
}

/// The repetition that a run is, if it is one.
pub(crate) fn repetition(plan: &CampaignPlan, task: &Task, rows: &[TestRow]) -> Option<Repetition> {
    let repeated = task.repeated(plan)?;
    let requirements = plan.requirements.iter().map(|requirement| {
        let runs = rows.iter().filter(|row| row.origin == Origin::Search);
        let tally = Tally::of(runs.map(|row| row.verdict(requirement)));
        ViolationRate {
            requirement: requirement.name.clone(),
            text: requirement.text.clone(),
            violated: tally.violated,
            conclusive: tally.conclusive(),
            interval: wilson(tally.violated, tally.conclusive()),
        }
    });
    Some(Repetition { test: repeated.name.to_owned(), requirements: requirements.collect() })
}

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

    proptest! {
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
