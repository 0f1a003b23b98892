//! Two independent samples of one metric of one test, from a simulation and from a lab: the difference of their means,
//! and how great it is compared with their spread.
//!
//! Differences are the lab's value minus the simulation's. A simulator that always gives the same value is a sample
//! without spread: whoever knows that of a simulator that ran once passes its value twice, and then only the lab's
//! spread counts.

use std::fmt;

use crate::distribution::{student_quantile, student_tail};

/// Where runs were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// In the simulation.
    Simulation,
    /// In the lab.
    Lab,
}

/// Why a number does not exist. [`Display`](fmt::Display) says it in a clause without a full stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Undefined {
    /// One side has no values.
    NoRuns(Side),
    /// One run does not show how much runs differ, and this number depends on that.
    OneRun(Side),
    /// Too few runs in total.
    TooFewRuns,
    /// All values are equal on each side, or in a series, and the number is a ratio to their spread.
    NoSpread,
    /// Too many resamples have no value, because they repeat one run.
    Resamples,
    /// The two series have too little time in common.
    TooShort,
}

impl fmt::Display for Undefined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |side: &Side| match side {
            Side::Simulation => "the simulation",
            Side::Lab => "the lab",
        };
        match self {
            Undefined::NoRuns(of) => write!(f, "{} has no runs", side(of)),
            Undefined::OneRun(of) => write!(f, "{} has one run, which shows no spread", side(of)),
            Undefined::TooFewRuns => write!(f, "there are too few runs"),
            Undefined::NoSpread => write!(f, "all values are equal, so there is no spread to compare with"),
            Undefined::Resamples => write!(f, "too many resamples repeat a single run"),
            Undefined::TooShort => write!(f, "the series have too little time in common"),
        }
    }
}

/// The values of one metric in the runs of one test.
#[derive(Debug, Clone, Copy)]
pub struct Samples<'a> {
    simulation: &'a [f64],
    lab: &'a [f64],
}

impl<'a> Samples<'a> {
    /// Takes finite values, in any order; a side may be empty.
    pub fn new(simulation: &'a [f64], lab: &'a [f64]) -> Self {
        let finite = simulation.iter().chain(lab).all(|value| value.is_finite());
        assert!(finite, "samples are finite: what was not measured is left out");
        Samples { simulation, lab }
    }

    /// The simulation's values.
    pub fn simulation(self) -> &'a [f64] {
        self.simulation
    }

    /// The lab's values.
    pub fn lab(self) -> &'a [f64] {
        self.lab
    }
}

/// A sample at a glance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// How many values there are, at least 1.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation, of a sample (with `n − 1`); `None` of a single value.
    pub deviation: Option<f64>,
}

impl Moments {
    /// Summarises finite values; `None` without a value.
    pub fn of(values: &[f64]) -> Option<Moments> {
        let first = *values.first()?;
        let n = values.len() as f64;
        // From a value on, so that equal values have exactly themselves as their mean.
        let mean = first + values.iter().map(|x| (x - first) / n).sum::<f64>();
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let deviation = (values.len() > 1).then(|| libm::sqrt(squares / (n - 1.0)));
        Some(Moments { count: values.len(), mean, deviation })
    }

    /// The squared standard error of the mean.
    fn squared_error(self, side: Side) -> Result<f64, Undefined> {
        let deviation = self.deviation.ok_or(Undefined::OneRun(side))?;
        Ok(deviation * deviation / self.count as f64)
    }
}

/// The means of both sides, each with its spread.
pub fn moments(samples: Samples<'_>) -> Result<[Moments; 2], Undefined> {
    let simulation = Moments::of(samples.simulation).ok_or(Undefined::NoRuns(Side::Simulation))?;
    let lab = Moments::of(samples.lab).ok_or(Undefined::NoRuns(Side::Lab))?;
    Ok([simulation, lab])
}

/// The difference of two means with its uncertainty [Welch 1947]: unequal variances, and degrees of freedom after
/// Satterthwaite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Welch {
    /// The lab's mean minus the simulation's.
    pub difference: f64,
    /// The standard error of the difference, above 0.
    pub standard_error: f64,
    /// Degrees of freedom, at least 1.
    pub degrees: f64,
}

impl Welch {
    /// Compares two samples with two values or more each, at least one of which has spread.
    pub fn of(samples: Samples<'_>) -> Result<Welch, Undefined> {
        let [simulation, lab] = moments(samples)?;
        Welch::from_moments(simulation, lab)
    }

    /// The same from means and spreads.
    pub fn from_moments(simulation: Moments, lab: Moments) -> Result<Welch, Undefined> {
        let a = simulation.squared_error(Side::Simulation)?;
        let b = lab.squared_error(Side::Lab)?;
        let standard_error = libm::sqrt(a + b);
        // Spread that rounding alone explains is none.
        let least = 1e-14 * simulation.mean.abs().max(lab.mean.abs());
        if standard_error <= least {
            return Err(Undefined::NoSpread);
        }
        // As shares, so that squares of small errors do not vanish.
        let (a, b) = (a / (a + b), b / (a + b));
        let degrees = 1.0 / (a * a / (simulation.count as f64 - 1.0) + b * b / (lab.count as f64 - 1.0));
        Ok(Welch { difference: lab.mean - simulation.mean, standard_error, degrees })
    }

    /// The interval that contains the true difference with this confidence, in `0..1`.
    pub fn interval(self, confidence: f64) -> [f64; 2] {
        let half = student_quantile(0.5 + confidence / 2.0, self.degrees) * self.standard_error;
        [self.difference - half, self.difference + half]
    }

    /// The probability of such a difference or a greater one, in either direction, if there is none.
    pub fn p(self) -> f64 {
        (2.0 * student_tail(self.difference.abs() / self.standard_error, self.degrees)).min(1.0)
    }

    /// The probability of such a difference or a greater one if the true difference is `bound`.
    pub fn p_above(self, bound: f64) -> f64 {
        student_tail((self.difference - bound) / self.standard_error, self.degrees)
    }

    /// The probability of such a difference or a smaller one if the true difference is `bound`.
    pub fn p_below(self, bound: f64) -> f64 {
        student_tail((bound - self.difference) / self.standard_error, self.degrees)
    }
}

/// Cohen's d: the difference of the means in pooled standard deviations [Cohen 1988]. One side may have one value.
pub fn cohen_d(samples: Samples<'_>) -> Result<f64, Undefined> {
    let [simulation, lab] = moments(samples)?;
    if simulation.count + lab.count < 3 {
        return Err(Undefined::TooFewRuns);
    }
    let squares = |of: Moments| of.deviation.map_or(0.0, |deviation| deviation * deviation * (of.count as f64 - 1.0));
    let pooled = libm::sqrt((squares(simulation) + squares(lab)) / pooled_degrees(samples));
    if pooled <= 1e-14 * simulation.mean.abs().max(lab.mean.abs()) {
        return Err(Undefined::NoSpread);
    }
    Ok((lab.mean - simulation.mean) / pooled)
}

/// Hedges' g: Cohen's d without its bias in small samples, by the exact factor [Hedges 1981]. Four values at least.
pub fn hedges_g(samples: Samples<'_>) -> Result<f64, Undefined> {
    let d = cohen_d(samples)?;
    let degrees = pooled_degrees(samples);
    if degrees < 2.0 {
        return Err(Undefined::TooFewRuns);
    }
    let log = libm::lgamma(degrees / 2.0) - libm::lgamma((degrees - 1.0) / 2.0) - 0.5 * libm::log(degrees / 2.0);
    Ok(d * libm::exp(log))
}

fn pooled_degrees(samples: Samples<'_>) -> f64 {
    (samples.simulation.len() + samples.lab.len()) as f64 - 2.0
}

/// Cliff's delta [Cliff 1993]: the probability that a value of the lab is greater than one of the simulation, minus the
/// probability that it is smaller, in `-1..=1`. It depends on the order of values only.
pub fn cliff_delta(samples: Samples<'_>) -> Result<f64, Undefined> {
    moments(samples)?;
    let mut sorted = samples.simulation.to_vec();
    sorted.sort_by(f64::total_cmp);
    let sum: f64 = samples
        .lab
        .iter()
        .map(|&value| {
            let below = sorted.partition_point(|&other| other < value);
            let above = sorted.len() - sorted.partition_point(|&other| other <= value);
            below as f64 - above as f64
        })
        .sum();
    Ok(sum / (samples.simulation.len() as f64 * samples.lab.len() as f64))
}

/// The difference of the means: the lab's minus the simulation's.
pub fn difference(samples: Samples<'_>) -> Result<f64, Undefined> {
    moments(samples).map(|[simulation, lab]| lab.mean - simulation.mean)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * (1.0 + a.abs() + b.abs())
    }

    #[test]
    fn an_example_is_what_the_textbook_computes() {
        // Means 3 and 6, variances 1 and 4: s.e. = √(1/3 + 4/3), and (5/3)² / (1/18 + 16/18) = 50/17 degrees.
        let samples = Samples::new(&[2.0, 3.0, 4.0], &[4.0, 6.0, 8.0]);
        let welch = Welch::of(samples).unwrap();
        assert!(near(welch.difference, 3.0) && near(welch.standard_error, libm::sqrt(5.0 / 3.0)));
        assert!(near(welch.degrees, 50.0 / 17.0), "{welch:?}");
        assert!(near(cohen_d(samples).unwrap(), 3.0 / libm::sqrt(2.5)));
        // The exact factor of four degrees of freedom is √(2/π)·Γ(2)... = 0.797885.
        assert!(near(hedges_g(samples).unwrap(), 3.0 / libm::sqrt(2.5) * 0.797_884_560_802_865_4));
        // There are nine pairs, 2-4, 2-6 and so on: eight are greater and one, 4-4, is a tie.
        assert!(near(cliff_delta(samples).unwrap(), 8.0 / 9.0));
        assert!(near(welch.p(), welch.p_above(0.0) * 2.0));
    }

    #[test]
    fn what_has_no_value_says_why() {
        let of = Samples::new;
        assert_eq!(Welch::of(of(&[], &[1.0])), Err(Undefined::NoRuns(Side::Simulation)));
        assert_eq!(cliff_delta(of(&[1.0], &[])), Err(Undefined::NoRuns(Side::Lab)));
        assert_eq!(Welch::of(of(&[1.0, 2.0], &[1.0])), Err(Undefined::OneRun(Side::Lab)));
        assert_eq!(Welch::of(of(&[0.1; 7], &[0.3; 7])), Err(Undefined::NoSpread));
        assert_eq!(cohen_d(of(&[1.0], &[2.0])), Err(Undefined::TooFewRuns));
        assert_eq!(hedges_g(of(&[1.0], &[2.0, 3.0])), Err(Undefined::TooFewRuns));
        assert_eq!(cohen_d(of(&[5.0; 3], &[5.0; 3])), Err(Undefined::NoSpread));
        assert_eq!(cliff_delta(of(&[5.0; 3], &[5.0; 3])), Ok(0.0));
        assert_eq!(difference(of(&[5.0], &[7.0])), Ok(2.0));
        assert_eq!(Undefined::OneRun(Side::Lab).to_string(), "the lab has one run, which shows no spread");
    }

    #[test]
    fn a_value_passed_twice_is_known_exactly() {
        let lab = [1.0, 2.0, 4.0, 5.0];
        let welch = Welch::of(Samples::new(&[3.0, 3.0], &lab)).unwrap();
        let spread = Moments::of(&lab).unwrap().deviation.unwrap();
        assert!(near(welch.standard_error, spread / 2.0) && near(welch.degrees, 3.0), "{welch:?}");
    }

    fn any_sample() -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(prop_oneof![-10.0..10.0f64, (-3i32..3).prop_map(f64::from)], 1..12)
    }

    type Number = fn(Samples<'_>) -> Result<f64, Undefined>;

    proptest! {
        #[test]
        fn swapped_sides_change_the_sign_and_a_scale_changes_differences_only(
            a in any_sample(), b in any_sample(), scale in 0.01..100.0f64, offset in -10.0..10.0f64,
        ) {
            let welch = |a, b| Welch::of(Samples::new(a, b)).ok();
            let moved = |values: &[f64]| values.iter().map(|x| x * scale + offset).collect::<Vec<_>>();
            if let (Some(one), Some(other), Some(scaled)) = (welch(&a, &b), welch(&b, &a), welch(&moved(&a), &moved(&b)))
            {
                prop_assert!(near(one.difference, -other.difference) && near(one.p(), other.p()));
                let ([low, high], [swapped_low, swapped_high]) = (one.interval(0.9), other.interval(0.9));
                prop_assert!(near(low, -swapped_high) && near(high, -swapped_low));
                prop_assert!((one.p() - scaled.p()).abs() < 1e-6);
                prop_assert!(near(one.difference * scale, scaled.difference));
                let fewer = a.len().min(b.len()) as f64 - 1.0;
                let all = (a.len() + b.len()) as f64 - 2.0;
                prop_assert!(one.degrees > fewer - 1e-9 && one.degrees < all + 1e-9);
            }
            for number in [cohen_d as Number, hedges_g, cliff_delta] {
                let (one, other) = (number(Samples::new(&a, &b)), number(Samples::new(&b, &a)));
                if let (Ok(one), Ok(other)) = (one, other) {
                    prop_assert!(one.is_finite() && near(one, -other), "{one} {other}");
                }
                prop_assert_eq!(one.is_ok(), other.is_ok());
            }
        }

        #[test]
        fn cliffs_delta_is_a_count_of_pairs(a in any_sample(), b in any_sample()) {
            let pairs = b.iter().flat_map(|y| a.iter().map(move |x| f64::from(y > x) - f64::from(y < x)));
            let naive = pairs.sum::<f64>() / (a.len() * b.len()) as f64;
            prop_assert!(near(cliff_delta(Samples::new(&a, &b)).unwrap(), naive));
        }
    }
}
