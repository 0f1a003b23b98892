//! Non-dominated sorting: which solutions nothing dominates, which only those dominate, and so on.
//!
//! Solutions are visited in lexicographic order, so each can only be dominated by earlier ones, and a solution that a
//! front's member dominates is dominated in every front before as well: its front is found by binary search (Zhang et
//! al. 2015, efficient non-dominated sort). With two objectives a front's latest member alone decides, which makes it
//! O(n log n); with more it is O(m n²) at worst. The result is that of Deb's definition.

use crate::dominance::{Fitness, ascending, dominates_in_all, lexicographic};

/// The fronts, best first; each lists positions in `fitness` in ascending order, and each position is in exactly one.
/// Fronts of measured solutions come first, then the infeasible by violation, then one with all the unfit.
pub fn fronts(fitness: &[&Fitness]) -> Vec<Vec<usize>> {
    let mut measured: Vec<(&[f64], usize)> = Vec::with_capacity(fitness.len());
    let mut infeasible: Vec<(f64, usize)> = Vec::new();
    let mut unfit: Vec<usize> = Vec::new();
    for (position, solution) in fitness.iter().enumerate() {
        match solution {
            Fitness::Measured(objectives) => measured.push((objectives, position)),
            Fitness::Infeasible { violation } => infeasible.push((*violation, position)),
            Fitness::Unfit(_) => unfit.push(position),
        }
    }
    let mut fronts = match measured.first() {
        Some((objectives, _)) if objectives.len() == 2 => fronts_of_pairs(&measured),
        _ => fronts_of_vectors(&mut measured),
    };
    for front in &mut fronts {
        front.sort_unstable();
    }
    infeasible.sort_by(|a, b| ascending(a.0, b.0));
    fronts.extend(infeasible.chunk_by(|a, b| a.0 == b.0).map(|tied| tied.iter().map(|&(_, i)| i).collect()));
    if !unfit.is_empty() {
        fronts.push(unfit);
    }
    fronts
}

fn fronts_of_pairs(measured: &[(&[f64], usize)]) -> Vec<Vec<usize>> {
    let mut pairs: Vec<(f64, f64, usize)> = measured.iter().map(|(pair, i)| (pair[0], pair[1], *i)).collect();
    pairs.sort_unstable_by(|a, b| ascending(a.0, b.0).then_with(|| ascending(a.1, b.1)));
    let mut fronts: Vec<Vec<usize>> = Vec::new();
    // The latest member of each front, which has the smallest second value in it.
    let mut latest: Vec<(f64, f64)> = Vec::new();
    for (x, y, position) in pairs {
        let front = latest.partition_point(|&(x0, y0)| y0 < y || (y0 == y && x0 < x));
        if front == fronts.len() {
            fronts.push(Vec::new());
            latest.push((x, y));
        }
        fronts[front].push(position);
        latest[front] = (x, y);
    }
    fronts
}

fn fronts_of_vectors(measured: &mut [(&[f64], usize)]) -> Vec<Vec<usize>> {
    measured.sort_by(|a, b| lexicographic(a.0, b.0));
    let mut fronts: Vec<Vec<(&[f64], usize)>> = Vec::new();
    for &(objectives, position) in measured.iter() {
        let front = fronts.partition_point(|front| front.iter().rev().any(|(x, _)| dominates_in_all(x, objectives)));
        if front == fronts.len() {
            fronts.push(Vec::new());
        }
        fronts[front].push((objectives, position));
    }
    fronts.into_iter().map(|front| front.into_iter().map(|(_, position)| position).collect()).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::tests::any_population;
    use crate::dominance::{Unfit, dominates};

    /// Deb's definition, word for word: peel off what nothing left dominates.
    pub(crate) fn naive_fronts(fitness: &[Fitness]) -> Vec<Vec<usize>> {
        let mut left: Vec<usize> = (0..fitness.len()).collect();
        let mut fronts = Vec::new();
        while !left.is_empty() {
            let (front, rest): (Vec<usize>, Vec<usize>) =
                left.iter().partition(|&&i| !left.iter().any(|&j| dominates(&fitness[j], &fitness[i])));
            fronts.push(front);
            left = rest;
        }
        fronts
    }

    proptest! {
        #[test]
        fn fronts_are_those_of_the_definition(population in any_population()) {
            prop_assert_eq!(fronts(&population.iter().collect::<Vec<_>>()), naive_fronts(&population));
        }
    }

    #[test]
    fn solutions_without_objectives_are_all_equal() {
        let population = [Fitness::Measured(vec![]), Fitness::Unfit(Unfit::Void), Fitness::Measured(vec![])];
        assert_eq!(fronts(&population.iter().collect::<Vec<_>>()), [vec![0, 2], vec![1]]);
    }
}
