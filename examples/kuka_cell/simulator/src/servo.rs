//! One driven axis: a motor with its drive, following a target it is sent.
//!
//! The target is smoothed first, as fine interpolation does with the coarse steps it gets. The drive is the usual
//! cascade: a proportional position loop over a proportional speed loop, with limits on speed and on acceleration
//! (torque). Near its target the axis is a critically damped second-order lag; far from it, it speeds up at its limit,
//! cruises at its limit and brakes along the curve that its torque allows, so it does not overshoot. Hard stops end
//! its travel. Units are rad and s for joints, m and s for conveyors.

/// What an axis can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits {
    /// The lower hard stop.
    pub lower: f64,
    /// The upper hard stop.
    pub upper: f64,
    /// The highest speed, per second.
    pub speed: f64,
    /// The highest acceleration, per second squared.
    pub acceleration: f64,
}

/// An axis in motion.
///
/// Always `lower <= position <= upper` and `|speed|` at most its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    position: f64,
    speed: f64,
    target: f64,
    smoothed: f64,
}

/// Time constant with which targets are smoothed, in s.
const SMOOTHING: f64 = 0.05;

/// Gain of the position loop, 1/s. With the smoothing, the axis lags a slow steady motion by 150 ms, a fast one by a
/// little more: typical of large arms whose controller is sent positions alone, without speed feed-forward.
const POSITION_GAIN: f64 = 10.0;

/// Gain of the speed loop, 1/s: four times the other, which makes the cascade critically damped.
const SPEED_GAIN: f64 = 4.0 * POSITION_GAIN;

/// The part of the highest acceleration that braking plans with; the rest is for the speed loop's own lag.
const BRAKING_SHARE: f64 = 0.7;

/// How much harder a brake of full force brakes than the drive can.
const BRAKE_STRENGTH: f64 = 2.0;

impl Servo {
    /// An axis at rest, holding its position.
    pub fn at_rest(position: f64) -> Self {
        Servo { position, speed: 0.0, target: position, smoothed: position }
    }

    /// Where the axis is.
    pub fn position(&self) -> f64 {
        self.position
    }

    /// How fast it moves, signed.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Takes a new target. One that is not a finite number is ignored, as a drive rejects a broken telegram: the last
    /// one holds. One beyond a hard stop is followed up to the stop.
    pub fn aim(&mut self, target: f64) {
        if target.is_finite() {
            self.target = target;
        }
    }

    /// Advances by `dt` seconds (a few milliseconds). `disturbance` is an acceleration from outside the drive, such as
    /// torque ripple; with it the acceleration may exceed the limit by as much.
    pub fn advance(&mut self, limits: &AxisLimits, dt: f64, disturbance: f64) {
        let reachable = self.target.clamp(limits.lower, limits.upper);
        // The implicit step: stable however small the time constant is against `dt`.
        self.smoothed += (reachable - self.smoothed) * (dt / (SMOOTHING + dt));
        let error = self.smoothed - self.position;
        let wanted = approach_speed(error.abs(), limits).copysign(error);
        let acceleration =
            (SPEED_GAIN * (wanted - self.speed)).clamp(-limits.acceleration, limits.acceleration) + disturbance;
        self.speed = (self.speed + acceleration * dt).clamp(-limits.speed, limits.speed);
        self.travel(limits, dt);
    }

    /// The same with the drive switched off and a brake instead, with this share of its force: none lets the axis roll.
    pub fn brake(&mut self, limits: &AxisLimits, dt: f64, share: f64) {
        let lost = BRAKE_STRENGTH * share * limits.acceleration * dt;
        self.speed = (self.speed.abs() - lost).max(0.0).copysign(self.speed);
        self.travel(limits, dt);
        // Where the drive takes over once the brake is released.
        self.target = self.position;
        self.smoothed = self.position;
    }

    fn travel(&mut self, limits: &AxisLimits, dt: f64) {
        self.position += self.speed * dt;
        if self.position > limits.upper {
            self.position = limits.upper;
            self.speed = 0.0;
        } else if self.position < limits.lower {
            self.position = limits.lower;
            self.speed = 0.0;
        }
    }
}

/// The speed at which to approach a target this far away: proportional when close; beyond, the speed from which
/// constant braking still ends in the proportional part. The two meet with equal value and slope.
fn approach_speed(distance: f64, limits: &AxisLimits) -> f64 {
    let braking = BRAKING_SHARE * limits.acceleration;
    let close = braking / (POSITION_GAIN * POSITION_GAIN);
    let speed =
        if distance <= close { POSITION_GAIN * distance } else { libm::sqrt(2.0 * braking * (distance - 0.5 * close)) };
    speed.min(limits.speed)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LIMITS: AxisLimits = AxisLimits { lower: -3.0, upper: 3.0, speed: 1.8, acceleration: 3.5 };
    const DT: f64 = 0.004;

    /// Positions after each step towards targets given by time.
    fn run(n_seconds: u32, target: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut servo = Servo::at_rest(0.0);
        (0..n_seconds * 250)
            .map(|i| {
                servo.aim(target(f64::from(i) * DT));
                servo.advance(&LIMITS, DT, 0.0);
                servo.position()
            })
            .collect()
    }

    fn first_time(positions: &[f64], level: f64) -> f64 {
        positions.iter().position(|&q| q >= level).expect("the axis gets there") as f64 * DT
    }

    #[test]
    fn a_small_step_is_a_smooth_lag_without_overshoot() {
        let step = 0.01;
        let positions = run(2, |_| step);
        // Three poles near 20/s, none of them oscillating: 10 % to 90 % takes 4.2/20 s, and it never overshoots.
        let rise = first_time(&positions, 0.9 * step) - first_time(&positions, 0.1 * step);
        assert!((0.19..0.23).contains(&rise), "{rise}");
        assert!(positions.iter().all(|&q| q <= step * 1.005), "overshoot");
        assert!((positions.last().unwrap() - step).abs() < 1e-6, "settles");
        assert!(first_time(&positions, 0.98 * step) < 0.45, "settling time");
    }

    #[test]
    fn a_large_step_takes_the_time_its_speed_and_torque_allow_and_hardly_overshoots() {
        let positions = run(5, |_| 2.0);
        // At the limits, with no lag at all: distance/speed + speed/acceleration, less the last centimetre or two.
        let ideal = 2.0 / LIMITS.speed + LIMITS.speed / LIMITS.acceleration - 0.1;
        let arrival = first_time(&positions, 1.98);
        assert!((ideal..ideal + 0.6).contains(&arrival), "{arrival} against {ideal}");
        assert!(positions.iter().all(|&q| q <= 2.01), "overshoot");
        assert!((positions.last().unwrap() - 2.0).abs() < 1e-6);
    }

    #[test]
    fn a_steady_motion_is_followed_late_by_a_constant_time() {
        let positions = run(3, |t| 0.2 * t);
        let lag = 3.0 - positions.last().unwrap() / 0.2;
        assert!((lag - (SMOOTHING + 1.0 / POSITION_GAIN)).abs() < 0.01, "{lag}");
    }

    #[test]
    fn white_noise_is_smoothed_away_and_a_bias_comes_through() {
        // A new draw every 20 ms.
        let draw = |t: f64| sesame_runtime::rng::keyed_unit(1, libm::floor(t / 0.02 + 0.01).to_bits(), 0);
        let noise = run(60, |t| 0.6 * (draw(t) - 0.5));
        let bias = run(60, |t| 0.27 + 0.02 * draw(t));
        // 0.17 rad RMS go in; what comes out is what torque can follow.
        let rms = libm::sqrt(noise.iter().map(|q| q * q).sum::<f64>() / noise.len() as f64);
        assert!((0.005..0.06).contains(&rms), "{rms}");
        assert!(bias[500..].iter().all(|q| (q - 0.28).abs() < 0.005));
    }

    #[test]
    fn a_torque_disturbance_pushes_the_axis_off_as_far_as_its_stiffness_allows() {
        let mut servo = Servo::at_rest(0.0);
        (0..1000).for_each(|_| servo.advance(&LIMITS, DT, 0.5));
        assert!((servo.position() - 0.5 / (SPEED_GAIN * POSITION_GAIN)).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn limits_hold_under_absurd_targets(
            targets in prop::collection::vec(
                prop_oneof![
                    prop::num::f64::ANY,
                    Just(f64::NAN),
                    Just(f64::INFINITY),
                    Just(f64::MAX),
                    -5.0..5.0f64,
                ],
                1..400,
            ),
        ) {
            let mut servo = Servo::at_rest(0.0);
            for target in targets {
                servo.aim(target);
                let before = servo;
                servo.advance(&LIMITS, DT, 0.0);
                prop_assert!((LIMITS.lower..=LIMITS.upper).contains(&servo.position()));
                prop_assert!(servo.speed().abs() <= LIMITS.speed);
                // At a hard stop the axis is stopped by the stop, not by its drive.
                let stopped = servo.position() == LIMITS.lower || servo.position() == LIMITS.upper;
                prop_assert!(stopped || (servo.speed() - before.speed()).abs() <= LIMITS.acceleration * DT + 1e-12);
            }
        }

        #[test]
        fn a_target_that_is_no_number_leaves_the_last_one(target in -2.0..2.0f64) {
            let mut servo = Servo::at_rest(0.0);
            servo.aim(target);
            for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                servo.aim(broken);
            }
            (0..2000).for_each(|_| servo.advance(&LIMITS, DT, 0.0));
            prop_assert!((servo.position() - target).abs() < 1e-6);
        }

        #[test]
        fn approach_speed_can_always_be_braked(distance in 0.0..6.0f64) {
            // Speed times its slope over distance is the braking that the curve asks for.
            let h = 1e-6;
            let slope = (approach_speed(distance + h, &LIMITS) - approach_speed(distance, &LIMITS)) / h;
            prop_assert!(approach_speed(distance, &LIMITS) * slope <= LIMITS.acceleration);
        }
    }
}
