//! Whether a simulation and a lab agree within a tolerance: two one-sided tests [Schuirmann 1987], with Welch's
//! standard error.

use crate::power::{Design, TARGET, lab_runs_for, tost_power};
use crate::samples::{Moments, Samples, Undefined, Welch, moments};

/// What a comparison says about one metric of one test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Verdict {
    /// The means differ by less than the tolerance: both one-sided tests reject.
    Equivalent,
    /// The means differ, and by more than the tolerance as far as the samples show: the ordinary test rejects, and the
    /// difference of the samples exceeds the tolerance.
    Different,
    /// Neither, for this reason.
    Undecided(Reason),
}

/// Why a comparison decides nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// The tests have no value. With [`Undefined::NoSpread`], all values of a side are equal, and a test by permutation
    /// does not reject either.
    Undefined(Undefined),
    /// No difference is tolerated, so equivalence cannot be shown; and the samples do not show that the means differ.
    NoTolerance,
    /// The samples would not show equivalence even if the means were equal, with a probability of at least 0.8: there
    /// are too few runs for their spread.
    NoPower,
    /// The samples had a chance to show equivalence and did not; nor do they show a difference above the tolerance.
    NotShown,
}

/// The numbers behind a verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tests {
    /// The difference, its standard error and degrees of freedom.
    pub welch: Welch,
    /// The p value of the one-sided test against a difference of minus the tolerance or less.
    pub p_above: f64,
    /// The p value of the one-sided test against a difference of the tolerance or more.
    pub p_below: f64,
    /// The p value of the ordinary, two-sided test against no difference.
    pub p_different: f64,
    /// The p value of the test against a difference of at most the tolerance in either direction: where it is small,
    /// the true difference exceeds the tolerance, which is more than [`Verdict::Different`] says.
    pub p_beyond: f64,
    /// The interval of the difference at 1 − 2α: the means are equivalent if it is within the tolerance.
    pub interval: [f64; 2],
    /// The probability that these numbers of runs show the equivalence of means that are equal, in `0..=1`.
    pub power: f64,
}

impl Tests {
    /// The p value of equivalence: the greater of both one-sided ones.
    pub fn p_equivalent(&self) -> f64 {
        self.p_above.max(self.p_below)
    }
}

/// A comparison: its numbers, where they exist, and its verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equivalence {
    /// The numbers.
    pub tests: Result<Tests, Undefined>,
    /// The verdict of this comparison alone; with others, see [`verdict`].
    pub verdict: Verdict,
}

/// Compares the means of two samples with a tolerance in the metric's unit, from 0 on. A wrong "equivalent", and a
/// "different" of equal means, have at most about the probability `alpha`, in `0..0.5`.
///
/// "Different" says that the means differ and that the best estimate of their difference exceeds the tolerance. If the
/// true difference is just the tolerance, that is as likely as not; [`Tests::p_beyond`] is the stricter question.
pub fn compare(samples: Samples<'_>, tolerance: f64, alpha: f64) -> Equivalence {
    assert!(tolerance >= 0.0 && tolerance.is_finite(), "a tolerance is a size");
    assert!(alpha > 0.0 && alpha < 0.5, "the probability of an error is below one half");
    let tests = moments(samples).and_then(|[simulation, lab]| tests(simulation, lab, tolerance, alpha));
    let verdict = match &tests {
        Ok(tests) => verdict(tests, tests.p_equivalent(), tests.p_different, tolerance, alpha),
        Err(Undefined::NoSpread) => without_spread(samples, tolerance, alpha),
        Err(why) => Verdict::Undecided(Reason::Undefined(*why)),
    };
    Equivalence { tests, verdict }
}

fn tests(simulation: Moments, lab: Moments, tolerance: f64, alpha: f64) -> Result<Tests, Undefined> {
    let welch = Welch::from_moments(simulation, lab)?;
    let deviation = |of: Moments| of.deviation.expect("Welch's test needs both");
    let (simulation_deviation, lab_deviation) = (deviation(simulation), deviation(lab));
    let design = Design { simulation_deviation, lab_deviation, tolerance, alpha };
    Ok(Tests {
        welch,
        p_above: welch.p_above(-tolerance),
        p_below: welch.p_below(tolerance),
        p_different: welch.p(),
        p_beyond: (2.0 * welch.p_above(tolerance).min(welch.p_below(-tolerance))).min(1.0),
        interval: welch.interval(1.0 - 2.0 * alpha),
        power: tost_power(design, simulation.count, lab.count),
    })
}

/// How many runs of the lab would show the equivalence of equal means with the power 0.8, with as many runs of the
/// simulation, if the spread is that of these samples; `None` if more than ten thousand would be needed. Runs of a
/// simulation without spread need not be repeated.
pub fn lab_runs_needed(samples: Samples<'_>, tolerance: f64, alpha: f64) -> Result<Option<usize>, Undefined> {
    let [simulation, lab] = moments(samples)?;
    // Where one run or equal values tell no spread, this says so.
    Welch::from_moments(simulation, lab)?;
    let deviation = |of: Moments| of.deviation.expect("Welch's test needs both");
    let (simulation_deviation, lab_deviation) = (deviation(simulation), deviation(lab));
    let fixed = (simulation_deviation == 0.0).then_some(simulation.count);
    Ok(lab_runs_for(TARGET, Design { simulation_deviation, lab_deviation, tolerance, alpha }, fixed))
}

/// The verdict of p values that were adjusted for other comparisons, such as by [`holm`](crate::holm): those of
/// equivalence ([`Tests::p_equivalent`]) as one family, those of the ordinary test as another.
pub fn verdict(tests: &Tests, p_equivalent: f64, p_different: f64, tolerance: f64, alpha: f64) -> Verdict {
    if tolerance > 0.0 && p_equivalent <= alpha {
        Verdict::Equivalent
    } else if p_different <= alpha && tests.welch.difference.abs() > tolerance {
        Verdict::Different
    } else if tolerance == 0.0 {
        Verdict::Undecided(Reason::NoTolerance)
    } else if tests.power < TARGET {
        Verdict::Undecided(Reason::NoPower)
    } else {
        Verdict::Undecided(Reason::NotShown)
    }
}

/// For samples without spread on either side: the share of all divisions of the runs into two sides that separate the
/// values as the observed one does (a permutation test).
fn without_spread(samples: Samples<'_>, tolerance: f64, alpha: f64) -> Verdict {
    let (m, n) = (samples.simulation().len() as f64, samples.lab().len() as f64);
    let log = |n: f64| libm::lgamma(n + 1.0);
    let divisions = libm::exp(log(m + n) - log(m) - log(n));
    let p = if m == n { 2.0 / divisions } else { 1.0 / divisions };
    let difference = samples.lab()[0] - samples.simulation()[0];
    if difference.abs() > tolerance && difference != 0.0 && p <= alpha {
        Verdict::Different
    } else {
        Verdict::Undecided(Reason::Undefined(Undefined::NoSpread))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_rng::Stream;

    use super::*;
    use crate::samples::Side;

    fn sample(seed: u64, side: u64, count: usize, mean: f64, deviation: f64) -> Vec<f64> {
        let mut stream = Stream::derive(seed, "equivalence", &[side]);
        (0..count).map(|_| mean + deviation * stream.normal()).collect()
    }

    /// How many of a thousand comparisons give a verdict of this kind.
    fn thousand(m: usize, n: usize, means: [f64; 2], deviations: [f64; 2], is: fn(&Verdict) -> bool) -> usize {
        (0..1000)
            .filter(|&seed| {
                let simulation = sample(seed, 0, m, means[0], deviations[0]);
                let lab = sample(seed, 1, n, means[1], deviations[1]);
                is(&compare(Samples::new(&simulation, &lab), 1.0, 0.05).verdict)
            })
            .count()
    }

    #[test]
    fn wrong_verdicts_are_as_rare_as_alpha_says() {
        let equivalent = |verdict: &Verdict| *verdict == Verdict::Equivalent;
        let different = |verdict: &Verdict| *verdict == Verdict::Different;
        // 50 of a thousand, plus three standard deviations: 71.
        for (m, n, deviations) in [(5, 5, [1.0, 1.0]), (30, 4, [0.3, 1.0]), (12, 20, [1.0, 0.2])] {
            for truth in [1.0, -1.0, 1.3] {
                let wrong = thousand(m, n, [0.0, truth], deviations, equivalent);
                assert!(wrong <= 71, "{wrong} of 1000 say equivalent of {m} and {n} at {truth}");
            }
            let wrong = thousand(m, n, [3.0, 3.0], deviations, different);
            assert!(wrong <= 71, "{wrong} of 1000 say different of {m} and {n}");
        }
        assert!(thousand(20, 20, [0.0, 0.0], [0.5, 0.5], equivalent) > 950);
        assert!(thousand(20, 20, [0.0, 2.0], [0.5, 0.5], different) > 950);
    }

    #[test]
    fn an_undecided_comparison_says_why() {
        let reason = |a: &[f64], b: &[f64], tolerance| match compare(Samples::new(a, b), tolerance, 0.05).verdict {
            Verdict::Undecided(reason) => reason,
            verdict => panic!("{verdict:?}"),
        };
        assert_eq!(reason(&[1.0, 2.0], &[1.5], 1.0), Reason::Undefined(Undefined::OneRun(Side::Lab)));
        assert_eq!(reason(&[], &[1.5], 1.0), Reason::Undefined(Undefined::NoRuns(Side::Simulation)));
        assert_eq!(reason(&[1.0, 2.0, 3.0], &[1.1, 2.1, 3.1], 0.0), Reason::NoTolerance);
        assert_eq!(reason(&[1.0, 3.0], &[1.1, 3.1], 1.0), Reason::NoPower);
        let (a, b) = (sample(1, 0, 40, 0.0, 1.0), sample(1, 1, 40, 0.6, 1.0));
        assert_eq!(reason(&a, &b, 1.0), Reason::NotShown);
        assert_eq!(reason(&[2.0; 5], &[2.0; 5], 1.0), Reason::Undefined(Undefined::NoSpread));
    }

    #[test]
    fn values_without_spread_differ_if_permutations_say_so() {
        let verdict = |m: usize, n: usize| compare(Samples::new(&vec![0.0; m], &vec![5.0; n]), 1.0, 0.05).verdict;
        // 2 of 20 divisions, 2 of 70.
        assert_eq!(verdict(3, 3), Verdict::Undecided(Reason::Undefined(Undefined::NoSpread)));
        assert_eq!(verdict(4, 4), Verdict::Different);
    }

    #[test]
    fn without_tolerance_a_difference_can_still_be_shown() {
        let (a, b) = (sample(1, 0, 20, 0.0, 1.0), sample(1, 1, 20, 5.0, 1.0));
        assert_eq!(compare(Samples::new(&a, &b), 0.0, 0.05).verdict, Verdict::Different);
    }

    #[test]
    fn power_is_told_with_the_runs_that_would_give_it() {
        let samples = Samples::new(&[1.0, 3.0, 2.0], &[1.1, 3.1, 2.2]);
        let tests = compare(samples, 1.0, 0.05).tests.unwrap();
        assert!(tests.power < 0.3, "{tests:?}");
        let needed = lab_runs_needed(samples, 1.0, 0.05).unwrap().unwrap();
        assert!((15..25).contains(&needed), "{needed}");
        let exact = Samples::new(&[2.0, 2.0], &[1.1, 3.1, 2.2]);
        assert!(lab_runs_needed(exact, 1.0, 0.05).unwrap().unwrap() < needed);
        assert_eq!(lab_runs_needed(samples, 0.0, 0.05), Ok(None));
        assert_eq!(lab_runs_needed(Samples::new(&[1.0, 2.0], &[1.5]), 1.0, 0.05), Err(Undefined::OneRun(Side::Lab)));
    }

    proptest! {
        #[test]
        fn equal_samples_are_never_different_and_the_interval_agrees_with_the_verdict(
            a in prop::collection::vec(-10.0..10.0f64, 2..10), b in prop::collection::vec(-10.0..10.0f64, 2..10),
            tolerance in 0.0..10.0f64,
        ) {
            prop_assert!(compare(Samples::new(&a, &a), tolerance, 0.05).verdict != Verdict::Different);
            let Equivalence { tests, verdict } = compare(Samples::new(&a, &b), tolerance, 0.05);
            let swapped = compare(Samples::new(&b, &a), tolerance, 0.05);
            prop_assert_eq!(verdict, swapped.verdict);
            if let Ok(tests) = tests {
                let [low, high] = tests.interval;
                let within = -tolerance < low && high < tolerance;
                prop_assert_eq!(within, tests.p_equivalent() < 0.05);
                prop_assert!(tests.p_above.is_finite() && tests.p_below.is_finite() && tests.p_beyond.is_finite());
            }
        }
    }
}
