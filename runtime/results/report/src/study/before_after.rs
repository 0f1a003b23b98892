//! The gap before and after a compensation: for each metric, how far the lab was from the simulation and how far it is
//! from the simulation that was fitted to it.

use sesame_analysis::gap::{Compared, Gap, MetricGap};
use sesame_base::test_number::TestNumber;
use sesame_plan::CampaignPlan;
use sesame_present::axis::Axis;
use sesame_present::markup::Markup;
use sesame_present::number::{quantity, titled};

use crate::study::differences::difference;
use crate::study::figure::{Figure, Plot, dot, line, rectangle, text};

/// The width of a figure, and the height of a line in it, in pixels.
const WIDTH: f64 = 340.0;
const LINE: f64 = 22.0;

/// A figure for each metric that was compared on both occasions.
pub(super) fn figures(plan: &CampaignPlan, before: &Gap, after: &Gap) -> Vec<Figure> {
    let both = before.metrics.iter().filter_map(|old| {
        let new = after.metrics.iter().find(|new| new.metric == old.metric)?;
        figure(plan, old, new)
    });
    both.collect()
}

fn figure(plan: &CampaignPlan, old: &MetricGap, new: &MetricGap) -> Option<Figure> {
    let rows = old.tests.iter().filter_map(|before| {
        let after = new.tests.iter().find(|after| after.test == before.test)?;
        let [before_it, after_it] =
            [before, after].map(|compared: &Compared| difference(compared).map(|(difference, _)| difference));
        Some((before.test, before_it?, after_it?))
    });
    let rows: Vec<(u32, f64, f64)> = rows.collect();
    if rows.iter().all(|(_, old, new)| *old == 0.0 && *new == 0.0) {
        return None;
    }
    let declared = plan.metric(old.metric);
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
    plot.frame(&mut drawn, "lab − simulation", &titled(&declared.name, unit));
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
