//! Parameters of a simulation under which it is closer to the lab (system identification).
//!
//! [`identify`] reads delay, gain, offset and noise off pairs of traces, without running anything. [`minimise`] looks
//! for the few parameters of a model whose effect only a run of it shows.

use sesame_optimise::sobol::SobolPoints;

use crate::samples::{Moments, Undefined};
use crate::series::Series;
use crate::traces::{Settings, compare};

/// What leads from the simulation to the lab, over several pairs of traces. The mean is what to set in a simulation,
/// the deviation over the pairs is by how much to vary it (domain randomisation).
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// By how much the lab is later, in seconds.
    pub delay: Moments,
    /// By what values are multiplied.
    pub gain: Moments,
    /// What is added to values.
    pub offset: Moments,
    /// The standard deviation of what is left, in the unit of the values.
    pub noise: Moments,
    /// Positions of pairs whose delay is the greatest that was looked for: the true one may be greater.
    pub at_the_limit: Vec<usize>,
    /// Positions of pairs that say nothing, with the reason.
    pub left_out: Vec<(usize, Undefined)>,
}

/// Delay, gain, offset and noise of pairs of a simulation and a lab; `None` if no pair says anything.
pub fn identify(pairs: &[(Series<'_>, Series<'_>)], settings: Settings) -> Option<Identified> {
    let [mut delays, mut gains, mut offsets, mut noises] = [const { Vec::new() }; 4];
    let (mut at_the_limit, mut left_out) = (Vec::new(), Vec::new());
    for (at, (simulation, lab)) in pairs.iter().enumerate() {
        let found = compare(simulation, lab, settings).and_then(|of| Ok((of.lag?, of.line?)));
        match found {
            Ok((lag, line)) => {
                delays.push(lag.seconds);
                gains.push(line.gain);
                offsets.push(line.offset);
                noises.push(line.noise);
                if lag.at_the_limit {
                    at_the_limit.push(at);
                }
            }
            Err(why) => left_out.push((at, why)),
        }
    }
    let [delay, gain, offset, noise] = [&delays, &gains, &offsets, &noises].map(|of| Moments::of(of));
    Some(Identified { delay: delay?, gain: gain?, offset: offset?, noise: noise?, at_the_limit, left_out })
}

/// The least value that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Where.
    pub at: Vec<f64>,
    /// The value there; infinite if no evaluation was finite.
    pub value: f64,
}

/// Looks for the least value of a function of few parameters within bounds, lower end first, with this many evaluations
/// at most, at least one; no derivatives.
///
/// A third of the evaluations are low-discrepancy points, which find the valley; the others are simplex searches from
/// the best one on [Nelder and Mead 1965], each point moved into the bounds, begun anew where a simplex has shrunk to
/// nothing. A value that is not finite counts as worse than all others. The function is evaluated in one order, so a
/// deterministic one gives the same result again.
pub fn minimise(bounds: &[[f64; 2]], evaluations: usize, seed: u64, mut f: impl FnMut(&[f64]) -> f64) -> Best {
    assert!(!bounds.is_empty() && evaluations > 0, "there is a parameter, and an evaluation");
    let ordered = bounds.iter().all(|[low, high]| low <= high && low.is_finite() && high.is_finite());
    assert!(ordered, "bounds are finite, the lower one first");
    let scaled = |unit: &[f64]| -> Vec<f64> {
        unit.iter().zip(bounds).map(|(x, [low, high])| (low + (high - low) * x).clamp(*low, *high)).collect()
    };
    let mut search = Search { left: evaluations, best: None };
    let mut value = |unit: &[f64]| {
        let value = f(&scaled(unit));
        if value.is_finite() { value } else { f64::INFINITY }
    };
    let mut points = SobolPoints::new(seed);
    for index in 0..u32::try_from(evaluations.div_ceil(3)).unwrap_or(u32::MAX) {
        let unit = (0..bounds.len()).map(|dimension| points.value(dimension, index)).collect();
        search.evaluate(unit, &mut value);
    }
    let mut size = 0.15;
    while search.left > 0 {
        search.simplex(size, &mut value);
        // Another direction and another size each time, so that a simplex that lost a direction finds it again.
        size *= -0.5;
        if f64::abs(size) < 1e-4 {
            size = 0.15;
        }
    }
    let best = search.best.expect("there was an evaluation");
    Best { at: scaled(&best.at), value: best.value }
}

/// A point of the unit box with its value.
#[derive(Debug, Clone)]
struct Vertex {
    at: Vec<f64>,
    value: f64,
}

struct Search {
    left: usize,
    best: Option<Vertex>,
}

impl Search {
    /// Evaluates a point, moved into the box; `None` if no evaluation is left.
    fn evaluate(&mut self, mut at: Vec<f64>, value: &mut impl FnMut(&[f64]) -> f64) -> Option<Vertex> {
        self.left = self.left.checked_sub(1)?;
        for x in &mut at {
            *x = x.clamp(0.0, 1.0);
        }
        let vertex = Vertex { value: value(&at), at };
        if self.best.as_ref().is_none_or(|best| vertex.value < best.value) {
            self.best = Some(vertex.clone());
        }
        Some(vertex)
    }

    /// One simplex search from the best point on; `None` if evaluations ended it.
    fn simplex(&mut self, size: f64, value: &mut impl FnMut(&[f64]) -> f64) -> Option<()> {
        let first = self.best.clone()?;
        let mut simplex = vec![first.clone()];
        for dimension in 0..first.at.len() {
            let mut at = first.at.clone();
            // Inwards at a bound, or the vertex would be the first one again.
            let inside = (0.0..=1.0).contains(&(at[dimension] + size));
            at[dimension] += if inside { size } else { -size };
            simplex.push(self.evaluate(at, value)?);
        }
        loop {
            simplex.sort_by(|a, b| a.value.total_cmp(&b.value));
            let extent =
                |vertex: &Vertex| vertex.at.iter().zip(&simplex[0].at).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            if simplex.iter().map(extent).fold(0.0, f64::max) < 1e-10 {
                return Some(());
            }
            let worst = simplex.pop().expect("a simplex has two vertices or more");
            let count = simplex.len() as f64;
            let centre: Vec<f64> =
                (0..worst.at.len()).map(|d| simplex.iter().map(|vertex| vertex.at[d]).sum::<f64>() / count).collect();
            // The point on the line from the worst vertex through the centre of the others.
            let beyond = |by: f64| centre.iter().zip(&worst.at).map(|(c, w)| c + by * (c - w)).collect::<Vec<f64>>();
            let (least, second_worst) = (simplex[0].value, simplex[simplex.len() - 1].value);
            let reflected = self.evaluate(beyond(1.0), value)?;
            if reflected.value < least {
                let expanded = self.evaluate(beyond(2.0), value)?;
                simplex.push(if expanded.value < reflected.value { expanded } else { reflected });
            } else if reflected.value < second_worst {
                simplex.push(reflected);
            } else {
                let by = if reflected.value < worst.value { 0.5 } else { -0.5 };
                let contracted = self.evaluate(beyond(by), value)?;
                if contracted.value < reflected.value.min(worst.value) {
                    simplex.push(contracted);
                } else {
                    // Nothing on the line is better: all vertices move half the way to the best.
                    let best = simplex[0].at.clone();
                    simplex.push(worst);
                    for vertex in &mut simplex[1..] {
                        let halfway = vertex.at.iter().zip(&best).map(|(x, y)| f64::midpoint(*x, *y)).collect();
                        *vertex = self.evaluate(halfway, value)?;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use sesame_rng::Stream;

    use super::*;
    use crate::series::{Between, rms};

    #[test]
    fn the_least_value_of_known_functions_is_found() {
        let rosenbrock = |x: &[f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            a * a + 100.0 * b * b
        };
        let best = minimise(&[[-2.0, 2.0], [-2.0, 2.0]], 600, 1, rosenbrock);
        assert!(best.value < 1e-8 && (best.at[0] - 1.0).abs() < 1e-3, "{best:?}");
        // Its least value within the bounds is on one of them.
        let best = minimise(&[[0.0, 0.5], [1.0, 3.0], [-1.0, 1.0]], 400, 1, |x| {
            (x[0] - 2.0) * (x[0] - 2.0) + x[1] + (x[2] - 0.3) * (x[2] - 0.3)
        });
        assert!((best.at[0] - 0.5).abs() < 1e-3 && (best.at[1] - 1.0).abs() < 1e-3, "{best:?}");
        assert!((best.at[2] - 0.3).abs() < 1e-2, "{best:?}");
    }

    #[test]
    fn a_relays_delay_and_gain_are_found_by_running_it() {
        let signal = |t: f64| libm::sin(t) + 0.4 * libm::sin(3.1 * t);
        let run = |delay: f64, gain: f64| -> Vec<f64> {
            (0..300).map(|i| gain * signal(f64::from(i) * 0.05 - delay)).collect()
        };
        let lab = run(0.21, 0.8);
        let best = minimise(&[[0.0, 1.0], [0.5, 2.0]], 120, 3, |at| rms(&run(at[0], at[1]), &lab));
        assert!((best.at[0] - 0.21).abs() < 0.005 && (best.at[1] - 0.8).abs() < 0.005, "{best:?}");
    }

    #[test]
    fn pairs_of_traces_tell_delay_gain_offset_and_noise_with_their_spread() {
        let times: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.05).collect();
        let signal = |t: f64, run: f64| libm::sin(t + run) + 0.5 * libm::sin(2.3 * t);
        let mut stream = Stream::derive(1, "fit", &[]);
        let runs: Vec<(Vec<f64>, Vec<f64>)> = (0..4)
            .map(|run| {
                let run = f64::from(run);
                let delay = 0.2 + 0.02 * run;
                let simulated = times.iter().map(|&t| signal(t, run)).collect();
                let noisy =
                    times.iter().map(|&t| 0.9 * signal(t - delay, run) + 0.1 + 0.05 * stream.normal()).collect();
                (simulated, noisy)
            })
            .collect();
        let of = |values| Series::new(&times, values, Between::Linear).unwrap();
        let still = vec![1.0; times.len()];
        let mut pairs: Vec<_> = runs.iter().map(|(simulated, lab)| (of(simulated), of(lab))).collect();
        pairs.push((of(&still), of(&runs[0].1)));
        let found = identify(&pairs, Settings { step: None, greatest_lag: 1.0, band: 0.5 }).unwrap();
        assert_eq!((found.left_out, found.at_the_limit), (vec![(4, Undefined::NoSpread)], vec![]));
        assert!((found.delay.mean - 0.23).abs() < 0.01 && (found.gain.mean - 0.9).abs() < 0.02, "{:?}", found.delay);
        assert!((0.015..0.04).contains(&found.delay.deviation.unwrap()), "{:?}", found.delay);
        assert!(
            (found.offset.mean - 0.1).abs() < 0.02 && (0.03..0.06).contains(&found.noise.mean),
            "{:?}",
            found.noise
        );
        assert_eq!(identify(&pairs[4..], Settings { step: None, greatest_lag: 1.0, band: 0.5 }), None);
    }

    proptest! {
        #[test]
        fn evaluations_are_never_more_and_never_outside(evaluations in 1usize..60, seed in 0u64..9, low in -3.0..0.0f64) {
            let mut count = 0;
            let bounds = [[low, low + 2.0], [1.0, 1.0]];
            let best = minimise(&bounds, evaluations, seed, |at| {
                count += 1;
                assert!(at.iter().zip(bounds).all(|(x, [low, high])| (low..=high).contains(x)), "{at:?}");
                if at[0] > 0.0 { f64::NAN } else { at[0] * at[0] }
            });
            prop_assert_eq!(count, evaluations);
            prop_assert!(!best.value.is_nan());
        }
    }
}
