//! Pose traces: where something was at recorded times.
//!
//! Between two samples the position moves on a straight line at constant speed, and the orientation turns the shorter
//! way at constant angular speed (spherical linear interpolation). Before the first sample and after the last one the
//! pose is unknown: nothing is extrapolated, as what was not recorded may have been a collision.

use parry3d_f64::math::{Pose, Rotation, Vector};

/// The greatest coordinate, in metres: enough for coordinates with their origin in the centre of the earth. Farther
/// away, rounding reaches the least tolerance of [`crate::contact`].
pub const FARTHEST: f64 = 1e7;

/// How much the length of a quaternion may differ from 1: what numbers with seven digits can be off.
const UNIT: f64 = 1e-6;

/// A recorded motion. It has at least one sample; its times rise strictly; all numbers are finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    times: Vec<f64>,
    positions: Vec<Vector>,
    orientations: Option<Vec<Rotation>>,
}

/// What is wrong with a recording. Samples are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// There is nothing in it.
    #[error("a pose trace needs at least one sample")]
    Empty,
    /// A list is longer than another.
    #[error("a pose trace has {times} times, but {values} {what}: each sample needs one of each")]
    Lengths {
        /// What there is more or less of.
        what: &'static str,
        /// The number of times.
        times: usize,
        /// The number of the other values.
        values: usize,
    },
    /// A time, position or orientation is NaN or infinite.
    #[error("the {what} of sample {sample} is not finite")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// Which sample.
        sample: usize,
    },
    /// Times must rise.
    #[error("sample {sample} is at {time} s, which is not after {before} s, the time of the sample before it")]
    NotRising {
        /// The later of the two samples.
        sample: usize,
        /// Its time.
        time: f64,
        /// The time before.
        before: f64,
    },
    /// A coordinate is greater than [`FARTHEST`].
    #[error("the position of sample {sample} is more than {FARTHEST} m from the origin: choose a nearer origin")]
    TooFar {
        /// Which sample.
        sample: usize,
    },
    /// An orientation is not a rotation.
    #[error("the orientation of sample {sample} is a quaternion of length {length}: it must have length 1")]
    NotUnit {
        /// Which sample.
        sample: usize,
        /// The quaternion's length.
        length: f64,
    },
}

impl Trace {
    /// A trace of these samples. Orientations are unit quaternions; a length that differs from 1 by at most 10⁻⁶ is
    /// corrected.
    pub fn new(
        times: Vec<f64>,
        positions: Vec<Vector>,
        orientations: Option<Vec<Rotation>>,
    ) -> Result<Trace, TraceError> {
        let lengths = |what, values| TraceError::Lengths { what, times: times.len(), values };
        if positions.len() != times.len() {
            return Err(lengths("positions", positions.len()));
        }
        if let Some(orientations) = &orientations
            && orientations.len() != times.len()
        {
            return Err(lengths("orientations", orientations.len()));
        }
        check_times(&times)?;
        for (at, position) in positions.iter().enumerate() {
            let sample = at + 1;
            if !position.is_finite() {
                return Err(TraceError::NotFinite { what: "position", sample });
            }
            if position.abs().max_element() > FARTHEST {
                return Err(TraceError::TooFar { sample });
            }
        }
        let orientations = orientations.map(|all| all.into_iter().enumerate().map(unit).collect()).transpose()?;
        Ok(Trace { times, positions, orientations })
    }

    /// The times of the samples, rising strictly.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The positions of the samples.
    pub fn positions(&self) -> &[Vector] {
        &self.positions
    }

    /// The orientations of the samples, if they were recorded.
    pub fn orientations(&self) -> Option<&[Rotation]> {
        self.orientations.as_deref()
    }

    /// The time of the first sample.
    pub fn start(&self) -> f64 {
        self.times[0]
    }

    /// The time of the last sample.
    pub fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// The pose at a time; `None` before the first sample and after the last one. Without recorded orientations it has
    /// the identity as orientation.
    pub fn at(&self, time: f64) -> Option<Pose> {
        if !(self.start()..=self.end()).contains(&time) {
            return None;
        }
        let after = self.times.partition_point(|&sample| sample <= time);
        let before = after - 1;
        if self.times[before] == time {
            return Some(self.sample(before));
        }
        let share = (time - self.times[before]) / (self.times[after] - self.times[before]);
        Some(between(&self.sample(before), &self.sample(after), share))
    }

    /// The same motion, this much later. Fails where the sum of times is not finite or cannot tell two samples apart.
    pub fn shifted(&self, seconds: f64) -> Result<Trace, TraceError> {
        let times: Vec<f64> = self.times.iter().map(|time| time + seconds).collect();
        check_times(&times)?;
        Ok(Trace { times, ..self.clone() })
    }

    /// A sample, by its number from 0.
    fn sample(&self, at: usize) -> Pose {
        let rotation = self.orientations.as_ref().map_or(Rotation::IDENTITY, |orientations| orientations[at]);
        Pose::from_parts(self.positions[at], rotation)
    }
}

/// The pose on the way from one to another, at a share in `0..=1` of the way.
pub(crate) fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let translation = from.translation + (to.translation - from.translation) * share;
    // The interpolation of nearly equal rotations is linear and shortens the quaternion a little.
    Pose::from_parts(translation, from.rotation.slerp(to.rotation, share).normalize())
}

/// The angle between two orientations, in `0..=π`. Near 0 the arc cosine of a scalar product would lose half of the
/// digits.
pub(crate) fn angle(one: &Rotation, other: &Rotation) -> f64 {
    let turn = one.inverse() * *other;
    2.0 * libm::atan2(turn.xyz().length(), turn.w.abs())
}

fn check_times(times: &[f64]) -> Result<(), TraceError> {
    if times.is_empty() {
        return Err(TraceError::Empty);
    }
    if let Some(at) = times.iter().position(|time| !time.is_finite()) {
        return Err(TraceError::NotFinite { what: "time", sample: at + 1 });
    }
    match times.windows(2).position(|pair| pair[1] <= pair[0]) {
        Some(at) => Err(TraceError::NotRising { sample: at + 2, time: times[at + 1], before: times[at] }),
        None => Ok(()),
    }
}

fn unit((at, rotation): (usize, Rotation)) -> Result<Rotation, TraceError> {
    let sample = at + 1;
    if !rotation.is_finite() {
        return Err(TraceError::NotFinite { what: "orientation", sample });
    }
    let length = rotation.length();
    if (length - 1.0).abs() > UNIT {
        return Err(TraceError::NotUnit { sample, length });
    }
    Ok(rotation.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_seconds() -> Trace {
        let turn = Rotation::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let positions = vec![Vector::ZERO, Vector::new(1.0, 0.0, 0.0), Vector::new(1.0, 4.0, 0.0)];
        Trace::new(vec![0.0, 1.0, 2.0], positions, Some(vec![Rotation::IDENTITY, Rotation::IDENTITY, turn])).unwrap()
    }

    fn fails(times: &[f64], positions: &[f64]) -> String {
        let positions = positions.iter().map(|&x| Vector::new(x, 0.0, 0.0)).collect();
        Trace::new(times.to_vec(), positions, None).unwrap_err().to_string()
    }

    #[test]
    fn between_samples_a_body_moves_straight_and_turns_evenly() {
        let pose = two_seconds().at(1.5).unwrap();
        assert_eq!(pose.translation, Vector::new(1.0, 2.0, 0.0));
        let eighth = Rotation::from_rotation_z(std::f64::consts::FRAC_PI_4);
        assert!(pose.rotation.abs_diff_eq(eighth, 1e-15));
    }

    #[test]
    fn samples_are_met_and_nothing_is_extrapolated() {
        let trace = two_seconds();
        assert_eq!(trace.at(0.0).unwrap().translation, Vector::ZERO);
        assert_eq!(trace.at(2.0).unwrap().translation, Vector::new(1.0, 4.0, 0.0));
        assert_eq!((trace.at(-1e-12), trace.at(2.000_000_1), trace.at(f64::NAN)), (None, None, None));
    }

    #[test]
    fn a_sample_alone_is_known_at_its_time() {
        let trace = Trace::new(vec![3.0], vec![Vector::ONE], None).unwrap();
        assert_eq!(trace.at(3.0).unwrap(), Pose::from_translation(Vector::ONE));
        assert_eq!(trace.at(3.1), None);
    }

    #[test]
    fn errors_name_the_sample() {
        assert_eq!(fails(&[], &[]), "a pose trace needs at least one sample");
        assert_eq!(
            fails(&[0.0, 1.0], &[0.0]),
            "a pose trace has 2 times, but 1 positions: each sample needs one of each"
        );
        assert_eq!(
            fails(&[0.0, 2.0, 2.0], &[0.0, 1.0, 2.0]),
            "sample 3 is at 2 s, which is not after 2 s, the time of the sample before it"
        );
        assert_eq!(fails(&[0.0, f64::NAN], &[0.0, 1.0]), "the time of sample 2 is not finite");
        assert_eq!(fails(&[0.0, 1.0], &[f64::INFINITY, 1.0]), "the position of sample 1 is not finite");
        assert_eq!(
            fails(&[0.0, 1.0], &[0.0, 2e7]),
            "the position of sample 2 is more than 10000000 m from the origin: choose a nearer origin"
        );
        let long = Trace::new(vec![0.0], vec![Vector::ZERO], Some(vec![Rotation::from_xyzw(0.0, 0.0, 0.0, 2.0)]));
        assert_eq!(
            long.unwrap_err().to_string(),
            "the orientation of sample 1 is a quaternion of length 2: it must have length 1"
        );
        let unknown = Rotation::from_xyzw(f64::NAN, 0.0, 0.0, 1.0);
        let unknown = Trace::new(vec![0.0], vec![Vector::ZERO], Some(vec![unknown]));
        assert_eq!(unknown.unwrap_err().to_string(), "the orientation of sample 1 is not finite");
    }

    #[test]
    fn a_shift_that_merges_samples_is_an_error() {
        let trace = Trace::new(vec![0.0, 1e-6], vec![Vector::ZERO; 2], None).unwrap();
        assert_eq!(trace.shifted(5.0).unwrap().times(), [5.0, 5.0 + 1e-6]);
        assert!(matches!(trace.shifted(1e15), Err(TraceError::NotRising { sample: 2, .. })));
        assert!(matches!(trace.shifted(f64::INFINITY), Err(TraceError::NotFinite { what: "time", sample: 1 })));
    }
}
