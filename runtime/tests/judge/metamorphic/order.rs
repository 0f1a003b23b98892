//! The names and the order of declarations change nothing.
//!
//! If two operations have the same priority, the one that is declared first acts first, so each has a priority of its
//! own here. Members of a group keep their order, since random numbers are drawn by it.

use sesame_plan::{RequirementId, Topic};
use sesame_rng::Stream;

use super::{compare_ends, compare_metrics};
use crate::adapter::{self, said};
use crate::case::places::{Places, put};
use crate::case::{Added, Case};
use crate::hooks::HookKind;
use crate::ledger::Message;
use crate::properties::all_hold;
use crate::words;

/// A case with other names and in another order.
struct Reordered {
    case: Case,
    places: Places,
    /// Where the operations of the test are.
    used: Vec<usize>,
}

/// The same case with a priority for each operation.
fn with_priorities(case: &Case) -> Case {
    let mut case = case.clone();
    for (operation, at) in case.plan.operations.iter_mut().zip(0..) {
        operation.priority = operation.priority * 1_000 + at;
    }
    case
}

fn reordered(case: &Case) -> Reordered {
    let mut stream = Stream::derive(case.number, "order", &[]);
    let places = Places {
        topics: stream.permutation(case.plan.topics.len()),
        metrics: stream.permutation(case.plan.metrics.len()),
        operations: stream.permutation(case.plan.operations.len()),
        requirements: stream.permutation(case.plan.requirements.len()),
        monitors: stream.permutation(case.plan.monitors.len()),
    };
    let mut used = stream.permutation(case.test.operations.len());
    // Copies of one operation follow each other as before: which of them acts first is no matter of declarations.
    for operation in 0..case.plan.operations.len() {
        let own: Vec<usize> =
            (0..used.len()).filter(|&at| case.test.operations[at].operation.index() == operation).collect();
        let mut sorted: Vec<usize> = own.iter().map(|&at| used[at]).collect();
        sorted.sort_unstable();
        for (&at, place) in own.iter().zip(sorted) {
            used[at] = place;
        }
    }
    let mut case = case.clone();
    places.refer(&mut case);
    rename(&mut case);
    case.plan.topics = put(places.topics.clone(), case.plan.topics);
    case.carries = put(places.topics.clone(), case.carries);
    case.plan.metrics = put(places.metrics.clone(), case.plan.metrics);
    case.plan.operations = put(places.operations.clone(), case.plan.operations);
    case.plan.requirements = put(places.requirements.clone(), case.plan.requirements);
    case.plan.monitors = put(places.monitors.clone(), case.plan.monitors);
    case.test.operations = put(used.clone(), case.test.operations);
    Reordered { case, places, used }
}

/// Another name, before which what came after it comes.
fn renamed(position: usize) -> String {
    format!("renamed{}", 999 - position)
}

fn rename(case: &mut Case) {
    for (metric, at) in case.plan.metrics.iter_mut().zip(0..) {
        // The name of a hook says what it does.
        let names = HookKind::ALL.map(HookKind::names);
        let other = names.iter().find_map(|[one, other]| match metric.name.as_str() {
            name if name == *one => Some(*other),
            name if name == *other => Some(*one),
            _ => None,
        });
        metric.name = other.map_or_else(|| renamed(at), str::to_owned);
    }
    for (requirement, at) in case.plan.requirements.iter_mut().zip(0..) {
        requirement.name = renamed(at);
    }
    for (operation, at) in case.plan.operations.iter_mut().zip(0..) {
        operation.name = renamed(at);
    }
    for (monitor, at) in case.plan.monitors.iter_mut().zip(0..) {
        monitor.name = renamed(at);
    }
    for (topic, at) in case.plan.topics.iter_mut().zip(0..) {
        topic.name = renamed(at);
        for path in &mut topic.paths {
            *path = path_renamed(path);
        }
    }
    for line in &mut case.script.lines {
        line.path = path_renamed(&line.path);
    }
}

/// Another name on the wire. The robot knows what nothing reads by how its name begins.
fn path_renamed(path: &str) -> String {
    let reversed = |name: &str| name.chars().rev().collect::<String>();
    match path.strip_prefix("unread/") {
        Some(rest) => format!("unread/{}", reversed(rest)),
        None => format!("renamed/{}", reversed(path)),
    }
}

fn differences(case: &Case) -> Vec<String> {
    // In half of the cases with monitors.
    let case = if case.number.is_multiple_of(2) { case.clone() } else { case.with_unread(Added::All).case };
    let case = with_priorities(&case);
    let Reordered { case: other, places, used } = reordered(&case);
    let (before, told) = adapter::run(&case.plan, &case.test, &case.script);
    let (now, told_now) = adapter::run(&other.plan, &other.test, &other.script);
    let mut wrong = Vec::new();
    compare_ends(&before, &now, false, &mut wrong);
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        let mut before = before.metrics[at].clone();
        for lost in &mut before.lost {
            lost.requirement = RequirementId(u32::try_from(places.requirements[lost.requirement.index()]).unwrap());
        }
        before.lost.sort_by_key(|lost| lost.requirement);
        compare_metrics(metric, &before, &now.metrics[places.metrics[at]], &mut wrong);
    }
    for (at, effect) in before.operations.iter().enumerate() {
        let now = &now.operations[used[at]];
        if effect != now {
            wrong.push(format!("operation {at} of the test: {effect:?}, now {now:?}"));
        }
    }
    for (at, requirement) in case.plan.requirements.iter().enumerate() {
        let (before, now) = (said(requirement, &before), said(&other.plan.requirements[places.requirements[at]], &now));
        if before != now {
            wrong.push(format!("it said {before:?} of {}, now {now:?}", requirement.name));
        }
    }
    for (at, monitor) in before.monitors.iter().enumerate() {
        let now = &now.monitors[places.monitors[at]];
        if monitor.decisions != now.decisions {
            wrong.push(format!("monitor {at}: {:?}, now {:?}", monitor.decisions, now.decisions));
        }
    }
    let own = |messages: &[Message], topic: &Topic| -> Vec<Message> {
        messages.iter().filter(|message| topic.paths.contains(&message.path)).cloned().collect()
    };
    for (at, topic) in case.plan.topics.iter().enumerate() {
        let renamed = &other.plan.topics[places.topics[at]];
        for (what, before, now) in
            [("published", &told.published, &told_now.published), ("delivered", &told.delivered, &told_now.delivered)]
        {
            let (before, now) = (own(before, topic), own(now, renamed));
            let same = |(a, b): (&Message, &Message)| Message { path: path_renamed(&a.path), ..a.clone() }.is(b);
            if before.len() != now.len() || !before.iter().zip(&now).all(same) {
                wrong.push(format!("what is {what} on {:?}", topic.paths));
            }
        }
    }
    if !wrong.is_empty() {
        wrong.push(format!("before:\n{}\nnow:\n{}", words::case(&case), words::case(&other)));
    }
    wrong
}

#[test]
fn other_names_and_another_order_of_declarations_change_nothing() {
    all_hold(0..300, differences);
}

#[test]
#[ignore = "long: 100,000 random spaces, each run twice"]
fn other_names_and_another_order_of_declarations_change_nothing_in_many_cases() {
    all_hold(2_000..102_000, differences);
}
