//! The poses in the signals of a recording.

use std::collections::{BTreeMap, BTreeSet};

use sesame_dsl::units::{Unit, convert};
use sesame_plan::{CampaignPlan, Topic, Type};
use sesame_runtime::trace::Signal;
use sesame_safety::trace::{Trace, TraceError};
use sesame_safety::{Rotation, Vector};

/// The signals of a recording by name, such as `robots/east/pose.position.x`.
pub(super) type Signals = BTreeMap<String, Signal>;

/// Where messages have a position, and the orientation that goes with it: of points and messages of the space, and of
/// poses, odometry and transforms of ROS.
const LAYOUTS: [[&str; 2]; 6] = [
    ["", ".orientation"],
    [".position", ".orientation"],
    [".pose.position", ".pose.orientation"],
    [".pose.pose.position", ".pose.pose.orientation"],
    [".translation", ".rotation"],
    [".transform.translation", ".transform.rotation"],
];

/// A pause between two samples that is longer than so many usual ones is told.
const LONG_PAUSE: f64 = 5.0;

/// Why a recording has no such pose.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum PoseError {
    /// No topic of the space has this name, or its messages have no position.
    #[error("there is no pose `{name}`; {}. Poses are in messages with x, y and z on topics of the space", known(.there))]
    Unknown {
        /// What was asked for.
        name: String,
        /// The poses that there are.
        there: Vec<String>,
    },
    /// Coordinates were recorded for some times only.
    #[error("pose `{name}` has numbers that are not finite, so it is not known where the body was")]
    NotFinite {
        /// Its name.
        name: String,
    },
    /// Coordinates are not lengths.
    #[error("pose `{name}` is in {unit}, which is not a unit of length")]
    Unit {
        /// Its name.
        name: String,
        /// The unit.
        unit: String,
    },
    /// Its samples are not motion.
    #[error("pose `{name}`: {error}")]
    Trace {
        /// Its name.
        name: String,
        /// What is wrong.
        error: TraceError,
    },
}

fn known(there: &[String]) -> String {
    match there {
        [] => "the recording has none".to_owned(),
        some => format!("the recording has `{}`", some.join("`, `")),
    }
}

/// The motion of a pose, in metres and seconds since the start of the run.
///
/// A pose is named by its topic, perhaps with fields of its messages: its position is in the fields `x`, `y` and `z`,
/// or in a point, and its orientation, if there is one, in a quaternion with the fields `x`, `y`, `z` and `w`, or in
/// the fields `qx`, `qy`, `qz` and `qw` beside a position. Coordinates without a unit are metres.
pub(super) fn pose(plan: &CampaignPlan, signals: &Signals, name: &str) -> Result<Trace, PoseError> {
    let found = LAYOUTS.iter().find_map(|[position, orientation]| {
        let position = format!("{name}{position}");
        let coordinates = components(signals, &position, ["x", "y", "z"])?;
        Some((position, format!("{name}{orientation}"), coordinates))
    });
    let Some((position, orientation, [x, y, z])) = found else {
        return Err(PoseError::Unknown { name: name.to_owned(), there: poses(signals) });
    };
    let not_finite = || PoseError::NotFinite { name: name.to_owned() };
    if x.times != y.times || x.times != z.times {
        return Err(not_finite());
    }
    let metres = to_metres(plan, &position)?;
    let positions = (0..x.times.len()).map(|at| Vector::new(x.values[at], y.values[at], z.values[at]));
    let positions = positions.map(|position| Vector::from_array(position.to_array().map(&metres))).collect();
    let quaternion = components(signals, &orientation, ["x", "y", "z", "w"])
        .or_else(|| components(signals, &position, ["qx", "qy", "qz", "qw"]))
        .or_else(|| components(signals, name, ["qx", "qy", "qz", "qw"]));
    let orientations = match quaternion {
        None => None,
        Some(parts) if parts.iter().any(|part| part.times != x.times) => return Err(not_finite()),
        Some([qx, qy, qz, qw]) => {
            let rotation = |at: usize| Rotation::from_xyzw(qx.values[at], qy.values[at], qz.values[at], qw.values[at]);
            Some((0..x.times.len()).map(rotation).collect())
        }
    };
    Trace::new(x.times.clone(), positions, orientations)
        .map_err(|error| PoseError::Trace { name: name.to_owned(), error })
}

/// The longest time between two samples, with its begin, if it is much longer than others: how the body moved meanwhile
/// is a guess.
pub(super) fn long_pause(trace: &Trace) -> Option<(f64, f64)> {
    let mut pauses: Vec<(f64, f64)> = trace.times().windows(2).map(|pair| (pair[1] - pair[0], pair[0])).collect();
    pauses.sort_by(|one, other| one.0.total_cmp(&other.0));
    let usual = pauses.get(pauses.len() / 2)?.0;
    pauses.last().filter(|(pause, _)| *pause > LONG_PAUSE * usual).copied()
}

/// The signals of these fields, if all are there.
fn components<'a, const N: usize>(signals: &'a Signals, of: &str, fields: [&str; N]) -> Option<[&'a Signal; N]> {
    let found: Option<Vec<&Signal>> = fields.iter().map(|field| signals.get(&format!("{of}.{field}"))).collect();
    found?.try_into().ok()
}

/// What has a position, by the name that is shortest.
fn poses(signals: &Signals) -> Vec<String> {
    let positions = signals.keys().filter_map(|name| name.strip_suffix(".x"));
    let positions = positions.filter(|name| components(signals, name, ["x", "y", "z"]).is_some());
    // A quaternion has an x, too.
    let positions = positions.filter(|name| !signals.contains_key(&format!("{name}.w")));
    let shortest = |name: &str| {
        let mut layouts = LAYOUTS.iter().rev();
        layouts.find_map(|[position, _]| name.strip_suffix(position)).unwrap_or(name).to_owned()
    };
    let names: BTreeSet<String> = positions.map(shortest).collect();
    names.into_iter().collect()
}

/// How coordinates of a position become metres.
fn to_metres(plan: &CampaignPlan, position: &str) -> Result<impl Fn(f64) -> f64 + use<>, PoseError> {
    let metre = Unit::parse("m").expect("the metre is a unit");
    let symbol = unit(plan, position);
    let unit = match &symbol {
        None => metre.clone(),
        Some(symbol) => Unit::parse(symbol)
            .ok()
            .filter(|unit| unit.dimension() == metre.dimension())
            .ok_or_else(|| PoseError::Unit { name: position.to_owned(), unit: symbol.clone() })?,
    };
    Ok(move |value| convert(value, Some(&unit), Some(&metre)))
}

/// The unit of a position with these fields `x`, `y` and `z`, where the space declares one.
fn unit(plan: &CampaignPlan, position: &str) -> Option<String> {
    let (topic, fields) = topic_of(plan, position)?;
    let mut ty = &topic.ty;
    for field in fields.split('.').filter(|field| !field.is_empty()) {
        let (field, element) = field.split_once('[').map_or((field, None), |(field, element)| (field, Some(element)));
        if !field.is_empty() {
            ty = field_of(plan, ty, field)?;
        }
        for _ in element.into_iter().flat_map(|element| element.split('[')) {
            let Type::List { of } = ty else { return None };
            ty = of;
        }
    }
    let ty = if let Type::Message { .. } = ty { field_of(plan, ty, "x")? } else { ty };
    match ty {
        Type::Point { unit } | Type::Real { unit } | Type::Int { unit } => unit.clone(),
        _ => None,
    }
}

fn field_of<'a>(plan: &'a CampaignPlan, ty: &Type, field: &str) -> Option<&'a Type> {
    let &Type::Message { id } = ty else { return None };
    plan.message(id).fields.iter().find(|known| known.name == field).map(|known| &known.ty)
}

/// The topic on which a signal or pose of this name is, and what follows the topic's path in the name. Of topics of
/// which one continues the path of another, it is the one with the longest path.
pub(super) fn topic_of<'a, 'n>(plan: &'a CampaignPlan, name: &'n str) -> Option<(&'a Topic, &'n str)> {
    let rest = |path: &str| name.strip_prefix(path).filter(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
    let topics = plan.topics.iter().flat_map(|topic| topic.paths.iter().map(move |path| (topic, path)));
    let found = topics.filter_map(|(topic, path)| Some((topic, rest(path)?)));
    found.min_by_key(|(_, rest)| rest.len())
}

#[cfg(test)]
mod tests {
    use sesame_plan::MessageId;
    use sesame_plan::testing::{field, message, minimal, topic};

    use super::*;

    fn signals(named: &[(&str, &[f64])]) -> Signals {
        let signal = |values: &[f64]| Signal {
            times: (0..values.len()).map(|second| second as f64).collect(),
            values: values.to_vec(),
        };
        named.iter().map(|(name, values)| ((*name).to_owned(), signal(values))).collect()
    }

    fn plan() -> CampaignPlan {
        let millimetres = Type::Point { unit: Some("mm".to_owned()) };
        let degrees = Type::Real { unit: Some("deg".to_owned()) };
        let pose = message("Pose", vec![field("position", millimetres.clone())]);
        let joint = message("Joint", ["x", "y", "z"].map(|axis| field(axis, degrees.clone())).to_vec());
        let topics = [
            ("arm", Type::Message { id: MessageId(0) }),
            ("joint", Type::Message { id: MessageId(1) }),
            ("point", millimetres),
            ("odometry", Type::Real { unit: None }),
        ];
        CampaignPlan {
            messages: vec![pose, joint],
            topics: topics.map(|(name, ty)| topic(name, &[name], ty)).to_vec(),
            ..minimal()
        }
    }

    #[test]
    fn points_and_messages_are_poses_in_the_unit_that_is_declared() {
        let all = signals(&[
            ("arm.position.x", &[1000.0, 2000.0]),
            ("arm.position.y", &[0.0, 500.0]),
            ("arm.position.z", &[0.0, 0.0]),
            ("point.x", &[250.0]),
            ("point.y", &[0.0]),
            ("point.z", &[0.0]),
        ]);
        for name in ["arm", "arm.position"] {
            let trace = pose(&plan(), &all, name).unwrap();
            assert_eq!(trace.positions(), [Vector::new(1.0, 0.0, 0.0), Vector::new(2.0, 0.5, 0.0)]);
            assert_eq!((trace.times(), trace.orientations()), (&[0.0, 1.0][..], None));
        }
        assert_eq!(pose(&plan(), &all, "point").unwrap().positions(), [Vector::new(0.25, 0.0, 0.0)]);
    }

    #[test]
    fn odometry_has_its_pose_two_messages_inside_and_is_in_metres() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let of = |field: &str| format!("odometry.pose.pose.{field}");
        let values = [
            ("position.x", 1.0),
            ("position.y", 2.0),
            ("position.z", 3.0),
            ("orientation.x", 0.0),
            ("orientation.y", 0.0),
            ("orientation.z", half),
            ("orientation.w", half),
        ];
        let all: Signals = values
            .iter()
            .map(|&(field, value)| (of(field), Signal { times: vec![0.5], values: vec![value] }))
            .collect();
        let trace = pose(&plan(), &all, "odometry").unwrap();
        assert_eq!(trace.positions(), [Vector::new(1.0, 2.0, 3.0)]);
        let quarter = Rotation::from_rotation_z(std::f64::consts::FRAC_PI_2);
        assert!(trace.orientations().unwrap()[0].abs_diff_eq(quarter, 1e-12));
    }

    #[test]
    fn what_is_no_pose_is_told_with_what_there_is() {
        let all = signals(&[
            ("arm.position.x", &[1.0, 2.0]),
            ("arm.position.y", &[1.0, 2.0]),
            ("arm.position.z", &[1.0]),
            ("joint.x", &[0.0]),
            ("joint.y", &[0.0]),
            ("joint.z", &[0.0]),
        ]);
        let refused = |name: &str| pose(&plan(), &all, name).unwrap_err().to_string();
        assert_eq!(
            refused("gripper"),
            "there is no pose `gripper`; the recording has `arm`, `joint`. Poses are in messages with x, y and z on \
             topics of the space"
        );
        assert_eq!(refused("arm"), "pose `arm` has numbers that are not finite, so it is not known where the body was");
        assert_eq!(refused("joint"), "pose `joint` is in deg, which is not a unit of length");
    }

    #[test]
    fn a_pause_is_long_if_it_is_longer_than_the_others() {
        let trace = |times: &[f64]| Trace::new(times.to_vec(), vec![Vector::ZERO; times.len()], None).unwrap();
        assert_eq!(long_pause(&trace(&[0.0, 1.0, 2.0, 3.0])), None);
        assert_eq!(long_pause(&trace(&[0.0, 1.0, 2.0, 12.0, 13.0])), Some((10.0, 2.0)));
        assert_eq!(long_pause(&trace(&[0.0])), None);
    }
}
