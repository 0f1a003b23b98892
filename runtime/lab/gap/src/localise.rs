//! Whether a gap is the same everywhere, or is where some tests are and others are not.

use crate::pooled::{Heterogeneity, Pooled};
use crate::samples::Welch;
use crate::split::{Located, Split, best_split};

/// What is asked of the tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The greatest difference that counts as none, in the metric's unit, from 0 on.
    pub tolerance: f64,
    /// The probability of an error, in `0..0.5`.
    pub alpha: f64,
    /// Permutations for the p value of a split; 999 resolve a thousandth.
    pub permutations: u32,
    /// Seed of these.
    pub seed: u64,
}

/// How far a gap extends.
#[derive(Debug, Clone, PartialEq)]
pub enum Extent {
    /// Every test agrees within the tolerance by itself (two one-sided tests each; all have to agree, so no correction
    /// for their number is due).
    None,
    /// The differences can all be one, which is not 0 and exceeds the tolerance as far as the tests show.
    Systematic {
        /// Their common value.
        pooled: Pooled,
        /// How much they differ; `p` is above α.
        heterogeneity: Heterogeneity,
    },
    /// The differences in one range of a coordinate are unlike the others.
    Range {
        /// The range. It is the side of a threshold with the greater difference.
        split: Split,
        /// The common value inside it.
        inside: Pooled,
        /// The common value outside it.
        outside: Pooled,
    },
    /// A few tests differ from the others, which agree with each other. No range explains it.
    Tests {
        /// Their positions, ascending.
        tests: Vec<usize>,
        /// The common value of the others.
        others: Pooled,
    },
    /// The differences vary from test to test, without a range or a few tests that would explain it.
    Scattered(Heterogeneity),
    /// Nothing can be said, for this reason.
    Undecided(Reason),
}

/// Why the extent of a gap stays open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason {
    /// There are no differences to compare.
    NoTests,
    /// One test that does not agree says nothing about other places.
    OneTest,
    /// The differences can all be one, and this one may be 0 or within the tolerance; not every test agrees by itself.
    NotShown(Pooled),
}

/// Whether there is a gap and where.
///
/// The order of questions: whether all tests agree within the tolerance; whether the differences are of one size
/// (Welch's F at α, or none further from the middle of all than the tolerance); if so, whether this size is a gap; if
/// not, whether a range of one coordinate explains it (by permutation, at α), or else few tests do, which are left out
/// one after the other, the most deviating first, until the others agree: at most a third. So where all true
/// differences are equal, a local gap is reported with a probability of about α at most, and where they are all 0, a
/// systematic one.
pub fn localise(tests: &[Located], settings: Settings) -> Extent {
    let Settings { tolerance, alpha, permutations, seed } = settings;
    assert!(tolerance >= 0.0 && alpha > 0.0 && alpha < 0.5, "a tolerance is a size, an error is less likely than not");
    let Some(pooled) = Pooled::of(differences(tests)) else { return Extent::Undecided(Reason::NoTests) };
    let agrees = |of: &Welch| of.p_above(-tolerance).max(of.p_below(tolerance)) <= alpha;
    if tolerance > 0.0 && differences(tests).all(agrees) {
        return Extent::None;
    }
    let Some(heterogeneity) = Heterogeneity::of(differences(tests)) else {
        return Extent::Undecided(Reason::OneTest);
    };
    let estimates = differences(tests).map(|of| of.difference);
    let [least, greatest] =
        estimates.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    // However sure it is that differences are not quite equal: what does not matter is not looked for.
    if heterogeneity.p > alpha || greatest - least <= 2.0 * tolerance {
        return if pooled.p() <= alpha && pooled.estimate.abs() > tolerance {
            Extent::Systematic { pooled, heterogeneity }
        } else {
            Extent::Undecided(Reason::NotShown(pooled))
        };
    }
    if let Some(range) = by_range(tests, alpha, permutations, seed) {
        return range;
    }
    few_tests(tests, alpha).unwrap_or(Extent::Scattered(heterogeneity))
}

fn differences(tests: &[Located]) -> impl Iterator<Item = &Welch> {
    tests.iter().map(|test| &test.difference)
}

fn by_range(tests: &[Located], alpha: f64, permutations: u32, seed: u64) -> Option<Extent> {
    let mut split = best_split(tests, permutations, seed).filter(|split| split.p <= alpha)?;
    let part = |of: bool| {
        let tests = tests.iter().filter(|test| split.range.contains(&test.at) == of);
        Pooled::of(tests.map(|test| &test.difference)).expect("a split has tests on both sides")
    };
    let (mut inside, mut outside) = (part(true), part(false));
    let known = tests.iter().all(|test| test.at[split.range.dimension].is_some());
    // A threshold has two sides that are ranges, unless some tests are on neither.
    let threshold = split.range.low.is_none() || split.range.high.is_none();
    if threshold && known && inside.estimate.abs() < outside.estimate.abs() {
        std::mem::swap(&mut inside, &mut outside);
        std::mem::swap(&mut split.range.low, &mut split.range.high);
    }
    Some(Extent::Range { split, inside, outside })
}

/// The few tests without which the others agree with each other.
fn few_tests(tests: &[Located], alpha: f64) -> Option<Extent> {
    let mut rest: Vec<usize> = (0..tests.len()).collect();
    let mut left_out = Vec::new();
    while left_out.len() < tests.len() / 3 {
        // Each test is left out in turn; the others should agree as well as possible.
        let without = |at: usize| rest.iter().filter(move |&&other| other != at).map(|&other| &tests[other].difference);
        let q = |at: usize| Some(Heterogeneity::of(without(at))?.q);
        let (worst, _) = rest.iter().filter_map(|&at| Some((at, q(at)?))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        let agree = Heterogeneity::of(without(worst))?.p > alpha;
        rest.retain(|&at| at != worst);
        left_out.push(worst);
        if agree {
            left_out.sort_unstable();
            let others = Pooled::of(rest.iter().map(|&at| &tests[at].difference))?;
            return Some(Extent::Tests { tests: left_out, others });
        }
    }
    None
}

/// How a sentence names things.
pub struct Words<'a> {
    /// The metric.
    pub metric: &'a str,
    /// What the metric is in the lab where a difference is below 0, and where it is above, for example `smaller` and
    /// `greater`.
    pub than: [&'a str; 2],
    /// A value of the metric with its unit.
    pub value: &'a dyn Fn(f64) -> String,
    /// The name of a coordinate.
    pub dimension: &'a dyn Fn(usize) -> String,
    /// A value of this coordinate.
    pub coordinate: &'a dyn Fn(usize, f64) -> String,
    /// The name of the test at a position.
    pub test: &'a dyn Fn(usize) -> String,
}

/// An extent as one plain sentence; `count` is how many tests there were.
pub fn sentence(extent: &Extent, count: usize, words: &Words<'_>) -> String {
    let metric = words.metric;
    let about = |of: &Pooled| {
        let [low, high] = of.interval(0.95);
        let size = (words.value)(of.estimate.abs());
        let [smaller, greater] = words.than;
        let than = if of.estimate < 0.0 { smaller } else { greater };
        format!(
            "{size} {than} in the lab (95 % interval of the difference: {} to {})",
            (words.value)(low),
            (words.value)(high)
        )
    };
    let tests = |count: usize| if count == 1 { "1 test".to_owned() } else { format!("{count} tests") };
    match extent {
        Extent::None => {
            format!(
                "There is no gap: {metric} agrees within the tolerance in {}.",
                if count == 1 { "the only test".to_owned() } else { format!("all {count} tests") }
            )
        }
        Extent::Systematic { pooled, .. } => {
            format!("The gap is systematic: over {}, {metric} is {}.", tests(count), about(pooled))
        }
        Extent::Range { split, inside, outside } => {
            let dimension = split.range.dimension;
            let name = (words.dimension)(dimension);
            let end = |end: f64| (words.coordinate)(dimension, end);
            let place = match (split.range.low, split.range.high) {
                (Some(low), Some(high)) => format!("{name} between {} and {}", end(low), end(high)),
                (Some(low), None) => format!("{name} above {}", end(low)),
                (None, Some(high)) => format!("{name} below {}", end(high)),
                (None, None) => name,
            };
            format!(
                "The gap is local: in the {} with {place}, {metric} is {}; in the other {}, it is {}.",
                tests(inside.count),
                about(inside),
                outside.count,
                about(outside)
            )
        }
        Extent::Tests { tests: few, others } => {
            let names: Vec<String> = few.iter().map(|&at| (words.test)(at)).collect();
            format!(
                "The gap of {} is unlike the others: in the other {}, {metric} is {}.",
                names.join(", "),
                tests(others.count),
                about(others)
            )
        }
        Extent::Scattered(heterogeneity) => format!(
            "The gap of {metric} varies from test to test ({:.0} % of the variation is more than chance), and no range of a coordinate explains it.",
            100.0 * heterogeneity.i_squared
        ),
        Extent::Undecided(Reason::NoTests) => format!("No test has enough runs to compare {metric}."),
        Extent::Undecided(Reason::OneTest) => {
            format!("Only one test compares {metric}, and it does not agree: where else there is a gap is unknown.")
        }
        Extent::Undecided(Reason::NotShown(pooled)) => {
            format!("Whether there is a gap is undecided: over {}, {metric} is {}.", tests(count), about(pooled))
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_rng::Stream;

    use super::*;
    use crate::pooled::tests::measured;

    const SETTINGS: Settings = Settings { tolerance: 0.8, alpha: 0.05, permutations: 199, seed: 1 };

    fn located(seed: u64, runs: usize, truth: impl Fn(usize, &[f64]) -> f64) -> Vec<Located> {
        let mut stream = Stream::derive(seed, "places", &[]);
        let places: Vec<Vec<f64>> = (0..12).map(|_| (0..2).map(|_| stream.unit()).collect()).collect();
        let truths: Vec<f64> = places.iter().enumerate().map(|(test, at)| truth(test, at)).collect();
        let of = |(at, difference): (Vec<f64>, Welch)| Located { at: at.into_iter().map(Some).collect(), difference };
        places.into_iter().zip(measured(seed, runs, &truths)).map(of).collect()
    }

    /// In how many of a hundred made-up campaigns the extent is of a kind.
    fn hundred(runs: usize, truth: impl Fn(usize, &[f64]) -> f64, is: fn(&Extent) -> bool) -> usize {
        (0..100).filter(|&seed| is(&localise(&located(seed, runs, &truth), Settings { seed, ..SETTINGS }))).count()
    }

    #[test]
    fn each_extent_is_recognised() {
        let none = hundred(80, |_, _| 0.0, |extent| *extent == Extent::None);
        let everywhere = hundred(8, |_, _| 2.0, |extent| matches!(extent, Extent::Systematic { .. }));
        let range = |_: usize, at: &[f64]| if at[0] < 0.45 { 3.0 } else { 0.0 };
        let in_range = hundred(8, range, |extent| match extent {
            Extent::Range { split, inside, outside } => {
                split.range.dimension == 0 && inside.estimate > 2.0 && outside.estimate < 1.0
            }
            _ => false,
        });
        let one = hundred(
            8,
            |test, _| if test == 5 { 6.0 } else { 0.0 },
            |extent| matches!(extent, Extent::Tests { tests, .. } if *tests == [5]),
        );
        let scatter =
            hundred(8, |test, _| [0.0, 4.0, -4.0, 8.0][test % 4], |extent| matches!(extent, Extent::Scattered(_)));
        let counts = [none, everywhere, in_range, one, scatter];
        assert!(counts.iter().all(|&count| count >= 80), "{counts:?}");
    }

    #[test]
    fn wrong_extents_are_as_rare_as_alpha_says() {
        let local =
            |extent: &Extent| matches!(extent, Extent::Range { .. } | Extent::Tests { .. } | Extent::Scattered(_));
        for truth in [0.0, 2.0] {
            let wrong = hundred(5, |_, _| truth, local);
            assert!(wrong <= 12, "{wrong} of 100 with equal differences of {truth}");
        }
        let wrong = hundred(5, |_, _| 0.0, |extent| matches!(extent, Extent::Systematic { .. }));
        assert!(wrong <= 12, "{wrong} of 100 without a gap");
        // In one test of twelve there is a gap of the tolerance.
        let wrong = hundred(60, |test, _| if test == 0 { 0.8 } else { 0.0 }, |extent| *extent == Extent::None);
        assert!(wrong <= 12, "{wrong} of 100 say that there is no gap");
    }

    #[test]
    fn few_tests_leave_the_extent_open() {
        let tests = located(1, 8, |_, _| 3.0);
        assert_eq!(localise(&[], SETTINGS), Extent::Undecided(Reason::NoTests));
        assert_eq!(localise(&tests[..1], SETTINGS), Extent::Undecided(Reason::OneTest));
        let two = located(1, 20, |_, _| 3.0);
        assert!(matches!(localise(&two[..2], SETTINGS), Extent::Systematic { .. }));
        let still = located(1, 3, |_, _| 0.0);
        assert!(matches!(localise(&still, SETTINGS), Extent::Undecided(Reason::NotShown(_))));
    }

    #[test]
    fn swapped_sides_give_the_same_extent_with_the_other_sign() {
        for seed in 0..20 {
            let tests = located(seed, 8, |_, at| if at[1] > 0.5 { 3.0 } else { 0.0 });
            let mut swapped = tests.clone();
            for test in &mut swapped {
                test.difference.difference = -test.difference.difference;
            }
            match (localise(&tests, SETTINGS), localise(&swapped, SETTINGS)) {
                (Extent::Range { split, inside, .. }, Extent::Range { split: other, inside: turned, .. }) => {
                    assert_eq!(split.range, other.range);
                    assert!((inside.estimate + turned.estimate).abs() < 1e-12);
                }
                (one, other) => assert_eq!(std::mem::discriminant(&one), std::mem::discriminant(&other)),
            }
        }
    }

    #[test]
    fn an_extent_is_told_in_a_sentence() {
        let words = Words {
            metric: "distance",
            than: ["smaller", "greater"],
            value: &|value| format!("{value:.1} m"),
            dimension: &|dimension| format!("T{}", dimension + 1),
            coordinate: &|_, at| format!("{at:.1}"),
            test: &|at| format!("T{at}"),
        };
        let said =
            |runs, truth: fn(usize, &[f64]) -> f64| sentence(&localise(&located(3, runs, truth), SETTINGS), 12, &words);
        assert_eq!(said(80, |_, _| 0.0), "There is no gap: distance agrees within the tolerance in all 12 tests.");
        let systematic = said(8, |_, _| -2.0);
        assert!(systematic.starts_with("The gap is systematic: over 12 tests, distance is "), "{systematic}");
        assert!(systematic.contains("m smaller in the lab (95 % interval of the difference: -"), "{systematic}");
        let local = said(8, |_, at| if at[0] < 0.45 { 4.0 } else { 0.0 });
        assert!(local.starts_with("The gap is local: in the ") && local.contains(" with T1 below 0.5"), "{local}");
        let few = said(8, |test, _| if test == 5 { 9.0 } else { 0.0 });
        assert!(few.starts_with("The gap of T5 is unlike the others: in the other 11 tests,"), "{few}");
        let open = said(3, |_, _| 0.0);
        assert!(open.starts_with("Whether there is a gap is undecided: over 12 tests, distance is "), "{open}");
    }
}
