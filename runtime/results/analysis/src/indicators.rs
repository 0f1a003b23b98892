//! Indicators of a search, generation by generation.

use sesame_optimise::dominance::Fitness;
use sesame_optimise::front::Front;
use sesame_optimise::hypervolume::Volume;
use sesame_optimise::igd::IgdPlus;
use sesame_plan::CampaignPlan;
use sesame_record::{Origin, RecordError, Repository, ResultSet};
use sesame_search::coverage::{Coverage, Feasible, Grid};
use sesame_search::indicators::{reference_point, volume};
use sesame_search::sspr::Convention;

use crate::{Datum, Table};

/// What a search had come to after a generation, or at a result set of an imported campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Indicator {
    /// The result set, of an imported campaign.
    pub set: Option<String>,
    /// The generation; of an imported campaign the position of the set's number of evaluations among those of all sets.
    pub generation: Option<u32>,
    /// Tests evaluated by then; of an imported campaign as the set's name says.
    pub evaluations: Option<u32>,
    /// How many of these are not exact duplicates. `None`, as the next three, for imported results, in which they were
    /// not counted.
    pub unique: Option<u32>,
    /// How many of these had no effect.
    pub no_effect: Option<u32>,
    /// How many of these crashed.
    pub crashes: Option<u32>,
    /// How many of these timed out.
    pub timeouts: Option<u32>,
    /// Tests on the front.
    pub front: u32,
    /// The hypervolume of the front up to the reference point, in the product of the objectives' units.
    pub hypervolume: Option<f64>,
    /// The standard error of the hypervolume where it is an estimate, as an exact one would have taken too long.
    pub standard_error: Option<f64>,
    /// IGD⁺ to the front of all tests of the file, each objective divided by the range that this front has in it.
    pub igd_plus: Option<f64>,
    /// Cells covered, where the campaign counts them.
    pub covered: Option<usize>,
}

/// The indicators of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct IndicatorAnalysis {
    /// By generation.
    pub generations: Vec<Indicator>,
    /// The point hypervolumes are measured from: of each objective its metric's name and the value in its unit. Empty
    /// where there is none.
    pub reference: Vec<(String, f64)>,
    /// Cells there are, where the campaign counts them.
    pub cells: Option<usize>,
    /// How many of these a test can reach, as far as known.
    pub feasible: Option<usize>,
}

/// A test as far as indicators go.
struct Judged {
    number: u32,
    generation: Option<u32>,
    fitness: Fitness,
    cell: Option<usize>,
}

/// The indicators after each complete generation. For an imported campaign, whose tests are of no generation, there is
/// one for each result set: of the front of its members.
///
/// Hypervolumes are measured from the `reference` given, a value per objective in its unit; else from the one that was
/// fixed while the campaign ran; else, of an imported campaign, from a point found in the same way among all of its
/// tests.
pub fn indicators(repository: &Repository, reference: Option<&[f64]>) -> Result<IndicatorAnalysis, RecordError> {
    let plan = repository.plan();
    let grid = match &plan.campaign.coverage {
        Some(goal) => Some(Grid::new(goal.axes.clone()).map_err(|error| {
            RecordError::damaged(repository.path(), format!("the cells of its coverage are not a grid: {error}"))
        })?),
        None => None,
    };
    let judge = repository.judge()?;
    let mut tests = Vec::new();
    repository.scan(&mut |test| {
        if test.origin != Origin::Reference {
            let point = grid.as_ref().and_then(|_| test.covering_point(plan, Convention::Ours));
            tests.push(Judged {
                number: test.number,
                generation: test.generation,
                fitness: judge.fitness(&test),
                cell: grid.as_ref().zip(point).and_then(|(grid, point)| grid.cell_of(&point)),
            });
        }
    })?;
    let needed = plan.campaign.coverage.as_ref().map_or(1, |goal| goal.hits);
    let coverage = grid.as_ref().map(|grid| Coverage::new(grid.clone(), needed));
    let whole = Front::from_tests(tests.iter().map(|test| (test.number, &test.fitness)));
    let distance = IgdPlus::to(whole.members().iter().map(|member| member.objectives.as_slice()))
        .filter(|_| !plan.campaign.objectives.is_empty());
    let oriented = |point: &[f64]| -> Vec<f64> {
        plan.objectives().zip(point).map(|(objective, &value)| objective.oriented(value)).collect()
    };
    let given = reference.map(oriented);
    let stored = repository.reference_point()?.as_deref().map(oriented);

    let recorded = repository.indicators()?;
    let mut neighbours = recorded.iter().zip(recorded.iter().skip(1));
    if let Some((before, after)) = neighbours.find(|(before, after)| before.evaluations > after.evaluations) {
        let problem = format!(
            "generation {} ends after {} tests, and generation {} after {}",
            before.generation, before.evaluations, after.generation, after.evaluations
        );
        return Err(RecordError::damaged(repository.path(), problem));
    }
    let ran = !recorded.is_empty() || tests.iter().any(|test| test.generation.is_some());
    let (generations, reference) = if ran {
        let mut generations: Vec<Indicator> = recorded
            .iter()
            .map(|generation| Indicator {
                set: None,
                generation: Some(generation.generation),
                evaluations: Some(generation.evaluations),
                unique: Some(generation.unique),
                no_effect: Some(generation.no_effect),
                crashes: Some(generation.crashes),
                timeouts: Some(generation.timeouts),
                front: generation.front,
                hypervolume: if given.is_some() { None } else { generation.hypervolume },
                standard_error: if given.is_some() { None } else { generation.standard_error },
                igd_plus: None,
                covered: None,
            })
            .collect();
        follow(&tests, &mut generations, given.as_deref(), distance, coverage);
        (generations, given.or(stored))
    } else {
        let measured: Vec<&[f64]> = tests.iter().filter_map(|test| test.fitness.objectives()).collect();
        let reference = given.or_else(|| reference_point(&measured)).filter(|point| !point.is_empty());
        (of_sets(repository, &tests, reference.as_deref(), distance.as_ref(), coverage)?, reference)
    };
    Ok(IndicatorAnalysis {
        generations,
        reference: named(plan, reference.as_deref().unwrap_or_default()),
        cells: grid.as_ref().map(Grid::len),
        feasible: grid.as_ref().map(|grid| Feasible::from_plan(plan, grid).count()),
    })
}

fn named(plan: &CampaignPlan, reference: &[f64]) -> Vec<(String, f64)> {
    let objectives = plan.objectives().zip(reference);
    objectives
        .map(|(objective, &value)| (plan.metric(objective.metric).name.clone(), objective.in_unit(value)))
        .collect()
}

/// Fills in what was not recorded while the campaign ran: distances, coverage, and hypervolumes from another point.
///
/// A point that another dominates makes no difference to a distance, so that of the front is that of all tests so far.
fn follow(
    tests: &[Judged],
    generations: &mut [Indicator],
    reference: Option<&[f64]>,
    mut distance: Option<IgdPlus>,
    mut coverage: Option<Coverage>,
) {
    let mut front = Front::default();
    let mut volumes: Option<(Vec<u32>, Option<Volume>)> = None;
    let mut rest = tests.iter();
    let mut done = 0;
    for indicator in generations {
        let upto = indicator.evaluations.unwrap_or(done);
        for test in rest.by_ref().take((upto - done) as usize) {
            if front.add(test.number, &test.fitness)
                && let (Some(distance), Some(point)) = (&mut distance, test.fitness.objectives())
            {
                distance.add(point);
            }
            if let (Some(coverage), Some(cell)) = (&mut coverage, test.cell) {
                coverage.hit(cell);
            }
        }
        done = upto;
        indicator.igd_plus = distance.as_ref().and_then(IgdPlus::value);
        indicator.covered = coverage.as_ref().map(Coverage::covered);
        if let Some(reference) = reference {
            let members = front.numbers();
            // Most generations leave the front as it is.
            let measured = match volumes.take() {
                Some((before, volume)) if before == members => volume,
                _ => volume(&front, reference),
            };
            indicator.hypervolume = measured.map(|volume| volume.value);
            indicator.standard_error = measured.and_then(|volume| volume.error);
            volumes = Some((members, measured));
        }
    }
}

/// An indicator for each result set of an imported campaign.
fn of_sets(
    repository: &Repository,
    tests: &[Judged],
    reference: Option<&[f64]>,
    distance: Option<&IgdPlus>,
    coverage: Option<Coverage>,
) -> Result<Vec<Indicator>, RecordError> {
    let mut covered = Vec::with_capacity(tests.len());
    if let Some(mut coverage) = coverage {
        for test in tests {
            if let Some(cell) = test.cell {
                coverage.hit(cell);
            }
            covered.push(coverage.covered());
        }
    }
    let mut found = Vec::new();
    for (set, _) in repository.result_set_sizes()? {
        let members = repository.members(&set.name)?;
        let member = |number: &u32| tests.binary_search_by_key(number, |test| test.number).ok().map(|at| &tests[at]);
        let front = Front::from_tests(members.iter().filter_map(member).map(|test| (test.number, &test.fitness)));
        let mut distance = distance.cloned();
        for member in front.members() {
            if let Some(distance) = &mut distance {
                distance.add(&member.objectives);
            }
        }
        let evaluations = evaluations_of(&set, tests.len());
        let measured = reference.and_then(|reference| volume(&front, reference));
        found.push(Indicator {
            generation: set.generation,
            evaluations,
            unique: None,
            no_effect: None,
            crashes: None,
            timeouts: None,
            front: u32::try_from(front.members().len()).unwrap_or(u32::MAX),
            hypervolume: measured.map(|volume| volume.value),
            standard_error: measured.and_then(|volume| volume.error),
            igd_plus: distance.as_ref().and_then(IgdPlus::value),
            covered: evaluations.and_then(|n| covered.get((n as usize).checked_sub(1)?).copied()),
            set: Some(set.name),
        });
    }
    Ok(found)
}

/// The original platform ends the names of its sets with the number of tests evaluated by then.
fn evaluations_of(set: &ResultSet, tests: usize) -> Option<u32> {
    let named = set.name.rsplit('-').next()?.parse().ok()?;
    (named as usize <= tests).then_some(named)
}

impl IndicatorAnalysis {
    /// A row for each generation.
    pub fn dataset(&self) -> Table {
        let imported = self.generations.iter().any(|generation| generation.set.is_some());
        let head = if imported { vec!["set"] } else { Vec::new() };
        let counts = ["generation", "evaluations", "unique", "no_effect", "crashes", "timeouts", "front"];
        let measures = ["hypervolume", "standard_error", "igd_plus"];
        let cells: &[&str] = if self.cells.is_some() { &["covered", "cells", "coverage"] } else { &[] };
        let columns = head.into_iter().chain(counts).chain(measures).chain(cells.iter().copied());
        let mut dataset = Table::new(columns.map(str::to_owned));
        let whole = |count: Option<u32>| count.map_or(Datum::Missing, |count| Datum::Whole(i64::from(count)));
        for generation in &self.generations {
            let head = imported.then(|| generation.set.clone().map_or(Datum::Missing, Datum::Text));
            let counts = [
                generation.generation,
                generation.evaluations,
                generation.unique,
                generation.no_effect,
                generation.crashes,
                generation.timeouts,
                Some(generation.front),
            ];
            let cells = self.cells.map(|cells| {
                let share = generation.covered.map(|covered| covered as f64 / cells as f64);
                [generation.covered.map_or(Datum::Missing, Datum::count), Datum::count(cells), Datum::real(share)]
            });
            let row = head
                .into_iter()
                .chain(counts.map(whole))
                .chain([
                    Datum::real(generation.hypervolume),
                    Datum::real(generation.standard_error),
                    Datum::real(generation.igd_plus),
                ])
                .chain(cells.into_iter().flatten());
            dataset.row(row);
        }
        dataset
    }
}
