//! The properties themselves.

use std::sync::atomic::{AtomicU64, Ordering};

use sesame_base::observation::{Observation, Outcome};
use sesame_plan::{
    Activation, Aggregate, Bound, Copies, Drain, Metric, MetricSource, OperationKind, Requirement, Span,
};
use sesame_record::Verdict;
use sesame_relay::value::{Fields, Record, Value};
use sesame_rng::Stream;

use crate::adapter::{self, STEP, declares_trend, hung, said};
use crate::broken_off::{is_over, known};
use crate::case::{Case, topics_of};
use crate::formulas::{Judged, first_blank, heard, judged};
use crate::hooks::HookKind;
use crate::ledger::{Ledger, Message};
use crate::robot::{Carries, Script};
use crate::{activations, monitors, words};

/// Futures of a run that are tried out.
const FUTURES: u64 = 4;

fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// What a metric comes to: `None` where it never had a value and has no default.
fn value_of(case: &Case, metric: &Metric, ledger: &Ledger, active: f64) -> Result<Option<f64>, Judged> {
    if matches!(metric.source, MetricSource::FuzzingTime) {
        return Ok(Some(active));
    }
    match judged(&case.plan, metric, ledger) {
        Judged::Value(value) => Ok(Some(value)),
        Judged::Unset => Ok(metric.default),
        Judged::Open => Err(Judged::Open),
    }
}

/// What decides a requirement on a metric: its value, but never the default of a robustness.
fn deciding(case: &Case, metric: &Metric, ledger: &Ledger, active: f64) -> Result<Option<f64>, Judged> {
    let value = value_of(case, metric, ledger, active)?;
    let unset = || judged(&case.plan, metric, ledger) == Judged::Unset;
    Ok(if matches!(metric.source, MetricSource::Robustness { .. }) && unset() { None } else { value })
}

fn verdict_of(bound: Bound, value: Option<f64>) -> Verdict {
    match value {
        Some(value) if bound.holds(value) => Verdict::Satisfied,
        Some(_) => Verdict::Violated,
        None => Verdict::Inconclusive,
    }
}

/// The time in which operations are active or hold messages back, summed over those that count, in seconds.
fn busy(case: &Case, observation: &Observation, ledger: &Ledger) -> f64 {
    adapter::busy(&case.plan, &case.test, observation, ledger) as f64 / 1e9
}

/// What could still have happened from a time on after a run that broke off, and in the place of numbers that are none.
fn futures(case: &Case, ledger: &Ledger, broke_off: bool, from: i64) -> Vec<Ledger> {
    let planned = nanos(case.plan.campaign.end_after) / STEP * STEP;
    (0..FUTURES)
        .map(|future| {
            let mut stream = Stream::derive(case.number, "future", &[future]);
            let mut whole = ledger.clone();
            for list in [&mut whole.published, &mut whole.delivered] {
                for message in list.iter_mut() {
                    filled(&mut message.value, &mut stream);
                }
            }
            if !broke_off {
                return whole;
            }
            whole.end = planned.max(ledger.end);
            whole.steps = whole.end;
            // The first future brings nothing more at all.
            let mut now = from;
            while future > 0 && now <= whole.end {
                for (topic, carries) in case.plan.topics.iter().zip(&case.carries) {
                    for path in &topic.paths {
                        for list in [&mut whole.published, &mut whole.delivered] {
                            for _ in 0..stream.below(3) {
                                let value = payload(*carries, if future == 1 { 4.0 } else { 1e6 }, &mut stream);
                                list.push(Message { time: now, path: path.clone(), value });
                            }
                        }
                    }
                }
                now += STEP;
            }
            whole
        })
        .collect()
}

/// A number for each that is none.
fn filled(value: &mut Value, stream: &mut Stream) {
    let number = |x: f64, stream: &mut Stream| {
        if x.is_finite() { x } else { [-1e6, -4.0, -1.0, 0.0, 1.0, 4.0, 1e6][stream.below(7)] }
    };
    match value {
        Value::Real(x) => *x = number(*x, stream),
        Value::Record(record) => {
            if let Some(Value::Real(x)) = record.get_mut("level") {
                *x = number(*x, stream);
            }
        }
        _ => {}
    }
}

fn payload(carries: Carries, most: f64, stream: &mut Stream) -> Value {
    let number = (stream.uniform(-most, most) * 4.0).round() / 4.0;
    match carries {
        Carries::Real => number.into(),
        Carries::Int => (number as i64).into(),
        Carries::Bool => (number > 0.0).into(),
        Carries::Zone => {
            let fields = Fields::new(["level", "count", "inside", "name"]);
            let name = ["a", "b", "c", "d"][stream.below(4)];
            Record::new(&fields, vec![number.into(), (number as i64).into(), (number > 1.0).into(), name.into()]).into()
        }
    }
}

/// Whether a value of this metric that breaks this bound can only break it further: of which nobody may stay silent.
fn only_worsens(metric: &Metric, bound: Bound) -> bool {
    let upper = matches!(bound, Bound::AtMost { .. } | Bound::Below { .. });
    let lower = matches!(bound, Bound::AtLeast { .. } | Bound::Above { .. });
    match &metric.source {
        MetricSource::Formula { formula } => match formula.aggregate {
            Aggregate::Max { .. } | Aggregate::Count { .. } | Aggregate::Duration { .. } => upper,
            Aggregate::Min { .. } => lower,
            Aggregate::Last { .. } | Aggregate::Mean { .. } => false,
        },
        MetricSource::FuzzingTime => upper,
        MetricSource::Hook { .. } => match HookKind::named(&metric.name) {
            kind if !declares_trend(kind) => false,
            HookKind::Counting => upper,
            HookKind::Least => lower,
            HookKind::Latest => false,
        },
        MetricSource::Last { .. } | MetricSource::Robustness { .. } | MetricSource::Monitor { .. } => false,
    }
}

/// What is wrong with a case; nothing if all is as it should be.
pub(crate) fn contradictions(case: &Case) -> Vec<String> {
    let mut wrong = Vec::new();
    let (truth, told) = adapter::run(&case.plan, &case.test, &case.truth());
    if !matches!(truth.outcome, Outcome::Completed | Outcome::NoEffect) {
        wrong.push(format!("the robot without faults ended with {:?}", truth.outcome));
        return wrong;
    }
    wrong.extend(effects(case, &truth, &told));
    wrong.extend(counters(case, &truth));
    let active = busy(case, &truth, &told);
    let sound: Vec<(&Requirement, Result<Option<f64>, Judged>)> = (case.plan.requirements.iter())
        .map(|requirement| (requirement, deciding(case, case.plan.metric(requirement.metric), &told, active)))
        .collect();
    for (requirement, value) in &sound {
        let said = said(requirement, &truth);
        let metric = case.plan.metric(requirement.metric);
        let observed = &truth.metrics[requirement.metric.index()];
        match value {
            Ok(value) if verdict_of(requirement.bound, *value) != said => wrong.push(format!(
                "{} of {}: {said:?} with the value {:?}, while the judge has {value:?}",
                requirement.name, metric.name, observed.value
            )),
            Err(_) if said == Verdict::Satisfied => {
                wrong.push(format!(
                    "{} of {}: kept, though it heard what is not a number",
                    requirement.name, metric.name
                ));
            }
            _ => {}
        }
    }
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        let value = value_of(case, metric, &told, active);
        if let Ok(value) = value
            && value != truth.metrics[at].value
        {
            let seen = truth.metrics[at].value;
            wrong.push(format!("metric {}: {seen:?}, while the judge has {value:?}", words::metric(metric)));
        }
        if adapter::heard_no_number(&truth.metrics[at]) != value.is_err() {
            wrong.push(format!("metric {}: whether it heard what is not a number is wrong", metric.name));
        }
    }
    if sound.iter().any(|(_, value)| value.is_err()) {
        wrong.extend(unfounded(case, &truth, &told, false));
    }
    if !case.behaves() {
        wrong.extend(faulty(case, &truth, &told, &sound));
    }
    wrong
}

/// What is wrong with the run of a robot with faults, compared with the true one.
fn faulty(
    case: &Case,
    truth: &Observation,
    told: &Ledger,
    sound: &[(&Requirement, Result<Option<f64>, Judged>)],
) -> Vec<String> {
    let mut wrong = Vec::new();
    let (observed, ledger) = adapter::run(&case.plan, &case.test, &case.script);
    let broke_off = matches!(observed.outcome, Outcome::Crash { .. });
    if case.script.blanks.is_empty() {
        let begins = |part: &[Message], whole: &[Message]| {
            part.len() <= whole.len() && part.iter().zip(whole).all(|(a, b)| a.is(b))
        };
        if !begins(&ledger.published, &told.published) || !begins(&ledger.delivered, &told.delivered) {
            wrong.push("before the crash the run is not the true one".to_owned());
        }
    } else if !broke_off && ledger.published.len() != told.published.len() {
        wrong.push("numbers that are none changed what is published".to_owned());
    }
    wrong.extend(counters(case, &observed));
    let mut reports = vec![("crash or blanks", observed.clone())];
    if broke_off {
        reports.push(("hang", hung(&observed)));
        reports.push(("lost worker", Observation::without_run(Outcome::Timeout { limit: 1.0 })));
        reports.push(("dead worker", Observation::without_run(Outcome::Crash { message: "gone".to_owned() })));
    }
    // For some metrics the last instant counts as over, although more would have come in it.
    let in_last = |messages: &[Message], metric: &Metric| {
        let own = |message: &&Message| {
            topics_of(metric).iter().any(|&topic| case.plan.topic(topic).paths.contains(&message.path))
        };
        messages.iter().filter(|message| message.time == ledger.end).filter(own).count()
    };
    let is_cut = |metric: &Metric| {
        broke_off
            && is_over(&case.plan, metric, &ledger)
            && in_last(heard(metric, &ledger), metric) < in_last(heard(metric, told), metric)
    };
    for (what, report) in &reports {
        for (requirement, value) in sound {
            let Ok(value) = value else { continue };
            if is_cut(case.plan.metric(requirement.metric)) {
                continue;
            }
            let (said, true_one) = (said(requirement, report), verdict_of(requirement.bound, *value));
            let metric = &case.plan.metric(requirement.metric);
            let contradicts = matches!(
                (said, true_one),
                (Verdict::Satisfied, Verdict::Violated) | (Verdict::Violated, Verdict::Satisfied)
            );
            if contradicts {
                wrong.push(format!(
                    "{what}: {} of {} is {said:?} with {:?}, in truth {true_one:?} with {value:?}",
                    requirement.name,
                    metric.name,
                    report.metrics.get(requirement.metric.index()).and_then(|metric| metric.value)
                ));
            }
        }
        if broke_off {
            for requirement in &case.plan.requirements {
                if said(requirement, report) == Verdict::Satisfied {
                    wrong.push(format!("{what}: {} is kept by a run that broke off", requirement.name));
                }
            }
        }
    }
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        let blank = first_blank(&case.plan, metric, &ledger);
        if adapter::heard_no_number(&observed.metrics[at]) != blank.is_some() {
            wrong.push(format!("metric {}: whether it heard what is not a number is wrong", metric.name));
        }
        let computed = matches!(metric.source, MetricSource::Formula { .. });
        if broke_off && computed && blank.is_none() {
            let value = value_of(case, metric, &known(&case.plan, metric, &ledger), 0.0).unwrap_or_default();
            let seen = observed.metrics[at].value;
            if value != seen {
                let metric = words::metric(metric);
                wrong.push(format!("metric {metric}: {seen:?} when it broke off, while the judge has {value:?}"));
            }
        }
        let (low, high) = adapter::reach(&observed.metrics[at]);
        if !is_cut(metric)
            && let Ok(Some(value)) = deciding(case, metric, told, busy(case, truth, told))
            && !(low..=high).contains(&value)
        {
            wrong.push(format!("metric {}: {value} in truth, beyond its reach {low} to {high}", metric.name));
        }
    }
    for requirement in &case.plan.requirements {
        let metric = case.plan.metric(requirement.metric);
        let said = said(requirement, &observed);
        if first_blank(&case.plan, metric, &ledger).is_some() {
            if said == Verdict::Satisfied {
                wrong.push(format!(
                    "{} of {}: kept, though it heard what is not a number",
                    requirement.name, metric.name
                ));
            }
        } else if broke_off && only_worsens(metric, requirement.bound) && said != Verdict::Violated {
            let set = match &metric.source {
                MetricSource::FuzzingTime => Some(busy(case, &observed, &ledger)),
                _ => match judged(&case.plan, metric, &known(&case.plan, metric, &ledger)) {
                    Judged::Value(value) => Some(value),
                    Judged::Unset | Judged::Open => None,
                },
            };
            if set.is_some_and(|value| !requirement.bound.holds(value)) {
                wrong.push(format!(
                    "{} of {}: {said:?} after {set:?}, though it can only get worse",
                    requirement.name, metric.name
                ));
            }
        }
    }
    wrong.extend(unfounded(case, &observed, &ledger, broke_off));
    wrong
}

/// Violations that another end of the run, or other numbers in the place of those that are none, would not have shown.
fn unfounded(case: &Case, observed: &Observation, ledger: &Ledger, broke_off: bool) -> Vec<String> {
    let mut wrong = Vec::new();
    let active = busy(case, observed, ledger);
    let violated = |requirement: &&Requirement| said(requirement, observed) == Verdict::Violated;
    let suspects: Vec<&Requirement> = case.plan.requirements.iter().filter(violated).collect();
    if suspects.is_empty() && !broke_off {
        return wrong;
    }
    // For some metrics the last instant counts as over, so that nothing more comes in it.
    let ahead = [ledger.end, ledger.end + STEP].map(|from| futures(case, ledger, broke_off, from));
    let of_metric = |number: usize, metric: &Metric| &ahead[usize::from(is_over(&case.plan, metric, ledger))][number];
    for number in 0..ahead[0].len() {
        for requirement in &suspects {
            let metric = case.plan.metric(requirement.metric);
            let future = of_metric(number, metric);
            let open = broke_off || first_blank(&case.plan, metric, ledger).is_some();
            if !open || matches!(metric.source, MetricSource::FuzzingTime) {
                continue;
            }
            if let Ok(Some(value)) = deciding(case, metric, future, active)
                && requirement.bound.holds(value)
            {
                wrong.push(format!(
                    "{} of {}: violated with {:?}, though in future {number} it would be kept with {value}",
                    requirement.name,
                    metric.name,
                    observed.metrics[requirement.metric.index()].value
                ));
            }
        }
        for (metric, seen) in case.plan.metrics.iter().zip(&observed.metrics) {
            if matches!(metric.source, MetricSource::FuzzingTime) {
                continue;
            }
            let future = of_metric(number, metric);
            let (low, high) = adapter::reach(seen);
            if let Ok(Some(value)) = deciding(case, metric, future, active)
                && !(low..=high).contains(&value)
            {
                wrong.push(format!(
                    "metric {}: {value} in future {number}, beyond its reach {low} to {high}",
                    metric.name
                ));
            }
        }
    }
    wrong
}

/// A run is void exactly where nobody heard anything but what was published.
fn effects(case: &Case, observed: &Observation, ledger: &Ledger) -> Vec<String> {
    let mut wrong = Vec::new();
    let paths: Vec<&String> = case.plan.topics.iter().flat_map(|topic| &topic.paths).collect();
    let differs = |path: &str| {
        let published: Vec<&Message> = Ledger::on(&ledger.published, path).collect();
        let delivered: Vec<&Message> = Ledger::on(&ledger.delivered, path).collect();
        published.len() != delivered.len() || published.iter().zip(&delivered).any(|(a, b)| !a.is(b))
    };
    let heard = paths.iter().any(|path| case.is_heard(path) && differs(path));
    let on = |path: &str| {
        let touches = |id| {
            let topic = case.plan.operation(id).topic.unwrap();
            case.plan.topic(topic).paths.iter().any(|of| of == path)
        };
        case.test.operations.iter().filter(|used| touches(used.operation)).count()
    };
    // Two operations on one wire may undo what each other does, and messages may be held and let go at one instant.
    let flushes = |id| {
        use OperationKind::{Latency, Reorder};
        matches!(case.plan.operation(id).kind, Latency { drain: Drain::Flush, .. } | Reorder { drain: Drain::Flush })
    };
    let flushed = case.test.operations.iter().any(|used| flushes(used.operation));
    let alone = !flushed && paths.iter().all(|path| on(path) <= 1);
    let void = observed.outcome == Outcome::NoEffect;
    if heard && void {
        wrong.push("void, though somebody heard what was not published so".to_owned());
    }
    if !heard && !void && alone && !case.test.operations.is_empty() {
        wrong.push("not void, though nobody heard anything but what was published".to_owned());
    }
    for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
        let topic = case.plan.operation(used.operation).topic.unwrap();
        let own = &case.plan.topic(topic).paths;
        let changed = own.iter().any(|path| case.is_heard(path) && differs(path));
        if alone && own.iter().all(|path| on(path) == 1) && changed != adapter::has_effect(effect) {
            wrong.push(format!("an operation on {own:?} has an effect or not: {:?}, heard {changed}", effect.counters));
        }
    }
    wrong
}

/// What operations counted fits together.
fn counters(case: &Case, observed: &Observation) -> Vec<String> {
    let mut wrong = Vec::new();
    for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
        let operation = case.plan.operation(used.operation);
        let counters = effect.counters;
        let mut must = |holds: bool, what: &str| {
            if !holds {
                wrong.push(format!("{}: {what}: {effect:?}", operation.name));
            }
        };
        must(counters.changed <= counters.seen, "changed at most what it saw");
        must(counters.dropped <= counters.seen + adapter::queued(&counters), "dropped at most what it saw");
        must(counters.delayed <= counters.seen, "delayed at most what it saw");
        must(effect.intervals.iter().all(|span| span.start < span.end), "no interval without length");
        must(effect.intervals.windows(2).all(|pair| pair[0].end <= pair[1].start), "intervals follow each other");
        let Span { start, end } = operation.within;
        let inside = |span: &Span| start <= span.start + 1e-9 && span.end <= end + 1e-9;
        must(effect.intervals.iter().all(inside), "inside `within`");
        let times = match used.activation {
            Activation::Condition { times, .. } | Activation::ConditionFor { times, .. } => times,
            Activation::Time { .. } | Activation::Offline => 1,
        };
        must(effect.intervals.len() <= times as usize, "no more often than permitted");
        if let Activation::ConditionFor { length, .. } = used.activation {
            must(effect.intervals.iter().all(|span| span.length() <= length + 1e-9), "no longer than its length");
        }
        // One that begins in the last instant of a run is active for no time.
        let at_the_end = effect.first_touch.is_none_or(|touch| touch == observed.end);
        must(counters.seen == 0 || !effect.intervals.is_empty() || at_the_end, "sees messages only while it is active");
        must(effect.first_touch <= effect.last_touch, "touches first, then last");
    }
    if case.plan.campaign.copies == Copies::Apart && adapter::KEEPS_COPIES_APART {
        let all = || case.test.operations.iter().zip(&observed.operations);
        for (at, (used, effect)) in all().enumerate() {
            for (other, beside) in all().skip(at + 1).filter(|(other, _)| other.operation == used.operation) {
                let together = |a: &Span, b: &Span| a.start < b.end && b.start < a.end;
                if effect.intervals.iter().any(|a| beside.intervals.iter().any(|b| together(a, b))) {
                    wrong.push(format!("copies of {:?} act at the same time", other.operation));
                }
            }
        }
    }
    wrong
}

/// The cases that fail, by their numbers, with what is wrong. All processors look for them, since cases have nothing in
/// common.
fn failures(numbers: std::ops::Range<u64>, check: fn(&Case) -> Vec<String>) -> Vec<(Case, Vec<String>)> {
    let next = AtomicU64::new(numbers.start);
    let search = || {
        let mut failures = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= numbers.end {
                return failures;
            }
            let case = Case::of(number);
            let wrong = check(&case);
            if !wrong.is_empty() {
                failures.push((case, wrong));
            }
        }
    };
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut failures: Vec<_> = std::thread::scope(|scope| {
        let searches: Vec<_> = (0..processors).map(|_| scope.spawn(search)).collect();
        searches.into_iter().flat_map(|search| search.join().unwrap()).collect()
    });
    failures.sort_by_key(|(case, _)| case.number);
    failures
}

/// The cases of some numbers, as many of them as `JUDGE_CASES` says if that is set, or the one that `JUDGE_CASE` names.
pub(crate) fn all_hold(numbers: std::ops::Range<u64>, check: fn(&Case) -> Vec<String>) {
    let set = |name: &str| std::env::var(name).ok().and_then(|number| number.parse::<u64>().ok());
    let numbers = match (set("JUDGE_CASE"), set("JUDGE_CASES")) {
        (Some(only), _) => only..only + 1,
        (None, Some(count)) => numbers.start..numbers.start.saturating_add(count).min(numbers.end),
        (None, None) => numbers,
    };
    let failures = failures(numbers.clone(), check);
    let Some((case, wrong)) = failures.first() else { return };
    let all: Vec<String> = failures
        .iter()
        .flat_map(|(case, wrong)| wrong.iter().map(|wrong| format!("case {}: {wrong}", case.number)))
        .collect();
    let (_, ledger) = adapter::run(&case.plan, &case.test, &case.script);
    panic!(
        "{} of {} cases fail, first case {}:\n{}\n\n{}\n{}\n\nall:\n{}",
        failures.len(),
        numbers.count(),
        case.number,
        wrong.join("\n"),
        words::case(case),
        words::ledger(&ledger),
        all[..all.len().min(100)].join("\n"),
    );
}

#[test]
fn no_verdict_contradicts_a_judge_who_knows_everything() {
    all_hold(0..1_000, contradictions);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn no_verdict_contradicts_a_judge_who_knows_everything_in_many_cases() {
    all_hold(2_000..102_000, contradictions);
}

/// Intervals of operations that are not where the documentation has them.
fn misplaced(case: &Case) -> Vec<String> {
    let (truth, told) = adapter::run(&case.plan, &case.test, &case.truth());
    activations::contradictions(case, &truth, &told)
}

#[test]
fn operations_are_active_where_the_documentation_says() {
    all_hold(0..500, misplaced);
}

#[test]
#[ignore = "long: 100,000 random spaces"]
fn operations_are_active_where_the_documentation_says_in_many_cases() {
    all_hold(2_000..102_000, misplaced);
}

/// Decisions and scores of monitors that are not what the documentation says.
fn misjudged(case: &Case) -> Vec<String> {
    let case = case.with_monitors();
    let (observed, told) = adapter::run(&case.plan, &case.test, &case.script);
    let mut wrong = monitors::contradictions(&case, &observed, &told);
    if !wrong.is_empty() {
        wrong.push(format!("with monitors:\n{}", words::case(&case)));
    }
    wrong
}

#[test]
fn monitors_decide_and_are_scored_as_the_documentation_says() {
    all_hold(0..300, misjudged);
}

#[test]
#[ignore = "long: 100,000 random spaces"]
fn monitors_decide_and_are_scored_as_the_documentation_says_in_many_cases() {
    all_hold(2_000..102_000, misjudged);
}

/// Else the properties would hold of nothing.
#[test]
fn cases_are_of_all_kinds() {
    let mut seen: std::collections::BTreeMap<String, u32> = std::collections::BTreeMap::new();
    let mut count = |what: String| *seen.entry(what).or_default() += 1;
    for number in 0..400 {
        let case = Case::of(number);
        let script: &Script = &case.script;
        let (observed, ledger) = adapter::run(&case.plan, &case.test, script);
        count(format!("outcome {}", observed.outcome.word()));
        let blank = |metric: &Metric| first_blank(&case.plan, metric, &ledger).is_some();
        if case.plan.metrics.iter().any(blank) {
            count("blank heard".to_owned());
        }
        if script.lines.iter().any(|line| !line.subscribed) {
            count("ignored topic".to_owned());
        }
        for requirement in &case.plan.requirements {
            let of = case.plan.metric(requirement.metric).source.clone();
            let kind = serde_json::to_value(of).unwrap()["kind"].as_str().unwrap().to_owned();
            count(format!("{kind} {}", said(requirement, &observed).word()));
        }
        for (used, effect) in case.test.operations.iter().zip(&observed.operations) {
            let by = if matches!(used.activation, Activation::Time { .. }) { "time" } else { "condition" };
            count(format!("by {by} {}", if effect.intervals.is_empty() { "never on" } else { "on" }));
        }
    }
    println!("{seen:#?}");
    assert!(seen.values().all(|&count| count >= 3), "{seen:#?}");
    assert!(seen.len() >= 20, "{seen:#?}");
}
