//! Which operations of a violating test are to blame.
//!
//! A cause is a requirement with a smallest set of operations that violates it. A test that violates a requirement is
//! reduced by delta debugging over its operations [Zeller 2002]: each operation alone, then what is left without those
//! that are to blame alone, then pairs. Each question is a test of the campaign like any other; those of one stage do
//! not depend on each other and are asked in one generation.

use std::collections::{BTreeMap, BTreeSet};

use sesame_plan::Test;

/// A smallest set of operations that violates a requirement, as far as was tried.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Cause {
    /// The position of the requirement.
    pub(super) requirement: usize,
    /// The positions of the operations in the test space.
    pub(super) kinds: BTreeSet<usize>,
}

/// The causes that are known. None contains another one of the same requirement.
#[derive(Debug, Clone, Default)]
pub(super) struct Causes(Vec<Cause>);

impl Causes {
    /// How many causes of a requirement there are.
    pub(super) fn count(&self, requirement: usize) -> usize {
        self.0.iter().filter(|known| known.requirement == requirement).count()
    }

    /// Adds a cause, unless a smaller one explains it; those that it explains leave. Returns whether it is new.
    pub(super) fn add(&mut self, cause: Cause) -> bool {
        if self.explain(cause.requirement, &cause.kinds) {
            return false;
        }
        self.0.retain(|known| known.requirement != cause.requirement || !cause.kinds.is_subset(&known.kinds));
        self.0.push(cause);
        true
    }

    /// Whether a known cause of a requirement is among these operations.
    pub(super) fn explain(&self, requirement: usize, kinds: &BTreeSet<usize>) -> bool {
        self.0.iter().any(|known| known.requirement == requirement && known.kinds.is_subset(kinds))
    }

    /// Whether an operation alone is a cause of a requirement.
    pub(super) fn is_alone(&self, requirement: usize, kind: usize) -> bool {
        let is =
            |known: &Cause| known.requirement == requirement && known.kinds.len() == 1 && known.kinds.contains(&kind);
        self.0.iter().any(is)
    }
}

/// The search for the operations that are to blame for a violation.
#[derive(Debug, Clone)]
pub(super) struct Attribution {
    /// The violating test, without the operations that had no effect.
    pub(super) test: Test,
    /// Per operation of the test, which one of the test space it is.
    kinds: Vec<usize>,
    /// The requirement that it violates.
    pub(super) requirement: usize,
    /// The caller's number of the test.
    pub(super) number: u32,
    /// Whether a test of only these operations violates the requirement too, as far as that was asked.
    answers: BTreeMap<BTreeSet<usize>, bool>,
    /// The least number of operations that a test may have.
    fewest: usize,
}

/// What an attribution comes to.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    /// It asks of each of these sets of operations, by position, whether a test of them alone violates the requirement.
    Ask(Vec<BTreeSet<usize>>),
    /// It found these sets of kinds to be to blame, or nothing that is not known.
    Done(Vec<BTreeSet<usize>>),
}

impl Attribution {
    pub(super) fn new(test: Test, kinds: Vec<usize>, requirement: usize, number: u32, fewest: usize) -> Self {
        Attribution { test, kinds, requirement, number, answers: BTreeMap::new(), fewest }
    }

    /// The operations that it began with.
    pub(super) fn all_kinds(&self) -> BTreeSet<usize> {
        self.kinds.iter().copied().collect()
    }

    /// Takes whether a test of only these operations violates the requirement.
    pub(super) fn answer(&mut self, positions: BTreeSet<usize>, violates: bool) {
        self.answers.insert(positions, violates);
    }

    /// The test of only these operations.
    pub(super) fn subset(&self, positions: &BTreeSet<usize>) -> Test {
        Test { operations: positions.iter().map(|&at| self.test.operations[at].clone()).collect() }
    }

    /// The test of only the operations of these kinds.
    pub(super) fn test_of(&self, kinds: &BTreeSet<usize>) -> Test {
        self.subset(&(0..self.kinds.len()).filter(|&at| kinds.contains(&self.kinds[at])).collect())
    }

    /// What comes next, by what is known.
    pub(super) fn next(&self, causes: &Causes) -> Next {
        self.reduced(causes).unwrap_or_else(Next::Ask)
    }

    /// Whether a test of only these operations violates the requirement, if that is known. What a campaign does not
    /// permit is not asked, and counts as no violation.
    fn known(&self, positions: &BTreeSet<usize>) -> Option<bool> {
        if positions.len() == self.kinds.len() {
            return Some(true);
        }
        if positions.len() < self.fewest {
            return Some(false);
        }
        self.answers.get(positions).copied()
    }

    /// Whether tests of only these operations violate the requirement; the error asks for all that are not known.
    fn each_violates(&self, sets: &[BTreeSet<usize>]) -> Result<Vec<bool>, Vec<BTreeSet<usize>>> {
        let known: Option<Vec<bool>> = sets.iter().map(|set| self.known(set)).collect();
        known.ok_or_else(|| sets.iter().filter(|set| self.known(set).is_none()).cloned().collect())
    }

    fn violates(&self, positions: &BTreeSet<usize>) -> Result<bool, Vec<BTreeSet<usize>>> {
        self.known(positions).ok_or_else(|| vec![positions.clone()])
    }

    fn reduced(&self, causes: &Causes) -> Result<Next, Vec<BTreeSet<usize>>> {
        let unknown = |positions: BTreeSet<usize>| -> BTreeSet<usize> {
            positions.into_iter().filter(|&at| !causes.is_alone(self.requirement, self.kinds[at])).collect()
        };
        let mut rest = unknown((0..self.kinds.len()).collect());
        while !rest.is_empty() && self.violates(&rest)? {
            let kinds: BTreeSet<usize> = rest.iter().map(|&at| self.kinds[at]).collect();
            let of = |wanted: &[usize]| -> BTreeSet<usize> {
                rest.iter().copied().filter(|&at| wanted.contains(&self.kinds[at])).collect()
            };
            // All at once: a generation has room for them, and the next one has the answers.
            let single: Vec<BTreeSet<usize>> = kinds.iter().map(|&kind| of(&[kind])).collect();
            let violate = if kinds.len() > 1 { self.each_violates(&single)? } else { vec![false] };
            let alone: BTreeSet<usize> =
                kinds.iter().zip(violate).filter(|(_, is)| *is).map(|(&kind, _)| kind).collect();
            if alone.is_empty() {
                return self.smallest(&kinds, of);
            }
            // The caller knows of them by the answers; what is left may be a cause of its own.
            rest = unknown(rest.iter().copied().filter(|&at| !alone.contains(&self.kinds[at])).collect());
        }
        Ok(Next::Done(Vec::new()))
    }

    /// The smallest sets among these kinds, none of which violates the requirement alone.
    fn smallest(
        &self,
        kinds: &BTreeSet<usize>,
        of: impl Fn(&[usize]) -> BTreeSet<usize>,
    ) -> Result<Next, Vec<BTreeSet<usize>>> {
        let list: Vec<usize> = kinds.iter().copied().collect();
        if list.len() > 2 {
            let pairs = list
                .iter()
                .enumerate()
                .flat_map(|(at, &first)| list[at + 1..].iter().map(move |&second| [first, second]));
            let pairs: Vec<[usize; 2]> = pairs.collect();
            let violate = self.each_violates(&pairs.iter().map(|pair| of(pair)).collect::<Vec<_>>())?;
            let found: Vec<BTreeSet<usize>> =
                pairs.into_iter().zip(violate).filter(|(_, is)| *is).map(|(pair, _)| pair.into()).collect();
            if !found.is_empty() {
                return Ok(Next::Done(found));
            }
            // Beyond pairs, one operation after the other is left out, as long as the rest violates the requirement.
            let mut left = list.clone();
            let mut at = 0;
            while at < left.len() && left.len() > 3 {
                let mut fewer = left.clone();
                fewer.remove(at);
                if self.violates(&of(&fewer))? {
                    left = fewer;
                } else {
                    at += 1;
                }
            }
            return Ok(Next::Done(vec![left.into_iter().collect()]));
        }
        Ok(Next::Done(vec![kinds.clone()]))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::testing::{test_of, use_of};

    use super::*;

    /// Runs an attribution to its end, where these sets of kinds violate the requirement.
    fn attribute(kinds: &[usize], violating: &[BTreeSet<usize>]) -> (Causes, usize) {
        let test = test_of(kinds.iter().map(|_| use_of(0, 0.0, 1.0, vec![], 1)).collect());
        let mut attribution = Attribution::new(test, kinds.to_vec(), 0, 1, 1);
        let (mut causes, mut asked) = (Causes::default(), 0);
        loop {
            match attribution.next(&causes) {
                Next::Ask(sets) => {
                    for positions in sets {
                        let held: BTreeSet<usize> = positions.iter().map(|&at| kinds[at]).collect();
                        let violates = violating.iter().any(|cause| cause.is_subset(&held));
                        if violates && held.len() == 1 {
                            causes.add(Cause { requirement: 0, kinds: held });
                        }
                        attribution.answer(positions, violates);
                        asked += 1;
                    }
                }
                Next::Done(found) => {
                    causes.0.extend(found.into_iter().map(|kinds| Cause { requirement: 0, kinds }));
                    return (causes, asked);
                }
            }
        }
    }

    proptest! {
        /// Beside all subsets of the operations.
        #[test]
        fn what_is_found_is_a_smallest_set_and_there_is_one(
            kinds in prop::collection::vec(0usize..5, 1..6),
            violating in prop::collection::vec(prop::collection::btree_set(0usize..5, 1..4), 1..4),
        ) {
            let held: BTreeSet<usize> = kinds.iter().copied().collect();
            prop_assume!(violating.iter().any(|cause| cause.is_subset(&held)));
            let (causes, asked) = attribute(&kinds, &violating);
            prop_assert!(!causes.0.is_empty());
            for Cause { kinds, .. } in &causes.0 {
                let violates = |set: &BTreeSet<usize>| violating.iter().any(|cause| cause.is_subset(set));
                prop_assert!(violates(kinds));
                for left_out in kinds {
                    let fewer = kinds.iter().copied().filter(|kind| kind != left_out).collect();
                    prop_assert!(!violates(&fewer), "{kinds:?} is not a smallest set");
                }
            }
            // All that violate alone are found.
            for cause in violating.iter().filter(|cause| cause.len() == 1 && cause.is_subset(&held)) {
                prop_assert!(causes.0.iter().any(|found| found.kinds == *cause), "{cause:?}");
            }
            prop_assert!(asked <= 20, "{asked} questions");
        }
    }

    #[test]
    fn a_smaller_cause_replaces_a_larger_one() {
        let mut causes = Causes::default();
        let cause = |kinds: &[usize]| Cause { requirement: 0, kinds: kinds.iter().copied().collect() };
        assert!(causes.add(cause(&[1, 2])));
        assert!(!causes.add(cause(&[1, 2, 3])));
        assert!(causes.add(cause(&[2])));
        assert_eq!(causes.0, [cause(&[2])]);
        assert!(causes.is_alone(0, 2) && !causes.is_alone(1, 2));
    }
}
