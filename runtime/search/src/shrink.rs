//! Shrinking a failing test: the fewest operations, then the shortest windows, then the simplest conditions, then the
//! mildest parameters with which it still fails in the same way; and if that is asked for, the fewest messages, and
//! variations of the windows that show when the operations have to act.
//!
//! Guarantees: the result fails, or is the original test; it is permitted if the original is; it keeps the operation
//! seeds, so that the rest of a disturbance is what it was; no single step can shrink it further, unless the
//! evaluations were used up; and no test is run twice for it. A step is one operation, one side of an `and` or `or` of
//! a condition, one activation by condition, or [`RESOLUTION`] of the permitted range of a time or a parameter. Times
//! and parameters end on numbers with three significant digits of that range where the test with these still fails.
//!
//! Like every [`Strategy`](crate::Strategy) it is a function of what it was told, so an interrupted run can be resumed.

mod axis;
mod each;
mod reduce;
mod space;
#[cfg(test)]
mod tests;
mod variations;

use std::collections::BTreeMap;

pub use reduce::MessagesEnd;
use reduce::{Oracle, Pending, Reduced, reduce};
use space::ShrinkSpace;
use variations::{Variation, variations};

use sesame_base::observation::AlteredMessages;
use sesame_base::verdict::fails;
use sesame_plan::{CampaignPlan, Choice, Failing, Shrinking, Span, Test};
use sesame_rng::derive_seed;

use crate::test_key::TestKey;
use crate::{Candidate, Evaluated};

pub use each::ShrinkEach;
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
    /// The smallest test so far is run again, and lists the messages that its operations alter.
    Listing,
    /// Fewer messages are altered.
    Messages,
    /// Windows lie elsewhere.
    Variations,
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
            Phase::Listing => "list of messages",
            Phase::Messages => "messages",
            Phase::Variations => "variations",
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
    /// The messages that its operations altered in any of its runs, if that was asked for.
    pub altered: Option<AlteredMessages>,
}

/// What one run of a test showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The run's number in the campaign.
    pub number: u32,
    /// Whether it failed as the test did.
    pub failed: bool,
    /// The messages that operations altered, if that was asked for.
    pub altered: Option<AlteredMessages>,
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
    /// The same of those that list messages.
    listings: BTreeMap<TestKey, usize>,
    /// Whether the reduction goes on to single messages.
    to_messages: bool,
    /// Whether windows of the smallest test are varied.
    varies: bool,
    /// How many of the variations were asked for.
    varied: usize,
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
        let Shrinking { test, failing, simulator_seed, runs, evaluations, messages, when, name: _ } = shrinking;
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
            listings: BTreeMap::new(),
            to_messages: messages,
            varies: when,
            varied: 0,
            asked: 0,
            generation: 0,
            awaited: 0,
            reduced: None,
        }
    }

    /// Takes what each run of the generation asked last showed.
    pub fn learn(&mut self, results: &[Shown]) {
        assert!(results.len() == self.awaited, "exactly the generation asked last is told");
        self.awaited = 0;
        for (tried, runs) in self.tried[self.asked..].iter_mut().zip(results.chunks(self.runs as usize)) {
            let failed = runs.iter().filter(|run| run.failed).count();
            tried.failed = Some(u32::try_from(failed).unwrap_or(u32::MAX));
            tried.number = runs[0].number;
            tried.altered = runs.iter().filter_map(|run| run.altered.clone()).reduce(AlteredMessages::with);
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
        let reduced = reduced.or_else(|| reduce(&self.space, &self.test, self, true, self.to_messages).ok());
        reduced.map_or_else(Vec::new, |reduced| reduced.accepted)
    }

    /// How the reduction to single messages ended; `None` if it was not asked for, or has not.
    pub fn messages(&self) -> Option<MessagesEnd> {
        self.reduced.as_ref()?.messages
    }

    /// The messages that the operations of a test that was tried alter, if that was asked for.
    pub fn altered_by(&self, tried: usize) -> Option<&AlteredMessages> {
        self.altered(&self.tried[tried].test)
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

/// Where a parameter of a test begins to matter: a step further towards its mildest value the test does not fail.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// The position of the operation in the test.
    pub operation: usize,
    /// The position of the parameter in the operation.
    pub parameter: usize,
    /// The mildest choice that was seen to fail.
    pub fails: Choice,
    /// The strongest one that was seen not to.
    pub passes: Choice,
}

impl Shrink {
    /// The thresholds of the smallest test, before it was reduced to messages; with each the position of the test among
    /// those tried. None of parameters that can be as mild as is permitted, or whose next step was not tried.
    pub fn thresholds(&self) -> Vec<(usize, Threshold)> {
        let Some(smallest) = self.smallest_of_all_messages() else { return Vec::new() };
        let test = &self.tried[smallest].test;
        let mut found = Vec::new();
        for axis in axis::parameters(test) {
            if axis.steps(&self.space, test) == 0 {
                continue;
            }
            let milder = axis.shrink_along(&self.space, test, 1);
            if self.find(&milder).is_none_or(|(_, fails)| fails) {
                continue;
            }
            let pairs = test.operations.iter().zip(&milder.operations).enumerate();
            found.extend(pairs.flat_map(|(operation, (used, milder))| {
                let choices = used.parameters.iter().zip(&milder.parameters).enumerate();
                let differing = choices.filter(|(_, (fails, passes))| fails != passes);
                differing.map(move |(parameter, (fails, passes))| {
                    let (fails, passes) = (fails.clone(), passes.clone());
                    (smallest, Threshold { operation, parameter, fails, passes })
                })
            }));
        }
        found
    }

    /// Takes away the tests that it can still try, and says how many they were.
    fn take_left(&mut self) -> u32 {
        std::mem::take(&mut self.left)
    }

    /// Lets it try so many tests more. If it was over for want of them, it goes on.
    fn add(&mut self, tests: u32) {
        self.left += tests;
        if tests > 0 && self.wants_more() {
            self.reduced = None;
        }
    }

    /// Whether it is over for want of runs.
    fn wants_more(&self) -> bool {
        let reduced = self.reduced.as_ref();
        reduced.is_some_and(|reduced| !reduced.accepted.is_empty() && !reduced.minimal)
            || self.varied < self.planned_variations().len()
    }
}

/// A variation of the smallest test: one of its windows lies elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Varied {
    /// The position of the operation in the smallest test.
    pub operation: usize,
    /// Its window.
    pub window: Span,
    /// Whether the test with this window failed.
    pub fails: bool,
    /// Whether a description of when it fails is held against this one, rather than made of it.
    pub fresh: bool,
}

impl Shrink {
    /// The smallest test, before it was reduced to messages: its position among those tried.
    pub fn smallest_of_all_messages(&self) -> Option<usize> {
        self.accepted().into_iter().rev().find(|&at| self.tried[at].phase != Phase::Messages)
    }

    /// The variations of the smallest test that were run.
    pub fn variations(&self) -> Vec<Varied> {
        let planned = self.planned_variations().into_iter().take(self.varied);
        let ran = planned.filter_map(|Variation { operation, window, fresh, test }| {
            let (_, fails) = self.find(&test)?;
            Some(Varied { operation, window, fails, fresh })
        });
        ran.collect()
    }

    /// All variations that there may be. None until nothing can be left out of the smallest test.
    fn planned_variations(&self) -> Vec<Variation> {
        let minimal = self.varies && self.is_minimal();
        let smallest = if minimal { self.smallest_of_all_messages() } else { None };
        smallest.map_or_else(Vec::new, |at| variations(&self.space, &self.tried[at].test, self.simulator_seed))
    }

    /// Asks for as many further variations as can be run.
    fn ask_variations(&mut self) -> Vec<Candidate> {
        let planned = self.planned_variations();
        let mut tests: Vec<Test> = Vec::new();
        for Variation { test, .. } in planned.into_iter().skip(self.varied) {
            let known = self.find(&test).is_some() || tests.contains(&test);
            if !known && tests.len() == self.left as usize {
                break;
            }
            if !known {
                tests.push(test);
            }
            self.varied += 1;
        }
        let base = self.smallest_of_all_messages();
        if tests.is_empty() { Vec::new() } else { self.asked(Pending { phase: Phase::Variations, tests, base }) }
    }
}

impl Oracle for Shrink {
    fn find(&self, test: &Test) -> Option<(usize, bool)> {
        let &at = self.known.get(&TestKey::exact(test))?;
        Some((at, self.tried[at].failed? == self.runs))
    }

    fn altered(&self, test: &Test) -> Option<&AlteredMessages> {
        let &at = self.listings.get(&TestKey::exact(test))?;
        self.tried[at].altered.as_ref()
    }
}

impl Shrink {
    /// The tests to run next; none when the shrink is over.
    pub fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        if self.reduced.is_none() {
            match reduce(&self.space, &self.test, self, self.left == 0, self.to_messages) {
                Ok(reduced) => self.reduced = Some(reduced),
                Err(pending) => return self.asked(pending),
            }
        }
        self.ask_variations()
    }

    /// The runs of tests that have to be run, as far as they can be.
    fn asked(&mut self, pending: Pending) -> Vec<Candidate> {
        let Pending { phase, mut tests, base } = pending;
        tests.truncate(self.left as usize);
        self.asked = self.tried.len();
        let parents: Vec<u32> = base.map(|base| self.tried[base].number).into_iter().collect();
        let mut candidates = Vec::with_capacity(tests.len() * self.runs as usize);
        for test in tests {
            self.left -= 1;
            let list = if phase == Phase::Listing { &mut self.listings } else { &mut self.known };
            list.insert(TestKey::exact(&test), self.tried.len());
            let number = u32::try_from(self.tried.len()).unwrap_or(u32::MAX).saturating_mul(self.runs) + 1;
            self.tried.push(Tried { test: test.clone(), phase, base, failed: None, number, altered: None });
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

    /// What a run of a candidate showed.
    fn shown(&self, result: &Evaluated) -> Shown {
        let run = &result.run;
        Shown {
            number: result.number,
            failed: fails(&self.plan, &self.failing, &run.outcome, |id| run.value(id)),
            altered: run.altered.clone(),
        }
    }

    /// Whether the runs of the generation asked last list the messages that operations alter.
    pub fn lists_altered(&self) -> bool {
        self.awaited > 0 && self.tried[self.asked].phase == Phase::Listing
    }

    /// Why it is over.
    pub fn ended(&self) -> Option<String> {
        let reduced = self.reduced.as_ref()?;
        Some(if reduced.accepted.is_empty() {
            "the test did not fail again".to_owned()
        } else if reduced.minimal {
            match reduced.messages {
                None => "no single step is left that still fails",
                Some(MessagesEnd::Reduced) => "no single step and no single message is left that can be spared",
                Some(MessagesEnd::NoneAltered) => "no single step is left that still fails, and no message is altered",
                Some(MessagesEnd::TooMany) => {
                    "no single step is left that still fails, and too many messages are altered to go on with them"
                }
                Some(MessagesEnd::NotReproduced | MessagesEnd::OutOfRuns) => {
                    "no single step is left that still fails; single messages could not be tried"
                }
            }
            .to_owned()
        } else {
            "all evaluations were used up".to_owned()
        })
    }
}
