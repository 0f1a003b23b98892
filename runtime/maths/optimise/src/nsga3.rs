//! Survival by reference points, as in NSGA-III [Deb and Jain 2014]: for three and more objectives, where most
//! solutions are non-dominated and crowding distances say little.
//!
//! Reference points are spread evenly over the unit simplex [Das and Dennis 1998]. Objectives are scaled by a
//! hyperplane through the extreme points of the front; then each solution belongs to the reference line that is nearest
//! to it, its niche. Solutions of the emptiest niches survive in the last front, which does not fit as a whole.

use sesame_rng::Stream;

use crate::dominance::Fitness;
use crate::selection::Rank;
use crate::sorting::fronts;

/// The weight of the other objectives where the extreme point of one objective is sought.
const ASIDE: f64 = 1e6;
/// Lengths below this are taken for 0.
const SMALL: f64 = 1e-6;

/// All points of the unit simplex whose coordinates are multiples of `1 / partitions`, in lexicographic order.
pub fn das_dennis(objectives: usize, partitions: usize) -> Vec<Vec<f64>> {
    fn extend(point: &mut Vec<usize>, left: usize, objectives: usize, points: &mut Vec<Vec<usize>>) {
        if point.len() + 1 == objectives {
            point.push(left);
            points.push(point.clone());
            point.pop();
            return;
        }
        for part in 0..=left {
            point.push(part);
            extend(point, left - part, objectives, points);
            point.pop();
        }
    }
    let mut points = Vec::new();
    if objectives > 0 && partitions > 0 {
        extend(&mut Vec::new(), partitions, objectives, &mut points);
    }
    points.iter().map(|point| point.iter().map(|&part| part as f64 / partitions as f64).collect()).collect()
}

/// How many points [`das_dennis`] gives; `None` if they are more than `most`.
fn das_dennis_count(objectives: usize, partitions: usize, most: usize) -> Option<usize> {
    // Binomial(partitions + objectives - 1, objectives - 1), each step of which is a whole number.
    (1..objectives).try_fold(1usize, |count, k| {
        let next = count.checked_mul(partitions + k)? / k;
        (next <= most).then_some(next)
    })
}

/// As many reference points as a population of this size can serve: the finest spread of [`das_dennis`], and where it
/// has no point inside the simplex, a second layer half as large, if that fits too. At least the corners.
pub fn reference_points(objectives: usize, population: usize) -> Vec<Vec<f64>> {
    if objectives < 2 {
        return vec![vec![1.0; objectives]];
    }
    let finest = |most: usize| {
        (1..=most).take_while(|&partitions| das_dennis_count(objectives, partitions, most).is_some()).last()
    };
    let partitions = finest(population).unwrap_or(1);
    let mut points = das_dennis(objectives, partitions);
    let left = population.saturating_sub(points.len());
    if partitions < objectives
        && let Some(inner) = finest(left)
    {
        let middle = 0.5 / objectives as f64;
        let inner = das_dennis(objectives, inner);
        points.extend(inner.into_iter().map(|point| point.into_iter().map(|x| 0.5 * x + middle).collect()));
    }
    points
}

/// Survival by reference points. What it has seen of the objectives stays from generation to generation.
#[derive(Debug, Clone, Default)]
pub struct ReferencePoints {
    points: Vec<Vec<f64>>,
    /// The best and the worst value of each objective so far.
    ideal: Vec<f64>,
    worst: Vec<f64>,
    /// Per objective, the point of a front that was farthest along it.
    extremes: Vec<Vec<f64>>,
}

/// The niche of a solution, and how far it is from its reference line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Niche {
    point: usize,
    distance: f64,
}

impl ReferencePoints {
    /// The `n` survivors (all when there are no more), as positions in ascending order with their ranks. Measured
    /// solutions have one rank, so that parents are drawn from them at random; others come after them, the least
    /// infeasible first.
    pub fn survivors(&mut self, fitness: &[&Fitness], n: usize, stream: &mut Stream) -> Vec<(usize, Rank)> {
        let fronts = fronts(fitness);
        let rank = |front: usize, position: usize| {
            let front = if fitness[position].objectives().is_some() { 0 } else { 1 + front };
            (position, Rank { front, crowding: 0.0 })
        };
        let mut chosen: Vec<(usize, Rank)> = Vec::with_capacity(n.min(fitness.len()));
        let mut whole: Vec<usize> = Vec::new();
        for (number, front) in fronts.iter().enumerate() {
            let room = n - chosen.len();
            let members = match fitness[front[0]].objectives() {
                Some(objectives) => {
                    if number == 0 {
                        self.observe(fitness, front, objectives.len(), n);
                    }
                    if front.len() <= room { front.clone() } else { self.fill(fitness, &whole, front, room, stream) }
                }
                None => front[..room.min(front.len())].to_vec(),
            };
            whole.extend(&members);
            chosen.extend(members.into_iter().map(|position| rank(number, position)));
            if chosen.len() == n {
                break;
            }
        }
        chosen.sort_unstable_by_key(|&(position, _)| position);
        chosen
    }

    /// Takes all measured solutions, and the first front among them, into account.
    fn observe(&mut self, fitness: &[&Fitness], front: &[usize], objectives: usize, population: usize) {
        if self.points.is_empty() {
            self.points = reference_points(objectives, population);
            self.ideal = vec![f64::INFINITY; objectives];
            self.worst = vec![f64::NEG_INFINITY; objectives];
        }
        for values in fitness.iter().filter_map(|fitness| fitness.objectives()) {
            for (at, &value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                self.ideal[at] = self.ideal[at].min(value);
                self.worst[at] = self.worst[at].max(value);
            }
        }
        let mut candidates = std::mem::take(&mut self.extremes);
        let finite = |values: &&[f64]| values.iter().all(|value| value.is_finite());
        let of_front = front.iter().filter_map(|&position| fitness[position].objectives()).filter(finite);
        candidates.extend(of_front.map(<[f64]>::to_vec));
        let achievement = |values: &[f64], along: usize| {
            let scaled = values.iter().zip(&self.ideal).enumerate().map(|(at, (value, ideal))| {
                let beyond = if value - ideal < 1e-3 { 0.0 } else { value - ideal };
                if at == along { beyond } else { beyond * ASIDE }
            });
            scaled.fold(0.0, f64::max)
        };
        let extreme = |along: usize| {
            let best = candidates.iter().min_by(|a, b| achievement(a, along).total_cmp(&achievement(b, along)));
            best.cloned()
        };
        self.extremes = (0..objectives).filter_map(extreme).collect();
    }

    /// The length of each objective, from the best value to where the hyperplane of the extreme points meets its axis;
    /// where there is no such plane, to the worst value of the front.
    fn lengths(&self, fitness: &[&Fitness], front: &[usize]) -> Vec<f64> {
        let objectives = self.ideal.len();
        let rows: Vec<Vec<f64>> = self
            .extremes
            .iter()
            .map(|point| point.iter().zip(&self.ideal).map(|(x, ideal)| x - ideal).collect())
            .collect();
        let plane = if rows.len() == objectives { solve(rows, vec![1.0; objectives]) } else { None };
        let intercepts = plane.map(|plane| plane.iter().map(|x| 1.0 / x).collect::<Vec<f64>>());
        let intercepts = intercepts.filter(|of| of.iter().all(|&x| x.is_finite() && x > SMALL));
        (0..objectives)
            .map(|at| {
                let spread = self.worst[at] - self.ideal[at];
                let of_front = || {
                    let values = front.iter().filter_map(|&position| fitness[position].objectives());
                    let worst =
                        values.map(|values| values[at]).filter(|x| x.is_finite()).fold(self.ideal[at], f64::max);
                    worst - self.ideal[at]
                };
                let length = intercepts.as_ref().map_or_else(of_front, |intercepts| intercepts[at].min(spread));
                let length = if length > SMALL { length } else { spread };
                if length > SMALL { length } else { 1.0 }
            })
            .collect()
    }

    /// The niche of a solution. Infinite values count as the best or the worst ones so far.
    fn niche(&self, values: &[f64], lengths: &[f64]) -> Niche {
        let scaled: Vec<f64> = (0..values.len())
            .map(|at| {
                (values[at].clamp(self.ideal[at], self.worst[at].max(self.ideal[at])) - self.ideal[at]) / lengths[at]
            })
            .collect();
        let mut nearest = Niche { point: 0, distance: f64::INFINITY };
        for (point, direction) in self.points.iter().enumerate() {
            let distance = distance_to_line(&scaled, direction);
            if distance < nearest.distance {
                nearest = Niche { point, distance };
            }
        }
        nearest
    }

    /// The members of a front that survive if it does not fit as a whole: in turn one of the emptiest niche, the
    /// nearest to its line if the niche is empty, any of its members otherwise.
    fn fill(
        &self,
        fitness: &[&Fitness],
        whole: &[usize],
        front: &[usize],
        room: usize,
        stream: &mut Stream,
    ) -> Vec<usize> {
        let first = if whole.is_empty() { front } else { whole };
        let lengths = self.lengths(fitness, first);
        let niche = |&position: &usize| {
            let values = fitness[position].objectives().expect("the fronts before, and this one, are measured");
            self.niche(values, &lengths)
        };
        let mut counts = vec![0u32; self.points.len()];
        for position in whole {
            counts[niche(position).point] += 1;
        }
        let mut waiting: Vec<Vec<(usize, f64)>> = vec![Vec::new(); self.points.len()];
        for position in front {
            let Niche { point, distance } = niche(position);
            waiting[point].push((*position, distance));
        }
        let mut chosen = Vec::with_capacity(room);
        while chosen.len() < room {
            let open = |point: &usize| !waiting[*point].is_empty();
            let fewest = (0..counts.len()).filter(open).map(|point| counts[point]).min();
            let fewest = fewest.expect("the front has more members than there is room for");
            let emptiest: Vec<usize> =
                (0..counts.len()).filter(open).filter(|&point| counts[point] == fewest).collect();
            let point = emptiest[stream.below(emptiest.len())];
            let members = &mut waiting[point];
            let at = if fewest == 0 {
                let nearest = members.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
                nearest.expect("the niche is open").0
            } else {
                stream.below(members.len())
            };
            chosen.push(members.remove(at).0);
            counts[point] += 1;
        }
        chosen
    }
}

/// How far a point is from the line through the origin in this direction.
fn distance_to_line(point: &[f64], direction: &[f64]) -> f64 {
    let dot: f64 = point.iter().zip(direction).map(|(a, b)| a * b).sum();
    let along = dot / direction.iter().map(|x| x * x).sum::<f64>();
    let squares = point.iter().zip(direction).map(|(a, b)| (a - along * b) * (a - along * b));
    libm::sqrt(squares.sum())
}

/// The solution of a system of linear equations, by Gaussian elimination with pivoting; `None` if there is not one.
fn solve(mut rows: Vec<Vec<f64>>, mut right: Vec<f64>) -> Option<Vec<f64>> {
    let n = right.len();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        if rows[pivot][column].abs() < 1e-12 {
            return None;
        }
        rows.swap(column, pivot);
        right.swap(column, pivot);
        let head = rows[column].clone();
        for row in (0..n).filter(|&row| row != column) {
            let factor = rows[row][column] / head[column];
            rows[row].iter_mut().zip(&head).for_each(|(x, h)| *x -= factor * h);
            right[row] -= factor * right[column];
        }
    }
    Some((0..n).map(|row| right[row] / rows[row][row]).collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::Unfit;
    use crate::dominance::tests::any_population;

    #[test]
    fn reference_points_are_those_of_das_and_dennis_and_as_many_as_the_population_serves() {
        assert_eq!(das_dennis(2, 2), [[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]);
        // The numbers of the paper: 91 points for 3 objectives and 12 partitions, 210 for 5 and 6.
        assert_eq!((das_dennis(3, 12).len(), das_dennis(5, 6).len()), (91, 210));
        assert_eq!((reference_points(3, 100).len(), reference_points(5, 212).len()), (91, 210));
        // For 8 objectives two layers of 3 and 2 partitions: 120 and 36.
        assert_eq!(reference_points(8, 156).len(), 156);
        // A population smaller than the corners still has those.
        assert_eq!((reference_points(5, 2).len(), reference_points(1, 10).len()), (5, 1));
    }

    proptest! {
        #[test]
        fn reference_points_lie_on_the_unit_simplex_each_once(objectives in 2usize..7, population in 2usize..300) {
            let points = reference_points(objectives, population);
            prop_assert!(points.len() <= population.max(objectives));
            for (at, point) in points.iter().enumerate() {
                prop_assert!((point.iter().sum::<f64>() - 1.0).abs() < 1e-9 && point.iter().all(|&x| x >= 0.0));
                prop_assert!(!points[..at].contains(point));
            }
        }

        #[test]
        fn a_solution_belongs_to_the_line_that_is_nearest_by_projection(
            values in prop::collection::vec(0.0..1.0f64, 3), population in 3usize..60,
        ) {
            let points = reference_points(3, population);
            let state = ReferencePoints {
                points: points.clone(), ideal: vec![0.0; 3], worst: vec![1.0; 3], extremes: Vec::new(),
            };
            let niche = state.niche(&values, &[1.0; 3]);
            // By Pythagoras: the square of the distance is that of the point minus that of its projection.
            let naive = |line: &Vec<f64>| {
                let norm = libm::sqrt(line.iter().map(|x| x * x).sum::<f64>());
                let along: f64 = values.iter().zip(line).map(|(a, b)| a * b / norm).sum();
                libm::sqrt((values.iter().map(|x| x * x).sum::<f64>() - along * along).max(0.0))
            };
            let least = points.iter().map(naive).fold(f64::INFINITY, f64::min);
            prop_assert!((naive(&points[niche.point]) - least).abs() < 1e-7);
            prop_assert!((niche.distance - least).abs() < 1e-7);
        }

        #[test]
        fn whole_fronts_survive_and_of_the_last_one_no_niche_is_served_twice_before_another_is_once(
            population in any_population(), n in 1usize..40, seed: u64,
        ) {
            let all: Vec<&Fitness> = population.iter().collect();
            let mut state = ReferencePoints::default();
            let survivors = state.survivors(&all, n, &mut Stream::derive(seed, "test", &[]));
            let positions: Vec<usize> = survivors.iter().map(|(position, _)| *position).collect();
            prop_assert_eq!(positions.len(), n.min(all.len()));
            prop_assert!(positions.windows(2).all(|pair| pair[0] < pair[1]));
            let fronts = fronts(&all);
            let mut before: Vec<usize> = Vec::new();
            for front in &fronts {
                let (chosen, left): (Vec<usize>, Vec<usize>) = front.iter().partition(|at| positions.contains(at));
                if left.is_empty() {
                    before.extend(chosen);
                    continue;
                }
                // Nothing of a later front survives.
                prop_assert_eq!(before.len() + chosen.len(), positions.len());
                if all[front[0]].objectives().is_none() {
                    break;
                }
                let first = if before.is_empty() { front } else { &before };
                let lengths = state.lengths(&all, first);
                let niche = |at: &usize| state.niche(all[*at].objectives().unwrap(), &lengths);
                let count = |point: usize| positions.iter().filter(|at| niche(at).point == point).count();
                let was_empty = |point: usize| before.iter().all(|at| niche(at).point != point);
                for lost in &left {
                    let lost = niche(lost);
                    for taken in &chosen {
                        let taken = niche(taken);
                        prop_assert!(count(taken.point) <= count(lost.point) + 1);
                    }
                    // The first of an empty niche is the nearest, so of those taken one is at least as near.
                    if was_empty(lost.point) && count(lost.point) > 0 {
                        let of_niche = chosen.iter().map(niche).filter(|other| other.point == lost.point);
                        prop_assert!(of_niche.map(|member| member.distance).fold(f64::INFINITY, f64::min) <= lost.distance);
                    }
                }
                break;
            }
        }
    }

    #[test]
    fn solutions_without_objectives_come_last() {
        let population = [
            Fitness::Unfit(Unfit::Crash),
            Fitness::Infeasible { violation: 2.0 },
            Fitness::Measured(vec![1.0, 2.0, 3.0]),
            Fitness::Infeasible { violation: 1.0 },
        ];
        let all: Vec<&Fitness> = population.iter().collect();
        let survivors = ReferencePoints::default().survivors(&all, 3, &mut Stream::derive(1, "test", &[]));
        assert_eq!(survivors.iter().map(|(position, _)| *position).collect::<Vec<_>>(), [1, 2, 3]);
        let [(_, worse), (_, best), (_, better)] = survivors[..] else { panic!("{survivors:?}") };
        assert!(best.compare(better).is_lt() && better.compare(worse).is_lt());
    }
}
