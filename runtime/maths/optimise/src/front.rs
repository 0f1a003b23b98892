//! The front: the non-dominated tests among all that were evaluated, kept as they come.

use crate::dominance::{Fitness, dominates_in_all, lexicographic};

/// The non-dominated tests so far. Every evaluated test counts, not only a population's survivors. Of tests with the
/// same objective values the one with the smallest number stands for all; so the front does not depend on the order
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
    /// The front of these tests. Of two or three objectives any number of tests is sorted out about as fast as it is
    /// sorted; of more, the time grows with the number of tests times that of the front.
    pub fn from_tests<'a>(tests: impl IntoIterator<Item = (u32, &'a Fitness)>) -> Self {
        let mut measured: Vec<(u32, &[f64])> =
            tests.into_iter().filter_map(|(number, fitness)| Some((number, fitness.objectives()?))).collect();
        // A test never comes after one that it dominates, nor an equal one with a smaller number after it.
        measured.sort_by(|a, b| lexicographic(a.1, b.1).then(a.0.cmp(&b.0)));
        let mut stairs = Stairs::default();
        let mut members: Vec<FrontMember> = Vec::new();
        for (number, objectives) in measured {
            let beaten = match *objectives {
                [_] => !members.is_empty(),
                [_, y] => stairs.reaches(y, 0.0),
                [_, y, z] => stairs.reaches(y, z),
                _ => members.iter().any(|member| at_least_as_good(&member.objectives, objectives)),
            };
            if beaten {
                continue;
            }
            match *objectives {
                [_, y] => stairs.add(y, 0.0),
                [_, y, z] => stairs.add(y, z),
                _ => {}
            }
            members.push(FrontMember { number, objectives: objectives.to_vec() });
        }
        members.sort_by_key(|member| member.number);
        Front { members }
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

/// Whether nothing of `b` is better.
fn at_least_as_good(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a <= b)
}

/// Points in the plane that no other is at least as good as: the first coordinate ascends, the second descends.
#[derive(Default)]
struct Stairs {
    steps: Vec<(f64, f64)>,
}

impl Stairs {
    /// Whether some point is at least as good as this one.
    fn reaches(&self, y: f64, z: f64) -> bool {
        let beyond = self.steps.partition_point(|step| step.0 <= y);
        beyond.checked_sub(1).is_some_and(|before| self.steps[before].1 <= z)
    }

    /// Adds a point that none reaches.
    fn add(&mut self, y: f64, z: f64) {
        let first = self.steps.partition_point(|step| step.0 < y);
        let worse = self.steps[first..].partition_point(|step| step.1 >= z);
        self.steps.splice(first..first + worse, [(y, z)]);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dominance::dominates;
    use crate::dominance::tests::any_population;

    proptest! {
        #[test]
        fn a_front_is_that_of_the_definition_for_any_order_of_tests(
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
            let order = sesame_rng::Stream::derive(seed, "test", &[]).permutation(population.len());
            prop_assert_eq!(Front::from_tests(numbered.iter().copied()).numbers(), naive.clone());
            let shuffled: Vec<(u32, &Fitness)> = order.into_iter().map(|i| numbered[i]).collect();
            prop_assert_eq!(Front::from_tests(shuffled.iter().copied()).numbers(), naive.clone());
            let mut one_by_one = Front::default();
            for (number, fitness) in shuffled {
                one_by_one.add(number, fitness);
            }
            prop_assert_eq!(&one_by_one, &Front::from_tests(numbered));
            prop_assert_eq!(one_by_one.numbers(), naive);
        }
    }
}
