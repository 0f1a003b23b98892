//! Tests that are known before anything is run: known tests, and one test that is repeated.

use sesame_plan::{CampaignPlan, KnownTest, KnownTestId, LabTask, Test, Undisturbed};
use sesame_rng::derive_seed;

use crate::{Candidate, Evaluated, Strategy};

/// Tests that are run in one generation, independently of their results.
#[derive(Debug, Clone)]
pub(crate) struct FixedTests {
    candidates: Vec<Candidate>,
    awaited: usize,
}

impl FixedTests {
    /// Known tests, each once, in this order, and with the seed of the simulator that it names.
    pub(crate) fn known(plan: &CampaignPlan, tests: &[KnownTestId]) -> Self {
        let candidate = |&id| {
            let KnownTest { test, simulator_seed, .. } = plan.test(id);
            let (test, simulator_seed) = (test.clone(), *simulator_seed);
            Candidate { test, parents: Vec::new(), generation: 0, known: Some(id), simulator_seed }
        };
        FixedTests { candidates: tests.iter().map(candidate).collect(), awaited: 0 }
    }

    /// One test this many times, with equal operation seeds, but another seed of the simulator each time. `seed` is
    /// that of the run.
    pub(crate) fn repeated(test: &Test, times: u32, seed: u64) -> Self {
        let repetition = |repetition: u32| Candidate {
            test: test.clone(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed: Some(derive_seed(seed, "simulator", &[u64::from(repetition)])),
        };
        FixedTests { candidates: (1..=times).map(repetition).collect(), awaited: 0 }
    }

    /// These tests, each once.
    pub(crate) fn each_once(tests: &[Test]) -> Self {
        let candidate = |test: &Test| Candidate {
            test: test.clone(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed: None,
        };
        FixedTests { candidates: tests.iter().map(candidate).collect(), awaited: 0 }
    }

    /// The scenario without disturbance, as often as the task says, but for the first time: that is the reference run.
    /// `seed` is that of the run.
    pub(crate) fn undisturbed(task: &Undisturbed, seed: u64) -> Self {
        let run = |run: u32| Candidate {
            test: Test::default(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            // The seed of the reference run has number 0.
            simulator_seed: Some(derive_seed(seed, "simulator", &[if task.equal_seeds { 0 } else { u64::from(run) }])),
        };
        FixedTests { candidates: (1..task.runs).map(run).collect(), awaited: 0 }
    }

    /// Tests in a lab, each as often as the task says, round by round. A stand-in for the lab has another seed in each
    /// run.
    pub(crate) fn in_lab(task: &LabTask, seed: u64) -> Self {
        let tests = (1..=task.repeats).flat_map(|_| &task.tests).zip(1u64..).map(|(known, run)| Candidate {
            test: known.test.clone(),
            parents: Vec::new(),
            generation: 0,
            known: None,
            simulator_seed: Some(derive_seed(seed, "simulator", &[run])),
        });
        FixedTests { candidates: tests.collect(), awaited: 0 }
    }
}

impl Strategy for FixedTests {
    fn ask(&mut self) -> Vec<Candidate> {
        assert!(self.awaited == 0, "a generation is told before the next is asked");
        self.awaited = self.candidates.len();
        std::mem::take(&mut self.candidates)
    }

    fn tell(&mut self, results: &[Evaluated]) {
        assert!(self.awaited == results.len(), "exactly the generation asked last is told");
        self.awaited = 0;
    }
}

#[cfg(test)]
mod tests {
    use sesame_optimise::dominance::Fitness;
    use sesame_plan::testing;

    use super::*;

    #[test]
    fn known_tests_are_asked_for_once_and_a_repeated_one_with_seeds_of_its_own() {
        let test = |name| testing::known_test(name, Test::default());
        let seeded = KnownTest { simulator_seed: Some(11), ..test("seeded") };
        let plan = CampaignPlan { tests: vec![test("a"), seeded, test("b")], ..testing::minimal() };
        let known = FixedTests::known(&plan, &[0, 1, 2].map(KnownTestId));
        let repeated = FixedTests::repeated(&Test::default(), 3, 7);
        for (mut search, is_known) in [(known, true), (repeated, false)] {
            let asked = search.ask();
            assert_eq!(asked.len(), 3);
            assert!(asked.iter().all(|test| test.known.is_some() == is_known));
            let mut seeds: Vec<u64> = asked.iter().filter_map(|test| test.simulator_seed).collect();
            seeds.sort_unstable();
            seeds.dedup();
            assert!(if is_known { seeds == [11] } else { seeds.len() == 3 }, "{seeds:?}");
            let results: Vec<Evaluated> = (1..)
                .zip(asked)
                .map(|(number, candidate)| Evaluated {
                    number,
                    test: candidate.test,
                    fitness: Fitness::Measured(Vec::new()),
                    point: None,
                    run: crate::testing::no_run(),
                    fresh_runs: Vec::new(),
                })
                .collect();
            search.tell(&results);
            assert_eq!(search.ask(), []);
        }
    }
}
