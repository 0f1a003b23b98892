//! The metric ranking `MR` [SESAME 2023, Section 4.4.2]: how good each measured test is among all of them, from 0 to 1.

use std::cmp::Ordering;
use std::fmt;

/// Which values of a metric are better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Better {
    /// Greater ones.
    Higher,
    /// Smaller ones.
    Lower,
    /// Those nearer to a value, such as the limit that a near miss almost reaches.
    Nearer(f64),
}

/// A metric that tests are ranked by: a value for each of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key<'a> {
    /// The values, in the order of the tests; infinite ones are compared, NaN is not a value.
    pub values: &'a [f64],
    /// Which of them are better.
    pub better: Better,
}

/// How a rank becomes a number from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// (average rank − 1) / (tests − 1): the worst test has 0, the best 1, and equal tests have the same. A single test
    /// has 1.
    Average,
    /// rank / tests with ranks from 0, equal tests in their order: what the original platform computed.
    Paper,
}

/// Why tests cannot be ranked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unrankable {
    /// There is no metric to rank by.
    NoKey,
    /// The key at this position has another number of values than the first one.
    Length(usize),
    /// The key at this position has no number for the test at that position.
    Unmeasured(usize, usize),
    /// The key at this position ranks by the distance to a value that is not finite.
    Target(usize),
}

impl fmt::Display for Unrankable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unrankable::NoKey => write!(f, "there is no metric to rank by"),
            Unrankable::Length(key) => write!(f, "metric {key} has another number of values than the first one"),
            Unrankable::Unmeasured(key, test) => write!(f, "metric {key} has no value for test {test}"),
            Unrankable::Target(key) => write!(f, "metric {key} is compared with a value that is not finite"),
        }
    }
}

impl std::error::Error for Unrankable {}

/// The quality of each test: its rank by the first key, among equal ones by the second, and so on.
pub fn qualities(keys: &[Key<'_>], scale: Scale) -> Result<Vec<f64>, Unrankable> {
    let count = keys.first().ok_or(Unrankable::NoKey)?.values.len();
    for (at, key) in keys.iter().enumerate() {
        if key.values.len() != count {
            return Err(Unrankable::Length(at));
        }
        if let Some(test) = key.values.iter().position(|value| value.is_nan()) {
            return Err(Unrankable::Unmeasured(at, test));
        }
        if matches!(key.better, Better::Nearer(target) if !target.is_finite()) {
            return Err(Unrankable::Target(at));
        }
    }
    let compare = |a: usize, b: usize| {
        let by = |key: &Key<'_>| worse_first(key, a, b);
        keys.iter().map(by).find(|ordering| ordering.is_ne()).unwrap_or(Ordering::Equal)
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| compare(a, b));
    let mut qualities = vec![0.0; count];
    match scale {
        Scale::Paper => {
            for (rank, &test) in order.iter().enumerate() {
                qualities[test] = rank as f64 / count as f64;
            }
        }
        Scale::Average => {
            let mut before = 0;
            for equal in order.chunk_by(|&a, &b| compare(a, b).is_eq()) {
                // Ranks from 0, so the first is `before` and the last `before + equal − 1`.
                let average = before as f64 + 0.5 * (equal.len() - 1) as f64;
                for &test in equal {
                    qualities[test] = if count == 1 { 1.0 } else { average / (count - 1) as f64 };
                }
                before += equal.len();
            }
        }
    }
    Ok(qualities)
}

fn worse_first(key: &Key<'_>, a: usize, b: usize) -> Ordering {
    let (a, b) = (key.values[a], key.values[b]);
    let ascending = |a: f64, b: f64| a.partial_cmp(&b).expect("NaN is refused");
    match key.better {
        Better::Higher => ascending(a, b),
        Better::Lower => ascending(b, a),
        Better::Nearer(target) => ascending((b - target).abs(), (a - target).abs()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranked(keys: &[(&[f64], Better)], scale: Scale) -> Vec<f64> {
        let keys: Vec<Key<'_>> = keys.iter().map(|&(values, better)| Key { values, better }).collect();
        qualities(&keys, scale).unwrap()
    }

    #[test]
    fn the_best_has_one_the_worst_has_none_and_equal_tests_share() {
        assert_eq!(
            ranked(&[(&[3.0, 1.0, 2.0, 2.0, 9.0], Better::Higher)], Scale::Average),
            [0.75, 0.0, 0.375, 0.375, 1.0]
        );
        assert_eq!(
            ranked(&[(&[3.0, 1.0, 2.0, 2.0, 9.0], Better::Lower)], Scale::Average),
            [0.25, 1.0, 0.625, 0.625, 0.0]
        );
        assert_eq!(ranked(&[(&[7.0], Better::Lower)], Scale::Average), [1.0]);
        assert_eq!(ranked(&[(&[7.0, 7.0, 7.0], Better::Lower)], Scale::Average), [0.5; 3]);
        assert_eq!(ranked(&[(&[0.0, -0.0], Better::Higher)], Scale::Average), [0.5; 2]);
        assert!(ranked(&[(&[], Better::Lower)], Scale::Average).is_empty());
    }

    #[test]
    fn near_misses_rank_by_their_distance_to_the_limit() {
        assert_eq!(
            ranked(&[(&[0.0, 5.5, 4.0, f64::INFINITY], Better::Nearer(5.0))], Scale::Average),
            [1.0 / 3.0, 1.0, 2.0 / 3.0, 0.0]
        );
    }

    #[test]
    fn later_keys_decide_between_equal_tests() {
        let keys: [(&[f64], Better); 2] = [(&[1.0, 1.0, 0.0], Better::Higher), (&[5.0, 4.0, 0.0], Better::Lower)];
        assert_eq!(ranked(&keys, Scale::Average), [0.5, 1.0, 0.0]);
    }

    #[test]
    fn the_papers_ranks_begin_at_zero_and_keep_the_order_of_equal_tests() {
        assert_eq!(ranked(&[(&[3.0, 1.0, 3.0, 2.0], Better::Higher)], Scale::Paper), [0.5, 0.0, 0.75, 0.25]);
    }

    #[test]
    fn what_cannot_be_ranked_is_named() {
        assert_eq!(qualities(&[], Scale::Average), Err(Unrankable::NoKey));
        let key = |values, better| Key { values, better };
        let (two, nan): (&[f64], &[f64]) = (&[1.0, 2.0], &[1.0, f64::NAN]);
        let wrong = |keys: &[Key<'_>]| qualities(keys, Scale::Average).unwrap_err();
        assert_eq!(wrong(&[key(two, Better::Lower), key(nan, Better::Lower)]), Unrankable::Unmeasured(1, 1));
        assert_eq!(wrong(&[key(two, Better::Lower), key(&two[..1], Better::Lower)]), Unrankable::Length(1));
        assert_eq!(wrong(&[key(two, Better::Nearer(f64::NAN))]), Unrankable::Target(0));
        assert_eq!(wrong(&[key(nan, Better::Lower)]).to_string(), "metric 0 has no value for test 1");
    }
}
