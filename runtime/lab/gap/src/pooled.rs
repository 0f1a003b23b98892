//! What several estimates of one difference say together, and whether they can be of one difference (meta-analysis).

use crate::distribution::{f_tail, student_quantile, student_tail};
use crate::samples::Welch;

/// The common value of several differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pooled {
    /// How many differences it is of, at least 1.
    pub count: usize,
    /// Their mean, each weighted by its inverse squared standard error.
    pub estimate: f64,
    /// The standard error of that, allowing for weights that are estimates themselves [Meier 1953].
    pub standard_error: f64,
    /// Degrees of freedom, after Satterthwaite.
    pub degrees: f64,
}

impl Pooled {
    /// Pools differences by their standard errors, which are above 0; `None` without a difference.
    pub fn of<'a>(differences: impl IntoIterator<Item = &'a Welch>) -> Option<Pooled> {
        let differences: Vec<&Welch> = differences.into_iter().collect();
        let weights = Weights::of(&differences)?;
        let (mut estimate, mut unsure, mut inverse_degrees) = (0.0, 0.0, 0.0);
        for (difference, share) in differences.iter().zip(&weights.shares) {
            estimate += share * difference.difference;
            unsure += share * (1.0 - share) / difference.degrees;
            inverse_degrees += share * share / difference.degrees;
        }
        Some(Pooled {
            count: differences.len(),
            estimate,
            standard_error: libm::sqrt((1.0 + 4.0 * unsure) / weights.total),
            degrees: 1.0 / inverse_degrees,
        })
    }

    /// The p value of the two-sided test against a common value of 0.
    pub fn p(self) -> f64 {
        (2.0 * student_tail(self.estimate.abs() / self.standard_error, self.degrees)).min(1.0)
    }

    /// The interval that contains the common value with this confidence, in `0..1`.
    pub fn interval(self, confidence: f64) -> [f64; 2] {
        let half = student_quantile(0.5 + confidence / 2.0, self.degrees) * self.standard_error;
        [self.estimate - half, self.estimate + half]
    }
}

/// Inverse squared standard errors.
struct Weights {
    total: f64,
    /// The share of each weight in the total; they sum to 1.
    shares: Vec<f64>,
}

impl Weights {
    fn of(differences: &[&Welch]) -> Option<Weights> {
        let weight = |of: &&Welch| {
            assert!(of.standard_error > 0.0 && of.degrees > 0.0, "a difference without spread cannot be pooled");
            1.0 / (of.standard_error * of.standard_error)
        };
        let weights: Vec<f64> = differences.iter().map(weight).collect();
        let total: f64 = weights.iter().sum();
        (!weights.is_empty()).then(|| Weights { total, shares: weights.iter().map(|weight| weight / total).collect() })
    }
}

/// How much several differences differ from each other compared with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heterogeneity {
    /// Cochran's Q: the sum of squared deviations from the pooled value, in standard errors [Cochran 1954].
    pub q: f64,
    /// The share of the deviations that chance does not explain, in `0..1` [Higgins and Thompson 2002].
    pub i_squared: f64,
    /// The p value that all are of one difference. With few runs Q is too great, since standard errors are estimates;
    /// so this is of Welch's F, which is Q with a correction for that [Welch 1951].
    pub p: f64,
}

impl Heterogeneity {
    /// The heterogeneity of two or more differences; `None` for fewer.
    pub fn of<'a>(differences: impl IntoIterator<Item = &'a Welch>) -> Option<Heterogeneity> {
        let differences: Vec<&Welch> = differences.into_iter().collect();
        let count = differences.len() as f64;
        if differences.len() < 2 {
            return None;
        }
        let pooled = Pooled::of(differences.iter().copied())?.estimate;
        let weights = Weights::of(&differences)?;
        let (mut q, mut unsure) = (0.0, 0.0);
        for (difference, share) in differences.iter().zip(&weights.shares) {
            let deviation = (difference.difference - pooled) / difference.standard_error;
            q += deviation * deviation;
            unsure += (1.0 - share) * (1.0 - share) / difference.degrees;
        }
        let squares = count * count - 1.0;
        let f = q / (count - 1.0) / (1.0 + 2.0 * (count - 2.0) / squares * unsure);
        // Beyond this many degrees of freedom more make no difference.
        let p = f_tail(f, count - 1.0, (squares / (3.0 * unsure)).min(1e6));
        let i_squared = if q > count - 1.0 { (q - (count - 1.0)) / q } else { 0.0 };
        Some(Heterogeneity { q, i_squared, p })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use sesame_rng::Stream;

    use super::*;
    use crate::distribution::normal_cdf;
    use crate::samples::Samples;

    fn welch(difference: f64, standard_error: f64, degrees: f64) -> Welch {
        Welch { difference, standard_error, degrees }
    }

    /// The differences of made-up tests with this many runs on each side and these true differences.
    pub(crate) fn measured(seed: u64, runs: usize, truths: &[f64]) -> Vec<Welch> {
        let of = |(test, truth): (usize, &f64)| {
            let mut stream = Stream::derive(seed, "pooled", &[test as u64]);
            let simulation: Vec<f64> = (0..runs).map(|_| stream.normal()).collect();
            let lab: Vec<f64> = (0..runs).map(|_| truth + stream.normal()).collect();
            Welch::of(Samples::new(&simulation, &lab)).unwrap()
        };
        truths.iter().enumerate().map(of).collect()
    }

    #[test]
    fn an_example_is_what_the_formulas_say() {
        // Weights 4 and 1: mean (4·1 + 1·3)/5 = 1.4, Q = (0.4/0.5)² + (1.6/1)² = 3.2, I² = 2.2/3.2.
        let differences = [welch(1.0, 0.5, 1e9), welch(3.0, 1.0, 1e9)];
        let pooled = Pooled::of(&differences).unwrap();
        assert!((pooled.estimate - 1.4).abs() < 1e-12 && (pooled.standard_error - libm::sqrt(0.2)).abs() < 1e-6);
        let heterogeneity = Heterogeneity::of(&differences).unwrap();
        assert!((heterogeneity.q - 3.2).abs() < 1e-12 && (heterogeneity.i_squared - 0.6875).abs() < 1e-12);
        // Chi-squared with one degree of freedom is the square of a normal number.
        assert!((heterogeneity.p - 2.0 * normal_cdf(-libm::sqrt(3.2))).abs() < 1e-5);
        assert_eq!(Heterogeneity::of(&differences[..1]), None);
        assert_eq!(Pooled::of(&[]), None);
        assert_eq!(Pooled::of(&differences[..1]).unwrap().estimate, 1.0);
    }

    #[test]
    fn equal_differences_are_rarely_called_unequal_even_with_few_runs() {
        for runs in [4, 8, 30] {
            let wrong =
                (0..1000).filter(|&seed| Heterogeneity::of(&measured(seed, runs, &[0.7; 8])).unwrap().p <= 0.05);
            let wrong = wrong.count();
            assert!((15..=80).contains(&wrong), "{wrong} of 1000 with {runs} runs");
            let missed = (0..1000).filter(|&seed| {
                let [low, high] = Pooled::of(&measured(seed, runs, &[0.7; 8])).unwrap().interval(0.95);
                !(low..=high).contains(&0.7)
            });
            let missed = missed.count();
            assert!(missed <= 85, "{missed} of 1000 intervals with {runs} runs miss the value");
        }
    }
}
