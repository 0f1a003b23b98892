//! What one run of a runner does with a plan: its campaign, or something else with the same model.

use serde::{Deserialize, Serialize};

use crate::{CampaignPlan, Dimension, KnownTestId, Recorded, RequirementId, Search, Test};

/// What one run of a runner does.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Task {
    /// It performs the plan's campaign: `run`.
    #[default]
    Campaign,
    /// It runs known tests of the plan, each once: `known`.
    Known {
        /// Which.
        tests: Vec<KnownTestId>,
        /// The lab in which they are run; `None` for the simulation.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        lab: Option<String>,
    },
    /// It repeats one test: `repeat`.
    Repeat {
        /// The test's name.
        name: String,
        /// The test.
        test: Test,
        /// How often.
        times: u32,
    },
    /// It shrinks a failing test: `shrink`.
    Shrink(Shrinking),
    /// It shrinks several failing tests, one after the other: `shrink --violations`. Runs that one does not need go on
    /// to the next.
    ShrinkEach {
        /// Which; at least one.
        each: Vec<Shrinking>,
    },
    /// It runs chosen tests of a campaign in a lab: `physical`; or somebody ran them there by hand.
    Lab(LabTask),
    /// It simulates the tests that a lab ran, with what [compensates](crate::Compensation) for the reality gap:
    /// `compensate`.
    Compensated(LabTask),
    /// It runs variations of a test along one dimension, each once: `explore`.
    Variations(Variations),
    /// It runs the scenario without disturbance, as preparatory testing does: `null` and `mitm`.
    Undisturbed(Undisturbed),
}

/// Runs of the scenario without disturbance. The reference run is the first of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Undisturbed {
    /// How many; at least one.
    pub runs: u32,
    /// How many of the topics that [operations can act on](CampaignPlan::relayable) pass through the relay, the first
    /// ones; the others are only observed.
    pub relayed: u32,
    /// Whether the simulator has one seed in all runs, so that equal runs show that it is deterministic.
    pub equal_seeds: bool,
    /// The lab in which they are made; `None` for the simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lab: Option<String>,
}

/// Variations of a test of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Variations {
    /// The test's name.
    pub name: String,
    /// The dimension along which they differ.
    pub dimension: Dimension,
    /// The tests, in the order of their coordinates; at least one.
    pub tests: Vec<Test>,
}

/// Tests of a campaign that are run in a lab, or once more in simulation to compare them with a lab.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabTask {
    /// The lab's name.
    pub lab: String,
    /// The digest of the campaign's results.
    pub results: String,
    /// The tests, no two equal; at least one.
    pub tests: Vec<LabTest>,
    /// How often each is run; at least once. All tests are run once before any is run again, so that what changes in
    /// the lab with time is not a difference of tests.
    pub repeats: u32,
}

/// A test of a campaign that is run in a lab.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabTest {
    /// Its number in the campaign's results.
    pub number: u32,
    /// The test.
    pub test: Test,
}

impl LabTask {
    /// The number in the campaign's results of a test that was run in the lab; `None` of another test.
    pub fn of(&self, test: &Test) -> Option<u32> {
        self.tests.iter().find(|known| known.test == *test).map(|known| known.number)
    }
}

/// How a failing test is shrunk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shrinking {
    /// The test's name.
    pub name: String,
    /// The test.
    pub test: Test,
    /// How it fails; the shrunk test fails in the same way.
    pub failing: Failing,
    /// The simulator's seed with which it failed.
    pub simulator_seed: u64,
    /// In how many runs a smaller test has to fail, from 1. The first has the simulator's seed of the test, the others
    /// have seeds of their own.
    pub runs: u32,
    /// The most runs.
    pub evaluations: u32,
    /// Whether the reduction goes on to single messages.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub messages: bool,
    /// Whether windows of the smallest test are varied, to describe when its operations have to act.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub when: bool,
}

/// How a test fails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Failing {
    /// It violates each of these requirements; at least one.
    Violation {
        /// Which.
        requirements: Vec<RequirementId>,
        /// For each of them by how much at least, in the unit of its metric: a test that violates it by less could as
        /// well be one that keeps it, in other arithmetic. Finite and not negative; none is any violation.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        margins: Vec<f64>,
    },
    /// Its run crashes.
    Crash,
    /// Its run times out.
    Timeout,
}

/// A test that is repeated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeated<'a> {
    /// Its name.
    pub name: &'a str,
    /// The test.
    pub test: &'a Test,
    /// How often.
    pub times: u32,
}

impl Task {
    /// How many tests it evaluates, at most.
    pub fn evaluations(&self, plan: &CampaignPlan) -> u32 {
        match self {
            Task::Campaign => plan.campaign.search.evaluations(),
            Task::Known { tests, .. } => u32::try_from(tests.len()).unwrap_or(u32::MAX),
            Task::Repeat { times, .. } => *times,
            Task::Shrink(_) | Task::ShrinkEach { .. } => {
                self.shrinkings().iter().fold(0, |sum: u32, shrinking| sum.saturating_add(shrinking.evaluations))
            }
            Task::Lab(LabTask { tests, repeats, .. }) | Task::Compensated(LabTask { tests, repeats, .. }) => {
                u32::try_from(tests.len()).unwrap_or(u32::MAX).saturating_mul(*repeats)
            }
            Task::Variations(variations) => u32::try_from(variations.tests.len()).unwrap_or(u32::MAX),
            Task::Undisturbed(Undisturbed { runs, .. }) => runs.saturating_sub(1),
        }
    }

    /// The plan as this task uses it. Only a campaign searches: the others have no objectives, coverage, exploration,
    /// confirmation or rules to stop.
    pub fn plan(&self, plan: &CampaignPlan) -> CampaignPlan {
        let mut plan = plan.clone();
        if *self != Task::Campaign {
            let campaign = &mut plan.campaign;
            campaign.objectives.clear();
            campaign.coverage = None;
            campaign.exploration = None;
            campaign.confirm = None;
            campaign.neighbours = None;
            campaign.stop.clear();
            campaign.describes_when = self.shrinkings().iter().any(|shrinking| shrinking.when);
            // What is compared with a simulation is compared in its traces too.
            if self.of_lab().is_some() || matches!(self, Task::Variations(_)) {
                campaign.record = Some(Recorded::All);
            }
        }
        plan
    }

    /// The test that is repeated, by a command or by the campaign itself; `None` if none is.
    pub fn repeated<'a>(&'a self, plan: &'a CampaignPlan) -> Option<Repeated<'a>> {
        match (self, &plan.campaign.search) {
            (Task::Repeat { name, test, times }, _) => Some(Repeated { name, test, times: *times }),
            (Task::Campaign, &Search::Repeat { test, times }) => {
                let known = plan.test(test);
                Some(Repeated { name: &known.name, test: &known.test, times })
            }
            _ => None,
        }
    }

    /// How tests are shrunk; none if no test is.
    pub fn shrinkings(&self) -> &[Shrinking] {
        match self {
            Task::Shrink(shrinking) => std::slice::from_ref(shrinking),
            Task::ShrinkEach { each } => each,
            _ => &[],
        }
    }

    /// What is run in a lab; `None` if nothing is.
    pub fn in_lab(&self) -> Option<&LabTask> {
        if let Task::Lab(lab) = self { Some(lab) } else { None }
    }

    /// Which tests are simulated once more with what compensates for a reality gap; `None` if none are.
    pub fn compensated(&self) -> Option<&LabTask> {
        if let Task::Compensated(lab) = self { Some(lab) } else { None }
    }

    /// The tests of a lab that are run, in the lab or in simulation; `None` if none are.
    pub fn of_lab(&self) -> Option<&LabTask> {
        self.in_lab().or(self.compensated())
    }

    /// Runs without disturbance; `None` if it is about disturbances.
    pub fn undisturbed(&self) -> Option<&Undisturbed> {
        if let Task::Undisturbed(undisturbed) = self { Some(undisturbed) } else { None }
    }

    /// The lab that it runs in; `None` for the simulation.
    pub fn lab(&self) -> Option<&str> {
        match self {
            Task::Known { lab, .. } | Task::Undisturbed(Undisturbed { lab, .. }) => lab.as_deref(),
            Task::Lab(task) => Some(&task.lab),
            Task::Campaign
            | Task::Repeat { .. }
            | Task::Shrink(_)
            | Task::ShrinkEach { .. }
            | Task::Compensated(_)
            | Task::Variations(_) => None,
        }
    }

    /// Whether it searches for tests: only a campaign does, unless it repeats a test.
    pub fn searches(&self, plan: &CampaignPlan) -> bool {
        *self == Task::Campaign && plan.campaign.search.strategy().is_some()
    }

    /// The word that tables use for it.
    pub fn keyword(&self, plan: &CampaignPlan) -> &'static str {
        match self {
            Task::Campaign => plan.campaign.search.keyword(),
            Task::Known { .. } => "known tests",
            Task::Repeat { .. } => "repeat",
            Task::Shrink(_) | Task::ShrinkEach { .. } => "shrink",
            Task::Lab(_) => "lab",
            Task::Compensated(_) => "compensated",
            Task::Variations(_) => "variations",
            Task::Undisturbed(_) => "undisturbed",
        }
    }
}
