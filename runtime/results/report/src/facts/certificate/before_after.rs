//! The same tests under two certificates: before a certificate was mended, and after.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::CampaignPlan;
use sesame_record::{RecordError, Repository, TestRow};

use crate::facts::certificate::campaign::missed_by_test;

/// How the monitors of two results did in the same tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mend {
    /// The earlier results.
    pub before: PathBuf,
    /// How the spaces differ in anything but their monitors, in words; `None` if they do not.
    pub difference: Option<String>,
    /// Tests that are in both results.
    pub tests: usize,
    /// In how many of these a hazard was missed before.
    pub missed_before: usize,
    /// In how many of these a hazard is missed now.
    pub missed_after: usize,
    /// The tests in which a hazard was or is missed, by number: those that still miss one first.
    pub changed: Vec<MendedTest>,
}

/// A test in which a hazard was missed before, or is missed now.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MendedTest {
    /// The test.
    pub test: TestNumber,
    /// The same test in the earlier results.
    pub before: TestNumber,
    /// Whether the simulator had the same seed in both.
    pub same_seed: bool,
    /// Hazards that were missed before, as in `R1 by transport`.
    pub missed_before: Vec<String>,
    /// Hazards that are missed now.
    pub missed_after: Vec<String>,
}

/// Compares the tests of results with the same ones of earlier results, whose certificates were others. Tests are the
/// same if they do the same, whatever their numbers; of several, the one with the same seed of the simulator.
pub fn mend(repository: &Repository, before: &Repository) -> Result<Mend, RecordError> {
    let (old_rows, new_rows) = (before.tests()?, repository.tests()?);
    let mut old_missed = missed_by_test(before, &old_rows)?;
    let mut new_missed = missed_by_test(repository, &new_rows)?;
    let [old_seeds, new_seeds] = [before.simulator_seeds()?, repository.simulator_seeds()?];
    let mut known: BTreeMap<Vec<String>, Vec<u32>> = BTreeMap::new();
    for row in old_rows.iter().filter(|row| old_missed.contains_key(&row.number)) {
        known.entry(content(before.plan(), row)).or_default().push(row.number);
    }
    let (mut tests, mut changed) = (0, Vec::new());
    for row in &new_rows {
        let Some(missed_after) = new_missed.remove(&row.number) else { continue };
        let Some(same) = known.get_mut(&content(repository.plan(), row)) else { continue };
        let seed = new_seeds.get(&row.number);
        let place = same.iter().position(|number| old_seeds.get(number) == seed);
        if same.is_empty() {
            continue;
        }
        let old = same.remove(place.unwrap_or(0));
        let missed_before = old_missed.remove(&old).unwrap_or_default();
        let (test, old) = (TestNumber(row.number), TestNumber(old));
        tests += 1;
        changed.push(MendedTest { test, before: old, same_seed: place.is_some(), missed_before, missed_after });
    }
    changed.retain(|test| !test.missed_before.is_empty() || !test.missed_after.is_empty());
    changed.sort_by_key(|test| (test.missed_after.is_empty(), test.test));
    let missed = |of: fn(&MendedTest) -> &Vec<String>| changed.iter().filter(|test| !of(test).is_empty()).count();
    Ok(Mend {
        before: before.folder().to_owned(),
        difference: difference(before.plan(), repository.plan()),
        tests,
        missed_before: missed(|test| &test.missed_before),
        missed_after: missed(|test| &test.missed_after),
        changed,
    })
}

/// What a test does, whatever the numbers of operations are in its plan.
fn content(plan: &CampaignPlan, row: &TestRow) -> Vec<String> {
    row.test.operations.iter().map(|used| notation::test_operation(plan, used)).collect()
}

/// How two plans differ apart from their monitors.
fn difference(before: &CampaignPlan, after: &CampaignPlan) -> Option<String> {
    let without = |plan: &CampaignPlan| CampaignPlan { monitors: after.monitors.clone(), ..plan.clone() };
    without(before).model_difference(&CampaignPlan { space: before.space.clone(), ..after.clone() })
}
