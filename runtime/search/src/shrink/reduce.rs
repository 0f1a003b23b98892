//! The reduction of a test, as a function of which tests are known to fail.
//!
//! It is written as if an oracle knew every answer. If an answer is missing, the reduction stops and returns the tests
//! that have to be run; with their results it starts again from the beginning, and gets further. So it has no state
//! between two questions, and a resumed reduction is the same reduction.

use sesame_plan::Test;

use crate::shrink::Phase;
use crate::shrink::axis::{self, ShrinkAxis};
use crate::shrink::space::ShrinkSpace;

/// Which tests are known to fail.
pub(super) trait Oracle {
    /// The index of a test that was asked for, and whether it fails.
    fn find(&self, test: &Test) -> Option<(usize, bool)>;
}

/// Tests that have to be run before the reduction can go on; all are different, and none is known.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) phase: Phase,
    pub(super) tests: Vec<Test>,
    /// Index of the test that they are made of.
    pub(super) base: Option<usize>,
}

/// The result of a reduction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reduced {
    /// Indices of the tests that were accepted, in their order; the last one is the smallest. Empty if the original
    /// test does not fail.
    pub(super) accepted: Vec<usize>,
    /// Whether every smaller test that is one step away was run and does not fail.
    pub(super) minimal: bool,
}

/// A reduction in progress.
struct Reduction<'a, A> {
    space: &'a ShrinkSpace,
    oracle: &'a A,
    /// Whether no more tests can be run: what is not known then does not fail.
    exhausted: bool,
    /// Whether anything was taken not to fail for that reason.
    guessed: bool,
    test: Test,
    accepted: Vec<usize>,
}

/// Reduces a test as far as the answers are known.
pub(super) fn reduce<A: Oracle>(
    space: &ShrinkSpace,
    original: &Test,
    oracle: &A,
    exhausted: bool,
) -> Result<Reduced, Pending> {
    let mut reduction =
        Reduction { space, oracle, exhausted, guessed: false, test: original.clone(), accepted: Vec::new() };
    let found = reduction.failing(Phase::Original, std::slice::from_ref(original))?;
    if let Some(index) = found[0] {
        reduction.accepted.push(index);
        reduction.all_the_way()?;
    }
    Ok(Reduced { minimal: !reduction.guessed && !reduction.accepted.is_empty(), accepted: reduction.accepted })
}

impl<A: Oracle> Reduction<'_, A> {
    fn all_the_way(&mut self) -> Result<(), Pending> {
        self.fewer_operations()?;
        self.shrink_along(Phase::Windows, axis::times(&self.test))?;
        self.simpler_conditions()?;
        self.shrink_along(Phase::Parameters, axis::parameters(&self.test))?;
        self.round_numbers()?;
        while self.single_steps()? || self.round_numbers()? {}
        Ok(())
    }

    /// Which of these tests fail, by their indices. One phase asks for all of them at once.
    fn failing(&mut self, phase: Phase, tests: &[Test]) -> Result<Vec<Option<usize>>, Pending> {
        let mut unknown: Vec<Test> = Vec::new();
        let mut found = Vec::with_capacity(tests.len());
        for test in tests {
            let known = self.oracle.find(test);
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
        Err(Pending { phase, tests: unknown, base: self.accepted.last().copied() })
    }

    fn accept(&mut self, test: Test, index: usize) {
        self.test = test;
        self.accepted.push(index);
    }

    /// Goes to the first of these tests that fails, if one does, and says which.
    fn first_failing(&mut self, phase: Phase, mut tests: Vec<Test>) -> Result<Option<usize>, Pending> {
        let found = self.failing(phase, &tests)?;
        let Some(at) = found.iter().position(Option::is_some) else { return Ok(None) };
        if let Some(index) = found[at] {
            self.accept(tests.swap_remove(at), index);
        }
        Ok(Some(at))
    }

    /// Delta debugging (Zeller and Hildebrandt 2002, ddmin): parts of the operations alone, then all but a part, in
    /// ever smaller parts.
    fn fewer_operations(&mut self) -> Result<(), Pending> {
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

    /// Turns axes as far as they go, all of them side by side, each by bisection.
    fn shrink_along(&mut self, phase: Phase, axes: Vec<ShrinkAxis>) -> Result<(), Pending> {
        // With each axis the fewest steps from here that are known, or taken, to be too many.
        let mut axes: Vec<(ShrinkAxis, u32)> =
            axes.into_iter().map(|axis| (axis, axis.steps(self.space, &self.test).saturating_add(1))).collect();
        loop {
            for (axis, too_many) in &mut axes {
                *too_many = (*too_many).min(axis.steps(self.space, &self.test).saturating_add(1));
            }
            axes.retain(|(_, too_many)| *too_many > 1);
            if axes.is_empty() {
                return Ok(());
            }
            let half = |too_many: u32| too_many / 2;
            let tests: Vec<Test> = axes
                .iter()
                .map(|&(axis, too_many)| axis.shrink_along(self.space, &self.test, half(too_many)))
                .collect();
            let found = self.failing(phase, &tests)?;
            let shrunk: Vec<usize> = (0..axes.len()).filter(|&at| found[at].is_some()).collect();
            for (at, (_, too_many)) in axes.iter_mut().enumerate() {
                if found[at].is_none() {
                    *too_many = half(*too_many);
                }
            }
            let Some(&first) = shrunk.first() else { continue };
            let mut together = self.test.clone();
            let mut taken = Vec::new();
            for &at in &shrunk {
                let (axis, too_many) = axes[at];
                let steps = half(too_many).min(axis.steps(self.space, &together));
                if steps > 0 {
                    together = axis.shrink_along(self.space, &together, steps);
                    taken.push((at, steps));
                }
            }
            if self.first_failing(phase, vec![together])?.is_none()
                && let Some(index) = found[first]
            {
                taken = vec![(first, half(axes[first].1))];
                self.accept(tests[first].clone(), index);
            }
            for (at, steps) in taken {
                axes[at].1 -= steps;
            }
        }
    }

    fn simpler_conditions(&mut self) -> Result<(), Pending> {
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

    /// Tries to shrink numbers by less than a step to round ones: all of them, then those that can be alone. Returns
    /// whether any was; the others keep the digits that they need. What is not tried for want of runs says nothing
    /// about smaller tests.
    fn round_numbers(&mut self) -> Result<bool, Pending> {
        let guessed = self.guessed;
        let rounded = self.rounded_numbers();
        self.guessed = guessed;
        rounded
    }

    fn rounded_numbers(&mut self) -> Result<bool, Pending> {
        let axes = [axis::times(&self.test), axis::parameters(&self.test)].concat();
        let rounded = |test: Test, axis: &ShrinkAxis| axis.rounded(self.space, &test).unwrap_or(test);
        let alone: Vec<(ShrinkAxis, Test)> =
            axes.iter().filter_map(|axis| Some((*axis, axis.rounded(self.space, &self.test)?))).collect();
        if alone.is_empty() {
            return Ok(false);
        }
        let all = axes.iter().fold(self.test.clone(), rounded);
        let mut tests: Vec<Test> = std::iter::once(all).chain(alone.iter().map(|(_, test)| test.clone())).collect();
        let found = self.failing(Phase::LocalMinimality, &tests)?;
        if let Some(index) = found[0] {
            self.accept(tests.swap_remove(0), index);
            return Ok(true);
        }
        let fail = alone.iter().zip(&found[1..]).filter(|(_, found)| found.is_some());
        let fail: Vec<ShrinkAxis> = fail.map(|((axis, _), _)| *axis).collect();
        let together = fail.iter().fold(self.test.clone(), rounded);
        if fail.len() > 1 && self.first_failing(Phase::LocalMinimality, vec![together])?.is_some() {
            return Ok(true);
        }
        // One after the other: to begin again with all of them after each would take many times as many runs.
        for axis in &fail {
            if let Some(test) = axis.rounded(self.space, &self.test) {
                self.first_failing(Phase::LocalMinimality, vec![test])?;
            }
        }
        Ok(!fail.is_empty())
    }

    /// Tries every single step. If one of these tests fails, it is accepted, and the result is true; if none does, the
    /// test is minimal.
    fn single_steps(&mut self) -> Result<bool, Pending> {
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
        let axes: Vec<ShrinkAxis> = [axis::times(&self.test), axis::parameters(&self.test)]
            .concat()
            .into_iter()
            .filter(|axis| axis.steps(self.space, &self.test) > 0)
            .collect();
        tests.extend(axes.iter().map(|axis| axis.shrink_along(self.space, &self.test, 1)));
        let found = self.failing(Phase::LocalMinimality, &tests)?;
        let Some(first) = found.iter().position(Option::is_some) else { return Ok(false) };
        if first < others {
            if let Some(index) = found[first] {
                self.accept(tests.swap_remove(first), index);
            }
            return Ok(true);
        }
        let loose: Vec<ShrinkAxis> =
            axes.iter().zip(&found[others..]).filter(|(_, found)| found.is_some()).map(|(axis, _)| *axis).collect();
        // One step of each is known to be possible, so that the halves lead to one at least.
        self.shrink_along(Phase::LocalMinimality, loose)?;
        Ok(true)
    }
}
