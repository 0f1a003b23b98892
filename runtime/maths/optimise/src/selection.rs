//! Who mates and who survives: crowded comparison, binary tournament, environmental selection (Deb et al. 2002).

use std::cmp::Ordering;

use sesame_rng::Stream;

use crate::crowding::distances;
use crate::dominance::{Fitness, lexicographic};
use crate::sorting::fronts;

/// The rank of a solution in its population: what the crowded comparison compares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rank {
    /// Its front, from 0 for the best.
    pub front: usize,
    /// Its crowding distance on that front.
    pub crowding: f64,
}

impl Rank {
    /// The crowded comparison: `Less` is better. An earlier front wins, then the larger crowding distance.
    pub fn compare(self, other: Rank) -> Ordering {
        self.front.cmp(&other.front).then_with(|| other.crowding.total_cmp(&self.crowding))
    }
}

/// The rank of each solution, in their order.
pub fn ranks(fitness: &[&Fitness]) -> Vec<Rank> {
    let mut ranks = vec![Rank { front: 0, crowding: 0.0 }; fitness.len()];
    for (rank, front) in fronts(fitness).iter().enumerate() {
        for (&position, crowding) in front.iter().zip(distances(fitness, front)) {
            ranks[position] = Rank { front: rank, crowding };
        }
    }
    ranks
}

/// `n` parents, by binary tournaments. Contestants come from shuffled copies of the population, so that within
/// `population / 2` tournaments each solution competes once, and neighbours in the result are different solutions
/// (save where one copy ends and the next begins). Equal contestants: the first drawn wins, which is either at random.
pub fn parents(ranks: &[Rank], n: usize, stream: &mut Stream) -> Vec<usize> {
    assert!(!ranks.is_empty(), "parents come from a population");
    let mut contestants = Vec::with_capacity(2 * n + ranks.len());
    while contestants.len() < 2 * n {
        contestants.extend(stream.permutation(ranks.len()));
    }
    let winner = |pair: &[usize]| {
        if ranks[pair[1]].compare(ranks[pair[0]]).is_lt() { pair[1] } else { pair[0] }
    };
    contestants.chunks_exact(2).take(n).map(winner).collect()
}

/// The `n` best solutions (all when there are no more), as positions in ascending order with their ranks among each
/// other: whole fronts while they fit, of the next one those with the largest crowding distances, of equal ones the
/// earlier.
pub fn survivors(fitness: &[&Fitness], n: usize) -> Vec<(usize, Rank)> {
    let mut chosen: Vec<(usize, Rank)> = Vec::with_capacity(n.min(fitness.len()));
    // Earlier fronts survive as a whole, so the survivors of a front stay on the same front.
    for (rank, mut front) in fronts(fitness).into_iter().enumerate() {
        let room = n - chosen.len();
        let mut crowding = distances(fitness, &front);
        if front.len() > room {
            let mut order: Vec<usize> = (0..front.len()).collect();
            order.sort_by(|&a, &b| crowding[b].total_cmp(&crowding[a]));
            order.truncate(room);
            order.sort_unstable();
            front = order.iter().map(|&k| front[k]).collect();
            crowding = distances(fitness, &front);
        }
        chosen.extend(front.into_iter().zip(crowding).map(|(at, crowding)| (at, Rank { front: rank, crowding })));
        if chosen.len() == n {
            break;
        }
    }
    chosen.sort_unstable_by_key(|&(position, _)| position);
    chosen
}

/// As [`survivors`], but measured solutions with the objective values of an earlier one come after all solutions with
/// values of their own, however good they are, and before those that are not measured. They add no information, while a
/// worse solution with other values may lead to better ones.
pub fn distinct_survivors(fitness: &[&Fitness], n: usize) -> Vec<(usize, Rank)> {
    let mut measured: Vec<(&[f64], usize)> = Vec::with_capacity(fitness.len());
    let mut others = Vec::new();
    for (position, solution) in fitness.iter().enumerate() {
        match solution.objectives() {
            Some(objectives) => measured.push((objectives, position)),
            None => others.push(position),
        }
    }
    // Stable, so that the first of equals is the earliest.
    measured.sort_by(|a, b| lexicographic(a.0, b.0));
    let (mut distinct, mut repeated) = (Vec::new(), Vec::new());
    for equals in measured.chunk_by(|a, b| lexicographic(a.0, b.0).is_eq()) {
        distinct.push(equals[0].1);
        repeated.extend(equals[1..].iter().map(|&(_, position)| position));
    }
    let mut chosen: Vec<usize> = Vec::with_capacity(n.min(fitness.len()));
    for mut group in [distinct, repeated, others] {
        group.sort_unstable();
        let members: Vec<&Fitness> = group.iter().map(|&position| fitness[position]).collect();
        let best = survivors(&members, n - chosen.len());
        chosen.extend(best.into_iter().map(|(k, _)| group[k]));
    }
    chosen.sort_unstable();
    // The members of each group were ranked by themselves.
    let ranks = ranks(&chosen.iter().map(|&position| fitness[position]).collect::<Vec<_>>());
    chosen.into_iter().zip(ranks).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::tests::any_population;
    use crate::dominance::{Unfit, dominates};

    proptest! {
        #[test]
        fn survivors_are_the_best_by_the_crowded_comparison(population in any_population(), n in 0usize..40) {
            let all: Vec<&Fitness> = population.iter().collect();
            let ranks = ranks(&all);
            let mut order: Vec<usize> = (0..all.len()).collect();
            order.sort_by(|&a, &b| ranks[a].compare(ranks[b]).then(a.cmp(&b)));
            order.truncate(n);
            order.sort_unstable();
            let (positions, among_each_other): (Vec<usize>, Vec<Rank>) = survivors(&all, n).into_iter().unzip();
            prop_assert_eq!(&positions, &order);
            let chosen: Vec<&Fitness> = order.iter().map(|&at| all[at]).collect();
            prop_assert_eq!(among_each_other, super::ranks(&chosen));
        }

        #[test]
        fn distinct_survivors_are_values_of_their_own_first(population in any_population(), n in 0usize..40) {
            let all: Vec<&Fitness> = population.iter().collect();
            // By pairs: 0 brings values of its own, 1 repeats an earlier one's, 2 is not measured.
            let group = |i: usize| match all[i].objectives() {
                None => 2,
                Some(objectives) => i32::from(all[..i].iter().any(|earlier| earlier.objectives() == Some(objectives))),
            };
            let mut expected = Vec::new();
            for wanted in 0..3 {
                let members: Vec<usize> = (0..all.len()).filter(|&i| group(i) == wanted).collect();
                let ranks = ranks(&members.iter().map(|&i| all[i]).collect::<Vec<_>>());
                let mut order: Vec<usize> = (0..members.len()).collect();
                order.sort_by(|&a, &b| ranks[a].compare(ranks[b]).then(a.cmp(&b)));
                expected.extend(order.into_iter().map(|k| members[k]));
            }
            expected.truncate(n);
            expected.sort_unstable();
            let (positions, among_each_other): (Vec<usize>, Vec<Rank>) =
                distinct_survivors(&all, n).into_iter().unzip();
            prop_assert_eq!(&positions, &expected);
            let chosen: Vec<&Fitness> = expected.iter().map(|&at| all[at]).collect();
            prop_assert_eq!(among_each_other, super::ranks(&chosen));
        }

        #[test]
        fn a_tournament_is_never_won_by_the_dominated(population in any_population(), n in 0usize..50, seed: u64) {
            prop_assume!(!population.is_empty());
            let all: Vec<&Fitness> = population.iter().collect();
            let ranks = ranks(&all);
            let parents = parents(&ranks, n, &mut Stream::derive(seed, "test", &[]));
            prop_assert_eq!(parents.len(), n);
            // Replays the contests: the same stream shuffles the same contestants.
            let mut stream = Stream::derive(seed, "test", &[]);
            let mut contestants = Vec::new();
            while contestants.len() < 2 * n {
                contestants.extend(stream.permutation(all.len()));
            }
            for (contest, &winner) in parents.iter().enumerate() {
                let pair = [contestants[2 * contest], contestants[2 * contest + 1]];
                let loser = if pair[0] == winner { pair[1] } else { pair[0] };
                prop_assert!(pair.contains(&winner));
                prop_assert!(!dominates(all[loser], all[winner]));
                prop_assert!(ranks[winner].compare(ranks[loser]).is_le());
            }
        }
    }

    #[test]
    fn everyone_competes_equally_often_and_the_worst_never_wins() {
        let population: Vec<Fitness> = (0..9).map(|i| Fitness::Measured(vec![f64::from(i)])).collect();
        let population = [population, vec![Fitness::Unfit(Unfit::Crash)]].concat();
        let ranks = ranks(&population.iter().collect::<Vec<_>>());
        let parents = parents(&ranks, 5_000, &mut Stream::derive(3, "test", &[]));
        let mut wins = [0u32; 10];
        for winner in parents {
            wins[winner] += 1;
        }
        assert_eq!(wins[0], 1_000, "the best wins each of its contests");
        assert_eq!(wins[9], 0, "the unfit loses each of its contests");
        assert!(wins.windows(2).all(|pair| pair[0] > pair[1]), "{wins:?}");
    }
}
