//! Contacts of moving bodies: by hand, compared with dense sampling, and what must not make a difference.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]

use proptest::prelude::*;
use sesame_safety::alignment::Alignment;
use sesame_safety::body::{Body, Placement, Shape};
use sesame_safety::contact::{ContactError, Contacts, TOLERANCE, contacts};
use sesame_safety::distance::separation;
use sesame_safety::trace::Trace;
use sesame_safety::{Pose, Rotation, Vector};

fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

fn cuboid(edges: [f64; 3]) -> Shape {
    Shape::cuboid(edges).unwrap()
}

/// A sphere through these points, one per second from 0 s.
fn flying(radius: f64, points: &[[f64; 3]]) -> Body {
    let times = (0..points.len()).map(|second| second as f64).collect();
    let positions = points.iter().map(|&point| Vector::from_array(point)).collect();
    Body::moving(sphere(radius), Trace::new(times, positions, None).unwrap()).unwrap()
}

fn wall() -> Body {
    Body::fixed_at(cuboid([2.0; 3]), Vector::ZERO).unwrap()
}

fn found(one: &Body, other: &Body) -> Contacts {
    contacts(one, other, TOLERANCE).unwrap()
}

#[track_caller]
fn near(found: f64, expected: f64, within: f64) {
    assert!((found - expected).abs() <= within, "{found} instead of {expected}");
}

#[test]
fn a_sphere_flies_through_a_box() {
    // The surface of the sphere reaches the box after 3.5 m and leaves it after 6.5 m, of 10 m in a second.
    let found = found(&flying(0.5, &[[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), &wall());
    assert_eq!(found.intervals.len(), 1);
    near(found.intervals[0].from, 0.35, TOLERANCE / 10.0);
    near(found.intervals[0].to, 0.65, TOLERANCE / 10.0);
    assert!(found.intervals[0].from <= 0.35, "never late");
    near(found.duration(), 0.3, TOLERANCE / 5.0);
    // It goes as deep as the centre of the box, 1 m from each face.
    near(found.nearest.clearance, -1.5, TOLERANCE);
    assert!(!found.from_the_start());
}

#[test]
fn a_sphere_passes_a_box_without_touching_it() {
    let found = found(&flying(0.5, &[[-5.0, 2.0, 0.0], [5.0, 2.0, 0.0]]), &wall());
    assert_eq!(found.first(), None);
    near(found.nearest.clearance, 0.5, TOLERANCE);
    assert!((0.4..=0.6).contains(&found.nearest.time), "beside the face, not {}", found.nearest.time);
}

#[test]
fn a_sphere_passes_the_edge_of_a_box_where_no_sample_is() {
    // The way is 3 m off the edge at (1, 1), in the direction (1, 1), and nearest at its middle.
    let off = 1.0 + 3.0 / libm::sqrt(2.0);
    let found = found(&flying(1.0, &[[off - 10.0, off + 10.0, 0.0], [off + 10.0, off - 10.0, 0.0]]), &wall());
    near(found.nearest.clearance, 2.0, TOLERANCE);
    near(found.nearest.time, 0.5, 1e-3);
}

#[test]
fn grazing_is_a_contact() {
    let found = found(&flying(0.5, &[[-5.0, 1.5, 0.0], [5.0, 1.5, 0.0]]), &wall());
    // As long as the centre is beside the face, and a little longer by the tolerance.
    assert!(found.first().unwrap() <= 0.4);
    near(found.first().unwrap(), 0.4, 1e-3);
    near(found.nearest.clearance, 0.0, TOLERANCE);
}

#[test]
fn a_miss_by_more_than_the_tolerance_is_none() {
    let found = found(&flying(0.5, &[[-5.0, 1.5 + 2.0 * TOLERANCE, 0.0], [5.0, 1.5 + 2.0 * TOLERANCE, 0.0]]), &wall());
    assert_eq!(found.first(), None);
}

#[test]
fn a_sphere_that_starts_inside_leaves_and_returns() {
    let found = found(&flying(0.5, &[[0.0; 3], [4.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0; 3]]), &wall());
    assert!(found.from_the_start());
    assert_eq!(found.intervals.len(), 2);
    near(found.intervals[0].to, 0.375, TOLERANCE);
    near(found.intervals[1].from, 2.625, TOLERANCE);
    assert_eq!(found.intervals[1].to, 3.0);
}

#[test]
fn two_spheres_cross_and_meet_in_the_middle() {
    // Both reach the origin after a second; they touch when they are √2 (2 − 2t) = 1 m apart.
    let one = flying(0.5, &[[-2.0, 0.0, 0.0], [0.0; 3], [2.0, 0.0, 0.0]]);
    let other = flying(0.5, &[[0.0, -2.0, 0.0], [0.0; 3], [0.0, 2.0, 0.0]]);
    let found = found(&one, &other);
    near(found.first().unwrap(), 1.0 - 1.0 / (2.0 * libm::sqrt(2.0)), TOLERANCE);
    near(found.nearest.clearance, -1.0, TOLERANCE);
    near(found.nearest.time, 1.0, TOLERANCE);
}

#[test]
fn two_robots_that_cross_one_after_the_other_do_not_meet() {
    let one = flying(0.5, &[[-4.0, 0.0, 0.0], [0.0; 3], [4.0, 0.0, 0.0], [8.0, 0.0, 0.0]]);
    let Placement::Moving(recorded) = one.placement() else { unreachable!() };
    let late = flying(0.5, &[[0.0, -4.0, 0.0], [0.0; 3], [0.0, 4.0, 0.0]]);
    let Placement::Moving(other) = late.placement() else { unreachable!() };
    let with = |alignment: Alignment| {
        let aligned = alignment.align(recorded, other).unwrap();
        found(&one, &Body::moving(sphere(0.5), aligned).unwrap())
    };
    assert!(with(Alignment::CommonStart).first().is_some());
    let later = with(Alignment::Offset(1.0));
    assert_eq!((later.first(), later.known.from), (None, 1.0));
    // A second later they pass 4 m apart in each direction: the least distance is 4/√2.
    near(later.nearest.clearance, 4.0 / libm::sqrt(2.0) - 1.0, TOLERANCE);
}

#[test]
fn a_bar_that_turns_hits_what_its_ends_do_not_pass_at_any_sample() {
    let bar = Shape::capsule(Vector::new(2.0, 0.0, 0.0), 0.1).unwrap();
    let turn = Rotation::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let trace = Trace::new(vec![0.0, 1.0], vec![Vector::ZERO; 2], Some(vec![Rotation::IDENTITY, turn])).unwrap();
    let bar = Body::moving(bar, trace).unwrap();
    let post = Body::fixed_at(sphere(0.1), Vector::new(1.0, 1.0, 0.0)).unwrap();
    let found = found(&bar, &post);
    // At an angle of 45°, less the one at which the axis is 0.2 m from the post, which is √2 m away.
    let first = (std::f64::consts::FRAC_PI_4 - libm::asin(0.2 / libm::sqrt(2.0))) / std::f64::consts::FRAC_PI_2;
    near(found.first().unwrap(), first, 2.0 * TOLERANCE);
    near(found.nearest.clearance, -0.2, TOLERANCE);
    near(found.nearest.time, 0.5, 1e-3);
}

#[test]
fn a_recording_of_one_sample_says_something_about_that_instant() {
    let one = flying(0.5, &[[1.2, 0.0, 0.0]]);
    let found = found(&one, &wall());
    assert_eq!((found.first(), found.duration(), found.known.to), (Some(0.0), 0.0, 0.0));
}

#[test]
fn times_of_a_clock_since_1970_lose_little() {
    let at = 1.7e9;
    let positions = vec![Vector::new(-5.0, 0.0, 0.0), Vector::new(5.0, 0.0, 0.0)];
    let trace = Trace::new(vec![at, at + 1.0], positions, None).unwrap();
    let found = found(&Body::moving(sphere(0.5), trace).unwrap(), &wall());
    near(found.first().unwrap(), at + 0.35, 1e-6);
}

#[test]
fn what_cannot_be_answered_is_an_error() {
    let [one, other] = [flying(0.5, &[[0.0; 3], [1.0; 3]]), wall()];
    assert_eq!(contacts(&other, &other, TOLERANCE), Err(ContactError::NothingMoves));
    assert_eq!(contacts(&one, &other, 0.0), Err(ContactError::Tolerance(0.0)));
    assert!(matches!(contacts(&one, &other, f64::NAN), Err(ContactError::Tolerance(_))));
    let Placement::Moving(trace) = one.placement() else { unreachable!() };
    let later = Body::moving(sphere(0.5), trace.shifted(5.0).unwrap()).unwrap();
    assert_eq!(
        contacts(&one, &later, TOLERANCE).unwrap_err().to_string(),
        "the recordings have no time in common: one is from 0 s to 1 s, the other from 5 s to 6 s; align them"
    );
}

fn any_shape() -> impl Strategy<Value = Shape> {
    let length = || 0.1..1.5f64;
    prop_oneof![
        2 => length().prop_map(sphere),
        2 => [length(), length(), length()].prop_map(cuboid),
        1 => ([0.1..1.0f64, 0.1..1.0f64, 0.1..1.0f64], length())
            .prop_map(|(half, radius)| Shape::capsule(Vector::from_array(half), radius).unwrap()),
    ]
}

fn any_rotation() -> impl Strategy<Value = Rotation> {
    [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64]
        .prop_map(|axis| Rotation::from_scaled_axis(Vector::from_array(axis) * 2.0))
}

fn any_position() -> impl Strategy<Value = Vector> {
    let coordinate = || prop_oneof![1 => (-2i32..=2).prop_map(f64::from), 4 => -3.0..3.0f64];
    [coordinate(), coordinate(), coordinate()].prop_map(Vector::from_array)
}

fn any_pose() -> impl Strategy<Value = Pose> {
    (any_position(), any_rotation()).prop_map(|(position, rotation)| Pose::from_parts(position, rotation))
}

fn any_moving() -> impl Strategy<Value = Body> {
    let samples = prop::collection::vec((0.05..1.0f64, any_position(), any_rotation()), 2..6);
    (any_shape(), 0.0..0.5f64, samples).prop_map(|(shape, start, samples)| {
        let times = samples.iter().scan(start, |time, sample| {
            *time += sample.0;
            Some(*time)
        });
        let positions = samples.iter().map(|sample| sample.1).collect();
        let orientations = samples.iter().map(|sample| sample.2).collect();
        let trace = Trace::new(times.collect(), positions, Some(orientations)).unwrap();
        Body::moving(shape, trace).unwrap()
    })
}

fn any_fixed() -> impl Strategy<Value = Body> {
    (any_shape(), any_pose()).prop_map(|(shape, pose)| Body::fixed(shape, pose).unwrap())
}

fn any_pair() -> impl Strategy<Value = (Body, Body)> {
    (any_moving(), prop_oneof![any_fixed(), any_moving()])
}

/// Both bodies with a common time, which recordings of half a second may not have.
fn known(one: &Body, other: &Body, tolerance: f64) -> Result<Contacts, TestCaseError> {
    contacts(one, other, tolerance).map_err(|_| TestCaseError::reject("no common time"))
}

fn clearance(one: &Body, other: &Body, time: f64) -> f64 {
    separation(one.shape(), &one.at(time).unwrap(), other.shape(), &other.at(time).unwrap()).distance
}

fn moved(body: &Body, by: Pose) -> Body {
    match body.placement() {
        Placement::Fixed(pose) => Body::fixed(*body.shape(), by * *pose).unwrap(),
        Placement::Moving(trace) => {
            let positions = trace.positions().iter().map(|&position| by * position).collect();
            let turned = trace.orientations().map(|all| all.iter().map(|&one| by.rotation * one).collect());
            let trace = Trace::new(trace.times().to_vec(), positions, turned).unwrap();
            Body::moving(*body.shape(), trace).unwrap()
        }
    }
}

/// Two answers about one scene are equal where the tolerance leaves no choice.
fn agree(one: &Body, other: &Body, here: &Contacts, there: &Contacts) -> Result<(), TestCaseError> {
    let [clear, deep] = [here.nearest, there.nearest].map(|nearest| nearest.clearance);
    prop_assert!((clear - deep).abs() <= 2.1 * TOLERANCE, "{clear} {deep}");
    let end = here.known.to;
    let [first, second] = [here, there].map(Contacts::first);
    let (early, late) =
        (first.unwrap_or(end).min(second.unwrap_or(end)), first.unwrap_or(end).max(second.unwrap_or(end)));
    if early < late {
        for k in 0..50 {
            let time = early + (late - early) * f64::from(k) / 50.0;
            prop_assert!(clearance(one, other, time) > 0.0, "contact between {early} and {late}");
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn contacts_are_those_of_dense_sampling((one, other) in any_pair()) {
        let tolerance = 1e-4;
        let found = known(&one, &other, tolerance)?;
        let mut least = f64::INFINITY;
        for k in 0..=1000 {
            let time = found.known.from + (found.known.to - found.known.from) * f64::from(k) / 1000.0;
            let time = time.min(found.known.to);
            let clearance = clearance(&one, &other, time);
            least = least.min(clearance);
            let touching = found.intervals.iter().any(|interval| (interval.from..=interval.to).contains(&time));
            prop_assert!(touching || clearance > 0.0, "{clearance} at {time} is not contact in {found:?}");
            prop_assert!(!touching || clearance <= tolerance * 1.01, "{clearance} at {time} is a contact in {found:?}");
        }
        prop_assert!(found.nearest.clearance <= least + tolerance * 1.01, "{found:?} {least}");
        let there = clearance(&one, &other, found.nearest.time);
        prop_assert!((there - found.nearest.clearance).abs() <= 1e-6, "{there} {found:?}");
        prop_assert!(found.intervals.windows(2).all(|pair| pair[0].to < pair[1].from), "{found:?}");
        prop_assert!(found.intervals.iter().all(|one| one.from <= one.to), "{found:?}");
    }

    #[test]
    fn moving_the_whole_scene_changes_nothing((one, other) in any_pair(), by in any_pose()) {
        let here = known(&one, &other, TOLERANCE)?;
        let there = known(&moved(&one, by), &moved(&other, by), TOLERANCE)?;
        agree(&one, &other, &here, &there)?;
    }

    #[test]
    fn swapping_the_bodies_changes_nothing((one, other) in any_pair()) {
        let here = known(&one, &other, TOLERANCE)?;
        let swapped = known(&other, &one, TOLERANCE)?;
        agree(&one, &other, &here, &swapped)?;
    }

    #[test]
    fn samples_in_between_change_nothing((one, other) in any_pair(), share in 0.01..0.99f64) {
        let here = known(&one, &other, TOLERANCE)?;
        let Placement::Moving(trace) = one.placement() else { unreachable!() };
        let mut times = trace.times().to_vec();
        times.push(trace.start() + (trace.end() - trace.start()) * share);
        times.sort_by(f64::total_cmp);
        times.dedup();
        let poses: Vec<Pose> = times.iter().map(|&time| trace.at(time).unwrap()).collect();
        let positions = poses.iter().map(|pose| pose.translation).collect();
        let finer = Trace::new(times, positions, Some(poses.iter().map(|pose| pose.rotation).collect())).unwrap();
        let finer = known(&Body::moving(*one.shape(), finer).unwrap(), &other, TOLERANCE)?;
        agree(&one, &other, &here, &finer)?;
    }

    #[test]
    fn expanding_a_body_makes_contact_earlier_and_never_later((one, other) in any_pair(), by in 1e-4..1.0f64) {
        let before = known(&one, &other, TOLERANCE)?;
        let after = known(&one, &other.clone().expanded(by).unwrap(), TOLERANCE)?;
        if let Some(first) = before.first() {
            prop_assert!(after.first().is_some_and(|expanded| expanded <= first), "{before:?} {after:?}");
        }
        prop_assert!((before.nearest.clearance - by - after.nearest.clearance).abs() <= 2.1 * TOLERANCE);
        prop_assert!(after.duration() >= before.duration() - 1e-12);
    }
}
