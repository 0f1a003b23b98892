//! When a time that grows reaches a number of seconds.

use sesame_base::time::SimTime;

/// The first nanosecond whose seconds are at least this number.
pub(crate) fn reaching(number: f64) -> i64 {
    first(number, |seconds| seconds >= number)
}

/// The first nanosecond whose seconds are above this number.
pub(crate) fn beyond(number: f64) -> i64 {
    first(number, |seconds| seconds > number)
}

/// The first nanosecond near a number of seconds from which on something holds.
fn first(number: f64, holds: impl Fn(f64) -> bool) -> i64 {
    // Even the largest times have smaller gaps than this after rounding to seconds.
    const NEAR: i64 = 1 << 12;
    let near = SimTime::from_seconds(number).nanos();
    let (mut low, mut high) = (near.saturating_sub(NEAR), near.saturating_add(NEAR));
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(SimTime::from_nanos(middle).seconds()) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_first_nanosecond_is_the_first(number in prop_oneof![0.0..100.0f64, (0i64..2000).prop_map(|n| n as f64 * 0.05)]) {
            let seconds = |nanos| SimTime::from_nanos(nanos).seconds();
            let (reached, passed) = (reaching(number), beyond(number));
            prop_assert!(seconds(reached) >= number && seconds(reached - 1) < number);
            prop_assert!(seconds(passed) > number && seconds(passed - 1) <= number);
        }
    }
}
