//! Analyses of a results file: what campaigns, tests, fronts, points and coverage there are in it, as tables.
//!
//! They read any results file, of any campaign, finished or not, and never write one. Each analysis reads the file once
//! from beginning to end, and gives a [`Table`], which prints as a table, as CSV and as JSON. The same results give the
//! same tables on every machine.
//!
//! In addition there is what a lab needs: the [`choice`] of its tests, the reality [`gap`] in metrics and in
//! [`traces`], and what [`compensation`] makes of it.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod candidates;
pub mod causes;
pub mod choice;
mod compare;
pub mod compensation;
pub mod confirmed;
mod distances;
mod extents;
pub mod gap;
mod indicators;
pub mod pairs;
mod rank_sum;
pub mod regions;
#[cfg(any(test, feature = "testing"))]
pub mod sample;
pub mod statistics;
#[cfg(test)]
mod tests;
pub mod traces;
pub mod trigger;

use std::collections::{BTreeMap, BTreeSet};

use sesame_optimise::dominance::lexicographic;
use sesame_optimise::front::{Front, FrontMember};
use sesame_plan::{CampaignPlan, Dimension, GridAxis, MetricId};
use sesame_record::{EnteredRun, NoPoint, Origin, Provenance, RecordError, Repository, ScannedTest, not_imported};
use sesame_search::coverage::{Coverage, CurvePoint, Feasible, Grid, curve};
use sesame_search::sspr::Convention;

use crate::confirmed::confirmed_tests;
use crate::statistics::Sample;

pub use candidates::{Candidate, Candidates, LeftOut, Terms, candidates, excluded, exclusions, qualities};
pub use compare::{CompareError, Comparison, Run, compare};
pub use distances::{FrontDistance, GivenFront, GivenFrontError, distance_table, distances};
pub use extents::extents;
pub use indicators::{Indicator, IndicatorAnalysis, indicators};
pub use rank_sum::{RankSum, rank_sum};
pub use sesame_base::gathered::{first_of, gathered};
pub use sesame_base::test_number::TestNumber;
pub use sesame_optimise::igd::Scaling;
pub use sesame_present::table::{Datum, Table, TextOptions};

/// Which tests are looked at.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    /// Numbers of tests; all for `None`.
    tests: Option<BTreeSet<u32>>,
    /// The last test that counts; all do for `None`.
    until: Option<u32>,
}

impl Selection {
    /// All tests, or those of the result set of this name.
    pub fn of(repository: &Repository, set: Option<&str>) -> Result<Selection, RecordError> {
        let Some(name) = set else { return Ok(Selection::default()) };
        let sets = repository.result_set_sizes()?;
        if sets.iter().any(|(set, _)| set.name == name) {
            let members = repository.members(name)?.into_iter().collect();
            return Ok(Selection { tests: Some(members), until: None });
        }
        Err(RecordError::NoSuchSet {
            name: name.to_owned(),
            known: sets.into_iter().map(|(set, _)| set.name).collect(),
            path: repository.path().to_owned(),
        })
    }

    /// Of these tests the ones up to a number: what was known once so many tests had run.
    #[must_use]
    pub fn until(self, last: Option<u32>) -> Selection {
        Selection { until: last, ..self }
    }

    fn holds(&self, number: u32) -> bool {
        self.until.is_none_or(|last| number <= last) && self.tests.as_ref().is_none_or(|tests| tests.contains(&number))
    }
}

/// Who reads a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Readers {
    /// People, on lines that are not too long.
    People,
    /// Programs, who are given everything.
    Programs,
}

/// What each file holds, one row per file, in their order.
///
/// If there are more than three result sets, a table for people has only the first, the last and their number.
pub fn campaigns(repositories: &[Repository], readers: Readers) -> Result<Table, RecordError> {
    let columns = ["file", "space", "campaign", "search", "seed", "tests", "front", "objectives", "sets", "ended"];
    let mut dataset = Table::new(columns.map(str::to_owned));
    for repository in repositories {
        let facts = repository.campaign();
        let plan = &facts.plan;
        let sets = repository.result_set_sizes()?;
        let objectives: Vec<&str> = plan.campaign.objectives.iter().map(|&id| plan.metric(id).name.as_str()).collect();
        let names: Vec<&str> = sets.iter().map(|(set, _)| set.name.as_str()).collect();
        dataset.row([
            Datum::Text(repository.path().display().to_string()),
            Datum::Text(plan.space.clone()),
            Datum::Text(plan.campaign.name.clone()),
            Datum::Text(facts.task.keyword(plan).to_owned()),
            Datum::Text(facts.seed.to_string()),
            Datum::count(repository.evaluated()?),
            sets.last().map_or(Datum::Missing, |(_, size)| Datum::count(*size)),
            Datum::Text(objectives.join(" ")),
            Datum::Text(match (&names[..], readers) {
                ([first, _, .., last], Readers::People) if names.len() > 3 => {
                    format!("{first} … {last} ({})", names.len())
                }
                _ => names.join(" "),
            }),
            facts.stop.clone().map_or(Datum::Missing, Datum::Text),
        ]);
    }
    Ok(dataset)
}

/// All tests but the reference runs: where each comes from, how it ended, and the value of each metric; of imported
/// ones also what they were called, and of runs in a lab the test of the campaign (`run_of`). Of runs that were entered
/// by hand there is also which run of that test it is, and who made it, with what and when, if anybody said so.
pub fn tests(repository: &Repository, selection: &Selection) -> Result<Table, RecordError> {
    let plan = repository.plan();
    let originals = repository.original_names()?;
    let original = (!originals.is_empty()).then(|| "original_name".to_owned());
    let run_of = runs_in_a_lab(repository)?;
    let lab = (!run_of.is_empty()).then(|| "run_of".to_owned());
    let entered: BTreeMap<u32, EnteredRun> =
        repository.entered_runs()?.into_iter().map(|entered| (entered.test, entered)).collect();
    let run = (!entered.is_empty()).then(|| "run".to_owned());
    let said: Vec<usize> = (0..Provenance::NAMES.len())
        .filter(|&at| entered.values().any(|run| run.provenance.texts()[at].is_some()))
        .collect();
    let columns = ["origin", "generation", "outcome", "duplicate_of", "operations"].map(str::to_owned);
    let metrics = plan.metrics.iter().map(|metric| metric.name.clone());
    let provenance = said.iter().map(|&at| Provenance::NAMES[at].to_owned());
    let head = std::iter::once("test".to_owned()).chain(original.clone()).chain(lab.clone()).chain(run.clone());
    let mut dataset = Table::new(head.chain(columns).chain(metrics).chain(provenance));
    repository.scan(&mut |test| {
        if test.origin == Origin::Reference || !selection.holds(test.number) {
            return;
        }
        let called =
            original.is_some().then(|| originals.get(&test.number).cloned().map_or(Datum::Missing, Datum::Text));
        let of = lab.is_some().then(|| run_of.get(&test.number).copied().map_or(Datum::Missing, Datum::test));
        let entered = entered.get(&test.number);
        let of_run =
            run.is_some().then(|| entered.map_or(Datum::Missing, |entered| Datum::Whole(i64::from(entered.run))));
        let head = [
            Datum::Text(test.origin.word().to_owned()),
            test.generation.map_or(Datum::Missing, |generation| Datum::Whole(i64::from(generation))),
            Datum::Text(test.outcome.word().to_owned()),
            test.duplicate_of.map_or(Datum::Missing, Datum::test),
            Datum::Text(operations(plan, &test)),
        ];
        let values = (0u32..).map(MetricId).take(plan.metrics.len()).map(|id| Datum::real(test.value(id).value));
        let said = said.iter().map(|&at| {
            let text = entered.and_then(|entered| entered.provenance.texts()[at]);
            text.map_or(Datum::Missing, Datum::text)
        });
        let first = std::iter::once(Datum::test(test.number)).chain(called).chain(of).chain(of_run);
        dataset.row(first.chain(head).chain(values).chain(said));
    })?;
    Ok(dataset)
}

/// For the results of a lab: the test of the campaign that each test is a run of, by number. Other results have none.
fn runs_in_a_lab(repository: &Repository) -> Result<BTreeMap<u32, u32>, RecordError> {
    let Some(task) = repository.task().of_lab() else { return Ok(BTreeMap::new()) };
    let rows = repository.tests()?;
    Ok(rows.iter().filter_map(|row| Some((row.number, task.of(&row.test)?))).collect())
}

/// The values of each metric over the tests of a selection: how many have one, their mean, standard deviation (of a
/// sample, with `n − 1`), range and median. Tests that stand for an equal one are left out, as reference runs are.
pub fn statistics(repository: &Repository, selection: &Selection) -> Result<Table, RecordError> {
    let plan = repository.plan();
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); plan.metrics.len()];
    repository.scan(&mut |test| {
        if test.origin == Origin::Reference || test.duplicate_of.is_some() || !selection.holds(test.number) {
            return;
        }
        for (id, of_metric) in (0u32..).map(MetricId).zip(&mut values) {
            of_metric.extend(test.value(id).value);
        }
    })?;
    let columns = ["metric", "unit", "tests", "mean", "deviation", "least", "median", "most"];
    let mut table = Table::new(columns.map(str::to_owned));
    for (metric, values) in plan.metrics.iter().zip(values) {
        let sample = Sample::of(values);
        let real = |of: fn(&Sample) -> Option<f64>| Datum::real(sample.as_ref().and_then(of));
        table.row([
            Datum::text(&metric.name),
            metric.unit.clone().map_or(Datum::Missing, Datum::Text),
            Datum::count(sample.as_ref().map_or(0, |sample| sample.count)),
            real(|sample| Some(sample.mean)),
            real(|sample| sample.deviation),
            real(|sample| Some(sample.min)),
            real(|sample| Some(sample.median)),
            real(|sample| Some(sample.max)),
        ]);
    }
    Ok(table)
}

/// A test's operations in its order, apart by spaces; behind them how many could not be imported.
fn operations(plan: &CampaignPlan, test: &ScannedTest) -> String {
    let names = test.operations.iter().map(|operation| plan.operation(operation.operation).name.clone());
    names.chain(not_imported(test.left_out).map(|left_out| format!("({left_out})"))).collect::<Vec<_>>().join(" ")
}

/// The tests of a selection that no other of it dominates, by their recorded values, or those of their repetitions
/// where the campaign confirmed them. Equal tests are all there; `same_as` names the one that stands for them in the
/// campaign's own fronts. Without a selection these are the tests of the whole file.
///
/// Where tests were run again, `finding` is what fresh runs show most often (a requirement, `crash` or `timeout`),
/// `confirmed` is in how many of the `conclusive` runs, of all `repetitions`. From `confirmed_low` to
/// `confirmed_high` is the 95 % Wilson interval, and `standing` is `confirmed`, `flaky` or `not confirmed`.
pub fn front(repository: &Repository, selection: &Selection) -> Result<Table, RecordError> {
    let plan = repository.plan();
    let objectives = &plan.campaign.objectives;
    let judge = repository.judge()?;
    let mut judged = Vec::new();
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference && selection.holds(test.number) {
            judged.push((test.number, judge.fitness(&test)));
        }
    })?;
    let names = objectives.iter().map(|&id| plan.metric(id).name.clone());
    let confirmed = if judge.repetitions().is_empty() {
        Vec::new()
    } else {
        confirmed_tests(plan, &judge, &repository.tests()?, &[])
    };
    let again: &[&str] = match confirmed.len() {
        0 => &[],
        _ => &["finding", "confirmed", "conclusive", "repetitions", "confirmed_low", "confirmed_high", "standing"],
    };
    let again_columns = again.iter().map(|&column| column.to_owned());
    let mut dataset =
        Table::new(["test".to_owned()].into_iter().chain(names).chain(["same_as".to_owned()]).chain(again_columns));
    if objectives.is_empty() {
        return Ok(dataset);
    }
    let front = Front::from_tests(judged.iter().map(|(number, fitness)| (*number, fitness)));
    let mut members: Vec<&FrontMember> = front.members().iter().collect();
    members.sort_by(|a, b| lexicographic(&a.objectives, &b.objectives));
    for (number, fitness) in &judged {
        let Some(oriented) = fitness.objectives() else { continue };
        let Ok(at) = members.binary_search_by(|member| lexicographic(&member.objectives, oriented)) else { continue };
        let values =
            plan.objectives().zip(oriented).map(|(objective, &value)| Datum::real(Some(objective.in_unit(value))));
        let same = if members[at].number == *number { Datum::Missing } else { Datum::test(members[at].number) };
        let of = confirmed.iter().find(|test| test.number == *number);
        let surest = of.and_then(|test| test.surest());
        let ends = surest.and_then(|finding| finding.interval);
        let came_again = [
            surest.map_or(Datum::Missing, |finding| Datum::Text(finding.finding.clone())),
            surest.map_or(Datum::Missing, |finding| Datum::count(finding.again)),
            surest.map_or(Datum::Missing, |finding| Datum::count(finding.conclusive)),
            of.map_or(Datum::Missing, |test| Datum::count(test.repetitions)),
            Datum::real(ends.map(|[low, _]| low)),
            Datum::real(ends.map(|[_, high]| high)),
            surest
                .and_then(|finding| finding.standing)
                .map_or(Datum::Missing, |standing| Datum::Text(standing.words().to_owned())),
        ];
        let came_again = came_again.into_iter().take(again.len());
        dataset.row([Datum::test(*number)].into_iter().chain(values).chain([same]).chain(came_again));
    }
    Ok(dataset)
}

/// The point of each test in the reduced parameter space, from what was observed. Tests in which no operation was
/// active are left out, and so are those that [`without_point`] names.
pub fn sspr(
    repository: &Repository,
    selection: &Selection,
    dimensions: &[Dimension],
    convention: Convention,
) -> Result<Table, RecordError> {
    let plan = repository.plan();
    let names = dimensions.iter().map(|dimension| dimension.name().to_owned());
    let mut dataset = Table::new(["test".to_owned()].into_iter().chain(names));
    repository.scan(&mut |test| {
        if test.origin == Origin::Reference || !selection.holds(test.number) {
            return;
        }
        if let Some(point) = test.point(plan, convention) {
            let coordinates = dimensions.iter().map(|&dimension| Datum::real(point.get(dimension)));
            dataset.row([Datum::test(test.number)].into_iter().chain(coordinates));
        }
    })?;
    Ok(dataset)
}

/// Sentences about the tests of a selection that were imported, disturbed something, and have no point: one for each
/// reason.
pub fn without_point(
    repository: &Repository,
    selection: &Selection,
    convention: Convention,
) -> Result<Vec<String>, RecordError> {
    let plan = repository.plan();
    let mut found: BTreeMap<NoPoint, Vec<TestNumber>> = BTreeMap::new();
    repository.scan(&mut |test| {
        let counts = test.origin != Origin::Reference && selection.holds(test.number);
        if let Some(why) = counts.then(|| test.placed(plan, convention).err()).flatten() {
            found.entry(why).or_default().push(TestNumber(test.number));
        }
    })?;
    let sentences = found.into_iter().filter_map(|(why, tests)| {
        let since = match why {
            NoPoint::Inactive => return None,
            NoPoint::LeftOut => "since operations were not imported",
            NoPoint::Outside => "since operations acted or chose values beyond what the file permits them",
        };
        let mut named: Vec<String> = tests.iter().take(NAMED).map(ToString::to_string).collect();
        if tests.len() > NAMED {
            named.push(format!("and {} more", tests.len() - NAMED));
        }
        let have = if tests.len() == 1 { "1 test has".to_owned() } else { format!("{} tests have", tests.len()) };
        Some(format!("{have} no point, {since}: {}", named.join(", ")))
    });
    Ok(sentences.collect())
}

/// Tests that a sentence names at most.
const NAMED: usize = 5;

/// How much of a grid the tests of a selection cover.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverageAnalysis {
    coverage: Coverage,
    feasible: Feasible,
    curve: Vec<CurvePoint>,
}

/// Counts the cells of a grid that the tests of a selection hit, in the order of their numbers; tests
/// without effect and duplicates cover nothing.
pub fn coverage(
    repository: &Repository,
    selection: &Selection,
    grid: Grid,
    hits: u32,
    convention: Convention,
) -> Result<CoverageAnalysis, RecordError> {
    let plan = repository.plan();
    let feasible = Feasible::from_plan(plan, &grid);
    let mut coverage = Coverage::new(grid, hits);
    let mut points = Vec::new();
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference && selection.holds(test.number) {
            points.push(test.covering_point(plan, convention));
        }
    })?;
    let curve = curve(&mut coverage, points);
    Ok(CoverageAnalysis { coverage, feasible, curve })
}

impl CoverageAnalysis {
    /// Coverage over evaluations: a row for each test that covered a cell, and for the last one.
    pub fn curve(&self) -> Table {
        let columns = ["evaluations", "covered", "cells", "coverage", "feasible", "feasible_coverage"];
        let mut dataset = Table::new(columns.map(str::to_owned));
        let (cells, feasible) = (self.coverage.grid().len(), self.coverage.feasible(&self.feasible));
        for point in &self.curve {
            dataset.row([
                Datum::Whole(i64::from(point.evaluations)),
                Datum::count(point.covered),
                Datum::count(cells),
                Datum::Real(point.coverage),
                Datum::count(feasible),
                Datum::real((feasible > 0).then(|| point.covered as f64 / feasible as f64)),
            ]);
        }
        dataset
    }

    /// Each cell: where it lies on each axis, how often it was hit, and whether a test can reach it.
    pub fn cells(&self) -> Table {
        let grid = self.coverage.grid();
        let ends = |axis: &GridAxis| ["low", "high"].map(|end| format!("{}_{end}", axis.dimension.name()));
        let columns = grid.axes().iter().flat_map(ends);
        let more = ["hits", "covered", "feasible"].map(str::to_owned);
        let mut dataset = Table::new(columns.chain(more));
        for (cell, &hits) in self.coverage.hits().iter().enumerate() {
            let place = grid.place(cell);
            let edges = grid
                .axes()
                .iter()
                .zip(place)
                .flat_map(|(axis, at)| [at, at + 1].map(|at| Datum::Real(sesame_search::coverage::edge(axis, at))));
            let counted = [
                Datum::Whole(i64::from(hits)),
                Datum::Truth(self.coverage.is_covered(cell)),
                Datum::Truth(self.feasible.reaches(cell)),
            ];
            dataset.row(edges.chain(counted));
        }
        dataset
    }

    /// Whether the feasible cells are exactly these; otherwise some of them perhaps cannot be reached.
    pub fn feasible_is_exact(&self) -> bool {
        self.feasible.is_exact()
    }
}
