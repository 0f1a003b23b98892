//! Declarative metrics during a run: they hold the last value of each input, and aggregate the values of the formula
//! over time.
//!
//! A formula over one topic, or over each member of one group, is evaluated at each message. A formula that combines
//! several topics, or several members of a group, is evaluated once per instant of simulation time at which one of them
//! had a message, when all messages of that instant are known: so it never combines the new value of one with the old
//! value of another that changes in the same instant. A minimum, maximum or duration that contains the time is
//! evaluated at every instant. While the last value of an input is not finite, the formula is not evaluated.
//!
//! A duration over each member has a tally for each of them, since what holds of one says nothing about another.

use std::collections::BTreeMap;

use sesame_base::time::SimTime;
use sesame_plan::{Aggregate, CampaignPlan, Condition, Formula, Input, Members, TopicId};

use crate::metric::Context;
use crate::metric::expression::{Held, Moment, greatest, holds, least, number};
use crate::metric::held::{HeldInputs, hear};
use crate::value::{Text, Value};

/// The most keys of one metric; messages with further keys are ignored, with a warning of the run.
const KEY_LIMIT: usize = 1_000;

/// A formula in one run.
pub(super) struct FormulaState<'p> {
    formula: &'p Formula,
    /// Whether it combines several topics or several members, so that it is evaluated once per instant.
    several: bool,
    /// Whether it is evaluated at every instant, with a message or without.
    timed: bool,
    /// The whole state without keys; with keys, the initial state of a new one. Of pairs it holds the values.
    common: Stream,
    keys: BTreeMap<Key, Stream>,
    /// One for each pair of a group's members, if the formula is of pairs; one for each member, paired with itself, if
    /// members have tallies of their own.
    pairs: Vec<Pair>,
    /// Per member of that group: whether it had a message in the instant that is over. Kept to be used again.
    spoke: Vec<bool>,
    /// The values of the current message, per input.
    heard: Vec<(usize, Held)>,
}

/// The value that distinguishes the messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Int(i64),
    Text(Text),
}

impl<'p> FormulaState<'p> {
    /// Before the first message.
    pub(super) fn new(formula: &'p Formula, plan: &CampaignPlan) -> Self {
        let held = HeldInputs::new(&formula.inputs, plan);
        let each = || formula.inputs.iter().filter(|input| input.members == Members::Each);
        let paired = each().any(|input| each().any(|other| other.field.topic != input.field.topic));
        let common = Stream {
            held,
            tally: Tally::default(),
            heard: false,
            others: false,
            members: Vec::new(),
            paired,
            latest: None,
        };
        let timed = evaluated_at_every_instant(formula);
        let mut pairs: Vec<(usize, usize)> = pairs_of(&formula.inputs, plan).collect();
        if formula.per.is_none() && (timed || matches!(formula.aggregate, Aggregate::Duration { .. })) {
            let members = each().map(|input| plan.topic(input.field.topic).paths.len()).next().unwrap_or(0);
            pairs.extend((0..members).map(|member| (member, member)));
        }
        let pairs: Vec<Pair> = pairs.into_iter().map(|members| Pair { members, tally: Tally::default() }).collect();
        let topics = || formula.inputs.iter().map(|input| input.field.topic);
        let combined = |input: &Input| {
            matches!(input.members, Members::Min | Members::Max | Members::Sum)
                && plan.topic(input.field.topic).paths.len() > 1
        };
        let several = timed
            || !pairs.is_empty()
            || topics().any(|topic| Some(topic) != topics().next())
            || formula.inputs.iter().any(combined);
        let (keys, spoke, heard) = (BTreeMap::new(), Vec::new(), Vec::new());
        FormulaState { formula, several, timed, common, keys, pairs, spoke, heard }
    }

    /// A message on the `member`th path of a topic, at the context's time. Returns whether the formula waits for the
    /// end of the instant, for which [`FormulaState::settle`] is called.
    pub(super) fn message(&mut self, topic: TopicId, member: usize, value: &Value, context: &mut Context) -> bool {
        match hear(&self.formula.inputs, topic, value, &mut self.heard) {
            Ok(true) => {}
            Ok(false) => context.read_not_finite(),
            Err(lacking) => {
                context.note(format!("a message on `{}` has no value `{lacking}`", context.topic));
                return false;
            }
        }
        let wire = (topic, member);
        match &self.formula.per {
            None => {
                self.common.held.hold(&self.formula.inputs, &self.heard, member);
                self.common.take(self.formula, wire, self.several, context);
            }
            Some(per) if per.topic == topic => {
                let key = match value.at(&per.path) {
                    Some(Value::Int(n)) => Key::Int(*n),
                    Some(Value::Text(text)) => Key::Text(text.clone()),
                    _ => {
                        context.note(format!("a message on `{}` has no key `{}`", context.topic, per.path.join(".")));
                        return false;
                    }
                };
                if self.keys.len() >= KEY_LIMIT && !self.keys.contains_key(&key) {
                    context.note(format!(
                        "`per {}` has more than {KEY_LIMIT} values; further ones are not heard",
                        per.path.join(".")
                    ));
                    return false;
                }
                let stream = self.keys.entry(key).or_insert_with(|| self.common.clone());
                stream.held.hold(&self.formula.inputs, &self.heard, member);
                stream.take(self.formula, wire, self.several, context);
            }
            Some(_) => {
                self.common.held.hold(&self.formula.inputs, &self.heard, member);
                if self.several {
                    // A key that begins in this instant includes earlier messages of the same instant.
                    self.common.take(self.formula, wire, true, context);
                }
                for stream in self.keys.values_mut() {
                    stream.held.hold(&self.formula.inputs, &self.heard, member);
                    stream.take(self.formula, wire, self.several, context);
                }
            }
        }
        if !self.several {
            self.set(context);
        }
        self.several
    }

    /// Whether it is evaluated at every instant; then [`FormulaState::settle`] is called for all of them.
    pub(super) fn is_timed(&self) -> bool {
        self.timed
    }

    /// All messages of the instant at the context's time are known.
    pub(super) fn settle(&mut self, context: &mut Context) {
        if self.timed {
            // Time concerns all members, with a message or without.
            for stream in std::iter::once(&mut self.common).chain(self.keys.values_mut()) {
                (stream.heard, stream.others) = (true, true);
            }
        }
        if !self.pairs.is_empty() {
            self.common.settle_pairs(self.formula, &mut self.pairs, &mut self.spoke, context);
        } else if self.formula.per.is_none() {
            self.common.settle(self.formula, context);
        }
        self.common.forget();
        for stream in self.keys.values_mut() {
            stream.settle(self.formula, context);
        }
        self.set(context);
    }

    /// The value that would have been reached if every number had been finite: messages after the first number that was
    /// not finite count too, unless a rate limit might have excluded them.
    pub(super) fn certain(&self, context: &Context) -> Option<f64> {
        match (self.formula.every, context.not_finite) {
            (Some(_), Some((_, before))) => before,
            _ => context.value,
        }
    }

    /// The run has ended, at the context's time: what holds has held until now.
    pub(super) fn end(&mut self, context: &mut Context) {
        if !matches!(self.formula.aggregate, Aggregate::Duration { .. }) {
            return;
        }
        let keyed = self.keys.values_mut().map(|keyed| &mut keyed.tally);
        let of_pairs = self.pairs.iter_mut().map(|pair| &mut pair.tally);
        for tally in std::iter::once(&mut self.common.tally).chain(keyed).chain(of_pairs) {
            if tally.holds_since.is_some() {
                tally.hold(context.now, false);
            }
        }
        self.set(context);
    }

    /// The value over all keys and pairs: counts are added, of maxima it is the greatest, of all others the least.
    fn set(&self, context: &mut Context) {
        let streams = || std::iter::once(&self.common).chain(self.keys.values()).map(|stream| &stream.tally);
        let tallies = || streams().chain(self.pairs.iter().map(|pair| &pair.tally));
        let values = tallies().filter_map(|tally| tally.value);
        let value = match self.formula.aggregate {
            // In whole nanoseconds, so that equal durations have equal values.
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

/// Whether a formula changes while time passes, and its aggregate sees that: a message more or less counts in all
/// others.
fn evaluated_at_every_instant(formula: &Formula) -> bool {
    let reads_time = match &formula.aggregate {
        Aggregate::Min { of } | Aggregate::Max { of } => of.reads_time(),
        Aggregate::Duration { of } => of.reads_time(),
        Aggregate::Last { .. } | Aggregate::Mean { .. } | Aggregate::Count { .. } => return false,
    };
    reads_time || formula.when.as_ref().is_some_and(Condition::reads_time)
}

/// The pairs of different members of the group whose pairs a formula is of, each once.
pub(super) fn pairs_of(inputs: &[Input], plan: &CampaignPlan) -> impl Iterator<Item = (usize, usize)> {
    let group = inputs.iter().find(|input| input.members == Members::First).map(|input| input.field.topic);
    let count = group.map_or(0, |topic| plan.topic(topic).paths.len());
    (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
}

/// The aggregated values of a pair of members, or of one member, paired with itself.
struct Pair {
    members: (usize, usize),
    tally: Tally,
}

/// The held inputs and the aggregated values; one for each key.
#[derive(Clone)]
struct Stream {
    held: HeldInputs,
    tally: Tally,
    /// Whether a message of the current instant has not been aggregated yet.
    heard: bool,
    /// Whether it changed a value that concerns all members of the groups below.
    others: bool,
    /// The members of groups from which it came, if each member or pair has a formula: each once, the latest last.
    members: Vec<usize>,
    /// Whether members of several groups belong together.
    paired: bool,
    /// The last member that was aggregated, of groups that belong together.
    latest: Option<usize>,
}

impl Stream {
    /// Aggregates a message whose values are held: now, or when its instant is over.
    fn take(&mut self, formula: &Formula, wire: (TopicId, usize), wait: bool, context: &mut Context) {
        if !wait {
            return step(formula, &self.held, &mut self.tally, context);
        }
        self.heard = true;
        let (topic, member) = wire;
        let of_members = |input: &Input| matches!(input.members, Members::Each | Members::First);
        if formula.inputs.iter().any(|input| of_members(input) && input.field.topic == topic) {
            self.members.retain(|&heard| heard != member);
            self.members.push(member);
        }
        // What is computed of all members concerns each of them.
        let of_all = |input: &Input| matches!(input.members, Members::Min | Members::Max | Members::Sum);
        self.others |= formula.inputs.iter().any(|input| of_all(input) && input.field.topic == topic);
    }

    /// The instant is over, and nothing in it is left to aggregate.
    fn forget(&mut self) {
        self.heard = false;
        self.others = false;
        self.members.clear();
    }

    /// The instant is over: aggregates each member of a group that had a message, or the held values if none had one.
    fn settle(&mut self, formula: &Formula, context: &mut Context) {
        if !std::mem::take(&mut self.heard) {
            return;
        }
        if self.members.is_empty() {
            // The values of one member, and not the last one of each group.
            let one = !self.paired || self.latest.is_some_and(|member| self.held.turn_to(&formula.inputs, member));
            if one {
                step(formula, &self.held, &mut self.tally, context);
            }
            return;
        }
        let mut members = std::mem::take(&mut self.members);
        for member in members.drain(..) {
            if self.held.turn_to(&formula.inputs, member) {
                self.latest = Some(member);
                step(formula, &self.held, &mut self.tally, context);
            }
        }
        self.members = members;
    }

    /// The instant is over: aggregates each pair of which a member had a message, or all pairs if another topic had
    /// one.
    fn settle_pairs(&mut self, formula: &Formula, pairs: &mut [Pair], spoke: &mut Vec<bool>, context: &mut Context) {
        // The last pair has the last member.
        let count = pairs.last().map_or(0, |pair| pair.members.1 + 1);
        spoke.clear();
        spoke.resize(count, self.others);
        for &member in &self.members {
            spoke[member] = true;
        }
        for Pair { members, tally } in pairs {
            let concerned = spoke[members.0] || spoke[members.1];
            if concerned && self.held.turn_to_pair(&formula.inputs, *members) {
                step(formula, &self.held, tally, context);
            } else if tally.holds_since.is_some() {
                // Of a silent member it holds on, and conditions over the duration need to see that.
                tally.hold(context.now, true);
            }
        }
    }
}

/// Aggregates the values as they are now, once all are known.
fn step(formula: &Formula, held: &HeldInputs, tally: &mut Tally, context: &mut Context) {
    let now = context.now;
    let Some(inputs) = held.values() else {
        // While a value is not finite, it is not known what holds.
        if tally.holds_since.is_some() {
            tally.hold(now, false);
        }
        return;
    };
    let moment = Moment::new(inputs, now.seconds());
    tally.take(formula, &moment, now, context);
    if let Some(undefined) = moment.undefined() {
        context.note(format!("{undefined} at {now}"));
    }
}

/// The aggregate of a formula's values.
#[derive(Debug, Clone, Default)]
struct Tally {
    value: Option<f64>,
    /// For a mean.
    messages: f64,
    sum: f64,
    /// When the last message counted.
    counted: Option<SimTime>,
    /// For a duration: how long it has held, and since when it holds.
    held: SimTime,
    holds_since: Option<SimTime>,
}

impl Tally {
    /// Aggregates the values of a moment.
    fn take(&mut self, formula: &Formula, moment: &Moment<'_>, now: SimTime, context: &mut Context) {
        let due = |tally: &mut Tally| formula.every.is_none_or(|period| tally.due(now, SimTime::from_seconds(period)));
        let counts = formula.when.as_ref().is_none_or(|when| holds(when, moment));
        let of = match &formula.aggregate {
            Aggregate::Duration { of } => {
                return self.hold(now, counts && holds(of, moment));
            }
            Aggregate::Count { of } => {
                let before = *self.value.get_or_insert(0.0);
                if counts && holds(of, moment) && due(self) {
                    self.value = Some(before + 1.0);
                }
                return;
            }
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => of,
        };
        if !counts {
            return;
        }
        let value = number(of, moment);
        if !value.is_finite() {
            if moment.undefined().is_none() {
                context.note(format!("refused the value {value} at {now}"));
            }
            return;
        }
        if due(self) {
            self.messages += 1.0;
            self.sum += value;
            self.value = Some(match (&formula.aggregate, self.value) {
                (Aggregate::Min { .. }, Some(before)) => least(before, value),
                (Aggregate::Max { .. }, Some(before)) => greatest(before, value),
                (Aggregate::Mean { .. }, _) => self.sum / self.messages,
                _ => value,
            });
        }
    }

    /// Whether a message at this time counts.
    fn due(&mut self, now: SimTime, period: SimTime) -> bool {
        let due = self.counted.is_none_or(|counted| now - counted >= period);
        if due {
            self.counted = Some(now);
        }
        due
    }

    /// What held before has held until now; sets whether it holds from now on.
    fn hold(&mut self, now: SimTime, holds: bool) {
        if let Some(since) = self.holds_since {
            self.held = self.held + (now - since);
        }
        self.holds_since = holds.then_some(now);
        self.value = Some(self.held.seconds());
    }
}
