//! The reduction of a test, as a function of which tests are known to fail.
//!
//! It is written as if an oracle knew every answer. If an answer is missing, the reduction stops and returns the tests
//! that have to be run; with their results it starts again from the beginning, and gets further. So it has no state
//! between two questions, and a resumed reduction is the same reduction.

use sesame_base::observation::{AlteredMessage, AlteredMessages};
use sesame_plan::{Messages, Test, TestOperation};

use crate::shrink::Phase;
use crate::shrink::axis::{self, ShrinkAxis};
use crate::shrink::space::ShrinkSpace;

/// How many tests with fewer messages are asked for at once, at most. There may be thousands, and the first that fails
/// makes the others needless.
const AT_ONCE: usize = 8;

/// Which tests are known to fail.
pub(super) trait Oracle {
    /// The index of a test that was asked for, and whether it fails.
    fn find(&self, test: &Test) -> Option<(usize, bool)>;

    /// The messages that the operations of a test alter, if that was asked for.
    fn altered(&self, test: &Test) -> Option<&AlteredMessages>;
}

/// How the reduction to single messages ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MessagesEnd {
    /// No message can be left out; or there are no more runs, if the result is not minimal.
    Reduced,
    /// The operations alter no messages: they act before the start, after the end, or on nodes.
    NoneAltered,
    /// The operations alter more messages than a run lists.
    TooMany,
    /// The test does not fail any more if its operations alter exactly the messages that they altered before.
    NotReproduced,
    /// There were no runs left to begin with.
    OutOfRuns,
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
    /// How the reduction to single messages ended; `None` if it was not asked for, or did not begin.
    pub(super) messages: Option<MessagesEnd>,
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
    to_messages: bool,
) -> Result<Reduced, Pending> {
    let mut reduction =
        Reduction { space, oracle, exhausted, guessed: false, test: original.clone(), accepted: Vec::new() };
    let mut messages = None;
    let found = reduction.failing(Phase::Original, std::slice::from_ref(original))?;
    if let Some(index) = found[0] {
        reduction.accepted.push(index);
        reduction.all_the_way()?;
        messages = if to_messages { Some(reduction.fewer_messages()?) } else { None };
    }
    let minimal = !reduction.guessed && !reduction.accepted.is_empty();
    Ok(Reduced { minimal, accepted: reduction.accepted, messages })
}

impl<A: Oracle> Reduction<'_, A> {
    fn all_the_way(&mut self) -> Result<(), Pending> {
        self.fewer_operations()?;
        while self.fewer_members()? {}
        self.shrink_along(Phase::Windows, axis::times(&self.test))?;
        self.simpler_conditions()?;
        self.shrink_along(Phase::Parameters, axis::parameters(&self.test))?;
        self.round_numbers()?;
        while self.fewer_members()? || self.single_steps()? || self.round_numbers()? {}
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

    /// Leaves out operations as long as the rest fails.
    fn fewer_operations(&mut self) -> Result<(), Pending> {
        let (operations, fewest) = (self.test.operations.clone(), self.space.fewest);
        self.fewer(Phase::Operations, operations, usize::MAX, &|kept| {
            (kept.len() >= fewest).then(|| Test { operations: kept.to_vec() })
        })
    }

    /// Lets operations act on fewer members of their groups, on as few as the rest fails with. Returns whether one
    /// does.
    fn fewer_members(&mut self) -> Result<bool, Pending> {
        let (space, whole) = (self.space, &self.test);
        let with_fewer = |(place, used): (usize, &TestOperation)| {
            let choices = space.fewer_members(used);
            choices.into_iter().map(move |choice| {
                let mut test = whole.clone();
                test.operations[place].parameters = choice;
                test
            })
        };
        let tests: Vec<Test> = self.test.operations.iter().enumerate().flat_map(with_fewer).collect();
        Ok(!tests.is_empty() && self.first_failing(Phase::Operations, tests)?.is_some())
    }

    /// Leaves out messages that operations alter as long as the rest fails.
    fn fewer_messages(&mut self) -> Result<MessagesEnd, Pending> {
        let altered = match self.altered()? {
            Some(AlteredMessages::Listed(altered)) => altered,
            Some(AlteredMessages::TooMany) => return Ok(MessagesEnd::TooMany),
            None => {
                self.guessed = true;
                return Ok(MessagesEnd::OutOfRuns);
            }
        };
        if altered.is_empty() {
            return Ok(MessagesEnd::NoneAltered);
        }
        let (whole, fewest) = (self.test.clone(), self.space.fewest);
        let altering = |place: usize| altered.iter().any(|message| message.operation as usize == place);
        let altering: Vec<bool> = (0..whole.operations.len()).map(altering).collect();
        let test_of = |kept: &[AlteredMessage]| {
            let mut test = Test::default();
            for (place, used) in whole.operations.iter().enumerate() {
                let of_this = kept.iter().filter(|message| message.operation as usize == place);
                let messages = Messages::of(of_this.map(|message| (message.wire, message.number)));
                match messages {
                    Some(_) => test.operations.push(TestOperation { messages, ..used.clone() }),
                    // What altered no message matters otherwise, or not at all: it is left as it is.
                    None if !altering[place] => test.operations.push(used.clone()),
                    None => {}
                }
            }
            (test.operations.len() >= fewest).then_some(test)
        };
        let begins = test_of(&altered).into_iter().collect();
        let guessed = self.guessed;
        if self.first_failing(Phase::Messages, begins)?.is_none() {
            return Ok(if self.guessed && !guessed { MessagesEnd::OutOfRuns } else { MessagesEnd::NotReproduced });
        }
        self.fewer(Phase::Messages, altered, AT_ONCE, &test_of)?;
        // For the times of those that are left.
        self.altered()?;
        Ok(MessagesEnd::Reduced)
    }

    /// The messages that the operations of the test alter; `None` if that is not known, and no more runs can tell.
    fn altered(&self) -> Result<Option<AlteredMessages>, Pending> {
        match self.oracle.altered(&self.test) {
            None if !self.exhausted => {
                let (tests, base) = (vec![self.test.clone()], self.accepted.last().copied());
                Err(Pending { phase: Phase::Listing, tests, base })
            }
            known => Ok(known.cloned()),
        }
    }

    /// Delta debugging (Zeller and Hildebrandt 2002, ddmin): parts of the items alone, then all but a part, in ever
    /// smaller parts. `test_of` gives no test where the campaign permits none, and at most `at_once` are asked for
    /// together.
    fn fewer<T: Clone>(
        &mut self,
        phase: Phase,
        mut items: Vec<T>,
        at_once: usize,
        test_of: &dyn Fn(&[T]) -> Option<Test>,
    ) -> Result<(), Pending> {
        let mut parts = 2;
        while items.len() > 1 {
            let all = items.len();
            parts = parts.min(all);
            let bounds = move |part: usize| (part * all / parts, (part + 1) * all / parts);
            // With two parts, leaving one out gives the other.
            let kept_of = |at: usize| match at.checked_sub(parts) {
                None => items[bounds(at).0..bounds(at).1].to_vec(),
                Some(part) => [&items[..bounds(part).0], &items[bounds(part).1..]].concat(),
            };
            let count = if parts > 2 { 2 * parts } else { 2 };
            let mut smaller = None;
            let mut next = 0;
            while smaller.is_none() && next < count {
                let end = next.saturating_add(at_once).min(count);
                let kept = (next..end).map(kept_of).filter_map(|kept| Some((test_of(&kept)?, kept)));
                let (tests, kept): (Vec<Test>, Vec<Vec<T>>) = kept.unzip();
                let found = self.first_failing(phase, tests)?;
                smaller = found.and_then(|at| kept.into_iter().nth(at));
                next = end;
                if smaller.is_none() && self.guessed {
                    // All others are unknown as well.
                    return Ok(());
                }
            }
            match smaller {
                // One part of two, or all but one of more: in either case parts of the same size are left.
                Some(kept) => {
                    parts = if kept.len() * 2 > all { (parts - 1).max(2) } else { 2 };
                    items = kept;
                }
                None if parts >= all => return Ok(()),
                None => parts *= 2,
            }
        }
        Ok(())
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
