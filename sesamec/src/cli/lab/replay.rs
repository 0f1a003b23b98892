//! The shapes of a lab in recordings: when they touch, how near they come, and whether that may be concluded from
//! recordings in which something was missing.
//!
//! *Virtual objects* and *multi-robot position integration* [SESAME 2023, Section 4.3]. Nothing is read or written
//! here.

use std::collections::BTreeSet;

use sesame_plan::{CampaignPlan, LabShape, NodeId, ShapeForm, ShapePlace, TopicId, TopicMembers};
use sesame_safety::Vector;
use sesame_safety::body::{Body, BodyError, Placement, Shape, ShapeError};
use sesame_safety::contact::{ContactError, Contacts, TOLERANCE, contacts};
use sesame_safety::coupling::{Coupling, Missing, Tolerance, by_messages, by_motion};
use sesame_safety::trace::{Trace, TraceError};

use super::poses::{PoseError, Signals, pose, topic_of};

/// A shape of the lab, as it was in a recording.
#[derive(Debug, Clone)]
pub(super) struct Recorded {
    /// Its name in the lab.
    pub(super) name: String,
    /// The shape, without its margin, and where it was.
    pub(super) body: Body,
    /// By how much it is expanded, in metres.
    pub(super) margin: f64,
    /// The pose that it moves with, and from which recording it is; `None` for one that does not move.
    pub(super) moves: Option<(String, usize)>,
}

impl Recorded {
    /// Its motion; `None` for a shape that does not move.
    pub(super) fn trace(&self) -> Option<&Trace> {
        match self.body.placement() {
            Placement::Moving(trace) => Some(trace),
            Placement::Fixed(_) => None,
        }
    }
}

/// Two shapes of the lab.
#[derive(Debug, Clone)]
pub(super) struct Meeting {
    /// One of them, which moves.
    pub(super) one: String,
    /// The other.
    pub(super) other: String,
    /// When they touch, and how near they come, without their margins.
    pub(super) contacts: Contacts,
    /// When they first touch with their margins, in seconds; `None` if they do not.
    pub(super) margins_touch: Option<f64>,
    /// Whether the motions depend on each other; `None` if both were there in one recording.
    pub(super) coupling: Option<Coupling>,
}

/// Why shapes cannot be found in a recording.
#[derive(Debug, thiserror::Error)]
pub(super) enum ReplayError {
    /// A shape cannot be where it is said to be.
    #[error("shape `{name}`: {error}")]
    Shape {
        /// The shape.
        name: String,
        /// What is wrong.
        error: ShapeProblem,
    },
    /// Two shapes cannot be compared.
    #[error("shapes `{one}` and `{other}`: {error}")]
    Pair {
        /// One of them.
        one: String,
        /// The other.
        other: String,
        /// What is wrong.
        error: ContactError,
    },
}

/// What is wrong with a shape.
#[derive(Debug, thiserror::Error)]
pub(super) enum ShapeProblem {
    /// Its lengths.
    #[error(transparent)]
    Lengths(#[from] ShapeError),
    /// Its place.
    #[error(transparent)]
    Place(#[from] BodyError),
    /// Its pose.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// Its times, after they were shifted.
    #[error(transparent)]
    Times(#[from] TraceError),
}

/// A shape in a recording, whose times are shifted by this many seconds. A shape that does not move needs no recording.
pub(super) fn recorded(
    plan: &CampaignPlan,
    shape: &LabShape,
    (recording, signals, shift): (usize, &Signals, f64),
) -> Result<Recorded, ReplayError> {
    let body = || -> Result<Body, ShapeProblem> {
        let form = match shape.form {
            ShapeForm::Sphere { radius } => Shape::sphere(radius)?,
            ShapeForm::Box { edges } => Shape::cuboid(edges)?,
        };
        Ok(match &shape.place {
            ShapePlace::Fixed { centre } => Body::fixed_at(form, Vector::from_array(*centre))?,
            ShapePlace::Pose { pose: name } => {
                let trace = pose(plan, signals, name)?;
                Body::moving(form, if shift == 0.0 { trace } else { trace.shifted(shift)? })?
            }
        })
    };
    let wrong = |error| ReplayError::Shape { name: shape.name.clone(), error };
    let moves = match &shape.place {
        ShapePlace::Fixed { .. } => None,
        ShapePlace::Pose { pose } => Some((pose.clone(), recording)),
    };
    Ok(Recorded { name: shape.name.clone(), body: body().map_err(wrong)?, margin: shape.expand, moves })
}

/// All pairs of shapes of which one moves, in the order of the lab; of two that move with one pose nothing is said, as
/// they are parts of one thing. The one that moves comes first. Couplings are left open.
pub(super) fn meetings(shapes: &[Recorded]) -> Result<Vec<Meeting>, ReplayError> {
    let mut found = Vec::new();
    for (at, first) in shapes.iter().enumerate() {
        for second in &shapes[at + 1..] {
            if first.moves == second.moves {
                continue;
            }
            let (one, other) = if first.moves.is_some() { (first, second) } else { (second, first) };
            found.push(meeting(one, other)?);
        }
    }
    Ok(found)
}

fn meeting(one: &Recorded, other: &Recorded) -> Result<Meeting, ReplayError> {
    let wrong = |error| ReplayError::Pair { one: one.name.clone(), other: other.name.clone(), error };
    let found = contacts(&one.body, &other.body, TOLERANCE).map_err(wrong)?;
    let margins_touch = if one.margin == 0.0 && other.margin == 0.0 {
        found.first()
    } else {
        let expanded = |recorded: &Recorded| {
            let body = recorded.body.clone().expanded(recorded.margin);
            body.map_err(|error| ReplayError::Shape { name: recorded.name.clone(), error: error.into() })
        };
        contacts(&expanded(one)?, &expanded(other)?, TOLERANCE).map_err(wrong)?.first()
    };
    Ok(Meeting { one: one.name.clone(), other: other.name.clone(), contacts: found, margins_touch, coupling: None })
}

/// Whether what publishes one of two poses reads, perhaps through others, messages of what publishes the other one;
/// `None` if the space does not say who publishes them, or one node publishes both.
pub(super) fn reads_the_other(plan: &CampaignPlan, one: &str, other: &str) -> Option<bool> {
    let publishers = |pose: &str| -> Option<BTreeSet<usize>> {
        let (topic, behind) = topic_of(plan, pose)?;
        let path = &pose[..pose.len() - behind.len()];
        let member = topic.paths.iter().position(|of_topic| of_topic == path)?;
        let mut topics = (0u32..).map(TopicId).zip(&plan.topics);
        let (id, _) = topics.find(|(_, of_plan)| std::ptr::eq(*of_plan, topic))?;
        let nodes = plan.nodes.iter().enumerate().filter(|(_, node)| node.publishes_on(id, member));
        let nodes: BTreeSet<usize> = nodes.map(|(at, _)| at).collect();
        (!nodes.is_empty()).then_some(nodes)
    };
    let (one, other) = (publishers(one)?, publishers(other)?);
    // A node that publishes both, such as a tracking system, is none of the robots.
    if !one.is_disjoint(&other) {
        return None;
    }
    Some(!heard_by(plan, &one).is_disjoint(&other) || !heard_by(plan, &other).is_disjoint(&one))
}

/// The nodes whose messages reach one of these, directly or through others; not these themselves.
fn heard_by(plan: &CampaignPlan, nodes: &BTreeSet<usize>) -> BTreeSet<usize> {
    let mut reached = nodes.clone();
    let mut open: Vec<usize> = nodes.iter().copied().collect();
    while let Some(at) = open.pop() {
        let reads = &plan.node(NodeId(u32::try_from(at).expect("a plan has fewer nodes"))).subscribes;
        for (from, node) in plan.nodes.iter().enumerate() {
            let is_read = |published: &TopicMembers| reads.iter().any(|read| read.meets(published));
            if node.publishes.iter().any(is_read) && reached.insert(from) {
                open.push(from);
            }
        }
    }
    &reached - nodes
}

/// What may differ between a motion alone and one together, in metres and radians.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alike {
    /// Between positions.
    pub(super) position: f64,
    /// Between orientations.
    pub(super) angle: f64,
}

/// Judges whether the contacts of two shapes may be concluded from recordings in which one of them was missing.
///
/// `together` has the shapes as they were in a run with both: if there is such a run, motions are compared. Otherwise
/// what the robots read decides of two that were recorded apart. Of an object that does not move nothing is known then.
pub(super) fn judged(
    plan: &CampaignPlan,
    meeting: Meeting,
    alone: &[Recorded],
    together: Option<&[Recorded]>,
    alike: Alike,
) -> Result<Meeting, ReplayError> {
    fn named<'a>(shapes: &'a [Recorded], name: &str) -> &'a Recorded {
        shapes.iter().find(|shape| shape.name == name).expect("a pair is one of shapes that were recorded")
    }
    let pair = [named(alone, &meeting.one), named(alone, &meeting.other)];
    let coupling = match (together, &pair.map(|shape| shape.moves.as_ref())) {
        (_, [Some((_, one)), Some((_, other))]) if one == other => None,
        (Some(together), _) => {
            let both = [named(together, &meeting.one), named(together, &meeting.other)];
            let until = self::meeting(both[0], both[1])?.contacts.first().unwrap_or(f64::MAX);
            let judged = pair.iter().zip(both).filter_map(|(alone, both)| {
                let (alone, both) = (alone.trace()?, both.trace()?);
                let time = step(alone).max(step(both));
                let tolerance = Tolerance { position: alike.position, angle: alike.angle, time };
                Some(by_motion(alone, both, until.min(both.end()), tolerance))
            });
            judged.reduce(worse)
        }
        (None, [Some((one, _)), Some((other, _))]) => {
            Some(reads_the_other(plan, one, other).map_or(Coupling::Unknown(Missing::Run), by_messages))
        }
        (None, _) => Some(Coupling::Unknown(Missing::Run)),
    };
    Ok(Meeting { coupling, ..meeting })
}

/// The longest time between two samples, in seconds.
fn step(trace: &Trace) -> f64 {
    trace.times().windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
}

/// The judgement of two that forbids more.
fn worse(one: Coupling, other: Coupling) -> Coupling {
    let rank = |coupling: &Coupling| match coupling {
        Coupling::Coupled(_) => 0,
        Coupling::Unknown(_) => 1,
        Coupling::Independent(_) => 2,
    };
    if rank(&other) < rank(&one) { other } else { one }
}
