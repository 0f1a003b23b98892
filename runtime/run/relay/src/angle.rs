//! Angles on the circle: those that differ by whole turns are the same.

/// The angle in `low..low + turn` that differs from this one by whole turns; itself if it lies there. Not a number for
/// what is not finite.
pub(crate) fn wrapped(angle: f64, low: f64, turn: f64) -> f64 {
    if (low..low + turn).contains(&angle) {
        return angle;
    }
    // The remainder is exact, and lies within half a turn on either side of the middle.
    let middle = low + turn / 2.0;
    let wrapped = middle + libm::remainder(angle - middle, turn);
    if wrapped >= low + turn || wrapped < low { low } else { wrapped }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn wrapping_takes_away_turns_one_by_one(degrees in -2000..2000_i32, low in -400..400_i32) {
            let mut expected = degrees;
            while expected < low { expected += 360 }
            while expected >= low + 360 { expected -= 360 }
            prop_assert_eq!(wrapped(f64::from(degrees), f64::from(low), 360.0), f64::from(expected));
        }

        #[test]
        fn in_radians_the_direction_stays(angle in -1e4..1e4_f64, low in -10.0..10.0_f64) {
            let found = wrapped(angle, low, TAU);
            prop_assert!((low..low + TAU).contains(&found), "{found}");
            prop_assert!((libm::sin(found) - libm::sin(angle)).abs() < 1e-9);
            prop_assert!((libm::cos(found) - libm::cos(angle)).abs() < 1e-9);
        }
    }

    #[test]
    fn the_low_end_belongs_to_the_circle_and_the_high_end_does_not() {
        assert_eq!(wrapped(PI, -PI, TAU), -PI);
        assert_eq!(wrapped(-PI, -PI, TAU), -PI);
        assert_eq!(wrapped(360.0, 0.0, 360.0), 0.0);
        assert!(wrapped(f64::INFINITY, 0.0, 360.0).is_nan() && wrapped(f64::NAN, 0.0, 360.0).is_nan());
    }
}
