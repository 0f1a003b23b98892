//! How far the runs of a simulation are from those of a lab, as one number that a fit makes small.

use crate::samples::Undefined;
use crate::series::Series;

/// Into how many steps the common time of all runs is divided, at most. Values at these times change with any shift, so
/// more of them add cost and little knowledge.
const STEPS: f64 = 500.0;

/// How far the values of one signal over several runs of a simulation are from those over several runs of a lab, in
/// standard deviations of the signal in the lab; 0 on average if both are samples of the same, so it can be a little
/// below.
///
/// It is the energy distance [Székely and Rizzo 2013] of the two samples of values at a time, without bias, averaged
/// over the time that all runs have in common. It grows with a difference of the means as well as of the spread, so
/// delays, gains and offsets make it small where the runs agree, and noise where they vary as much as those of the lab.
/// For the latter both sides need several runs: one shows no spread, and then none is asked for.
pub fn discrepancy(simulation: &[Series<'_>], lab: &[Series<'_>]) -> Result<f64, Undefined> {
    let all = || simulation.iter().chain(lab);
    let start = all().map(Series::start).fold(f64::NEG_INFINITY, f64::max);
    let end = all().map(Series::end).fold(f64::INFINITY, f64::min);
    let interval = all().filter_map(Series::interval).fold(0.0, f64::max);
    if simulation.is_empty() || lab.is_empty() || interval <= 0.0 || end - start < interval {
        return Err(Undefined::TooShort);
    }
    let step = interval.max((end - start) / STEPS);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is at most the number of steps")]
    let count = libm::floor((end - start) / step) as usize + 1;
    let resampled =
        |runs: &[Series<'_>]| -> Vec<Vec<f64>> { runs.iter().map(|run| run.resampled(start, step, count)).collect() };
    let (simulation, lab) = (resampled(simulation), resampled(lab));
    let scale = deviation(&lab)?;
    let distances = (0..count).map(|at| energy_distance(&at_time(&simulation, at), &at_time(&lab, at)));
    Ok(distances.sum::<f64>() / count as f64 / scale)
}

/// 2 E|X − Y| − E|X − X′| − E|Y − Y′|. The last two are over pairs of different runs, and 0 for a single one.
fn energy_distance(x: &[f64], y: &[f64]) -> f64 {
    let sum = |a: &[f64], b: &[f64]| -> f64 { a.iter().flat_map(|x| b.iter().map(move |y| (x - y).abs())).sum() };
    let spread = |of: &[f64]| sum(of, of) / (of.len() * (of.len() - 1).max(1)) as f64;
    2.0 * sum(x, y) / (x.len() * y.len()) as f64 - spread(x) - spread(y)
}

fn at_time(runs: &[Vec<f64>], at: usize) -> Vec<f64> {
    runs.iter().map(|run| run[at]).collect()
}

/// The standard deviation of a signal over all its values.
fn deviation(runs: &[Vec<f64>]) -> Result<f64, Undefined> {
    let count = runs.iter().map(Vec::len).sum::<usize>() as f64;
    let mean = runs.iter().flatten().sum::<f64>() / count;
    let variance = runs.iter().flatten().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    let deviation = libm::sqrt(variance);
    // Rounding leaves a little of a signal that stands still.
    if deviation > 1e-12 * mean.abs() { Ok(deviation) } else { Err(Undefined::NoSpread) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_rng::Stream;

    use super::*;
    use crate::series::Between;

    fn times() -> Vec<f64> {
        (0..600).map(|i| f64::from(i) * 0.05).collect()
    }

    /// Runs of a wave that is so much later and noisier.
    fn runs(seed: u64, count: usize, delay: f64, noise: f64) -> Vec<Vec<f64>> {
        let mut stream = Stream::derive(seed, "runs", &[]);
        let wave = |t: f64| libm::sin(t - delay) + 0.5 * libm::sin(2.3 * (t - delay));
        (0..count).map(|_| times().iter().map(|&t| wave(t) + noise * stream.normal()).collect()).collect()
    }

    fn between(simulation: &[Vec<f64>], lab: &[Vec<f64>]) -> f64 {
        let times = times();
        let of = |run| Series::new(&times, run, Between::Linear).unwrap();
        let simulation: Vec<_> = simulation.iter().map(|run| of(run)).collect();
        let lab: Vec<_> = lab.iter().map(|run| of(run)).collect();
        discrepancy(&simulation, &lab).unwrap()
    }

    #[test]
    fn it_is_least_at_the_delay_and_the_noise_of_the_lab() {
        let lab = runs(1, 5, 0.2, 0.1);
        let best = |values: &[f64], of: &dyn Fn(f64) -> Vec<Vec<f64>>| {
            let found = values.iter().map(|&value| (between(&of(value), &lab), value));
            found.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
        };
        let delays = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3];
        assert_eq!(best(&delays, &|delay| runs(2, 5, delay, 0.1)), 0.2);
        // One run without noise shows the delay too.
        assert_eq!(best(&delays, &|delay| runs(2, 1, delay, 0.0)), 0.2);
        let noises = [0.0, 0.05, 0.1, 0.15, 0.2, 0.3];
        assert_eq!(best(&noises, &|noise| runs(2, 5, 0.2, noise)), 0.1);
    }

    #[test]
    fn what_stands_still_in_the_lab_or_never_meets_has_none() {
        let times = [0.0, 1.0, 2.0];
        let still = Series::new(&times, &[3.0; 3], Between::Linear).unwrap();
        let moving = Series::new(&times, &[3.0, 4.0, 3.0], Between::Linear).unwrap();
        assert_eq!(discrepancy(&[moving], &[still]), Err(Undefined::NoSpread));
        let later = [5.0, 6.0, 7.0];
        let later = Series::new(&later, &[3.0, 4.0, 3.0], Between::Linear).unwrap();
        assert_eq!(discrepancy(&[moving], &[later]), Err(Undefined::TooShort));
        assert_eq!(discrepancy(&[], &[moving]), Err(Undefined::TooShort));
    }

    proptest! {
        #[test]
        fn the_distance_is_that_of_the_distribution_functions_less_what_is_due_to_few_runs(
            x in prop::collection::vec(-5.0..5.0f64, 2..6), y in prop::collection::vec(-5.0..5.0f64, 2..6)
        ) {
            // The other form of the energy distance: twice the integral of the squared difference of the two
            // distribution functions [Székely and Rizzo 2013].
            let mut places: Vec<f64> = x.iter().chain(&y).copied().collect();
            places.sort_by(f64::total_cmp);
            let share = |of: &[f64], at: f64| of.iter().filter(|&&v| v <= at).count() as f64 / of.len() as f64;
            let pieces = places.windows(2).map(|pair| {
                let apart = share(&x, pair[0]) - share(&y, pair[0]);
                2.0 * apart * apart * (pair[1] - pair[0])
            });
            // Runs paired with themselves are in the distribution functions, and not in the distance.
            let with_themselves = |of: &[f64]| {
                let sum: f64 = of.iter().flat_map(|a| of.iter().map(move |b| (a - b).abs())).sum();
                let n = of.len() as f64;
                sum / (n * (n - 1.0)) - sum / (n * n)
            };
            let expected = pieces.sum::<f64>() - with_themselves(&x) - with_themselves(&y);
            prop_assert!((energy_distance(&x, &y) - expected).abs() < 1e-9);
        }
    }
}
