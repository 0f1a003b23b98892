//! How far gaps extend, as a table: of metrics, and of signals in traces.

use sesame_base::test_number::TestNumber;
use sesame_gap::localise::Extent;
use sesame_gap::pooled::Pooled;
use sesame_gap::split::Split;
use sesame_plan::{CampaignPlan, Dimension};
use sesame_present::table::Table;

use crate::Datum;
use crate::gap::Gap;
use crate::traces::{SignalGap, TraceGap};

/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A row per metric, per signal's lag and per signal's level: how far its gap extends (`none`, `systematic`, `range`,
/// `tests`, `scattered` or `undecided`), the common difference with its interval of 95 % (inside the range, or in the
/// tests that agree with each other), and the range or the tests that are unlike the others.
pub fn extents(plan: &CampaignPlan, gap: &Gap, traces: Option<&TraceGap>) -> Table {
    let columns = [
        "of",
        "quantity",
        "unit",
        "tests",
        "extent",
        "difference",
        "interval_low",
        "interval_high",
        "dimension",
        "from",
        "to",
        "unlike",
    ];
    let mut table = Table::new(columns.map(str::to_owned));
    for metric in &gap.metrics {
        let declared = plan.metric(metric.metric);
        let subject = Subject { of: &declared.name, quantity: "metric", unit: declared.unit.as_deref() };
        // A metric without chance has no standard error, and is told apart.
        let extent = match metric.without_spread() {
            Some(ends) => Told::Constant(ends),
            None => Told::Extent(&metric.extent),
        };
        row(&mut table, &subject, &extent, &metric.located, &gap.dimensions);
    }
    for SignalGap { signal, lag, level } in traces.iter().flat_map(|traces| &traces.signals) {
        let dimensions = &gap.dimensions;
        let subject = Subject { of: signal, quantity: "lag", unit: Some("s") };
        row(&mut table, &subject, &Told::Extent(&lag.extent), &lag.tests, dimensions);
        let subject = Subject { of: signal, quantity: "level", unit: None };
        row(&mut table, &subject, &Told::Extent(&level.extent), &level.tests, dimensions);
    }
    table
}

/// What a row is about.
struct Subject<'a> {
    of: &'a str,
    quantity: &'a str,
    unit: Option<&'a str>,
}

/// What is known of a gap.
enum Told<'a> {
    Extent(&'a Extent),
    /// The smallest and the largest difference, where nothing varies from run to run.
    Constant([f64; 2]),
}

fn row(table: &mut Table, subject: &Subject<'_>, told: &Told<'_>, tests: &[u32], dimensions: &[Dimension]) {
    let name = |at: &usize| TestNumber(tests[*at]).to_string();
    let mut unlike = None;
    let mut range = (None, None, None);
    let (word, pooled): (&str, Option<&Pooled>) = match told {
        Told::Constant([low, high]) if *low == 0.0 && *high == 0.0 => ("none", None),
        Told::Constant(_) => ("systematic", None),
        Told::Extent(extent) => match extent {
            Extent::None => ("none", None),
            Extent::Systematic { pooled, .. } => ("systematic", Some(pooled)),
            Extent::Range { split: Split { range: found, .. }, inside, .. } => {
                range = (Some(dimensions[found.dimension].name()), found.low, found.high);
                ("range", Some(inside))
            }
            Extent::Tests { tests, others } => {
                unlike = Some(tests.iter().map(name).collect::<Vec<_>>().join(" "));
                ("tests", Some(others))
            }
            Extent::Scattered(_) => ("scattered", None),
            Extent::Undecided(_) => ("undecided", None),
        },
    };
    let interval = pooled.map(|pooled| pooled.interval(CONFIDENCE));
    let (estimate, interval) = match told {
        Told::Constant([low, high]) => (Some(f64::midpoint(*low, *high)), Some([*low, *high])),
        Told::Extent(_) => (pooled.map(|pooled| pooled.estimate), interval),
    };
    let (dimension, from, to) = range;
    table.row([
        Datum::text(subject.of),
        Datum::text(subject.quantity),
        Datum::maybe(subject.unit.map(str::to_owned)),
        Datum::count(tests.len()),
        Datum::text(word),
        Datum::lone(estimate),
        Datum::lone(interval.map(|[low, _]| low)),
        Datum::lone(interval.map(|[_, high]| high)),
        Datum::maybe(dimension.map(str::to_owned)),
        Datum::lone(from),
        Datum::lone(to),
        Datum::maybe(unlike),
    ]);
}
