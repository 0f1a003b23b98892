//! Whether a recording that was made without another robot or an object says anything about a run with it.
//!
//! Virtual objects and multi-robot position integration ([`crate::contact`]) hold only while the recorded motion does
//! not depend on what was removed. A robot that sees the other one and waits moves differently when the other is
//! parked, and the contact that is found in its recording is none that would occur. There are two kinds of evidence:
//! what the robot reads, and a run of both from which its motion can be compared.

use crate::contact::Interval;
use crate::trace::{Trace, angle};

/// What may differ between two recordings of one motion, as they are never quite equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Between positions, in metres.
    pub position: f64,
    /// Between orientations, in radians.
    pub angle: f64,
    /// What a recording may lack of the beginning or the end, in seconds: the time between two samples, as two
    /// recordings never have theirs at the same times.
    pub time: f64,
}

/// The greatest difference between two recordings of one motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// When they are compared, in seconds.
    pub compared: Interval,
    /// Between positions, in metres. This is exact: between samples of both, the difference of two linear motions has
    /// its greatest length at one end.
    pub position: f64,
    /// When that is, in seconds.
    pub position_time: f64,
    /// Between orientations at the samples of both recordings, in radians in `0..=π`; 0 if one of them has none.
    pub angle: f64,
    /// When that is, in seconds.
    pub angle_time: f64,
    /// The first sample of either recording at which a tolerance is exceeded, in seconds.
    pub exceeded: Option<f64>,
}

/// Whether the method holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Coupling {
    /// The motion does not depend on what was removed, as far as the evidence goes.
    Independent(Evidence),
    /// It does: the method does not hold.
    Coupled(Evidence),
    /// Nobody knows.
    Unknown(Missing),
}

/// What a judgement rests on.
#[derive(Debug, Clone, PartialEq)]
pub enum Evidence {
    /// Whether the robot reads messages that depend on what was removed.
    Messages,
    /// How much a recording without it differs from one with it.
    Motion(Deviation),
}

/// Why a motion cannot be judged.
#[derive(Debug, Clone, PartialEq)]
pub enum Missing {
    /// There is no recording of a run in which what was removed was there.
    Run,
    /// The recordings have no instant in common up to the end of the comparison.
    CommonTime,
    /// The recordings agree as long as both last, but one begins late or ends before the comparison does.
    Part {
        /// What both cover, without a difference.
        agreed: Deviation,
        /// What had to be covered.
        needed: Interval,
    },
}

impl Coupling {
    /// Whether results of virtual objects and of multi-robot position integration may be used.
    pub fn method_holds(&self) -> bool {
        matches!(self, Coupling::Independent(_))
    }

    /// The judgement in a plain sentence.
    pub fn sentence(&self) -> String {
        match self {
            Coupling::Independent(Evidence::Messages) => {
                "The motion is independent: no message that the robot reads depends on what was removed.".to_owned()
            }
            Coupling::Independent(Evidence::Motion(deviation)) => format!(
                "The motion is independent: with and without the other, positions differ by at most {:.4} m and \
                 orientations by at most {:.4} rad from {:.3} s to {:.3} s.",
                deviation.position, deviation.angle, deviation.compared.from, deviation.compared.to
            ),
            Coupling::Coupled(Evidence::Messages) => {
                "The motion is coupled: the robot reads messages that depend on what was removed. The method does not \
                 hold."
                    .to_owned()
            }
            Coupling::Coupled(Evidence::Motion(deviation)) => format!(
                "The motion is coupled: with and without the other, positions differ by up to {:.4} m (at {:.3} s) and \
                 orientations by up to {:.4} rad (at {:.3} s), which is more than the tolerance{}. The method does not \
                 hold.",
                deviation.position,
                deviation.position_time,
                deviation.angle,
                deviation.angle_time,
                deviation.exceeded.map_or_else(String::new, |time| format!(" from {time:.3} s"))
            ),
            Coupling::Unknown(Missing::Run) => {
                "It is unknown whether the motion is coupled: there is no recording of a run in which what was removed \
                 was there."
                    .to_owned()
            }
            Coupling::Unknown(Missing::CommonTime) => {
                "It is unknown whether the motion is coupled: the recordings have no time in common before the end of \
                 the comparison."
                    .to_owned()
            }
            Coupling::Unknown(Missing::Part { agreed, needed }) => format!(
                "It is unknown whether the motion is coupled: the recordings agree from {:.3} s to {:.3} s, and must be \
                 compared from {:.3} s to {:.3} s.",
                agreed.compared.from, agreed.compared.to, needed.from, needed.to
            ),
        }
    }
}

/// Judges by what a robot reads: whether any message that reaches it depends on what was removed.
pub fn by_messages(depends: bool) -> Coupling {
    if depends { Coupling::Coupled(Evidence::Messages) } else { Coupling::Independent(Evidence::Messages) }
}

/// Judges by two recordings of one robot in the same times: `alone`, with the other parked or the object removed, and
/// `together`, from a run with both.
///
/// They are compared from the start of `together` up to `until`: the first contact in that run, after which bodies move
/// differently in any case, or its end. A difference within the tolerance is none. Two recordings that agree, but do
/// not cover all of that, are not proof.
pub fn by_motion(alone: &Trace, together: &Trace, until: f64, tolerance: Tolerance) -> Coupling {
    let needed = Interval { from: together.start(), to: until.max(together.start()) };
    let common = Interval { from: alone.start().max(needed.from), to: alone.end().min(together.end()).min(needed.to) };
    let Some(deviation) = deviation(alone, together, common, tolerance) else {
        return Coupling::Unknown(Missing::CommonTime);
    };
    if deviation.exceeded.is_some() {
        return Coupling::Coupled(Evidence::Motion(deviation));
    }
    if common.from - needed.from > tolerance.time || needed.to - common.to > tolerance.time {
        return Coupling::Unknown(Missing::Part { agreed: deviation, needed });
    }
    Coupling::Independent(Evidence::Motion(deviation))
}

/// How much two recordings differ in a time in which both are known; `None` if there is no such time.
fn deviation(one: &Trace, other: &Trace, within: Interval, tolerance: Tolerance) -> Option<Deviation> {
    let inner = one.times().iter().chain(other.times()).copied().filter(|&time| within.from < time && time < within.to);
    let mut times: Vec<f64> = inner.chain([within.from, within.to]).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let both_turn = one.orientations().is_some() && other.orientations().is_some();
    let mut deviation = Deviation {
        compared: within,
        position: 0.0,
        position_time: within.from,
        angle: 0.0,
        angle_time: within.from,
        exceeded: None,
    };
    for time in times {
        let (one, other) = (one.at(time)?, other.at(time)?);
        let position = (one.translation - other.translation).length();
        let angle = if both_turn { angle(&one.rotation, &other.rotation) } else { 0.0 };
        if position > deviation.position {
            (deviation.position, deviation.position_time) = (position, time);
        }
        if angle > deviation.angle {
            (deviation.angle, deviation.angle_time) = (angle, time);
        }
        // So that a tolerance of NaN permits nothing.
        let within_tolerance = position <= tolerance.position && angle <= tolerance.angle;
        if !within_tolerance && deviation.exceeded.is_none() {
            deviation.exceeded = Some(time);
        }
    }
    Some(deviation)
}

#[cfg(test)]
mod tests {
    use parry3d_f64::math::{Rotation, Vector};

    use super::*;

    const TOLERANCE: Tolerance = Tolerance { position: 0.01, angle: 0.02, time: 0.1 };

    fn along_x(samples: &[(f64, f64)]) -> Trace {
        let positions = samples.iter().map(|&(_, x)| Vector::new(x, 0.0, 0.0)).collect();
        Trace::new(samples.iter().map(|&(time, _)| time).collect(), positions, None).unwrap()
    }

    #[test]
    fn a_robot_that_moves_alike_with_and_without_the_other_is_independent() {
        let alone = along_x(&[(0.0, 0.0), (4.0, 4.0)]);
        let together = along_x(&[(0.0, 0.0), (1.0, 1.005), (3.0, 3.0)]);
        let coupling = by_motion(&alone, &together, 3.0, TOLERANCE);
        assert!(coupling.method_holds());
        assert_eq!(
            coupling.sentence(),
            "The motion is independent: with and without the other, positions differ by at most 0.0050 m and \
             orientations by at most 0.0000 rad from 0.000 s to 3.000 s."
        );
    }

    #[test]
    fn a_robot_that_waits_for_the_other_is_coupled() {
        let alone = along_x(&[(0.0, 0.0), (4.0, 4.0)]);
        let together = along_x(&[(0.0, 0.0), (1.0, 1.0), (3.0, 1.0), (4.0, 2.0)]);
        let coupling = by_motion(&alone, &together, 4.0, TOLERANCE);
        let Coupling::Coupled(Evidence::Motion(deviation)) = &coupling else { panic!("{coupling:?}") };
        assert_eq!((deviation.position, deviation.position_time, deviation.exceeded), (2.0, 3.0, Some(3.0)));
        assert_eq!(
            coupling.sentence(),
            "The motion is coupled: with and without the other, positions differ by up to 2.0000 m (at 3.000 s) and \
             orientations by up to 0.0000 rad (at 0.000 s), which is more than the tolerance from 3.000 s. The method \
             does not hold."
        );
    }

    #[test]
    fn what_happens_after_the_first_contact_does_not_count() {
        let alone = along_x(&[(0.0, 0.0), (4.0, 4.0)]);
        let together = along_x(&[(0.0, 0.0), (2.0, 2.0), (4.0, 2.0)]);
        assert!(by_motion(&alone, &together, 2.0, TOLERANCE).method_holds());
        assert!(!by_motion(&alone, &together, 4.0, TOLERANCE).method_holds());
    }

    #[test]
    fn a_turn_alone_is_a_difference() {
        let turned = |angle| {
            let orientations = vec![Rotation::IDENTITY, Rotation::from_rotation_z(angle)];
            Trace::new(vec![0.0, 1.0], vec![Vector::ZERO; 2], Some(orientations)).unwrap()
        };
        assert!(by_motion(&turned(0.0), &turned(0.01), 1.0, TOLERANCE).method_holds());
        let coupling = by_motion(&turned(0.0), &turned(0.5), 1.0, TOLERANCE);
        let Coupling::Coupled(Evidence::Motion(deviation)) = coupling else { panic!("{coupling:?}") };
        assert!((deviation.angle - 0.5).abs() < 1e-12);
        assert_eq!(deviation.angle_time, 1.0);
    }

    #[test]
    fn recordings_that_do_not_cover_the_run_prove_nothing() {
        let alone = along_x(&[(0.0, 0.0), (2.0, 2.0)]);
        let together = along_x(&[(0.0, 0.0), (4.0, 4.0)]);
        let part = by_motion(&alone, &together, 3.0, TOLERANCE);
        assert_eq!(
            part.sentence(),
            "It is unknown whether the motion is coupled: the recordings agree from 0.000 s to 2.000 s, and must be \
             compared from 0.000 s to 3.000 s."
        );
        assert!(!part.method_holds());
        assert!(by_motion(&alone, &together, 2.05, TOLERANCE).method_holds(), "the last sample is missing");
        let later = along_x(&[(5.0, 0.0), (6.0, 2.0)]);
        assert_eq!(by_motion(&later, &together, 3.0, TOLERANCE), Coupling::Unknown(Missing::CommonTime));
    }

    #[test]
    fn a_robot_that_reads_the_other_is_coupled() {
        assert!(by_messages(false).method_holds());
        assert_eq!(by_messages(true), Coupling::Coupled(Evidence::Messages));
        assert!(by_messages(true).sentence().ends_with("The method does not hold."));
    }
}
