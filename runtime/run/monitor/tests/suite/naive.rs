//! What monitors decide, computed anew from the whole history after each event, without any state.

use sesame_monitor::{State, Truth};
use sesame_plan::{Gate, Monitor, MonitorId, StaleIs};

use crate::random::{Heard, HeardMessage};

/// A decision: when, and for what.
pub(crate) type Step = (i64, State);

/// Truth as a number: 0, 1/2 and 1.
fn number(truth: Truth) -> f64 {
    match truth {
        Truth::False => 0.0,
        Truth::Unknown => 0.5,
        Truth::True => 1.0,
    }
}

fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

/// A moment: what was heard until then, and the time.
pub(crate) struct Moment<'a> {
    pub(crate) monitors: &'a [Monitor],
    pub(crate) heard: &'a [HeardMessage],
    pub(crate) now: i64,
}

impl Moment<'_> {
    pub(crate) fn evidence(&self, monitor: MonitorId, at: u32) -> Truth {
        let evidence = &self.monitors[monitor.index()].evidence[at as usize];
        let messages: Vec<(i64, Heard)> = self
            .heard
            .iter()
            .flat_map(|message| message.heard.iter().map(|heard| (message.at, *heard)))
            .filter(|(_, heard)| (heard.monitor, heard.at) == (monitor, at))
            .collect();
        let Some(&(last, Heard { truth: raw, .. })) = messages.last() else { return Truth::Unknown };
        let longest = evidence.stale.map_or(i64::MAX, |stale| nanos(stale.after));
        // Since when it is silent, after a message.
        let silent = |&(when, heard): &(i64, Heard)| match evidence.stale {
            Some(stale) if !stale.all => heard.oldest,
            _ => when,
        };
        let is_fresh = |message: &(i64, Heard), at: i64| at - silent(message) <= longest;
        if !messages.last().is_some_and(|message| is_fresh(message, self.now)) {
            return if evidence.stale.unwrap().is == StaleIs::False { Truth::False } else { Truth::Unknown };
        }
        if raw != Truth::True {
            return raw;
        }
        let mut since = last;
        for message in messages.iter().rev() {
            if message.1.truth != Truth::True || !is_fresh(message, since) {
                break;
            }
            since = message.0;
        }
        Truth::from(self.now - since >= nanos(evidence.held))
    }

    /// As a number.
    fn gate(&self, monitor: MonitorId, gate: &Gate) -> f64 {
        let all = |of: &[Gate]| of.iter().map(|part| self.gate(monitor, part)).collect::<Vec<f64>>();
        match gate {
            Gate::Evidence(at) => number(self.evidence(monitor, *at)),
            Gate::Demand(at) => {
                let demand = &self.monitors[monitor.index()].demands[*at as usize];
                let enough = match self.state(demand.monitor) {
                    State::Guarantee(at) => at <= demand.guarantee,
                    State::Safe => false,
                };
                let own =
                    |at: usize| self.gate(demand.monitor, &self.monitors[demand.monitor.index()].guarantees[at].gate);
                if enough { 1.0 } else { (0..=demand.guarantee as usize).map(own).fold(0.0, f64::max) }
            }
            Gate::All(of) => all(of).into_iter().fold(1.0, f64::min),
            Gate::Any(of) => all(of).into_iter().fold(0.0, f64::max),
            Gate::AtLeast { count, of } => {
                let mut values = all(of);
                values.sort_by(f64::total_cmp);
                values[values.len() - *count as usize]
            }
        }
    }

    pub(crate) fn guarantee(&self, monitor: MonitorId, at: u32) -> Truth {
        let value = self.gate(monitor, &self.monitors[monitor.index()].guarantees[at as usize].gate);
        [Truth::False, Truth::Unknown, Truth::True][(value * 2.0) as usize]
    }

    pub(crate) fn state(&self, monitor: MonitorId) -> State {
        let guarantees = self.monitors[monitor.index()].guarantees.len() as u32;
        (0..guarantees).find(|&at| self.guarantee(monitor, at).holds()).map_or(State::Safe, State::Guarantee)
    }
}

/// The moments after each event until the end: each instant before its messages, and after each of them.
pub(crate) fn moments<'a>(monitors: &'a [Monitor], messages: &'a [HeardMessage], end: i64) -> Vec<Moment<'a>> {
    let mut moments = Vec::new();
    for now in 0..=end {
        let before = messages.iter().filter(|message| message.at < now).count();
        let after = messages.iter().filter(|message| message.at <= now).count();
        moments.extend((before..=after).map(|count| Moment { monitors, heard: &messages[..count], now }));
    }
    moments
}

/// The decisions of each monitor.
pub(crate) fn decisions(monitors: &[Monitor], messages: &[HeardMessage], end: i64) -> Vec<Vec<Step>> {
    let mut decisions = vec![vec![(0, State::Safe)]; monitors.len()];
    for moment in moments(monitors, messages, end) {
        for (id, steps) in (0..).zip(&mut decisions) {
            let state = moment.state(MonitorId(id));
            if steps.last().unwrap().1 != state {
                steps.push((moment.now, state));
            }
        }
    }
    decisions
}
