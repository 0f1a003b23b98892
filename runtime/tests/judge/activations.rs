//! When operations are active, by the words of the documentation: from the values that metrics have had, message by
//! message.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::observation::Observation;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, Copies, MetricId, MetricSource};

use crate::case::{Case, topics_of, variables};
use crate::formulas::{Judged, first_blank, hears_deliveries, is_by_instant, judged};
use crate::ledger::Ledger;

/// Something that changes what a condition says: the values of all its variables from then on.
struct Change {
    time: i64,
    start: bool,
    end: bool,
}

/// Intervals that are not where the documentation has them. Conditions over what is computed once per instant, over
/// active time, and copies that wait for each other are left to other tests.
pub(crate) fn contradictions(case: &Case, observed: &Observation, ledger: &Ledger) -> Vec<String> {
    let mut wrong = Vec::new();
    for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
        let plain = |metric: &MetricId| {
            let metric = case.plan.metric(*metric);
            let mut topics = topics_of(metric);
            topics.sort_unstable();
            topics.dedup();
            let by_instant = match &metric.source {
                MetricSource::Formula { formula } => {
                    is_by_instant(&case.plan, &formula.inputs, Some(&formula.aggregate))
                }
                _ => topics.len() != 1,
            };
            // What one key has held is known only with its next message.
            let held = matches!(&metric.source, MetricSource::Formula { formula } if formula.per.is_some());
            let open = held || first_blank(&case.plan, metric, ledger).is_some();
            !by_instant && !open && !matches!(metric.source, MetricSource::Robustness { .. })
        };
        let copies = case.test.operations.iter().filter(|other| other.operation == used.operation).count();
        let apart = copies == 1 || case.plan.campaign.copies == Copies::MayOverlap;
        let within = case.plan.operation(used.operation).within;
        let window = (nanos(within.start), nanos(within.end));
        let expected = match &used.activation {
            Activation::Condition { .. } | Activation::ConditionFor { .. } => {
                if !apart || !variables(&used.activation).iter().all(plain) {
                    continue;
                }
                switched(case, &used.activation, window, ledger)
            }
            Activation::Time { start, end } => {
                let (start, end) = (nanos(*start).max(window.0), nanos(*end).min(window.1));
                if start < end { vec![(start, end)] } else { Vec::new() }
            }
            Activation::Offline => Vec::new(),
        };
        let expected: Vec<(i64, i64)> = expected
            .into_iter()
            .map(|(start, end)| (start, end.min(ledger.end)))
            .filter(|(start, end)| start < end)
            .collect();
        let seen: Vec<(i64, i64)> = effect.intervals.iter().map(|span| (nanos(span.start), nanos(span.end))).collect();
        if expected != seen {
            let name = &case.plan.operation(used.operation).name;
            wrong.push(format!("{name} was active in {seen:?}, and should have been in {expected:?} by {used:?}"));
        }
    }
    wrong
}

fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// Intervals by condition.
fn switched(case: &Case, activation: &Activation, window: (i64, i64), ledger: &Ledger) -> Vec<(i64, i64)> {
    let (start, end, length, most) = match activation {
        Activation::Condition { start, end, times } => (start, Some(end), None, *times),
        Activation::ConditionFor { start, length, times } => (start, None, Some(nanos(*length)), *times),
        Activation::Time { .. } | Activation::Offline => unreachable!("conditions switch it"),
    };
    let times_at_most = most as usize;
    let changes = changes(case, activation, start, end, ledger);
    // Conditions are looked at where the window begins, at each change, and once an instant is over.
    let mut times: BTreeSet<i64> = changes.iter().skip(1).flat_map(|change| [change.time, change.time + 1]).collect();
    times.insert(window.0);
    let mut intervals: Vec<(i64, i64)> = Vec::new();
    let mut on: Option<i64> = None;
    let mut switched = None;
    // Whether what begins an activation held, and whether it became true and nothing came of it yet.
    let (mut held, mut waits) = (false, false);
    while let Some(now) = times.pop_first() {
        let off_at = |since: i64| length.map_or(window.1, |length| (since + length).min(window.1));
        // At one instant time comes first, then messages in their order.
        if let Some(since) = on.filter(|&since| off_at(since) == now) {
            intervals.push((since, now));
            (on, switched) = (None, Some(now));
            times.insert(now + 1);
        }
        if now < window.0 || now >= window.1 {
            continue;
        }
        let before = changes.iter().rfind(|change| change.time < now);
        for look in before.into_iter().chain(changes.iter().filter(|change| change.time == now)) {
            let holds = look.start && !look.end;
            waits = on.is_none() && holds && (waits || !held);
            held = holds;
            if switched == Some(now) {
                continue;
            }
            if let Some(since) = on.filter(|_| look.end) {
                intervals.push((since, now));
                (on, switched) = (None, Some(now));
                times.insert(now + 1);
            } else if waits && intervals.len() < times_at_most {
                (on, switched, waits) = (Some(now), Some(now), false);
                times.extend([now + 1, off_at(now)]);
            }
        }
    }
    intervals
}

/// What start and end say: first before any message, then after each message that changes a variable.
fn changes(
    case: &Case,
    activation: &Activation,
    start: &Condition,
    end: Option<&Condition>,
    ledger: &Ledger,
) -> Vec<Change> {
    let mut values: BTreeMap<MetricId, Option<f64>> =
        variables(activation).into_iter().map(|metric| (metric, case.plan.metric(metric).initial)).collect();
    let said = |time, values: &BTreeMap<MetricId, Option<f64>>| Change {
        time,
        start: holds(start, values),
        end: end.is_some_and(|end| holds(end, values)),
    };
    let mut changes = vec![said(i64::MIN, &values)];
    let metrics: Vec<MetricId> = values.keys().copied().collect();
    for &(delivered, at) in &ledger.order {
        let message = if delivered { &ledger.delivered[at] } else { &ledger.published[at] };
        let mut heard = false;
        for &id in &metrics {
            let metric = case.plan.metric(id);
            let on = topics_of(metric).iter().any(|&topic| case.plan.topic(topic).paths.contains(&message.path));
            if !on || hears_deliveries(metric) != delivered {
                continue;
            }
            heard = true;
            let until = Ledger {
                paths: Vec::new(),
                published: if delivered { Vec::new() } else { ledger.published[..=at].to_vec() },
                delivered: if delivered { ledger.delivered[..=at].to_vec() } else { Vec::new() },
                order: Vec::new(),
                deeds: Vec::new(),
                end: message.time,
            };
            if let Judged::Value(value) = judged(&case.plan, metric, &until) {
                values.insert(id, Some(value));
            }
        }
        if heard {
            changes.push(said(message.time, &values));
        }
    }
    changes
}

fn holds(condition: &Condition, values: &BTreeMap<MetricId, Option<f64>>) -> bool {
    let number = |side: &Operand| match side {
        Operand::Number(number) => Some(*number),
        Operand::Variable(metric) => values[metric],
    };
    match condition {
        Condition::Compare { left, by, right } => match (number(left), number(right)) {
            (Some(left), Some(right)) => by.holds(left, right),
            _ => false,
        },
        Condition::And(a, b) => holds(a, values) && holds(b, values),
        Condition::Or(a, b) => holds(a, values) || holds(b, values),
    }
}
