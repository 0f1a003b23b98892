//! The automatic transmission of ARCH-COMP as differential equations: a car with four gears under throttle and brake.
//!
//! State: engine speed `n` in rpm, wheel speed `w` in rpm, gear. With the gear's ratio `r`, the speed ratio of the
//! torque converter is `s = r · 3.23 w / n`; with its capacity `K(s)` and torque ratio `R(s)` from tables,
//!
//! - `0.02199 dn/dt = T(throttle, n) - (n / K(s))²`, with the engine's torque `T` from a table, and `n` kept in 600 to
//!   6000,
//! - `12.0941 dw/dt = 3.23 r R(s) (n / K(s))² - sign(w) (40 + 0.02 v² + brake)`, in ft·lb,
//! - `v = 2π · 60/5280 · w`, in miles per hour.
//!
//! The gear goes up when `v` has been above a threshold of throttle and gear for 0.08 s, and down when below another.
//! Tables and numbers are those of the published model (The `MathWorks`' demonstration, as ARCH-COMP uses it).
//! Integrated by Heun's method in steps of 0.01 s, gears decided every 0.04 s; the original takes variable steps, so
//! figures are ours.

/// Pieces of 5 s of throttle and of brake.
pub(super) const SEGMENTS: usize = 6;
const SEGMENT_STEPS: usize = 500;
const STEP: f64 = 0.01;
/// Steps from one decision about gears to the next.
const DECISION_STEPS: usize = 4;
/// Decisions in a row that a shift takes.
const WAIT: u32 = 2;

const THROTTLES: [f64; 10] = [0.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0];
const ENGINE_SPEEDS: [f64; 11] =
    [800.0, 1200.0, 1600.0, 2000.0, 2400.0, 2800.0, 3200.0, 3600.0, 4000.0, 4400.0, 4800.0];
/// Torque of the engine in ft·lb, by throttle and engine speed.
const TORQUES: [[f64; 11]; 10] = [
    [-40.0, -44.0, -49.0, -53.0, -57.0, -61.0, -65.0, -70.0, -74.0, -78.0, -82.0],
    [215.0, 117.0, 85.0, 66.0, 44.0, 29.0, 10.0, -2.0, -13.0, -22.0, -32.0],
    [245.0, 208.0, 178.0, 148.0, 122.0, 104.0, 85.0, 66.0, 48.0, 33.0, 18.0],
    [264.0, 260.0, 241.0, 219.0, 193.0, 167.0, 152.0, 133.0, 119.0, 96.0, 85.0],
    [264.0, 279.0, 282.0, 275.0, 260.0, 238.0, 223.0, 208.0, 189.0, 171.0, 152.0],
    [267.0, 290.0, 293.0, 297.0, 290.0, 275.0, 260.0, 256.0, 234.0, 212.0, 193.0],
    [267.0, 297.0, 305.0, 305.0, 305.0, 301.0, 293.0, 282.0, 267.0, 249.0, 226.0],
    [267.0, 301.0, 308.0, 312.0, 319.0, 323.0, 319.0, 316.0, 297.0, 279.0, 253.0],
    [267.0, 301.0, 312.0, 319.0, 327.0, 327.0, 327.0, 327.0, 312.0, 293.0, 267.0],
    [267.0, 301.0, 312.0, 319.0, 327.0, 334.0, 334.0, 334.0, 319.0, 305.0, 275.0],
];

const SPEED_RATIOS: [f64; 21] = [
    0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.81, 0.82, 0.83, 0.84, 0.85, 0.86, 0.87, 0.88, 0.89, 0.9, 0.92, 0.94,
];
const CAPACITIES: [f64; 21] = [
    137.4652, 137.0650, 135.8644, 135.6644, 137.5653, 140.3666, 145.2689, 152.8725, 162.9773, 164.2779, 166.1788,
    167.9797, 170.0807, 172.7820, 175.3832, 179.5852, 183.5871, 189.8901, 197.6938, 215.9024, 244.5160,
];
const TORQUE_RATIOS: [f64; 21] = [
    2.232, 2.075, 1.975, 1.846, 1.72, 1.564, 1.409, 1.254, 1.096, 1.08, 1.061, 1.043, 1.028, 1.012, 1.002, 1.002,
    1.001, 0.998, 0.999, 1.001, 1.002,
];

const GEARS: [f64; 4] = [2.393, 1.45, 1.0, 0.677];
const UP_THROTTLES: [f64; 6] = [0.0, 25.0, 35.0, 50.0, 90.0, 100.0];
/// From each gear but the last, in miles per hour.
const UP_SPEEDS: [[f64; 6]; 3] = [
    [10.0, 10.0, 15.0, 23.0, 40.0, 40.0],
    [30.0, 30.0, 30.0, 41.0, 70.0, 70.0],
    [50.0, 50.0, 50.0, 60.0, 100.0, 100.0],
];
const DOWN_THROTTLES: [f64; 6] = [0.0, 5.0, 40.0, 50.0, 90.0, 100.0];
/// To each gear but the last.
const DOWN_SPEEDS: [[f64; 6]; 3] =
    [[5.0, 5.0, 5.0, 5.0, 30.0, 30.0], [20.0, 20.0, 25.0, 30.0, 50.0, 50.0], [35.0, 35.0, 40.0, 50.0, 80.0, 80.0]];

const ENGINE_INERTIA: f64 = 0.021_991_488;
const WHEEL_INERTIA: f64 = 12.0941;
const FINAL_DRIVE: f64 = 3.23;
/// Miles per hour of a wheel of one foot radius that turns once per minute.
const MILES_PER_HOUR: f64 = 2.0 * std::f64::consts::PI * 60.0 / 5280.0;

/// What came of a drive.
pub(super) struct Transmission {
    /// The greatest engine speed, in rpm.
    pub(super) engine_speed: f64,
    /// The vehicle's speed at each step, in miles per hour.
    speeds: Vec<f64>,
}

impl Transmission {
    /// A drive of 30 s from a stand: throttle and brake as shares of 100 % and 325 ft·lb.
    pub(super) fn run(throttle: &[f64], brake: &[f64]) -> Self {
        let (mut engine, mut wheel, mut gear) = (1000.0_f64, 0.0_f64, 0);
        let (mut above, mut below) = (0, 0);
        let mut run = Transmission { engine_speed: engine, speeds: Vec::with_capacity(SEGMENTS * SEGMENT_STEPS) };
        for step in 0..SEGMENTS * SEGMENT_STEPS {
            let (throttle, brake) = (100.0 * throttle[step / SEGMENT_STEPS], 325.0 * brake[step / SEGMENT_STEPS]);
            let speed = wheel * MILES_PER_HOUR;
            if step.is_multiple_of(DECISION_STEPS) {
                let goes_up = gear < 3 && speed > interpolated(&UP_THROTTLES, &UP_SPEEDS[gear.min(2)], throttle);
                let goes_down =
                    gear > 0 && speed < interpolated(&DOWN_THROTTLES, &DOWN_SPEEDS[gear.saturating_sub(1)], throttle);
                (above, below) = (if goes_up { above + 1 } else { 0 }, if goes_down { below + 1 } else { 0 });
                if above > WAIT {
                    (gear, above) = (gear + 1, 0);
                } else if below > WAIT {
                    (gear, below) = (gear - 1, 0);
                }
            }
            let first = derivatives(engine, wheel, GEARS[gear], throttle, brake);
            let (ahead, wheel_ahead) = moved(engine, wheel, first);
            let second = derivatives(ahead, wheel_ahead, GEARS[gear], throttle, brake);
            (engine, wheel) = moved(engine, wheel, [0, 1].map(|k: usize| 0.5 * (first[k] + second[k])));
            run.engine_speed = run.engine_speed.max(engine);
            run.speeds.push(wheel * MILES_PER_HOUR);
        }
        run
    }

    /// The greatest speed of the vehicle up to a time in seconds, in miles per hour.
    pub(super) fn vehicle_speed(&self, until: f64) -> f64 {
        let steps = (1u32..).zip(&self.speeds).take_while(|(step, _)| f64::from(*step) * STEP <= until + 0.5 * STEP);
        steps.map(|(_, &speed)| speed).fold(0.0, f64::max)
    }
}

fn moved(engine: f64, wheel: f64, [engine_by, wheel_by]: [f64; 2]) -> (f64, f64) {
    // Brakes stop a wheel and do not turn it back.
    ((engine + STEP * engine_by).clamp(600.0, 6000.0), (wheel + STEP * wheel_by).max(0.0))
}

/// How fast engine and wheel speed up, in rpm per second.
fn derivatives(engine: f64, wheel: f64, ratio: f64, throttle: f64, brake: f64) -> [f64; 2] {
    let slip = ratio * FINAL_DRIVE * wheel / engine;
    let at = engine / interpolated(&SPEED_RATIOS, &CAPACITIES, slip);
    let impeller = at * at;
    let turbine = impeller * interpolated(&SPEED_RATIOS, &TORQUE_RATIOS, slip);
    let by_throttle = TORQUES.map(|row| interpolated(&ENGINE_SPEEDS, &row, engine));
    let torque = interpolated(&THROTTLES, &by_throttle, throttle);
    let speed = wheel * MILES_PER_HOUR;
    let load = if wheel > 0.0 { 40.0 + 0.02 * speed * speed + brake } else { 0.0 };
    [(torque - impeller) / ENGINE_INERTIA, (FINAL_DRIVE * ratio * turbine - load) / WHEEL_INERTIA]
}

/// Linear interpolation in a table, and extrapolation beyond its ends.
fn interpolated(places: &[f64], values: &[f64], at: f64) -> f64 {
    let next = places.partition_point(|&place| place < at).clamp(1, places.len() - 1);
    let share = (at - places[next - 1]) / (places[next] - places[next - 1]);
    values[next - 1] + share * (values[next] - values[next - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_throttle_reaches_the_published_speeds() {
        let run = Transmission::run(&[1.0; SEGMENTS], &[0.0; SEGMENTS]);
        // The usual first requirement, below 120 mph for 20 s, is known to be broken by full throttle, and narrowly.
        assert!((118.0..128.0).contains(&run.vehicle_speed(20.0)), "{}", run.vehicle_speed(20.0));
        // So is the second, below 4750 rpm for 10 s.
        assert!((4700.0..5200.0).contains(&run.engine_speed), "{}", run.engine_speed);
    }

    #[test]
    fn brakes_stop_it_and_an_idling_engine_creeps() {
        let stopped = Transmission::run(&[0.0; SEGMENTS], &[1.0; SEGMENTS]);
        assert!(stopped.vehicle_speed(30.0) < 1.0);
        let idling = Transmission::run(&[0.1; SEGMENTS], &[0.0; SEGMENTS]);
        assert!((5.0..60.0).contains(&idling.vehicle_speed(30.0)), "{}", idling.vehicle_speed(30.0));
        assert!(idling.engine_speed < 3000.0);
    }
}
