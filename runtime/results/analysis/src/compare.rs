//! Comparison of runs: measures with the same meaning in each, and groups of runs by their medians and ranks.

use std::path::PathBuf;

use sesame_base::observation::Outcome;
use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_optimise::igd::IgdPlus;
use sesame_plan::{CampaignPlan, Direction};
use sesame_record::{Origin, RecordError, Repository};
use sesame_search::coverage::{Coverage, Grid, GridError};
use sesame_search::indicators::volume;
use sesame_search::sspr::Convention;

use crate::{Datum, Table, rank_sum};

/// A run to be compared.
#[derive(Debug)]
pub struct Run {
    /// What it belongs to: runs of one group differ in their seeds only.
    pub group: String,
    /// Its results.
    pub repository: Repository,
}

/// Why runs cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Results could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// Their fronts lie in different spaces.
    #[error(
        "runs with different objectives cannot be compared: {} has {}, {} has {}; name runs that optimise the same",
        first.display(), theirs(first_objectives), second.display(), theirs(second_objectives)
    )]
    Objectives {
        /// One run.
        first: PathBuf,
        /// Its objectives.
        first_objectives: Vec<String>,
        /// Another.
        second: PathBuf,
        /// Its objectives.
        second_objectives: Vec<String>,
    },
    /// A reference point of another space.
    #[error("the reference point has {given} values for {needed} objectives; give one for each, in its unit")]
    Reference {
        /// Values given.
        given: usize,
        /// Values needed.
        needed: usize,
    },
    /// The campaign's cells are not a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}

fn theirs(objectives: &[String]) -> String {
    if objectives.is_empty() { "none".to_owned() } else { objectives.join(", ") }
}

/// The measures of a run.
#[derive(Debug, Clone, PartialEq)]
struct Measured {
    group: String,
    path: PathBuf,
    campaign: String,
    seed: u64,
    tests: u32,
    unique: u32,
    no_effect: u32,
    crashes: u32,
    timeouts: u32,
    front: Front,
    /// The worst finite value of each objective.
    worst: Vec<f64>,
    coverage: Option<f64>,
    hypervolume: Option<f64>,
    /// The standard error of an estimated hypervolume.
    standard_error: Option<f64>,
    igd_plus: Option<f64>,
    joint_share: Option<f64>,
}

/// Runs side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    runs: Vec<Measured>,
    /// The point that all hypervolumes are measured from: of each objective its metric's name and the value in its
    /// unit. Empty without objectives.
    pub reference: Vec<(String, f64)>,
    /// Whether coverage is compared: over the grid that was given, or over that of all campaigns, if it is one.
    pub covers: bool,
}

/// Compares runs that have the same objectives.
///
/// All hypervolumes are measured from one point: the one given, a value per objective in its unit, else of each
/// objective the worst finite value in any test of any run. IGD⁺ is the distance to the joint front, the front of all
/// tests of all runs, each objective divided by the range that this front has in it. Coverage is that of the given
/// grid, where one test covers a cell, else of the campaigns' own if all have the same.
pub fn compare(runs: &[Run], reference: Option<&[f64]>, grid: Option<Grid>) -> Result<Comparison, CompareError> {
    let Some(first) = runs.first() else {
        return Ok(Comparison { runs: Vec::new(), reference: Vec::new(), covers: false });
    };
    let plan = first.repository.plan();
    for run in &runs[1..] {
        if objectives(run.repository.plan()) != objectives(plan) {
            return Err(CompareError::Objectives {
                first: first.repository.path().to_owned(),
                first_objectives: objectives(plan),
                second: run.repository.path().to_owned(),
                second_objectives: objectives(run.repository.plan()),
            });
        }
    }
    let needed = plan.campaign.objectives.len();
    if let Some(given) = reference.map(<[f64]>::len).filter(|&given| given != needed) {
        return Err(CompareError::Reference { given, needed });
    }
    let goal = &plan.campaign.coverage;
    let cells = match (grid, goal) {
        (Some(grid), _) => Some((grid, 1)),
        (None, Some(goal)) => {
            let same = |run: &Run| {
                let theirs = run.repository.plan().campaign.coverage.as_ref();
                theirs.is_some_and(|theirs| (&theirs.axes, theirs.hits) == (&goal.axes, goal.hits))
            };
            if runs.iter().all(same) { Some((Grid::new(goal.axes.clone())?, goal.hits)) } else { None }
        }
        (None, None) => None,
    };
    let mut measured =
        runs.iter().map(|run| measure(run, cells.as_ref())).collect::<Result<Vec<Measured>, RecordError>>()?;

    let reference: Vec<f64> = match reference {
        Some(given) => plan.objectives().zip(given).map(|(objective, &x)| objective.oriented(x)).collect(),
        None => (0..needed)
            .map(|at| measured.iter().filter_map(|run| run.worst.get(at).copied()).fold(f64::NEG_INFINITY, f64::max))
            .collect(),
    };
    let finite = reference.iter().all(|place| place.is_finite());
    // Numbers of tests mean nothing across runs: points are identified by their values.
    let fitness: Vec<Fitness> = measured
        .iter()
        .flat_map(|run| run.front.members())
        .map(|member| Fitness::Measured(member.objectives.clone()))
        .collect();
    let joint = Front::from_tests((0..).zip(&fitness));
    let distance = IgdPlus::to(joint.members().iter().map(|member| member.objectives.as_slice()));
    for run in measured.iter_mut().filter(|_| needed > 0) {
        let volume = if finite { volume(&run.front, &reference) } else { None };
        run.hypervolume = volume.map(|volume| volume.value);
        run.standard_error = volume.and_then(|volume| volume.error);
        let mut distance = distance.clone();
        for member in run.front.members() {
            if let Some(distance) = &mut distance {
                distance.add(&member.objectives);
            }
        }
        run.igd_plus = distance.as_ref().and_then(IgdPlus::value);
        let own = |point: &Vec<f64>| run.front.members().iter().any(|member| member.objectives == *point);
        let had = joint.members().iter().filter(|member| own(&member.objectives)).count();
        run.joint_share = (!joint.members().is_empty()).then(|| had as f64 / joint.members().len() as f64);
    }
    let named = plan.objectives().zip(&reference).filter(|_| finite);
    let reference = named
        .map(|(objective, &value)| (plan.metric(objective.metric).name.clone(), objective.in_unit(value)))
        .collect();
    Ok(Comparison { runs: measured, reference, covers: cells.is_some() })
}

/// The objectives in words: what must be equal.
fn objectives(plan: &CampaignPlan) -> Vec<String> {
    let words = plan.objectives().map(|objective| {
        let metric = plan.metric(objective.metric);
        let direction = match objective.direction {
            Direction::Maximise => "maximised",
            Direction::Minimise => "minimised",
        };
        match &metric.unit {
            Some(unit) => format!("{} [{unit}] {direction}", metric.name),
            None => format!("{} {direction}", metric.name),
        }
    });
    words.collect()
}

fn measure(run: &Run, cells: Option<&(Grid, u32)>) -> Result<Measured, RecordError> {
    let plan = run.repository.plan();
    let mut coverage = cells.map(|(grid, hits)| Coverage::new(grid.clone(), *hits));
    let mut judged: Vec<(u32, Fitness)> = Vec::new();
    let mut measured = Measured {
        group: run.group.clone(),
        path: run.repository.path().to_owned(),
        campaign: plan.campaign.name.clone(),
        seed: run.repository.campaign().seed,
        tests: 0,
        unique: 0,
        no_effect: 0,
        crashes: 0,
        timeouts: 0,
        front: Front::default(),
        worst: vec![f64::NEG_INFINITY; plan.campaign.objectives.len()],
        coverage: None,
        hypervolume: None,
        standard_error: None,
        igd_plus: None,
        joint_share: None,
    };
    let judge = run.repository.judge()?;
    run.repository.scan(&mut |test| {
        if test.origin == Origin::Reference {
            return;
        }
        measured.tests += 1;
        measured.unique += u32::from(test.duplicate_of.is_none());
        match test.outcome {
            Outcome::Completed
            | Outcome::Unknown
            | Outcome::LaunchFailed { .. }
            | Outcome::Disconnect { .. }
            | Outcome::WrongClock { .. } => {}
            Outcome::NoEffect => measured.no_effect += 1,
            Outcome::Crash { .. } => measured.crashes += 1,
            Outcome::Timeout { .. } => measured.timeouts += 1,
        }
        if let Some(coverage) = &mut coverage
            && let Some(point) = test.covering_point(plan, Convention::Ours)
        {
            coverage.add(&point);
        }
        let fitness = judge.fitness(&test);
        for (worst, &value) in measured.worst.iter_mut().zip(fitness.objectives().unwrap_or_default()) {
            if value.is_finite() {
                *worst = worst.max(value);
            }
        }
        judged.push((test.number, fitness));
    })?;
    measured.front = Front::from_tests(judged.iter().map(|(number, fitness)| (*number, fitness)));
    measured.coverage = coverage.map(|coverage| coverage.share());
    Ok(measured)
}

/// A measure by which groups of runs are compared: its name, and its value of a run.
type Measure = (&'static str, fn(&Measured) -> Option<f64>);

const MEASURES: [Measure; 9] = [
    ("hypervolume", |run| run.hypervolume),
    ("igd_plus", |run| run.igd_plus),
    ("joint_share", |run| run.joint_share),
    ("coverage", |run| run.coverage),
    ("tests", |run| Some(f64::from(run.tests))),
    ("unique", |run| Some(f64::from(run.unique))),
    ("no_effect", |run| Some(f64::from(run.no_effect))),
    ("crashes", |run| Some(f64::from(run.crashes))),
    ("timeouts", |run| Some(f64::from(run.timeouts))),
];

impl Comparison {
    /// Whether there is a group of several runs.
    pub fn has_groups(&self) -> bool {
        self.groups_of().iter().any(|(_, runs)| runs.len() > 1)
    }

    /// A row for each run.
    pub fn runs(&self) -> Table {
        let columns = [
            "group",
            "campaign",
            "seed",
            "tests",
            "unique",
            "no_effect",
            "crashes",
            "timeouts",
            "front",
            "hypervolume",
            "standard_error",
            "igd_plus",
            "joint_share",
            "coverage",
            "file",
        ];
        let mut dataset = Table::new(columns.map(str::to_owned));
        for run in &self.runs {
            let whole = |count: u32| Datum::Whole(i64::from(count));
            dataset.row([
                Datum::Text(run.group.clone()),
                Datum::Text(run.campaign.clone()),
                Datum::Text(run.seed.to_string()),
                whole(run.tests),
                whole(run.unique),
                whole(run.no_effect),
                whole(run.crashes),
                whole(run.timeouts),
                Datum::count(run.front.members().len()),
                Datum::real(run.hypervolume),
                Datum::real(run.standard_error),
                Datum::real(run.igd_plus),
                Datum::real(run.joint_share),
                Datum::real(run.coverage),
                Datum::Text(run.path.display().to_string()),
            ]);
        }
        dataset
    }

    /// A row for each measure and group: median and quartiles over its runs; and of every group but the first how it
    /// compares with the first, by ranks. The probabilities are each for itself, not corrected for there being several.
    pub fn groups(&self) -> Table {
        let columns = ["measure", "group", "runs", "lower", "median", "upper", "a12", "p", "p_is"];
        let mut dataset = Table::new(columns.map(str::to_owned));
        let groups = self.groups_of();
        for (name, measure) in MEASURES {
            let values = |runs: &[&Measured]| -> Vec<f64> { runs.iter().filter_map(|run| measure(run)).collect() };
            if groups.iter().all(|(_, runs)| values(runs).is_empty()) {
                continue;
            }
            let first = groups.first().map(|(_, runs)| values(runs)).unwrap_or_default();
            for (at, (group, runs)) in groups.iter().enumerate() {
                let values = values(runs);
                let compared = if at == 0 { None } else { rank_sum(&values, &first) };
                let way = compared.map(|comparison| if comparison.exact { "exact" } else { "normal approximation" });
                dataset.row([
                    Datum::Text(name.to_owned()),
                    Datum::Text((*group).to_owned()),
                    Datum::count(values.len()),
                    Datum::lone(quantile(&values, 0.25)),
                    Datum::lone(quantile(&values, 0.5)),
                    Datum::lone(quantile(&values, 0.75)),
                    Datum::real(compared.map(|comparison| comparison.a12)),
                    Datum::lone(compared.map(|comparison| comparison.p)),
                    way.map_or(Datum::Missing, |way| Datum::Text(way.to_owned())),
                ]);
            }
        }
        dataset
    }

    /// A row for each ordered pair of runs: the share of the second one's front that the first one's covers, Zitzler
    /// and Thiele's C: points that are equal to one of the first, or dominated by one.
    pub fn pairs(&self) -> Table {
        let mut dataset = Table::new(["first", "second", "c"].map(str::to_owned));
        for first in &self.runs {
            for second in self.runs.iter().filter(|second| !std::ptr::eq(*second, first)) {
                dataset.row([
                    Datum::Text(first.path.display().to_string()),
                    Datum::Text(second.path.display().to_string()),
                    Datum::real(covered(&first.front, &second.front)),
                ]);
            }
        }
        dataset
    }

    /// The groups in the order of their first runs, each with its runs.
    fn groups_of(&self) -> Vec<(&str, Vec<&Measured>)> {
        let mut groups: Vec<(&str, Vec<&Measured>)> = Vec::new();
        for run in &self.runs {
            match groups.iter_mut().find(|(group, _)| *group == run.group) {
                Some((_, runs)) => runs.push(run),
                None => groups.push((&run.group, vec![run])),
            }
        }
        groups
    }
}

/// The share of a front of which another has a point that is at least as good in every objective.
fn covered(by: &Front, of: &Front) -> Option<f64> {
    let reached = of.members().iter().filter(|point| {
        by.members().iter().any(|other| other.objectives.iter().zip(&point.objectives).all(|(a, b)| a <= b))
    });
    (!of.members().is_empty()).then(|| reached.count() as f64 / of.members().len() as f64)
}

/// A quantile, between the two nearest values in proportion; `None` without values.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let place = share * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (libm::floor(place), libm::ceil(place));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in the list")]
    let (low, high) = (sorted[below as usize], sorted[above as usize]);
    Some(low + (high - low) * (place - below))
}
