//! Whether one group of runs tends to larger values than another: Mann and Whitney's U, and the effect size of Vargha
//! and Delaney (2000).

/// Groups of together so many runs are tested exactly.
const MOST_EXACT: usize = 60;

/// Two groups compared by ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankSum {
    /// Mann and Whitney's U of the first group: pairs in which its value is the larger one, ties counting half.
    pub u: f64,
    /// Vargha and Delaney's A₁₂: the probability that a run of the first group has a larger value than one of the
    /// second, ties counting half; one half means no difference.
    pub a12: f64,
    /// The two-sided probability of a U at least as far from its mean, if both groups come from one distribution.
    pub p: f64,
    /// Whether `p` is exact, given the ties there are; else it is by the normal approximation, with correction for ties
    /// and continuity.
    pub exact: bool,
}

/// Compares two groups of values without NaN; `None` where one is empty.
pub fn rank_sum(first: &[f64], second: &[f64]) -> Option<RankSum> {
    let (n, m) = (first.len(), second.len());
    if n == 0 || m == 0 {
        return None;
    }
    let doubled = doubled_ranks(first, second);
    let sum: usize = doubled[..n].iter().sum();
    // Twice U, and twice its mean: whole numbers, so that nothing depends on rounding.
    let (twice_u, twice_mean) = (sum - n * (n + 1), n * m);
    let pairs = (n * m) as f64;
    let u = twice_u as f64 / 2.0;
    let exact = n + m <= MOST_EXACT;
    let p = if exact { exact_p(&doubled, n, twice_u.abs_diff(twice_mean)) } else { normal_p(&doubled, n, u) };
    Some(RankSum { u, a12: u / pairs, p, exact })
}

/// Twice the rank of each value, first those of the first group; equal values share the mean of their ranks.
fn doubled_ranks(first: &[f64], second: &[f64]) -> Vec<usize> {
    let values: Vec<f64> = first.iter().chain(second).map(|value| value + 0.0).collect();
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0; values.len()];
    let mut before = 0;
    for tied in order.chunk_by(|&a, &b| values[a].total_cmp(&values[b]).is_eq()) {
        for &at in tied {
            ranks[at] = 2 * before + tied.len() + 1;
        }
        before += tied.len();
    }
    ranks
}

/// The share of all ways to choose the first group whose U is at least as far from its mean.
fn exact_p(doubled: &[usize], n: usize, distance: usize) -> f64 {
    let total: usize = doubled.iter().sum();
    // `ways[k][s]`: in how many ways k of the values have ranks that add up to s.
    let mut ways = vec![vec![0.0f64; total + 1]; n + 1];
    ways[0][0] = 1.0;
    for (taken, &rank) in doubled.iter().enumerate() {
        for k in (1..=n.min(taken + 1)).rev() {
            let (fewer, more) = ways.split_at_mut(k);
            for sum in rank..=total {
                more[0][sum] += fewer[k - 1][sum - rank];
            }
        }
    }
    let middle = n * (n + 1) + n * (doubled.len() - n);
    let far = |sum: usize| sum.abs_diff(middle) >= distance;
    let (extreme, all) = ways[n]
        .iter()
        .enumerate()
        .fold((0.0, 0.0), |(extreme, all), (sum, ways)| (if far(sum) { extreme + ways } else { extreme }, all + ways));
    extreme / all
}

fn normal_p(doubled: &[usize], n: usize, u: f64) -> f64 {
    let total = doubled.len() as f64;
    let (n, m) = (n as f64, total - n as f64);
    let mut sorted = doubled.to_vec();
    sorted.sort_unstable();
    let ties: f64 = sorted.chunk_by(|a, b| a == b).map(|tied| tied.len() as f64).map(|t| t * t * t - t).sum();
    let variance = n * m / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    if variance <= 0.0 {
        return 1.0;
    }
    let far = ((u - n * m / 2.0).abs() - 0.5).max(0.0);
    libm::erfc(far / libm::sqrt(2.0 * variance))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// By counting pairs, and by trying every way to choose the first group.
    fn naive(first: &[f64], second: &[f64]) -> (f64, f64) {
        let wins = |first: &[f64], second: &[f64]| -> f64 {
            first
                .iter()
                .flat_map(|a| {
                    second.iter().map(move |b| {
                        if a > b {
                            1.0
                        } else if a < b {
                            0.0
                        } else {
                            0.5
                        }
                    })
                })
                .sum()
        };
        let all: Vec<f64> = first.iter().chain(second).copied().collect();
        let mean = (first.len() * second.len()) as f64 / 2.0;
        let u = wins(first, second);
        let (mut extreme, mut ways) = (0, 0);
        for subset in 0u32..1 << all.len() {
            if subset.count_ones() as usize == first.len() {
                let group = |inside: bool| -> Vec<f64> {
                    (0..all.len()).filter(|i| (subset >> i & 1 == 1) == inside).map(|i| all[i]).collect()
                };
                ways += 1;
                extreme += u32::from((wins(&group(true), &group(false)) - mean).abs() >= (u - mean).abs());
            }
        }
        (u, f64::from(extreme) / f64::from(ways))
    }

    #[test]
    fn published_and_other_known_values_come_out() {
        // Five against five without overlap: 2 of the 252 ways are as extreme.
        let apart = rank_sum(&[1.0, 2.0, 3.0, 4.0, 5.0], &[6.0, 7.0, 8.0, 9.0, 10.0]).unwrap();
        assert_eq!((apart.u, apart.a12, apart.exact), (0.0, 0.0, true));
        assert!((apart.p - 2.0 / 252.0).abs() < 1e-15);
        let same = rank_sum(&[1.0, 1.0], &[1.0, 1.0, 1.0]).unwrap();
        assert_eq!((same.a12, same.p), (0.5, 1.0));
        assert_eq!(rank_sum(&[], &[1.0]), None);
        // Mann and Whitney's tortoises and hares: six of each, U = 11 or 25.
        let (tortoises, hares) = ([1.0, 7.0, 8.0, 9.0, 10.0, 11.0], [2.0, 3.0, 4.0, 5.0, 6.0, 12.0]);
        assert_eq!(rank_sum(&tortoises, &hares).unwrap().u, 25.0);
    }

    #[test]
    fn the_approximation_comes_close_to_the_exact_probability() {
        let first: Vec<f64> = (0..28).map(|n| f64::from(n * 37 % 50)).collect();
        let second: Vec<f64> = (0..30).map(|n| f64::from(n * 31 % 60 + 6)).collect();
        let exact = rank_sum(&first, &second).unwrap();
        let near = normal_p(&doubled_ranks(&first, &second), 28, exact.u);
        assert!(exact.exact && (exact.p - near).abs() < 0.01 && (0.01..0.9).contains(&exact.p), "{exact:?} {near}");
        let many: Vec<f64> = (0..40).map(f64::from).collect();
        assert!(!rank_sum(&many, &many).unwrap().exact);
    }

    proptest! {
        #[test]
        fn it_is_what_counting_pairs_and_ways_gives(
            first in prop::collection::vec((0i32..6).prop_map(f64::from), 1..6),
            second in prop::collection::vec((0i32..6).prop_map(f64::from), 1..7),
        ) {
            let ours = rank_sum(&first, &second).unwrap();
            let (u, p) = naive(&first, &second);
            prop_assert_eq!(ours.u, u);
            prop_assert!((ours.p - p).abs() < 1e-12, "{} {}", ours.p, p);
            let back = rank_sum(&second, &first).unwrap();
            prop_assert!((ours.a12 + back.a12 - 1.0).abs() < 1e-12 && (ours.p - back.p).abs() < 1e-12);
        }
    }
}
