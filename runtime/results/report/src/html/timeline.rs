//! One test over time: when its operations were active, and what the metrics did meanwhile.
//!
//! Rows share one time axis. Like all charts they are fluid: horizontal places are shares of the width.

use std::fmt::Write as _;

use sesame_base::observation::MetricObservation;
use sesame_base::verdict::ends;
use sesame_plan::{Bound, CampaignPlan, Metric, MetricId, MetricSource, Span};
use sesame_present::axis::Axis;
use sesame_present::markup::{Markup, coordinate, percent};
use sesame_present::number;
use sesame_record::{MetricValue, TestRecord};

use crate::facts::disturbances::{choices_text, planned_text, spans_text};
use crate::facts::show::{OperationReport, TestReport, decided_at, violated_when};
use crate::facts::wording::value_of;
use crate::html::certificate;
use crate::sentences::effect_text;

/// Height of a lane of an operation, in pixels.
const LANE: f64 = 30.0;

/// Height of a metric's row, in pixels.
const SERIES: f64 = 76.0;

/// Space above and below a metric's line in its row, in pixels.
const MARGIN: f64 = 15.0;

/// Change points drawn per row: four for each of so many columns at most.
const COLUMNS: f64 = 400.0;

/// Draws a test over time.
pub(crate) fn timeline(markup: &mut Markup, plan: &CampaignPlan, record: &TestRecord, report: &TestReport) {
    let end = record.observation.end;
    let time = Axis::exact(0.0, plan.campaign.end_after.max(end), 8);
    let broke_off = !record.observation.outcome.is_whole();
    let broke_off = broke_off.then_some(end);
    let label = format!("{} over time", report.test);
    let until = coordinate(time.high);
    markup.open("figure", &[("class", "timeline"), ("aria-label", &label), ("data-end", &until)]);
    lanes(markup, &time, &report.operations, broke_off);
    certificate::lanes(markup, &time, &report.monitors, (end, broke_off));
    for id in shown_metrics(plan, record) {
        series(markup, plan, &time, id, &record.observation.metrics[id.index()], (end, broke_off));
    }
    time_axis(markup, &time);
    if let Some(at) = broke_off {
        let words = format!("Broke off at {}: {}.", number::quantity(at, Some("s")), report.outcome);
        markup.element("p", &[("class", "quiet")], &words);
    }
    markup.close();
}

/// The numbers of the time axis.
pub(super) fn time_axis(markup: &mut Markup, time: &Axis) {
    row(markup, |markup| markup.element("span", &[("class", "quiet")], "simulation time"));
    markup.open("svg", &[("class", "plot"), ("height", "24"), ("aria-hidden", "true")]);
    let labels = time.labels();
    for (at, (tick, text)) in time.ticks.iter().zip(&labels).enumerate() {
        let text = if at + 1 == labels.len() { format!("{text} s") } else { text.clone() };
        // Every other one gives way on a narrow screen.
        let class = if at % 2 == 0 { "tick middle" } else { "tick middle wide" };
        markup.element("text", &[("class", class), ("x", &percent(time.share(*tick))), ("y", "14")], &text);
    }
    markup.close();
    markup.close();
}

/// Opens a row and writes its label; the caller adds the plot and closes the row.
pub(super) fn row(markup: &mut Markup, label: impl FnOnce(&mut Markup)) {
    markup.open("div", &[("class", "row")]);
    markup.open("div", &[("class", "label")]);
    label(markup);
    markup.close();
}

/// A lane for each operation; those without effect are folded away if there are others.
fn lanes(markup: &mut Markup, time: &Axis, operations: &[OperationReport], broke_off: Option<f64>) {
    let idle = |operation: &&OperationReport| operation.counters.is_some_and(|counters| !counters.any_effect());
    let (without, with): (Vec<&OperationReport>, Vec<&OperationReport>) = operations.iter().partition(idle);
    for operation in if with.is_empty() { &without } else { &with } {
        lane(markup, time, operation, broke_off);
    }
    if !with.is_empty() && !without.is_empty() {
        let names: Vec<&str> = without.iter().map(|operation| operation.operation.as_str()).collect();
        markup.open("details", &[("class", "idle")]);
        markup.element("summary", &[], &format!("without effect: {}", names.join(", ")));
        for operation in without {
            lane(markup, time, operation, broke_off);
        }
        markup.close();
    }
}

fn lane(markup: &mut Markup, time: &Axis, operation: &OperationReport, broke_off: Option<f64>) {
    let effect = operation.counters.map(|counters| counters.any_effect());
    row(markup, |markup| {
        markup.element("b", &[], &operation.operation);
        let choices = if operation.choices.is_empty() { operation.kind.clone() } else { choices_text(operation) };
        markup.element("span", &[("class", "quiet")], &choices);
        if effect == Some(false) {
            markup.element("span", &[("class", "note")], "no effect");
        }
    });
    let observed = operation.observed.as_deref().unwrap_or_default();
    let said = match &operation.observed {
        Some(spans) => format!("active {}", spans_text(spans)),
        None => "activity unknown".to_owned(),
    };
    let title =
        format!("{}: planned {}, {said}; {}", operation.operation, planned_text(operation), effect_text(operation));
    let height = coordinate(LANE);
    markup.open("svg", &[("class", "plot"), ("height", &height), ("role", "img"), ("aria-label", &title)]);
    backdrop(markup, time, broke_off);
    let mut window = |span: Span, class: &str, inset: f64| {
        let x = percent(time.share(span.start));
        let width = percent((time.share(span.end) - time.share(span.start)).max(0.0001));
        let (y, height) = (coordinate(inset), coordinate(LANE - 2.0 * inset));
        let attributes = [("class", class), ("x", &x), ("y", &y), ("width", &width), ("height", &height), ("rx", "2")];
        markup.open("rect", &attributes);
        markup.element("title", &[], &title);
        markup.close();
    };
    // Where conditions decide, what was seen is what was planned.
    for &span in operation.planned.as_ref().map_or(observed, std::slice::from_ref) {
        window(span, "planned", 5.0);
    }
    for &span in observed {
        window(span, if effect == Some(false) { "seen idle" } else { "seen" }, 9.0);
    }
    markup.close();
    // Below the lane, where long conditions have room.
    if operation.conditions.is_some() {
        markup.element("div", &[("class", "quiet when")], &planned_text(operation));
    }
    markup.close();
}

/// Metrics with something to draw: those that a requirement bounds, then the objectives, then the rest.
fn shown_metrics(plan: &CampaignPlan, record: &TestRecord) -> Vec<MetricId> {
    let bounded = plan.requirements.iter().map(|requirement| requirement.metric);
    let objectives = plan.campaign.objectives.iter().copied();
    let all = (0..).map(MetricId).take(plan.metrics.len());
    let mut order: Vec<MetricId> = Vec::new();
    for id in bounded.chain(objectives).chain(all) {
        // The time spent fuzzing is what the lanes above show.
        let drawn = !matches!(plan.metric(id).source, MetricSource::FuzzingTime)
            && record.observation.metrics.get(id.index()).is_some_and(|shown| {
                let line = Line::of(plan.metric(id), shown, 0.0);
                !line.points.is_empty() || (record.observation.outcome.is_whole() && violates_unset(plan, id, shown))
            });
        if drawn && !order.contains(&id) {
            order.push(id);
        }
    }
    order
}

/// Whether a metric was never set, and a requirement is violated by its default.
fn violates_unset(plan: &CampaignPlan, id: MetricId, shown: &MetricObservation) -> bool {
    let mut bounds = plan.requirements.iter().filter(|requirement| requirement.metric == id);
    !shown.set && shown.value.is_some_and(|value| bounds.any(|requirement| !requirement.bound.holds(value)))
}

/// What is drawn of a metric: its change points, and when the last one no longer holds.
struct Line<'a> {
    points: &'a [(f64, f64)],
    end: f64,
}

impl<'a> Line<'a> {
    /// The series of a metric up to the end of the run, or the signal of a robustness.
    fn of(metric: &Metric, shown: &'a MetricObservation, end: f64) -> Line<'a> {
        match (&metric.source, shown.robustness.split_last()) {
            (MetricSource::Robustness { .. }, Some((last, points))) => Line { points, end: last.0 },
            (MetricSource::Robustness { .. }, None) => Line { points: &[], end },
            _ => Line { points: &shown.series, end },
        }
    }
}

fn series(
    markup: &mut Markup,
    plan: &CampaignPlan,
    time: &Axis,
    id: MetricId,
    shown: &MetricObservation,
    (end, broke_off): (f64, Option<f64>),
) {
    let metric = plan.metric(id);
    let of_run = end;
    let Line { points, end } = Line::of(metric, shown, end);
    let unit = metric.unit.as_deref();
    let bounds: Vec<(&str, Bound)> = plan
        .requirements
        .iter()
        .filter(|requirement| requirement.metric == id)
        .map(|requirement| (requirement.name.as_str(), requirement.bound))
        .collect();
    let lines: Vec<f64> = bounds
        .iter()
        .flat_map(|&(_, bound)| {
            let (low, _, high, _) = ends(bound);
            if low == high { [low, None] } else { [low, high] }
        })
        .flatten()
        .collect();
    let points = match shown.value {
        // What is drawn although it was never set is a default that violates a requirement, from beginning to end.
        Some(default) if points.is_empty() => vec![(0.0, default)],
        _ => thin(points, end),
    };
    let values = || points.iter().map(|point| point.1).chain(lines.iter().copied());
    let extent = Axis::exact(values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max), 2);
    // The default holds until the first change; one far away (999 s for "never") would flatten all else.
    let robust = matches!(metric.source, MetricSource::Robustness { .. });
    let default = metric.default.filter(|_| shown.set && !robust);
    let default = default.filter(|&default| (-1.0..=2.0).contains(&extent.share(default)));
    let reach = extent.high.max(default.unwrap_or(extent.high));
    let extent = Axis::exact(extent.low.min(default.unwrap_or(extent.low)), reach, 2);
    let height = |value: f64| MARGIN + (1.0 - extent.share(value)) * (SERIES - 2.0 * MARGIN);

    row(markup, |markup| {
        markup.element("b", &[], &metric.name);
        let mut value = value_of(plan, id, MetricValue::whole(shown.value, shown.set), &[]);
        if let Some(at) = decided_at(metric, shown) {
            let _ = write!(value, " at {at:.2} s");
        }
        markup.element("span", &[("class", "quiet")], &value);
        // Beside the plot, where it covers no line.
        for &(name, bound) in &bounds {
            let words = format!("{name} {}", number::bound(bound, unit));
            markup.element("span", &[("class", "bound-name")], &words);
        }
    });
    let broken: Vec<Span> = bounds.iter().flat_map(|&(_, bound)| violated_when(metric, shown, bound, of_run)).collect();
    let mut title =
        format!("{} from {} to {}", metric.name, number::number(extent.low), number::quantity(extent.high, unit));
    if !broken.is_empty() {
        let _ = write!(title, "; outside its bound {}", spans_text(&broken));
    }
    let tall = coordinate(SERIES);
    let ends = [extent.low, extent.high].map(|end| end.to_string());
    let told = [("data-metric", metric.name.as_str()), ("data-low", &ends[0]), ("data-high", &ends[1])];
    let told_unit = [("data-unit", unit.unwrap_or_default())];
    let attributes = [("class", "plot"), ("height", tall.as_str()), ("role", "img"), ("aria-label", &title)];
    markup.open("svg", &[&attributes[..], &told[..], &told_unit[..]].concat());
    backdrop(markup, time, broke_off);
    for span in &broken {
        let (x, width) = (percent(time.share(span.start)), percent(time.share(span.end) - time.share(span.start)));
        markup.leaf("rect", &[("class", "outside"), ("x", &x), ("y", "0"), ("width", &width), ("height", &tall)]);
    }
    for &at in &lines {
        let y = coordinate(height(at));
        markup.leaf("line", &[("class", "bound"), ("x1", "0"), ("x2", "100%"), ("y1", &y), ("y2", &y)]);
    }
    let viewport = format!("0 0 {} {tall}", coordinate(time.high));
    let frame =
        [("viewBox", viewport.as_str()), ("height", &tall), ("preserveAspectRatio", "none"), ("aria-hidden", "true")];
    markup.open("svg", &frame);
    if let Some(default) = default {
        let y = coordinate(height(default));
        let path = format!("M0 {y}H{}V{}", coordinate(points[0].0), coordinate(height(points[0].1)));
        markup.leaf("path", &[("class", "line default"), ("d", &path)]);
    }
    markup.leaf("path", &[("class", "line"), ("d", &step_path(&points, end, height, |_| true))]);
    // Single times decide a series; what they mean for a robustness depends on its formula.
    let within = |time: f64| broken.iter().any(|span| (span.start..span.end).contains(&time));
    let beyond = |value: f64| bounds.iter().any(|(_, bound)| !bound.holds(value));
    let is_bad = |(time, value): (f64, f64)| if robust && shown.set { within(time) } else { beyond(value) };
    let bad = step_path(&points, end, height, is_bad);
    if !bad.is_empty() {
        markup.leaf("path", &[("class", "line bad"), ("d", &bad)]);
    }
    markup.close();
    // A value set at the very end has no line, only a place.
    if let Some(&(at, value)) = points.last()
        && at >= end
        && !(robust && points.len() > 1)
    {
        let bad = if robust { !broken.is_empty() } else { beyond(value) };
        let (x, y) = (percent(time.share(at)), coordinate(height(value)));
        let class = if bad { "at-end bad" } else { "at-end" };
        markup.leaf("circle", &[("class", class), ("cx", &x), ("cy", &y), ("r", "3")]);
    }
    let decimals = number::decimals([extent.low, extent.high]);
    for value in [extent.high, extent.low] {
        let y = coordinate(height(value));
        markup.element(
            "text",
            &[("class", "tick end"), ("x", "-8"), ("y", &y), ("dy", "4")],
            &number::fixed(value, decimals),
        );
    }
    markup.close();
    markup.close();
}

/// The time axis's lines, and what lies behind the end of a run that broke off.
pub(super) fn backdrop(markup: &mut Markup, time: &Axis, broke_off: Option<f64>) {
    for tick in &time.ticks {
        let x = percent(time.share(*tick));
        markup.leaf("line", &[("class", "grid"), ("x1", &x), ("x2", &x), ("y1", "0"), ("y2", "100%")]);
    }
    if let Some(at) = broke_off {
        let (x, width) = (percent(time.share(at)), percent(1.0 - time.share(at)));
        markup.leaf("rect", &[("class", "after"), ("x", &x), ("y", "0"), ("width", &width), ("height", "100%")]);
        markup.leaf("line", &[("class", "ended"), ("x1", &x), ("x2", &x), ("y1", "0"), ("y2", "100%")]);
    }
}

/// A line that holds each value until the next change, where the value is to be drawn.
fn step_path(
    points: &[(f64, f64)],
    end: f64,
    height: impl Fn(f64) -> f64,
    drawn: impl Fn((f64, f64)) -> bool,
) -> String {
    let mut path = String::new();
    let mut going = false;
    for (at, &(time, value)) in points.iter().enumerate() {
        let until = points.get(at + 1).map_or(end, |next| next.0).min(end);
        if !drawn((time, value)) || time >= end {
            going = false;
            continue;
        }
        let (y, until) = (coordinate(height(value)), coordinate(until));
        if going {
            let _ = write!(path, "V{y}H{until}");
        } else {
            let _ = write!(path, "M{} {y}H{until}", coordinate(time));
        }
        going = true;
    }
    path
}

/// The change points that make a difference to the eye: in each narrow column the first, the last, the least and the
/// largest.
fn thin(series: &[(f64, f64)], end: f64) -> Vec<(f64, f64)> {
    let width = (end / COLUMNS).max(f64::MIN_POSITIVE);
    let column = |point: &(f64, f64)| libm::floor(point.0 / width);
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for group in series.chunk_by(|a, b| column(a) == column(b)) {
        let extreme = |ordering: fn(&f64, &f64) -> std::cmp::Ordering| {
            (0..group.len()).max_by(|&a, &b| ordering(&group[a].1, &group[b].1).then(b.cmp(&a))).unwrap_or(0)
        };
        let mut chosen = vec![0, group.len() - 1, extreme(f64::total_cmp), extreme(|a, b| b.total_cmp(a))];
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|at| group[at]));
    }
    kept
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_base::observation::Counters;
    use sesame_plan::Task;

    use sesame_base::observation::Outcome;
    use sesame_record::{Origin, sample};

    use super::*;
    use crate::facts::show::report_on;

    #[test]
    fn a_line_holds_its_value_until_the_next_change() {
        let points = [(1.0, 2.0), (3.0, 0.0), (4.0, 5.0), (5.0, 6.0)];
        assert_eq!(step_path(&points, 7.0, |value| value, |_| true), "M1 2H3V0H4V5H5V6H7");
        assert_eq!(step_path(&points, 7.0, |value| value, |(_, value)| value > 1.0), "M1 2H3M4 5H5V6H7");
        assert_eq!(step_path(&points, 4.5, |value| value, |_| true), "M1 2H3V0H4V5H4.5");
    }

    #[test]
    fn planned_and_observed_windows_and_violations_are_drawn() {
        let plan = sample::plan();
        let mut record = sample::record(&plan, 1, Origin::Search, plan.tests[0].test.clone());
        record.observation.operations[0].intervals[0].end = 40.0;
        record.observation.outcome = Outcome::Crash { message: "gone".to_owned() };
        record.observation.end = 60.0;
        record.observation.metrics.iter_mut().for_each(|metric| metric.series.truncate(3));
        let mut markup = Markup::default();
        timeline(&mut markup, &plan, &record, &report_on(&plan, &Task::Campaign, &record, &[], true));
        insta::assert_snapshot!("timeline", markup.finish().replace("><", ">\n<"));
    }

    #[test]
    fn where_conditions_decide_what_was_seen_is_what_was_planned() {
        let plan = sample::plan();
        let record = sample::record(&plan, 1, Origin::Search, sample::conditional_test());
        let mut markup = Markup::default();
        let report = report_on(&plan, &Task::Campaign, &record, &[], true);
        timeline(&mut markup, &plan, &record, &report);
        let drawn = markup.finish();
        assert_eq!(drawn.matches(r#"class="planned""#).count(), 3, "{drawn}");
        assert!(drawn.contains("planned when 1.5m/s &lt; top_speed for 0.3s at most 3 times"), "{drawn}");
        assert!(
            drawn.contains(r#"quiet when">when 1.5m/s &lt; top_speed for 0.3s at most 3 times"#),
            "beside the lane: {drawn}"
        );
    }

    #[test]
    fn a_default_that_violates_a_requirement_is_red_all_along() {
        let plan = sample::plan();
        let mut record = sample::record(&plan, 1, Origin::Search, plan.tests[0].test.clone());
        record.observation.metrics[3] = MetricObservation::whole(Some(999.0), false, vec![]);
        let drawn = |record: &TestRecord| {
            let mut markup = Markup::default();
            timeline(&mut markup, &plan, record, &report_on(&plan, &Task::Campaign, record, &[], true));
            let drawn = markup.finish();
            drawn.split("<b>cycle_time</b>").nth(1).map(str::to_owned)
        };
        let row = drawn(&record).unwrap();
        assert!(row.contains("999 s (never set)") && row.contains("R4 ≤ 70 s"), "{row}");
        assert!(row.contains("class=\"line bad\" d=\"M0 15H70\""), "{row}");
        record.observation.outcome = Outcome::Crash { message: "gone".to_owned() };
        assert_eq!(drawn(&record), None, "it might have been set later");
    }

    #[test]
    fn lanes_without_effect_are_folded_away_beside_others() {
        let plan = sample::plan();
        let mut record = sample::record(&plan, 1, Origin::Search, sample::conditional_test());
        let drawn = |record: &TestRecord| {
            let mut markup = Markup::default();
            timeline(&mut markup, &plan, record, &report_on(&plan, &Task::Campaign, record, &[], true));
            markup.finish()
        };
        assert!(!drawn(&record).contains("<details"));
        let idle = Counters { seen: 7, ..Counters::default() };
        record.observation.operations[0].counters = idle;
        let (before, folded) =
            drawn(&record).split_once("<details class=\"idle\">").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
        assert!(folded.starts_with("<summary>without effect: jitter_link0</summary>"), "{folded}");
        assert!(!before.contains("<b>jitter_link0</b>") && before.contains("<b>cut_link1</b>"));
        // Where none had an effect, that is what there is to see.
        record.observation.operations.iter_mut().for_each(|operation| operation.counters = idle);
        assert!(!drawn(&record).contains("<details"));
    }

    proptest! {
        #[test]
        fn thinning_keeps_ends_and_extremes(
            steps in prop::collection::vec((1u32..40, -1000i32..1000), 1..3000),
        ) {
            let mut time = 0;
            let series: Vec<(f64, f64)> = steps.iter().map(|&(step, value)| {
                time += step;
                (f64::from(time) / 1000.0, f64::from(value))
            }).collect();
            let end = series[series.len() - 1].0 + 0.001;
            let kept = thin(&series, end);
            prop_assert!(kept.len() <= 1604);
            prop_assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
            prop_assert!(kept.iter().all(|point| series.contains(point)));
            prop_assert_eq!((kept[0], kept[kept.len() - 1]), (series[0], series[series.len() - 1]));
            let most = |points: &[(f64, f64)]| points.iter().map(|point| point.1).fold(f64::NEG_INFINITY, f64::max);
            let least = |points: &[(f64, f64)]| points.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
            prop_assert_eq!((most(&kept), least(&kept)), (most(&series), least(&series)));
        }
    }
}
