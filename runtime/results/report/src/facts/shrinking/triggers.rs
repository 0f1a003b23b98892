//! When the operations of a smallest test have to act, in words: by what happens in the undisturbed run.

use serde::Serialize;

use sesame_analysis::trigger::{
    Agreement, Decides, Edge, Event, Holds, Moment, State, TriedWindow, Trigger, Which, Within, describe,
};
use sesame_base::observation::{Course, Happening};
use sesame_base::silence::{PlannedWire, wires};
use sesame_plan::{Activation, CampaignPlan, Span};
use sesame_present::number::fixed;
use sesame_search::shrink::{Shrink, Varied};

/// The share of fresh windows for which a description has to hold: so many of so many.
const HOLDS: (usize, usize) = (4, 5);

/// When an operation of the smallest test has to act.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShrinkTrigger {
    /// The operation.
    pub operation: String,
    /// The position of the operation in the smallest test, from 0.
    pub position: usize,
    /// When it has to act, as in ``has to act while `mode` is CHARGE``; `null` if nothing was found that holds for four
    /// fifths of fresh windows, or too few were tried.
    pub text: Option<String>,
    /// The same by times of the undisturbed run, for programs; `null` like `text`.
    pub decides: Option<Decides>,
    /// How many windows the description was made of, and how many of them it gets right.
    pub made_of: Agreement,
    /// The same of fresh windows, which it was not made of.
    pub fresh: Agreement,
}

/// When each operation by time of the smallest test has to act, as far as variations of its window were run.
pub(super) fn triggers(plan: &CampaignPlan, course: &Course, search: &Shrink) -> Vec<ShrinkTrigger> {
    let Some(smallest) = search.smallest_of_all_messages() else { return Vec::new() };
    let test = &search.tried()[smallest].test;
    let varied = search.variations();
    let wires = wires(plan);
    let by_time = test.operations.iter().enumerate().filter_map(|(position, used)| match used.activation {
        Activation::Time { start, end } => Some((position, used, Span { start, end })),
        _ => None,
    });
    let of = by_time.map(|(position, used, window)| {
        let operation = plan.operation(used.operation);
        let of_this = varied.iter().filter(|varied| varied.operation == position);
        let (fresh, made_of): (Vec<&Varied>, Vec<&Varied>) = of_this.partition(|varied| varied.fresh);
        let [made_of, fresh] = [made_of, fresh].map(|varied| {
            let tried = varied.into_iter().map(|&Varied { window, fails, .. }| TriedWindow { window, fails });
            tried.collect::<Vec<_>>()
        });
        let is_acted_on = |wire: &PlannedWire<'_>| operation.acts_on(wire.topic, wire.member, &used.parameters);
        let own: Vec<u32> = (0..).zip(&wires).filter(|(_, wire)| is_acted_on(wire)).map(|(at, _)| at).collect();
        let holds = |of: Agreement| of.right * HOLDS.1 >= of.of * HOLDS.0;
        let described = describe(course, plan.campaign.end_after, &own, window, &made_of, &fresh);
        let (made_of, fresh) = described.as_ref().map(|found| (found.made_of, found.fresh)).unwrap_or_default();
        let shown = described.filter(|found| holds(found.fresh));
        ShrinkTrigger {
            operation: operation.name.clone(),
            position,
            text: shown.as_ref().map(|found| words(plan, &found.trigger)),
            decides: shown.map(|found| found.decides),
            made_of,
            fresh,
        }
    });
    of.collect()
}

/// When an operation has to act, as what a sentence says of it.
fn words(plan: &CampaignPlan, trigger: &Trigger) -> String {
    match trigger {
        Trigger::Always => "may act at any time".to_owned(),
        Trigger::Around { moment, from, to } => format!("has to act {}", around(plan, moment, *from, *to)),
        Trigger::While { state, least } if *least > 0.0 => {
            format!("has to act for at least {} s {}", fixed(*least, 2), while_words(plan, state))
        }
        Trigger::While { state, .. } => format!("has to act {}", while_words(plan, state)),
        Trigger::Edge { edge, within } => {
            let verb = match edge {
                Edge::Begins => "begin",
                Edge::Ends => "end",
            };
            let when = match within {
                Within::State(state) => while_words(plan, state),
                Within::Around { moment, from, to } => around(plan, moment, *from, *to),
                Within::Times { span } => times(*span),
            };
            format!("has to {verb} {when}")
        }
        Trigger::Between { span } => format!("has to act {}", times(*span)),
    }
}

fn times(Span { start, end }: Span) -> String {
    let digits = if end - start < 0.1 { 3 } else { 2 };
    format!("from {} s to {} s", fixed(start, digits), fixed(end, digits))
}

fn around(plan: &CampaignPlan, moment: &Moment, from: f64, to: f64) -> String {
    let moment_words = moment_words(plan, moment);
    let is_message = moment.what == Event::Happens(Happening::Message);
    let seconds = |offset: f64| format!("{} s", fixed(offset.abs(), 2));
    let side = |offset: f64| if offset < 0.0 { "before" } else { "after" };
    match (from == 0.0, to == 0.0) {
        (true, true) if is_message => format!("at {moment_words}"),
        (true, true) => format!("when {moment_words}"),
        (true, false) if is_message => format!("from {moment_words} until {} later", seconds(to)),
        (true, false) => format!("from when {moment_words} until {} later", seconds(to)),
        (false, true) => format!("from {} before {moment_words} until then", seconds(from)),
        (false, false) if side(from) == side(to) => {
            format!("from {} to {} {} {moment_words}", seconds(from), seconds(to), side(from))
        }
        (false, false) => format!("from {} before to {} after {moment_words}", seconds(from), seconds(to)),
    }
}

/// A moment: a message as a thing, anything else as a clause.
fn moment_words(plan: &CampaignPlan, moment: &Moment) -> String {
    let name = signal(plan, moment.wire, &moment.field);
    if moment.what == Event::Happens(Happening::Message) {
        return match moment.which {
            Which::Any => format!("a message of {name}"),
            Which::Nth(number) => format!("the {} message of {name}", ordinal(number)),
            Which::Last => format!("the last message of {name}"),
        };
    }
    let clause = match &moment.what {
        Event::Becomes(value) => format!("{name} becomes {value}"),
        Event::Happens(Happening::Message | Happening::Begins) => format!("messages of {name} begin to come"),
        Event::Happens(Happening::Ends) => format!("{name} falls silent"),
        Event::Happens(Happening::Changes) => format!("{name} changes"),
        Event::Happens(Happening::Jumps) => format!("{name} jumps"),
        Event::Happens(Happening::SetsOut) => format!("{name} begins to move"),
        Event::Happens(Happening::Rests) => format!("{name} comes to rest"),
        Event::Happens(Happening::ChangesSign) => format!("{name} changes its sign"),
        Event::Happens(Happening::Turns) => format!("{name} turns"),
    };
    match moment.which {
        Which::Any => clause,
        Which::Nth(number) => format!("{clause} for the {} time", ordinal(number)),
        Which::Last => format!("{clause} for the last time"),
    }
}

fn while_words(plan: &CampaignPlan, State { wire, field, holds }: &State) -> String {
    let name = signal(plan, *wire, field);
    match holds {
        Holds::Value(value) => format!("while {name} is {}", constant(plan, *wire, field, value).unwrap_or(value)),
        Holds::Moves => format!("while {name} moves"),
        Holds::Rests => format!("while {name} rests"),
        Holds::Speaks => format!("while messages of {name} come"),
        Holds::FallsSilent => format!("while {name} is silent"),
    }
}

/// The name of a number that a field has, if it is a constant of its message.
fn constant<'a>(plan: &'a CampaignPlan, wire: u32, field: &str, value: &str) -> Option<&'a str> {
    let topic = wires(plan).get(wire as usize)?.topic;
    plan.constant(topic, &field.split('.').collect::<Vec<_>>(), value.parse().ok()?)
}

/// A field as the language names it, or the topic for messages as such; of a topic of several paths, the path.
fn signal(plan: &CampaignPlan, wire: u32, field: &str) -> String {
    let wires = wires(plan);
    let Some(wire) = wires.get(wire as usize) else { return "?".to_owned() };
    let topic = plan.topic(wire.topic);
    let name = if topic.paths.len() == 1 { topic.name.as_str() } else { wire.path };
    let dot = if field.is_empty() || field.starts_with('[') { "" } else { "." };
    format!("`{name}{dot}{field}`")
}

fn ordinal(number: usize) -> String {
    match number {
        1 => return "first".to_owned(),
        2 => return "second".to_owned(),
        3 => return "third".to_owned(),
        _ => {}
    }
    let suffix = match (number % 100, number % 10) {
        (11..=13, _) => "th",
        (_, 1) => "st",
        (_, 2) => "nd",
        (_, 3) => "rd",
        _ => "th",
    };
    format!("{number}{suffix}")
}

#[cfg(test)]
mod tests;
