//! The series of metrics in the course of runs, those of the simulation and of the lab above each other.

use sesame_plan::{CampaignPlan, MetricId};
use sesame_present::axis::Axis;
use sesame_present::chart::evenly;
use sesame_present::markup::Markup;
use sesame_present::number::titled;
use sesame_record::TestRecord;

use crate::study::Figure;
use crate::study::figure::{Plot, path};

/// The size of a figure, in pixels, and the edges of the plot in it.
const SIZE: [f64; 2] = [340.0, 190.0];
const EDGES: [f64; 4] = [52.0, 26.0, 330.0, 146.0];

/// Metrics drawn at most, and runs of each side.
const METRICS: usize = 24;
const RUNS: usize = 5;

/// Change points drawn of a run at most.
const POINTS: usize = 400;

/// A figure for each metric that changes in the course of a run.
pub(super) fn figures(plan: &CampaignPlan, name: &str, simulation: &[&TestRecord], lab: &[&TestRecord]) -> Vec<Figure> {
    let changing = (0u32..).map(MetricId).take(plan.metrics.len());
    changing.filter_map(|id| figure(plan, name, id, simulation, lab)).take(METRICS).collect()
}

fn figure(
    plan: &CampaignPlan,
    name: &str,
    id: MetricId,
    simulation: &[&TestRecord],
    lab: &[&TestRecord],
) -> Option<Figure> {
    let lines = |runs: &[&TestRecord]| -> Vec<Vec<(f64, f64)>> {
        let line = |run: &&TestRecord| steps(run, id);
        runs.iter().take(RUNS).filter_map(line).collect()
    };
    let (simulated, in_lab) = (lines(simulation), lines(lab));
    let points = || simulated.iter().chain(&in_lab).flatten();
    if !simulated.iter().chain(&in_lab).any(|line| line.len() > 2) {
        return None;
    }
    let declared = plan.metric(id);
    let plot = Plot {
        across: Axis::round(points().map(|(time, _)| *time).chain([0.0]), 6),
        up: Axis::round(points().map(|(_, value)| *value), 4),
        edges: EDGES,
    };
    let mut drawn = Markup::default();
    plot.frame(&mut drawn, "time [s]", &titled(&declared.name, declared.unit.as_deref()));
    for (class, lines) in [("lab", &in_lab), ("simulation", &simulated)] {
        for line in lines {
            path(&mut drawn, class, line.iter().map(|(time, value)| [plot.x(*time), plot.y(*value)]));
        }
    }
    let title = format!("{} in the course of the runs", declared.name);
    Some(Figure::new(&format!("{name}-{}", declared.name), title, SIZE, drawn))
}

/// The corners of a line that holds each value until the next, to the end of the run.
fn steps(run: &TestRecord, id: MetricId) -> Option<Vec<(f64, f64)>> {
    let shown = run.observation.metrics.get(id.index())?;
    let points = evenly(&shown.series, POINTS);
    let mut corners: Vec<(f64, f64)> = Vec::with_capacity(2 * points.len() + 1);
    for (time, value) in points {
        if let Some(&(_, before)) = corners.last() {
            corners.push((time, before));
        }
        corners.push((time, value));
    }
    let (_, last) = *corners.last()?;
    corners.push((run.observation.end, last));
    Some(corners)
}
