//! The value of each metric, from the complete lists of messages of a run, by the words of the documentation.

use sesame_plan::stl::Robustness;
use sesame_plan::{
    Aggregate, CampaignPlan, Condition, Expression, FieldRef, Formula, Input, Members, Metric, MetricSource, Side,
    TopicId,
};
use sesame_relay::value::Value;

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
        MetricSource::Formula { formula } => of_formula(plan, formula, messages, ledger.end),
        MetricSource::Robustness { robustness } => of_robustness(plan, robustness, messages, ledger.end),
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

/// Which member of a topic a wire is.
fn member(plan: &CampaignPlan, topic: TopicId, path: &str) -> Option<usize> {
    plan.topic(topic).paths.iter().position(|of| of == path)
}

fn number(message: &Value, path: &[String]) -> Option<f64> {
    let value = path.iter().try_fold(message, |value, name| match value {
        Value::Record(record) => record.get(name),
        _ => None,
    })?;
    match value {
        Value::Real(x) => Some(*x),
        Value::Int(n) => Some(*n as f64),
        Value::Bool(b) => Some(f64::from(u8::from(*b))),
        _ => None,
    }
}

/// What tells messages apart.
fn key(plan: &CampaignPlan, per: &FieldRef, message: &Message) -> Option<String> {
    member(plan, per.topic, &message.path)?;
    let Value::Record(record) = &message.value else { return None };
    Some(match record.get(&per.path[0])? {
        Value::Text(text) => text.to_string(),
        other => format!("{other:?}"),
    })
}

/// Whether a formula is computed once per instant: of several topics, of all members of a group, or with a duration for
/// each member.
pub(crate) fn is_by_instant(plan: &CampaignPlan, inputs: &[Input], aggregate: Option<&Aggregate>) -> bool {
    let mut topics: Vec<TopicId> = inputs.iter().map(|input| input.field.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    let members = |input: &Input| plan.topic(input.field.topic).paths.len();
    let of_all_members = |input: &Input| input.members != Members::Each && members(input) > 1;
    let each = inputs.iter().any(|input| input.members == Members::Each);
    topics.len() > 1
        || inputs.iter().any(of_all_members)
        || each && matches!(aggregate, Some(Aggregate::Duration { .. }))
}

/// A time at which a formula has a value, with its inputs then.
type Moment = (i64, Vec<f64>);

/// The values of inputs whenever a formula over them is computed: of one topic, or of each member of one group, at each
/// message; of several topics, or of all members, once per instant, when all its messages are known; as soon as every
/// input had a message. Only messages that `counts` lets
/// through are heard; nothing is computed before the first message that `begins` it.
fn moments(
    plan: &CampaignPlan,
    inputs: &[Input],
    messages: &[Message],
    counts: impl Fn(&Message) -> bool,
    begins: impl Fn(&Message) -> bool,
    each: Option<usize>,
    always_by_instant: bool,
) -> Vec<Moment> {
    let mut topics: Vec<TopicId> = inputs.iter().map(|input| input.field.topic).collect();
    topics.sort_unstable();
    topics.dedup();
    let of_all_members =
        |input: &Input| input.members != Members::Each && plan.topic(input.field.topic).paths.len() > 1;
    let by_instant = always_by_instant || topics.len() > 1 || inputs.iter().any(of_all_members);
    let heard: Vec<&Message> = messages
        .iter()
        .filter(|message| topics.iter().any(|&topic| member(plan, topic, &message.path).is_some()) && counts(message))
        .collect();
    let Some(first) = heard.iter().position(|message| begins(message)) else { return Vec::new() };
    let mut last: Vec<Vec<Option<f64>>> =
        inputs.iter().map(|input| vec![None; plan.topic(input.field.topic).paths.len()]).collect();
    let mut latest: Vec<Option<f64>> = vec![None; inputs.len()];
    let mut moments = Vec::new();
    for (at, message) in heard.iter().enumerate() {
        for (of, input) in inputs.iter().enumerate() {
            let Some(member) = member(plan, input.field.topic, &message.path) else { continue };
            if input.members == Members::Each && each.is_some_and(|own| own != member) {
                continue;
            }
            let value = number(&message.value, &input.field.path);
            last[of][member] = value;
            latest[of] = value;
        }
        let instant_is_over = heard.get(at + 1).is_none_or(|next| next.time > message.time);
        if by_instant && !instant_is_over || at < first && !(by_instant && heard[first].time == message.time) {
            continue;
        }
        // Of `each of` a group, every member with a message in the instant counts once, the latest last.
        let of_each = |topic| inputs.iter().any(|it| it.members == Members::Each && it.field.topic == topic);
        let mut turns: Vec<(TopicId, usize)> = Vec::new();
        if by_instant && each.is_none() {
            for message in heard[..=at].iter().filter(|other| other.time == message.time) {
                for topic in topics.iter().copied().filter(|&topic| of_each(topic)) {
                    let Some(member) = member(plan, topic, &message.path) else { continue };
                    turns.retain(|&turn| turn != (topic, member));
                    turns.push((topic, member));
                }
            }
        }
        let mut turns: Vec<Option<(TopicId, usize)>> = turns.into_iter().map(Some).collect();
        if turns.is_empty() {
            turns.push(None);
        }
        for turn in turns {
            for (of, input) in inputs.iter().enumerate() {
                if let Some((_, member)) = turn.filter(|turn| turn.0 == input.field.topic) {
                    latest[of] = last[of][member];
                }
            }
            let value = |(of, input): (usize, &Input)| {
                let known = last[of].iter().flatten().copied();
                match input.members {
                    Members::Each => latest[of],
                    Members::Min => known.reduce(f64::min),
                    Members::Max => known.reduce(f64::max),
                    Members::Sum => known.reduce(|a, b| a + b),
                    Members::First | Members::Second => unreachable!("no case has pairs"),
                }
            };
            let values: Option<Vec<f64>> = inputs.iter().enumerate().map(value).collect();
            moments.extend(values.map(|values| (message.time, values)));
        }
    }
    moments
}

fn of_formula(plan: &CampaignPlan, formula: &Formula, messages: &[Message], end: i64) -> Option<f64> {
    let each = formula.inputs.iter().find(|input| input.members == Members::Each).map(|input| input.field.topic);
    let streams: Vec<Vec<Moment>> = match &formula.per {
        // What holds of one member says nothing about another.
        None if each.is_some() && matches!(formula.aggregate, Aggregate::Duration { .. }) => {
            let of = |member| moments(plan, &formula.inputs, messages, |_| true, |_| true, Some(member), true);
            (0..plan.topic(each.expect("it has such an input")).paths.len()).map(of).collect()
        }
        None => vec![moments(plan, &formula.inputs, messages, |_| true, |_| true, None, false)],
        Some(per) => {
            let mut keys: Vec<String> = messages.iter().filter_map(|message| key(plan, per, message)).collect();
            keys.sort_unstable();
            keys.dedup();
            let own = |of: &String| {
                let counts = |message: &Message| key(plan, per, message).is_none_or(|key| key == *of);
                let begins = |message: &Message| key(plan, per, message).is_some();
                moments(plan, &formula.inputs, messages, counts, begins, None, false)
            };
            keys.iter().map(own).collect()
        }
    };
    let values = streams.iter().filter_map(|stream| aggregated(formula, stream, end));
    match formula.aggregate {
        // Durations are here in whole nanoseconds.
        Aggregate::Duration { .. } => values.reduce(|a, b| a + b).map(|nanos| nanos / 1e9),
        Aggregate::Count { .. } => values.reduce(|a, b| a + b),
        Aggregate::Max { .. } => values.reduce(f64::max),
        Aggregate::Last { .. } | Aggregate::Min { .. } | Aggregate::Mean { .. } => values.reduce(f64::min),
    }
}

fn aggregated(formula: &Formula, stream: &[Moment], end: i64) -> Option<f64> {
    stream.first()?;
    let when = |moment: &&Moment| formula.when.as_ref().is_none_or(|when| holds(when, &moment.1));
    let limited = |candidates: Vec<&Moment>| -> Vec<Moment> {
        let Some(every) = formula.every else { return candidates.into_iter().cloned().collect() };
        let period = (every * 1e9).round() as i64;
        let mut counted: Vec<Moment> = Vec::new();
        for moment in candidates {
            if counted.last().is_none_or(|last| moment.0 - last.0 >= period) {
                counted.push(moment.clone());
            }
        }
        counted
    };
    match &formula.aggregate {
        Aggregate::Count { of } => {
            let candidates = stream.iter().filter(when).filter(|moment| holds(of, &moment.1)).collect();
            Some(limited(candidates).len() as f64)
        }
        Aggregate::Duration { of } => {
            let next = stream.iter().skip(1).map(|moment| moment.0).chain([end]);
            let held = stream.iter().zip(next).filter(|(moment, _)| when(moment) && holds(of, &moment.1));
            Some(held.map(|(moment, next)| next - moment.0).sum::<i64>() as f64)
        }
        Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
            let counted = limited(stream.iter().filter(when).collect());
            let values: Vec<f64> = counted.iter().map(|moment| value(of, &moment.1)).collect();
            match formula.aggregate {
                Aggregate::Last { .. } => values.last().copied(),
                Aggregate::Min { .. } => values.into_iter().reduce(f64::min),
                Aggregate::Max { .. } => values.into_iter().reduce(f64::max),
                _ => (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64),
            }
        }
    }
}

fn of_robustness(plan: &CampaignPlan, of: &Robustness, messages: &[Message], end: i64) -> Option<f64> {
    let each = of.inputs.iter().find(|input| input.members == Members::Each).map(|input| input.field.topic);
    let instances: Vec<Option<usize>> = match each {
        None => vec![None],
        Some(topic) => (0..plan.topic(topic).paths.len()).map(Some).collect(),
    };
    let of_instance = |own: &Option<usize>| {
        let moments = moments(plan, &of.inputs, messages, |_| true, |_| true, *own, true);
        let signals = |moment: &Moment| of.signals.iter().map(|signal| value(signal, &moment.1)).collect();
        let samples: Vec<Moment> = moments.iter().map(|moment| (moment.0, signals(moment))).collect();
        temporal::robustness(&of.formula, &samples, end, crate::adapter::over_whole_windows(of))
    };
    instances.iter().filter_map(of_instance).reduce(f64::min).filter(|robustness| robustness.is_finite())
}

fn value(of: &Expression, inputs: &[f64]) -> f64 {
    let all = |of: &[Expression]| of.iter().map(|it| value(it, inputs)).collect::<Vec<f64>>().into_iter();
    match of {
        Expression::Constant(value) => *value,
        Expression::Input(at) => inputs[*at as usize],
        Expression::Negate(of) => -value(of, inputs),
        Expression::Sum(of) => all(of).reduce(|a, b| a + b).unwrap(),
        Expression::Product(of) => all(of).reduce(|a, b| a * b).unwrap(),
        Expression::Absolute(of) => value(of, inputs).abs(),
        Expression::Min(of) => all(of).reduce(f64::min).unwrap(),
        Expression::Max(of) => all(of).reduce(f64::max).unwrap(),
        Expression::Divide { .. }
        | Expression::Distance(_)
        | Expression::SignedDistance(_)
        | Expression::Time
        | Expression::Unary { .. }
        | Expression::Binary { .. } => unreachable!("no case has these"),
    }
}

fn holds(of: &Condition, inputs: &[f64]) -> bool {
    match of {
        Condition::Constant(value) => *value,
        Condition::Input(at) => inputs[*at as usize] != 0.0,
        Condition::Compare { left, by, right } => by.holds(value(left, inputs), value(right, inputs)),
        Condition::Same { left, right } => holds(left, inputs) == holds(right, inputs),
        Condition::All(of) => of.iter().all(|part| holds(part, inputs)),
        Condition::Any(of) => of.iter().any(|part| holds(part, inputs)),
        Condition::Not(of) => !holds(of, inputs),
    }
}
