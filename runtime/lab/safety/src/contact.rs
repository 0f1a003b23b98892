//! When two bodies touch, and how near they come to each other.
//!
//! *Virtual objects* [SESAME 2023, Section 4.3]: what a robot might hit is not in the lab, and the robot's recorded
//! motion is compared with where it would have been; the one body moves and the other is fixed. *Multi-robot position
//! integration*: two robots are recorded in two runs, and their motions are laid over each other; both bodies move.
//!
//! Contact is detected continuously, with a bound on motion, and not only at samples or at instants of a grid: a test
//! that says that there was no contact must not have looked away. This is conservative advancement [Mirtich 1996] on
//! cells of time, which are halved until each is decided. Let f be the signed distance of the bodies
//! ([`crate::distance`]), and consider a cell between two neighbouring samples, with its middle m.
//!
//! - Each body moves on a straight line and turns evenly, so in half of the cell the bodies move by a vector d relative
//!   to each other, and no point of the two cores moves by more than r in total through turns: the angle in half of the
//!   cell times the greatest distance of a point of the core from its centre, summed over both bodies. (A chord is not
//!   longer than its arc.) As parts added on every side are balls, their turns do not matter.
//! - *From below*: f is a maximum over directions n of a gap along n, so it is at least the gap along the direction
//!   that is best at m. That gap changes by at most |n·d| + r. So f ≥ gap(m, n) − |n·d| − r in the whole cell.
//! - *From above*: for the same reason f changes by at most |d| + r, so f ≤ f(m) + |d| + r. Moreover, with orientations
//!   kept as they are at m, each gap is linear in time, and a maximum of linear functions is convex and thus at most
//!   the greater of its values at both ends; keeping the orientations changes it by at most r. So f ≤ max(f(start),
//!   f(end)) + 2r, which is the better bound of a body that slides along another.
//!
//! With a tolerance ε, a cell is *clear* if f > ε/2 in all of it, and *in contact* if f ≤ ε in all of it. If neither is
//! proved, the cell is halved. When |d| + r ≤ ε/4, one of the two is: f(m) ≤ ε/2 + |d| + r if it is not clear, hence
//! f ≤ ε/2 + 2(|d| + r) ≤ ε. So there are at most 2 cells per ε/4 of motion, and far fewer where bodies are not within
//! ε of each other for long. The margin of ε/2 is for rounding, which stays below 10⁻⁷ m for permitted coordinates.

use parry3d_f64::math::{Pose, Vector};

use crate::body::{Body, Placement, Shape};
use crate::distance::{Separation, separation};
use crate::trace::{angle, between};

/// The least tolerance, in metres.
pub const LEAST_TOLERANCE: f64 = 1e-6;

/// A tolerance for robots, in metres: a tenth of what industrial arms repeat.
pub const TOLERANCE: f64 = 5e-6;

/// A part of a recording, in seconds; both ends belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Its first instant.
    pub from: f64,
    /// Its last instant, not before the first one.
    pub to: f64,
}

/// How near two bodies come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The least clearance between them, in metres; negative if they overlap: minus the deepest penetration.
    pub clearance: f64,
    /// When that is, in seconds. Of several such instants it is any one.
    pub time: f64,
}

/// The contacts of two bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Contacts {
    /// When both poses are known. Nothing is known about other times.
    pub known: Interval,
    /// When the bodies are in contact, in the order of time; disjoint. At each instant at which the signed distance is
    /// 0 or less, they are in contact; at each instant of an interval it is at most the tolerance. Thus a contact may
    /// be found early by the time in which the bodies approach by the tolerance, and never late.
    pub intervals: Vec<Interval>,
    /// How near they come: at most the tolerance more than the least signed distance.
    pub nearest: Nearest,
}

impl Contacts {
    /// When they first touch, in seconds; `None` if they never do.
    pub fn first(&self) -> Option<f64> {
        self.intervals.first().map(|interval| interval.from)
    }

    /// Whether they already touch at the first known instant, so that the contact may have begun before.
    pub fn from_the_start(&self) -> bool {
        self.first() == Some(self.known.from)
    }

    /// The sum of the lengths of all contacts, in seconds.
    pub fn duration(&self) -> f64 {
        self.intervals.iter().map(|interval| interval.to - interval.from).sum()
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// A tolerance that cannot be kept.
    #[error("the tolerance is {0} m: it must be finite and at least {LEAST_TOLERANCE} m")]
    Tolerance(f64),
    /// Neither of the bodies has a recording.
    #[error("none of the two bodies moves: without a recording there is no time at which they could touch")]
    NothingMoves,
    /// The recordings have no instant in common.
    #[error(
        "the recordings have no time in common: one is from {} s to {} s, the other from {} s to {} s; align them", .0.from, .0.to, .1.from, .1.to
    )]
    NoCommonTime(Interval, Interval),
}

/// The contacts of two bodies, of which at least one moves; see the top of this module for the guarantees.
pub fn contacts(one: &Body, other: &Body, tolerance: f64) -> Result<Contacts, ContactError> {
    if !(LEAST_TOLERANCE..f64::INFINITY).contains(&tolerance) {
        return Err(ContactError::Tolerance(tolerance));
    }
    let known = known(one, other)?;
    let times = common_times(one, other, known);
    let mut found = Found { intervals: Vec::new(), nearest: None, tolerance };
    let instants: Vec<Instant> = times.iter().map(|&time| Instant::at(one, other, time)).collect();
    // A good nearest instant from the start leaves little to look at.
    for (&time, instant) in times.iter().zip(&instants) {
        found.near(instant.separation.distance, time);
    }
    if let ([time], [instant]) = (&times[..], &instants[..])
        && instant.separation.distance <= tolerance
    {
        found.touch(*time, *time);
    }
    for (times, instants) in times.windows(2).zip(instants.windows(2)) {
        let stretch = Stretch::new(one, other, [times[0], times[1]], [&instants[0], &instants[1]]);
        let whole = Cell { shares: [0.0, 1.0], distances: [0, 1].map(|end| instants[end].separation.distance) };
        stretch.search(whole, &mut found);
    }
    let nearest = found.nearest.expect("a common time has at least one instant");
    Ok(Contacts { known, intervals: found.intervals, nearest })
}

/// The time in which both bodies have a pose.
fn known(one: &Body, other: &Body) -> Result<Interval, ContactError> {
    let of = |body: &Body| match body.placement() {
        Placement::Fixed(_) => None,
        Placement::Moving(trace) => Some(Interval { from: trace.start(), to: trace.end() }),
    };
    match (of(one), of(other)) {
        (None, None) => Err(ContactError::NothingMoves),
        (Some(known), None) | (None, Some(known)) => Ok(known),
        (Some(one), Some(other)) => {
            let common = Interval { from: one.from.max(other.from), to: one.to.min(other.to) };
            if common.from > common.to {
                return Err(ContactError::NoCommonTime(one, other));
            }
            Ok(common)
        }
    }
}

/// The instants at which a motion may bend, and both ends of what is known.
fn common_times(one: &Body, other: &Body, known: Interval) -> Vec<f64> {
    let mut times = vec![known.from, known.to];
    for body in [one, other] {
        if let Placement::Moving(trace) = body.placement() {
            times.extend(trace.times().iter().filter(|&&time| known.from < time && time < known.to));
        }
    }
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// Both bodies at one instant.
struct Instant {
    poses: [Pose; 2],
    separation: Separation,
}

impl Instant {
    fn at(one: &Body, other: &Body, time: f64) -> Instant {
        let pose = |body: &Body| body.at(time).expect("both poses are known");
        let poses = [pose(one), pose(other)];
        Instant { poses, separation: separation(one.shape(), &poses[0], other.shape(), &poses[1]) }
    }
}

/// What was found so far.
struct Found {
    intervals: Vec<Interval>,
    nearest: Option<Nearest>,
    tolerance: f64,
}

impl Found {
    fn touch(&mut self, from: f64, to: f64) {
        match self.intervals.last_mut() {
            Some(last) if last.to >= from => last.to = to,
            _ => self.intervals.push(Interval { from, to }),
        }
    }

    fn near(&mut self, clearance: f64, time: f64) {
        if self.nearest.is_none_or(|nearest| clearance < nearest.clearance) {
            self.nearest = Some(Nearest { clearance, time });
        }
    }
}

/// A motion between two neighbouring samples. Cells of it are shares in `0..=1` instead of times, so neither the length
/// of the stretch nor the distance from time 0 matters.
struct Stretch<'b> {
    shapes: [&'b Shape; 2],
    times: [f64; 2],
    /// The pose of each body at the start and the end.
    poses: [[Pose; 2]; 2],
    /// The way of the second body relative to the first one.
    way: Vector,
    /// How far turns move a point of both cores, in total at most.
    turns: f64,
}

/// A part of a stretch, with the signed distance at its ends.
#[derive(Clone, Copy)]
struct Cell {
    shares: [f64; 2],
    distances: [f64; 2],
}

impl<'b> Stretch<'b> {
    fn new(one: &'b Body, other: &'b Body, times: [f64; 2], instants: [&Instant; 2]) -> Stretch<'b> {
        let poses = [0, 1].map(|body| [instants[0].poses[body], instants[1].poses[body]]);
        let way = |[from, to]: [Pose; 2]| to.translation - from.translation;
        let shapes = [one.shape(), other.shape()];
        let turns = shapes
            .iter()
            .zip(poses)
            .map(|(shape, poses)| shape.reach() * angle(&poses[0].rotation, &poses[1].rotation))
            .sum();
        Stretch { shapes, times, poses, way: way(poses[1]) - way(poses[0]), turns }
    }

    fn time(&self, share: f64) -> f64 {
        let [from, to] = self.times;
        if share == 1.0 { to } else { from + (to - from) * share }
    }

    fn separation(&self, share: f64) -> Separation {
        let [one, other] = self.poses.map(|[from, to]| between(&from, &to, share));
        separation(self.shapes[0], &one, self.shapes[1], &other)
    }

    /// Decides a cell or its halves, in the order of time.
    fn search(&self, cell: Cell, found: &mut Found) {
        let [from, to] = cell.shares;
        let half = (to - from) / 2.0;
        let middle = from + half;
        let at_middle = self.separation(middle);
        found.near(at_middle.distance, self.time(middle));

        let turns = self.turns * half;
        let motion = self.way.length() * half + turns;
        let least = at_middle.gap - self.way.dot(at_middle.normal).abs() * half - turns;
        let most = (at_middle.distance + motion).min(cell.distances[0].max(cell.distances[1]) + 2.0 * turns);

        // A distance that is a little too large, which it may be between boxes, must not halve cells forever.
        let small = motion <= found.tolerance / 8.0;
        let clear = least > found.tolerance / 2.0;
        let touches = most <= found.tolerance || (small && !clear);
        let best = found.nearest.map_or(f64::INFINITY, |nearest| nearest.clearance);
        let nearest_known = least >= best - found.tolerance || small;
        if nearest_known && (clear || touches) {
            if touches {
                found.touch(self.time(from), self.time(to));
            }
            return;
        }
        let [at_from, at_to] = cell.distances;
        self.search(Cell { shares: [from, middle], distances: [at_from, at_middle.distance] }, found);
        self.search(Cell { shares: [middle, to], distances: [at_middle.distance, at_to] }, found);
    }
}
