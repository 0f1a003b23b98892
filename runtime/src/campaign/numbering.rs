//! The tests of a campaign get their numbers, and a test that is equal to an earlier one is recognised.

use std::collections::BTreeMap;

use sesame_base::observation::Observation;
use sesame_plan::Test;
use sesame_record::{Origin, TestRecord};
use sesame_rng::derive_seed;
use sesame_search::Candidate;
use sesame_search::test_key::SeenTests;

/// A test that has its number and is to be run.
#[derive(Debug, Clone)]
pub(super) struct PlannedTest {
    pub(super) number: u32,
    pub(super) origin: Origin,
    pub(super) generation: Option<u32>,
    pub(super) parents: Vec<u32>,
    pub(super) test: Test,
    pub(super) simulator_seed: u64,
    /// The equal test whose result stands for this one.
    pub(super) duplicate_of: Option<u32>,
}

impl PlannedTest {
    /// The test with what its run showed.
    pub(super) fn observed(self, observation: Observation) -> TestRecord {
        TestRecord {
            number: self.number,
            origin: self.origin,
            generation: self.generation,
            parents: self.parents,
            test: self.test,
            simulator_seed: self.simulator_seed,
            duplicate_of: self.duplicate_of,
            observation,
        }
    }
}

/// Numbers tests in the order in which a search asks for them.
#[derive(Debug)]
pub(super) struct Numbering {
    /// The simulator's seed, one for the whole campaign; searches that run a test several times bring their own.
    simulator_seed: u64,
    next: u32,
    /// The tests so far; `None` if an equal test may give another result.
    seen: Option<SeenTests>,
    /// By duplicate: the test whose result stands for it.
    originals: BTreeMap<u32, u32>,
}

impl Numbering {
    /// The numbering of a campaign with this seed. The first number is 0. Equal tests are only recognised if the
    /// simulator is stepped.
    pub(super) fn new(seed: u64, lock_stepped: bool) -> Self {
        Numbering {
            simulator_seed: derive_seed(seed, "simulator", &[0]),
            next: 0,
            seen: lock_stepped.then(SeenTests::default),
            originals: BTreeMap::new(),
        }
    }

    /// A reference run, with the next number.
    pub(super) fn reference_run(&mut self) -> PlannedTest {
        PlannedTest {
            number: self.take(),
            origin: Origin::Reference,
            generation: None,
            parents: Vec::new(),
            test: Test::default(),
            simulator_seed: self.simulator_seed,
            duplicate_of: None,
        }
    }

    /// A test that a search asks for, with the next number.
    pub(super) fn candidate(&mut self, candidate: Candidate) -> PlannedTest {
        let Candidate { test, parents, generation, known, simulator_seed } = candidate;
        let number = self.take();
        // Tests with seeds of their own are there to be run each.
        let seen = self.seen.as_mut().filter(|_| simulator_seed.is_none());
        let duplicate_of = seen.and_then(|seen| seen.first_equal(&test, number));
        if let Some(original) = duplicate_of {
            self.originals.insert(number, original);
        }
        PlannedTest {
            number,
            origin: known.map_or(Origin::Search, Origin::Known),
            generation: known.is_none().then_some(generation),
            parents,
            test,
            simulator_seed: simulator_seed.unwrap_or(self.simulator_seed),
            duplicate_of,
        }
    }

    /// The number given last; at least one must have been given.
    pub(super) fn last(&self) -> u32 {
        self.next - 1
    }

    /// The test whose result stands for this one: mostly itself.
    pub(super) fn stands_for(&self, number: u32) -> u32 {
        self.originals.get(&number).copied().unwrap_or(number)
    }

    fn take(&mut self) -> u32 {
        let number = self.next;
        self.next += 1;
        number
    }
}

#[cfg(test)]
mod tests {
    use sesame_record::sample;

    use super::*;

    #[test]
    fn an_equal_test_is_known_by_its_first_number_however_many_came_between() {
        let plan = sample::plan();
        let records = sample::records(&plan, 300);
        let mut seen = SeenTests::default();
        for (number, record) in (0u32..).zip(records.iter().chain(&records)) {
            let first = records.iter().position(|other| other.test == record.test);
            let first = u32::try_from(first.expect("it is among them")).unwrap();
            assert_eq!(seen.first_equal(&record.test, number), (first < number).then_some(first), "{number}");
        }
    }

    #[test]
    fn tests_with_seeds_of_their_own_are_run_each_and_stand_for_themselves() {
        let mut numbering = Numbering::new(7, true);
        let candidate = |simulator_seed| Candidate {
            test: Test::default(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed,
        };
        let reference = numbering.reference_run();
        let planned: Vec<PlannedTest> =
            [None, Some(3), None].into_iter().map(|seed| numbering.candidate(candidate(seed))).collect();
        assert_eq!(planned.iter().map(|test| test.number).collect::<Vec<_>>(), [1, 2, 3]);
        assert_eq!(planned.iter().map(|test| test.duplicate_of).collect::<Vec<_>>(), [None, None, Some(1)]);
        assert_eq!((numbering.stands_for(2), numbering.stands_for(3)), (2, 1));
        assert_eq!((planned[0].simulator_seed, planned[1].simulator_seed), (reference.simulator_seed, 3));
    }

    #[test]
    fn equal_tests_are_run_each_if_the_simulator_is_not_stepped() {
        let mut numbering = Numbering::new(7, false);
        let candidate = || Candidate {
            test: Test::default(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed: None,
        };
        let planned = [numbering.candidate(candidate()), numbering.candidate(candidate())];
        assert_eq!(planned.map(|test| test.duplicate_of), [None, None]);
    }
}
