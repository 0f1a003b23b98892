//! Crowding distance: how far a solution's neighbours on its front are (Deb et al. 2002, section III-B).
//!
//! Three cases that the paper leaves open are decided here, so that the distances do not depend on the order of the
//! solutions. Of several with the same objective values the first has the distance and the others have 0, as they add
//! nothing to the front. An objective on which all are equal says nothing. Where values are infinite, an infinite gap
//! counts as the whole span of the objective and a finite one as nothing.

use crate::dominance::{Fitness, ascending, lexicographic};

/// The distance of each member of a front, in the front's order; at least 0, infinite at the ends of each objective.
/// Members that are not measured have 0. `front` lists positions in `fitness` in ascending order.
pub fn distances(fitness: &[&Fitness], front: &[usize]) -> Vec<f64> {
    let mut distances = vec![0.0; front.len()];
    let mut points: Vec<(&[f64], usize)> =
        front.iter().enumerate().filter_map(|(k, &i)| fitness[i].objectives().map(|o| (o, k))).collect();
    points.sort_by(|a, b| lexicographic(a.0, b.0));
    points.dedup_by(|later, first| lexicographic(later.0, first.0).is_eq());
    if let [(_, only)] = points[..] {
        distances[only] = f64::INFINITY;
    }
    let Some(objectives) = points.first().map(|(objectives, _)| objectives.len()) else { return distances };
    for objective in 0..objectives {
        if objective > 0 {
            // Ties in the lexicographic order: neighbours are then a matter of values alone.
            points.sort_by(|a, b| ascending(a.0[objective], b.0[objective]).then_with(|| lexicographic(a.0, b.0)));
        }
        let (Some((least, first)), Some((most, last))) = (points.first(), points.last()) else { continue };
        if least[objective] == most[objective] {
            continue;
        }
        let span = most[objective] - least[objective];
        distances[*first] = f64::INFINITY;
        distances[*last] = f64::INFINITY;
        for around in points.windows(3) {
            let (below, above) = (around[0].0[objective], around[2].0[objective]);
            distances[around[1].1] += share(below, above, span);
        }
    }
    distances
}

/// The gap between two values as a share of a span; never NaN.
fn share(below: f64, above: f64, span: f64) -> f64 {
    if below == above {
        0.0
    } else if (above - below).is_infinite() {
        1.0
    } else {
        (above - below) / span
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::tests::any_population;
    use crate::sorting::tests::naive_fronts;

    fn naive_distance(fitness: &[Fitness], front: &[usize], member: usize) -> f64 {
        let Some(me) = fitness[member].objectives() else { return 0.0 };
        let points: Vec<&[f64]> = front.iter().filter_map(|&i| fitness[i].objectives()).collect();
        if front.iter().any(|&i| i < member && fitness[i].objectives() == Some(me)) {
            return 0.0;
        }
        if points.iter().all(|&p| p == me) {
            return f64::INFINITY;
        }
        let mut distance = 0.0;
        for k in 0..me.len() {
            let least = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let most = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            if least == most {
                continue;
            }
            let key = |p: &[f64]| [&p[k..=k], p].concat();
            let before = points.iter().filter(|&&p| lexicographic(&key(p), &key(me)).is_lt());
            let after = points.iter().filter(|&&p| lexicographic(&key(p), &key(me)).is_gt());
            let below = before.map(|p| p[k]).reduce(f64::max);
            let above = after.map(|p| p[k]).reduce(f64::min);
            distance += match (below, above) {
                (Some(below), Some(above)) => share(below, above, most - least),
                _ => f64::INFINITY,
            };
        }
        distance
    }

    proptest! {
        #[test]
        fn distances_are_those_of_the_definition(population in any_population()) {
            let all: Vec<&Fitness> = population.iter().collect();
            for front in naive_fronts(&population) {
                let naive: Vec<f64> = front.iter().map(|&i| naive_distance(&population, &front, i)).collect();
                prop_assert_eq!(distances(&all, &front), naive);
            }
        }
    }

    #[test]
    fn three_points_on_a_line() {
        let population = [[0.0, 4.0], [1.0, 2.0], [4.0, 0.0]].map(|pair| Fitness::Measured(pair.to_vec()));
        let all: Vec<&Fitness> = population.iter().collect();
        assert_eq!(distances(&all, &[0, 1, 2]), [f64::INFINITY, 2.0, f64::INFINITY]);
    }
}
