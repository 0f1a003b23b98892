//! Null fuzzing validation [SESAME 2023, §3.3.1]: the scenario without disturbance and without a relay, in simulation
//! and in a lab.

use serde::Serialize;

use sesame_plan::Lab;
use sesame_record::{RecordError, Repository, TestRecord};

use crate::preparation::series;
use crate::preparation::sides::{
    MetricSides, RequirementSides, broken_off, metrics, place, requirements, runs, violated,
};
use crate::study::Figure;

/// What the scenario shows without disturbance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NullTesting {
    /// The lab; `None` where there were runs in simulation only.
    pub lab: Option<String>,
    /// Runs on each side.
    pub runs: usize,
    /// All metrics, in declaration order.
    pub metrics: Vec<MetricSides>,
    /// All requirements, in declaration order.
    pub requirements: Vec<RequirementSides>,
    /// Each deviation from what is required, as a sentence.
    pub objections: Vec<String>,
    /// The series of metrics in the course of the runs.
    #[serde(skip)]
    pub(super) figures: Vec<Figure>,
}

/// Compares runs without disturbance.
pub fn null(simulation: &Repository, lab: Option<(&Lab, &Repository)>) -> Result<NullTesting, RecordError> {
    let plan = simulation.plan();
    let simulated = runs(simulation)?;
    let in_lab = match lab {
        Some((lab, repository)) => Some((lab, runs(repository)?)),
        None => None,
    };
    let simulated_runs: Vec<&TestRecord> = simulated.iter().collect();
    let lab_runs: Option<Vec<&TestRecord>> = in_lab.as_ref().map(|(_, runs)| runs.iter().collect());
    let of_lab = in_lab.as_ref().map(|(lab, _)| *lab).zip(lab_runs.as_deref());
    let metrics = metrics(plan, &simulated_runs, of_lab);
    let requirements = requirements(plan, &simulated_runs, lab_runs.as_deref());
    let mut objections = broken_off(&simulated, &place(None));
    if let Some((lab, runs)) = &in_lab {
        objections.extend(broken_off(runs, &place(Some(&lab.name))));
    }
    for requirement in &requirements {
        let name = &requirement.requirement;
        objections.extend(violated(name, requirement.simulation, &place(None)));
        if let (Some(counts), Some((lab, _))) = (requirement.lab, &in_lab) {
            objections.extend(violated(name, counts, &place(Some(&lab.name))));
        }
    }
    if let Some((lab, _)) = &in_lab {
        objections.extend(metrics.iter().filter_map(|metric| metric.objection("", &lab.name)));
    }
    Ok(NullTesting {
        lab: in_lab.as_ref().map(|(lab, _)| lab.name.clone()),
        runs: simulated.len(),
        figures: series::figures(plan, "null", &simulated_runs, lab_runs.as_deref().unwrap_or_default()),
        metrics,
        requirements,
        objections,
    })
}
