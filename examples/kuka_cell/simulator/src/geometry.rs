//! Distances between the solids of the cell: gripper spheres, cuboid zones, capsules along the links of the arms.
//!
//! All lengths are metres. Distances are signed: negative values say how deep two solids are in each other.

use parry3d_f64::bounding_volume::Aabb;
pub use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery as _;
use parry3d_f64::query::details::closest_points_segment_segment_with_locations_nD as closest_on_segments;
pub use parry3d_f64::shape::Capsule;

/// The distance from the surface of a sphere to a cuboid whose faces are parallel to the axes of the cell.
///
/// Inside, it is the way back to the nearest face, negative, with the sphere's radius on top: so it passes through
/// zero as the sphere touches the cuboid and keeps falling as the sphere goes on inwards.
pub fn sphere_to_cuboid(centre: Vector, radius: f64, cuboid: &Aabb) -> f64 {
    // Not solid: a centre inside the cuboid has a negative distance instead of zero.
    cuboid.distance_to_local_point(centre, false) - radius
}

/// The distance between two capsules' surfaces. Where their axes meet it is minus the sum of the radii.
pub fn capsule_to_capsule(one: &Capsule, other: &Capsule) -> f64 {
    let (here, there) = closest_on_segments((&one.segment.a, &one.segment.b), (&other.segment.a, &other.segment.b));
    let gap = one.segment.point_at(&here) - other.segment.point_at(&there);
    gap.length() - one.radius - other.radius
}

/// The smallest distance between any capsule of one chain and any of another.
///
/// Pairs whose bounding spheres are already further apart than the best pair are not measured; the result is the same
/// as measuring them all.
pub fn distance_between_chains<const N: usize>(chain: &[Capsule; N], other: &[Capsule; N]) -> f64 {
    let spheres = chain.each_ref().map(Capsule::local_bounding_sphere);
    let other_spheres = other.each_ref().map(Capsule::local_bounding_sphere);
    let mut nearest = f64::INFINITY;
    // The outer links meet first, so starting with them leaves little to measure.
    for (capsule, sphere) in chain.iter().zip(&spheres).rev() {
        for (other_capsule, other_sphere) in other.iter().zip(&other_spheres).rev() {
            let reach = nearest + sphere.radius + other_sphere.radius;
            // A reach below zero cannot be squared; so deep in each other, the pair is measured.
            if reach > 0.0 && (sphere.center - other_sphere.center).length_squared() >= reach * reach {
                continue;
            }
            nearest = nearest.min(capsule_to_capsule(capsule, other_capsule));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn cuboid() -> Aabb {
        Aabb::new(Vector::new(-1.0, -2.0, 0.0), Vector::new(1.0, 2.0, 1.0))
    }

    #[test]
    fn a_sphere_beside_over_and_diagonally_off_a_cuboid() {
        let level = |x, y, z| sphere_to_cuboid(Vector::new(x, y, z), 0.5, &cuboid());
        assert_eq!(level(3.0, 0.0, 0.5), 1.5, "beside a face: 2 m to the face, less the radius");
        assert_eq!(level(0.0, 0.0, 1.5), 0.0, "touching from above");
        assert_eq!(level(4.0, 6.0, 0.5), 4.5, "off an edge: 3-4-5");
        assert_eq!(level(3.0, 4.0, 2.0), 2.5, "off a corner: 2-2-1-3");
    }

    #[test]
    fn the_level_keeps_falling_as_the_sphere_goes_in() {
        let level = |x| sphere_to_cuboid(Vector::new(x, 0.0, 0.5), 0.25, &Aabb::new(Vector::ZERO, Vector::splat(10.0)));
        assert_eq!(level(-1.0), 0.75);
        assert_eq!(level(-0.125), -0.125, "surface inside, centre outside");
        assert_eq!(sphere_to_cuboid(Vector::splat(2.0), 0.25, &Aabb::new(Vector::ZERO, Vector::splat(10.0))), -2.25);
    }

    #[test]
    fn capsules_crossed_in_line_and_touching() {
        let along_x = Capsule::new(Vector::ZERO, Vector::new(2.0, 0.0, 0.0), 0.25);
        let across = Capsule::new(Vector::new(1.0, -1.0, 1.0), Vector::new(1.0, 1.0, 1.0), 0.25);
        let ahead = Capsule::new(Vector::new(5.0, 0.0, 0.0), Vector::new(9.0, 0.0, 0.0), 0.5);
        let through = Capsule::new(Vector::new(1.0, -1.0, 0.0), Vector::new(1.0, 1.0, 0.0), 0.5);
        assert_eq!(capsule_to_capsule(&along_x, &across), 0.5);
        assert_eq!(capsule_to_capsule(&along_x, &ahead), 2.25);
        assert_eq!(capsule_to_capsule(&along_x, &through), -0.75);
    }

    fn points() -> impl Strategy<Value = Vector> {
        prop::array::uniform3(-3.0..3.0f64).prop_map(Vector::from_array)
    }

    fn capsules() -> impl Strategy<Value = Capsule> {
        (points(), points(), 0.05..0.4f64).prop_map(|(start, end, radius)| Capsule::new(start, end, radius))
    }

    /// The least distance over a fine grid of points of the two axes: never below the true one, and above it by at
    /// most half a grid cell of each axis.
    fn sampled(a: &Capsule, b: &Capsule) -> f64 {
        let points = |capsule: &Capsule| {
            (0..=80).map(|i| capsule.segment.a.lerp(capsule.segment.b, f64::from(i) / 80.0)).collect()
        };
        let (on_a, on_b): (Vec<Vector>, Vec<Vector>) = (points(a), points(b));
        let gap = on_a.iter().flat_map(|p| on_b.iter().map(move |q| (*p - *q).length())).fold(f64::INFINITY, f64::min);
        gap - a.radius - b.radius
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn capsule_distance_agrees_with_sampling(a in capsules(), b in capsules()) {
            let cell = (a.height() + b.height()) / 160.0;
            let (exact, sampled) = (capsule_to_capsule(&a, &b), sampled(&a, &b));
            prop_assert!(exact <= sampled + 1e-9 && sampled <= exact + cell + 1e-9, "{exact} {sampled}");
        }

        #[test]
        fn pruning_changes_nothing(a in prop::array::uniform4(capsules()), b in prop::array::uniform4(capsules())) {
            let pairs = a.iter().flat_map(|x| b.iter().map(move |y| capsule_to_capsule(x, y)));
            let all = pairs.fold(f64::INFINITY, f64::min);
            prop_assert_eq!(distance_between_chains(&a, &b), all);
        }

        #[test]
        fn sphere_level_agrees_with_sampling_the_cuboid(centre in points(), radius in 0.1..0.5f64) {
            let cuboid = cuboid();
            // The nearest of a grid of points on the faces: at most half a grid cell's diagonal too far.
            let grid = |lo: f64, hi: f64| (0..=40).map(move |i| lo + (hi - lo) * f64::from(i) / 40.0);
            let mut nearest = f64::INFINITY;
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                for face in [cuboid.mins[axis], cuboid.maxs[axis]] {
                    for at_u in grid(cuboid.mins[u], cuboid.maxs[u]) {
                        for at_v in grid(cuboid.mins[v], cuboid.maxs[v]) {
                            let mut point = Vector::ZERO;
                            (point[axis], point[u], point[v]) = (face, at_u, at_v);
                            nearest = nearest.min((point - centre).length());
                        }
                    }
                }
            }
            let inside = (0..3).all(|axis| (cuboid.mins[axis]..=cuboid.maxs[axis]).contains(&centre[axis]));
            let sampled = if inside { -nearest } else { nearest } - radius;
            let level = sphere_to_cuboid(centre, radius, &cuboid);
            prop_assert!((level - sampled).abs() <= 0.06, "{level} {sampled}");
        }
    }
}
