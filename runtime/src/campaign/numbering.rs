//! The tests of a campaign get their numbers, and a test that is equal to an earlier one is recognised.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

use sha2::{Digest as _, Sha256};

use sesame_base::observation::Observation;
use sesame_plan::Test;
use sesame_results::record::{Origin, TestRecord};
use sesame_rng::derive_seed;
use sesame_search::Candidate;

/// A test that has its number and is to be run.
#[derive(Debug)]
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
    seen: SeenTests,
    /// By duplicate: the test whose result stands for it.
    originals: BTreeMap<u32, u32>,
}

impl Numbering {
    /// That of a campaign with this seed. The first number is 0.
    pub(super) fn new(seed: u64) -> Self {
        Numbering {
            simulator_seed: derive_seed(seed, "simulator", &[0]),
            next: 0,
            seen: SeenTests::default(),
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
        let duplicate_of = if simulator_seed.is_some() { None } else { self.seen.first_equal(&test, number) };
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

/// The tests of a campaign by their content, so that an equal one is not simulated again. Of each test its hash is kept:
/// the tests themselves would be most of what a campaign holds in memory.
#[derive(Debug, Default)]
struct SeenTests(HashMap<[u8; 16], u32>);

impl SeenTests {
    /// The number of the first test equal to this one; if there is none, this one is remembered.
    fn first_equal(&mut self, test: &Test, number: u32) -> Option<u32> {
        let content = serde_json::to_vec(test).unwrap_or_else(|error| unreachable!("a test is plain data: {error}"));
        // Half of a SHA-256: of 10^12 tests two have the same by chance once in 10^14 campaigns.
        let mut hash = [0; 16];
        hash.copy_from_slice(&Sha256::digest(content)[..16]);
        match self.0.entry(hash) {
            Entry::Occupied(first) => Some(*first.get()),
            Entry::Vacant(place) => {
                place.insert(number);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_results::record::sample;

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
        let mut numbering = Numbering::new(7);
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
}
