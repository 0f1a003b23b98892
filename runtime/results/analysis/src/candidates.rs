//! Which tests of a campaign may be run in a lab, where they lie in the reduced space, how interesting they are, and
//! what each costs: all that choosing among them needs.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Dimension, Direction, Lab, LabCost, LabExclusion, MetricId, RankKey, RankOrder};
use sesame_record::{Judge, Origin, RecordError, Repository, ScannedTest, Standing};
use sesame_search::sspr::{Convention, Point};
use sesame_search::test_key::TestKey;
use sesame_select::ranking::{self, Better, Key, Scale};

use crate::Selection;
use crate::confirmed::confirmed_tests;
use crate::statistics::Sample;

/// What decides which tests are candidates, and how they are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms {
    /// What tests differ in; at least one, each once.
    pub over: Vec<Dimension>,
    /// What makes a test interesting, the most important first; at least one.
    pub rank: Vec<RankKey>,
    /// What running a test costs.
    pub cost: LabCost,
    /// What running these tests costs instead, by number; 0 or more.
    pub costs: BTreeMap<u32, f64>,
    /// Tests of which one of these holds must not be run.
    pub exclude: Vec<LabExclusion>,
    /// What all tests together may cost; positive.
    pub budget: f64,
    /// Only tests of which fresh runs have confirmed a finding.
    pub confirmed: bool,
    /// Whose formulas reduce a test to a point.
    pub convention: Convention,
}

impl Terms {
    /// As a lab says; `None` for one without a budget.
    pub fn of_lab(plan: &CampaignPlan, lab: &Lab) -> Option<Terms> {
        let budget = lab.budget.as_ref()?;
        Some(Terms {
            over: budget.over.clone(),
            rank: if lab.rank.is_empty() { Terms::rank_by_objectives(plan) } else { lab.rank.clone() },
            cost: lab.cost,
            costs: BTreeMap::new(),
            exclude: lab.exclude.clone(),
            budget: budget.limit,
            confirmed: false,
            convention: Convention::Ours,
        })
    }

    /// By the objectives of a campaign, each in its direction: what a lab says that says nothing of its own.
    pub fn rank_by_objectives(plan: &CampaignPlan) -> Vec<RankKey> {
        let order = |metric: MetricId| match plan.metric(metric).direction {
            Some(Direction::Maximise) => RankOrder::Descending,
            Some(Direction::Minimise) | None => RankOrder::Ascending,
        };
        plan.campaign.objectives.iter().map(|&metric| RankKey { metric, order: order(metric) }).collect()
    }
}

/// A test that may be run in the lab.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its number.
    pub number: u32,
    /// A coordinate per dimension of [`Terms::over`]. Numbers of operations are shares of the most that a test may
    /// hold.
    pub point: Vec<f64>,
    /// The values it is ranked by, one per key.
    pub values: Vec<f64>,
    /// What running it costs.
    pub cost: f64,
}

/// Why a test is not a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LeftOut {
    /// It is equal to this one, or differs only in its operation seeds.
    Duplicate {
        /// The number of the other.
        of: u32,
    },
    /// None of its operations had an effect.
    NoEffect,
    /// No operation was active when the run ended, or none has a numeric parameter, so it has no place in this
    /// dimension.
    NoPlace {
        /// Which.
        dimension: Dimension,
    },
    /// It has no value of a metric that it is ranked or excluded by.
    Unmeasured {
        /// Which.
        metric: MetricId,
    },
    /// It is too dangerous.
    Excluded {
        /// By what.
        by: LabExclusion,
        /// The value.
        value: f64,
    },
    /// It costs more than there is.
    TooExpensive {
        /// Its cost.
        cost: f64,
    },
    /// No finding of it is confirmed.
    NotConfirmed,
}

/// The tests that may be run, and the others with the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidates {
    /// By number.
    pub tests: Vec<Candidate>,
    /// By number.
    pub left_out: Vec<(u32, LeftOut)>,
    /// The keys of all measured tests of the file, candidates or not: per test a number per key that is smaller the
    /// earlier the test comes. Ranks are among these [SESAME 2023, §4.4.2].
    pub measured: BTreeMap<u32, Vec<f64>>,
}

/// The tests of a selection that may be run in a lab. A value is the median of fresh runs where there are any, else the
/// recorded one.
pub fn candidates(repository: &Repository, selection: &Selection, terms: &Terms) -> Result<Candidates, RecordError> {
    let plan = repository.plan();
    let judge = repository.judge()?;
    let confirmed: Option<BTreeSet<u32>> = if terms.confirmed { Some(confirmed(repository, &judge)?) } else { None };
    let mut found = Candidates { tests: Vec::new(), left_out: Vec::new(), measured: BTreeMap::new() };
    let mut candidates = Vec::new();
    repository.scan(&mut |test| {
        if test.origin == Origin::Reference {
            return;
        }
        let values: Option<Vec<f64>> = terms.rank.iter().map(|key| value(&judge, &test, key.metric)).collect();
        if let Some(values) = &values {
            let places = terms.rank.iter().zip(values).map(|(key, &value)| key.order.place(value));
            found.measured.insert(test.number, places.collect());
        }
        if !selection.holds(test.number) {
            return;
        }
        match candidate(plan, &judge, terms, confirmed.as_ref(), &test) {
            Ok(candidate) => candidates.push(candidate),
            Err(reason) => found.left_out.push((test.number, reason)),
        }
    })?;
    // Equal tests would be run twice in the lab, to learn what one run more would tell.
    let mut first: BTreeMap<TestKey, u32> = BTreeMap::new();
    for candidate in candidates {
        let key = TestKey::without_seeds(&repository.row(candidate.number)?.test);
        match *first.entry(key).or_insert(candidate.number) {
            of if of == candidate.number => found.tests.push(candidate),
            of => found.left_out.push((candidate.number, LeftOut::Duplicate { of })),
        }
    }
    found.left_out.sort_by_key(|(number, _)| *number);
    Ok(found)
}

/// The tests among these that a lab excludes, each with the reason: the tests that must not be run in it, whatever else
/// speaks for them. One that has no value of a metric by which the lab excludes is among them, since nobody knows.
pub fn excluded(repository: &Repository, lab: &Lab, tests: &[u32]) -> Result<Vec<(u32, LeftOut)>, RecordError> {
    if lab.exclude.is_empty() {
        return Ok(Vec::new());
    }
    let judge = repository.judge()?;
    let mut found = Vec::new();
    repository.scan(&mut |test| {
        if tests.contains(&test.number) {
            found.extend(exclusion(&judge, &lab.exclude, &test).map(|reason| (test.number, reason)));
        }
    })?;
    Ok(found)
}

/// Why these tests are not run in a lab, in words; `None` if it excludes none of them.
pub fn exclusions(repository: &Repository, lab: &Lab, tests: &[u32]) -> Result<Option<String>, RecordError> {
    let metric = |metric| &repository.plan().metric(metric).name;
    let each = excluded(repository, lab, tests)?.into_iter().map(|(number, reason)| match reason {
        LeftOut::Excluded { by, value } => format!("{} (`{}` is {value})", TestNumber(number), metric(by.metric)),
        other => format!("{} ({})", TestNumber(number), other.words(repository.plan())),
    });
    let each = each.collect::<Vec<_>>().join(", ");
    Ok((!each.is_empty()).then(|| format!("lab `{}` excludes {each} as too dangerous", lab.name)))
}

/// Why a test is excluded, if it is.
fn exclusion(judge: &Judge<'_>, exclude: &[LabExclusion], test: &ScannedTest) -> Option<LeftOut> {
    exclude.iter().find_map(|&by| match value(judge, test, by.metric) {
        None => Some(LeftOut::Unmeasured { metric: by.metric }),
        Some(value) => by.bound.holds(value).then_some(LeftOut::Excluded { by, value }),
    })
}

/// How interesting each measured test is, from 0 to 1: its [rank](sesame_select::ranking) among all of them, by the
/// keys of [`Candidates::measured`]. Of none, if tests are ranked by nothing.
pub fn qualities(measured: &BTreeMap<u32, Vec<f64>>, convention: Convention) -> BTreeMap<u32, f64> {
    let count = measured.values().next().map_or(0, Vec::len);
    let columns: Vec<Vec<f64>> = (0..count).map(|key| measured.values().map(|keys| keys[key]).collect()).collect();
    let keys: Vec<Key<'_>> = columns.iter().map(|values| Key { values, better: Better::Lower }).collect();
    // The paper and its platform count positions.
    let scale = if convention == Convention::Ours { Scale::Average } else { Scale::Paper };
    let qualities = ranking::qualities(&keys, scale).unwrap_or_default();
    measured.keys().copied().zip(qualities).collect()
}

/// The tests of which fresh runs have confirmed a finding.
fn confirmed(repository: &Repository, judge: &Judge<'_>) -> Result<BTreeSet<u32>, RecordError> {
    let tests = confirmed_tests(repository.plan(), judge, &repository.tests()?, &[]);
    let confirmed = tests.into_iter().filter(|test| test.standing == Some(Standing::Confirmed));
    Ok(confirmed.map(|test| test.number).collect())
}

/// The value of a metric: the median of fresh runs that have one, else that of the recorded run.
fn value(judge: &Judge<'_>, test: &ScannedTest, metric: MetricId) -> Option<f64> {
    let fresh = judge.runs(test.duplicate_of.unwrap_or(test.number)).iter();
    let fresh = Sample::of(fresh.filter_map(|run| run.value(metric).value));
    fresh.map(|sample| sample.median).or(test.value(metric).value)
}

fn candidate(
    plan: &CampaignPlan,
    judge: &Judge<'_>,
    terms: &Terms,
    confirmed: Option<&BTreeSet<u32>>,
    test: &ScannedTest,
) -> Result<Candidate, LeftOut> {
    let measured = |metric| value(judge, test, metric).ok_or(LeftOut::Unmeasured { metric });
    if let Some(of) = test.duplicate_of {
        return Err(LeftOut::Duplicate { of });
    }
    if test.outcome == Outcome::NoEffect {
        return Err(LeftOut::NoEffect);
    }
    if let Some(reason) = exclusion(judge, &terms.exclude, test) {
        return Err(reason);
    }
    let cost = terms.costs.get(&test.number).copied().unwrap_or_else(|| terms.cost.of(test.operations.len()));
    if cost > terms.budget {
        return Err(LeftOut::TooExpensive { cost });
    }
    if confirmed.is_some_and(|confirmed| !confirmed.contains(&test.number)) {
        return Err(LeftOut::NotConfirmed);
    }
    let point = test.point(plan, terms.convention);
    let coordinate = |&dimension: &Dimension| {
        let coordinate = point.as_ref().and_then(|point| coordinate(plan, terms.convention, point, dimension));
        coordinate.ok_or(LeftOut::NoPlace { dimension })
    };
    Ok(Candidate {
        number: test.number,
        point: terms.over.iter().map(coordinate).collect::<Result<_, _>>()?,
        values: terms.rank.iter().map(|key| measured(key.metric)).collect::<Result<_, _>>()?,
        cost,
    })
}

/// A coordinate of a point. Counts are shares of the most operations of a test, so that they weigh as much as others;
/// those of the paper are whole numbers.
fn coordinate(plan: &CampaignPlan, convention: Convention, point: &Point, dimension: Dimension) -> Option<f64> {
    let coordinate = point.get(dimension)?;
    Some(match dimension {
        Dimension::O0 | Dimension::O1 | Dimension::O2 | Dimension::O3 if convention == Convention::Ours => {
            coordinate / f64::from(plan.campaign.count.max.max(1))
        }
        _ => coordinate,
    })
}

impl LeftOut {
    /// The reason in words, as in `excluded: collisions is 41`.
    pub fn words(self, plan: &CampaignPlan) -> String {
        let name = |metric| &plan.metric(metric).name;
        match self {
            LeftOut::Duplicate { of } => format!("equal to {}", TestNumber(of)),
            LeftOut::NoEffect => "no effect".to_owned(),
            LeftOut::NoPlace { dimension } => format!("has no {}", dimension.name()),
            LeftOut::Unmeasured { metric } => format!("has no value of `{}`", name(metric)),
            LeftOut::Excluded { by, value } => format!("excluded: `{}` is {value}", name(by.metric)),
            LeftOut::TooExpensive { cost } => format!("costs {cost}, more than the budget"),
            LeftOut::NotConfirmed => "no confirmed finding".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use sesame_record::{Recorder, sample};

    use super::*;
    use sesame_plan::{Bound, Test};

    const COLLISIONS: MetricId = MetricId(0);

    fn terms() -> Terms {
        Terms {
            over: vec![Dimension::T1, Dimension::T2, Dimension::O0],
            rank: vec![RankKey { metric: COLLISIONS, order: RankOrder::Descending }],
            cost: LabCost { base: 1.0, per_operation: 0.5 },
            costs: BTreeMap::new(),
            exclude: Vec::new(),
            budget: 100.0,
            confirmed: false,
            convention: Convention::Ours,
        }
    }

    fn repository() -> (tempfile::TempDir, Repository) {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        (folder, repository)
    }

    fn reasons(found: &Candidates) -> Vec<(u32, String)> {
        let plan = sample::plan();
        found.left_out.iter().map(|(number, reason)| (*number, reason.words(&plan))).collect()
    }

    #[test]
    fn every_test_is_a_candidate_or_left_out_for_a_reason_and_nothing_is_both() {
        let (_folder, repository) = repository();
        let found = candidates(&repository, &Selection::default(), &terms()).unwrap();
        let mut numbers: Vec<u32> = found.tests.iter().map(|test| test.number).collect();
        numbers.extend(found.left_out.iter().map(|(number, _)| number));
        numbers.sort_unstable();
        let rows = repository.tests().unwrap();
        let all: Vec<u32> = rows.iter().filter(|row| row.origin != Origin::Reference).map(|row| row.number).collect();
        assert_eq!(numbers, all);
        assert!(found.tests.len() > 30, "{}", found.tests.len());
        for test in &found.tests {
            let row = rows.iter().find(|row| row.number == test.number).unwrap();
            let operations = row.test.operations.len() as f64;
            assert_eq!(test.cost, 1.0 + 0.5 * operations);
            // The sample's campaign allows five operations.
            assert_eq!(test.point[2], operations / 5.0);
            assert_eq!(test.values, [row.value(COLLISIONS).value.unwrap()]);
            assert_eq!(found.measured[&test.number], [-test.values[0]]);
        }
    }

    #[test]
    fn what_is_too_dangerous_or_too_expensive_is_left_out_with_the_figure() {
        let (_folder, repository) = repository();
        let all = candidates(&repository, &Selection::default(), &terms()).unwrap();
        let exclude = vec![LabExclusion { metric: COLLISIONS, bound: Bound::AtLeast { value: 1.0 } }];
        let safe = candidates(&repository, &Selection::default(), &Terms { exclude, ..terms() }).unwrap();
        assert!(safe.tests.iter().all(|test| test.values[0] < 1.0));
        let excluded = reasons(&safe).into_iter().filter(|(_, reason)| reason.starts_with("excluded: `")).count();
        let violating = all.tests.iter().filter(|test| test.values[0] >= 1.0).count();
        assert!(violating > 0 && excluded >= violating, "{excluded} of {violating}");

        let cheap = candidates(&repository, &Selection::default(), &Terms { budget: 2.0, ..terms() }).unwrap();
        assert!(cheap.tests.iter().all(|test| test.cost <= 2.0) && !cheap.tests.is_empty());
        let said = reasons(&cheap).into_iter().find(|(_, reason)| reason.starts_with("costs"));
        assert_eq!(said.unwrap().1, "costs 2.5, more than the budget");
    }

    #[test]
    fn of_equal_tests_the_first_is_a_candidate() {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::plan();
        let test = plan.tests[0].test.clone();
        let mut reseeded: Test = test.clone();
        reseeded.operations[0].operation_seed += 1;
        let records = [test.clone(), reseeded, test].into_iter().zip(1..);
        let records = records.map(|(test, number)| sample::record(&plan, number, Origin::Search, test));
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
        recorder.commit_all(records).unwrap();
        let found = candidates(recorder.repository(), &Selection::default(), &terms()).unwrap();
        assert_eq!(found.tests.iter().map(|test| test.number).collect::<Vec<_>>(), [1]);
        assert_eq!(reasons(&found), [(2, "equal to T1".to_owned()), (3, "equal to T1".to_owned())]);
    }

    #[test]
    fn only_confirmed_findings_are_candidates_where_that_is_asked_for() {
        let (_folder, repository) = repository();
        let found = candidates(&repository, &Selection::default(), &Terms { confirmed: true, ..terms() }).unwrap();
        assert_eq!(found.tests, []);
        assert!(reasons(&found).iter().any(|(_, reason)| reason == "no confirmed finding"));
    }

    #[test]
    fn the_best_test_has_quality_1_and_equal_ones_share_theirs() {
        let measured: BTreeMap<u32, Vec<f64>> = [(1, [-3.0, 1.0]), (2, [0.0, 1.0]), (3, [-3.0, 1.0]), (4, [-3.0, 0.5])]
            .map(|(n, k)| (n, k.to_vec()))
            .into();
        let ours = qualities(&measured, Convention::Ours);
        assert_eq!(ours, BTreeMap::from([(2, 0.0), (1, 0.5), (3, 0.5), (4, 1.0)]));
        let paper = qualities(&measured, Convention::Paper);
        assert_eq!(paper, BTreeMap::from([(2, 0.0), (1, 0.25), (3, 0.5), (4, 0.75)]));
        assert_eq!(qualities(&BTreeMap::from([(9, vec![1.0])]), Convention::Ours), BTreeMap::from([(9, 1.0)]));
    }

    #[test]
    fn a_lab_that_says_nothing_ranks_by_the_objectives() {
        let plan = sample::plan();
        let orders: Vec<_> = Terms::rank_by_objectives(&plan).into_iter().map(|key| (key.metric, key.order)).collect();
        assert_eq!(orders, [(MetricId(1), RankOrder::Ascending), (COLLISIONS, RankOrder::Descending)]);
    }
}
