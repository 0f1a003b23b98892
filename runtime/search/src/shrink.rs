//! Shrinking a failing test: the fewest operations, then the shortest windows, then the simplest conditions, then the
//! mildest parameters with which it still fails in the same way.
//!
//! Guarantees: the result fails, or is the original test; it is permitted if the original is; it keeps the operation
//! seeds, so that the rest of a disturbance is what it was; no single step can shrink it further, unless the
//! evaluations were used up; and no test is run twice for it. A step is one operation, one side of an `and` or `or` of
//! a condition, one activation by condition, or [`RESOLUTION`] of the permitted range of a time or a parameter. Times
//! and parameters end on numbers with three significant digits of that range where the test with these still fails.
//!
//! Like every [`Strategy`] it is a function of what it was told, so an interrupted run can be resumed.

mod axis;
mod reduce;
mod space;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use reduce::{Oracle, Pending, Reduced, reduce};
use space::ShrinkSpace;

use sesame_base::observation::Observation;
use sesame_base::verdict::fails;
use sesame_plan::{CampaignPlan, Failing, Shrinking, Test};
use sesame_rng::derive_seed;

use crate::test_key::TestKey;
use crate::{Candidate, Evaluated, Strategy};

pub use space::{RESOLUTION, strength};

/// What is being shrunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The original test.
    Original,
    /// Operations are left out.
    Operations,
    /// Windows and activations are shorter, activations fewer.
    Windows,
    /// Conditions are simpler.
    Conditions,
    /// Parameters are milder.
    Parameters,
    /// Every single step that is left is tried, so that none is.
    LocalMinimality,
}

impl Phase {
    /// What is tried, in a few words.
    pub fn words(self) -> &'static str {
        match self {
            Phase::Original => "original",
            Phase::Operations => "operations",
            Phase::Windows => "windows",
            Phase::Conditions => "conditions",
            Phase::Parameters => "parameters",
            Phase::LocalMinimality => "last steps",
        }
    }
}

/// A test that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// The test.
    pub test: Test,
    /// What it was tried for.
    pub phase: Phase,
    /// The test that it was made of: its position among those tried; `None` for the one that was given.
    pub base: Option<usize>,
    /// In how many of its runs it failed; `None` while they are not known.
    pub failed: Option<u32>,
    /// Number of the first of its runs in the campaign, from 1; the others follow.
    pub number: u32,
}

/// Shrinks a test, by ask and tell of which candidates fail as it does.
#[derive(Debug, Clone)]
pub struct Shrink {
    space: ShrinkSpace,
    plan: CampaignPlan,
    failing: Failing,
    test: Test,
    simulator_seed: u64,
    runs: u32,
    /// Candidates that can still be run.
    left: u32,
    tried: Vec<Tried>,
    /// Positions among those tried, by content.
    known: BTreeMap<TestKey, usize>,
    /// Position of the first test of the generation asked last.
    asked: usize,
    generation: u32,
    /// How many runs of that generation are to be told.
    awaited: usize,
    reduced: Option<Reduced>,
}

impl Shrink {
    /// Shrinks this test of a plan.
    pub fn new(plan: &CampaignPlan, shrinking: Shrinking) -> Shrink {
        Shrink::with_resolution(plan, shrinking, RESOLUTION)
    }

    fn with_resolution(plan: &CampaignPlan, shrinking: Shrinking, resolution: f64) -> Shrink {
        let Shrinking { test, failing, simulator_seed, runs, evaluations, name: _ } = shrinking;
        let runs = runs.max(1);
        Shrink {
            space: ShrinkSpace::from_plan(plan, resolution),
            plan: plan.clone(),
            failing,
            test,
            simulator_seed,
            runs,
            left: evaluations / runs,
            tried: Vec::new(),
            known: BTreeMap::new(),
            asked: 0,
            generation: 0,
            awaited: 0,
            reduced: None,
        }
    }

    /// Takes of each run of the generation asked last its number, and whether it failed as the test did.
    pub fn learn(&mut self, results: &[(u32, bool)]) {
        assert!(results.len() == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
        for (tried, runs) in self.tried[self.asked..].iter_mut().zip(results.chunks(self.runs as usize)) {
            let failed = runs.iter().filter(|(_, failed)| *failed).count();
            tried.failed = Some(u32::try_from(failed).unwrap_or(u32::MAX));
            tried.number = runs[0].0;
        }
        self.generation += 1;
    }

    /// All tests that were tried, in the order in which they were asked for.
    pub fn tried(&self) -> &[Tried] {
        &self.tried
    }

    /// Positions among those tried of the tests that were gone to so far, the smallest last. Empty where the test that
    /// was given does not fail, and as long as that is not known.
    pub fn accepted(&self) -> Vec<usize> {
        let reduced = self.reduced.clone();
        // With nothing more to be run the reduce goes as far as what is known leads.
        let reduced = reduced.or_else(|| reduce(&self.space, &self.test, self, true).ok());
        reduced.map_or_else(Vec::new, |reduced| reduced.accepted)
    }

    /// Whether no single step can shrink the smallest test: all of them were run.
    pub fn is_minimal(&self) -> bool {
        self.reduced.as_ref().is_some_and(|reduced| reduced.minimal)
    }

    /// In how many runs each test is run.
    pub fn runs(&self) -> u32 {
        self.runs
    }
}

impl Oracle for Shrink {
    fn find(&self, test: &Test) -> Option<(usize, bool)> {
        let &at = self.known.get(&TestKey::exact(test))?;
        Some((at, self.tried[at].failed? == self.runs))
    }
}

impl Strategy for Shrink {
    fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        if self.reduced.is_some() {
            return Vec::new();
        }
        let Pending { phase, mut tests, base } = match reduce(&self.space, &self.test, self, self.left == 0) {
            Ok(reduced) => {
                self.reduced = Some(reduced);
                return Vec::new();
            }
            Err(asked) => asked,
        };
        tests.truncate(self.left as usize);
        self.asked = self.tried.len();
        let parents: Vec<u32> = base.map(|base| self.tried[base].number).into_iter().collect();
        let mut candidates = Vec::with_capacity(tests.len() * self.runs as usize);
        for test in tests {
            self.left -= 1;
            self.known.insert(TestKey::exact(&test), self.tried.len());
            let number = u32::try_from(self.tried.len()).unwrap_or(u32::MAX).saturating_mul(self.runs) + 1;
            self.tried.push(Tried { test: test.clone(), phase, base, failed: None, number });
            candidates.extend((0..self.runs).map(|run| Candidate {
                test: test.clone(),
                parents: parents.clone(),
                generation: self.generation,
                known: None,
                simulator_seed: Some(match run {
                    0 => self.simulator_seed,
                    run => derive_seed(self.simulator_seed, "shrink", &[u64::from(run)]),
                }),
            }));
        }
        self.awaited = candidates.len();
        candidates
    }

    fn tell(&mut self, results: &[Evaluated]) {
        let failed = |run: &Observation| fails(&self.plan, &self.failing, &run.outcome, |id| run.value(id));
        let results: Vec<(u32, bool)> = results.iter().map(|result| (result.number, failed(&result.run))).collect();
        self.learn(&results);
    }

    fn ended(&self) -> Option<String> {
        let reduced = self.reduced.as_ref()?;
        Some(if reduced.accepted.is_empty() {
            "the test did not fail again".to_owned()
        } else if reduced.minimal {
            "no single step is left that still fails".to_owned()
        } else {
            "all evaluations were used up".to_owned()
        })
    }
}
