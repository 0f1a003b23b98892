//! The clock of a simulator that nobody steps: it goes on in ticks of about equal length.

use sesame_base::time::SimTime;

use crate::transport::TransportError;

/// How many ticks are kept to know the usual one.
const KEPT: usize = 64;

/// From how few ticks nobody knows the usual one.
const FEWEST: usize = 10;

/// A leap is longer than so many usual ticks, and than [`LEAST`].
const TICKS: i64 = 100;

/// In nanoseconds of simulation time.
const LEAST: i64 = 1_000_000_000;

/// The ticks of a clock, over all runs.
#[derive(Debug, Clone, Default)]
pub struct Ticks {
    /// Their lengths in nanoseconds; the oldest one is replaced.
    kept: Vec<i64>,
    next: usize,
}

impl Ticks {
    /// The clock showed this time, and then that one. It is an error if it went back, or so far ahead that nobody knows
    /// what happened in between.
    pub fn tick(&mut self, from: SimTime, to: SimTime) -> Result<(), TransportError> {
        if to < from {
            return Err(TransportError::ClockBack { from, to });
        }
        let length = (to - from).nanos();
        if length == 0 {
            return Ok(());
        }
        if let Some(usual) = self.usual()
            && length > LEAST.max(usual.saturating_mul(TICKS))
        {
            return Err(TransportError::ClockLeap { from, to, usual: SimTime::from_nanos(usual) });
        }
        if self.kept.len() < KEPT {
            self.kept.push(length);
        } else {
            self.kept[self.next] = length;
            self.next = (self.next + 1) % KEPT;
        }
        Ok(())
    }

    /// The median of the last ticks.
    fn usual(&self) -> Option<i64> {
        let mut sorted = self.kept.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied().filter(|_| sorted.len() >= FEWEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a clock that shows these milliseconds comes to.
    fn shown(times: impl IntoIterator<Item = i64>) -> Result<(), TransportError> {
        let mut ticks = Ticks::default();
        let mut last = SimTime::ZERO;
        for time in times {
            let time = SimTime::from_nanos(time * 1_000_000);
            ticks.tick(last, time)?;
            last = time;
        }
        Ok(())
    }

    #[test]
    fn a_clock_that_goes_back_or_leaps_ahead_is_wrong() {
        let regular = || (0..1000).map(|tick| tick * 10);
        assert_eq!(shown(regular()), Ok(()));
        let back = shown(regular().chain([9_980])).unwrap_err().to_string();
        assert_eq!(back, "the clock of the simulator went back, from 9.990 s to 9.980 s");
        let leap = shown(regular().chain([3_600_000])).unwrap_err().to_string();
        assert_eq!(
            leap,
            "the clock of the simulator leapt ahead, from 9.990 s to 3600.000 s, while it usually goes on by 0.010 s"
        );
    }

    #[test]
    fn a_pause_lost_ticks_and_slow_clocks_are_no_leaps() {
        let regular = || (0..100).map(|tick| tick * 10);
        // A paused simulator shows the same time again.
        assert_eq!(shown(regular().chain([990, 990, 1000])), Ok(()));
        // Ninety ticks were lost, and then a second.
        assert_eq!(shown(regular().chain([1_890])), Ok(()));
        assert_eq!(shown(regular().chain([1_980])), Ok(()));
        assert_eq!(shown((0..50).map(|tick| tick * 5_000).chain([600_000])), Ok(()));
        // Before there are ten ticks, nobody knows what is usual.
        assert_eq!(shown([0, 10, 20, 3_600_000]), Ok(()));
    }
}
