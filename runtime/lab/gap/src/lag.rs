//! By how much one series is later than another.

use crate::samples::Undefined;
use crate::series::{Series, pearson, samples_between};

/// How much later the lab is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// In seconds; positive if the lab is later than the simulation.
    pub seconds: f64,
    /// The correlation of both series at the nearest lag that was compared.
    pub correlation: f64,
    /// Whether the best lag is the greatest that was compared: the true one may be beyond.
    pub at_the_limit: bool,
}

/// The lag with the greatest correlation, of those up to `greatest` seconds in either direction, one every `step`
/// seconds, refined between them by a parabola.
///
/// Correlation, not distance, decides: it does not change with gain and offset. All lags are compared over the same
/// stretch of time, which is half the greatest lag shorter at both ends than what both series have in common, and each
/// series is moved by half of a lag. So the lag of swapped series is the same with the other sign. Of equally good lags
/// the shortest is taken. Undefined if no lag has a correlation, or a positive one.
pub fn lag(simulation: &Series<'_>, lab: &Series<'_>, step: f64, greatest: f64) -> Result<Lag, Undefined> {
    assert!(greatest >= 0.0 && greatest.is_finite(), "a greatest lag is some time");
    let start = simulation.start().max(lab.start()) + greatest / 2.0;
    let count = samples_between(start, simulation.end().min(lab.end()) - greatest / 2.0, step)?;
    let correlation = |shift: f64| {
        let a = simulation.resampled(start - shift / 2.0, step, count);
        let b = lab.resampled(start + shift / 2.0, step, count);
        pearson(&a, &b)
    };
    // There are at most twice as many lags as steps in the greatest, which is less than the series have in common.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the common grid is bounded")]
    let steps = libm::floor(greatest / step + 1e-9) as usize;
    let both_ways = |at: usize| if at == 0 { vec![0.0] } else { vec![at as f64, -(at as f64)] };
    let mut best: Option<(f64, f64)> = None;
    for multiple in (0..=steps).flat_map(both_ways) {
        let Ok(value) = correlation(multiple * step) else { continue };
        // What rounding makes better is no longer lag.
        if best.is_none_or(|(_, greatest)| value > greatest + 1e-12) {
            best = Some((multiple, value));
        }
    }
    let (multiple, value) = best.ok_or(Undefined::NoSpread)?;
    if value <= 0.0 {
        return Err(Undefined::NoSpread);
    }
    let at_the_limit = multiple.abs() == steps as f64;
    let neighbours = (correlation((multiple - 1.0) * step), correlation((multiple + 1.0) * step));
    let refined = match neighbours {
        (Ok(before), Ok(after)) if !at_the_limit => multiple + vertex(before, value, after),
        _ => multiple,
    };
    Ok(Lag { seconds: refined * step, correlation: value, at_the_limit })
}

/// Where the parabola through three values at -1, 0 and 1, of which the middle one is the greatest, has its vertex.
fn vertex(before: f64, middle: f64, after: f64) -> f64 {
    let curvature = before - 2.0 * middle + after;
    if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::series::Between;

    fn sampled(times: &[f64], late: f64) -> Vec<f64> {
        times.iter().map(|&t| t - late).map(|t| libm::sin(1.3 * t) + libm::cos(0.6 * t * t / 10.0)).collect()
    }

    fn times(count: u32, step: f64) -> Vec<f64> {
        (0..count).map(|i| f64::from(i) * step).collect()
    }

    #[test]
    fn a_lag_beyond_the_range_says_so() {
        let times = times(200, 0.1);
        let (a, b) = (sampled(&times, 0.0), sampled(&times, 0.8));
        let of = |values| Series::new(&times, values, Between::Held).unwrap();
        let found = lag(&of(&a), &of(&b), 0.1, 0.5).unwrap();
        assert!(found.at_the_limit && (found.seconds - 0.5).abs() < 1e-9, "{found:?}");
        assert!(!lag(&of(&a), &of(&b), 0.1, 1.5).unwrap().at_the_limit);
    }

    #[test]
    fn series_without_a_lag_say_why() {
        let times = times(50, 0.1);
        let (still, moving) = (vec![2.0; 50], sampled(&times, 0.0));
        let turned: Vec<f64> = times.clone();
        let falling: Vec<f64> = times.iter().map(|t| -t).collect();
        let of = |values| Series::new(&times, values, Between::Held).unwrap();
        assert_eq!(lag(&of(&still), &of(&moving), 0.1, 1.0), Err(Undefined::NoSpread));
        assert_eq!(lag(&of(&turned), &of(&falling), 0.1, 1.0), Err(Undefined::NoSpread), "they never go together");
        assert_eq!(lag(&of(&moving), &of(&moving), 0.1, 100.0), Err(Undefined::TooShort));
    }

    #[test]
    fn of_a_periodic_signal_the_shortest_lag_is_found() {
        let times = times(400, 0.1);
        let wave: Vec<f64> = (0..400).map(|i| f64::from(i % 10)).collect();
        let late: Vec<f64> = (0..400).map(|i| f64::from((i + 8) % 10)).collect();
        let of = |values| Series::new(&times, values, Between::Held).unwrap();
        let found = lag(&of(&wave), &of(&late), 0.1, 3.0).unwrap();
        assert!((found.seconds - 0.2).abs() < 0.02, "{found:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn a_delay_is_found_between_samples_with_its_sign(late in -0.9..0.9f64, gain in 0.1..5.0f64) {
            let times = times(300, 0.05);
            let simulated = sampled(&times, 0.0);
            let lab: Vec<f64> = sampled(&times, late).iter().map(|x| gain * x - 2.0).collect();
            let of = |values| Series::new(&times, values, Between::Held).unwrap();
            let found = lag(&of(&simulated), &of(&lab), 0.05, 1.0).unwrap();
            prop_assert!((found.seconds - late).abs() < 0.005, "{:?} for {}", found, late);
            let swapped = lag(&of(&lab), &of(&simulated), 0.05, 1.0).unwrap();
            prop_assert!((found.seconds + swapped.seconds).abs() < 1e-9);
        }
    }
}
