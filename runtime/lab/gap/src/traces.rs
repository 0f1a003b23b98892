//! Two traces of one signal, from a simulation and from a lab: how far they are apart, and how much of that is a lag, a
//! gain, an offset or noise.

use crate::lag::{Lag, lag};
use crate::samples::Undefined;
use crate::series::{Line, Series, aligned, pearson, rms};
use crate::warping::{Warping, dtw};

/// How two series are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Seconds between samples of the common grid; `None` takes the longer of both median times between samples. A step
    /// that is finer than the samples adds no knowledge, and makes lags less exact.
    pub step: Option<f64>,
    /// The greatest lag that is looked for, in seconds, in either direction.
    pub greatest_lag: f64,
    /// How far one series may locally run ahead of the other in the DTW distance, in seconds.
    pub band: f64,
}

/// Two series compared. What depends on the lag has no value where the lag has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Seconds between samples of the common grid.
    pub step: f64,
    /// How many samples both series have in common.
    pub samples: usize,
    /// The standard deviation of the simulation's values.
    pub spread: f64,
    /// The root mean square of the differences.
    pub rms: f64,
    /// Pearson's correlation.
    pub correlation: Result<f64, Undefined>,
    /// The DTW distance.
    pub warping: Warping,
    /// By how much the lab is later.
    pub lag: Result<Lag, Undefined>,
    /// The root mean square of the differences once the lag is taken out.
    pub rms_without_lag: Result<f64, Undefined>,
    /// The lab's mean minus the simulation's once the lag is taken out.
    pub level: Result<f64, Undefined>,
    /// Gain, offset and noise once the lag is taken out.
    pub line: Result<Line, Undefined>,
}

/// Compares two series over the time that they have in common.
pub fn compare(simulation: &Series<'_>, lab: &Series<'_>, settings: Settings) -> Result<Comparison, Undefined> {
    let by_samples = || Some(simulation.interval()?.max(lab.interval()?));
    let step = settings.step.or_else(by_samples).ok_or(Undefined::TooShort)?;
    let [a, b] = aligned(simulation, lab, step, 0.0)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is bounded by the samples")]
    let band = libm::round((settings.band / step).clamp(0.0, a.len() as f64)) as usize;
    let lag = lag(simulation, lab, step, settings.greatest_lag);
    let without = lag.and_then(|lag| aligned(simulation, lab, step, lag.seconds));
    Ok(Comparison {
        step,
        samples: a.len(),
        spread: deviation(&a),
        rms: rms(&a, &b),
        correlation: pearson(&a, &b),
        warping: dtw(&a, &b, band),
        lag,
        rms_without_lag: without.as_ref().map(|[a, b]| rms(a, b)).map_err(|why| *why),
        level: without.as_ref().map(|[a, b]| mean(b) - mean(a)).map_err(|why| *why),
        line: without.as_ref().map_err(|why| *why).and_then(|[a, b]| Line::of(a, b)),
    })
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    libm::sqrt(values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use sesame_rng::Stream;

    use super::*;
    use crate::series::Between;

    #[test]
    fn a_delayed_scaled_noisy_copy_is_recognised() {
        let mut stream = Stream::derive(1, "traces", &[]);
        let times: Vec<f64> = (0..600).map(|i| f64::from(i) * 0.05).collect();
        let signal = |t: f64| libm::sin(t) + 0.5 * libm::sin(2.3 * t + 1.0);
        let simulated: Vec<f64> = times.iter().map(|&t| signal(t)).collect();
        // The lab samples at other times.
        let lab_times: Vec<f64> = (0..500).map(|i| 0.013 + f64::from(i) * 0.06).collect();
        let lab: Vec<f64> = lab_times.iter().map(|&t| 1.2 * signal(t - 0.37) - 0.3 + 0.02 * stream.normal()).collect();
        let simulated = Series::new(&times, &simulated, Between::Linear).unwrap();
        let lab = Series::new(&lab_times, &lab, Between::Linear).unwrap();
        let settings = Settings { step: None, greatest_lag: 1.0, band: 0.5 };
        let of = compare(&simulated, &lab, settings).unwrap();
        assert_eq!(of.step, simulated.interval().unwrap().max(lab.interval().unwrap()));
        assert!((of.lag.unwrap().seconds - 0.37).abs() < 0.01, "{of:?}");
        let line = of.line.unwrap();
        assert!((line.gain - 1.2).abs() < 0.01 && (line.offset + 0.3).abs() < 0.01, "{of:?}");
        assert!((0.012..0.025).contains(&line.noise), "{of:?}");
        assert!(of.rms_without_lag.unwrap() < of.rms && of.warping.rms() < of.rms, "{of:?}");
        assert!(of.correlation.unwrap() < of.lag.unwrap().correlation);
    }

    #[test]
    fn series_that_do_not_meet_have_no_comparison() {
        let series = |times| Series::new(times, &[1.0, 2.0, 1.0], Between::Held).unwrap();
        let (early, late) = (series(&[0.0, 1.0, 2.0]), series(&[5.0, 6.0, 7.0]));
        let settings = Settings { step: None, greatest_lag: 1.0, band: 0.0 };
        assert_eq!(compare(&early, &late, settings), Err(Undefined::TooShort));
    }
}
