//! How likely an equivalence test shows what is true: before runs are made, and together with a comparison that stayed
//! undecided.

use crate::distribution::{deviation_density, normal_cdf, student_quantile};

/// What an equivalence test compares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// The standard deviation of the simulation's values, from 0 on.
    pub simulation_deviation: f64,
    /// The standard deviation of the lab's values, from 0 on; one of the two is above 0.
    pub lab_deviation: f64,
    /// The greatest difference that counts as none, from 0 on.
    pub tolerance: f64,
    /// The probability of a wrong "equivalent", in `0..0.5`.
    pub alpha: f64,
}

/// The power that studies are commonly planned for.
pub const TARGET: f64 = 0.8;

/// More runs than these are not suggested.
const MOST: usize = 10_000;

/// The probability that the test says "equivalent" if the true difference is 0, with two runs or more on each side; in
/// `0..=1`.
///
/// The spread of the standard error around its true value follows Satterthwaite's degrees of freedom; with equal
/// deviations and counts this is the exact power [Phillips 1990].
pub fn tost_power(design: Design, simulation_runs: usize, lab_runs: usize) -> f64 {
    let Design { simulation_deviation, lab_deviation, tolerance, alpha } = design;
    assert!(simulation_runs > 1 && lab_runs > 1, "the test needs two runs on each side");
    assert!(simulation_deviation + lab_deviation > 0.0 && alpha > 0.0 && alpha < 0.5, "the design has a spread");
    let (m, n) = (simulation_runs as f64, lab_runs as f64);
    let (a, b) = (simulation_deviation * simulation_deviation / m, lab_deviation * lab_deviation / n);
    let error = libm::sqrt(a + b);
    let (a, b) = (a / (a + b), b / (a + b));
    let degrees = 1.0 / (a * a / (m - 1.0) + b * b / (n - 1.0));
    // It says "equivalent" if the difference is within what the estimated error times this leaves of the tolerance.
    let t = student_quantile(1.0 - alpha, degrees);
    let bound = tolerance / error;
    let spread = 10.0 / libm::sqrt(2.0 * degrees);
    let (low, high) = ((1.0 - spread).max(0.0), (bound / t).min(1.0 + spread));
    if high <= low {
        return 0.0;
    }
    // Over the fourth root: with few degrees of freedom the density begins like a root, which no rule takes as it is.
    let (low, high) = (libm::sqrt(libm::sqrt(low)), libm::sqrt(libm::sqrt(high)));
    let within = |root: f64| {
        let x = root * root * root * root;
        let density = 4.0 * root * root * root * deviation_density(x, degrees);
        (1.0 - 2.0 * normal_cdf(x * t - bound)).max(0.0) * density
    };
    let step = (high - low) / PANELS as f64;
    // Simpson's rule.
    let sum: f64 = (0..PANELS)
        .map(|at| {
            let root = low + step * at as f64;
            within(root) + 4.0 * within(root + step / 2.0) + within(root + step)
        })
        .sum();
    (sum * step / 6.0).clamp(0.0, 1.0)
}

const PANELS: usize = 400;

/// The least number of runs of the lab with which the test has this power, with as many runs of the simulation, or with
/// a fixed number of these; `None` if even ten thousand are too few, as with a tolerance of 0.
pub fn lab_runs_for(power: f64, design: Design, simulation_runs: Option<usize>) -> Option<usize> {
    let enough = |runs: usize| tost_power(design, simulation_runs.unwrap_or(runs), runs) >= power;
    let mut high = 2;
    while !enough(high) {
        high *= 2;
        if high > MOST {
            return None;
        }
    }
    // Power grows with the runs of both sides, so halving finds where it becomes enough.
    let mut low = high / 2;
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if enough(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use sesame_rng::Stream;

    use super::*;
    use crate::samples::{Samples, Welch};

    #[test]
    fn power_is_how_often_simulated_tests_say_equivalent() {
        let cases = [(1.0, 1.0, 1.5, 10, 10), (0.5, 2.0, 1.5, 30, 12), (0.0, 1.0, 1.0, 2, 6), (1.0, 3.0, 2.0, 5, 25)];
        for (simulation_deviation, lab_deviation, tolerance, m, n) in cases {
            let design = Design { simulation_deviation, lab_deviation, tolerance, alpha: 0.05 };
            let power = tost_power(design, m, n);
            let runs = 4000;
            let mut said = 0;
            for seed in 0..runs {
                let mut stream = Stream::derive(seed, "power", &[]);
                let simulation: Vec<f64> = (0..m).map(|_| simulation_deviation * stream.normal()).collect();
                let lab: Vec<f64> = (0..n).map(|_| lab_deviation * stream.normal()).collect();
                let welch = Welch::of(Samples::new(&simulation, &lab)).unwrap();
                said += u32::from(welch.p_above(-tolerance) < 0.05 && welch.p_below(tolerance) < 0.05);
            }
            let share = f64::from(said) / runs as f64;
            assert!(
                (power - share).abs() < 0.035,
                "{design:?} with {m} and {n}: {power}, and {share} of simulated tests"
            );
        }
    }

    #[test]
    fn the_number_of_runs_is_the_least_with_the_power() {
        let design = Design { simulation_deviation: 1.0, lab_deviation: 1.0, tolerance: 1.0, alpha: 0.05 };
        let runs = lab_runs_for(TARGET, design, None).unwrap();
        assert!(tost_power(design, runs, runs) >= 0.8 && tost_power(design, runs - 1, runs - 1) < 0.8);
        let with_many = lab_runs_for(TARGET, design, Some(1000)).unwrap();
        assert!(with_many < runs, "runs of the simulation save some of the lab");
        assert_eq!(lab_runs_for(TARGET, Design { tolerance: 0.0, ..design }, None), None);
        assert_eq!(lab_runs_for(TARGET, design, Some(3)), None, "few runs of the simulation cannot be made good");
        assert_eq!(tost_power(Design { tolerance: 0.0, ..design }, 10, 10), 0.0);
    }
}
