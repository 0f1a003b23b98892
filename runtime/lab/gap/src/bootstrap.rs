//! Intervals of a statistic of two samples by resampling each side [Efron and Tibshirani 1993].

use sesame_rng::Stream;

use crate::distribution::{normal_cdf, normal_quantile};
use crate::samples::{Samples, Side, Undefined};

/// How an interval is resampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resampling {
    /// How many resamples, at least 100; the ends of 95 % intervals want 2,000.
    pub resamples: u32,
    /// The confidence of the interval, in `0..1`.
    pub confidence: f64,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for Resampling {
    fn default() -> Self {
        Resampling { resamples: 2000, confidence: 0.95, seed: 0 }
    }
}

/// Two intervals of one statistic, each with its lower end first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intervals {
    /// The quantiles of the resampled values.
    pub percentile: [f64; 2],
    /// Corrected for bias and for a spread that varies with the value (BCa); undefined where the resampled values are
    /// all on one side of the observed one.
    pub bca: Result<[f64; 2], Undefined>,
    /// How many resamples had a value.
    pub resamples: u32,
}

/// The share of resamples that may have no value.
const LOST: f64 = 0.05;

/// Intervals of a statistic of both samples, with two values or more on each side.
///
/// Resamples without a value are left out if they are at most 5 %. If all resamples give the same value, the intervals
/// would have no width and would claim a certainty that a few runs do not give: they are undefined. BCa takes its
/// acceleration from both samples, as in SciPy.
pub fn intervals(
    samples: Samples<'_>,
    resampling: Resampling,
    statistic: impl Fn(Samples<'_>) -> Result<f64, Undefined>,
) -> Result<Intervals, Undefined> {
    let Resampling { resamples, confidence, seed } = resampling;
    assert!(resamples >= 100 && confidence > 0.0 && confidence < 1.0, "an interval needs resamples and a confidence");
    let observed = statistic(samples)?;
    for (side, values) in [(Side::Simulation, samples.simulation()), (Side::Lab, samples.lab())] {
        if values.len() < 2 {
            return Err(Undefined::OneRun(side));
        }
    }
    let mut stream = Stream::derive(seed, "bootstrap", &[]);
    let mut draw = |from: &[f64], into: &mut Vec<f64>| {
        into.clear();
        into.extend((0..from.len()).map(|_| from[stream.below(from.len())]));
    };
    let (mut simulation, mut lab) = (Vec::new(), Vec::new());
    let mut values: Vec<f64> = (0..resamples)
        .filter_map(|_| {
            draw(samples.simulation(), &mut simulation);
            draw(samples.lab(), &mut lab);
            statistic(Samples::new(&simulation, &lab)).ok()
        })
        .collect();
    if (values.len() as f64) < (1.0 - LOST) * f64::from(resamples) {
        return Err(Undefined::Resamples);
    }
    values.sort_by(f64::total_cmp);
    if values.first() == values.last() {
        return Err(Undefined::NoSpread);
    }
    let tail = (1.0 - confidence) / 2.0;
    let percentile = [tail, 1.0 - tail].map(|share| quantile(&values, share));
    let bca = bca_shares(samples, &values, observed, tail, statistic).map(|ends| ends.map(|p| quantile(&values, p)));
    Ok(Intervals { percentile, bca, resamples: u32::try_from(values.len()).expect("no more than resamples") })
}

/// Which quantiles of the resampled values are the ends of the BCa interval.
fn bca_shares(
    samples: Samples<'_>,
    sorted: &[f64],
    observed: f64,
    tail: f64,
    statistic: impl Fn(Samples<'_>) -> Result<f64, Undefined>,
) -> Result<[f64; 2], Undefined> {
    let below = sorted.partition_point(|&value| value < observed);
    let up_to = sorted.partition_point(|&value| value <= observed);
    // Half of the ties, as statistics of ranks have many.
    let share = (below + up_to) as f64 / (2.0 * sorted.len() as f64);
    if share == 0.0 || share == 1.0 {
        return Err(Undefined::Resamples);
    }
    let bias = normal_quantile(share);
    let (simulation, lab) = (samples.simulation(), samples.lab());
    let without_lab = |rest: &[f64]| statistic(Samples::new(simulation, rest));
    let without_simulation = |rest: &[f64]| statistic(Samples::new(rest, lab));
    let [a, b] = [jackknife(lab, without_lab)?, jackknife(simulation, without_simulation)?];
    let squares = a[0] + b[0];
    let acceleration = if squares > 0.0 { (a[1] + b[1]) / (6.0 * squares * libm::sqrt(squares)) } else { 0.0 };
    let end = |p: f64| {
        let z = bias + normal_quantile(p);
        let stretched = 1.0 - acceleration * z;
        if stretched > 0.0 { Ok(normal_cdf(bias + z / stretched)) } else { Err(Undefined::Resamples) }
    };
    Ok([end(tail)?, end(1.0 - tail)?])
}

/// The sums of squares and cubes of what each value contributes to a statistic.
fn jackknife(values: &[f64], statistic: impl Fn(&[f64]) -> Result<f64, Undefined>) -> Result<[f64; 2], Undefined> {
    let mut rest = values[1..].to_vec();
    let mut without = Vec::with_capacity(values.len());
    for at in 0..values.len() {
        without.push(statistic(&rest)?);
        if at + 1 < values.len() {
            rest[at] = values[at];
        }
    }
    let n = values.len() as f64;
    let mean = without.iter().sum::<f64>() / n;
    let influences = without.iter().map(|value| (n - 1.0) * (mean - value) / n);
    Ok(influences.fold([0.0, 0.0], |[squares, cubes], u| [squares + u * u, cubes + u * u * u]))
}

/// A quantile of sorted values, between two of them in proportion.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is an index")]
    let low = at as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (sorted[high] - sorted[low]) * (at - low as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{cliff_delta, cohen_d, difference, hedges_g};

    fn normal_sample(seed: u64, side: u64, count: usize) -> Vec<f64> {
        let mut stream = Stream::derive(seed, "test", &[side]);
        (0..count).map(|_| stream.normal()).collect()
    }

    #[test]
    fn nineteen_of_twenty_intervals_contain_the_true_value() {
        let inside = |truth: f64, [low, high]: [f64; 2]| u32::from(low <= truth && truth <= high);
        let mut hits = [0; 4];
        for seed in 0..300 {
            let (simulation, mut lab) = (normal_sample(seed, 0, 20), normal_sample(seed, 1, 20));
            for value in &mut lab {
                *value += 1.0;
            }
            let samples = Samples::new(&simulation, &lab);
            let resampling = Resampling { resamples: 600, seed, ..Resampling::default() };
            let of_difference = intervals(samples, resampling, difference).unwrap();
            let of_delta = intervals(samples, resampling, cliff_delta).unwrap();
            // Φ(1/√2)·2 − 1 is the probability of a greater value minus that of a smaller one.
            let delta = 2.0 * normal_cdf(std::f64::consts::FRAC_1_SQRT_2) - 1.0;
            hits[0] += inside(1.0, of_difference.percentile);
            hits[1] += inside(1.0, of_difference.bca.unwrap());
            hits[2] += inside(delta, of_delta.percentile);
            hits[3] += inside(delta, of_delta.bca.unwrap());
        }
        // 95 % are 285. The bootstrap of twenty values is known to be a little narrow.
        assert!(hits.iter().all(|&of| (268..=297).contains(&of)), "{hits:?}");
    }

    #[test]
    fn degenerate_samples_have_no_interval() {
        let of = |a, b, statistic: fn(Samples<'_>) -> Result<f64, Undefined>| {
            intervals(Samples::new(a, b), Resampling::default(), statistic)
        };
        assert_eq!(of(&[1.0], &[1.0, 2.0], difference), Err(Undefined::OneRun(Side::Simulation)));
        assert_eq!(of(&[1.0; 4], &[2.0; 4], difference), Err(Undefined::NoSpread));
        assert_eq!(of(&[1.0, 2.0, 3.0], &[7.0, 8.0, 9.0], cliff_delta), Err(Undefined::NoSpread));
        // Every fourth resample of two values each has no spread.
        assert_eq!(of(&[1.0, 2.0], &[1.0, 3.0], cohen_d), Err(Undefined::Resamples));
        assert!(of(&[1.0, 2.0, 4.0, 3.0], &[1.0, 3.0, 5.0, 2.0], hedges_g).is_ok());
    }

    #[test]
    fn equal_seeds_give_equal_intervals_and_the_order_of_ends_is_kept() {
        let (a, b) = (normal_sample(1, 0, 9), normal_sample(1, 1, 7));
        let of =
            |seed| intervals(Samples::new(&a, &b), Resampling { seed, ..Resampling::default() }, hedges_g).unwrap();
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
        let [low, high] = of(3).bca.unwrap();
        assert!(low < high);
    }
}
