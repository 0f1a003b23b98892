//! Known fuzzing testing [SESAME 2023, §3.3.3]: regression tests in simulation and in a lab.

use serde::Serialize;

use sesame_plan::{CampaignPlan, KnownTestId, Lab};
use sesame_present::number::exact_bound;
use sesame_record::{Origin, RecordError, Repository, TestRecord, Verdict, verdict};

use crate::preparation::sides::{MetricSides, RequirementSides, VerdictCounts, metrics, place, requirements, runs};

/// Regression tests on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownTesting {
    /// The lab; `None` where they ran in simulation only.
    pub lab: Option<String>,
    /// The tests, in declaration order.
    pub tests: Vec<KnownSides>,
    /// Each deviation from what is required, as a sentence.
    pub objections: Vec<String>,
}

/// A regression test on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownSides {
    /// Its name.
    pub test: String,
    /// How it ended in simulation; `None` where it did not run.
    pub simulation: Option<String>,
    /// How it ended in the lab.
    pub lab: Option<String>,
    /// What was expected.
    pub expectations: Vec<ExpectationSides>,
    /// All metrics, in declaration order.
    pub metrics: Vec<MetricSides>,
    /// All requirements, in declaration order.
    pub requirements: Vec<RequirementSides>,
}

/// An expectation on both sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExpectationSides {
    /// The metric it is about.
    pub metric: String,
    /// The expected bound, in words.
    pub bound: String,
    /// The value in simulation.
    pub simulation_value: Option<f64>,
    /// The verdict of the run in simulation; `None` if there was none.
    pub simulation: Option<Verdict>,
    /// The value in the lab.
    pub lab_value: Option<f64>,
    /// The verdict of the run in the lab.
    pub lab: Option<Verdict>,
}

/// Compares regression tests of simulation and lab, of one campaign.
pub fn known(simulation: &Repository, lab: Option<(&Lab, &Repository)>) -> Result<KnownTesting, RecordError> {
    let plan = simulation.plan();
    let simulated = runs(simulation)?;
    let in_lab = match lab {
        Some((lab, repository)) => Some((lab, runs(repository)?)),
        None => None,
    };
    let mut tests = Vec::new();
    let mut objections = Vec::new();
    for (id, declared) in (0u32..).map(KnownTestId).zip(&plan.tests) {
        let of = |runs: &'_ [TestRecord]| runs.iter().position(|run| run.origin == Origin::Known(id));
        let here = of(&simulated).map(|at| &simulated[at]);
        let there = in_lab.as_ref().map(|(lab, runs)| (*lab, of(runs).map(|at| &runs[at])));
        if here.is_none() && there.is_none_or(|(_, run)| run.is_none()) {
            continue;
        }
        let sides = sides(plan, id, here, there);
        for (run, at) in [(here, None), (there.and_then(|(_, run)| run), there.map(|(lab, _)| lab.name.as_str()))] {
            let Some(run) = run.filter(|run| !run.observation.outcome.is_whole()) else { continue };
            let detail = run.observation.outcome.detail().map_or_else(String::new, |detail| format!(": {detail}"));
            let word = run.observation.outcome.word();
            objections.push(format!("`{}` ended by {word} in {}{detail}", declared.name, place(at)));
        }
        objections.extend(not_as_expected(&sides, there.map(|(lab, _)| lab.name.as_str())));
        tests.push(sides);
    }
    Ok(KnownTesting { lab: in_lab.map(|(lab, _)| lab.name.clone()), tests, objections })
}

fn sides(
    plan: &CampaignPlan,
    id: KnownTestId,
    here: Option<&TestRecord>,
    there: Option<(&Lab, Option<&TestRecord>)>,
) -> KnownSides {
    let declared = plan.test(id);
    let expectations = declared.expectations.iter().map(|expectation| {
        let metric = plan.metric(expectation.metric);
        let value = |run: &TestRecord| run.observation.value(expectation.metric);
        let said = |run: &TestRecord| verdict(expectation.bound, &run.observation.outcome, value(run));
        let there = there.and_then(|(_, run)| run);
        ExpectationSides {
            metric: metric.name.clone(),
            bound: exact_bound(expectation.bound, metric.unit.as_deref()),
            simulation_value: here.and_then(|run| value(run).value),
            simulation: here.map(said),
            lab_value: there.and_then(|run| value(run).value),
            lab: there.map(said),
        }
    });
    let word = |run: &TestRecord| run.observation.outcome.word().to_owned();
    let simulated: Vec<&TestRecord> = here.into_iter().collect();
    let in_lab: Option<Vec<&TestRecord>> = there.map(|(_, run)| run.into_iter().collect());
    KnownSides {
        test: declared.name.clone(),
        simulation: here.map(word),
        lab: there.and_then(|(_, run)| run).map(word),
        expectations: expectations.collect(),
        metrics: metrics(plan, &simulated, there.map(|(lab, _)| lab).zip(in_lab.as_deref())),
        requirements: requirements(plan, &simulated, in_lab.as_deref()),
    }
}

impl KnownTesting {
    /// Requirements that are not satisfied although the tests ended as they were expected to, as in `R2 by pit`.
    pub(super) fn unsatisfied(&self) -> Vec<String> {
        let of_test = self.tests.iter().flat_map(|test| test.requirements.iter().map(move |sides| (test, sides)));
        let open = |counts: &VerdictCounts| counts.violated + counts.inconclusive > 0;
        let open = of_test.filter(|(_, sides)| open(&sides.simulation) || sides.lab.as_ref().is_some_and(open));
        open.map(|(test, sides)| format!("{} by {}", sides.requirement, test.test)).collect()
    }
}

/// Expectations that are not kept on a side, violations that nobody expects, and requirements whose verdicts differ.
fn not_as_expected(sides: &KnownSides, lab: Option<&str>) -> Vec<String> {
    let mut objections = Vec::new();
    let name = &sides.test;
    for expectation in &sides.expectations {
        for (verdict, place) in [(expectation.simulation, place(None)), (expectation.lab, place(lab))] {
            let what = match verdict {
                Some(Verdict::Violated) => "violated",
                Some(Verdict::Inconclusive) => "inconclusive",
                Some(Verdict::Satisfied) | None => continue,
            };
            let metric = &expectation.metric;
            objections.push(format!("the expectation of `{name}` about {metric} is {what} in {place}"));
        }
    }
    for requirement in &sides.requirements {
        let of = &requirement.requirement;
        if let Some((counts, lab)) = requirement.lab.zip(lab).filter(|(counts, _)| *counts != requirement.simulation) {
            let (here, there) = (requirement.simulation.words(), counts.words());
            objections.push(format!("{of} in `{name}` is {here} in simulation and {there} in lab `{lab}`"));
        } else if sides.expectations.iter().all(|expectation| expectation.metric != requirement.metric) {
            let in_lab = requirement.lab.as_ref().is_some_and(|counts| counts.violated > 0);
            let violated = [(requirement.simulation.violated > 0, place(None)), (in_lab, place(lab))];
            objections.extend(
                violated.into_iter().filter(|(violated, _)| *violated).map(|(_, place)| {
                    format!("{of} is violated by `{name}` in {place}, and the test does not expect it")
                }),
            );
        }
    }
    objections
}
