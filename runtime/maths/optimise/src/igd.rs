//! IGD and IGD⁺: how far a set of points is from a front on average, all objectives minimised (Coello and Reyes 2004;
//! Ishibuchi et al. 2015).
//!
//! IGD is the mean over the points of the front of the Euclidean distance to the nearest point of the set. In IGD⁺
//! the distance of a point of the front to a point of the set counts only in the objectives in which the set's point is
//! worse. So a set that is better than another never has a larger IGD⁺, which IGD does not guarantee.

/// IGD⁺ of a set that only grows.
///
/// Objectives are measured in lengths of the front: each is divided by the range that the front has in it, where it has
/// one, so that seconds and counts weigh alike.
#[derive(Debug, Clone, PartialEq)]
pub struct IgdPlus {
    /// The front, scaled.
    front: Vec<Vec<f64>>,
    /// What one unit of each objective is multiplied by.
    scale: Vec<f64>,
    /// For each point of the front: the least squared distance to a point of the set; infinite before there is one.
    nearest: Vec<f64>,
}

impl IgdPlus {
    /// The distance to this front, of a set without points yet. Points of the front with an infinite value are left
    /// out, as nothing is near them; `None` where no point is left.
    pub fn to<'p>(front: impl IntoIterator<Item = &'p [f64]>) -> Option<IgdPlus> {
        let front: Vec<&[f64]> = front.into_iter().filter(|point| point.iter().all(|x| x.is_finite())).collect();
        let scale = ranges(&front)?;
        Some(IgdPlus::scaled(&front, scale))
    }

    /// As [`IgdPlus::to`], with each objective multiplied by the factor given.
    fn scaled(front: &[&[f64]], scale: Vec<f64>) -> IgdPlus {
        let front: Vec<Vec<f64>> =
            front.iter().map(|point| point.iter().zip(&scale).map(|(x, scale)| x * scale).collect()).collect();
        IgdPlus { nearest: vec![f64::INFINITY; front.len()], front, scale }
    }

    /// Adds a point to the set. One that another point of the set dominates makes no difference.
    pub fn add(&mut self, point: &[f64]) {
        let point: Vec<f64> = point.iter().zip(&self.scale).map(|(x, scale)| x * scale).collect();
        for (target, nearest) in self.front.iter().zip(&mut self.nearest) {
            let squared: f64 = point
                .iter()
                .zip(target)
                .map(|(x, z)| {
                    let worse = (x - z).max(0.0);
                    worse * worse
                })
                .sum();
            *nearest = nearest.min(squared);
        }
    }

    /// The mean distance; `None` while the set has no point with a finite one.
    pub fn value(&self) -> Option<f64> {
        let total: f64 = self.nearest.iter().map(|&squared| libm::sqrt(squared)).sum();
        Some(total / self.nearest.len() as f64).filter(|mean| mean.is_finite())
    }
}

/// The scale in which objectives are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// Each objective is divided by the range that the front has in it, where it has one.
    ByRange,
    /// As they are.
    Unscaled,
}

/// IGD of points to a front; `None` without a point or a front. Points of the front with an infinite value are left
/// out.
pub fn igd(points: &[&[f64]], front: &[&[f64]], scaling: Scaling) -> Option<f64> {
    let front: Vec<&[f64]> = front.iter().copied().filter(|point| point.iter().all(|x| x.is_finite())).collect();
    let scale = match scaling {
        Scaling::ByRange => ranges(&front)?,
        Scaling::Unscaled => vec![1.0; front.first()?.len()],
    };
    let squared = |a: &[f64], z: &[f64]| -> f64 {
        a.iter().zip(z).zip(&scale).map(|((a, z), scale)| (a - z) * scale * ((a - z) * scale)).sum()
    };
    let nearest = |z: &[f64]| points.iter().map(|a| squared(a, z)).fold(f64::INFINITY, f64::min);
    let total: f64 = front.iter().map(|z| libm::sqrt(nearest(z))).sum();
    Some(total / front.len() as f64).filter(|mean| mean.is_finite())
}

/// IGD⁺ of points to a front; `None` without a point or a front. Points of the front with an infinite value are left
/// out.
pub fn igd_plus(points: &[&[f64]], front: &[&[f64]], scaling: Scaling) -> Option<f64> {
    let mut distance = match scaling {
        Scaling::ByRange => IgdPlus::to(front.iter().copied())?,
        Scaling::Unscaled => {
            let finite: Vec<&[f64]> =
                front.iter().copied().filter(|point| point.iter().all(|x| x.is_finite())).collect();
            IgdPlus::scaled(&finite, vec![1.0; finite.first()?.len()])
        }
    };
    for point in points {
        distance.add(point);
    }
    distance.value()
}

/// One over the range of each objective of a front, or 1 where it has none; `None` without a front.
fn ranges(front: &[&[f64]]) -> Option<Vec<f64>> {
    let scales = (0..front.first()?.len()).map(|at| {
        let values = front.iter().map(|point| point[at]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let range = high - low;
        if range > 0.0 { 1.0 / range } else { 1.0 }
    });
    Some(scales.collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::dominates_in_all;

    fn any_points() -> impl Strategy<Value = (Vec<Vec<f64>>, Vec<Vec<f64>>)> {
        (1usize..=4).prop_flat_map(|n| {
            let value = prop_oneof![(0i32..5).prop_map(f64::from), -3.0..5.0f64];
            let points = prop::collection::vec(prop::collection::vec(value, n), 1..12);
            (points.clone(), points)
        })
    }

    fn slices(points: &[Vec<f64>]) -> Vec<&[f64]> {
        points.iter().map(Vec::as_slice).collect()
    }

    /// The definition, word by word.
    fn naive(points: &[Vec<f64>], front: &[Vec<f64>]) -> f64 {
        let distance = |a: &[f64], z: &[f64]| -> f64 {
            let mut sum = 0.0;
            for k in 0..z.len() {
                let d = if a[k] > z[k] { a[k] - z[k] } else { 0.0 };
                sum += d * d;
            }
            libm::sqrt(sum)
        };
        let least = |z: &[f64]| points.iter().map(|a| distance(a, z)).fold(f64::INFINITY, f64::min);
        front.iter().map(|z| least(z)).sum::<f64>() / front.len() as f64
    }

    #[test]
    fn published_cases_come_out() {
        // The point is one of the front, and worse by 2 than the other in one objective, better in the other.
        let front: [&[f64]; 2] = [&[2.0, 5.0], &[4.0, 2.0]];
        let close = |value: Option<f64>, expected: f64| (value.unwrap() - expected).abs() < 1e-12;
        assert!(close(igd_plus(&[&[4.0, 2.0]], &front, Scaling::Unscaled), 1.0));
        assert!(close(
            igd_plus(&[&[5.0, 6.0]], &front, Scaling::Unscaled),
            f64::midpoint(libm::sqrt(10.0), libm::sqrt(17.0))
        ));
        // A point better than the front has the distance 0; IGD would penalise it.
        assert_eq!(igd_plus(&[&[1.0, 1.0]], &front, Scaling::Unscaled), Some(0.0));
        assert_eq!(igd_plus(&[], &front, Scaling::Unscaled), None);
        assert_eq!(igd_plus(&[&[1.0, 1.0]], &[], Scaling::Unscaled), None);
    }

    #[test]
    fn a_point_better_than_the_front_is_as_far_from_it_as_a_worse_one_in_igd() {
        let front: [&[f64]; 2] = [&[0.0, 1.0], &[1.0, 0.0]];
        assert_eq!(igd(&[&[0.0, 1.0], &[1.0, 0.0]], &front, Scaling::Unscaled), Some(0.0));
        assert_eq!(igd(&[&[0.0, 0.0]], &front, Scaling::Unscaled), Some(1.0));
        assert_eq!(igd_plus(&[&[0.0, 0.0]], &front, Scaling::Unscaled), Some(0.0));
        assert_eq!(igd(&[], &front, Scaling::Unscaled), None);
        assert_eq!(igd(&[&[0.0, 0.0]], &[&[f64::INFINITY, 0.0]], Scaling::ByRange), None);
    }

    #[test]
    fn objectives_are_measured_in_lengths_of_the_front() {
        let front: [&[f64]; 2] = [&[0.0, 1000.0], &[10.0, 0.0]];
        let mut distance = IgdPlus::to(front).unwrap();
        distance.add(&[0.0, 1100.0]);
        // To the first point a tenth of the front's height, to the second all of it and a tenth.
        assert!((distance.value().unwrap() - 0.6).abs() < 1e-12);
        assert_eq!(IgdPlus::to([&[f64::NEG_INFINITY, 0.0][..]]), None);
    }

    proptest! {
        #[test]
        fn it_is_what_the_definition_says((points, front) in any_points()) {
            let ours = igd_plus(&slices(&points), &slices(&front), Scaling::Unscaled).unwrap();
            let expected = naive(&points, &front);
            prop_assert!((ours - expected).abs() <= 1e-12 * expected.max(1.0), "{ours} {expected}");
        }

        #[test]
        fn igd_is_what_the_definition_says((points, front) in any_points()) {
            let distance = |a: &[f64], z: &[f64]| libm::sqrt(a.iter().zip(z).map(|(a, z)| (a - z) * (a - z)).sum());
            let naive = |points: &[Vec<f64>], front: &[Vec<f64>]| {
                let least = |z: &Vec<f64>| points.iter().map(|a| distance(a, z)).fold(f64::INFINITY, f64::min);
                front.iter().map(least).sum::<f64>() / front.len() as f64
            };
            let ours = igd(&slices(&points), &slices(&front), Scaling::Unscaled).unwrap();
            prop_assert!((ours - naive(&points, &front)).abs() <= 1e-12 * ours.max(1.0), "{ours}");
            prop_assert!(igd_plus(&slices(&points), &slices(&front), Scaling::Unscaled).unwrap() <= ours + 1e-12);
            // Scaled, it is that of the scaled points: pymoo's `IGD(front, zero_to_one=True)`.
            let unit = |of: &[Vec<f64>]| -> Vec<Vec<f64>> {
                let scaled = |point: &Vec<f64>| {
                    let ends = |at: usize| {
                        let values = front.iter().map(|point| point[at]);
                        (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
                    };
                    let to_unit = |(at, x): (usize, &f64)| {
                        let (low, high) = ends(at);
                        (x - low) / if high > low { high - low } else { 1.0 }
                    };
                    point.iter().enumerate().map(to_unit).collect()
                };
                of.iter().map(scaled).collect()
            };
            let scaled = igd(&slices(&points), &slices(&front), Scaling::ByRange).unwrap();
            let expected = naive(&unit(&points), &unit(&front));
            prop_assert!((scaled - expected).abs() <= 1e-9 * expected.max(1.0), "{scaled} {expected}");
        }

        #[test]
        fn points_that_others_dominate_make_no_difference((points, front) in any_points()) {
            let mut all = IgdPlus::to(slices(&front)).unwrap();
            let mut best = all.clone();
            for point in &points {
                all.add(point);
                if !points.iter().any(|other| dominates_in_all(other, point)) {
                    best.add(point);
                }
            }
            prop_assert_eq!(all.value(), best.value());
        }
    }
}
