//! The signed distance between two shapes.
//!
//! It is the length of the shortest translation that brings disjoint shapes into touch; for shapes that overlap, minus
//! the length of the shortest translation that separates them (the penetration depth). In a formula, with the support
//! functions of the shapes: the maximum over all unit vectors n of the gap along n, which is
//! min {n·b | b in the second} − max {n·a | a in the first}.
//!
//! Everything on every side of a core only adds its radius: the gap along each n, and thus its maximum, is that of the
//! cores less both radii.
//!
//! Points, segments and boxes are zonotopes: a centre plus all sums of generators, each times a number in [−1, 1]. So
//! their difference is the zonotope of all generators. Where it has a volume and contains the origin, the maximum is
//! attained at the normal of a face, which is orthogonal to two generators. This is exact and the same for both orders
//! of the bodies. parry's `distance` is 0 for all that overlaps, and its `contact` is too small for a thin box in a
//! thick one.

use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::details::{
    closest_points_segment_segment_with_locations_nD as closest_on_segments, closest_points_support_map_support_map,
};
use parry3d_f64::query::{ClosestPoints, PointQuery as _};
use parry3d_f64::shape::{Cuboid, Segment};

use crate::body::{Core, Shape};

/// The sine of an angle below which two directions count as the same: their cross product is rounding.
const PARALLEL: f64 = 1e-9;

/// How two shapes are to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// The signed distance, in metres: negative where the shapes overlap. It is exact up to rounding; for two disjoint
    /// shapes of which one is a box and the other is not a sphere, it may be too large by a part in 10⁷.
    pub distance: f64,
    /// A unit vector from the first shape to the second one, along which the gap is greatest.
    pub normal: Vector,
    /// The gap along the normal. It is at most the exact signed distance, whatever the normal.
    pub gap: f64,
}

/// The signed distance of two shapes at their poses.
pub fn separation(one: &Shape, at: &Pose, other: &Shape, there: &Pose) -> Separation {
    let way = there.translation - at.translation;
    let generators: Vec<Vector> = generators(one, at).chain(self::generators(other, there)).collect();
    let radii = one.radius() + other.radius();
    let gap = |normal: Vector| gap_along(normal, way, &generators) - radii;
    let of = |distance: f64, normal: Vector| Separation { distance: distance - radii, normal, gap: gap(normal) };

    let face = widest_face(way, &generators);
    if let Some((normal, gap)) = face
        && gap <= 0.0
        && has_volume(one, other)
    {
        return of(gap, normal);
    }
    let nearest = nearest(one.core(), at, other.core(), there);
    let length = nearest.map_or(0.0, Vector::length);
    match (nearest, face) {
        (Some(nearest), None) if length > 0.0 => of(length, nearest / length),
        (Some(nearest), Some((face, gap))) if length > 0.0 => {
            // Very near each other, the direction between nearest points is rounding, and that of a face is not.
            let normal = nearest / length;
            let normal = if gap_along(normal, way, &generators) >= gap { normal } else { face };
            of(length.max(gap), normal)
        }
        // They touch so closely that no iteration finds the gap.
        (_, Some((face, gap))) => of(gap.max(0.0), face),
        // Two cores without a volume meet: any direction that is orthogonal to both separates them at once.
        (_, None) => {
            let along = generators.iter().find_map(|generator| generator.try_normalize());
            of(0.0, along.map_or(Vector::X, Vector::any_orthonormal_vector))
        }
    }
}

/// The gap between two zonotopes along a unit vector; `way` leads from the centre of the first to that of the second.
fn gap_along(normal: Vector, way: Vector, generators: &[Vector]) -> f64 {
    normal.dot(way) - generators.iter().map(|generator| normal.dot(*generator).abs()).sum::<f64>()
}

/// The normal of a face of the difference of two zonotopes along which their gap is greatest, with that gap; `None` if
/// there are no two generators with different directions.
fn widest_face(way: Vector, generators: &[Vector]) -> Option<(Vector, f64)> {
    let mut widest: Option<(Vector, f64)> = None;
    for (at, one) in generators.iter().enumerate() {
        for other in &generators[at + 1..] {
            let cross = one.cross(*other);
            let length = cross.length();
            if length <= PARALLEL * one.length() * other.length() {
                continue;
            }
            let normal = if cross.dot(way) < 0.0 { -cross / length } else { cross / length };
            let gap = gap_along(normal, way, generators);
            if widest.is_none_or(|(_, most)| gap > most) {
                widest = Some((normal, gap));
            }
        }
    }
    widest
}

/// Whether the difference of two cores has a volume for certain: one of them is a box.
fn has_volume(one: &Shape, other: &Shape) -> bool {
    [one, other].iter().any(|shape| matches!(shape.core(), Core::Box(_)))
}

fn generators(shape: &Shape, pose: &Pose) -> impl Iterator<Item = Vector> {
    let halves = match shape.core() {
        Core::Point => [None; 3],
        Core::Segment(half) => [Some(half), None, None],
        Core::Box(half) => [Some(Vector::X * half.x), Some(Vector::Y * half.y), Some(Vector::Z * half.z)],
    };
    let rotation = pose.rotation;
    halves.into_iter().flatten().map(move |half| rotation * half)
}

/// The vector from the point of the first core that is nearest to the second one to that one's nearest point; `None` if
/// the cores meet or are too near to tell.
fn nearest(one: Core, at: &Pose, other: Core, there: &Pose) -> Option<Vector> {
    let segment = |half: Vector, pose: &Pose| Segment::new(pose * -half, pose * half);
    let half = |core: Core| match core {
        Core::Segment(half) => half,
        Core::Point | Core::Box(_) => Vector::ZERO,
    };
    match (one, other) {
        (Core::Point, Core::Point) => Some(there.translation - at.translation),
        (Core::Box(edges), Core::Point) => {
            let point = at.inverse_transform_point(there.translation);
            let on_box = Cuboid::new(edges).project_local_point(point, true).point;
            Some(at.rotation * (point - on_box))
        }
        (Core::Point | Core::Segment(_), Core::Box(_)) => nearest(other, there, one, at).map(|way| -way),
        (Core::Box(edges), Core::Segment(half)) => {
            let other = Segment::new(-half, half);
            let relative = at.inv_mul(there);
            let closest = closest_points_support_map_support_map(&relative, &Cuboid::new(edges), &other, f64::MAX);
            between_closest(closest, at, there)
        }
        (Core::Box(edges), Core::Box(others)) => {
            let (one, other) = (Cuboid::new(edges), Cuboid::new(others));
            let closest = closest_points_support_map_support_map(&at.inv_mul(there), &one, &other, f64::MAX);
            between_closest(closest, at, there)
        }
        (one, other) => {
            let (one, other) = (segment(half(one), at), segment(half(other), there));
            let (here, there) = closest_on_segments((&one.a, &one.b), (&other.a, &other.b));
            Some(other.point_at(&there) - one.point_at(&here))
        }
    }
}

fn between_closest(closest: ClosestPoints, at: &Pose, there: &Pose) -> Option<Vector> {
    match closest {
        ClosestPoints::WithinMargin(here, other) => Some(there * other - at * here),
        ClosestPoints::Intersecting | ClosestPoints::Disjoint => None,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use parry3d_f64::math::Rotation;
    use proptest::prelude::*;

    use super::*;

    pub(crate) fn any_shape() -> impl Strategy<Value = Shape> {
        let length = || prop_oneof![Just(1.0), 0.1..2.0f64];
        let half = [-1.0..1.0f64, -1.0..1.0f64, 0.1..1.0f64].prop_map(Vector::from_array);
        let shape = prop_oneof![
            length().prop_map(|radius| Shape::sphere(radius).unwrap()),
            [length(), length(), length()].prop_map(|edges| Shape::cuboid(edges).unwrap()),
            (half, length()).prop_map(|(half, radius)| Shape::capsule(half, radius).unwrap()),
        ];
        (shape, prop_oneof![Just(0.0), 0.0..0.5f64]).prop_map(|(shape, by)| shape.expanded(by).unwrap())
    }

    pub(crate) fn any_rotation() -> impl Strategy<Value = Rotation> {
        let turn = [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(|axis| Vector::from_array(axis) * 3.0);
        prop_oneof![Just(Rotation::IDENTITY), turn.prop_map(Rotation::from_scaled_axis)]
    }

    pub(crate) fn any_position(within: f64) -> impl Strategy<Value = Vector> {
        let coordinate = move || prop_oneof![1 => (-2i32..=2).prop_map(f64::from), 4 => -within..within];
        [coordinate(), coordinate(), coordinate()].prop_map(Vector::from_array)
    }

    pub(crate) fn any_pose() -> impl Strategy<Value = Pose> {
        (any_position(4.0), any_rotation()).prop_map(|(position, rotation)| Pose::from_parts(position, rotation))
    }

    fn at(x: f64, y: f64, z: f64) -> Pose {
        Pose::translation(x, y, z)
    }

    fn distance(one: &Shape, pose: Pose, other: &Shape, there: Pose) -> f64 {
        separation(one, &pose, other, &there).distance
    }

    #[test]
    fn a_sphere_beside_a_box_off_its_corner_and_inside() {
        let sphere = Shape::sphere(0.5).unwrap();
        let cuboid = Shape::cuboid([2.0, 4.0, 1.0]).unwrap();
        let level = |x, y, z| distance(&sphere, at(x, y, z), &cuboid, at(0.0, 0.0, 0.5));
        assert_eq!(level(3.0, 0.0, 0.5), 1.5, "beside a face: 2 m to the face, less the radius");
        assert_eq!(level(4.0, 6.0, 0.5), 4.5, "off an edge: 3-4-5");
        assert_eq!(level(3.0, 4.0, 2.0), 2.5, "off a corner: 2-2-1-3");
        assert_eq!(level(0.0, 0.0, 1.5), 0.0, "touching from above");
        assert_eq!(level(0.75, 0.0, 0.5), -0.75, "inside: a quarter of a metre to the face, and the radius");
    }

    #[test]
    fn an_expanded_box_has_round_corners() {
        let cuboid = Shape::cuboid([2.0; 3]).unwrap().expanded(0.5).unwrap();
        let point = Shape::sphere(1e-3).unwrap();
        assert_eq!(distance(&point, at(2.0, 0.0, 0.0), &cuboid, at(0.0, 0.0, 0.0)), 0.5 - 1e-3);
        let corner = distance(&point, at(2.0, 2.0, 2.0), &cuboid, at(0.0, 0.0, 0.0));
        assert!((corner - (libm::sqrt(3.0) - 0.5 - 1e-3)).abs() < 1e-15);
    }

    #[test]
    fn boxes_side_by_side_turned_and_in_each_other() {
        let cuboid = Shape::cuboid([2.0; 3]).unwrap();
        assert_eq!(distance(&cuboid, at(0.0, 0.0, 0.0), &cuboid, at(5.0, 1.0, 0.0)), 3.0);
        assert_eq!(distance(&cuboid, at(0.0, 0.0, 0.0), &cuboid, at(1.5, 0.25, 0.0)), -0.5);
        assert_eq!(distance(&cuboid, at(0.0, 0.0, 0.0), &cuboid, at(0.0, 0.0, 0.0)), -2.0);
        let turned =
            Pose::from_parts(Vector::new(4.0, 0.0, 0.0), Rotation::from_rotation_z(std::f64::consts::FRAC_PI_4));
        let edge = distance(&cuboid, at(0.0, 0.0, 0.0), &cuboid, turned);
        assert!((edge - (3.0 - libm::sqrt(2.0))).abs() < 1e-9, "{edge}");
    }

    #[test]
    fn capsules_crossed_in_line_and_meeting() {
        let along_x = Shape::capsule(Vector::X, 0.25).unwrap();
        let along_y = Shape::capsule(Vector::Y, 0.25).unwrap();
        assert_eq!(distance(&along_x, at(0.0, 0.0, 0.0), &along_y, at(0.0, 0.0, 1.0)), 0.5);
        assert_eq!(distance(&along_x, at(0.0, 0.0, 0.0), &along_x, at(5.0, 0.0, 0.0)), 2.5);
        assert_eq!(distance(&along_x, at(0.0, 0.0, 0.0), &along_y, at(0.0, 0.0, 0.0)), -0.5);
        assert_eq!(distance(&along_x, at(0.0, 0.0, 0.0), &along_x, at(1.0, 0.0, 0.0)), -0.5);
    }

    proptest! {
        /// The gap along the normal is a lower bound by its definition, so where it is as great as the distance, both
        /// are right.
        #[test]
        fn the_gap_along_the_normal_proves_the_distance(
            one in any_shape(), at in any_pose(), other in any_shape(), there in any_pose(),
        ) {
            let found = separation(&one, &at, &other, &there);
            prop_assert!((found.normal.length() - 1.0).abs() < 1e-12);
            prop_assert!((found.distance - found.gap).abs() <= 1e-6, "{found:?}");
        }

        /// With the property above: the distance is the greatest gap.
        #[test]
        fn no_direction_has_a_greater_gap_than_the_distance(
            one in any_shape(), at in any_pose(), other in any_shape(), way in any_position(2.0), rotation in any_rotation(),
        ) {
            let there = Pose::from_parts(at.translation + way, rotation);
            let found = separation(&one, &at, &other, &there);
            let generators: Vec<Vector> = generators(&one, &at).chain(super::generators(&other, &there)).collect();
            // Evenly spread over the sphere by the golden angle.
            for k in 0..2000 {
                let z = 1.0 - (f64::from(k) + 0.5) / 1000.0;
                let (sin, cos) = libm::sincos(f64::from(k) * 2.399_963_229_728_653);
                let around = libm::sqrt(1.0 - z * z);
                let normal = Vector::new(around * cos, around * sin, z);
                let gap = gap_along(normal, way, &generators) - one.radius() - other.radius();
                prop_assert!(gap <= found.distance + 1e-9, "{gap} along {normal} instead of {found:?}");
            }
        }

        #[test]
        fn distance_is_the_same_from_both_sides_and_anywhere(
            one in any_shape(), at in any_pose(), other in any_shape(), there in any_pose(), moved in any_pose(),
        ) {
            let here = separation(&one, &at, &other, &there).distance;
            let swapped = separation(&other, &there, &one, &at).distance;
            let elsewhere = separation(&one, &(moved * at), &other, &(moved * there)).distance;
            prop_assert!((here - swapped).abs() <= 1e-6, "{here} {swapped}");
            prop_assert!((here - elsewhere).abs() <= 1e-6, "{here} {elsewhere}");
        }

        #[test]
        fn expanding_takes_just_as_much_from_the_distance(
            one in any_shape(), at in any_pose(), other in any_shape(), there in any_pose(), by in 0.0..3.0f64,
        ) {
            let before = separation(&one, &at, &other, &there).distance;
            let after = separation(&one.expanded(by).unwrap(), &at, &other, &there).distance;
            prop_assert!((before - by - after).abs() < 1e-12);
        }
    }
}
