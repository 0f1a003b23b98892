//! The gap before and after a compensation: of each metric, how far the lab was from the simulation and how far it is
//! from the simulation that was fitted to it.

use std::collections::BTreeSet;

use sesame_base::test_number::TestNumber;
use sesame_plan::CampaignPlan;

use crate::analysis::gap::Gap;
use crate::present::axis::Axis;
use crate::present::markup::Markup;
use crate::present::number::quantity;
use crate::report::study::differences::difference;
use crate::report::study::figure::{Figure, Plot, dot, line, rectangle, text};

/// The width of a figure, and the height of a line in it, in pixels.
const WIDTH: f64 = 340.0;
const LINE: f64 = 22.0;

/// A figure for each metric that was compared on both occasions.
pub(super) fn figures(plan: &CampaignPlan, before: &Gap, after: &Gap) -> Vec<Figure> {
    before.metrics.iter().filter_map(|metric| figure(plan, before, after, metric.metric)).collect()
}

fn figure(plan: &CampaignPlan, before: &Gap, after: &Gap, metric: sesame_plan::MetricId) -> Option<Figure> {
    let of = |gap: &Gap| gap.metrics.iter().find(|it| it.metric == metric).cloned();
    let (old, new) = (of(before)?, of(after)?);
    let tests: BTreeSet<u32> = old.tests.iter().map(|it| it.test).collect();
    let rows: Vec<(u32, f64, f64)> = tests
        .into_iter()
        .filter_map(|test| {
            let found = |gap: &crate::analysis::gap::MetricGap| {
                difference(gap.tests.iter().find(|it| it.test == test)?).map(|(difference, _)| difference)
            };
            Some((test, found(&old)?, found(&new)?))
        })
        .collect();
    if rows.iter().all(|(_, old, new)| *old == 0.0 && *new == 0.0) {
        return None;
    }
    let declared = plan.metric(metric);
    let unit = declared.unit.as_deref();
    let tolerance = old.tolerance;
    let bottom = 26.0 + LINE * rows.len() as f64;
    let plot = Plot {
        across: Axis::round(rows.iter().flat_map(|(_, a, b)| [*a, *b]).chain([-tolerance, tolerance, 0.0]), 5),
        up: Axis { low: 0.0, high: rows.len() as f64, ticks: Vec::new() },
        edges: [52.0, 26.0, WIDTH - 12.0, bottom],
    };
    let mut drawn = Markup::default();
    rectangle(&mut drawn, "tolerated", [plot.x(-tolerance), 26.0], [plot.x(tolerance), bottom]);
    let title = unit.map_or_else(|| declared.name.clone(), |unit| format!("{} [{unit}]", declared.name));
    plot.frame(&mut drawn, "lab − simulation", &title);
    line(&mut drawn, "zero", [plot.x(0.0), 26.0], [plot.x(0.0), bottom]);
    for (at, (test, old, new)) in rows.iter().enumerate() {
        let y = 26.0 + LINE * (at as f64 + 0.5);
        let test = TestNumber(*test);
        text(&mut drawn, "tick end", [46.0, y + 4.0], &test.to_string());
        line(&mut drawn, "moved", [plot.x(*old), y], [plot.x(*new), y]);
        dot(&mut drawn, "before", [plot.x(*old), y], 4.5, &format!("{test} before: {}", quantity(*old, unit)));
        dot(&mut drawn, "after", [plot.x(*new), y], 5.0, &format!("{test} after: {}", quantity(*new, unit)));
    }
    let title = format!("{} before (ring) and after (dot) the compensation", declared.name);
    Some(Figure::new(&format!("compensation-{}", declared.name), title, [WIDTH, bottom + 40.0], drawn))
}
