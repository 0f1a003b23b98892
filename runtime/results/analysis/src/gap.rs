//! The reality gap: the results of a lab compared with those of the campaign that its tests come from, per test, metric
//! and requirement, and over the space of tests.
//!
//! Both sides are independent samples of a test's two distributions; the tests are the pairs. In the simulation, fresh
//! runs are the sample, where there are any: the run for which a test was chosen shows more than a test usually does.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use sesame_base::test_number::TestNumber;
use sesame_gap::bootstrap::{Resampling, intervals};
use sesame_gap::equivalence::{self, Equivalence, Reason, Verdict as Equal, lab_runs_needed};
use sesame_gap::holm::adjusted;
use sesame_gap::localise::{self, Extent, Words, localise};
use sesame_gap::next::{Next, Tried, Why, next};
use sesame_gap::pooled::Pooled;
use sesame_gap::samples::{Samples, Side, Undefined, Welch, hedges_g, moments};
use sesame_gap::split::{Located, Range, Split};
use sesame_gap::violations::{Confusion, Frequencies, Occurrence, Occurrences, frequencies};
use sesame_plan::{CampaignPlan, Dimension, Lab, LabTask, MetricId, Requirement, Task};
use sesame_present::number::{fixed, plural, quantity};
use sesame_present::table::Table;
use sesame_record::{Origin, RecordError, Repetition, Repository, TestRow, Verdict};
use sesame_search::sspr::Convention;
use sesame_search::variation;

use crate::Datum;

/// The probability of an error that verdicts allow.
pub const ALPHA: f64 = 0.05;

/// Permutations that decide whether a gap is in a range of a dimension.
const PERMUTATIONS: u32 = 999;

/// The dimensions in which a gap is looked for, where a lab says nothing else.
const DIMENSIONS: [Dimension; 3] = [Dimension::T1, Dimension::T2, Dimension::P1];

/// A run in a lab: the test of the campaign that it was a run of, and what it showed.
#[derive(Debug, Clone, PartialEq)]
pub struct LabRun {
    /// The number of the test in the results of the campaign.
    pub of: u32,
    /// The run.
    pub row: TestRow,
}

/// Why results cannot be compared as those of a campaign and of its lab.
#[derive(Debug, thiserror::Error)]
pub enum GapError {
    /// They cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// They are not results of a lab.
    #[error("{} has no results of a lab: `physical` runs tests in one, and `lab add` records those that people ran", path.display())]
    NotOfALab {
        /// The file.
        path: PathBuf,
    },
    /// They are not results of tests that were simulated again for a lab.
    #[error("{} has no results of `compensate`, which simulates the tests of a lab again", path.display())]
    NotCompensated {
        /// The file.
        path: PathBuf,
    },
    /// The lab ran tests of another run.
    #[error(
        "{} has results of other tests: its {test} is not that of {}; give the run whose tests were taken to the lab",
        lab.display(), campaign.display()
    )]
    OtherTests {
        /// The lab's file.
        lab: PathBuf,
        /// The campaign's file.
        campaign: PathBuf,
        /// The test.
        test: TestNumber,
    },
    /// What was measured or disturbed there is something else.
    #[error("{} was recorded with another model ({difference}), so its values cannot be compared", lab.display())]
    OtherModel {
        /// The lab's file.
        lab: PathBuf,
        /// How they differ.
        difference: String,
    },
}

/// The runs in the results of a lab, without its runs without disturbance. They must be of tests of these results of a
/// campaign.
pub fn lab_runs(campaign: &Repository, lab: &Repository) -> Result<Vec<LabRun>, GapError> {
    let Some(task) = lab.task().in_lab() else { return Err(GapError::NotOfALab { path: lab.path().to_owned() }) };
    runs_of(campaign, lab, task)
}

/// The runs in results of `compensate`: the tests that a lab ran, simulated once more. They must be of tests of these
/// results of a campaign.
pub fn compensated_runs(campaign: &Repository, again: &Repository) -> Result<Vec<LabRun>, GapError> {
    match again.task().compensated() {
        Some(task) => runs_of(campaign, again, task),
        None => Err(GapError::NotCompensated { path: again.path().to_owned() }),
    }
}

/// The runs of a task, without those without disturbance.
fn runs_of(campaign: &Repository, lab: &Repository, task: &LabTask) -> Result<Vec<LabRun>, GapError> {
    let paths = || (lab.path().to_owned(), campaign.path().to_owned());
    // Only the robots may be others.
    let simulator = campaign.plan().simulator.clone();
    let reached = CampaignPlan { simulator, ..lab.plan().clone() };
    if let Some(difference) = campaign.plan().model_difference(&reached) {
        return Err(GapError::OtherModel { lab: paths().0, difference });
    }
    let known: BTreeSet<u32> = campaign.numbers()?.into_iter().collect();
    for selected in &task.tests {
        if !known.contains(&selected.number) || campaign.row(selected.number)?.test != selected.test {
            let (lab, campaign) = paths();
            return Err(GapError::OtherTests { lab, campaign, test: TestNumber(selected.number) });
        }
    }
    let rows = lab.tests()?.into_iter().filter(|row| row.origin != Origin::Reference);
    Ok(rows.filter_map(|row| Some(LabRun { of: task.of(&row.test)?, row })).collect())
}

/// How a simulation and a lab differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap {
    /// The tests that were run in the lab, by number.
    pub tests: Vec<u32>,
    /// The objectives, the metrics of requirements and those with a tolerance, in the plan's order, if they have a
    /// value on both sides in some test; without interlocked ones.
    pub metrics: Vec<MetricGap>,
    /// Every requirement, and every interlocked metric.
    pub events: Vec<EventGap>,
    /// The names of dimensions in which gaps were looked for.
    pub dimensions: Vec<Dimension>,
    /// The coordinates of the tests in these dimensions, by number.
    pub points: BTreeMap<u32, Vec<Option<f64>>>,
}

/// How one metric differs.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricGap {
    /// The metric.
    pub metric: MetricId,
    /// A difference that does not matter, in its unit.
    pub tolerance: f64,
    /// The tests with a value on both sides, by number.
    pub tests: Vec<Compared>,
    /// Where the gap is. Its positions are those of the located tests.
    pub extent: Extent,
    /// The numbers of the tests whose difference has a standard error.
    pub located: Vec<u32>,
}

/// One metric of one test on both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// The number of the test.
    pub test: u32,
    /// Whether the sample of the simulation is the run that selected the test, because it was never run again.
    pub selected: bool,
    /// Values of the simulation; at least one.
    pub simulation: Vec<f64>,
    /// Values of the lab; at least one.
    pub lab: Vec<f64>,
    /// The difference, with the verdict of all comparisons together (Holm).
    pub equivalence: Equivalence,
    /// The p value that the means are equal, adjusted for all comparisons (Holm).
    pub p_different: Option<f64>,
    /// The p value of equivalence, adjusted likewise.
    pub p_equivalent: Option<f64>,
    /// Hedges' g with the 95 % interval by bootstrap (bias-corrected and accelerated).
    pub effect: Option<(f64, Option<[f64; 2]>)>,
    /// How many runs in the lab would show equivalence with a power of 0.8, if there is none.
    pub runs_needed: Option<usize>,
}

/// How often an event occurs on both sides: the violation of a requirement, or what ends a test in the lab.
#[derive(Debug, Clone, PartialEq)]
pub struct EventGap {
    /// The name of the requirement or interlocked metric.
    pub name: String,
    /// Tests by what the two sides say.
    pub confusion: Confusion,
    /// Each test, by number.
    pub tests: Vec<(u32, Frequencies)>,
}

/// Compares the runs of a lab with the results of the campaign that its tests come from.
pub fn gap(campaign: &Repository, runs: &[LabRun], lab: Option<&Lab>) -> Result<Gap, RecordError> {
    compare(campaign, None, runs, lab)
}

/// Compares the runs of a lab with those in which its tests were simulated again ([`compensated_runs`]). Tests that
/// were not are left out.
pub fn gap_after(
    campaign: &Repository,
    again: &[LabRun],
    runs: &[LabRun],
    lab: Option<&Lab>,
) -> Result<Gap, RecordError> {
    compare(campaign, Some(again), runs, lab)
}

fn compare(
    campaign: &Repository,
    again: Option<&[LabRun]>,
    runs: &[LabRun],
    lab: Option<&Lab>,
) -> Result<Gap, RecordError> {
    let plan = campaign.plan();
    let mut by_test: BTreeMap<u32, Vec<&TestRow>> = BTreeMap::new();
    for run in runs {
        by_test.entry(run.of).or_default().push(&run.row);
    }
    let variations = match campaign.task() {
        Task::Variations(variations) => Some(variations.dimension),
        _ => None,
    };
    // Variations differ in one dimension only.
    let dimensions = variations.map_or_else(|| dimensions(lab), |dimension| vec![dimension]);
    let judge = campaign.judge()?;
    let points = points(campaign, &by_test.keys().copied().collect(), &dimensions)?;
    let mut reference = None;
    campaign.scan(&mut |test| {
        if test.origin == Origin::Reference && reference.is_none() {
            reference = Some(test.values);
        }
    })?;
    let mut sides = Vec::with_capacity(by_test.len());
    for (&test, lab_runs) in &by_test {
        let row = campaign.row(test)?;
        let simulated = match again {
            Some(again) => Simulated::Again(again.iter().filter(|run| run.of == test).map(|run| &run.row).collect()),
            None => match judge.runs(row.duplicate_of.unwrap_or(test)) {
                [] => Simulated::Selected(Box::new(row)),
                fresh => Simulated::Fresh(fresh),
            },
        };
        if !matches!(&simulated, Simulated::Again(runs) if runs.is_empty()) {
            sides.push(Sides { test, simulated, lab_runs });
        }
    }

    let interlocked = lab.map_or(&[][..], |lab| &lab.interlock);
    let ids = (0u32..).map(MetricId).take(plan.metrics.len());
    let mut metrics = Vec::new();
    let tolerances = lab.map_or(&[][..], |lab| &lab.tolerances);
    let matters = |metric: &MetricId| {
        plan.campaign.objectives.contains(metric)
            || plan.requirements.iter().any(|requirement| requirement.metric == *metric)
            || tolerances.iter().any(|tolerance| tolerance.metric == *metric)
    };
    for metric in ids.filter(|metric| matters(metric) && !interlocked.contains(metric)) {
        let tolerance =
            tolerances.iter().find(|tolerance| tolerance.metric == metric).map_or(0.0, |tolerance| tolerance.value);
        let tests: Vec<Compared> = sides.iter().filter_map(|sides| sides.compared(metric, tolerance)).collect();
        if !tests.is_empty() {
            metrics.push(MetricGap { metric, tolerance, tests, extent: Extent::None, located: Vec::new() });
        }
    }
    adjust(&mut metrics);
    for gap in &mut metrics {
        locate(gap, &points);
        if variations.is_some()
            && let Some(extent) = separated(gap, &points)
        {
            gap.extent = extent;
        }
    }
    let requirements = plan.requirements.iter().map(|requirement| {
        let occurrence = |said: Verdict| match said {
            Verdict::Violated => Occurrence::Seen,
            Verdict::Satisfied => Occurrence::Absent,
            Verdict::Inconclusive => Occurrence::Inconclusive,
        };
        event(&requirement.name, &sides, |sides| {
            let simulation = Occurrences::of(sides.simulated.verdicts(requirement).into_iter().map(occurrence));
            let lab = Occurrences::of(sides.lab_runs.iter().map(|row| occurrence(row.verdict(requirement))));
            (simulation, lab)
        })
    });
    let is_bounded =
        |metric: MetricId| plan.requirements.iter().any(|requirement: &Requirement| requirement.metric == metric);
    let interlocks = interlocked.iter().filter(|&&metric| !is_bounded(metric)).map(|&metric| {
        let usual = reference.as_ref().and_then(|values| values.get(metric.index())).and_then(|value| value.value);
        // Without a requirement, an interlock has acted where the metric is not as it is without disturbance.
        let occurrence = |value: Option<f64>| match value {
            None => Occurrence::Inconclusive,
            Some(_) if value == usual => Occurrence::Absent,
            Some(_) => Occurrence::Seen,
        };
        event(&plan.metric(metric).name, &sides, |sides| {
            let simulation = Occurrences::of(sides.simulated.values(metric).into_iter().map(occurrence));
            let lab = Occurrences::of(sides.lab_runs.iter().map(|row| occurrence(row.value(metric).value)));
            (simulation, lab)
        })
    });
    let events = requirements.chain(interlocks).collect();
    Ok(Gap { tests: sides.iter().map(|sides| sides.test).collect(), metrics, events, dimensions, points })
}

/// The dimensions in which a gap is looked for: those of the lab's budget, otherwise T1, T2 and P1.
pub fn dimensions(lab: Option<&Lab>) -> Vec<Dimension> {
    lab.and_then(|lab| lab.budget.as_ref()).map_or_else(|| DIMENSIONS.to_vec(), |budget| budget.over.clone())
}

/// The coordinates of these tests in these dimensions, by number.
///
/// The points of variations are as planned: they rise from one to the next, also where operations of some had no
/// effect.
pub fn points(
    campaign: &Repository,
    tests: &BTreeSet<u32>,
    dimensions: &[Dimension],
) -> Result<BTreeMap<u32, Vec<Option<f64>>>, RecordError> {
    let mut points = BTreeMap::new();
    if matches!(campaign.task(), Task::Variations(_)) {
        for &number in tests {
            let test = campaign.row(number)?.test;
            let at = dimensions.iter().map(|&dimension| variation::coordinate(campaign.plan(), &test, dimension));
            points.insert(number, at.collect());
        }
        return Ok(points);
    }
    campaign.scan(&mut |test| {
        if tests.contains(&test.number) {
            let point = test.point(campaign.plan(), Convention::Ours);
            let at = dimensions.iter().map(|&dimension| point.as_ref().and_then(|point| point.get(dimension)));
            points.insert(test.number, at.collect());
        }
    })?;
    Ok(points)
}

/// A test on both sides.
struct Sides<'a> {
    test: u32,
    simulated: Simulated<'a>,
    lab_runs: &'a [&'a TestRow],
}

/// The runs of a test in simulation.
enum Simulated<'a> {
    /// The run for which the test was chosen, because there is no other.
    Selected(Box<TestRow>),
    /// Fresh runs of a confirmation; at least one.
    Fresh(&'a [Repetition]),
    /// Runs after a compensation; at least one.
    Again(Vec<&'a TestRow>),
}

impl Simulated<'_> {
    /// The value of a metric in each run.
    fn values(&self, metric: MetricId) -> Vec<Option<f64>> {
        match self {
            Simulated::Selected(row) => vec![row.value(metric).value],
            Simulated::Fresh(runs) => runs.iter().map(|run| run.value(metric).value).collect(),
            Simulated::Again(rows) => rows.iter().map(|row| row.value(metric).value).collect(),
        }
    }

    /// What each run says of a requirement.
    fn verdicts(&self, requirement: &Requirement) -> Vec<Verdict> {
        match self {
            Simulated::Selected(row) => vec![row.verdict(requirement)],
            Simulated::Fresh(runs) => runs.iter().map(|run| run.verdict(requirement)).collect(),
            Simulated::Again(rows) => rows.iter().map(|row| row.verdict(requirement)).collect(),
        }
    }
}

impl Sides<'_> {
    fn compared(&self, metric: MetricId, tolerance: f64) -> Option<Compared> {
        let simulation: Vec<f64> = self.simulated.values(metric).into_iter().flatten().collect();
        let selected = matches!(self.simulated, Simulated::Selected(_));
        let lab: Vec<f64> = self.lab_runs.iter().filter_map(|row| row.value(metric).value).collect();
        if simulation.is_empty() || lab.is_empty() {
            return None;
        }
        let samples = Samples::new(&simulation, &lab);
        let equivalence = equivalence::compare(samples, tolerance, ALPHA);
        let interval = || {
            let found = intervals(samples, Resampling::default(), hedges_g).ok()?;
            Some(found.bca.unwrap_or(found.percentile))
        };
        let effect = hedges_g(samples).ok().map(|g| (g, interval()));
        let runs_needed = match equivalence.verdict {
            Equal::Undecided(Reason::NoPower) => lab_runs_needed(samples, tolerance, ALPHA).ok().flatten(),
            _ => None,
        };
        let (p_different, p_equivalent) = (None, None);
        let test = self.test;
        Some(Compared { test, selected, simulation, lab, equivalence, p_different, p_equivalent, effect, runs_needed })
    }
}

/// Adjusts the p values of all comparisons, and their verdicts.
fn adjust(metrics: &mut [MetricGap]) {
    let tests = || metrics.iter().flat_map(|gap| &gap.tests).filter_map(|test| test.equivalence.tests.as_ref().ok());
    let different = adjusted(&tests().map(|test| test.p_different).collect::<Vec<_>>());
    let equivalent = adjusted(&tests().map(equivalence::Tests::p_equivalent).collect::<Vec<_>>());
    let mut adjusted = different.into_iter().zip(equivalent);
    for gap in metrics {
        for compared in &mut gap.tests {
            let Ok(tests) = &compared.equivalence.tests else { continue };
            let Some((different, equivalent)) = adjusted.next() else { continue };
            compared.p_different = Some(different);
            compared.p_equivalent = Some(equivalent);
            compared.equivalence.verdict = equivalence::verdict(tests, equivalent, different, gap.tolerance, ALPHA);
        }
    }
}

fn locate(gap: &mut MetricGap, points: &BTreeMap<u32, Vec<Option<f64>>>) {
    let mut located = Vec::new();
    for compared in &gap.tests {
        let (Ok(tests), Some(at)) = (&compared.equivalence.tests, points.get(&compared.test)) else { continue };
        located.push(Located { at: at.clone(), difference: tests.welch });
        gap.located.push(compared.test);
    }
    let settings = localise::Settings { tolerance: gap.tolerance, alpha: ALPHA, permutations: PERMUTATIONS, seed: 0 };
    gap.extent = localise(&located, settings);
}

/// Where the gap of variations of one test is: between those that differ and those that agree, if a range divides them.
///
/// Other coordinates of variations are equal, so nothing else can explain it. That some differ at all is more than
/// chance already, since verdicts are those of all comparisons together.
fn separated(gap: &MetricGap, points: &BTreeMap<u32, Vec<Option<f64>>>) -> Option<Extent> {
    let mut decided: Vec<(f64, bool, Welch)> = Vec::new();
    for compared in &gap.tests {
        let (Ok(tests), Some([Some(at)])) =
            (&compared.equivalence.tests, points.get(&compared.test).map(Vec::as_slice))
        else {
            continue;
        };
        match compared.equivalence.verdict {
            Equal::Different => decided.push((*at, true, tests.welch)),
            Equal::Equivalent => decided.push((*at, false, tests.welch)),
            Equal::Undecided(_) => {}
        }
    }
    decided.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first = decided.iter().position(|(_, differs, _)| *differs)?;
    let last = decided.iter().rposition(|(_, differs, _)| *differs)?;
    let inside = &decided[first..=last];
    let outside = || decided[..first].iter().chain(&decided[last + 1..]);
    if inside.iter().any(|(_, differs, _)| !differs) || inside.len() < 2 || outside().count() < 2 {
        return None;
    }
    let end = |below: usize| Some(f64::midpoint(decided.get(below)?.0, decided.get(below + 1)?.0));
    let range = Range { dimension: 0, low: first.checked_sub(1).and_then(end), high: end(last) };
    let inside = Pooled::of(inside.iter().map(|(_, _, difference)| difference))?;
    let outside = Pooled::of(outside().map(|(_, _, difference)| difference))?;
    let apart = inside.estimate - outside.estimate;
    let squared = |of: &Pooled| of.standard_error * of.standard_error;
    let q = apart * apart / (squared(&inside) + squared(&outside));
    Some(Extent::Range { split: Split { range, q, p: ALPHA }, inside, outside })
}

fn event(name: &str, sides: &[Sides<'_>], of: impl Fn(&Sides<'_>) -> (Occurrences, Occurrences)) -> EventGap {
    let counts: Vec<(u32, (Occurrences, Occurrences))> = sides.iter().map(|sides| (sides.test, of(sides))).collect();
    EventGap {
        name: name.to_owned(),
        confusion: Confusion::of(counts.iter().map(|(_, counts)| *counts)),
        tests: counts.into_iter().map(|(test, (simulation, lab))| (test, frequencies(simulation, lab))).collect(),
    }
}

impl Gap {
    /// Each metric of each test: both sides, their difference (the lab's mean minus the simulation's), the effect size,
    /// and the verdict. Intervals are of 95 %, except that of the difference, which is of 90 %: it is within the
    /// tolerance if the test is equivalent by itself.
    pub fn comparisons(&self, plan: &CampaignPlan) -> Table {
        let columns = [
            "test",
            "metric",
            "unit",
            "simulation_runs",
            "simulation_mean",
            "simulation_deviation",
            "lab_runs",
            "lab_mean",
            "lab_deviation",
            "difference",
            "difference_low",
            "difference_high",
            "tolerance",
            "effect",
            "effect_low",
            "effect_high",
            "p_different",
            "p_equivalent",
            "power",
            "verdict",
            "remark",
        ];
        let mut table = Table::new(columns.map(str::to_owned));
        for gap in &self.metrics {
            let metric = plan.metric(gap.metric);
            for compared in &gap.tests {
                let Compared { simulation, lab, equivalence, effect, .. } = compared;
                let [simulated, measured] =
                    moments(Samples::new(simulation, lab)).map_or([None; 2], |both| both.map(Some));
                let mean = |of: Option<sesame_gap::samples::Moments>| Datum::lone(of.map(|of| of.mean));
                let deviation = |of: Option<sesame_gap::samples::Moments>| Datum::lone(of.and_then(|of| of.deviation));
                let tests = equivalence.tests.as_ref().ok();
                let difference = simulated.zip(measured).map(|(simulated, measured)| measured.mean - simulated.mean);
                let interval = effect.and_then(|(_, interval)| interval);
                table.row([
                    Datum::test(compared.test),
                    Datum::text(&metric.name),
                    metric.unit.clone().map_or(Datum::Missing, Datum::Text),
                    Datum::count(simulation.len()),
                    mean(simulated),
                    deviation(simulated),
                    Datum::count(lab.len()),
                    mean(measured),
                    deviation(measured),
                    Datum::lone(difference),
                    Datum::lone(tests.map(|tests| tests.interval[0])),
                    Datum::lone(tests.map(|tests| tests.interval[1])),
                    Datum::Lone(gap.tolerance),
                    Datum::lone(effect.map(|(g, _)| g)),
                    Datum::lone(interval.map(|[low, _]| low)),
                    Datum::lone(interval.map(|[_, high]| high)),
                    Datum::lone(compared.p_different),
                    Datum::lone(compared.p_equivalent),
                    Datum::lone(tests.map(|tests| tests.power)),
                    Datum::text(word(equivalence.verdict)),
                    Datum::maybe(compared.remark()),
                ]);
            }
        }
        table
    }

    /// The same for people: what a line holds.
    pub fn overview(&self, plan: &CampaignPlan) -> Table {
        let columns = ["test", "metric", "simulation", "lab", "difference", "verdict", "remark"];
        let mut table = Table::new(columns.map(str::to_owned));
        for gap in &self.metrics {
            let metric = plan.metric(gap.metric);
            let unit = metric.unit.as_deref();
            for compared in &gap.tests {
                let Ok([simulation, lab]) = moments(Samples::new(&compared.simulation, &compared.lab)) else {
                    continue;
                };
                let side = |of: sesame_gap::samples::Moments| match of.deviation {
                    Some(deviation) => {
                        format!("{} ± {} ({})", quantity(of.mean, None), quantity(deviation, unit), of.count)
                    }
                    None => format!("{} ({})", quantity(of.mean, unit), of.count),
                };
                table.row([
                    Datum::test(compared.test),
                    Datum::text(&metric.name),
                    Datum::Text(side(simulation)),
                    Datum::Text(side(lab)),
                    Datum::Text(quantity(lab.mean - simulation.mean, unit)),
                    Datum::text(word(compared.equivalence.verdict)),
                    Datum::maybe(compared.remark()),
                ]);
            }
        }
        table
    }

    /// Each requirement and interlocked metric: how many tests violate it on both sides, in the simulation only (false
    /// alarms), in the lab only (misses), or nowhere.
    pub fn events(&self) -> Table {
        let columns = [
            "event",
            "both",
            "false_alarms",
            "misses",
            "neither",
            "inconclusive",
            "precision",
            "recall",
            "missed_tests",
        ];
        let mut table = Table::new(columns.map(str::to_owned));
        for EventGap { name, confusion, tests } in &self.events {
            let missed = tests.iter().filter(|(_, found)| {
                found.simulation.is_some_and(|share| share.count == 0) && found.lab.is_some_and(|share| share.count > 0)
            });
            let missed: Vec<String> = missed.map(|(test, _)| TestNumber(*test).to_string()).collect();
            table.row([
                Datum::text(name),
                Datum::count(confusion.both),
                Datum::count(confusion.false_alarms),
                Datum::count(confusion.misses),
                Datum::count(confusion.neither),
                Datum::count(confusion.inconclusive),
                Datum::lone(confusion.precision().map(sesame_gap::proportion::Share::value)),
                Datum::lone(confusion.recall().map(sesame_gap::proportion::Share::value)),
                if missed.is_empty() { Datum::Missing } else { Datum::Text(missed.join(" ")) },
            ]);
        }
        table
    }

    /// What the study says, most important first: misses, then where each metric differs.
    pub fn sentences(&self, plan: &CampaignPlan) -> Vec<String> {
        let mut sentences = Vec::new();
        for EventGap { name, confusion, .. } in &self.events {
            let Confusion { misses, false_alarms, .. } = *confusion;
            if misses > 0 {
                sentences.push(format!(
                    "`{name}` is missed: {} it in the lab and not in the simulation.",
                    plural(misses, "test violates", "tests violate")
                ));
            }
            if false_alarms > 0 {
                sentences.push(format!(
                    "`{name}` is a false alarm: {} it in the simulation and not in the lab.",
                    plural(false_alarms, "test violates", "tests violate")
                ));
            }
        }
        for gap in &self.metrics {
            let metric = plan.metric(gap.metric);
            let words = Words {
                metric: &format!("`{}`", metric.name),
                than: ["smaller", "greater"],
                value: &|value| quantity(value, metric.unit.as_deref()),
                dimension: &|at| self.dimensions[at].name().to_owned(),
                coordinate: &|_, value| fixed(value, 2),
                test: &|at| TestNumber(gap.located[at]).to_string(),
            };
            sentences.push(match gap.without_spread() {
                Some([low, high]) => constant(words.metric, [low, high], gap.tests.len(), words.value),
                None => localise::sentence(&gap.extent, gap.located.len(), &words),
            });
            sentences.extend(self.edges(gap));
        }
        sentences
    }
}

impl Gap {
    /// Between which tests a gap that is local begins and ends; `None` for another one.
    fn edges(&self, gap: &MetricGap) -> Option<String> {
        let Extent::Range { split: Split { range, .. }, .. } = &gap.extent else { return None };
        let name = self.dimensions[range.dimension].name();
        let places = gap.located.iter().filter_map(|test| Some((*test, self.points.get(test)?[range.dimension]?)));
        let places: Vec<(u32, f64)> = places.collect();
        let edge = |end: f64| {
            let below = places.iter().filter(|(_, at)| *at < end).max_by(|a, b| a.1.total_cmp(&b.1))?;
            let above = places.iter().filter(|(_, at)| *at > end).min_by(|a, b| a.1.total_cmp(&b.1))?;
            let [below, above] =
                [below, above].map(|(test, at)| format!("{} ({name} {})", TestNumber(*test), fixed(*at, 2)));
            Some(format!("between {below} and {above}"))
        };
        let (begins, ends) = (range.low.and_then(edge), range.high.and_then(edge));
        match (begins, ends) {
            (Some(begins), Some(ends)) => Some(format!("It begins {begins}, and ends {ends}.")),
            (Some(begins), None) => Some(format!("It begins {begins}.")),
            (None, Some(ends)) => Some(format!("It ends {ends}.")),
            (None, None) => None,
        }
    }

    /// The recorded test that would tell most about where a gap begins and ends if it were run in the lab next, with
    /// the reason as a sentence; `None` if every test was run there.
    ///
    /// A test has a gap if one of its metrics differs, and none if all that is decided agrees.
    pub fn next_test(&self, campaign: &Repository) -> Result<Option<(u32, String)>, RecordError> {
        let verdict = |test: u32| {
            let of_metrics =
                self.metrics.iter().flat_map(|gap| gap.tests.iter().filter(move |compared| compared.test == test));
            let verdicts: Vec<Equal> = of_metrics.map(|compared| compared.equivalence.verdict).collect();
            match () {
                () if verdicts.contains(&Equal::Different) => Some(true),
                () if verdicts.contains(&Equal::Equivalent) => Some(false),
                () => None,
            }
        };
        let tried: Vec<(u32, Tried)> =
            self.points.iter().map(|(&test, at)| (test, Tried { at: at.clone(), gap: verdict(test) })).collect();
        let others: BTreeSet<u32> = {
            let rows = campaign.tests()?;
            let own = |row: &&TestRow| row.origin != Origin::Reference && row.duplicate_of.is_none();
            rows.iter().filter(own).map(|row| row.number).filter(|test| !self.points.contains_key(test)).collect()
        };
        let candidates: Vec<(u32, Vec<Option<f64>>)> = points(campaign, &others, &self.dimensions)?
            .into_iter()
            .filter(|(_, at)| at.iter().any(Option::is_some))
            .collect();
        let along = self.metrics.iter().find_map(|gap| match &gap.extent {
            Extent::Range { split, .. } => Some(split.range.dimension),
            _ => None,
        });
        let known: Vec<Tried> = tried.iter().map(|(_, tried)| tried.clone()).collect();
        let places: Vec<Vec<Option<f64>>> = candidates.iter().map(|(_, at)| at.clone()).collect();
        let Some(Next { candidate, why }) = next(&known, &places, along) else { return Ok(None) };
        let test = candidates[candidate].0;
        let why = match why {
            Why::Between { gap, none } => format!(
                "it lies between {}, which has a gap, and {}, which has none",
                TestNumber(tried[gap].0),
                TestNumber(tried[none].0)
            ),
            Why::Farthest { .. } => "it is the most unlike those that were run there".to_owned(),
        };
        Ok(Some((test, format!("{} would tell most if it were run in the lab next: {why}.", TestNumber(test)))))
    }
}

impl MetricGap {
    /// The smallest and the largest difference, where all runs of each test are equal on each side, so that there is no
    /// chance to speak of; `None` elsewhere.
    pub fn without_spread(&self) -> Option<[f64; 2]> {
        let no_spread = |test: &Compared| test.equivalence.tests == Err(Undefined::NoSpread);
        if !self.tests.iter().all(no_spread) {
            return None;
        }
        let differences = self.tests.iter().map(|test| test.lab[0] - test.simulation[0]);
        Some(differences.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]))
    }
}

/// A sentence on a metric whose runs are all equal on each side.
fn constant(metric: &str, [low, high]: [f64; 2], tests: usize, value: &dyn Fn(f64) -> String) -> String {
    let tests = plural(tests, "test", "tests");
    if low == 0.0 && high == 0.0 {
        return format!("There is no gap: {metric} is the same in every run of {tests}.");
    }
    let by = if low == high { format!("by {}", value(low)) } else { format!("by {} to {}", value(low), value(high)) };
    format!("{metric} does not vary from run to run, and differs {by} in the lab over {tests}.")
}

/// What a comparison found, as one word for tables.
pub fn word(verdict: Equal) -> &'static str {
    match verdict {
        Equal::Equivalent => "equivalent",
        Equal::Different => "different",
        Equal::Undecided(_) => "undecided",
    }
}

impl Compared {
    /// Why nothing is decided, and what would help.
    fn remark(&self) -> Option<String> {
        let why = match self.equivalence.verdict {
            Equal::Equivalent | Equal::Different => return self.selected.then(|| SELECTED.to_owned()),
            Equal::Undecided(Reason::Undefined(Undefined::OneRun(Side::Simulation))) if self.selected => {
                return Some(SELECTED.to_owned());
            }
            Equal::Undecided(Reason::Undefined(Undefined::NoSpread)) if self.lab[0] == self.simulation[0] => {
                "the same in every run".to_owned()
            }
            Equal::Undecided(Reason::Undefined(why)) => why.to_string(),
            Equal::Undecided(Reason::NoTolerance) => "no difference is tolerated, and none is shown".to_owned(),
            Equal::Undecided(Reason::NoPower) => match self.runs_needed {
                Some(runs) => format!("too few runs: {runs} in the lab would do"),
                None => "too few runs for such a spread".to_owned(),
            },
            Equal::Undecided(Reason::NotShown) => "neither is shown".to_owned(),
        };
        Some(why)
    }
}

/// The only run of the simulation was the one for which the test was chosen.
const SELECTED: &str = "run once in the simulation: `confirm` runs it again";

#[cfg(test)]
mod tests {
    use sesame_record::{MetricValue, sample};

    use super::*;
    use crate::sample::{COLLISIONS, FUZZING_TIME, Made, study, tolerant};

    fn made(collisions: Made, fuzzing_time: Made) -> (Vec<LabRun>, Repository, tempfile::TempDir) {
        let folder = tempfile::tempdir().unwrap();
        let (runs, repository) = study(folder.path(), collisions, fuzzing_time);
        (runs, repository, folder)
    }

    fn of(gap: &Gap, metric: MetricId) -> &MetricGap {
        gap.metrics.iter().find(|gap| gap.metric == metric).unwrap()
    }

    #[test]
    fn a_lab_that_agrees_is_equivalent_test_by_test() {
        let (runs, repository, _folder) = made(|value, _| value, |value, _| value);
        let gap = gap(&repository, &runs, Some(&tolerant())).unwrap();
        assert_eq!(gap.tests.len(), 24);
        for metric in [COLLISIONS, FUZZING_TIME] {
            let gap = of(&gap, metric);
            assert!(gap.tests.iter().all(|test| test.equivalence.verdict == Equal::Equivalent && !test.selected));
            assert_eq!(gap.extent, Extent::None);
        }
        let said = gap.sentences(repository.plan());
        assert!(
            said.contains(&"There is no gap: `fuzzing_time` agrees within the tolerance in all 24 tests.".to_owned()),
            "{said:?}"
        );
    }

    #[test]
    fn a_gap_that_is_everywhere_is_systematic_and_one_in_late_tests_is_local() {
        let (runs, repository, _folder) =
            made(|value, t1| if t1 > 0.5 { value - 3.0 } else { value }, |value, _| value + 4.0);
        let gap = gap(&repository, &runs, Some(&tolerant())).unwrap();
        let everywhere = of(&gap, FUZZING_TIME);
        let Extent::Systematic { pooled, .. } = &everywhere.extent else { panic!("{:?}", everywhere.extent) };
        assert!((pooled.estimate - 4.0).abs() < 0.1, "{pooled:?}");
        assert!(everywhere.tests.iter().all(|test| test.equivalence.verdict == Equal::Different));
        let late = of(&gap, COLLISIONS);
        let Extent::Range { split, inside, .. } = &late.extent else { panic!("{:?}", late.extent) };
        assert_eq!(gap.dimensions[split.range.dimension], Dimension::T1);
        assert!((split.range.low.unwrap() - 0.5).abs() < 0.1 && split.range.high.is_none(), "{split:?}");
        assert!((inside.estimate + 3.0).abs() < 0.3, "{inside:?}");
    }

    #[test]
    fn violations_are_compared_as_false_alarms_and_misses() {
        let (mut runs, repository, _folder) = made(|value, _| value, |value, _| value);
        // R2 bounds the top speed, which the sample's tests satisfy or violate.
        let speed = &repository.plan().requirements[1];
        let violated: Vec<u32> = runs.iter().map(|run| run.of).collect();
        let first = violated[0];
        for run in runs.iter_mut().filter(|run| run.of == first) {
            run.row.values[speed.metric.index()] = MetricValue::whole(Some(99.0), true);
        }
        let gap = gap(&repository, &runs, None).unwrap();
        let [_, event, ..] = &gap.events[..] else { panic!("there are requirements") };
        let fresh = repository.judge().unwrap().tally(first, speed);
        let (misses, both) = if fresh.violated == 0 { (1, 0) } else { (0, 1) };
        assert_eq!(event.confusion.misses, misses);
        assert!(event.confusion.both >= both);
        assert_eq!(event.confusion.false_alarms, 0);
        let Confusion { both, neither, inconclusive, .. } = event.confusion;
        assert_eq!(both + neither + inconclusive + misses, 24);
    }

    #[test]
    fn an_interlocked_metric_is_compared_by_presence_only() {
        let (runs, repository, _folder) = made(|value, _| value + 30.0, |value, _| value);
        let interlocked = Lab { interlock: vec![COLLISIONS, FUZZING_TIME], ..tolerant() };
        let gap = gap(&repository, &runs, Some(&interlocked)).unwrap();
        assert!(gap.metrics.iter().all(|gap| gap.metric != COLLISIONS && gap.metric != FUZZING_TIME));
        // Collisions have a requirement, R1; fuzzing times have none.
        let names: Vec<&str> = gap.events.iter().map(|event| event.name.as_str()).collect();
        assert_eq!(names, ["R1", "R2", "R3", "R4", "fuzzing_time"]);
        assert_eq!(gap.events[4].confusion.both, 24);
    }

    #[test]
    fn the_gap_of_variations_is_where_those_that_differ_are_divided_from_those_that_agree() {
        let (runs, repository, _folder) =
            made(|value, t1| if t1 > 0.5 { value - 30.0 * (t1 - 0.5) - 3.0 } else { value }, |value, _| value);
        let found = gap(&repository, &runs, Some(&tolerant())).unwrap();
        let own = of(&found, COLLISIONS);
        let along = |of: &dyn Fn(f64) -> f64| -> BTreeMap<u32, Vec<Option<f64>>> {
            found.points.iter().map(|(test, at)| (*test, vec![at[0].map(of)])).collect()
        };
        let Some(Extent::Range { split, inside, outside }) = separated(own, &along(&|t1| t1)) else {
            panic!("late tests differ, early ones agree")
        };
        assert!((split.range.low.unwrap() - 0.5).abs() < 0.1 && split.range.high.is_none(), "{split:?}");
        assert!(inside.estimate < -3.0 && outside.estimate.abs() < 0.5, "{inside:?} {outside:?}");
        // In another order of the tests nothing divides them.
        assert_eq!(separated(own, &along(&|t1| libm::sin(40.0 * t1))), None);
    }

    #[test]
    fn a_test_that_was_run_once_says_how_it_is_run_again() {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 60);
        let rows = repository.tests().unwrap();
        let row = rows.iter().find(|row| row.origin == Origin::Search && row.duplicate_of.is_none()).unwrap();
        let runs = [LabRun { of: row.number, row: row.clone() }];
        let gap = gap(&repository, &runs, Some(&tolerant())).unwrap();
        let compared = &gap.metrics[0].tests[0];
        assert!(compared.selected);
        assert_eq!(compared.remark().as_deref(), Some(SELECTED));
        assert!(gap.comparisons(repository.plan()).rows()[0].contains(&Datum::text("undecided")));
        assert_eq!(gap.overview(repository.plan()).rows().len(), gap.metrics.len());
    }
}
