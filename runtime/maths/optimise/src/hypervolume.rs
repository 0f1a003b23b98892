//! Hypervolume: the volume that a set of points dominates up to a reference point, all objectives minimised.
//!
//! Exact volumes are computed by sweeps for two and three objectives (the latter after Beume et al. 2009), and by WFG
//! for more (While, Bradstreet and Barone 2012): the volume of a set is the sum over its points of the volume that a
//! point dominates and no later point does. Points are sorted by their last objective, the worst first, so the part of
//! a point's box that later points dominate has the height of the whole box, and each step of the recursion has one
//! objective less. Each step leaves dominated points out, which makes the algorithm fast.
//!
//! The work still grows exponentially in the number of objectives. [`measured`] therefore counts it, and beyond a limit
//! estimates the volume from random samples in one of two ways: samples from the bounding box of all points, of which
//! the dominated share is counted; or (Karp and Luby 1983) samples from the boxes of single points, each box with a
//! probability in proportion to its volume, with the mean of 1 / k for a sample in k boxes. The first way is good where
//! much of the box is dominated, the second also where little is; a pilot sample decides between them. Neither the
//! count nor the samples depend on the machine: equal sets have equal volumes, estimated or not.

use std::cmp::Ordering;

use sesame_rng::Stream;

use crate::dominance::{ascending, lexicographic};

/// The most coordinates that an exact computation reads or writes before the volume is estimated instead: a few tenths
/// of a second.
pub const WORK: u64 = 60_000_000;

/// The most coordinates that an estimate compares.
const ESTIMATING_WORK: u64 = 80_000_000;
/// Samples of an estimate, at least and at most.
const SAMPLES: (u64, u64) = (4_000, 100_000);
/// If a sample of `n` shows no growth, the upper bound of the share of growth, times `n`: with a greater share, such a
/// sample has a probability of less than 5 % (the rule of three).
const UNSEEN: f64 = 3.0;
/// The 95th percentile of the standard normal distribution.
const ONE_SIDED: f64 = 1.645;

/// A hypervolume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// The volume, or an estimate of it.
    pub value: f64,
    /// The standard error of an estimate; `None` of an exact volume.
    pub error: Option<f64>,
}

/// How much more a set of points dominates than another, as a share of the volume that it dominates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// The share, in `0..=1`, or an estimate of it.
    pub share: f64,
    /// For an estimate: an upper bound of the share with a confidence of about 95 %.
    pub at_most: Option<f64>,
}

/// The volume dominated by the points and bounded by the reference, always exact, however long it takes. A point counts
/// only if it is below the reference in every objective. The reference must be finite, and the points must be as long
/// as the reference and free of NaN; without objectives the volume is 0.
pub fn hypervolume(points: &[&[f64]], reference: &[f64]) -> f64 {
    measured(points, reference, u64::MAX).value
}

/// As [`hypervolume`], estimated where an exact computation would read or write more than `work` coordinates. With
/// three objectives or fewer it is always exact.
pub fn measured(points: &[&[f64]], reference: &[f64], work: u64) -> Volume {
    let exact = |value| Volume { value, error: None };
    let Some(points) = inside(points, reference) else { return exact(f64::INFINITY) };
    if reference.is_empty() {
        return exact(0.0);
    }
    let mut counted = Counted { left: work };
    match counted.volume(points.clone(), reference) {
        Some(value) => exact(value),
        None => Boxes::of(&points, reference).volume(),
    }
}

/// How much more the points of `now` dominate than those of `then`, each of which must be in `now` or dominated by a
/// point of `now`; 0 if `now` dominates nothing or an infinite volume. Work is bounded as in [`measured`].
pub fn growth(now: &[&[f64]], then: &[&[f64]], reference: &[f64], work: u64) -> Growth {
    let exact = |share| Growth { share, at_most: None };
    let (Some(now), Some(then)) = (inside(now, reference), inside(then, reference)) else { return exact(0.0) };
    if now == then || now.is_empty() || reference.is_empty() {
        return exact(0.0);
    }
    let mut counted = Counted { left: work };
    let volumes = counted
        .volume(now.clone(), reference)
        .and_then(|volume| Some((volume, counted.volume(then.clone(), reference)?)));
    match volumes {
        Some((now, then)) => exact(if now > 0.0 { (now - then) / now } else { 0.0 }),
        None => Boxes::of(&now, reference).growth(&then),
    }
}

/// The points below the reference; `None` if one of them is infinite.
fn inside(points: &[&[f64]], reference: &[f64]) -> Option<Vec<Vec<f64>>> {
    assert!(reference.iter().all(|bound| bound.is_finite()), "a hypervolume has a finite reference point");
    let points: Vec<Vec<f64>> = points
        .iter()
        .inspect(|point| assert!(point.len() == reference.len(), "a point has as many values as the reference"))
        .filter(|point| point.iter().zip(reference).all(|(x, bound)| x < bound))
        .map(|point| point.to_vec())
        .collect();
    (!points.iter().flatten().any(|x| x.is_infinite())).then_some(points)
}

/// An exact computation that stops when its work is spent.
struct Counted {
    left: u64,
}

impl Counted {
    fn spend(&mut self, coordinates: usize) -> Option<()> {
        self.left = self.left.checked_sub(coordinates as u64)?;
        Some(())
    }

    /// The volume that points dominate, all of which are finite and below the reference.
    fn volume(&mut self, points: Vec<Vec<f64>>, reference: &[f64]) -> Option<f64> {
        let [.., _, _, _, _] = *reference else { return Some(swept(points, reference)) };
        let mut set = Set { objectives: reference.len(), values: Vec::new() };
        for point in points {
            self.spend(set.values.len())?;
            set.add(&point);
        }
        self.sliced(&mut set, reference)
    }

    /// As [`Counted::volume`], for points of which none dominates another.
    fn sliced(&mut self, set: &mut Set, reference: &[f64]) -> Option<f64> {
        let objectives = reference.len();
        let own = |point: &[f64]| extent(point, reference);
        let rows = set.values.len() / objectives;
        self.spend(objectives * rows)?;
        match rows {
            0 => return Some(0.0),
            1 => return Some(own(&set.values)),
            2 => {
                let (first, second) = set.values.split_at(objectives);
                let common: Vec<f64> = first.iter().zip(second).map(|(a, b)| a.max(*b)).collect();
                return Some(own(first) + own(second) - own(&common));
            }
            _ => {}
        }
        if objectives == 3 {
            // A sweep sorts, so it costs more than reading all points.
            self.spend(6 * rows)?;
            return Some(swept_space(
                set.values.chunks(3).map(|point| [point[0], point[1], point[2]]).collect(),
                reference,
            ));
        }
        set.worst_last_first();
        let (last, below) = (objectives - 1, &reference[..objectives - 1]);
        let mut total = 0.0;
        let mut corner = Vec::with_capacity(last);
        let mut limited = Set { objectives: last, values: Vec::with_capacity(last * rows) };
        for at in 0..rows {
            let point = &set.values[at * objectives..][..objectives];
            let own = extent(&point[..last], below);
            // The part of this point's box that later points dominate: their corners are moved into it. Later points
            // are at least as good in the last objective, so these boxes have the height of the whole box.
            limited.values.clear();
            for other in set.values[(at + 1) * objectives..].chunks(objectives) {
                corner.clear();
                corner.extend(other.iter().zip(&point[..last]).map(|(a, b)| a.max(*b)));
                let compared = limited.add(&corner);
                self.spend(last + 2 * compared)?;
            }
            total += (reference[last] - point[last]) * (own - self.sliced(&mut limited, below)?);
        }
        Some(total)
    }
}

/// Up to this number, rows are sorted in place.
const FEW: usize = 12;

/// Points of which none dominates or equals another, row by row.
struct Set {
    objectives: usize,
    values: Vec<f64>,
}

impl Set {
    /// Adds a point unless another dominates or equals it, and removes those that it dominates. Returns the number of
    /// comparisons.
    fn add(&mut self, point: &[f64]) -> usize {
        let wide = self.objectives;
        let rows = self.values.len() / wide;
        if let Some(at) = self.values.chunks(wide).position(|other| holds(other, point)) {
            // A point that dominates one other often dominates many, so it is moved to the front.
            if at > 0 {
                let (front, rest) = self.values.split_at_mut(at * wide);
                front[..wide].swap_with_slice(&mut rest[..wide]);
            }
            return at + 1;
        }
        let mut kept = 0;
        for at in 0..rows {
            if !holds(point, &self.values[at * wide..][..wide]) {
                self.values.copy_within(at * wide..(at + 1) * wide, kept * wide);
                kept += 1;
            }
        }
        self.values.truncate(kept * wide);
        self.values.extend_from_slice(point);
        2 * rows
    }

    fn worst_last_first(&mut self) {
        let wide = self.objectives;
        let worse = |a: &[f64], b: &[f64]| ascending(b[wide - 1], a[wide - 1]).then_with(|| lexicographic(a, b));
        let rows = self.values.len() / wide;
        if rows > FEW {
            let mut rows: Vec<&[f64]> = self.values.chunks(wide).collect();
            rows.sort_by(|a, b| worse(a, b));
            self.values = rows.concat();
            return;
        }
        // Most sets have few points, which are sorted in place.
        for at in 1..rows {
            let point = &self.values[at * wide..][..wide];
            let place = self.values.chunks(wide).take(at).position(|other| worse(point, other) == Ordering::Less);
            if let Some(place) = place {
                self.values[place * wide..(at + 1) * wide].rotate_right(wide);
            }
        }
    }
}

/// The volume of any points with at most three objectives.
fn swept(mut points: Vec<Vec<f64>>, reference: &[f64]) -> f64 {
    match *reference {
        [] => 0.0,
        [end] => points.iter().map(|point| end - point[0]).fold(0.0, f64::max),
        [x, y] => {
            points.sort_by(|a, b| lexicographic(a, b));
            let mut top = y;
            let mut area = 0.0;
            for point in &points {
                if point[1] < top {
                    area += (x - point[0]) * (top - point[1]);
                    top = point[1];
                }
            }
            area
        }
        _ => swept_space(points.iter().map(|point| [point[0], point[1], point[2]]).collect(), reference),
    }
}

/// As [`swept`], for three objectives: a plane moves up the third one, and the area dominated below it only grows.
fn swept_space(mut points: Vec<[f64; 3]>, reference: &[f64]) -> f64 {
    let (right, top, end) = (reference[0], reference[1], reference[2]);
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
    /// The nondominated points: the first coordinate ascends, the second descends.
    steps: Vec<(f64, f64)>,
    right: f64,
    top: f64,
}

impl Stairs {
    /// Adds a point, and returns the growth of the area.
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

/// The boxes that points dominate, from which samples are drawn.
struct Boxes<'a> {
    points: Vec<&'a [f64]>,
    reference: &'a [f64],
    /// The best value of each objective.
    ideal: Vec<f64>,
    /// The cumulative volumes of the boxes.
    upto: Vec<f64>,
}

/// How samples are drawn.
#[derive(Debug, Clone, Copy)]
enum Drawn {
    /// From the boxes, each with a probability in proportion to its volume; a sample in k boxes weighs 1 / k.
    FromBoxes,
    /// From the bounding box of all of them; a sample in none of the boxes weighs 0, any other 1.
    FromAround,
}

impl<'a> Boxes<'a> {
    /// The boxes of points below the reference, of which there must be one.
    fn of(points: &'a [Vec<f64>], reference: &'a [f64]) -> Boxes<'a> {
        let mut points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        points.sort_by(|a, b| lexicographic(a, b));
        points.dedup_by(|later, first| lexicographic(later, first) == Ordering::Equal);
        let best = |at: usize| points.iter().map(|point| point[at]).fold(f64::INFINITY, f64::min);
        let ideal: Vec<f64> = (0..reference.len()).map(best).collect();
        let mut sum = 0.0;
        let volumes = points.iter().map(|point| {
            sum += extent(point, reference);
            sum
        });
        Boxes { upto: volumes.collect(), points, reference, ideal }
    }

    /// The volume from which samples are drawn.
    fn whole(&self, drawn: Drawn) -> f64 {
        match drawn {
            Drawn::FromBoxes => self.upto.last().copied().unwrap_or_default(),
            Drawn::FromAround => extent(&self.ideal, self.reference),
        }
    }

    /// Draws samples and passes them on with their weights. Boxes are chosen at even steps through their cumulative
    /// volumes, from a random start.
    fn sample(&self, drawn: Drawn, count: u64, purpose: &str, each: &mut dyn FnMut(f64, &[f64])) {
        let mut stream = Stream::derive(0, purpose, &[self.reference.len() as u64, self.points.len() as u64]);
        let begin = stream.unit();
        let whole = self.whole(drawn);
        let mut sample = vec![0.0; self.reference.len()];
        for at in 0..count {
            let low = match drawn {
                Drawn::FromAround => self.ideal.as_slice(),
                Drawn::FromBoxes => {
                    let place = whole * (at as f64 + begin) / count as f64;
                    self.points[self.upto.partition_point(|&upto| upto <= place).min(self.points.len() - 1)]
                }
            };
            for ((x, low), high) in sample.iter_mut().zip(low).zip(self.reference) {
                *x = low + (high - low) * stream.unit();
            }
            let mut holding = self.points.iter().filter(|point| holds(point, &sample));
            let weight = match drawn {
                Drawn::FromAround => f64::from(u8::from(holding.next().is_some())),
                Drawn::FromBoxes => 1.0 / holding.count().max(1) as f64,
            };
            each(weight, &sample);
        }
    }

    /// The way to draw that has the smaller variance according to a pilot sample, and how many samples to draw.
    fn best_way(&self) -> (Drawn, u64) {
        let count = ESTIMATING_WORK / (self.points.len() * self.reference.len()) as u64;
        let (mut sum, mut squares) = (0.0, 0.0);
        self.sample(Drawn::FromBoxes, SAMPLES.0, "hypervolume pilot", &mut |weight, _| {
            sum += weight;
            squares += weight * weight;
        });
        let n = SAMPLES.0 as f64;
        let share = (sum / n * self.whole(Drawn::FromBoxes) / self.whole(Drawn::FromAround)).min(1.0);
        // The variance of one sample, divided by the squared mean.
        let (from_boxes, from_around) = (squares * n / (sum * sum) - 1.0, (1.0 - share) / share);
        let drawn = if from_around < from_boxes { Drawn::FromAround } else { Drawn::FromBoxes };
        (drawn, count.clamp(SAMPLES.0, SAMPLES.1))
    }

    fn volume(&self) -> Volume {
        let (drawn, count) = self.best_way();
        let (mut sum, mut squares) = (0.0, 0.0);
        self.sample(drawn, count, "hypervolume", &mut |weight, _| {
            sum += weight;
            squares += weight * weight;
        });
        let (whole, n) = (self.whole(drawn), count as f64);
        let mean = sum / n;
        let variance = (squares / n - mean * mean).max(0.0);
        Volume { value: whole * mean, error: Some(whole * libm::sqrt(variance / n)) }
    }

    /// The share of the boxes' volume that the points of `then` do not dominate.
    fn growth(&self, then: &[Vec<f64>]) -> Growth {
        let (drawn, count) = self.best_way();
        let (mut all, mut new, mut all_squared, mut new_squared) = (0.0, 0.0, 0.0, 0.0);
        self.sample(drawn, count, "hypervolume", &mut |weight, sample| {
            all += weight;
            all_squared += weight * weight;
            if weight > 0.0 && !then.iter().any(|point| holds(point, sample)) {
                new += weight;
                new_squared += weight * weight;
            }
        });
        if all <= 0.0 {
            return Growth { share: 1.0, at_most: Some(1.0) };
        }
        let share = new / all;
        // The variance of a ratio of two means, where the numerator is a part of the denominator.
        let variance = (new_squared * (1.0 - 2.0 * share) + share * share * all_squared).max(0.0) / (all * all);
        let at_most = (share + ONE_SIDED * libm::sqrt(variance)).max(UNSEEN / all);
        Growth { share, at_most: Some(at_most.min(1.0)) }
    }
}

/// The volume of the box between a point and the reference.
fn extent(point: &[f64], reference: &[f64]) -> f64 {
    point.iter().zip(reference).map(|(x, bound)| bound - x).product()
}

/// Whether a point dominates another or equals it.
fn holds(point: &[f64], other: &[f64]) -> bool {
    point.iter().zip(other).all(|(low, x)| low <= x)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The volume of a union of boxes by inclusion and exclusion over all subsets.
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
            points in (1usize..=6).prop_flat_map(|n| {
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

    /// Points on a sphere around the origin, of which none dominates another.
    fn sphere(objectives: usize, count: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut stream = Stream::derive(seed, "sphere", &[]);
        let point = |_| {
            let ray: Vec<f64> = (0..objectives).map(|_| stream.normal().abs()).collect();
            let length = libm::sqrt(ray.iter().map(|x| x * x).sum());
            ray.iter().map(|x| x / length).collect()
        };
        (0..count).map(point).collect()
    }

    fn slices(points: &[Vec<f64>]) -> Vec<&[f64]> {
        points.iter().map(Vec::as_slice).collect()
    }

    /// The recursion over exclusive volumes, without slices, sorting or sweeps.
    fn plain(points: &[Vec<f64>], reference: &[f64]) -> f64 {
        let mut total = 0.0;
        for (at, point) in points.iter().enumerate() {
            let moved = |other: &Vec<f64>| other.iter().zip(point).map(|(a, b)| a.max(*b)).collect();
            let mut limited: Vec<Vec<f64>> = points[at + 1..].iter().map(moved).collect();
            limited.sort_by(|a, b| lexicographic(a, b));
            limited.dedup();
            let all = limited.clone();
            limited.retain(|point| !all.iter().any(|other| other != point && holds(other, point)));
            total += extent(point, reference) - plain(&limited, reference);
        }
        total
    }

    #[test]
    fn slicing_by_objectives_does_not_change_the_volume() {
        for (objectives, count) in [(3, 60), (4, 40), (5, 24), (6, 16), (7, 12)] {
            let points = sphere(objectives, count, 3);
            let reference = vec![1.1; objectives];
            let (sliced, plain) = (hypervolume(&slices(&points), &reference), plain(&points, &reference));
            assert!((sliced - plain).abs() < 1e-9, "{objectives}: {sliced} and {plain}");
        }
    }

    #[test]
    fn a_volume_that_takes_too_much_work_is_estimated_with_its_standard_error() {
        // The first sets dominate much of their bounding box, the last one almost nothing, so both ways to draw are
        // used.
        let far: Vec<Vec<f64>> = (0..6).map(|at| (0..6).map(|k| if k == at { 0.0 } else { 0.98 }).collect()).collect();
        for points in [sphere(6, 30, 1), sphere(5, 60, 2), far] {
            let reference = vec![1.0; points[0].len()];
            let (points, reference) = (slices(&points), reference.as_slice());
            let exact = measured(&points, reference, WORK);
            assert_eq!(exact, Volume { value: hypervolume(&points, reference), error: None });
            let estimated = measured(&points, reference, 10);
            let error = estimated.error.expect("ten coordinates do not suffice");
            assert!((estimated.value - exact.value).abs() < 4.0 * error, "{estimated:?} of {exact:?}");
            assert!(error < 0.05 * exact.value, "{estimated:?} of {exact:?}");
            assert_eq!(measured(&points, reference, 10), estimated, "the same every time");
        }
    }

    #[test]
    fn work_for_a_front_of_eight_objectives_is_bounded() {
        let points = sphere(8, 200, 1);
        let mut counted = Counted { left: WORK / 100 };
        assert_eq!(counted.volume(points.clone(), &[1.1; 8]), None);
        // With three objectives, work is not limited.
        let flat = sphere(3, 500, 1);
        assert_eq!(measured(&slices(&flat), &[1.1; 3], 0).error, None);
    }

    #[test]
    fn growth_is_the_share_of_new_volume_and_an_estimate_has_an_upper_bound() {
        let points = sphere(5, 40, 9);
        let reference = vec![1.1; 5];
        for kept in [1, 20, 35, 39] {
            let (now, then) = (slices(&points), slices(&points[..kept]));
            let (all, before) = (hypervolume(&now, &reference), hypervolume(&then, &reference));
            let exact = growth(&now, &then, &reference, WORK);
            assert!((exact.share - (all - before) / all).abs() < 1e-12 && exact.at_most.is_none());
            let estimated = growth(&now, &then, &reference, 1_000);
            let at_most = estimated.at_most.expect("a thousand coordinates do not suffice");
            assert!(estimated.share <= at_most && exact.share < at_most + 0.01, "{estimated:?} of {exact:?}");
            assert!((estimated.share - exact.share).abs() < 0.02, "{estimated:?} of {exact:?}");
        }
        let same = slices(&points);
        assert_eq!(growth(&same, &same, &reference, 0), Growth { share: 0.0, at_most: None });
    }

    #[test]
    fn infinite_points_have_an_infinite_volume_or_none() {
        let below: &[f64] = &[f64::NEG_INFINITY, 0.0];
        let above: &[f64] = &[f64::INFINITY, 0.0];
        let inside: &[f64] = &[0.0, 0.0];
        assert_eq!(hypervolume(&[below, inside], &[1.0, 1.0]), f64::INFINITY);
        assert_eq!(hypervolume(&[above, inside], &[1.0, 1.0]), 1.0);
        assert_eq!(hypervolume(&[], &[1.0, 1.0]), 0.0);
    }
}
