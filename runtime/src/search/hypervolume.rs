//! Hypervolume: the volume that a set of points dominates up to a reference point, all objectives minimised.
//!
//! Exact: sweeps for two and three objectives (the latter after Beume et al. 2009), WFG's recursion over exclusive volumes
//! (While et al. 2012) for any other number.

use std::cmp::Ordering;

use crate::search::dominance::{ascending, dominates_in_all, lexicographic};

/// The volume dominated by the points and bounded by the reference. A point counts only where it is below the reference
/// in every objective. The reference must be finite, the points free of NaN and as long as it; with no objectives at
/// all the volume is 0.
pub fn hypervolume(points: &[&[f64]], reference: &[f64]) -> f64 {
    assert!(reference.iter().all(|bound| bound.is_finite()), "a hypervolume has a finite reference point");
    let inside = |point: &&[f64]| point.iter().zip(reference).all(|(x, bound)| x < bound);
    let points: Vec<Vec<f64>> = points
        .iter()
        .inspect(|point| assert!(point.len() == reference.len(), "a point has as many values as the reference"))
        .filter(|point| inside(point))
        .map(|point| point.to_vec())
        .collect();
    if reference.is_empty() {
        0.0
    } else if points.iter().flatten().any(|x| x.is_infinite()) {
        f64::INFINITY
    } else {
        volume(points, reference)
    }
}

/// The points that no other dominates or equals, in lexicographic order.
fn non_dominated(mut points: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    points.sort_by(|a, b| lexicographic(a, b));
    points.dedup_by(|later, first| lexicographic(later, first) == Ordering::Equal);
    let mut kept: Vec<Vec<f64>> = Vec::with_capacity(points.len());
    for point in points {
        if !kept.iter().any(|better| dominates_in_all(better, &point)) {
            kept.push(point);
        }
    }
    kept
}

/// The volume that points dominate, all inside the reference and finite.
fn volume(mut points: Vec<Vec<f64>>, reference: &[f64]) -> f64 {
    if let [x, y] = *reference {
        points.sort_by(|a, b| lexicographic(a, b));
        let mut top = y;
        let mut area = 0.0;
        for point in &points {
            if point[1] < top {
                area += (x - point[0]) * (top - point[1]);
                top = point[1];
            }
        }
        return area;
    }
    if let [x, y, z] = *reference {
        return swept(points, [x, y, z]);
    }
    let mut total = 0.0;
    let mut rest = non_dominated(points).into_iter();
    while let Some(point) = rest.next() {
        let own: f64 = point.iter().zip(reference).map(|(x, bound)| bound - x).product();
        // What the remaining points dominate of this point's box: their corners moved into it.
        let limited = rest.as_slice().iter().map(|other| other.iter().zip(&point).map(|(a, b)| a.max(*b)).collect());
        total += own - volume(limited.collect(), reference);
    }
    total
}

/// As [`volume`], of three objectives: a plane moves up the third one, and the area dominated below it only grows.
fn swept(mut points: Vec<Vec<f64>>, [right, top, end]: [f64; 3]) -> f64 {
    points.sort_by(|a, b| ascending(a[2], b[2]).then_with(|| lexicographic(a, b)));
    let mut stairs = Stairs { steps: Vec::new(), right, top };
    let (mut total, mut area) = (0.0, 0.0);
    let mut height = points.first().map_or(end, |lowest| lowest[2]);
    for point in &points {
        total += area * (point[2] - height);
        height = point[2];
        area += stairs.add(point[0], point[1]);
    }
    total + area * (end - height)
}

/// The area that points in the plane dominate up to a corner.
struct Stairs {
    /// The points that no other dominates: the first coordinate ascends, the second descends.
    steps: Vec<(f64, f64)>,
    right: f64,
    top: f64,
}

impl Stairs {
    /// Adds a point, and tells by how much the area has grown.
    fn add(&mut self, x: f64, y: f64) -> f64 {
        let beyond = self.steps.partition_point(|step| step.0 <= x);
        let mut ceiling = beyond.checked_sub(1).map_or(self.top, |before| self.steps[before].1);
        if ceiling <= y {
            return 0.0;
        }
        let first = self.steps.partition_point(|step| step.0 < x);
        let (mut left, mut grown, mut last) = (x, 0.0, first);
        while let Some(&(step, height)) = self.steps.get(last).filter(|step| step.1 >= y) {
            grown += (step - left) * (ceiling - y);
            (left, ceiling) = (step, height);
            last += 1;
        }
        let end = self.steps.get(last).map_or(self.right, |step| step.0);
        grown += (end - left) * (ceiling - y);
        self.steps.splice(first..last, [(x, y)]);
        grown
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Inclusion and exclusion over all subsets: the volume of a union of boxes by definition.
    fn naive(points: &[&[f64]], reference: &[f64]) -> f64 {
        (1u32..1 << points.len())
            .map(|subset| {
                let corner = |k: usize| {
                    points
                        .iter()
                        .enumerate()
                        .filter(|(i, _)| subset >> i & 1 == 1)
                        .map(|(_, p)| p[k])
                        .fold(f64::MIN, f64::max)
                };
                let common: f64 = (0..reference.len()).map(|k| (reference[k] - corner(k)).max(0.0)).product();
                if subset.count_ones() % 2 == 1 { common } else { -common }
            })
            .sum()
    }

    proptest! {
        #[test]
        fn volume_is_that_of_the_union_of_boxes(
            points in (1usize..=4).prop_flat_map(|n| {
                let value = prop_oneof![(0i32..6).prop_map(f64::from), 0.0..5.0f64];
                proptest::collection::vec(proptest::collection::vec(value, n), 0..9)
            }),
        ) {
            let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
            let reference = vec![4.5; points.first().map_or(2, |point| point.len())];
            let (fast, slow) = (hypervolume(&points, &reference), naive(&points, &reference));
            prop_assert!((fast - slow).abs() <= 1e-9 * slow.max(1.0), "{fast} against {slow}");
        }
    }

    #[test]
    fn infinite_points_have_infinite_or_no_volume() {
        let below: &[f64] = &[f64::NEG_INFINITY, 0.0];
        let above: &[f64] = &[f64::INFINITY, 0.0];
        let inside: &[f64] = &[0.0, 0.0];
        assert_eq!(hypervolume(&[below, inside], &[1.0, 1.0]), f64::INFINITY);
        assert_eq!(hypervolume(&[above, inside], &[1.0, 1.0]), 1.0);
        assert_eq!(hypervolume(&[], &[1.0, 1.0]), 0.0);
    }
}
