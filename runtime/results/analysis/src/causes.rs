//! The causes of violations: for each requirement, the smallest sets of operations with which tests violate it.
//!
//! They follow from the recorded tests of any campaign, whatever its strategy. A set is smallest as far as tests were
//! run: no recorded test with fewer of its operations violates the requirement. Whether a violating test was run again
//! without each of its operations is part of each cause. Operations that are known to have had no effect are not part
//! of any.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use sesame_plan::{Activation, CampaignPlan, OperationId, RequirementId, Test, TestOperation};
use sesame_record::{Judge, Origin, RecordError, Repository, TestRow, Verdict};
use sesame_search::discovery_at_most;
use sesame_search::shrink::strength;
use sesame_search::test_key::TestKey;

use crate::{Datum, Selection, Table};

/// An operation as tests use it. Where tests choose members of a group, each choice counts as an operation of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Act {
    /// The operation.
    pub operation: OperationId,
    /// Which of the permitted choices of members; `None` for an operation whose tests choose none.
    pub members: Option<u32>,
}

impl Act {
    /// The one that a test uses.
    pub fn of(plan: &CampaignPlan, used: &TestOperation) -> Act {
        let members = plan.operation(used.operation).choice_of_members(&used.parameters);
        Act { operation: used.operation, members }
    }

    /// Its name, with the members in brackets: `late[r2]`.
    pub fn name(self, plan: &CampaignPlan) -> String {
        let operation = plan.operation(self.operation);
        let members = self.members.and_then(|members| operation.choices_of_members()?.get(members as usize));
        members.map_or_else(|| operation.name.clone(), |members| format!("{}[{members}]", operation.name))
    }
}

/// A requirement with a smallest set of operations that violates it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// The requirement.
    pub requirement: RequirementId,
    /// The operations, in order of declaration; at least one.
    pub operations: BTreeSet<Act>,
    /// The numbers of the tests that violate the requirement and hold these operations, in rising order.
    pub violating: Vec<u32>,
    /// How many conclusive tests hold these operations.
    pub held: u32,
    /// The smallest of the violating tests that hold no other operations: the fewest uses, then the shortest time, then
    /// the least strength.
    pub smallest: u32,
    /// How many of the violating tests hold no other known cause of the requirement, so that this one explains them.
    pub shown: u32,
    /// What is known of fewer of the operations.
    pub fewer: Fewer,
}

/// What is known of a cause with some of its operations left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fewer {
    /// It has a single operation.
    Single,
    /// There is a test with only these operations that violates the requirement and, whichever of them is left out, no
    /// longer does: all those tests were run.
    NoViolation,
    /// That was not tried, or not for each of them: what is to blame may be fewer of them.
    NotTried,
}

impl Fewer {
    /// The word that tables use.
    pub fn word(self) -> &'static str {
        match self {
            Fewer::Single => "none",
            Fewer::NoViolation => "no violation",
            Fewer::NotTried => "not tried",
        }
    }
}

/// The causes of some tests.
#[derive(Debug, Clone, PartialEq)]
pub struct Causes {
    /// By requirement: those with few operations first, then those that were found first.
    pub found: Vec<Cause>,
    /// What can be said of causes that were not found; `None` where none was.
    pub unseen: Option<Unseen>,
}

/// What the causes of some tests say about causes that none of them showed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unseen {
    /// How many tests there are that are conclusive about a requirement.
    pub tests: u32,
    /// How many causes only one of them showed: a test shows a cause if it holds no other one of the requirement.
    pub once: u32,
    /// An upper bound, at 99 % confidence after Good and Turing, on the probability that a further test shows a new
    /// cause, if tests are drawn independently.
    pub at_most: f64,
    /// Whether the search draws its tests independently; otherwise the bound is biased.
    pub independent: bool,
}

/// What a test says about a requirement, and by which operations.
struct Judged<'a> {
    row: &'a TestRow,
    operations: BTreeSet<Act>,
    violates: bool,
}

/// What tests disturb that are conclusive about a requirement, do not violate it, and hold fewer operations than one of
/// its causes.
struct Harmless<'a> {
    plan: &'a CampaignPlan,
    keys: BTreeSet<TestKey>,
}

impl<'a> Harmless<'a> {
    fn of(plan: &'a CampaignPlan, judged: &[Judged<'_>], smallest: &[&BTreeSet<Act>]) -> Self {
        let is_part = |held: &BTreeSet<Act>| smallest.iter().any(|set| held.len() < set.len() && held.is_subset(set));
        let is_whole = |test: &&Judged<'_>| test.row.left_out == 0;
        let harmless = judged.iter().filter(is_whole).filter(|test| !test.violates && is_part(&test.operations));
        // Operations without effect make no difference: a test stands for the one without them, too.
        let keys = harmless.flat_map(|test| [test.row.test.clone(), acting_test(test.row)]);
        Harmless { plan, keys: keys.map(|test| TestKey::of_disturbance(plan, &test)).collect() }
    }

    /// Whether a violating test was run without each one of its operations, and did not violate the requirement then.
    fn without_each_of(&self, test: &Judged<'_>) -> bool {
        let acting = acting_test(test.row);
        // One that did more than its operations say is not the test of these operations.
        test.row.left_out == 0
            && test.operations.iter().all(|&left_out| {
                let others = acting.operations.iter().filter(|used| Act::of(self.plan, used) != left_out);
                let fewer = Test { operations: others.cloned().collect() };
                self.keys.contains(&TestKey::of_disturbance(self.plan, &fewer))
            })
    }
}

/// The causes in the tests of a selection: by requirement, those with few operations first, then those that were found
/// first.
pub fn causes(repository: &Repository, selection: &Selection) -> Result<Vec<Cause>, RecordError> {
    let (plan, judge, rows) = (repository.plan(), repository.judge()?, repository.tests()?);
    Ok(causes_in(plan, &judge, &selected(&rows, selection)).found)
}

/// The selected tests and the reference runs; every selection includes those.
fn selected<'a>(rows: &'a [TestRow], selection: &Selection) -> Vec<&'a TestRow> {
    rows.iter().filter(|row| row.origin == Origin::Reference || selection.holds(row.number)).collect()
}

/// A cause with the conclusive tests that hold its operations and no other cause of its requirement.
pub(crate) struct CauseAlone {
    pub(crate) cause: Cause,
    /// By the number of a test, whether it violates the requirement.
    pub(crate) tests: BTreeMap<u32, bool>,
}

/// The causes in the tests of a selection, each with the tests that hold no other one.
pub(crate) fn causes_alone(repository: &Repository, selection: &Selection) -> Result<Vec<CauseAlone>, RecordError> {
    let (plan, judge, rows) = (repository.plan(), repository.judge()?, repository.tests()?);
    let rows = selected(&rows, selection);
    let found = causes_in(plan, &judge, &rows).found;
    let (_, tests) = references_and_tests(&rows);
    let mut by_requirement: BTreeMap<RequirementId, Vec<Judged<'_>>> = BTreeMap::new();
    for cause in &found {
        let judge_all = || judged(plan, &judge, &tests, cause.requirement);
        by_requirement.entry(cause.requirement).or_insert_with(judge_all);
    }
    let of = found.iter().map(|cause| {
        let of_requirement = found.iter().filter(|other| other.requirement == cause.requirement);
        let others: Vec<_> =
            of_requirement.map(|other| &other.operations).filter(|other| **other != cause.operations).collect();
        let holds_it_alone = |test: &Judged<'_>| {
            cause.operations.is_subset(&test.operations) && !others.iter().any(|set| set.is_subset(&test.operations))
        };
        let holding = by_requirement[&cause.requirement].iter().filter(|test| holds_it_alone(test));
        let tests = holding.map(|test| (test.row.number, test.violates)).collect();
        CauseAlone { cause: cause.clone(), tests }
    });
    Ok(of.collect())
}

/// The causes in these tests, and what they say about others. A requirement that a reference run among them violates
/// has none: no operation is needed to violate it.
pub fn causes_in(plan: &CampaignPlan, judge: &Judge<'_>, rows: &[&TestRow]) -> Causes {
    let (references, rows) = references_and_tests(rows);
    let mut found = Vec::new();
    let mut conclusive = BTreeSet::new();
    for requirement in (0..).map(RequirementId).take(plan.requirements.len()) {
        if judged(plan, judge, &references, requirement).iter().any(|run| run.violates) {
            continue;
        }
        let judged = judged(plan, judge, &rows, requirement);
        conclusive.extend(judged.iter().map(|test| test.row.number));
        found.extend(of_requirement(plan, &judged, requirement));
    }
    let tests = u32::try_from(conclusive.len()).unwrap_or(u32::MAX);
    let shown = |times: u32| found.iter().filter(|cause| cause.shown == times).count();
    let [once, twice] = [1, 2].map(|times| u32::try_from(shown(times)).unwrap_or(u32::MAX));
    let strategy = plan.campaign.search.strategy();
    let unseen = (!found.is_empty()).then(|| Unseen {
        tests,
        once,
        at_most: discovery_at_most(once, twice, tests),
        independent: strategy.is_some_and(|strategy| strategy.kind().properties().independent),
    });
    Causes { found, unseen }
}

/// The reference runs, and the tests without duplicates.
fn references_and_tests<'a>(rows: &[&'a TestRow]) -> (Vec<&'a TestRow>, Vec<&'a TestRow>) {
    let (references, mut tests): (Vec<&TestRow>, Vec<&TestRow>) =
        rows.iter().copied().partition(|row| row.origin == Origin::Reference);
    tests.retain(|row| row.duplicate_of.is_none());
    (references, tests)
}

/// The causes as a table.
pub fn table(plan: &CampaignPlan, causes: &[Cause]) -> Table {
    let columns = ["requirement", "operations", "violating", "of", "first", "smallest", "fewer"].map(str::to_owned);
    let mut table = Table::new(columns);
    for cause in causes {
        let names: Vec<String> = cause.operations.iter().map(|act| act.name(plan)).collect();
        table.row([
            Datum::text(&plan.requirement(cause.requirement).name),
            Datum::Text(names.join(" + ")),
            Datum::Whole(i64::try_from(cause.violating.len()).unwrap_or(i64::MAX)),
            Datum::Whole(i64::from(cause.held)),
            cause.violating.first().map_or(Datum::Missing, |&test| Datum::test(test)),
            Datum::test(cause.smallest),
            Datum::text(cause.fewer.word()),
        ]);
    }
    table
}

/// What each test says about a requirement, if it is conclusive.
fn judged<'a>(
    plan: &CampaignPlan,
    judge: &Judge<'_>,
    rows: &[&'a TestRow],
    requirement: RequirementId,
) -> Vec<Judged<'a>> {
    let declared = plan.requirement(requirement);
    rows.iter()
        .filter_map(|row| {
            let violates = match judge.verdict(row, declared) {
                Verdict::Violated => true,
                Verdict::Satisfied => false,
                Verdict::Inconclusive => return None,
            };
            Some(Judged { row, operations: acting(plan, row), violates })
        })
        .collect()
}

fn of_requirement(plan: &CampaignPlan, judged: &[Judged<'_>], requirement: RequirementId) -> Vec<Cause> {
    let sets: BTreeSet<&BTreeSet<Act>> = judged
        .iter()
        .filter(|test| test.violates && !test.operations.is_empty())
        .map(|test| &test.operations)
        .collect();
    // Small ones first, so that each needs to be compared with the smallest ones only.
    let mut sets: Vec<&BTreeSet<Act>> = sets.into_iter().collect();
    sets.sort_by_key(|set| set.len());
    let mut smallest: Vec<&BTreeSet<Act>> = Vec::new();
    for set in sets {
        if !smallest.iter().any(|known| known.is_subset(set)) {
            smallest.push(set);
        }
    }
    let harmless = Harmless::of(plan, judged, &smallest);
    let mut causes: Vec<Cause> =
        smallest.iter().map(|set| cause(&harmless, judged, requirement, set, &smallest)).collect();
    causes.sort_by_key(|cause| (cause.operations.len(), cause.violating.first().copied()));
    causes
}

/// The operations of a test, without those that are known to have had no effect.
fn acting(plan: &CampaignPlan, row: &TestRow) -> BTreeSet<Act> {
    acting_uses(row).map(|used| Act::of(plan, used)).collect()
}

/// A test without the operations that are known to have had no effect.
fn acting_test(row: &TestRow) -> Test {
    Test { operations: acting_uses(row).cloned().collect() }
}

fn acting_uses(row: &TestRow) -> impl Iterator<Item = &TestOperation> {
    let idle = |at: usize| row.idle.get(at).copied().unwrap_or(false);
    row.test.operations.iter().enumerate().filter(move |(at, _)| !idle(*at)).map(|(_, used)| used)
}

/// The cause with a set of operations; `all` are the sets of all causes of the requirement.
fn cause(
    harmless: &Harmless<'_>,
    judged: &[Judged<'_>],
    requirement: RequirementId,
    set: &BTreeSet<Act>,
    all: &[&BTreeSet<Act>],
) -> Cause {
    let holding = || judged.iter().filter(|test| set.is_subset(&test.operations));
    let violating: Vec<u32> = holding().filter(|test| test.violates).map(|test| test.row.number).collect();
    let only = || judged.iter().filter(|test| test.violates && test.operations == *set);
    let smallest = only().min_by(|a, b| {
        let size = |test: &Judged<'_>| {
            (test.row.test.operations.len(), length(&test.row.test), strength(harmless.plan, &test.row.test))
        };
        let ((a_uses, a_length, a_strength), (b_uses, b_length, b_strength)) = (size(a), size(b));
        let by_size = a_uses.cmp(&b_uses).then(a_length.total_cmp(&b_length)).then(a_strength.total_cmp(&b_strength));
        by_size.then(a.row.number.cmp(&b.row.number))
    });
    let is_alone = |test: &&Judged<'_>| all.iter().filter(|other| other.is_subset(&test.operations)).count() == 1;
    let shown = holding().filter(|test| test.violates).filter(is_alone).count();
    Cause {
        requirement,
        operations: set.clone(),
        violating,
        held: u32::try_from(holding().count()).unwrap_or(u32::MAX),
        smallest: smallest.map_or(0, |test| test.row.number),
        shown: u32::try_from(shown).unwrap_or(u32::MAX),
        fewer: match set.len() {
            1 => Fewer::Single,
            _ if only().any(|test| harmless.without_each_of(test)) => Fewer::NoViolation,
            _ => Fewer::NotTried,
        },
    }
}

/// The sum of the lengths of windows and activations, in seconds.
fn length(test: &Test) -> f64 {
    let lengths = test.operations.iter().map(|used| match &used.activation {
        Activation::Time { start, end } => end - start,
        Activation::ConditionFor { length, .. } => *length,
        Activation::Condition { .. } | Activation::Offline => 0.0,
    });
    lengths.sum()
}

#[cfg(test)]
mod tests {
    use sesame_plan::Bound;
    use sesame_record::sample;

    use super::*;

    /// Beside every set of operations: none with fewer operations violates the requirement, and each violating test
    /// holds a cause.
    #[test]
    fn causes_are_smallest_and_explain_every_violating_test() {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::covering(folder.path());
        let (plan, judge) = (repository.plan(), repository.judge().unwrap());
        let found = causes(&repository, &Selection::default()).unwrap();
        let rows = repository.tests().unwrap();
        let mut explained = 0;
        for requirement in (0..).map(RequirementId).take(plan.requirements.len()) {
            let of: Vec<&Cause> = found.iter().filter(|cause| cause.requirement == requirement).collect();
            let declared = plan.requirement(requirement);
            let violates =
                |row: &&TestRow| row.origin != Origin::Reference && judge.verdict(row, declared) == Verdict::Violated;
            for row in rows.iter().filter(violates).filter(|row| !acting(plan, row).is_empty()) {
                assert!(of.iter().any(|cause| cause.operations.is_subset(&acting(plan, row))), "{}", row.number);
                assert!(!of.iter().any(|cause| {
                    acting(plan, row).len() < cause.operations.len() && acting(plan, row).is_subset(&cause.operations)
                }));
                explained += 1;
            }
            for cause in of {
                assert!(cause.violating.contains(&cause.smallest) && cause.held as usize >= cause.violating.len());
                assert!((1..=cause.violating.len()).contains(&(cause.shown as usize)), "its smallest test shows it");
            }
        }
        assert!(explained > 0, "some tests violate a requirement");
    }

    /// A test of these operations, all of them active from a time on.
    fn row(number: u32, operations: &[u32], start: f64) -> TestRow {
        let used = |&operation: &u32| TestOperation {
            operation: OperationId(operation),
            activation: Activation::Time { start, end: start + 5.0 },
            parameters: Vec::new(),
            operation_seed: u64::from(operation),
            messages: None,
        };
        TestRow {
            number,
            origin: Origin::Search,
            generation: None,
            test: Test { operations: operations.iter().map(used).collect() },
            idle: vec![false; operations.len()],
            outcome: sesame_base::observation::Outcome::Completed,
            end: 60.0,
            duplicate_of: None,
            values: Vec::new(),
            left_out: 0,
        }
    }

    #[test]
    fn fewer_operations_were_tried_if_the_same_test_ran_without_each() {
        let plan = sample::plan();
        let both = row(1, &[0, 1], 10.0);
        let known = |others: &[TestRow]| {
            let violating = Judged { row: &both, operations: acting(&plan, &both), violates: true };
            let others = others.iter().map(|row| Judged { row, operations: acting(&plan, row), violates: false });
            let judged: Vec<Judged<'_>> = std::iter::once(violating).chain(others).collect();
            let found = of_requirement(&plan, &judged, RequirementId(0));
            assert_eq!(found.len(), 1);
            found[0].fewer
        };
        let (first, second) = (row(2, &[0], 10.0), row(3, &[1], 10.0));
        assert_eq!(known(&[]), Fewer::NotTried);
        assert_eq!(known(std::slice::from_ref(&first)), Fewer::NotTried);
        let elsewhere = row(3, &[1], 20.0);
        assert_eq!(known(&[first.clone(), elsewhere]), Fewer::NotTried, "at another time it is another test");
        assert_eq!(known(&[first.clone(), second.clone()]), Fewer::NoViolation);
        // What had no effect makes no difference.
        let mut with_idle = row(3, &[1, 2], 10.0);
        with_idle.idle[1] = true;
        assert_eq!(known(&[first.clone(), with_idle]), Fewer::NoViolation);
        // One of which operations could not be imported did more.
        assert_eq!(known(&[first, TestRow { left_out: 1, ..second }]), Fewer::NotTried);
    }

    #[test]
    fn what_the_undisturbed_system_violates_has_no_cause() {
        let folder = tempfile::tempdir().unwrap();
        let mut plan = sample::plan();
        plan.requirements[0].bound = Bound::Below { value: 0.0 };
        let repository = sample::campaign(folder.path(), &plan, 60);
        let of_first = |rows: &[&TestRow]| {
            let found = causes_in(&plan, &repository.judge().unwrap(), rows).found;
            found.iter().filter(|cause| cause.requirement == RequirementId(0)).count()
        };
        let rows = repository.tests().unwrap();
        let all: Vec<&TestRow> = rows.iter().collect();
        let disturbed: Vec<&TestRow> = rows.iter().filter(|row| row.origin != Origin::Reference).collect();
        assert!(of_first(&disturbed) > 0, "operations would be blamed for it");
        assert_eq!(of_first(&all), 0);
        let selected = causes(&repository, &Selection::default()).unwrap();
        assert!(selected.iter().all(|cause| cause.requirement != RequirementId(0)));
    }
}
