//! When operations are active, by the words of the documentation: from the values that metrics have had, message by
//! message.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::observation::Observation;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, Aggregate, Copies, Metric, MetricId, MetricSource, OperationKind};

use crate::adapter::STEP;
use crate::case::{Case, topics_of, variables};
use crate::computations::When;
use crate::formulas::{Judged, first_blank, heard, hears_deliveries, judged};
use crate::ledger::{Ledger, Message};

/// Something that changes what a condition says: the values of all its variables from then on.
struct Change {
    time: i64,
    /// Whether time alone makes it, before anything is heard at that moment.
    by_time: bool,
    start: bool,
    end: bool,
}

/// Intervals that are not where the documentation has them. Conditions over active time, over durations that are
/// compared with each other, and copies that wait for each other are left to other tests.
pub(crate) fn contradictions(case: &Case, observed: &Observation, ledger: &Ledger) -> Vec<String> {
    let mut wrong = Vec::new();
    for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
        let known = |metric: &MetricId| {
            let metric = case.plan.metric(*metric);
            let open = first_blank(&case.plan, metric, ledger).is_some();
            !open && !matches!(metric.source, MetricSource::Robustness { .. } | MetricSource::FuzzingTime)
        };
        let copies = case.test.operations.iter().filter(|other| other.operation == used.operation).count();
        let apart = copies == 1 || case.plan.campaign.copies == Copies::MayOverlap;
        let within = case.plan.operation(used.operation).within;
        let window = (nanos(within.start), nanos(within.end));
        let expected = match &used.activation {
            Activation::Condition { .. } | Activation::ConditionFor { .. } => {
                let growing = |metric: &MetricId| grows(case, *metric) && compares_metrics(&used.activation);
                let metrics = variables(&used.activation);
                // Conditions see what was delivered when a message and its copies have all been.
                if metrics.iter().any(|&metric| hears_copies(case, metric)) {
                    continue;
                }
                if !apart || !metrics.iter().all(known) || metrics.iter().any(growing) {
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

/// Whether a metric hears what is delivered on a topic on which an operation of the test makes copies.
fn hears_copies(case: &Case, metric: MetricId) -> bool {
    let metric = case.plan.metric(metric);
    let mut used = case.test.operations.iter().map(|used| case.plan.operation(used.operation));
    hears_deliveries(metric)
        && used.any(|operation| {
            operation.kind == OperationKind::Duplicate
                && operation.topic.is_some_and(|topic| topics_of(metric).contains(&topic))
        })
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
        let at_now = || changes.iter().filter(|change| change.time == now);
        let is_new = at_now().next().is_some_and(|change| change.by_time);
        let before = changes.iter().rfind(|change| change.time < now).filter(|_| !is_new);
        for look in before.into_iter().chain(at_now()) {
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

/// What start and end say: first before any message, then whenever a variable may have changed.
fn changes(
    case: &Case,
    activation: &Activation,
    start: &Condition,
    end: Option<&Condition>,
    ledger: &Ledger,
) -> Vec<Change> {
    let metrics = variables(activation);
    let said = |time, by_time, values: &BTreeMap<MetricId, Option<f64>>| Change {
        time,
        by_time,
        start: holds(start, values),
        end: end.is_some_and(|end| holds(end, values)),
    };
    let initial = metrics.iter().map(|&metric| (metric, case.plan.metric(metric).initial)).collect();
    let mut changes = vec![said(i64::MIN, true, &initial)];
    let mut moments = moments_of_time(case, activation, &metrics, ledger).into_iter().peekable();
    let values = |time: i64, heard: &[(bool, usize)]| -> BTreeMap<MetricId, Option<f64>> {
        let value = |id: MetricId| value_at(case, id, ledger, time, heard).or(case.plan.metric(id).initial);
        metrics.iter().map(|&metric| (metric, value(metric))).collect()
    };
    for (at, &(delivered, message)) in ledger.order.iter().enumerate() {
        let message = if delivered { &ledger.delivered[message] } else { &ledger.published[message] };
        while let Some(moment) = moments.next_if(|&moment| moment <= message.time) {
            changes.push(said(moment, true, &values(moment, &ledger.order[..at])));
        }
        let hears = |id: &MetricId| {
            let metric = case.plan.metric(*id);
            hears_deliveries(metric) == delivered
                && topics_of(metric).iter().any(|&topic| case.plan.topic(topic).paths.contains(&message.path))
        };
        if metrics.iter().any(hears) {
            changes.push(said(message.time, false, &values(message.time, &ledger.order[..=at])));
        }
    }
    changes.extend(moments.map(|moment| said(moment, true, &values(moment, &ledger.order))));
    changes
}

/// The value of a metric at a moment at which so much was heard; `None` before it has one.
fn value_at(case: &Case, id: MetricId, ledger: &Ledger, time: i64, heard: &[(bool, usize)]) -> Option<f64> {
    let metric = case.plan.metric(id);
    // What is computed once per instant is known when the instant is over.
    let until = if when(case, metric) == When::Message { time + 1 } else { time };
    let messages = |side: bool, messages: &[Message]| -> Vec<Message> {
        let heard = heard.iter().filter(|(delivered, _)| *delivered == side).map(|&(_, at)| &messages[at]);
        heard.filter(|message| message.time < until).cloned().collect()
    };
    let until = Ledger {
        paths: Vec::new(),
        published: messages(false, &ledger.published),
        delivered: messages(true, &ledger.delivered),
        order: Vec::new(),
        deeds: Vec::new(),
        end: time,
        steps: time - 1,
    };
    match judged(&case.plan, metric, &until) {
        Judged::Value(value) => Some(value),
        Judged::Unset | Judged::Open => None,
    }
}

/// When time alone makes new values of metrics known: an instant is over, or a duration reaches a number.
fn moments_of_time(case: &Case, activation: &Activation, metrics: &[MetricId], ledger: &Ledger) -> BTreeSet<i64> {
    let mut moments = BTreeSet::new();
    for &id in metrics {
        let metric = case.plan.metric(id);
        let when = when(case, metric);
        if when != When::Message {
            let of_metric = |message: &&Message| {
                topics_of(metric).iter().any(|&topic| case.plan.topic(topic).paths.contains(&message.path))
            };
            moments.extend(heard(metric, ledger).iter().filter(of_metric).map(|message| message.time + 1));
        }
        if when == When::Step {
            moments.extend((0..=ledger.end / STEP).map(|step| step * STEP + 1));
        }
        if grows(case, id) {
            for number in numbers(activation) {
                let reached =
                    |time| value_at(case, id, ledger, time, &ledger.order).is_some_and(|value| value >= number);
                let passed = |time| value_at(case, id, ledger, time, &ledger.order).is_some_and(|value| value > number);
                moments.extend(first(ledger.end, reached));
                moments.extend(first(ledger.end, passed));
            }
        }
    }
    moments
}

/// The first nanosecond from which on something holds.
fn first(end: i64, holds: impl Fn(i64) -> bool) -> Option<i64> {
    let (mut low, mut high) = (0, end + 1);
    while low < high {
        let middle = low + (high - low) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    (low <= end).then_some(low)
}

fn when(case: &Case, metric: &Metric) -> When {
    match &metric.source {
        MetricSource::Formula { formula } => When::of(&case.plan, formula),
        _ => When::Message,
    }
}

fn grows(case: &Case, metric: MetricId) -> bool {
    let source = &case.plan.metric(metric).source;
    matches!(source, MetricSource::Formula { formula } if matches!(formula.aggregate, Aggregate::Duration { .. }))
}

/// All numbers in the conditions of an activation.
fn numbers(activation: &Activation) -> Vec<f64> {
    let number = |operand: &Operand| match operand {
        Operand::Number(number) => Some(*number),
        Operand::Variable(_) => None,
    };
    comparisons(activation).iter().flat_map(|(left, right)| [number(left), number(right)]).flatten().collect()
}

/// Whether metrics are compared with each other.
fn compares_metrics(activation: &Activation) -> bool {
    let is_metric = |operand: &Operand| matches!(operand, Operand::Variable(_));
    comparisons(activation).iter().any(|(left, right)| is_metric(left) && is_metric(right))
}

fn comparisons(activation: &Activation) -> Vec<(Operand, Operand)> {
    fn of(condition: &Condition, found: &mut Vec<(Operand, Operand)>) {
        match condition {
            Condition::Compare { left, right, .. } => found.push((*left, *right)),
            Condition::And(a, b) | Condition::Or(a, b) => {
                of(a, found);
                of(b, found);
            }
        }
    }
    let mut found = Vec::new();
    match activation {
        Activation::Condition { start, end, .. } => {
            of(start, &mut found);
            of(end, &mut found);
        }
        Activation::ConditionFor { start, .. } => of(start, &mut found),
        Activation::Time { .. } | Activation::Offline => {}
    }
    found
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
