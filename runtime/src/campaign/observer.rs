//! What follows a search without taking part in it: each observer sees every test and every generation, records what it
//! makes of them, and may end the search.

use std::ops::ControlFlow;

use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_record::{RecordError, Recorder, TestRecord};
use sesame_search::Evaluated;
use sesame_search::coverage::Coverage;
use sesame_search::sspr::Point;

/// A test that has ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct EndedTest<'a> {
    pub(super) record: &'a TestRecord,
    /// The fitness of its own run, before any confirmation.
    pub(super) fitness: &'a Fitness,
    /// Where it lies in the reduced parameter space, if it counts for coverage.
    pub(super) point: Option<&'a Point>,
}

/// A generation all of whose tests have ended and are confirmed, as far as the campaign confirms.
#[derive(Debug, Clone, Copy)]
pub(super) struct Generation<'a> {
    pub(super) number: u32,
    /// Its tests, in the order of their numbers.
    pub(super) tests: &'a [Evaluated],
    /// The front of all tests so far.
    pub(super) front: &'a Front,
    /// Tests evaluated so far.
    pub(super) done: u32,
}

/// Follows a search. Nothing that an observer decides may depend on the order in which the tests of a generation end: a
/// campaign gives equal results with any number of workers.
pub(super) trait Observer {
    /// A test has ended.
    fn test_ended(&mut self, _: EndedTest<'_>) {}

    /// A generation has ended. `Break` ends the search, with the reason in words.
    fn generation_ended(
        &mut self,
        generation: Generation<'_>,
        recorder: &mut Recorder,
    ) -> Result<ControlFlow<String>, RecordError>;

    /// Whether it may ever end the search.
    fn may_end(&self) -> bool {
        false
    }

    /// What is to be said before the search begins.
    fn warning(&self) -> Option<String> {
        None
    }

    /// The cells covered so far, of the observer that counts them.
    fn coverage(&self) -> Option<&Coverage> {
        None
    }
}
