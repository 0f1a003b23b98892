//! Declarative metrics during a run: they hold the last value of each input, and aggregate the values of the formula
//! over time.
//!
//! A formula over one topic, or over each member of one group, is evaluated at each message. A formula that combines
//! several topics, or several members of a group, is evaluated once per instant of simulation time at which one of them
//! had a message, when all messages of that instant are known: so it never combines the new value of one with the old
//! value of another that changes in the same instant. While the last value of an input is not finite, the formula is
//! not evaluated.
//!
//! A formula over each member of a group is evaluated for those that had a message. If another topic had one, the value
//! of every member has changed, and all of them count. Each member, each pair and each key has a state of its own,
//! since what holds of one says nothing about another.
//!
//! A minimum, maximum or duration that contains the time is evaluated at each step of the simulation too. Where nobody
//! steps, time passes continuously: it is evaluated just before each message of its topics, and whenever one of its
//! comparisons changes. Nothing else that happens in a run causes an evaluation.

use std::collections::BTreeMap;

use sesame_base::activation::TICK;
use sesame_base::time::SimTime;
use sesame_plan::{Aggregate, CampaignPlan, Condition, Formula, Input, Members, TopicId};

use crate::metric::Context;
use crate::metric::attendance::Attendance;
use crate::metric::expression::{Given, Held, greatest, least};
use crate::metric::growth::{next_change, next_crossing};
use crate::metric::held::{HeardValues, HeldInputs, Optional, Read, hear};
use crate::metric::memory::Memories;
use crate::metric::tally::{Tally, step};
use crate::value::{Text, Value};

/// The most keys of one metric; messages with further keys are ignored, with a warning of the run.
const KEY_LIMIT: usize = 1_000;

/// A formula in one run.
pub(super) struct FormulaState<'p> {
    formula: &'p Formula,
    /// Whether it is evaluated once per instant, since it combines several topics or several members.
    several: bool,
    /// Whether it changes while time passes.
    timed: bool,
    of: Of,
    /// The whole state without keys; with keys, the initial state of a new one.
    common: Stream,
    keys: BTreeMap<Key, Stream>,
    /// Who had a message in an instant, for a formula that is evaluated once per instant.
    attendance: Option<Attendance>,
    /// When it was evaluated last.
    evaluated: Option<SimTime>,
    /// The values of the current message, per input.
    heard: HeardValues,
    optional: Optional,
    /// Whether a message may lack the key of `per`.
    key_is_optional: bool,
}

/// What a formula is evaluated for.
enum Of {
    /// The values of its inputs.
    Inputs,
    /// Each of these members of its groups, in ascending order.
    Members(Vec<usize>),
    /// Each pair of different members of its group, or of each member of one group with each of another.
    Pairs(Pairs),
}

/// Pairs of members, each once.
pub(super) struct Pairs {
    /// The first and the second member of each.
    pairs: Vec<(usize, usize)>,
    /// The group of the second members, if it is another one than that of the first.
    other: Option<TopicId>,
}

impl Of {
    /// For how many values it is evaluated.
    fn count(&self) -> usize {
        match self {
            Of::Inputs => 1,
            Of::Members(members) => members.len(),
            Of::Pairs(of) => of.pairs.len(),
        }
    }

    /// How many states there are: that of a member is at its position in the group.
    fn states(&self) -> usize {
        match self {
            Of::Members(members) => members.last().map_or(1, |last| last + 1),
            Of::Inputs | Of::Pairs(_) => self.count(),
        }
    }
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
        let each = formula.inputs.iter().find(|input| input.members == Members::Each);
        let pairs: Vec<(usize, usize)> = pairs_of(&formula.inputs, plan).collect();
        let other = groups_of_pairs(&formula.inputs).and_then(|(one, other)| (one != other).then_some(other));
        let of = match each {
            _ if !pairs.is_empty() => Of::Pairs(Pairs { pairs, other }),
            Some(input) => Of::Members(each_of(&formula.inputs, input.field.topic, plan)),
            None => Of::Inputs,
        };
        let timed = changes_with_time(formula);
        let sources = || formula.inputs.iter().map(Input::source);
        let combined = |input: &Input| {
            let one = matches!(input.members, Members::Each | Members::Only(_));
            !one && plan.topic(input.field.topic).paths.len() > 1
        };
        let several =
            timed || sources().any(|source| Some(source) != sources().next()) || formula.inputs.iter().any(combined);
        // Without these, one state for the values of all members gives the same count, extreme, mean and last value.
        let apart = match of {
            Of::Inputs => false,
            Of::Members(_) => formula.every.is_some() || matches!(formula.aggregate, Aggregate::Duration { .. }),
            Of::Pairs(_) => true,
        };
        FormulaState {
            formula,
            several,
            timed,
            common: Stream::new(
                HeldInputs::new(&formula.inputs, plan),
                Memories::new(&formula.inputs, plan),
                if apart { of.states() } else { 1 },
            ),
            of,
            keys: BTreeMap::new(),
            attendance: several.then(|| Attendance::new(&formula.inputs, plan)),
            evaluated: None,
            heard: HeardValues::default(),
            optional: Optional::new(&formula.inputs, plan),
            key_is_optional: formula.per.as_ref().is_some_and(|per| plan.may_lack(per)),
        }
    }

    /// A message on the `member`th path of a topic, at the context's time. Returns whether the formula waits for the
    /// end of the instant, for which [`FormulaState::settle`] is called.
    pub(super) fn message(&mut self, topic: TopicId, member: usize, value: &Value, context: &mut Context) -> bool {
        let read = hear(&self.formula.inputs, &self.optional, (topic, member), value, &mut self.heard);
        if read == Ok(Read::Lacking) {
            return false;
        }
        if let Some(attendance) = &mut self.attendance {
            attendance.heard(context.now, topic, member);
        }
        match read {
            Ok(Read::NotFinite) => context.read_not_finite(),
            Ok(_) => {}
            Err(lacking) => {
                context.note(format!("a message on `{}` has no value `{lacking}`", context.topic));
                return false;
            }
        }
        if let Some(several) = self.heard.note(&self.formula.inputs) {
            context.note(format!("in a message on `{}`, {several}", context.topic));
        }
        if self.heard.is_nothing() {
            return false;
        }
        let of_members = |input: &Input| matches!(input.members, Members::Each | Members::First | Members::Second);
        let mut read = self.formula.inputs.iter().filter(|input| input.reads(topic, member));
        let second = matches!(&self.of, Of::Pairs(Pairs { other: Some(other), .. }) if *other == topic);
        let spoken =
            Spoken { member: read.clone().any(of_members).then_some((member, second)), all: !read.all(of_members) };
        match &self.formula.per {
            None => {
                self.common.memories.remember(&mut self.heard, member, context.now);
                self.common.hear(&self.formula.inputs, &self.heard, member, spoken);
            }
            Some(per) if per.topic == topic => {
                let key = match value.at(&per.path) {
                    Some(Value::Int(n)) => Key::Int(*n),
                    Some(Value::Text(text)) => Key::Text(text.clone()),
                    _ if self.key_is_optional => return false,
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
                // A key that begins in this instant includes earlier messages of the same instant.
                let stream = self.keys.entry(key).or_insert_with(|| self.common.clone());
                stream.remember(&self.formula.inputs, &self.heard, (member, context.now), spoken);
            }
            Some(_) => {
                for stream in std::iter::once(&mut self.common).chain(self.keys.values_mut()) {
                    stream.remember(&self.formula.inputs, &self.heard, (member, context.now), spoken);
                }
            }
        }
        if !self.several {
            self.settle(context);
        }
        self.several
    }

    /// Whether it changes while time passes.
    pub(super) fn is_timed(&self) -> bool {
        self.timed
    }

    /// Whether its value grows while time passes.
    pub(super) fn grows(&self) -> bool {
        matches!(self.formula.aggregate, Aggregate::Duration { .. })
    }

    /// All messages of the instant at the context's time are known.
    pub(super) fn settle(&mut self, context: &mut Context) {
        if self.formula.per.is_none() {
            self.common.settle(self.formula, &self.of, context);
        } else {
            self.common.forget();
        }
        for stream in self.keys.values_mut() {
            stream.settle(self.formula, &self.of, context);
        }
        self.evaluated = Some(context.now);
        self.set(context);
    }

    /// Evaluates all of it at the context's time, which concerns all members, with a message or without.
    pub(super) fn at_time(&mut self, context: &mut Context) {
        for stream in std::iter::once(&mut self.common).chain(self.keys.values_mut()) {
            (stream.heard, stream.others) = (true, true);
        }
        self.settle(context);
    }

    /// A message comes at the context's time, in a system without steps: what time has made of the values until then.
    pub(super) fn just_before(&mut self, context: &mut Context) {
        let now = context.now;
        let before = SimTime::from_nanos(now.nanos() - TICK.nanos());
        if self.evaluated.is_some_and(|last| last < before) {
            context.now = before;
            self.at_time(context);
            context.now = now;
        }
    }

    /// When one of its comparisons changes, if nothing but time passes from now on.
    pub(super) fn next_change(&self, given: Given<'_>) -> Option<SimTime> {
        self.held().filter_map(|inputs| next_change(self.formula, &inputs, given)).min()
    }

    /// When its value goes beyond a number or reaches it, if nothing but time passes from now on.
    pub(super) fn next_crossing(&self, bound: f64, value: Option<f64>, given: Given<'_>) -> Option<SimTime> {
        let (of, beyond): (_, fn(f64, f64) -> bool) = match &self.formula.aggregate {
            Aggregate::Min { of } => (of, |value, bound| value < bound),
            Aggregate::Max { of } => (of, |value, bound| value > bound),
            Aggregate::Last { of } => (of, |_, _| false),
            _ => return None,
        };
        // What was reached stays reached, except by a last value.
        if value.is_some_and(|value| beyond(value, bound)) {
            return None;
        }
        self.held().filter_map(|inputs| next_crossing(of, bound, &inputs, given)).min()
    }

    /// The values of the inputs, for each of what is aggregated apart.
    fn held(&self) -> impl Iterator<Item = Vec<Held>> {
        // The initial state of new keys aggregates nothing.
        let streams = self.streams().skip(usize::from(self.formula.per.is_some()));
        streams.flat_map(|stream| (0..self.of.count()).flat_map(|at| stream.turned_to(self.formula, &self.of, at)))
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
        if self.grows() {
            self.set(context);
            for tally in self.streams_mut().flat_map(|stream| &mut stream.tallies) {
                tally.stop(context.now);
            }
        }
    }

    /// The run broke off at the context's time, in an instant of which `waits` says whether the formula waited for its
    /// end: that instant counts if it is complete. What time has made of the values counts until the last instant that
    /// was observed.
    pub(super) fn break_off(&mut self, waits: bool, observed: SimTime, context: &mut Context) {
        if waits && self.attendance.as_ref().is_some_and(Attendance::is_complete) {
            self.settle(context);
        }
        if self.evaluated.is_some_and(|last| last < observed) {
            context.now = observed;
            self.grow(context);
        }
    }

    /// What has held until now is part of the value of a duration.
    pub(super) fn grow(&mut self, context: &mut Context) {
        if self.grows() {
            self.set(context);
        }
    }

    /// How long it has held until `now`, and how many times as fast as time passes that grows; `None` if it is no
    /// duration, or has not begun.
    pub(super) fn growth(&self, now: SimTime) -> Option<(SimTime, i64)> {
        if !self.grows() {
            return None;
        }
        let tallies = || self.streams().flat_map(|stream| &stream.tallies).filter(|tally| tally.value.is_some());
        let total = tallies().map(|tally| tally.held_until(now)).reduce(|a, b| a + b)?;
        Some((total, tallies().map(|tally| i64::from(tally.holds())).sum()))
    }

    fn streams(&self) -> impl Iterator<Item = &Stream> {
        std::iter::once(&self.common).chain(self.keys.values())
    }

    fn streams_mut(&mut self) -> impl Iterator<Item = &mut Stream> {
        std::iter::once(&mut self.common).chain(self.keys.values_mut())
    }

    /// The value over all keys, members and pairs: counts and durations are added, of maxima it is the greatest, of all
    /// others the least. Means and last values of the members of a key are those of all their messages.
    fn set(&self, context: &mut Context) {
        let values = || self.streams().flat_map(|stream| &stream.tallies).filter_map(|tally| tally.value);
        let of_messages = |of: fn(&Stream) -> Option<f64>| match self.of {
            Of::Pairs(_) => values().reduce(least),
            Of::Inputs | Of::Members(_) => self.streams().filter_map(of).reduce(least),
        };
        let value = match self.formula.aggregate {
            // In whole nanoseconds, so that equal durations have equal values.
            Aggregate::Duration { .. } => self.growth(context.now).map(|(total, _)| total.seconds()),
            Aggregate::Count { .. } => values().reduce(|a, b| a + b),
            Aggregate::Max { .. } => values().reduce(greatest),
            Aggregate::Min { .. } => values().reduce(least),
            Aggregate::Mean { .. } => of_messages(Stream::mean),
            Aggregate::Last { .. } => of_messages(|stream| stream.last),
        };
        if let Some(value) = value {
            context.set(value);
        }
    }
}

/// Whether a formula changes while time passes, and its aggregate sees that: a message more or less counts in all
/// others. Only the last value of what is integrated is that at the end of the run, if all messages count.
fn changes_with_time(formula: &Formula) -> bool {
    let reads_time = match &formula.aggregate {
        Aggregate::Min { of } | Aggregate::Max { of } => of.reads_time(),
        Aggregate::Duration { of } => of.reads_time(),
        Aggregate::Last { of } => return of.integrates() && formula.when.is_none() && formula.every.is_none(),
        Aggregate::Mean { .. } | Aggregate::Count { .. } => return false,
    };
    reads_time || formula.when.as_ref().is_some_and(Condition::reads_time)
}

/// The pairs of different members of the group whose pairs a formula is of, each once; or those of two groups.
pub(super) fn pairs_of(inputs: &[Input], plan: &CampaignPlan) -> impl Iterator<Item = (usize, usize)> {
    let groups = groups_of_pairs(inputs);
    let count = |topic: TopicId| plan.topic(topic).paths.len();
    let (firsts, seconds) = groups.map_or((0, 0), |(one, other)| (count(one), count(other)));
    let other = groups.is_some_and(|(one, other)| one != other);
    let begin = move |first| if other { 0 } else { first + 1 };
    (0..firsts).flat_map(move |first| (begin(first)..seconds).map(move |second| (first, second)))
}

/// The groups of the first and the second members of pairs, if a formula is of pairs.
fn groups_of_pairs(inputs: &[Input]) -> Option<(TopicId, TopicId)> {
    let group = |side| inputs.iter().find(|input| input.members == side).map(|input| input.field.topic);
    let (one, other) = (group(Members::First), group(Members::Second));
    Some((one.or(other)?, other.or(one)?))
}

/// The members for which a formula with `each of` is evaluated, in ascending order: all except those that it names.
pub(super) fn each_of(inputs: &[Input], group: TopicId, plan: &CampaignPlan) -> Vec<usize> {
    let each = |input: &&Input| input.members == Members::Each;
    let paired: Vec<TopicId> = inputs.iter().filter(each).map(|input| input.field.topic).collect();
    let named = |member: usize| {
        let is_it = |input: &Input| input.only().is_some_and(|only| only as usize == member);
        inputs.iter().any(|input| is_it(input) && paired.contains(&input.field.topic))
    };
    (0..plan.topic(group).paths.len()).filter(|&member| !named(member)).collect()
}

/// Whose values a message changed.
#[derive(Debug, Clone, Copy)]
struct Spoken {
    /// The values of this member; with whether it is of the second group of pairs of two groups.
    member: Option<(usize, bool)>,
    /// The values of every member.
    all: bool,
}

/// The held inputs and what is aggregated; one for each key.
#[derive(Clone)]
struct Stream {
    held: HeldInputs,
    memories: Memories,
    /// One for each member or pair, if they have states of their own.
    tallies: Vec<Tally>,
    /// The sum and number of the values that counted in a mean, of all members.
    sum: (f64, f64),
    /// The value that counted last, of whatever member.
    last: Option<f64>,
    /// Whether there was a message of the current instant.
    heard: bool,
    /// Whether one of them changed the values of every member.
    others: bool,
    /// The members from which one came, each once, the latest last; with whether they are of the second group of pairs
    /// of two groups.
    spoke: Vec<(usize, bool)>,
}

impl Stream {
    fn new(held: HeldInputs, memories: Memories, tallies: usize) -> Self {
        let tallies = vec![Tally::default(); tallies];
        Stream { held, memories, tallies, sum: (0.0, 0.0), last: None, heard: false, others: false, spoke: Vec::new() }
    }

    /// Takes a message whose values are not those that formulas remember of several.
    fn remember(&mut self, inputs: &[Input], heard: &HeardValues, (member, now): (usize, SimTime), spoken: Spoken) {
        if self.memories.is_empty() {
            self.hear(inputs, heard, member, spoken);
            return;
        }
        let mut heard = heard.clone();
        self.memories.remember(&mut heard, member, now);
        self.hear(inputs, &heard, member, spoken);
    }

    /// Takes a message of which all values are computed.
    fn hear(&mut self, inputs: &[Input], heard: &HeardValues, path: usize, Spoken { member, all }: Spoken) {
        if heard.is_nothing() {
            return;
        }
        self.held.hold(inputs, heard, path);
        self.heard = true;
        self.others |= all;
        if let Some(member) = member {
            self.spoke.retain(|&heard| heard != member);
            self.spoke.push(member);
        }
    }

    /// The instant is over, and nothing in it is left to aggregate.
    fn forget(&mut self) {
        self.heard = false;
        self.others = false;
        self.spoke.clear();
    }

    /// The instant is over: aggregates what it changed.
    fn settle(&mut self, formula: &Formula, of: &Of, context: &mut Context) {
        if !self.heard {
            return;
        }
        match of {
            Of::Inputs => self.step(formula, 0, context),
            Of::Members(members) => {
                if self.others {
                    let mut silent = vec![true; of.states()];
                    // Those that the formula names may lie behind the last of the others.
                    for &(member, _) in self.spoke.iter().filter(|(member, _)| *member < of.states()) {
                        silent[member] = false;
                    }
                    for &member in members.iter().filter(|&&member| silent[member]) {
                        self.step_of_member(formula, member, context);
                    }
                }
                for at in 0..self.spoke.len() {
                    let (member, _) = self.spoke[at];
                    if members.binary_search(&member).is_ok() {
                        self.step_of_member(formula, member, context);
                    }
                }
            }
            Of::Pairs(Pairs { pairs, other }) => {
                // The last pair has the last members.
                let (first, second) = pairs.last().map_or((0, 0), |pair| (pair.0 + 1, pair.1 + 1));
                let mut concerned = [vec![self.others; first.max(second)], vec![self.others; second]];
                self.spoke.iter().for_each(|&(member, of_second)| concerned[usize::from(of_second)][member] = true);
                let second = usize::from(other.is_some());
                let concerns = |pair: &(usize, usize)| concerned[0][pair.0] || concerned[second][pair.1];
                for (at, &pair) in pairs.iter().enumerate().filter(|(_, pair)| concerns(pair)) {
                    if self.held.turn_to_pair(&formula.inputs, pair) {
                        self.step(formula, at, context);
                    }
                }
            }
        }
        self.forget();
    }

    fn step_of_member(&mut self, formula: &Formula, member: usize, context: &mut Context) {
        if self.held.turn_to(&formula.inputs, member) {
            self.step(formula, if self.tallies.len() == 1 { 0 } else { member }, context);
        }
    }

    /// Aggregates the values that are held now, of each element if the formula is of the elements of a list.
    fn step(&mut self, formula: &Formula, at: usize, context: &mut Context) {
        let Some(elements) = self.held.elements() else { return self.take(formula, at, context) };
        for element in 0..elements {
            self.held.turn_to_element(element);
            self.take(formula, at, context);
        }
    }

    fn take(&mut self, formula: &Formula, at: usize, context: &mut Context) {
        if let Some(value) = step(formula, &self.held, &mut self.tallies[at], context) {
            self.sum = (self.sum.0 + value, self.sum.1 + 1.0);
            self.last = Some(value);
        }
    }

    fn mean(&self) -> Option<f64> {
        let (sum, count) = self.sum;
        (count > 0.0).then(|| sum / count)
    }

    /// The values of all inputs for one of those that the formula is of, once all are known and finite: of each element
    /// if the formula is of the elements of a list.
    fn turned_to(&self, formula: &Formula, of: &Of, at: usize) -> Vec<Vec<Held>> {
        let mut held = self.held.clone();
        let known = match of {
            Of::Inputs => true,
            Of::Members(members) => held.turn_to(&formula.inputs, members[at]),
            Of::Pairs(Pairs { pairs, .. }) => held.turn_to_pair(&formula.inputs, pairs[at]),
        };
        let values = |held: &HeldInputs| held.values().map(<[Held]>::to_vec);
        if !known {
            return Vec::new();
        }
        let Some(elements) = held.elements() else { return values(&held).into_iter().collect() };
        let of_element = |element| {
            held.turn_to_element(element);
            values(&held)
        };
        (0..elements).filter_map(of_element).collect()
    }
}
