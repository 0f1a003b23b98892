//! Where differences change: the range of one coordinate in which they are unlike the others.

use sesame_rng::Stream;

use crate::samples::Welch;

/// The difference that one test shows, and where the test is.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// Its coordinates, finite, such as those of its SSPR point; `None` for one that it does not have. All tests have
    /// as many.
    pub at: Vec<Option<f64>>,
    /// The difference with its uncertainty.
    pub difference: Welch,
}

/// A range of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Which coordinate, from 0 on.
    pub dimension: usize,
    /// Its lower end, halfway between the tests on both sides; `None` if it is open. One end at least is not.
    pub low: Option<f64>,
    /// Its upper end.
    pub high: Option<f64>,
}

impl Range {
    /// Whether a test is inside. One without the coordinate is not.
    pub fn contains(self, at: &[Option<f64>]) -> bool {
        at[self.dimension].is_some_and(|x| self.low.is_none_or(|low| x > low) && self.high.is_none_or(|high| x < high))
    }
}

/// The range that divides tests best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// The range.
    pub range: Range,
    /// The squared difference of the pooled values inside and outside, in standard errors (Q between groups).
    pub q: f64,
    /// How often ranges divide tests as well if differences are dealt out to tests at random: a p value that allows for
    /// the choice of dimension and ends.
    pub p: f64,
}

/// Fewer tests on a side are not part of the space, but single tests.
const LEAST: usize = 2;

/// The best of all ranges with two tests or more inside and outside; `None` if there is none.
///
/// Ranges are compared by Q between groups, less the logarithm of the number of tests for each end that is not open: so
/// a threshold is preferred unless a second end explains more than chance would (the Bayesian information criterion).
/// The p value comes from `permutations` permutations drawn from the seed.
pub fn best_split(tests: &[Located], permutations: u32, seed: u64) -> Option<Split> {
    let dimensions = tests.first()?.at.len();
    assert!(tests.iter().all(|test| test.at.len() == dimensions), "all tests have as many coordinates");
    let orders: Vec<Order> = (0..dimensions).map(|dimension| Order::of(tests, dimension)).collect();
    let weigh = |test: &Located| {
        let weight = 1.0 / (test.difference.standard_error * test.difference.standard_error);
        (weight, weight * test.difference.difference)
    };
    let weighed: Vec<(f64, f64)> = tests.iter().map(weigh).collect();
    let best = best_of(&orders, &weighed)?;
    let mut stream = Stream::derive(seed, "split", &[]);
    let as_good = (0..permutations).filter(|_| {
        let dealt: Vec<(f64, f64)> = stream.permutation(tests.len()).into_iter().map(|at| weighed[at]).collect();
        best_of(&orders, &dealt).is_some_and(|other| other.score >= best.score * (1.0 - 1e-12))
    });
    let as_good = as_good.count() as f64;
    let p = (1.0 + as_good) / (1.0 + f64::from(permutations));
    let order = &orders[best.dimension];
    let end =
        |at: usize| (0 < at && at < order.tests.len()).then(|| f64::midpoint(order.values[at - 1], order.values[at]));
    let range = Range { dimension: best.dimension, low: end(best.from), high: end(best.to) };
    Some(Split { range, q: best.q, p })
}

/// Tests by one coordinate.
struct Order {
    /// Those that have it, ascending.
    tests: Vec<usize>,
    values: Vec<f64>,
}

impl Order {
    fn of(tests: &[Located], dimension: usize) -> Order {
        let known = tests.iter().enumerate().filter_map(|(at, test)| Some((at, test.at[dimension]?)));
        let mut known: Vec<(usize, f64)> = known.collect();
        known.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (tests, values) = known.into_iter().unzip();
        Order { tests, values }
    }

    /// Whether equal coordinates are on both sides of a place.
    fn ties(&self, place: usize) -> bool {
        0 < place && place < self.values.len() && self.values[place - 1] == self.values[place]
    }
}

/// The tests `from..to` of the order by one dimension.
#[derive(Clone, Copy)]
struct Best {
    dimension: usize,
    from: usize,
    to: usize,
    q: f64,
    score: f64,
}

fn best_of(orders: &[Order], weighed: &[(f64, f64)]) -> Option<Best> {
    let all = weighed.iter().fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    let penalty = libm::log(weighed.len() as f64);
    let mut best: Option<Best> = None;
    for (dimension, order) in orders.iter().enumerate() {
        let known = order.tests.len();
        for from in (0..known).filter(|&from| !order.ties(from)) {
            let mut inside = (0.0, 0.0);
            for to in from + 1..=known {
                let (weight, product) = weighed[order.tests[to - 1]];
                inside = (inside.0 + weight, inside.1 + product);
                let ends = u8::from(from > 0) + u8::from(to < known);
                let (count, rest) = (to - from, weighed.len() - (to - from));
                if ends == 0 || count < LEAST || rest < LEAST || order.ties(to) {
                    continue;
                }
                let outside = (all.0 - inside.0, all.1 - inside.1);
                let difference = inside.1 / inside.0 - outside.1 / outside.0;
                let q = difference * difference / (1.0 / inside.0 + 1.0 / outside.0);
                let score = q - penalty * f64::from(ends);
                if best.is_none_or(|best| score > best.score) {
                    best = Some(Best { dimension, from, to, q, score });
                }
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pooled::tests::measured;

    fn located(seed: u64, truth: impl Fn(&[f64]) -> f64) -> Vec<Located> {
        let mut stream = Stream::derive(seed, "places", &[]);
        let places: Vec<Vec<f64>> = (0..16).map(|_| (0..3).map(|_| stream.unit()).collect()).collect();
        let truths: Vec<f64> = places.iter().map(|at| truth(at)).collect();
        let of = |(at, difference): (Vec<f64>, Welch)| Located { at: at.into_iter().map(Some).collect(), difference };
        places.into_iter().zip(measured(seed, 6, &truths)).map(of).collect()
    }

    #[test]
    fn a_threshold_and_a_range_are_found_where_they_are() {
        let (mut thresholds, mut ranges) = (0, 0);
        for seed in 0..40 {
            let split = best_split(&located(seed, |at| if at[1] > 0.6 { 3.0 } else { 0.0 }), 199, seed).unwrap();
            let range = split.range;
            let found = range.dimension == 1 && (range.low.is_some() != range.high.is_some()) && split.p <= 0.05;
            let end = range.low.or(range.high).unwrap();
            thresholds += u32::from(found && (end - 0.6).abs() < 0.15);
            let middle = |at: &[f64]| if (0.3..0.7).contains(&at[2]) { 3.0 } else { 0.0 };
            let range = best_split(&located(seed, middle), 199, seed).unwrap().range;
            ranges += u32::from(range.dimension == 2);
        }
        assert!(thresholds >= 34 && ranges >= 34, "{thresholds} {ranges}");
    }

    #[test]
    fn where_differences_are_equal_or_vary_without_a_place_splits_are_rare() {
        let scattered = |seed: u64| {
            let mut stream = Stream::derive(seed, "scatter", &[]);
            let truths: Vec<f64> = (0..16).map(|_| 3.0 * stream.normal()).collect();
            let mut tests = located(seed, |_| 0.0);
            for (test, of) in tests.iter_mut().zip(measured(seed, 6, &truths)) {
                test.difference = of;
            }
            tests
        };
        let split = |tests: &[Located], seed| best_split(tests, 99, seed).unwrap().p <= 0.05;
        let equal = (0..200).filter(|&seed| split(&located(seed, |_| 1.0), seed)).count();
        let varying = (0..200).filter(|&seed| split(&scattered(seed), seed)).count();
        // 10 of 200, plus three standard deviations.
        assert!(equal <= 19 && varying <= 19, "{equal} {varying}");
    }

    #[test]
    fn equal_coordinates_are_never_divided_and_missing_ones_are_outside() {
        let difference = |difference| Welch { difference, standard_error: 0.1, degrees: 9.0 };
        let tests: Vec<Located> = [(Some(0.0), 0.0), (Some(0.0), 5.0), (Some(1.0), 5.0), (Some(1.0), 5.0), (None, 0.0)]
            .map(|(x, value)| Located { at: vec![x], difference: difference(value) })
            .to_vec();
        let range = best_split(&tests, 9, 1).unwrap().range;
        assert_eq!(range, Range { dimension: 0, low: Some(0.5), high: None });
        assert!(range.contains(&[Some(1.0)]) && !range.contains(&[None]) && !range.contains(&[Some(0.0)]));
        assert_eq!(best_split(&tests[..3], 9, 1), None, "three tests have no two parts");
        assert_eq!(best_split(&[], 9, 1), None);
    }
}
