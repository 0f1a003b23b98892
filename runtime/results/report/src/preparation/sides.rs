//! Runs of one test in simulation and in a lab, side by side.

use serde::Serialize;

use sesame_analysis::statistics::Sample;
use sesame_plan::{CampaignPlan, Lab, MetricId, Requirement};
use sesame_present::number::{self, quantity};
use sesame_record::{RecordError, Repository, TestRecord, Verdict, verdict};

/// Where runs were made, as sentences name it.
pub(super) fn place(lab: Option<&str>) -> String {
    lab.map_or_else(|| "the simulation".to_owned(), |lab| format!("lab `{lab}`"))
}

/// All runs of a results file, with their series, in their order.
pub(super) fn runs(repository: &Repository) -> Result<Vec<TestRecord>, RecordError> {
    repository.records(0..=u32::MAX, true)
}

/// The values of a metric over several runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Values {
    /// Runs that have a value.
    pub runs: usize,
    /// The mean.
    pub mean: f64,
    /// The standard deviation of a sample (with `n − 1`); `None` for a single run.
    pub deviation: Option<f64>,
    /// The smallest value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
}

impl Values {
    /// Summarises all runs that have a value; `None` if none has.
    pub(super) fn of<'a>(runs: impl IntoIterator<Item = &'a TestRecord>, metric: MetricId) -> Option<Values> {
        let value = |record: &TestRecord| record.observation.value(metric).value.filter(|value| value.is_finite());
        let Sample { count, mean, deviation, min, max, median: _ } = Sample::of(runs.into_iter().filter_map(value))?;
        Some(Values { runs: count, mean, deviation, min, max })
    }

    /// In words: `41.2 ± 0.3 s`, and without spread only the value.
    pub(super) fn words(&self, unit: Option<&str>) -> String {
        match self.deviation.filter(|deviation| *deviation > 0.0) {
            Some(deviation) => {
                let decimals = number::decimals([self.mean, deviation]);
                let [mean, deviation] = [self.mean, deviation].map(|value| number::fixed(value, decimals));
                number::with_unit(format!("{mean} ± {deviation}"), unit)
            }
            None => quantity(self.mean, unit),
        }
    }
}

/// A metric on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricSides {
    /// The metric.
    pub metric: String,
    /// Its unit; `None` for a plain number.
    pub unit: Option<String>,
    /// Its values in simulation; `None` where it has none.
    pub simulation: Option<Values>,
    /// Its values in the lab.
    pub lab: Option<Values>,
    /// The mean in the lab minus that in simulation.
    pub difference: Option<f64>,
    /// The difference that the lab tolerates; `None` if it declares none, and for metrics of an interlock.
    pub tolerance: Option<f64>,
    /// Whether the difference is greater than that, or only one side has values.
    pub beyond: bool,
}

/// All metrics over runs of one test.
pub(super) fn metrics<'a>(
    plan: &CampaignPlan,
    simulation: &[&'a TestRecord],
    lab: Option<(&Lab, &[&'a TestRecord])>,
) -> Vec<MetricSides> {
    let sides = (0u32..).map(MetricId).zip(&plan.metrics).map(|(id, metric)| {
        let values = |runs: &[&'a TestRecord]| Values::of(runs.iter().copied(), id);
        let simulated = values(simulation);
        let in_lab = lab.and_then(|(_, runs)| values(runs));
        let tolerated = |lab: &Lab| {
            let ends_by = lab.interlock.contains(&id);
            lab.tolerances.iter().find(|tolerance| tolerance.metric == id && !ends_by).map(|tolerance| tolerance.value)
        };
        let tolerance = lab.and_then(|(lab, _)| tolerated(lab));
        let difference = simulated.zip(in_lab).map(|(simulated, in_lab)| in_lab.mean - simulated.mean);
        let beyond = tolerance.is_some_and(|tolerance| match difference {
            Some(difference) => difference.abs() > tolerance,
            None => simulated.is_some() != in_lab.is_some(),
        });
        let (metric, unit) = (metric.name.clone(), metric.unit.clone());
        MetricSides { metric, unit, simulation: simulated, lab: in_lab, difference, tolerance, beyond }
    });
    sides.collect()
}

impl MetricSides {
    /// Why it is not as required, if it is not.
    pub(super) fn objection(&self, of: &str, lab: &str) -> Option<String> {
        let unit = self.unit.as_deref();
        let tolerance = self.tolerance.filter(|_| self.beyond)?;
        let name = &self.metric;
        Some(match self.difference {
            Some(difference) => format!(
                "`{name}`{of} differs by {} between the simulation and lab `{lab}`; the lab tolerates {}",
                quantity(difference.abs(), unit),
                quantity(tolerance, unit)
            ),
            None if self.simulation.is_some() => {
                format!("`{name}`{of} has a value in simulation and none in lab `{lab}`")
            }
            None => format!("`{name}`{of} has a value in lab `{lab}` and none in simulation"),
        })
    }
}

/// How many runs say what about a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct VerdictCounts {
    /// Runs that violate it.
    pub violated: usize,
    /// Runs that satisfy it.
    pub satisfied: usize,
    /// Runs that are inconclusive about it.
    pub inconclusive: usize,
}

impl VerdictCounts {
    pub(super) fn of<'a>(runs: impl IntoIterator<Item = &'a TestRecord>, requirement: &Requirement) -> Self {
        let mut counts = VerdictCounts::default();
        for TestRecord { observation, .. } in runs {
            match verdict(requirement.bound, &observation.outcome, observation.value(requirement.metric)) {
                Verdict::Violated => counts.violated += 1,
                Verdict::Satisfied => counts.satisfied += 1,
                Verdict::Inconclusive => counts.inconclusive += 1,
            }
        }
        counts
    }

    fn all(self) -> usize {
        self.violated + self.satisfied + self.inconclusive
    }

    /// In words: `satisfied`, or how many runs say what.
    pub(super) fn words(self) -> String {
        let counts = [(self.violated, "violated"), (self.satisfied, "satisfied"), (self.inconclusive, "inconclusive")];
        let said: Vec<(usize, &str)> = counts.into_iter().filter(|(count, _)| *count > 0).collect();
        match said[..] {
            [] => "–".to_owned(),
            [(_, word)] => word.to_owned(),
            _ => said.iter().map(|(count, word)| format!("{count} {word}")).collect::<Vec<_>>().join(", "),
        }
    }
}

/// A requirement on both sides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RequirementSides {
    /// The requirement.
    pub requirement: String,
    /// The metric it is about.
    pub metric: String,
    /// Its bound, in words.
    pub bound: String,
    /// The verdicts of the runs in simulation.
    pub simulation: VerdictCounts,
    /// The verdicts of the runs in the lab.
    pub lab: Option<VerdictCounts>,
}

/// All requirements over runs of one test.
pub(super) fn requirements(
    plan: &CampaignPlan,
    simulation: &[&TestRecord],
    lab: Option<&[&TestRecord]>,
) -> Vec<RequirementSides> {
    let sides = plan.requirements.iter().map(|requirement| {
        let metric = plan.metric(requirement.metric);
        RequirementSides {
            requirement: requirement.name.clone(),
            metric: metric.name.clone(),
            bound: number::bound(requirement.bound, metric.unit.as_deref()),
            simulation: VerdictCounts::of(simulation.iter().copied(), requirement),
            lab: lab.map(|runs| VerdictCounts::of(runs.iter().copied(), requirement)),
        }
    });
    sides.collect()
}

/// Why a requirement is not as required on one side, if it is not: it is violated, or no run says anything about it.
pub(super) fn violated(name: &str, counts: VerdictCounts, place: &str) -> Option<String> {
    let runs = counts.all();
    if counts.violated > 0 {
        Some(format!("{name} is violated in {} of {} in {place}", counts.violated, number::plural(runs, "run", "runs")))
    } else if counts.satisfied == 0 && runs > 0 {
        Some(format!("no run in {place} is conclusive about {name}"))
    } else {
        None
    }
}

/// Runs that broke off, each in a sentence.
pub(super) fn broken_off(runs: &[TestRecord], place: &str) -> Vec<String> {
    let broken = runs.iter().filter(|run| !run.observation.outcome.is_whole());
    let said = broken.map(|run| {
        let outcome = &run.observation.outcome;
        let detail = outcome.detail().map_or_else(String::new, |detail| format!(": {detail}"));
        format!("run {} in {place} ended by {}{detail}", run.number + 1, outcome.word())
    });
    said.collect()
}
