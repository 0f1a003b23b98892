//! The way from a test to a smaller one, as a function of what is known of the tests on it.
//!
//! The walk is written as if every question had its answer at once. Where one is missing it breaks off and says which
//! tests have to be run; with their answers it is walked again from its beginning, to the same place and on. So there is
//! no state to be kept between two questions, and a walk taken up again is the same walk.

use sesame_plan::Test;

use crate::shrink::Phase;
use crate::shrink::dial::{self, Dial};
use crate::shrink::space::Space;

/// What is known of tests.
pub(super) trait Answers {
    /// The index of a test that was asked for, and whether it fails.
    fn find(&self, test: &Test) -> Option<(usize, bool)>;
}

/// Tests that have to be run before the walk goes on; none of them is known, none is there twice.
#[derive(Debug)]
pub(super) struct Asked {
    pub(super) phase: Phase,
    pub(super) tests: Vec<Test>,
    /// Index of the test that they are made of.
    pub(super) base: Option<usize>,
}

/// Where a walk ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Arrived {
    /// Indices of the tests that were gone to, in their order; the last one is the smallest. None where the test that
    /// the walk begins with does not fail.
    pub(super) kept: Vec<usize>,
    /// Whether every smaller test that is one step away was run and does not fail.
    pub(super) minimal: bool,
}

/// A walk on its way.
struct Walk<'a, A> {
    space: &'a Space,
    answers: &'a A,
    /// Whether no more tests can be run: what is not known then does not fail.
    exhausted: bool,
    /// Whether anything was taken not to fail for that reason.
    guessed: bool,
    test: Test,
    kept: Vec<usize>,
}

/// Walks as far as what is known leads.
pub(super) fn walk<A: Answers>(space: &Space, original: &Test, answers: &A, exhausted: bool) -> Result<Arrived, Asked> {
    let mut walk = Walk { space, answers, exhausted, guessed: false, test: original.clone(), kept: Vec::new() };
    let found = walk.failing(Phase::Original, std::slice::from_ref(original))?;
    if let Some(index) = found[0] {
        walk.kept.push(index);
        walk.all_the_way()?;
    }
    Ok(Arrived { minimal: !walk.guessed && !walk.kept.is_empty(), kept: walk.kept })
}

impl<A: Answers> Walk<'_, A> {
    fn all_the_way(&mut self) -> Result<(), Asked> {
        self.fewer_operations()?;
        self.turn(Phase::Windows, dial::times(&self.test))?;
        self.simpler_conditions()?;
        self.turn(Phase::Parameters, dial::parameters(&self.test))?;
        while self.last_steps()? {}
        Ok(())
    }

    /// Which of these tests fail, by their indices. One phase asks for all of them at once.
    fn failing(&mut self, phase: Phase, tests: &[Test]) -> Result<Vec<Option<usize>>, Asked> {
        let mut unknown: Vec<Test> = Vec::new();
        let mut found = Vec::with_capacity(tests.len());
        for test in tests {
            let known = self.answers.find(test);
            if known.is_none() && !unknown.contains(test) {
                unknown.push(test.clone());
            }
            found.push(known.filter(|(_, fails)| *fails).map(|(index, _)| index));
        }
        if unknown.is_empty() {
            return Ok(found);
        }
        if self.exhausted {
            self.guessed = true;
            return Ok(found);
        }
        Err(Asked { phase, tests: unknown, base: self.kept.last().copied() })
    }

    fn go_to(&mut self, test: Test, index: usize) {
        self.test = test;
        self.kept.push(index);
    }

    /// Goes to the first of these tests that fails, if one does, and says which.
    fn first_failing(&mut self, phase: Phase, mut tests: Vec<Test>) -> Result<Option<usize>, Asked> {
        let found = self.failing(phase, &tests)?;
        let Some(at) = found.iter().position(Option::is_some) else { return Ok(None) };
        if let Some(index) = found[at] {
            self.go_to(tests.swap_remove(at), index);
        }
        Ok(Some(at))
    }

    /// Delta debugging (Zeller and Hildebrandt 2002, ddmin): parts of the operations alone, then all but a part, in ever
    /// smaller parts.
    fn fewer_operations(&mut self) -> Result<(), Asked> {
        let mut parts = 2;
        loop {
            let all = self.test.operations.len();
            if all <= self.space.fewest {
                return Ok(());
            }
            parts = parts.min(all);
            let bounds: Vec<(usize, usize)> =
                (0..parts).map(|part| (part * all / parts, (part + 1) * all / parts)).collect();
            let test_of = |keep: &dyn Fn(usize) -> bool| {
                let kept = self.test.operations.iter().enumerate().filter(|(at, _)| keep(*at));
                Test { operations: kept.map(|(_, used)| used.clone()).collect() }
            };
            let alone = bounds.iter().map(|&(from, to)| test_of(&|at| from <= at && at < to));
            let without = bounds.iter().map(|&(from, to)| test_of(&|at| at < from || to <= at));
            let mut tests: Vec<Test> = alone.collect();
            if parts > 2 {
                tests.extend(without);
            }
            tests.retain(|test| test.operations.len() >= self.space.fewest);
            let before = all;
            match self.first_failing(Phase::Operations, tests)? {
                // One part of two, or all but one of more: in either case parts of the same size are left.
                Some(_) => {
                    let left = self.test.operations.len();
                    parts = if left * 2 > before { (parts - 1).max(2) } else { 2 };
                }
                None if parts >= all => return Ok(()),
                None => parts *= 2,
            }
        }
    }

    /// Turns dials as far as they go, all of them side by side, each by bisection.
    fn turn(&mut self, phase: Phase, dials: Vec<Dial>) -> Result<(), Asked> {
        // With each dial the fewest steps from here that are known, or taken, to be too many.
        let mut dials: Vec<(Dial, u32)> =
            dials.into_iter().map(|dial| (dial, dial.steps(self.space, &self.test).saturating_add(1))).collect();
        loop {
            for (dial, too_many) in &mut dials {
                *too_many = (*too_many).min(dial.steps(self.space, &self.test).saturating_add(1));
            }
            dials.retain(|(_, too_many)| *too_many > 1);
            if dials.is_empty() {
                return Ok(());
            }
            let half = |too_many: u32| too_many / 2;
            let tests: Vec<Test> =
                dials.iter().map(|&(dial, too_many)| dial.turned(self.space, &self.test, half(too_many))).collect();
            let found = self.failing(phase, &tests)?;
            let turned: Vec<usize> = (0..dials.len()).filter(|&at| found[at].is_some()).collect();
            for (at, (_, too_many)) in dials.iter_mut().enumerate() {
                if found[at].is_none() {
                    *too_many = half(*too_many);
                }
            }
            let Some(&first) = turned.first() else { continue };
            let mut together = self.test.clone();
            let mut taken = Vec::new();
            for &at in &turned {
                let (dial, too_many) = dials[at];
                let steps = half(too_many).min(dial.steps(self.space, &together));
                if steps > 0 {
                    together = dial.turned(self.space, &together, steps);
                    taken.push((at, steps));
                }
            }
            if self.first_failing(phase, vec![together])?.is_none()
                && let Some(index) = found[first]
            {
                taken = vec![(first, half(dials[first].1))];
                self.go_to(tests[first].clone(), index);
            }
            for (at, steps) in taken {
                dials[at].1 -= steps;
            }
        }
    }

    fn simpler_conditions(&mut self) -> Result<(), Asked> {
        loop {
            let tests = self.with_simpler_conditions();
            if tests.is_empty() || self.first_failing(Phase::Conditions, tests)?.is_none() {
                return Ok(());
            }
        }
    }

    fn with_simpler_conditions(&self) -> Vec<Test> {
        let operations = self.test.operations.iter().enumerate();
        let tests = operations.flat_map(|(place, used)| {
            self.space.simpler(used).into_iter().map(move |activation| {
                let mut test = self.test.clone();
                test.operations[place].activation = activation;
                test
            })
        });
        tests.collect()
    }

    /// Tries everything that is one step smaller. Where something of it fails, goes there and on, and says so; where
    /// nothing does, no single step is left.
    fn last_steps(&mut self) -> Result<bool, Asked> {
        let mut tests = Vec::new();
        if self.test.operations.len() > self.space.fewest {
            for place in 0..self.test.operations.len() {
                let mut test = self.test.clone();
                test.operations.remove(place);
                tests.push(test);
            }
        }
        tests.extend(self.with_simpler_conditions());
        let others = tests.len();
        let dials: Vec<Dial> = [dial::times(&self.test), dial::parameters(&self.test)]
            .concat()
            .into_iter()
            .filter(|dial| dial.steps(self.space, &self.test) > 0)
            .collect();
        tests.extend(dials.iter().map(|dial| dial.turned(self.space, &self.test, 1)));
        let found = self.failing(Phase::LastSteps, &tests)?;
        let Some(first) = found.iter().position(Option::is_some) else { return Ok(false) };
        if first < others {
            if let Some(index) = found[first] {
                self.go_to(tests.swap_remove(first), index);
            }
            return Ok(true);
        }
        let loose: Vec<Dial> =
            dials.iter().zip(&found[others..]).filter(|(_, found)| found.is_some()).map(|(dial, _)| *dial).collect();
        // One step of each is known to be possible, so that the halves lead to one at least.
        self.turn(Phase::LastSteps, loose)?;
        Ok(true)
    }
}
