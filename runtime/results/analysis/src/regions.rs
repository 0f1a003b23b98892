//! Where tests fail: rules over the reduced space and the operations, found by a small decision tree.
//!
//! For each requirement that tests violate (and for crashes and timeouts) a tree of a few questions divides the
//! tests into regions, and says of each how many of its tests fail. The regions of a tree do not overlap, and together
//! they hold every test that is conclusive about the requirement; tests without effect are among them, duplicates and
//! reference runs are not.
//!
//! By cause there is a tree for each [cause](crate::causes), of the tests that hold its operations and no other cause
//! of the requirement. Its questions are about what these operations do, in units: when, for how long, how often and
//! with which values.

mod feature;
mod picture;
#[cfg(test)]
mod tests;
mod tree;

use feature::{Feature, features, features_in_units, numbers};
use tree::{Columns, Growth, Question, TreeNode};

use sesame_plan::{CampaignPlan, RequirementId};
use sesame_record::{Judge, Origin, RecordError, Repository, ScannedTest, Verdict};

use crate::causes::{CauseAlone, causes_alone};
use crate::confirmed::{failed, failed_tally};
use crate::{Datum, Selection, Table};

pub use tree::Tally;

/// How deep a tree is unless something else is asked for.
pub const DEPTH: u32 = 3;

/// The tests of a region at least, and where that is more, the share of all tests.
const LEAST: usize = 5;
const LEAST_SHARE: f64 = 0.01;

/// What a test can fail in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    Requirement(RequirementId),
    Crash,
    Timeout,
}

/// Where tests fail in one respect.
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// The requirement that they violate, or `crash` or `timeout`.
    pub target: String,
    /// The names of the operations of the cause to whose tests this is limited; `None` for all tests.
    pub cause: Option<Vec<String>>,
    /// All tests that say anything about it.
    pub all: Tally,
    /// The regions, those with the largest share of failing tests first.
    pub rules: Vec<Rule>,
    root: TreeNode,
    plan_features: Vec<Feature>,
}

/// One region.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// What holds of its tests, in words; empty where there is but one region.
    pub conditions: Vec<String>,
    /// Its tests.
    pub tally: Tally,
    path: Vec<Step>,
}

/// One question on the way to a region, and its answer.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    question: Question,
    holds: bool,
    /// Whether tests come this way that do not have the number that is asked for.
    missing: bool,
}

/// Why regions cannot be computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RegionsError {
    /// The results cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// There is no such requirement.
    #[error("nothing that tests could fail in is called `{name}`; there are the requirements {}, and `crash` and `timeout`", known.join(", "))]
    NoSuchRequirement {
        /// What was asked for.
        name: String,
        /// The requirements there are.
        known: Vec<String>,
    },
    /// Only requirements have causes.
    #[error("`{name}` has no causes: only requirements have")]
    NoCauses {
        /// What was asked for.
        name: String,
    },
}

/// The numbers of tests, and what they fail in.
struct Gathered {
    /// If all these tests belong to one cause: the names of the operations that it consists of.
    cause: Option<Vec<String>>,
    features: Vec<Feature>,
    /// Per feature the number of each test.
    values: Vec<Vec<f64>>,
    /// Per target whether each test fails; `None` for a test that is inconclusive.
    labels: Vec<(Target, Vec<Option<bool>>)>,
}

/// Where the tests of a selection fail: in this requirement (or `crash`, `timeout`), or in everything in which some of
/// them do.
pub fn regions(
    repository: &Repository,
    selection: &Selection,
    requirement: Option<&str>,
    depth: u32,
) -> Result<Vec<Regions>, RegionsError> {
    let targets = match requirement {
        Some(name) => vec![target(repository.plan(), name)?],
        None => Vec::new(),
    };
    Ok(found(repository, selection, targets, depth)?)
}

/// Where the tests of a selection fail, in everything in which some of them do.
pub fn all_regions(repository: &Repository, selection: &Selection) -> Result<Vec<Regions>, RecordError> {
    found(repository, selection, Vec::new(), DEPTH)
}

/// Where the tests of each cause violate its requirement, of all requirements or of this one, in the order of causes.
pub fn regions_by_cause(
    repository: &Repository,
    selection: &Selection,
    requirement: Option<&str>,
    depth: u32,
) -> Result<Vec<Regions>, RegionsError> {
    let plan = repository.plan();
    let asked = match requirement.map(|name| target(plan, name)).transpose()? {
        None => None,
        Some(Target::Requirement(id)) => Some(id),
        Some(other) => return Err(RegionsError::NoCauses { name: name(plan, other) }),
    };
    Ok(found_by_cause(repository, selection, asked, depth)?)
}

/// Where the tests of each cause violate its requirement, of all requirements, in the order of causes.
pub fn all_regions_by_cause(repository: &Repository, selection: &Selection) -> Result<Vec<Regions>, RecordError> {
    found_by_cause(repository, selection, None, DEPTH)
}

fn found_by_cause(
    repository: &Repository,
    selection: &Selection,
    asked: Option<RequirementId>,
    depth: u32,
) -> Result<Vec<Regions>, RecordError> {
    let plan = repository.plan();
    let mut causes = causes_alone(repository, selection)?;
    causes.retain(|CauseAlone { cause, .. }| asked.is_none_or(|asked| asked == cause.requirement));
    let mut gathered: Vec<Gathered> = causes
        .iter()
        .map(|CauseAlone { cause, .. }| {
            let operations = cause.operations.iter().map(|act| act.operation).collect();
            let features = features_in_units(plan, &operations);
            let names = cause.operations.iter().map(|act| act.name(plan)).collect();
            let targets = [Target::Requirement(cause.requirement)];
            Gathered { cause: Some(names), ..Gathered::empty(features, targets) }
        })
        .collect();
    repository.scan(&mut |test| {
        for (CauseAlone { tests, .. }, gathered) in causes.iter().zip(&mut gathered) {
            if let Some(&violates) = tests.get(&test.number) {
                gathered.push(plan, &test, |_| Some(violates));
            }
        }
    })?;
    Ok(gathered.into_iter().flat_map(|gathered| trees(plan, gathered, depth, |_| true)).collect())
}

/// Where tests fail in these respects; without any, in all in which some do.
fn found(
    repository: &Repository,
    selection: &Selection,
    asked: Vec<Target>,
    depth: u32,
) -> Result<Vec<Regions>, RecordError> {
    let plan = repository.plan();
    let any = asked.is_empty();
    let gathered = gather(repository, selection, if any { targets(plan) } else { asked })?;
    Ok(trees(plan, gathered, depth, |labels| !any || labels.contains(&Some(true))))
}

/// The regions of each target of which the labels are wanted.
fn trees(
    plan: &CampaignPlan,
    Gathered { cause, features, values, labels }: Gathered,
    depth: u32,
    wanted: impl Fn(&[Option<bool>]) -> bool,
) -> Vec<Regions> {
    let columns = Columns::new(values);
    let found = labels.iter().filter(|(_, labels)| wanted(labels));
    let found = found.map(|(target, labels)| {
        let count = labels.iter().flatten().count();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
        let least = LEAST.max((LEAST_SHARE * count as f64) as usize);
        let root = columns.tree(labels, Growth { depth, least });
        let mut rules = Vec::new();
        leaves(&root, &mut Vec::new(), &mut |path, tally| {
            let conditions = simplified(path)
                .iter()
                .map(|step| features[step.question.column].words(plan, step.question, step.holds, step.missing))
                .collect();
            rules.push(Rule { conditions, tally, path: path.to_vec() });
        });
        // Shares as cross products, so that equal ones are equal; the sort keeps the tree's order among them.
        rules.sort_by(|a, b| {
            let share = |of: &Rule, other: &Rule| of.tally.failing as u128 * other.tally.tests as u128;
            share(b, a).cmp(&share(a, b)).then(b.tally.tests.cmp(&a.tally.tests))
        });
        let (target, cause) = (name(plan, *target), cause.clone());
        Regions { target, cause, all: root.tally, rules, root, plan_features: features.clone() }
    });
    found.collect()
}

fn targets(plan: &CampaignPlan) -> Vec<Target> {
    let requirements = (0u32..).map(RequirementId).take(plan.requirements.len()).map(Target::Requirement);
    requirements.chain([Target::Crash, Target::Timeout]).collect()
}

/// The target of this name.
fn target(plan: &CampaignPlan, wanted: &str) -> Result<Target, RegionsError> {
    targets(plan).into_iter().find(|&target| name(plan, target) == wanted).ok_or_else(|| {
        let known = plan.requirements.iter().map(|requirement| requirement.name.clone()).collect();
        RegionsError::NoSuchRequirement { name: wanted.to_owned(), known }
    })
}

fn name(plan: &CampaignPlan, target: Target) -> String {
    match target {
        Target::Requirement(id) => plan.requirement(id).name.clone(),
        Target::Crash => "crash".to_owned(),
        Target::Timeout => "timeout".to_owned(),
    }
}

fn gather(repository: &Repository, selection: &Selection, targets: Vec<Target>) -> Result<Gathered, RecordError> {
    let plan = repository.plan();
    let mut gathered = Gathered::empty(features(plan), targets);
    let judge = repository.judge()?;
    repository.scan(&mut |test| {
        if is_counted(&test, selection) {
            gathered.push(plan, &test, |target| fails(plan, &judge, target, &test));
        }
    })?;
    Ok(gathered)
}

impl Gathered {
    fn empty(features: Vec<Feature>, targets: impl IntoIterator<Item = Target>) -> Gathered {
        let labels = targets.into_iter().map(|target| (target, Vec::new())).collect();
        Gathered { cause: None, values: vec![Vec::new(); features.len()], features, labels }
    }

    fn push(&mut self, plan: &CampaignPlan, test: &ScannedTest, fails: impl Fn(Target) -> Option<bool>) {
        for (column, number) in self.values.iter_mut().zip(numbers(plan, &self.features, test)) {
            column.push(number);
        }
        for (target, labels) in &mut self.labels {
            labels.push(fails(*target));
        }
    }
}

fn is_counted(test: &ScannedTest, selection: &Selection) -> bool {
    test.origin != Origin::Reference && test.duplicate_of.is_none() && selection.holds(test.number)
}

/// Whether a test fails, by its fresh runs where it was run again; `None` if it does not say.
fn fails(plan: &CampaignPlan, judge: &Judge<'_>, target: Target, test: &ScannedTest) -> Option<bool> {
    let broke_off = |word: &str| failed_tally(judge.runs(test.number), word).verdict(failed(&test.outcome, word));
    let said = match target {
        Target::Crash => broke_off("crash"),
        Target::Timeout => broke_off("timeout"),
        Target::Requirement(id) => judge.verdict_of_scanned(test, plan.requirement(id)),
    };
    match said {
        Verdict::Violated => Some(true),
        Verdict::Satisfied => Some(false),
        Verdict::Inconclusive => None,
    }
}

/// Shows every leaf with the questions above it, in the order of the tree.
fn leaves(node: &TreeNode, path: &mut Vec<Step>, each: &mut impl FnMut(&[Step], Tally)) {
    let Some(split) = &node.split else { return each(path, node.tally) };
    for (holds, below) in [(true, &split.holds), (false, &split.fails)] {
        path.push(Step { question: split.question, holds, missing: split.missing });
        leaves(below, path, each);
        path.pop();
    }
}

/// A path without what a later answer says more narrowly: of two answers of one kind on one number the last one. Where
/// every test has the number, "not at most" is "above".
fn simplified(path: &[Step]) -> Vec<Step> {
    let plain = |step: &Step| match step {
        Step { question, holds: false, missing: false } => {
            Step { question: Question { at_most: !question.at_most, ..*question }, holds: true, missing: false }
        }
        _ => *step,
    };
    let path: Vec<Step> = path.iter().map(plain).collect();
    let kind = |step: &Step| (step.question.column, step.question.at_most, step.holds);
    let is_last = |at: usize| path[at + 1..].iter().all(|later| kind(later) != kind(&path[at]));
    (0..path.len()).filter(|&at| is_last(at)).map(|at| path[at]).collect()
}

impl Rule {
    /// What holds of its tests, in a sentence.
    pub fn sentence(&self) -> String {
        if self.conditions.is_empty() { "everywhere".to_owned() } else { self.conditions.join(", ") }
    }
}

impl Regions {
    /// What it is about: the requirement, or `crash` or `timeout`, and the operations of the cause.
    pub fn title(&self) -> String {
        match &self.cause {
            None => self.target.clone(),
            Some(names) => format!("{}, {}", self.target, names.join(" + ")),
        }
    }

    /// What a file of it is called: `R1`, or `R1-lag+loss` for a cause.
    pub fn file_stem(&self) -> String {
        match &self.cause {
            None => self.target.clone(),
            Some(names) => format!("{}-{}", self.target, names.join("+")),
        }
    }

    /// The tree as a picture: a file of its own (SVG).
    pub fn svg(&self, plan: &CampaignPlan) -> String {
        picture::file(self, plan)
    }

    /// The tree as a picture on a page.
    pub fn draw(&self, markup: &mut sesame_present::markup::Markup, plan: &CampaignPlan) {
        picture::draw(self, plan, markup);
    }
}

/// Regions as a table: a row for each.
pub fn table(regions: &[Regions]) -> Table {
    let by_cause = regions.iter().any(|of| of.cause.is_some());
    let columns = ["fails", "operations", "region", "failing", "tests", "share", "share_low", "share_high"];
    let mut dataset =
        Table::new(columns.into_iter().filter(|&name| by_cause || name != "operations").map(str::to_owned));
    for of in regions {
        for rule in &of.rules {
            let share = rule.tally.share();
            let fails = Datum::Text(of.target.clone());
            let operations = of.cause.as_ref().map(|names| Datum::Text(names.join(" + ")));
            let numbers = [
                Datum::Text(rule.sentence()),
                Datum::count(rule.tally.failing),
                Datum::count(rule.tally.tests),
                Datum::real(share.map(|(share, _)| share)),
                Datum::real(share.map(|(_, [low, _])| low)),
                Datum::real(share.map(|(_, [_, high])| high)),
            ];
            dataset.row([fails].into_iter().chain(operations).chain(numbers));
        }
    }
    dataset
}
