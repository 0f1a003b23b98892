//! What compensates for a reality gap, in words, and the gap before and after.

use sesame_gap::equivalence::Verdict;
use sesame_gap::samples::{Samples, moments};
use sesame_plan::{CampaignPlan, Compensation, Fit, Fitted, Type, Values, value_path_in_words};
use sesame_present::number::quantity;
use sesame_present::table::Table;

use crate::Datum;
use crate::gap::{Gap, MetricGap};

/// Something that is fitted, as the space says it: `relay delay`, `relay bias on link0`, `parameter "servo_gain"`.
pub fn fitted(plan: &CampaignPlan, what: &Fitted) -> String {
    let on = |values: &Values| {
        let topic = &plan.topic(values.topic).name;
        match values.places.as_slice() {
            [] => topic.clone(),
            places => {
                let places = places.iter().map(|place| format!("{topic}{}", value_path_in_words(place)));
                places.collect::<Vec<_>>().join(", ")
            }
        }
    };
    match what {
        Fitted::Delay { topic: None } => "relay delay".to_owned(),
        Fitted::Delay { topic: Some(topic) } => format!("relay delay on {}", plan.topic(*topic).name),
        Fitted::Scale(values) => format!("relay scale on {}", on(values)),
        Fitted::Bias(values) => format!("relay bias on {}", on(values)),
        Fitted::Noise(values) => format!("relay noise on {}", on(values)),
        Fitted::Parameter { name } => format!("parameter \"{name}\""),
    }
}

/// The unit of what is fitted, if it has one.
pub fn unit(plan: &CampaignPlan, what: &Fitted) -> Option<String> {
    let of_message = |values: &Values| match &plan.topic(values.topic).ty {
        Type::Int { unit } | Type::Real { unit } | Type::Point { unit } => unit.clone(),
        // Inside messages units differ from field to field; what is fitted is in that of its field.
        Type::Bool | Type::Text | Type::List { .. } | Type::Message { .. } => None,
    };
    match what {
        Fitted::Delay { .. } => Some("s".to_owned()),
        Fitted::Bias(values) | Fitted::Noise(values) => of_message(values),
        Fitted::Scale(_) | Fitted::Parameter { .. } => None,
    }
}

/// Levels in words: one value, or from the least to the greatest.
pub fn levels(plan: &CampaignPlan, what: &Fitted, levels: &[f64]) -> String {
    let unit = unit(plan, what);
    let low = levels.iter().copied().fold(f64::INFINITY, f64::min);
    let high = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = (quantity(low, None), quantity(high, unit.as_deref()));
    if levels.len() < 2 { high } else { format!("{low} to {high}") }
}

/// All that a compensation sets, in one line.
pub fn in_words(plan: &CampaignPlan, compensation: &Compensation) -> String {
    let adjustments = compensation.adjustments.iter();
    let all: Vec<String> = adjustments
        .map(|adjustment| {
            format!("{} {}", fitted(plan, &adjustment.what), levels(plan, &adjustment.what, &adjustment.levels))
        })
        .collect();
    format!("for lab {}: {}", compensation.lab, all.join(", "))
}

/// What was fitted within which range, the value that was found, and what is to be said of it.
pub fn values(plan: &CampaignPlan, fits: &[Fit], compensation: &Compensation) -> Table {
    let mut table = Table::new(["fitted", "permitted", "value", "remark"].map(str::to_owned));
    for fit in fits {
        let Some(adjustment) = compensation.adjustments.iter().find(|adjustment| adjustment.what == fit.what) else {
            continue;
        };
        let width = fit.high - fit.low;
        let near = |end: f64| width > 0.0 && adjustment.levels.iter().any(|level| (level - end).abs() <= width / 100.0);
        // Without delay and without noise the simulation is as it was, and less is not possible.
        let least = fit.what.is_not_negative() && fit.low == 0.0;
        let remark = match () {
            () if near(fit.high) => Some("at the end of its range: the true value may be beyond"),
            () if near(fit.low) && !least => Some("at the beginning of its range: the true value may be before"),
            () => None,
        };
        table.row([
            Datum::Text(fitted(plan, &fit.what)),
            Datum::Text(levels(plan, &fit.what, &[fit.low, fit.high])),
            Datum::Text(levels(plan, &fit.what, &adjustment.levels)),
            Datum::maybe(remark.map(str::to_owned)),
        ]);
    }
    table
}

/// The reality gap before and after a compensation, per metric: the mean size of the differences over the tests that
/// both have, and how many tests differ.
pub fn before_and_after(plan: &CampaignPlan, before: &Gap, after: &Gap) -> Table {
    let columns =
        ["metric", "unit", "tests", "difference_before", "difference_after", "different_before", "different_after"];
    let mut table = Table::new(columns.map(str::to_owned));
    for was in &before.metrics {
        let Some(is) = after.metrics.iter().find(|is| is.metric == was.metric) else { continue };
        let shared = |gap: &MetricGap| -> (Vec<f64>, usize) {
            let other = if std::ptr::eq(gap, was) { is } else { was };
            let tests = gap.tests.iter().filter(|test| other.tests.iter().any(|compared| compared.test == test.test));
            let (mut sizes, mut different) = (Vec::new(), 0);
            for test in tests {
                if let Ok([simulation, lab]) = moments(Samples::new(&test.simulation, &test.lab)) {
                    sizes.push((lab.mean - simulation.mean).abs());
                }
                different += usize::from(test.equivalence.verdict == Verdict::Different);
            }
            (sizes, different)
        };
        let mean = |sizes: &[f64]| (!sizes.is_empty()).then(|| sizes.iter().sum::<f64>() / sizes.len() as f64);
        let ((before, different_before), (after, different_after)) = (shared(was), shared(is));
        let metric = plan.metric(was.metric);
        table.row([
            Datum::text(&metric.name),
            Datum::maybe(metric.unit.clone()),
            Datum::count(before.len()),
            Datum::real(mean(&before)),
            Datum::real(mean(&after)),
            Datum::count(different_before),
            Datum::count(different_after),
        ]);
    }
    table
}
