//! Declarative metrics during a run: the last value of each input is held, and what the formula says becomes of the values
//! over time is kept up with every message.

use std::collections::BTreeMap;

use sesame_plan::{Aggregate, CampaignPlan, Formula, TopicId};

use super::Context;
use super::expression::{Held, greatest, holds, least, number};
use super::held::{HeldInputs, hear};
use crate::time::SimTime;
use crate::value::{Text, Value};

/// The most keys of one metric; messages of further ones are not heard, and the run is warned.
const KEY_LIMIT: usize = 1_000;

/// A formula in one run.
pub(super) struct FormulaState<'p> {
    formula: &'p Formula,
    /// All there is without keys; with them, what a new key begins with.
    common: Stream,
    keys: BTreeMap<Key, Stream>,
    /// What the message at hand holds, per input.
    heard: Vec<(usize, Held)>,
}

/// A value that tells the messages of a topic apart.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Int(i64),
    Text(Text),
}

impl<'p> FormulaState<'p> {
    /// Before the first message.
    pub(super) fn new(formula: &'p Formula, plan: &CampaignPlan) -> Self {
        let common = Stream { held: HeldInputs::new(&formula.inputs, plan), tally: Tally::default() };
        FormulaState { formula, common, keys: BTreeMap::new(), heard: Vec::new() }
    }

    /// A message on the `member`th path of a topic, at the context's time.
    pub(super) fn message(&mut self, topic: TopicId, member: usize, value: &Value, context: &mut Context) {
        if let Err(lacking) = hear(&self.formula.inputs, topic, value, &mut self.heard) {
            context.note(format!("a message on `{}` has no value `{lacking}`", context.topic));
            return;
        }
        match &self.formula.per {
            None => {
                self.common.held.hold(&self.formula.inputs, &self.heard, member);
                self.common.step(self.formula, context);
            }
            Some(per) if per.topic == topic => {
                let key = match value.at(&per.path) {
                    Some(Value::Int(n)) => Key::Int(*n),
                    Some(Value::Text(text)) => Key::Text(text.clone()),
                    _ => {
                        context.note(format!("a message on `{}` has no key `{}`", context.topic, per.path.join(".")));
                        return;
                    }
                };
                if self.keys.len() >= KEY_LIMIT && !self.keys.contains_key(&key) {
                    context.note(format!(
                        "`per {}` has more than {KEY_LIMIT} values; further ones are not heard",
                        per.path.join(".")
                    ));
                    return;
                }
                let stream = self.keys.entry(key).or_insert_with(|| self.common.clone());
                stream.held.hold(&self.formula.inputs, &self.heard, member);
                stream.step(self.formula, context);
            }
            Some(_) => {
                self.common.held.hold(&self.formula.inputs, &self.heard, member);
                for stream in self.keys.values_mut() {
                    stream.held.hold(&self.formula.inputs, &self.heard, member);
                    stream.step(self.formula, context);
                }
            }
        }
        self.set(context);
    }

    /// The run has come to its end, at the context's time: what holds has held until now.
    pub(super) fn end(&mut self, context: &mut Context) {
        if !matches!(self.formula.aggregate, Aggregate::Duration { .. }) {
            return;
        }
        for tally in std::iter::once(&mut self.common.tally).chain(self.keys.values_mut().map(|it| &mut it.tally)) {
            if tally.holds_since.is_some() {
                tally.hold(context.now, false);
            }
        }
        self.set(context);
    }

    /// The value over all keys: what is counted adds up, the greatest is the greatest, and of all others it is the least.
    fn set(&self, context: &mut Context) {
        let tallies = || std::iter::once(&self.common).chain(self.keys.values()).map(|stream| &stream.tally);
        let values = tallies().filter_map(|tally| tally.value);
        let value = match self.formula.aggregate {
            // In whole nanoseconds, so that what held equally long is equal.
            Aggregate::Duration { .. } => tallies()
                .filter(|tally| tally.value.is_some())
                .map(|tally| tally.held)
                .reduce(|a, b| a + b)
                .map(SimTime::seconds),
            Aggregate::Count { .. } => values.reduce(|a, b| a + b),
            Aggregate::Max { .. } => values.reduce(greatest),
            Aggregate::Last { .. } | Aggregate::Min { .. } | Aggregate::Mean { .. } => values.reduce(least),
        };
        if let Some(value) = value {
            context.set(value);
        }
    }
}

/// What is held of the inputs, and what has become of the values so far; one for each key.
#[derive(Clone)]
struct Stream {
    held: HeldInputs,
    tally: Tally,
}

impl Stream {
    /// Takes the values into account as they are now, once all are known.
    fn step(&mut self, formula: &Formula, context: &mut Context) {
        let Some(inputs) = self.held.values() else { return };
        let now = context.now;
        let due = |tally: &mut Tally| formula.every.is_none_or(|period| tally.due(now, SimTime::from_seconds(period)));
        let counts = formula.when.as_ref().is_none_or(|when| holds(when, inputs));
        let of = match &formula.aggregate {
            Aggregate::Duration { of } => {
                return self.tally.hold(now, counts && holds(of, inputs));
            }
            Aggregate::Count { of } => {
                let count = self.tally.value.get_or_insert(0.0);
                let before = *count;
                if counts && holds(of, inputs) && due(&mut self.tally) {
                    self.tally.value = Some(before + 1.0);
                }
                return;
            }
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => of,
        };
        if !counts {
            return;
        }
        let value = number(of, inputs);
        if !value.is_finite() {
            context.note(format!("refused the value {value} at {now}"));
            return;
        }
        if due(&mut self.tally) {
            let tally = &mut self.tally;
            tally.messages += 1.0;
            tally.sum += value;
            tally.value = Some(match (&formula.aggregate, tally.value) {
                (Aggregate::Min { .. }, Some(before)) => least(before, value),
                (Aggregate::Max { .. }, Some(before)) => greatest(before, value),
                (Aggregate::Mean { .. }, _) => tally.sum / tally.messages,
                _ => value,
            });
        }
    }
}

/// What has become of a formula's values.
#[derive(Debug, Clone, Default)]
struct Tally {
    value: Option<f64>,
    /// For a mean.
    messages: f64,
    sum: f64,
    /// When the last message counted.
    counted: Option<SimTime>,
    /// For a duration: how long it has held, and since when it does.
    held: SimTime,
    holds_since: Option<SimTime>,
}

impl Tally {
    /// Whether a message counts that comes now.
    fn due(&mut self, now: SimTime, period: SimTime) -> bool {
        let due = self.counted.is_none_or(|counted| now - counted >= period);
        if due {
            self.counted = Some(now);
        }
        due
    }

    /// What held before has held until now; whether it does from now on.
    fn hold(&mut self, now: SimTime, holds: bool) {
        if let Some(since) = self.holds_since {
            self.held = self.held + (now - since);
        }
        self.holds_since = holds.then_some(now);
        self.value = Some(self.held.seconds());
    }
}
