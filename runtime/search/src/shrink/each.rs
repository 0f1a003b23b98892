//! Shrinking several tests within one budget, one after the other.
//!
//! Each may first try as many tests as its task says. What one does not need goes on to the next, and at last to those
//! that were over for want of runs.

use sesame_plan::{CampaignPlan, Shrinking};

use crate::shrink::{Shown, Shrink};
use crate::{Candidate, Evaluated, Strategy};

/// Shrinks tests one after the other.
#[derive(Debug, Clone)]
pub struct ShrinkEach {
    each: Vec<Shrink>,
    /// The one at work.
    current: usize,
    /// How many have begun.
    begun: usize,
    generation: u32,
}

impl ShrinkEach {
    /// Shrinks these tests of a plan, of which there is one at least, all in the same number of runs each.
    pub fn new(plan: &CampaignPlan, shrinkings: &[Shrinking]) -> ShrinkEach {
        let each = shrinkings.iter().map(|shrinking| Shrink::new(plan, shrinking.clone())).collect();
        ShrinkEach { each, current: 0, begun: 1, generation: 0 }
    }

    /// The shrink of each test, in their order.
    pub fn each(&self) -> &[Shrink] {
        &self.each
    }

    /// The position of the one that asked last.
    pub fn current(&self) -> usize {
        self.current
    }

    /// Takes what each run of the generation asked last showed.
    pub fn learn(&mut self, results: &[Shown]) {
        self.each[self.current].learn(results);
        self.generation += 1;
    }

    /// The next shrink that is to be asked; `None` if all are over.
    fn next(&self) -> Option<usize> {
        if self.begun < self.each.len() {
            return Some(self.begun);
        }
        self.each.iter().position(Shrink::wants_more)
    }
}

impl Strategy for ShrinkEach {
    fn ask(&mut self) -> Vec<Candidate> {
        loop {
            let mut asked = self.each[self.current].ask();
            if !asked.is_empty() {
                for candidate in &mut asked {
                    candidate.generation = self.generation;
                }
                return asked;
            }
            let spare = self.each[self.current].take_left();
            let Some(next) = self.next() else { return Vec::new() };
            if next < self.begun && spare == 0 {
                return Vec::new();
            }
            self.begun = self.begun.max(next + 1);
            self.current = next;
            self.each[next].add(spare);
        }
    }

    fn tell(&mut self, results: &[Evaluated]) {
        let shown: Vec<Shown> = results.iter().map(|result| self.each[self.current].shown(result)).collect();
        self.learn(&shown);
    }

    fn lists_altered(&self) -> bool {
        self.each[self.current].lists_altered()
    }

    fn ended(&self) -> Option<String> {
        if let [only] = self.each.as_slice() {
            return only.ended();
        }
        let minimal = self.each.iter().filter(|shrink| shrink.is_minimal()).count();
        Some(format!("of {} tests, {minimal} cannot be shrunk by one more step", self.each.len()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::{Activation, Choice, Failing, OperationId, Search, Strategy as Of, Test, TestOperation};

    use super::*;
    use crate::Strategy as _;
    use crate::testing::synthetic_robots::SYNTHETIC_ROBOTS;

    /// A test of so many operations, of which the first is needed.
    fn shrinking(operations: u64, evaluations: u32) -> Shrinking {
        let used = |operation_seed| TestOperation {
            operation: OperationId(0),
            activation: Activation::Time { start: 2.0, end: 50.0 },
            parameters: vec![Choice::Range { low: -0.2, high: 0.25 }],
            operation_seed,
            messages: None,
        };
        Shrinking {
            name: "T1".to_owned(),
            test: Test { operations: (0..operations).map(used).collect() },
            failing: Failing::Crash,
            simulator_seed: 7,
            runs: 1,
            evaluations,
            messages: false,
            when: false,
        }
    }

    fn fails(test: &Test) -> bool {
        test.operations.iter().any(|used| {
            let Activation::Time { start, end } = used.activation else { return false };
            used.operation_seed == 0 && start <= 20.0 && end >= 30.0
        })
    }

    /// Shrinks all, and says how many tests each tried.
    fn shrunk(shrinkings: &[Shrinking]) -> (ShrinkEach, Vec<usize>) {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(Of::Random, 1));
        let mut search = ShrinkEach::new(&plan, shrinkings);
        let (mut number, mut generation) = (0, 0);
        loop {
            let asked = search.ask();
            if asked.is_empty() {
                let tried = search.each().iter().map(|shrink| shrink.tried().len()).collect();
                return (search, tried);
            }
            let shown = |candidate: &Candidate| {
                assert_eq!(candidate.generation, generation, "they rise, whichever test is at work");
                number += 1;
                Shown { number, failed: fails(&candidate.test), altered: None }
            };
            let shown: Vec<Shown> = asked.iter().map(shown).collect();
            search.learn(&shown);
            generation += 1;
        }
    }

    proptest! {
        // Each case shrinks several tests all the way, and each of them alone.
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn runs_that_one_does_not_need_go_on_to_the_others(
            tests in proptest::collection::vec(1u64..6, 1..5),
            share in 1u32..120,
            when: bool,
        ) {
            let shrinking = |operations, evaluations| Shrinking { when, ..shrinking(operations, evaluations) };
            let needed: Vec<usize> = tests.iter().map(|&size| shrunk(&[shrinking(size, 10_000)]).1[0]).collect();
            let each: Vec<Shrinking> = tests.iter().map(|&size| shrinking(size, share)).collect();
            let (search, tried) = shrunk(&each);
            let budget = share as usize * tests.len();
            let enough = needed.iter().sum::<usize>() <= budget;
            prop_assert!(tried.iter().sum::<usize>() <= budget);
            let minimal = search.each().iter().all(Shrink::is_minimal);
            prop_assert!(minimal || !enough, "{:?} of {}", &needed, budget);
            prop_assert!(tried == needed || !enough, "{:?} of {:?}", &tried, &needed);
            for (tried, needed) in tried.iter().zip(&needed) {
                prop_assert!(*tried >= (share as usize).min(*needed), "each has its share");
                prop_assert!(tried <= needed);
            }
            if !minimal {
                prop_assert_eq!(tried.iter().sum::<usize>(), budget, "none is left over while one needs it");
            }
            // One alone does the same as ever.
            let alone = shrunk(&each[..1]).0;
            prop_assert_eq!(alone.ended(), alone.each()[0].ended());
        }
    }
}
