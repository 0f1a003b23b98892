//! The map of the gap: how far the lab is from the simulation, at which places of the reduced space.

use sesame_analysis::gap::{Compared, Gap, MetricGap, word};
use sesame_base::test_number::TestNumber;
use sesame_gap::equivalence::Verdict;
use sesame_gap::localise::Extent;
use sesame_gap::samples::{Samples, moments};
use sesame_gap::split::Split;
use sesame_plan::CampaignPlan;
use sesame_present::axis::Axis;
use sesame_present::markup::Markup;
use sesame_present::number::{quantity, titled};

use crate::study::figure::{Figure, Plot, dot, line, names, rectangle};

/// The size of a figure, in pixels.
const SIZE: [f64; 2] = [340.0, 240.0];

/// The edges of the plot in it.
const EDGES: [f64; 4] = [52.0, 26.0, 330.0, 200.0];

/// The difference of a metric in a test, the lab's mean minus the simulation's, with its interval of 90 %.
pub(super) fn difference(compared: &Compared) -> Option<(f64, Option<[f64; 2]>)> {
    let [simulation, lab] = moments(Samples::new(&compared.simulation, &compared.lab)).ok()?;
    let interval = compared.equivalence.tests.as_ref().ok().map(|tests| tests.interval);
    Some((lab.mean - simulation.mean, interval))
}

/// A figure for each metric along each dimension in which its tests differ.
pub(super) fn figures(plan: &CampaignPlan, gap: &Gap) -> Vec<Figure> {
    let mut figures = Vec::new();
    // Where everything is the same, there is nothing to see.
    for metric in gap.metrics.iter().filter(|metric| metric.without_spread() != Some([0.0; 2])) {
        for at in 0..gap.dimensions.len() {
            figures.extend(figure(plan, gap, metric, at));
        }
    }
    figures
}

fn figure(plan: &CampaignPlan, gap: &Gap, metric: &MetricGap, dimension: usize) -> Option<Figure> {
    let declared = plan.metric(metric.metric);
    let unit = declared.unit.as_deref();
    let marks: Vec<(&Compared, f64, f64, Option<[f64; 2]>)> = metric
        .tests
        .iter()
        .filter_map(|compared| {
            let at = (*gap.points.get(&compared.test)?.get(dimension)?)?;
            let (difference, interval) = difference(compared)?;
            Some((compared, at, difference, interval))
        })
        .collect();
    let places = || marks.iter().map(|(_, at, ..)| *at);
    let (least, most) =
        places().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (least.min(at), most.max(at)));
    if marks.is_empty() || least >= most {
        return None;
    }
    let ends = marks
        .iter()
        .flat_map(|(_, _, difference, interval)| interval.map_or([*difference; 2], |[low, high]| [low, high]));
    let tolerance = metric.tolerance;
    let plot = Plot {
        across: Axis::round(places(), 5),
        up: Axis::round(ends.chain([-tolerance, tolerance, 0.0]), 4),
        edges: EDGES,
    };
    let mut drawn = Markup::default();
    if let Extent::Range { split: Split { range, .. }, .. } = &metric.extent
        && range.dimension == dimension
    {
        let [left, top, right, bottom] = EDGES;
        let from = range.low.map_or(left, |low| plot.x(low).clamp(left, right));
        let to = range.high.map_or(right, |high| plot.x(high).clamp(left, right));
        rectangle(&mut drawn, "local", [from, top], [to, bottom]);
    }
    plot.band(&mut drawn, "tolerated", [-tolerance, tolerance]);
    let name = gap.dimensions[dimension].name();
    let title = titled(&declared.name, unit);
    plot.frame(&mut drawn, name, &format!("{title}, lab − simulation"));
    line(&mut drawn, "zero", [EDGES[0], plot.y(0.0)], [EDGES[2], plot.y(0.0)]);
    for (compared, at, difference, interval) in &marks {
        let place = [plot.x(*at), plot.y(*difference)];
        if let Some([low, high]) = interval {
            line(&mut drawn, "whisker", [place[0], plot.y(*low)], [place[0], plot.y(*high)]);
        }
        let verdict = compared.equivalence.verdict;
        let test = TestNumber(compared.test);
        let tip = format!("{test}, {name} {at:.2}: {} ({})", quantity(*difference, unit), word(verdict));
        mark(&mut drawn, verdict, place, &tip);
    }
    let named = marks.iter().map(|(compared, at, difference, _)| {
        ([plot.x(*at), plot.y(*difference)], TestNumber(compared.test).to_string())
    });
    names(&mut drawn, EDGES, &named.collect::<Vec<_>>(), 1.0);
    let title = format!("Difference of {} over {name}", declared.name);
    Some(Figure::new(&format!("gap-{}-{name}", declared.name), title, SIZE, drawn))
}

/// Draws a verdict: a dot, a square or a ring, so that they can be told apart without colours.
pub(super) fn mark(drawn: &mut Markup, verdict: Verdict, [x, y]: [f64; 2], tip: &str) {
    match verdict {
        Verdict::Equivalent => dot(drawn, "equivalent", [x, y], 5.0, tip),
        Verdict::Undecided(_) => dot(drawn, "undecided", [x, y], 4.5, tip),
        Verdict::Different => {
            let corner = [x - 4.5, y - 4.5].map(sesame_present::markup::coordinate);
            let attributes =
                [("class", "different"), ("x", corner[0].as_str()), ("y", &corner[1]), ("width", "9"), ("height", "9")];
            drawn.open("rect", &attributes);
            drawn.element("title", &[], tip);
            drawn.close();
        }
    }
}

/// All comparisons as a table: a row per metric, a column per test; each cell says the difference in the metric's unit.
pub(super) fn map(body: &mut Markup, plan: &CampaignPlan, gap: &Gap) {
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[("class", "gap-map")]);
    body.open("thead", &[]);
    body.open("tr", &[]);
    body.element("th", &[], "metric");
    body.element("th", &[("class", "number")], "tolerance");
    for test in &gap.tests {
        body.element("th", &[("class", "number")], &TestNumber(*test).to_string());
    }
    body.close();
    body.close();
    body.open("tbody", &[]);
    for metric in &gap.metrics {
        let declared = plan.metric(metric.metric);
        let unit = declared.unit.as_deref();
        body.open("tr", &[]);
        body.element("th", &[], &declared.name);
        body.element("td", &[("class", "number")], &quantity(metric.tolerance, unit));
        for test in &gap.tests {
            let compared = metric.tests.iter().find(|compared| compared.test == *test);
            let Some((compared, (difference, _))) =
                compared.and_then(|compared| Some((compared, difference(compared)?)))
            else {
                body.element("td", &[("class", "number")], "–");
                continue;
            };
            let same = metric.without_spread() == Some([0.0; 2]);
            let (class, sign) = match compared.equivalence.verdict {
                _ if same => ("number equivalent", "="),
                Verdict::Equivalent => ("number equivalent", "="),
                Verdict::Different => ("number different", "≠"),
                Verdict::Undecided(_) => ("number undecided", "?"),
            };
            body.element("td", &[("class", class)], &format!("{sign} {}", quantity(difference, unit)));
        }
        body.close();
    }
    body.close();
    body.close();
    body.close();
}
