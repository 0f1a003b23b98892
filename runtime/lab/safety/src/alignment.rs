//! Two recordings on one time axis, as multi-robot position integration needs them: each was made in a run of its own.

use crate::trace::{Trace, TraceError};

/// How the times of a second recording relate to those of a first one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alignment {
    /// They have the same zero, for example the start of the test.
    Recorded,
    /// Both recordings begin at the same instant of the test.
    CommonStart,
    /// What the second recording calls 0 s is this time of the first, in seconds.
    Offset(f64),
}

impl Alignment {
    /// The second recording in the times of the first one.
    pub fn align(self, first: &Trace, second: &Trace) -> Result<Trace, TraceError> {
        match self {
            Alignment::Recorded => Ok(second.clone()),
            Alignment::CommonStart => second.shifted(first.start() - second.start()),
            Alignment::Offset(seconds) => second.shifted(seconds),
        }
    }
}

#[cfg(test)]
mod tests {
    use parry3d_f64::math::Vector;

    use super::*;

    #[test]
    fn times_of_the_second_recording_become_those_of_the_first() {
        let trace = |times: [f64; 2]| Trace::new(times.to_vec(), vec![Vector::ZERO; 2], None).unwrap();
        let (first, second) = (trace([100.0, 104.0]), trace([7.0, 9.0]));
        let aligned = |alignment: Alignment| alignment.align(&first, &second).unwrap().times().to_vec();
        assert_eq!(aligned(Alignment::Recorded), [7.0, 9.0]);
        assert_eq!(aligned(Alignment::CommonStart), [100.0, 102.0]);
        assert_eq!(aligned(Alignment::Offset(90.0)), [97.0, 99.0]);
    }
}
