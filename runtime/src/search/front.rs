//! The front: the non-dominated tests among all that were evaluated, kept as they come.

use crate::search::dominance::{Fitness, dominates_in_all};

/// The non-dominated tests so far. Every evaluated test counts, not only a population's survivors. Of tests with the
/// same objective values the one with the smallest number stands for all; so the front is the same whatever the order
/// in which they were added. Tests without measured objectives are never on it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Front {
    members: Vec<FrontMember>,
}

/// A test on the front.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontMember {
    /// The test's number.
    pub number: u32,
    /// Its objective values, oriented so that smaller is better.
    pub objectives: Vec<f64>,
}

impl Front {
    /// The front of these tests.
    pub fn of<'a>(tests: impl IntoIterator<Item = (u32, &'a Fitness)>) -> Self {
        let mut front = Front::default();
        for (number, fitness) in tests {
            front.add(number, fitness);
        }
        front
    }

    /// Takes an evaluated test into account; true if it is on the front now.
    pub fn add(&mut self, number: u32, fitness: &Fitness) -> bool {
        let Fitness::Measured(objectives) = fitness else { return false };
        let beaten_by = |member: &FrontMember| {
            dominates_in_all(&member.objectives, objectives)
                || (member.objectives == *objectives && member.number <= number)
        };
        if self.members.iter().any(beaten_by) {
            return false;
        }
        self.members
            .retain(|member| !dominates_in_all(objectives, &member.objectives) && member.objectives != *objectives);
        let place = self.members.partition_point(|member| member.number < number);
        self.members.insert(place, FrontMember { number, objectives: objectives.clone() });
        true
    }

    /// Its tests, by ascending number.
    pub fn members(&self) -> &[FrontMember] {
        &self.members
    }

    /// The numbers of its tests, ascending.
    pub fn numbers(&self) -> Vec<u32> {
        self.members.iter().map(|member| member.number).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::search::dominance::{dominates, tests::any_population};

    proptest! {
        #[test]
        fn a_front_is_that_of_the_definition_in_whatever_order_tests_come(
            population in any_population(),
            seed: u64,
        ) {
            let naive: Vec<u32> = (0u32..)
                .zip(&population)
                .filter(|(i, me)| {
                    me.objectives().is_some()
                        && !population.iter().any(|other| dominates(other, me))
                        && !population[..*i as usize].iter().any(|other| other.objectives() == me.objectives())
                })
                .map(|(i, _)| i)
                .collect();
            let numbered: Vec<(u32, &Fitness)> = (0u32..).zip(&population).collect();
            let order = crate::rng::Stream::derive(seed, "test", &[]).permutation(population.len());
            prop_assert_eq!(Front::of(numbered.iter().copied()).numbers(), naive.clone());
            prop_assert_eq!(Front::of(order.into_iter().map(|i| numbered[i])).numbers(), naive);
        }
    }
}
