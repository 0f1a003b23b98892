//! Simulation time, a type of its own so that it cannot be confused with wall time.

use std::fmt;
use std::ops::{Add, Sub};

use serde::{Deserialize, Serialize};

/// A point in, or a length of, simulation time: whole nanoseconds since the start of the run.
///
/// Wall time is `std::time::Duration` and never converts to this.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SimTime(i64);

impl SimTime {
    /// The start of every run.
    pub const ZERO: SimTime = SimTime(0);
    /// The latest time.
    pub const MAX: SimTime = SimTime(i64::MAX);

    /// From whole nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Self {
        SimTime(nanos)
    }

    /// From seconds, rounded to the nearest nanosecond. Values out of range are clamped; NaN is zero.
    #[expect(clippy::cast_possible_truncation, reason = "`as` clamps, which is what is documented")]
    pub fn from_seconds(seconds: f64) -> Self {
        SimTime(libm::round(seconds * 1e9) as i64)
    }

    /// Whole nanoseconds.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Seconds, the unit of all calculations.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e9
    }
}

impl Add for SimTime {
    type Output = SimTime;
    fn add(self, other: SimTime) -> SimTime {
        SimTime(self.0.saturating_add(other.0))
    }
}

impl Sub for SimTime {
    type Output = SimTime;
    fn sub(self, other: SimTime) -> SimTime {
        SimTime(self.0.saturating_sub(other.0))
    }
}

impl fmt::Display for SimTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.seconds())
    }
}
