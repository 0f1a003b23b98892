//! How far a point is from the boundary of a region.

use sesame_plan::Region;

/// The distance of a point from the boundary of a region: positive outside, negative inside.
pub(super) fn signed_distance(point: [f64; 3], region: &Region) -> f64 {
    match region {
        Region::Box { low, high } => of_box(point, low, high),
        Region::Polygon { corners } => of_polygon([point[0], point[1]], corners),
    }
}

fn of_box(point: [f64; 3], low: &[f64; 3], high: &[f64; 3]) -> f64 {
    // Per axis, how far the point is beyond the nearer of the two faces.
    let beyond = |axis: usize| (low[axis] - point[axis]).max(point[axis] - high[axis]);
    let inside = beyond(0).max(beyond(1)).max(beyond(2));
    if inside <= 0.0 {
        return inside;
    }
    let square = |axis: usize| {
        let out = beyond(axis).max(0.0);
        out * out
    };
    libm::sqrt(square(0) + square(1) + square(2))
}

/// The nearest side is found by projection. Whether the point is inside is decided by how many sides a ray from it
/// crosses: each side counts at its lower corner and not at its upper one, so a ray through a corner counts it once.
fn of_polygon(point: [f64; 2], corners: &[[f64; 2]]) -> f64 {
    let mut nearest = f64::INFINITY;
    let mut inside = false;
    for (at, &to) in corners.iter().enumerate() {
        let from = corners[at.checked_sub(1).unwrap_or(corners.len() - 1)];
        let along = [to[0] - from[0], to[1] - from[1]];
        let away = [point[0] - from[0], point[1] - from[1]];
        let length = along[0] * along[0] + along[1] * along[1];
        // Two corners may be so close that the square of their distance is 0.
        let share = if length > 0.0 { (away[0] * along[0] + away[1] * along[1]) / length } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        let gap = [away[0] - share * along[0], away[1] - share * along[1]];
        nearest = nearest.min(gap[0] * gap[0] + gap[1] * gap[1]);
        if (from[1] > point[1]) != (to[1] > point[1]) && away[0] < along[0] * (away[1] / along[1]) {
            inside = !inside;
        }
    }
    let distance = libm::sqrt(nearest);
    if inside && distance > 0.0 { -distance } else { distance }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];

    #[test]
    fn a_box_has_faces_edges_and_corners() {
        let region = Region::Box { low: [0.0; 3], high: [10.0, 20.0, 30.0] };
        let from = |x, y, z| signed_distance([x, y, z], &region);
        assert_eq!(from(5.0, 10.0, 15.0), -5.0);
        assert_eq!(from(1.0, 10.0, 15.0), -1.0);
        assert_eq!(from(10.0, 10.0, 15.0), 0.0);
        assert_eq!(from(5.0, 10.0, 33.0), 3.0);
        assert_eq!(from(13.0, 24.0, 15.0), 5.0);
        assert_eq!(from(-2.0, -3.0, 36.0), 7.0);
    }

    #[test]
    fn a_polygon_is_a_column_of_any_height_in_either_direction() {
        let mut corners = SQUARE.to_vec();
        for _ in 0..2 {
            let region = Region::Polygon { corners: corners.clone() };
            for z in [-100.0, 0.0, 7.0] {
                let from = |x, y| signed_distance([x, y, z], &region);
                assert_eq!(from(5.0, 5.0), -5.0);
                assert_eq!(from(1.0, 8.0), -1.0);
                assert_eq!(from(10.0, 3.0), 0.0);
                assert_eq!(from(0.0, 0.0), 0.0);
                assert_eq!(from(13.0, 14.0), 5.0);
                assert_eq!(from(-2.0, 10.0), 2.0, "the ray goes through a corner");
            }
            corners.reverse();
        }
    }

    /// Corners around a centre: a simple polygon, in general not a convex one.
    fn star() -> impl Strategy<Value = Vec<[f64; 2]>> {
        prop::collection::vec((0.1f64..1.0, 1.0f64..50.0), 3..12).prop_map(|parts| {
            let whole: f64 = parts.iter().map(|(part, _)| part).sum();
            let mut turned = 0.0;
            let corners = parts.iter().map(|(part, radius)| {
                turned += part / whole * std::f64::consts::TAU;
                [radius * libm::cos(turned), radius * libm::sin(turned)]
            });
            corners.collect()
        })
    }

    fn sides(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
        (0..corners.len()).map(|at| [corners[at], corners[(at + 1) % corners.len()]])
    }

    /// The oracle: how often the polygon goes around the point, as the sum of the angles at which its sides are seen.
    fn goes_around(point: [f64; 2], corners: &[[f64; 2]]) -> bool {
        let angle: f64 = sides(corners)
            .map(|side| {
                let [a, b] = side.map(|corner| [corner[0] - point[0], corner[1] - point[1]]);
                libm::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
            })
            .sum();
        angle.abs() > std::f64::consts::PI
    }

    /// The oracle: the distance of the nearest of many points on the boundary.
    fn sampled(point: [f64; 2], corners: &[[f64; 2]], samples: u32) -> f64 {
        let distances = sides(corners).flat_map(|[a, b]| {
            (0..=samples).map(move |at| {
                let share = f64::from(at) / f64::from(samples);
                let on = |axis: usize| a[axis] + share * (b[axis] - a[axis]);
                libm::hypot(on(0) - point[0], on(1) - point[1])
            })
        });
        distances.fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn a_polygon_agrees_with_angles_and_with_samples_of_its_boundary(
            corners in star(),
            x in -60.0f64..60.0,
            y in -60.0f64..60.0,
        ) {
            let found = signed_distance([x, y, 0.0], &Region::Polygon { corners: corners.clone() });
            let distance = sampled([x, y], &corners, 2_000);
            // Half of the longest step between two samples, which is at most 100/2000 wide.
            prop_assert!(found.abs() <= distance + 1e-9 && distance <= found.abs() + 0.026, "{found} {distance}");
            if distance > 1e-6 {
                prop_assert_eq!(found < 0.0, goes_around([x, y], &corners));
            }
        }

        #[test]
        fn a_box_agrees_with_the_polygon_below_it_and_with_each_axis(
            point in prop::array::uniform3(-20.0f64..20.0),
            low in prop::array::uniform3(-10.0f64..0.0),
            high in prop::array::uniform3(1.0f64..10.0),
        ) {
            let tall = Region::Box { low: [low[0], low[1], -1e9], high: [high[0], high[1], 1e9] };
            let below = Region::Polygon {
                corners: vec![[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]],
            };
            prop_assert!((signed_distance(point, &tall) - signed_distance(point, &below)).abs() < 1e-9);
            let found = signed_distance(point, &Region::Box { low, high });
            let within = (0..3).all(|axis| low[axis] <= point[axis] && point[axis] <= high[axis]);
            prop_assert_eq!(found <= 0.0, within);
            // Nobody gets to the boundary on a shorter way: at that distance along each axis it is the same side.
            for axis in 0..3 {
                for way in [-0.999, 0.999] {
                    let mut near = point;
                    near[axis] += way * found.abs();
                    prop_assert_eq!(signed_distance(near, &Region::Box { low, high }) < 0.0, found < 0.0);
                }
            }
            let nearest = [0, 1, 2].map(|axis| point[axis].clamp(low[axis], high[axis]));
            let away = (0..3).map(|axis| (point[axis] - nearest[axis]) * (point[axis] - nearest[axis])).sum::<f64>();
            prop_assert!((libm::sqrt(away) - found.max(0.0)).abs() < 1e-9);
        }
    }
}
