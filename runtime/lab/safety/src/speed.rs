//! How fast a recorded body was, as a safety zone needs to know that is wide enough for its approach.

use crate::trace::Trace;

/// A mean speed over a part of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Speed {
    /// In metres per second; 0 or more.
    pub value: f64,
    /// When the part begins, in seconds.
    pub from: f64,
    /// When it ends, in seconds.
    pub to: f64,
}

/// Why there is no speed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpeedError {
    /// A length of time that is none.
    #[error("the window is {0} s: it must be finite and 0 s or more")]
    Window(f64),
    /// No two samples are that far apart.
    #[error("the recording lasts {recorded} s: it must have two samples, at least {window} s apart")]
    TooShort {
        /// What is recorded, in seconds.
        recorded: f64,
        /// What is needed, in seconds.
        window: f64,
    },
}

/// The greatest mean speed between two samples that are at least `window` seconds apart and have none in between that
/// would do: displacement by time.
///
/// A window is what makes this robust. Neighbouring samples that are a millisecond apart turn a millimetre of noise
/// into a metre per second. If each position is off by at most u metres, the value is off by at most 2u / window. On
/// the other hand, peaks within a window are averaged. If the acceleration is at most a, the body was nowhere faster
/// than the value plus a·w/2, where w is the longest window: at a time t its velocity differs from that at the peak by
/// at most a times the time between, and each instant of the recording is in a window. Add both to the value for a
/// bound.
pub fn greatest_speed(trace: &Trace, window: f64) -> Result<Speed, SpeedError> {
    if !(0.0..f64::INFINITY).contains(&window) {
        return Err(SpeedError::Window(window));
    }
    let times = trace.times();
    let apart = |from: usize, to: usize| from < to && times[to] - times[from] >= window;
    let mut greatest: Option<Speed> = None;
    let mut consider = |from: usize, to: usize| {
        let way = (trace.positions()[to] - trace.positions()[from]).length();
        let value = way / (times[to] - times[from]);
        if greatest.is_none_or(|speed| value > speed.value) {
            greatest = Some(Speed { value, from: times[from], to: times[to] });
        }
    };
    // The shortest window that begins at each sample, and the shortest that ends there: with only one of them, the
    // first or the last samples could be in none.
    let (mut after, mut before) = (0, 0);
    for sample in 0..times.len() {
        while after < times.len() && !apart(sample, after) {
            after += 1;
        }
        if after < times.len() {
            consider(sample, after);
        }
        while apart(before + 1, sample) {
            before += 1;
        }
        if apart(before, sample) {
            consider(before, sample);
        }
    }
    greatest.ok_or(SpeedError::TooShort { recorded: trace.end() - trace.start(), window })
}

#[cfg(test)]
mod tests {
    use parry3d_f64::math::Vector;
    use proptest::prelude::*;

    use super::*;

    fn along_x(samples: &[(f64, f64)]) -> Trace {
        let positions = samples.iter().map(|&(_, x)| Vector::new(x, 0.0, 0.0)).collect();
        Trace::new(samples.iter().map(|&(time, _)| time).collect(), positions, None).unwrap()
    }

    #[test]
    fn the_fastest_part_is_found_with_its_time() {
        let trace = along_x(&[(0.0, 0.0), (1.0, 1.0), (2.0, 4.0), (3.0, 5.0)]);
        assert_eq!(greatest_speed(&trace, 0.0), Ok(Speed { value: 3.0, from: 1.0, to: 2.0 }));
        assert_eq!(greatest_speed(&trace, 1.5), Ok(Speed { value: 2.0, from: 0.0, to: 2.0 }));
    }

    #[test]
    fn noise_between_close_samples_is_no_speed() {
        let sample = |k: u32| {
            let time = f64::from(k) / 1000.0;
            (time, 0.5 * time + if k.is_multiple_of(2) { 1e-3 } else { -1e-3 })
        };
        let noisy: Vec<(f64, f64)> = (0..1000).map(sample).collect();
        let trace = along_x(&noisy);
        assert!(greatest_speed(&trace, 0.0).unwrap().value > 2.0);
        let windowed = greatest_speed(&trace, 0.1).unwrap().value;
        assert!((windowed - 0.5).abs() <= 2.0 * 1e-3 / 0.1 + 1e-9, "{windowed}");
    }

    #[test]
    fn a_recording_that_is_too_short_is_an_error() {
        let trace = along_x(&[(0.0, 0.0), (1.0, 1.0)]);
        assert_eq!(
            greatest_speed(&trace, 2.0).unwrap_err().to_string(),
            "the recording lasts 1 s: it must have two samples, at least 2 s apart"
        );
        assert_eq!(greatest_speed(&trace, -1.0), Err(SpeedError::Window(-1.0)));
        assert!(greatest_speed(&along_x(&[(0.0, 0.0)]), 0.0).is_err());
    }

    proptest! {
        #[test]
        fn the_speed_is_that_of_all_shortest_windows(
            samples in prop::collection::vec((0.01..1.0f64, -2.0..2.0f64), 2..30), window in 0.0..2.0f64,
        ) {
            let mut time = 0.0;
            let samples: Vec<(f64, f64)> = samples.iter().map(|&(step, x)| { time += step; (time, x) }).collect();
            let trace = along_x(&samples);
            let times = trace.times();
            let apart = |i: usize, j: usize| i < j && times[j] - times[i] >= window;
            let mut naive: Option<f64> = None;
            for i in 0..times.len() {
                for j in i + 1..times.len() {
                    if apart(i, j) && (!apart(i, j - 1) || !apart(i + 1, j)) {
                        let value = (samples[j].1 - samples[i].1).abs() / (times[j] - times[i]);
                        naive = Some(naive.map_or(value, |most: f64| most.max(value)));
                    }
                }
            }
            prop_assert_eq!(greatest_speed(&trace, window).ok().map(|speed| speed.value), naive);
        }
    }
}
