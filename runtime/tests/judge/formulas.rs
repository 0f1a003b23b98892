//! The value of each metric, from the complete lists of messages of a run, by the words of the documentation.

use sesame_plan::stl::Robustness;
use sesame_plan::{Aggregate, CampaignPlan, Condition, Expression, FieldRef, Formula, Metric, MetricSource, Side};

use crate::computations::{Computed, Hearing, Units, When, computations, key, member, number};
use crate::hooks::HookKind;
use crate::ledger::{Ledger, Message};
use crate::robot::number_of;
use crate::temporal;

/// What the messages of a run make of a metric, which is not of the time that operations are active.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Judged {
    /// It heard what is not finite: its value is open.
    Open,
    /// It was never set.
    Unset,
    Value(f64),
}

/// The value of a metric at the end of a run.
pub(crate) fn judged(plan: &CampaignPlan, metric: &Metric, ledger: &Ledger) -> Judged {
    let messages = heard(metric, ledger);
    if first_blank(plan, metric, ledger).is_some() {
        return Judged::Open;
    }
    let value = match &metric.source {
        MetricSource::FuzzingTime | MetricSource::Monitor { .. } => unreachable!("no message makes it"),
        MetricSource::Last { input } => {
            let on = |message: &&Message| member(plan, input.topic, &message.path).is_some();
            messages.iter().rfind(on).and_then(|message| number(&message.value, &input.path))
        }
        MetricSource::Hook { topics } => {
            let on = |message: &&Message| topics.iter().any(|&topic| member(plan, topic, &message.path).is_some());
            let numbers: Vec<f64> = messages.iter().filter(on).map(|message| number_of(&message.value)).collect();
            match HookKind::named(&metric.name) {
                HookKind::Counting => {
                    let count = numbers.iter().filter(|&&number| number > 1.0).count();
                    (count > 0).then_some(count as f64)
                }
                HookKind::Least => numbers.into_iter().reduce(f64::min),
                HookKind::Latest => numbers.last().copied(),
            }
        }
        MetricSource::Formula { formula } => of_formula(plan, formula, messages, ledger),
        MetricSource::Robustness { robustness } => of_robustness(plan, robustness, messages, ledger),
    };
    value.map_or(Judged::Unset, Judged::Value)
}

/// Whether a metric hears messages as they are delivered.
pub(crate) fn hears_deliveries(metric: &Metric) -> bool {
    let side = match &metric.source {
        MetricSource::Formula { formula } => formula.side,
        MetricSource::Robustness { robustness } => robustness.side,
        _ => Side::Inbound,
    };
    side == Side::Outbound
}

/// The messages that a metric hears, those of other topics among them.
pub(crate) fn heard<'a>(metric: &Metric, ledger: &'a Ledger) -> &'a [Message] {
    if hears_deliveries(metric) { &ledger.delivered } else { &ledger.published }
}

/// When a metric first heard what is not finite, in nanoseconds.
pub(crate) fn first_blank(plan: &CampaignPlan, metric: &Metric, ledger: &Ledger) -> Option<i64> {
    let fields: Vec<FieldRef> = match &metric.source {
        MetricSource::FuzzingTime | MetricSource::Monitor { .. } => Vec::new(),
        MetricSource::Last { input } => vec![input.clone()],
        MetricSource::Hook { topics } => {
            let blank = |message: &&Message| {
                topics.iter().any(|&topic| member(plan, topic, &message.path).is_some())
                    && !number_of(&message.value).is_finite()
            };
            return ledger.published.iter().find(blank).map(|message| message.time);
        }
        MetricSource::Formula { formula } => formula.inputs.iter().map(|input| input.field.clone()).collect(),
        MetricSource::Robustness { robustness } => robustness.inputs.iter().map(|input| input.field.clone()).collect(),
    };
    let blank = |message: &&Message| {
        fields.iter().any(|field| {
            member(plan, field.topic, &message.path).is_some()
                && number(&message.value, &field.path).is_some_and(|number| !number.is_finite())
        })
    };
    heard(metric, ledger).iter().find(blank).map(|message| message.time)
}

fn of_formula(plan: &CampaignPlan, formula: &Formula, messages: &[Message], ledger: &Ledger) -> Option<f64> {
    let (inputs, when, steps) = (&formula.inputs[..], When::of(plan, formula), ledger.steps);
    let of_key = |key: Option<(&FieldRef, &str)>| computations(&Hearing { plan, inputs, messages, key, when, steps });
    let streams: Vec<Vec<Computed>> = match &formula.per {
        None => vec![of_key(None)],
        Some(per) => {
            let mut keys: Vec<String> = messages.iter().filter_map(|message| key(plan, per, message)).collect();
            keys.sort_unstable();
            keys.dedup();
            keys.iter().map(|key| of_key(Some((per, key.as_str())))).collect()
        }
    };
    let units = Units::of(plan, inputs);
    let values = streams.iter().filter_map(|stream| aggregated(formula, &units, stream, ledger.end));
    match formula.aggregate {
        // Durations are here in whole nanoseconds.
        Aggregate::Duration { .. } => values.reduce(|a, b| a + b).map(|nanos| nanos / 1e9),
        Aggregate::Count { .. } => values.reduce(|a, b| a + b),
        Aggregate::Max { .. } => values.reduce(f64::max),
        Aggregate::Last { .. } | Aggregate::Min { .. } | Aggregate::Mean { .. } => values.reduce(f64::min),
    }
}

/// The value of the computations for one key, or of all of them.
fn aggregated(formula: &Formula, units: &Units, stream: &[Computed], end: i64) -> Option<f64> {
    stream.first()?;
    let counts = |at: &Computed| formula.when.as_ref().is_none_or(|when| holds(when, at));
    match &formula.aggregate {
        Aggregate::Count { of } => Some(limited(formula, stream, |at| counts(at) && holds(of, at)).len() as f64),
        // What holds of one member says nothing about another.
        Aggregate::Duration { of } => {
            let mut sum = 0;
            for unit in 0..units.count() {
                let own: Vec<&Computed> = stream.iter().filter(|at| at.of == unit).collect();
                for (at, computed) in own.iter().enumerate() {
                    let next = own.get(at + 1).map_or(end, |next| next.time);
                    sum += if counts(computed) && holds(of, computed) { next - computed.time } else { 0 };
                }
            }
            Some(sum as f64)
        }
        Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
            let counted = limited(formula, stream, counts);
            let all: Vec<(usize, f64)> = counted.iter().map(|at| (at.of, value(of, at))).collect();
            let summary = |values: Vec<f64>| match formula.aggregate {
                Aggregate::Last { .. } => values.last().copied(),
                Aggregate::Min { .. } => values.into_iter().reduce(f64::min),
                Aggregate::Max { .. } => values.into_iter().reduce(f64::max),
                _ => (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64),
            };
            // Each pair has a value of its own, while members have one together.
            if !matches!(units, Units::Pairs(_)) {
                return summary(all.into_iter().map(|(_, value)| value).collect());
            }
            let of_pair = |pair| all.iter().filter(|(of, _)| *of == pair).map(|(_, value)| *value).collect();
            let each = (0..units.count()).filter_map(|pair| summary(of_pair(pair)));
            each.reduce(if matches!(formula.aggregate, Aggregate::Max { .. }) { f64::max } else { f64::min })
        }
    }
}

/// The computations that count: after one that does, the next one of the same member only once the time of `every` has
/// passed.
fn limited<'a>(formula: &Formula, stream: &'a [Computed], counts: impl Fn(&Computed) -> bool) -> Vec<&'a Computed> {
    let candidates = stream.iter().filter(|at| counts(at));
    let Some(every) = formula.every else { return candidates.collect() };
    let period = (every * 1e9).round() as i64;
    let mut counted: Vec<&Computed> = Vec::new();
    for at in candidates {
        let before = counted.iter().rfind(|before| before.of == at.of);
        if before.is_none_or(|before| at.time - before.time >= period) {
            counted.push(at);
        }
    }
    counted
}

fn of_robustness(plan: &CampaignPlan, of: &Robustness, messages: &[Message], ledger: &Ledger) -> Option<f64> {
    let (inputs, when, steps) = (&of.inputs[..], When::of_robustness(of), ledger.steps);
    let all = computations(&Hearing { plan, inputs, messages, key: None, when, steps });
    let of_unit = |unit: usize| {
        let own = all.iter().filter(|at| at.of == unit);
        let signals = |at: &Computed| of.signals.iter().map(|signal| value(signal, at)).collect();
        let samples: Vec<(i64, Vec<f64>)> = own.map(|at| (at.time, signals(at))).collect();
        temporal::robustness(&of.formula, &samples, ledger.end, crate::adapter::over_whole_windows(of))
    };
    let units = Units::of(plan, inputs).count();
    (0..units).filter_map(of_unit).reduce(f64::min).filter(|robustness| robustness.is_finite())
}

fn value(of: &Expression, at: &Computed) -> f64 {
    let all = |of: &[Expression]| of.iter().map(|part| value(part, at)).collect::<Vec<f64>>().into_iter();
    match of {
        Expression::Constant(value) => *value,
        Expression::Input(input) => at.values[*input as usize],
        // Stamps of a simulator inside are in simulation time.
        Expression::Time | Expression::Now => at.time as f64 / 1e9,
        Expression::Negate(of) => -value(of, at),
        Expression::Sum(of) => all(of).reduce(|a, b| a + b).unwrap(),
        Expression::Product(of) => all(of).reduce(|a, b| a * b).unwrap(),
        Expression::Absolute(of) => value(of, at).abs(),
        Expression::Min(of) => all(of).reduce(f64::min).unwrap(),
        Expression::Max(of) => all(of).reduce(f64::max).unwrap(),
        Expression::Divide { .. }
        | Expression::Scene { .. }
        | Expression::Integral(_)
        | Expression::Distance(_)
        | Expression::SignedDistance(_)
        | Expression::Unary { .. }
        | Expression::Binary { .. } => unreachable!("no case has these"),
    }
}

pub(crate) fn holds(of: &Condition, at: &Computed) -> bool {
    match of {
        Condition::Constant(value) => *value,
        Condition::Input(input) => at.values[*input as usize] != 0.0,
        Condition::Compare { left, by, right } => by.holds(value(left, at), value(right, at)),
        Condition::Same { left, right } => holds(left, at) == holds(right, at),
        Condition::All(of) => of.iter().all(|part| holds(part, at)),
        Condition::Any(of) => of.iter().any(|part| holds(part, at)),
        Condition::Not(of) => !holds(of, at),
    }
}
