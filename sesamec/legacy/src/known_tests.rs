//! Tests of the original that a campaign repeats, as regression tests in the words of the language.

use std::mem::discriminant;

use sesame_notation::{self as notation, Unit, activation_named, quoted};
use sesame_plan::condition as grown;
use sesame_plan::{self as plan, MetricId, Span};

use crate::notes::Kind;
use crate::original::{
    Activation, Comparison, Condition, Domain, MetricSource, Operand, Operation, OperationKind, Reference, Test,
};
use crate::parts::{Effect, matching};
use crate::writer::{Writer, called_before, meant};
use crate::xml::{cleaned, printable};

/// Why a condition that compares a time with something else is not imported.
pub(crate) const NO_SECONDS: &str = "its condition compares seconds with a plain number";

/// Levels of a condition that the language permits.
const MOST_LEVELS: u32 = 40;

/// A test that is repeated, as a regression test with these members; its name.
pub(crate) fn known_test(writer: &mut Writer<'_>, test: &Test, members: Vec<String>, text: &mut String) -> String {
    let name = writer.name("test", &test.name);
    let doc = if name == *test.name { String::new() } else { called_before(&test.name) };
    text.push('\n');
    text.push_str(&notation::test_block(&doc, &name, members));
    name
}

/// The member of a regression test that disturbs nothing: an operation that adds 0, or loses nothing. One that the test
/// holds is preferred.
pub(crate) fn harmless_member(writer: &mut Writer<'_>, test: &Test, end: f64) -> Option<String> {
    let used = writer.mapped.holders.used_by(writer.original, [test]);
    let others = (0..writer.mapped.parts.len()).filter(|at| !used.contains(at));
    let holders = &writer.mapped.holders.operations;
    let parts = used.iter().copied().chain(others);
    let mut harmless =
        parts.flat_map(|at| writer.mapped.parts[at].iter().map(move |part| (at, part))).filter_map(|(at, part)| {
            let said = match (&part.effect, &holders[at].kind) {
                (&Effect::Value { set, relative: true }, OperationKind::RandomValue { values, .. }) => {
                    let Domain::Reals(low, high) = values[set].domain else { return None };
                    (low.min(high) <= 0.0 && low.max(high) >= 0.0).then(|| ("offset", Unit::None.range(0.0, 0.0)))
                }
                (Effect::Loss, OperationKind::PacketLoss { keep }) if keep.0.max(keep.1) >= 1.0 => {
                    Some(("loss", Unit::Share.number(0.0)))
                }
                _ => None,
            };
            said.map(|(parameter, nothing)| (at, &part.name, parameter, nothing))
        });
    let (at, name, parameter, nothing) = harmless.next()?;
    let Span { start, end } = match writer.permitted(at) {
        Some(window) if window.start < end => Span { start: window.start, end: window.end.min(end) },
        Some(_) => return None,
        None => Span { start: 0.0, end },
    };
    let (shown, harmless) = (printable(&test.name), format!("{name} {parameter} {nothing}"));
    let window = when(writer, &plan::Activation::Time { start, end });
    let member = notation::test_member(name, [(parameter, nothing)], &window, None);
    let nothing = if test.operations.is_empty() { "disturbs nothing" } else { "has no operation left" };
    writer.notes.say(Kind::Changed, format!("known test `{shown}` {nothing}: it holds `{harmless}`"));
    Some(member)
}

/// The operations of a regression test, as members of its block; those that cannot be translated are noted. The test is
/// over after so many seconds.
pub(crate) fn held_by(writer: &mut Writer<'_>, test: &Test, over: f64) -> Vec<String> {
    let shown = printable(&test.name);
    let mut members = Vec::new();
    for operation in &test.operations {
        let Some(at) = writer.mapped.holders.find(writer.original, operation) else { continue };
        let template = writer.mapped.holders.operations[at].clone();
        for part in writer.mapped.parts[at].clone() {
            let offline = matches!(part.effect, Effect::Custom { offline: true, .. });
            let said = |writer: &Writer<'_>| {
                let window = if offline {
                    Ok(Window::Exact(plan::Activation::Offline))
                } else {
                    window(writer, operation, at, over)
                };
                let window = window?;
                let chosen = choices(operation, &template, &part.effect, Bounds::Kept)?;
                let meant = choices(operation, &template, &part.effect, Bounds::Ignored)?;
                Ok::<_, String>((window, chosen, meant))
            };
            let member = match said(writer) {
                Ok((window, chosen, meant)) => {
                    let beyond = chosen.iter().zip(&meant).filter(|(chosen, meant)| chosen != meant);
                    let mut beyond: Vec<String> = beyond
                        .map(|((parameter, chosen), (_, meant))| format!("its {parameter} {meant} is {chosen} now"))
                        .collect();
                    let window = match window {
                        Window::Exact(window) => window,
                        Window::Cut { meant, cut } => {
                            let times = |span: Span| {
                                format!(
                                    "from {} to {}",
                                    Unit::SECONDS.number(span.start),
                                    Unit::SECONDS.number(span.end)
                                )
                            };
                            beyond.push(format!("its window {} is {} now", times(meant), times(cut)));
                            plan::Activation::Time { start: cut.start, end: cut.end }
                        }
                    };
                    for what in beyond {
                        let part = &part.name;
                        let text = format!("known test `{shown}`, beyond what operation `{part}` permits: {what}");
                        writer.notes.say(Kind::Changed, text);
                    }
                    let seed = (operation.seed != 0 && !offline).then(|| operation.seed.cast_unsigned());
                    notation::test_member(&part.name, chosen, &when(writer, &window), seed)
                }
                Err(why) => {
                    writer.notes.say(Kind::LeftOut, format!("known test `{shown}`, operation `{}`: {why}", part.name));
                    continue;
                }
            };
            members.push(member);
        }
    }
    members
}

/// When an operation of a regression test is active, as text. The metrics of a condition are those of the original, by
/// position.
fn when(writer: &Writer<'_>, activation: &plan::Activation) -> String {
    let before_start = plan::OperationKind::Custom { moment: plan::Moment::BeforeStart };
    activation_named(activation, &before_start, &|metric| {
        let at = metric.index();
        let name = writer.mapped.metrics[at].as_deref();
        let name = name.expect("a condition compares metrics that were translated");
        (name, if is_timed(writer, at) { Unit::SECONDS } else { Unit::None })
    })
}

fn is_timed(writer: &Writer<'_>, metric: usize) -> bool {
    writer.original.metrics[metric].source == MetricSource::FuzzingTime
}

/// Whether choices stay within what the space permits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bounds {
    /// What is not permitted is the nearest that is, so that the space is right.
    Kept,
    /// As the test has it.
    Ignored,
}

/// What a test chooses, by parameter.
fn choices<'e>(
    operation: &Operation,
    template: &Operation,
    effect: &'e Effect,
    bounds: Bounds,
) -> Result<Vec<(&'e str, String)>, String> {
    let kept = bounds == Bounds::Kept;
    let sets = |operation: &Operation| match &operation.kind {
        OperationKind::RandomValue { values: sets, .. } | OperationKind::Custom { parameters: sets } => sets.clone(),
        _ => Vec::new(),
    };
    let (held, permitted) = (sets(operation), sets(template));
    // No delay is negative.
    let permitted_delay = |delay: f64| match template.kind {
        OperationKind::Latency { delay: of, .. } if kept => delay.clamp(of.0.min(of.1), of.0.max(of.1)).max(0.0),
        _ => delay.max(0.0),
    };
    let domain = |at: usize| {
        let chosen = matching(&held, &permitted, at).map(|set| &set.domain);
        chosen.ok_or_else(|| "it has no value of its own there".to_owned())
    };
    let limits = |at: usize| permitted.get(at).filter(|_| kept).map(|set| &set.domain);
    let within = |low: f64, high: f64, at: usize| match limits(at) {
        Some(&Domain::Reals(from, to)) => {
            let (from, to) = (from.min(to), from.max(to));
            (low.clamp(from, to), high.clamp(from, to))
        }
        Some(&Domain::Integers(from, to)) => {
            let (from, to) = (from.min(to) as f64, from.max(to) as f64);
            (low.clamp(from, to), high.clamp(from, to))
        }
        _ => (low, high),
    };
    Ok(match (effect, &operation.kind) {
        (&Effect::Value { set, relative }, _) => {
            let (low, high) = match *domain(set)? {
                Domain::Reals(low, high) => (low.min(high), low.max(high)),
                Domain::Integers(low, high) => (low.min(high) as f64, low.max(high) as f64),
                _ => return Err("it does not choose numbers".to_owned()),
            };
            let (low, high) = within(low, high, set);
            let word = if relative { "offset" } else { "value" };
            vec![(word, Unit::None.range(low, high))]
        }
        (Effect::Loss, OperationKind::PacketLoss { keep }) => {
            let chosen = match template.kind {
                OperationKind::PacketLoss { keep: of } if kept => {
                    keep.0.min(keep.1).clamp(of.0.min(of.1), of.0.max(of.1))
                }
                _ => keep.0.min(keep.1),
            };
            vec![("loss", Unit::Share.number(meant(1.0 - chosen.clamp(0.0, 1.0))))]
        }
        (Effect::Delay { randomised: false }, OperationKind::Latency { delay, .. }) => {
            vec![("delay", Unit::SECONDS.number(permitted_delay(delay.0.min(delay.1))))]
        }
        (Effect::Delay { randomised: true }, OperationKind::Latency { delay, .. }) => {
            let (low, high) = (delay.0.min(delay.1), delay.0.max(delay.1));
            vec![("delay", Unit::SECONDS.range(permitted_delay(low), permitted_delay(high)))]
        }
        (Effect::Custom { parameters, .. }, _) => {
            let mut all = Vec::new();
            for (name, at) in parameters {
                let chosen = domain(*at)?;
                if permitted.get(*at).is_some_and(|set| discriminant(&set.domain) != discriminant(chosen)) {
                    return Err(format!("what it chooses for `{name}` is of another kind than its template permits"));
                }
                let chosen = match chosen {
                    Domain::Reals(low, high) => Unit::None.number(within(low.min(*high), *high, *at).0),
                    Domain::Integers(low, high) => {
                        let low = *low.min(high);
                        Unit::None.number(match limits(*at) {
                            Some(&Domain::Integers(from, to)) => low.clamp(from.min(to), from.max(to)) as f64,
                            _ => low as f64,
                        })
                    }
                    Domain::Points(low, _) => {
                        let mut point = *low;
                        if let Some(Domain::Points(from, to)) = limits(*at) {
                            for axis in 0..3 {
                                point[axis] = point[axis].clamp(from[axis].min(to[axis]), from[axis].max(to[axis]));
                            }
                        }
                        Unit::None.point(point)
                    }
                    Domain::Texts(texts) => {
                        let offered = |text: &str| match permitted.get(*at).map(|set| &set.domain) {
                            Some(Domain::Texts(offered)) => offered.iter().any(|other| **other == *text),
                            _ => true,
                        };
                        match texts.first().filter(|text| offered(text)) {
                            Some(text) => quoted(&cleaned(text)),
                            None => return Err("it chooses no text that its template offers".to_owned()),
                        }
                    }
                    Domain::Other(_) => {
                        return Err("it chooses a kind of value that the original never read".to_owned());
                    }
                };
                all.push((name.as_str(), chosen));
            }
            all
        }
        (Effect::Blackhole, _) => Vec::new(),
        (Effect::Loss | Effect::Delay { .. }, _) => return Err("it does something else than its template".to_owned()),
    })
}

/// When an operation of a regression test is active.
enum Window {
    /// As the test has it. The metrics of a condition are those of the original, by position.
    Exact(plan::Activation),
    /// A window that is longer than the operation permits.
    Cut { meant: Span, cut: Span },
}

/// When an operation of a regression test is active, which is one of those at this position and over after so many
/// seconds.
fn window(writer: &Writer<'_>, operation: &Operation, at: usize, over: f64) -> Result<Window, String> {
    let forever = 1e6;
    let times = 1;
    let never = || Err("it is never active".to_owned());
    let permitted = writer.permitted(at);
    if let Some(permitted) = permitted.filter(|permitted| permitted.start >= over) {
        let (start, over) = (Unit::SECONDS.number(permitted.start), Unit::SECONDS.number(over));
        return Err(format!("it may be active from {start}, when the test is over, after {over}"));
    }
    let exact = |activation| Ok(Window::Exact(activation));
    match &operation.activation {
        Activation::Time(start, end) => {
            let meant = Span { start: start.min(*end).max(0.0), end: start.max(*end) };
            if meant.start >= over {
                return Err(format!("its window begins when the test is over, after {}", Unit::SECONDS.number(over)));
            }
            let within = permitted.unwrap_or(Span { start: 0.0, end: f64::INFINITY });
            let cut = Span { start: meant.start.max(within.start), end: meant.end.min(within.end) };
            if meant.start >= meant.end {
                never()
            } else if cut.start >= cut.end {
                Err("its window lies beyond that of the operation".to_owned())
            } else if cut == meant {
                exact(plan::Activation::Time { start: cut.start, end: cut.end })
            } else {
                Ok(Window::Cut { meant, cut })
            }
        }
        Activation::Condition(start, end) => {
            let start = match start.as_ref().map(|condition| settled(writer, condition)).transpose()? {
                Some(Truth::Sometimes(start)) => start,
                Some(Truth::Always) => return Err("its start condition always holds".to_owned()),
                Some(Truth::Never) | None => return never(),
            };
            match end.as_ref().map(|condition| settled(writer, condition)).transpose()? {
                Some(Truth::Sometimes(end)) => exact(plan::Activation::Condition { start, end, times }),
                Some(Truth::Always) => Err("its end condition always holds".to_owned()),
                Some(Truth::Never) | None => exact(plan::Activation::ConditionFor { start, length: forever, times }),
            }
        }
        Activation::ConditionFor(start, length) => {
            match start.as_ref().map(|condition| settled(writer, condition)).transpose()? {
                Some(Truth::Sometimes(start)) if *length > 0.0 => {
                    exact(plan::Activation::ConditionFor { start, length: *length, times })
                }
                Some(Truth::Always) => Err("its start condition always holds".to_owned()),
                _ => never(),
            }
        }
        Activation::Missing => Err("it does not say when it is active".to_owned()),
    }
}

/// A condition, unless it goes one way in every test.
enum Truth {
    Always,
    Never,
    Sometimes(grown::Condition),
}

fn settled(writer: &Writer<'_>, condition: &Condition) -> Result<Truth, String> {
    settled_at(writer, condition, 1)
}

fn settled_at(writer: &Writer<'_>, condition: &Condition, level: u32) -> Result<Truth, String> {
    if level > MOST_LEVELS {
        return Err(format!("its condition has more than {MOST_LEVELS} levels"));
    }
    let both = |a: &Condition, b: &Condition| -> Result<(Truth, Truth), String> {
        Ok((settled_at(writer, a, level + 1)?, settled_at(writer, b, level + 1)?))
    };
    Ok(match condition {
        Condition::And(a, b) => match both(a, b)? {
            (Truth::Never, _) | (_, Truth::Never) => Truth::Never,
            (Truth::Always, other) | (other, Truth::Always) => other,
            (Truth::Sometimes(a), Truth::Sometimes(b)) => {
                Truth::Sometimes(grown::Condition::And(Box::new(a), Box::new(b)))
            }
        },
        Condition::Or(a, b) => match both(a, b)? {
            (Truth::Always, _) | (_, Truth::Always) => Truth::Always,
            (Truth::Never, other) | (other, Truth::Never) => other,
            (Truth::Sometimes(a), Truth::Sometimes(b)) => {
                Truth::Sometimes(grown::Condition::Or(Box::new(a), Box::new(b)))
            }
        },
        Condition::Compare(left, by, right) => {
            let named = |metric: Reference| {
                let at = writer.original.metric(metric).filter(|&at| writer.mapped.metrics[at].is_some());
                at.ok_or_else(|| "its condition compares something that is not a metric".to_owned())
            };
            let variable = named(*left)?;
            let timed = is_timed(writer, variable);
            let comparison = |right: grown::Operand| {
                Truth::Sometimes(grown::Condition::Compare { left: operand(variable), by: (*by).into(), right })
            };
            match *right {
                Operand::Integer(value) if timed && value < 0 => match by {
                    Comparison::Greater => Truth::Always,
                    Comparison::Less | Comparison::Equal => Truth::Never,
                },
                Operand::Integer(0) if timed && *by == Comparison::Less => Truth::Never,
                Operand::Integer(value) => comparison(grown::Operand::Number(value as f64)),
                Operand::Metric(other) => match named(other)? {
                    other if other == variable && *by == Comparison::Equal => Truth::Always,
                    other if other == variable => Truth::Never,
                    other if is_timed(writer, other) != timed => {
                        return Err(NO_SECONDS.to_owned());
                    }
                    other => comparison(operand(other)),
                },
            }
        }
    })
}

/// A metric of the original, by position, as a variable of a condition.
fn operand(metric: usize) -> grown::Operand {
    grown::Operand::Variable(MetricId(u32::try_from(metric).expect("a file has fewer than 2^32 metrics")))
}
