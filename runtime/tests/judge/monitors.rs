//! What monitors decide and what they are worth, from the complete list of messages, by the words of the documentation.

use std::collections::{BTreeMap, BTreeSet};

use sesame_base::observation::{Observation, Outcome};
use sesame_plan::{
    Bound, Evidence, Gate, Input, Members, Metric, MetricSource, Monitor, MonitorState, Requirement, Score, Side,
    StaleIs, Trend,
};
use sesame_record::Verdict;

use crate::adapter::{STEP, said};
use crate::case::Case;
use crate::computations::{Computed, number};
use crate::formulas::{Judged, first_blank, holds, judged};
use crate::ledger::{Ledger, Message};
use crate::words;

fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A time without interruption in one state.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stay {
    state: MonitorState,
    from: i64,
    to: i64,
}

/// What is wrong with monitors all evidence of which hears one side.
pub(crate) fn contradictions(case: &Case, observed: &Observation, ledger: &Ledger) -> Vec<String> {
    let mut wrong = Vec::new();
    let whole = matches!(observed.outcome, Outcome::Completed | Outcome::NoEffect);
    let decisions = decisions(case, ledger, whole);
    for (at, (expected, shown)) in decisions.iter().zip(&observed.monitors).enumerate() {
        let mut seen: Vec<(i64, MonitorState)> =
            shown.decisions.iter().map(|decision| (nanos(decision.time), decision.state)).collect();
        if seen.first() != Some(&(0, MonitorState::Otherwise)) {
            seen.insert(0, (0, MonitorState::Otherwise));
        }
        if *expected != seen {
            wrong.push(format!("monitor {at} decided {seen:?}, while the judge has {expected:?}"));
        }
    }
    // A requirement has a hazard exactly where it is violated, also in a run that broke off.
    for (monitor, id) in case.plan.hazards_to_foresee() {
        let requirement = case.plan.requirement(id);
        let violated = said(requirement, observed) == Verdict::Violated;
        let shown = &observed.metrics[requirement.metric.index()];
        // When a formula was lost that has no value is left to other tests.
        if matches!(case.plan.metric(requirement.metric).source, MetricSource::Robustness { .. }) && !shown.set {
            continue;
        }
        let has_hazard = observed.monitors[monitor.index()].hazards.iter().any(|hazard| hazard.requirement == id);
        if violated != has_hazard {
            wrong.push(format!("{}: violated {violated}, hazard {has_hazard}", requirement.name));
        }
    }
    if !wrong.is_empty() || !whole {
        return wrong;
    }
    for (at, metric) in case.plan.metrics.iter().enumerate() {
        let MetricSource::Monitor { monitor, score } = metric.source else { continue };
        let stays = stays(&decisions[monitor.index()], ledger.end);
        if let Ok(expected) = scored(case, &stays, score, ledger)
            && expected != observed.metrics[at].value
        {
            let seen = observed.metrics[at].value;
            wrong.push(format!("{}: {seen:?}, while the judge has {expected:?}", words::metric(metric)));
        }
    }
    wrong
}

/// The decisions of each monitor, the first of which is its safe state at time zero. `whole` is whether the run came to
/// its end.
fn decisions(case: &Case, ledger: &Ledger, whole: bool) -> Vec<Vec<(i64, MonitorState)>> {
    let monitors = &case.plan.monitors;
    let mut decisions = vec![vec![(0, MonitorState::Otherwise)]; monitors.len()];
    let heard = |side| if side == Side::Outbound { &ledger.delivered } else { &ledger.published };
    let Some(side) = monitors.iter().flat_map(|monitor| &monitor.evidence).map(|evidence| evidence.side).next() else {
        return decisions;
    };
    let messages = heard(side);
    // Timers of all evidence: it may have been held for long enough, or be too old.
    let mut timers = BTreeSet::new();
    for evidence in monitors.iter().flat_map(|monitor| &monitor.evidence) {
        for message in messages {
            timers.insert(message.time + nanos(evidence.held));
            timers.extend(evidence.stale.map(|stale| message.time + nanos(stale.after) + 1));
        }
    }
    let mut timers = timers.into_iter().filter(|&timer| timer <= ledger.end).peekable();
    let mut decide = |time: i64, messages: &[Message], instant: Instant| {
        let heard = Heard { case, time, messages, instant };
        let mut states: Vec<MonitorState> = Vec::new();
        for (at, monitor) in monitors.iter().enumerate() {
            let state = heard.state(monitor, &states);
            states.push(state);
            if decisions[at].last().is_some_and(|last| last.1 != state) {
                decisions[at].push((time, state));
            }
        }
    };
    for (at, message) in messages.iter().enumerate() {
        while let Some(timer) = timers.next_if(|&timer| timer <= message.time) {
            decide(timer, &messages[..at], Instant::Over);
        }
        decide(message.time, &messages[..=at], Instant::Going);
        match messages.get(at + 1) {
            Some(next) if next.time == message.time => {}
            None if message.time == ledger.end && !whole => decide(message.time, messages, Instant::PerhapsOver),
            _ => decide(message.time, &messages[..=at], Instant::Over),
        }
    }
    for timer in timers {
        decide(timer, messages, Instant::Over);
    }
    decisions
}

/// What is known of the instant at hand.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Instant {
    /// More of its messages may come.
    Going,
    /// The run broke off in it. It counts for what heard all its sources in it.
    PerhapsOver,
    Over,
}

/// What was heard until a moment.
#[derive(Clone, Copy)]
struct Heard<'a> {
    case: &'a Case,
    time: i64,
    messages: &'a [Message],
    instant: Instant,
}

/// What the condition of evidence said at an instant.
struct Reading {
    at: i64,
    says: Option<bool>,
    /// The last message of what it reads that has been silent longest.
    oldest: i64,
}

impl Heard<'_> {
    /// The strongest guarantee of a monitor that holds, where the monitors before it are in these states.
    fn state(self, monitor: &Monitor, others: &[MonitorState]) -> MonitorState {
        let holds = |gate: &Gate| self.gate_holds(monitor, others, gate);
        let strongest = monitor.guarantees.iter().position(|guarantee| holds(&guarantee.gate));
        strongest.map_or(MonitorState::Otherwise, |at| MonitorState::Guarantee(u32::try_from(at).unwrap()))
    }

    /// Whether a gate is true: unknown parts are not.
    fn gate_holds(self, monitor: &Monitor, others: &[MonitorState], gate: &Gate) -> bool {
        let count = |parts: &[Gate]| parts.iter().filter(|part| self.gate_holds(monitor, others, part)).count();
        match gate {
            Gate::Evidence(at) => self.truth(&monitor.evidence[*at as usize]) == Some(true),
            Gate::Demand(at) => {
                let demand = &monitor.demands[*at as usize];
                match others[demand.monitor.index()] {
                    MonitorState::Guarantee(strongest) => strongest <= demand.guarantee,
                    MonitorState::Otherwise => false,
                }
            }
            Gate::All(parts) => count(parts) == parts.len(),
            Gate::Any(parts) => count(parts) > 0,
            Gate::AtLeast { count: needed, of } => count(of) >= *needed as usize,
        }
    }

    /// What evidence says; `None` if it is unknown.
    fn truth(self, evidence: &Evidence) -> Option<bool> {
        let readings = self.readings(evidence);
        let last = readings.last()?;
        let is_stale = |reading: &Reading, at: i64| {
            evidence.stale.is_some_and(|stale| {
                let silent = if stale.all { reading.at } else { reading.oldest };
                at - silent > nanos(stale.after)
            })
        };
        if is_stale(last, self.time) {
            return if evidence.stale?.is == StaleIs::False { Some(false) } else { None };
        }
        if last.says != Some(true) {
            return last.says;
        }
        // Since when it has been true without a break, which a long silence is too.
        let mut since = last.at;
        for reading in readings.iter().rev() {
            if reading.says != Some(true) || is_stale(reading, since) {
                break;
            }
            since = reading.at;
        }
        Some(self.time - since >= nanos(evidence.held))
    }

    /// What the condition of evidence said: at each message where it reads one wire; where it reads several, once in
    /// each instant that is over, from the first one on at which each of them had a message.
    fn readings(self, evidence: &Evidence) -> Vec<Reading> {
        let plan = &self.case.plan;
        let wires: BTreeSet<&String> =
            evidence.inputs.iter().flat_map(|input| &plan.topic(input.field.topic).paths).collect();
        let own: Vec<&Message> = self.messages.iter().filter(|message| wires.contains(&message.path)).collect();
        let together = |a: &&Message, b: &&Message| wires.len() > 1 && a.time == b.time;
        let mut last: BTreeMap<&str, &Message> = BTreeMap::new();
        let mut readings = Vec::new();
        for instant in own.chunk_by(together) {
            let at = instant[0].time;
            last.extend(instant.iter().map(|message| (message.path.as_str(), *message)));
            let all_spoke = wires.iter().all(|wire| instant.iter().any(|message| message.path == **wire));
            let counts = at < self.time
                || wires.len() == 1
                || match self.instant {
                    Instant::Going => false,
                    Instant::PerhapsOver => all_spoke,
                    Instant::Over => true,
                };
            if counts && last.len() == wires.len() {
                let oldest = last.values().map(|message| message.time).min().expect("there is a message");
                readings.push(Reading { at, says: self.says(evidence, at, &last), oldest });
            }
        }
        readings
    }

    /// What the condition of evidence says of the last messages of all that it reads.
    fn says(self, evidence: &Evidence, time: i64, last: &BTreeMap<&str, &Message>) -> Option<bool> {
        let value = |input: &Input| {
            let paths = &self.case.plan.topic(input.field.topic).paths;
            let numbers = paths.iter().map(|path| number(&last[path.as_str()].value, &input.field.path));
            let numbers: Vec<f64> =
                numbers.map(|number| number.filter(|number| number.is_finite())).collect::<Option<_>>()?;
            match input.members {
                Members::Max => numbers.into_iter().reduce(f64::max),
                Members::Sum => numbers.into_iter().reduce(|a, b| a + b),
                _ => numbers.into_iter().reduce(f64::min),
            }
        };
        let values = evidence.inputs.iter().map(value).collect::<Option<Vec<f64>>>()?;
        Some(holds(&evidence.condition, &Computed { time, of: 0, values }))
    }
}

fn stays(decisions: &[(i64, MonitorState)], end: i64) -> Vec<Stay> {
    let next = decisions.iter().skip(1).map(|decision| decision.0).chain([end]);
    decisions.iter().zip(next).map(|(&(from, state), to)| Stay { state, from, to }).collect()
}

/// This judge cannot tell.
struct Unjudged;

/// What a score is in a run that came to its end.
fn scored(case: &Case, stays: &[Stay], score: Score, ledger: &Ledger) -> Result<Option<f64>, Unjudged> {
    let seconds = |nanos: i64| nanos as f64 / 1e9;
    let safe = stays.iter().filter(|stay| stay.state == MonitorState::Otherwise);
    let at = |hazard: i64| *stays.iter().rfind(|stay| stay.from <= hazard).expect("a run begins with a stay");
    let lead = |hazard: i64| Some(hazard - at(hazard).from).filter(|_| at(hazard).state == MonitorState::Otherwise);
    let count = |counts: bool| Ok(Some(f64::from(u8::from(counts))));
    match score {
        Score::TimeIn { state } => {
            let own = stays.iter().filter(|stay| stay.state == state);
            Ok(Some(seconds(own.map(|stay| stay.to - stay.from).sum())))
        }
        Score::Changes => Ok(Some((stays.len() - 1) as f64)),
        Score::Mitigations => Ok(Some(safe.skip(1).count() as f64)),
        // The stay with which a run begins has not begun with a change.
        Score::ShortestStay => {
            let ended = &stays[..stays.len() - 1];
            Ok(ended.iter().skip(1).map(|stay| stay.to - stay.from).min().map(seconds))
        }
        Score::MissedHazards { requirement } => {
            let hazard = hazard(case, case.plan.requirement(requirement), ledger)?;
            count(hazard.is_some_and(|hazard| lead(hazard).is_none()))
        }
        Score::ForeseenHazards { requirement } => {
            let hazard = hazard(case, case.plan.requirement(requirement), ledger)?;
            count(hazard.and_then(lead).is_some_and(|lead| lead > 0))
        }
        Score::LeadTime { requirement } => {
            let hazard = hazard(case, case.plan.requirement(requirement), ledger)?;
            Ok(hazard.and_then(lead).filter(|&lead| lead > 0).map(seconds))
        }
        Score::FalseAlarms { requirement, within } => {
            let hazard = hazard(case, case.plan.requirement(requirement), ledger)?;
            let last = stays.last().ok_or(Unjudged)?;
            let justified = |stay: &Stay| {
                hazard.is_some_and(|hazard| {
                    // If several stays begin in one instant, only the last one has a length.
                    let inside = hazard < stay.to || std::ptr::eq(stay, last);
                    let near = within.is_some_and(|within| hazard <= stay.from + nanos(within));
                    stay.from <= hazard && (inside || near)
                })
            };
            // The stay with which a run begins is no alarm, unless the monitor never leaves it.
            let skipped = usize::from(stays.len() > 1);
            Ok(Some(safe.skip(skipped).filter(|stay| !justified(stay)).count() as f64))
        }
        Score::Integrity | Score::Holds { .. } => Err(Unjudged),
    }
}

/// When a requirement was lost in a run that came to its end: from which moment on nothing could satisfy it.
fn hazard(case: &Case, requirement: &Requirement, ledger: &Ledger) -> Result<Option<i64>, Unjudged> {
    let metric = case.plan.metric(requirement.metric);
    let known = match metric.source {
        MetricSource::Formula { .. } | MetricSource::Hook { .. } | MetricSource::Last { .. } => true,
        MetricSource::Robustness { .. } | MetricSource::FuzzingTime | MetricSource::Monitor { .. } => false,
    };
    if !known || first_blank(&case.plan, metric, ledger).is_some() {
        return Err(Unjudged);
    }
    let set = |time: i64| value_after(case, metric, ledger, time);
    let lost = |time: i64| set(time).is_some_and(|value| is_beyond(requirement.bound, metric.trend, value));
    if lost(ledger.end) {
        let (mut low, mut high) = (0, ledger.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if lost(middle) { high = middle } else { low = middle + 1 }
        }
        return Ok(Some(low));
    }
    let value = set(ledger.end).or(metric.default).ok_or(Unjudged)?;
    Ok((!requirement.bound.holds(value)).then_some(ledger.end))
}

/// The value of a metric when the instant at a time is over.
fn value_after(case: &Case, metric: &Metric, ledger: &Ledger, time: i64) -> Option<f64> {
    let until = |messages: &[Message]| messages.iter().filter(|message| message.time <= time).cloned().collect();
    let (published, delivered) = (until(&ledger.published), until(&ledger.delivered));
    let steps = time.div_euclid(STEP) * STEP;
    match judged(&case.plan, metric, &Ledger { published, delivered, end: time, steps, ..ledger.clone() }) {
        Judged::Value(value) => Some(value),
        Judged::Unset | Judged::Open => None,
    }
}

/// Whether a metric that goes this way only, and has this value, can never be inside of a bound again.
fn is_beyond(bound: Bound, trend: Option<Trend>, value: f64) -> bool {
    match (trend, bound) {
        (Some(Trend::Rising), Bound::AtMost { value: end } | Bound::Equal { value: end }) => value > end,
        (Some(Trend::Rising), Bound::Within { high, .. }) => value > high,
        (Some(Trend::Rising), Bound::Below { value: end }) => value >= end,
        (Some(Trend::Falling), Bound::AtLeast { value: end } | Bound::Equal { value: end }) => value < end,
        (Some(Trend::Falling), Bound::Within { low, .. }) => value < low,
        (Some(Trend::Falling), Bound::Above { value: end }) => value <= end,
        _ => false,
    }
}
