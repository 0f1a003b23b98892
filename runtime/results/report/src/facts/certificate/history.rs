//! The evidence of a test's monitors, event by event.
//!
//! Results have the changes of evidence of each monitor in their order. An event, which is a message or an instant at
//! which evidence changes by itself, may change evidence of several monitors; here their changes are put together
//! again. From these follows the value of everything else in the certificates, at each moment.

use std::collections::VecDeque;

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorObservation};
use sesame_base::time::SimTime;
use sesame_monitor::why::Moment;
use sesame_monitor::{EvidenceId, Network, Truth};
use sesame_plan::{CampaignPlan, MonitorId};

/// What the monitors of a plan heard in a test.
pub(super) struct History<'a> {
    pub(super) plan: &'a CampaignPlan,
    shown: &'a [MonitorObservation],
    network: Network,
    events: Vec<Event>,
}

/// Evidence has changed, at one time and for one reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Event {
    pub(super) time: SimTime,
    /// Monitors, with positions among the changes of their evidence; at least one.
    changes: Vec<(MonitorId, usize)>,
}

impl<'a> History<'a> {
    /// The history of what the monitors of this plan did; `None` if nothing is known of it, or no run can have made it
    /// because the monitors cannot be run together.
    pub(super) fn new(plan: &'a CampaignPlan, shown: &'a [MonitorObservation]) -> Option<Self> {
        if shown.is_empty() || shown.len() != plan.monitors.len() {
            return None;
        }
        let network = Network::new(&plan.monitors).ok()?;
        Some(History { plan, shown, network, events: events(shown) })
    }

    /// The monitors compiled together.
    pub(super) fn network(&self) -> &Network {
        &self.network
    }

    /// The changes in an event.
    pub(super) fn changes(&self, event: &Event) -> impl Iterator<Item = (MonitorId, &'a EvidenceChange)> {
        event.changes.iter().map(|&(monitor, at)| (monitor, &self.shown[monitor.index()].evidence[at]))
    }

    /// What caused an event.
    pub(super) fn cause(&self, event: &Event) -> &'a ChangeCause {
        let (monitor, at) = event.changes[0];
        &self.shown[monitor.index()].evidence[at].cause
    }

    /// Goes through the test: tells the values at its beginning, without an event, and after each event.
    pub(super) fn play(&self, mut each: impl FnMut(Option<&Event>, &Values<'_>)) {
        let mut values = Values::new(self);
        each(None, &values);
        for event in &self.events {
            values.take(event);
            each(Some(event), &values);
        }
    }

    /// The values at the end of an instant.
    pub(super) fn at(&self, time: SimTime) -> Values<'_> {
        let mut values = Values::new(self);
        self.events.iter().take_while(|event| event.time <= time).for_each(|event| values.take(event));
        values
    }
}

/// The values of all evidence at a moment.
pub(super) struct Values<'h> {
    history: &'h History<'h>,
    pub(super) truths: Vec<Truth>,
    /// The last change of each piece of evidence.
    last: Vec<Option<&'h EvidenceChange>>,
}

impl<'h> Values<'h> {
    fn new(history: &'h History<'h>) -> Self {
        let count = history.network.evidence_count();
        Values { history, truths: vec![Truth::Unknown; count], last: vec![None; count] }
    }

    fn take(&mut self, event: &Event) {
        for (monitor, change) in self.history.changes(event) {
            let id = self.history.network.evidence(monitor, change.evidence);
            self.truths[id.index()] = change.holds.map_or(Truth::Unknown, Truth::from);
            self.last[id.index()] = Some(change);
        }
    }

    /// The values of everything that follows.
    pub(super) fn moment(&self) -> Moment<'h> {
        Moment::new(&self.history.network, |id: EvidenceId| self.truths[id.index()])
    }

    /// The change that gave evidence of a monitor its value; `None` if it has been unknown from the beginning.
    pub(super) fn last(&self, monitor: MonitorId, evidence: u32) -> Option<&'h EvidenceChange> {
        self.last[self.history.network.evidence(monitor, evidence).index()]
    }

    /// The plan.
    pub(super) fn plan(&self) -> &'h CampaignPlan {
        self.history.plan
    }
}

/// What makes changes of one instant one event: the message, or that there was none.
fn key(change: &EvidenceChange) -> Option<(&str, u64)> {
    match &change.cause {
        ChangeCause::Message { topic, index } => Some((topic, *index)),
        ChangeCause::Held | ChangeCause::Stale => None,
    }
}

/// All events, in order. Events of one instant are in an order in which each monitor may have heard them; where that
/// leaves a choice, no monitor heard both.
fn events(shown: &[MonitorObservation]) -> Vec<Event> {
    let mut waiting: Vec<VecDeque<(usize, &EvidenceChange)>> =
        shown.iter().map(|monitor| monitor.evidence.iter().enumerate().collect()).collect();
    let mut events = Vec::new();
    loop {
        let heads = waiting.iter().filter_map(|changes| changes.front());
        let Some(time) = heads.map(|(_, change)| SimTime::from_seconds(change.time)).min() else { return events };
        let now = |change: &EvidenceChange| SimTime::from_seconds(change.time) == time;
        let of_now = |changes: &VecDeque<(usize, &'_ EvidenceChange)>| {
            changes.iter().map(|(_, change)| *change).take_while(|change| now(change)).count()
        };
        let counts: Vec<usize> = waiting.iter().map(of_now).collect();
        let candidates: Vec<Option<(&str, u64)>> = waiting
            .iter()
            .zip(&counts)
            .filter(|(_, count)| **count > 0)
            .filter_map(|(changes, _)| changes.front().map(|(_, change)| key(change)))
            .collect();
        // What a monitor heard later than something else does not come first.
        let comes_later = |candidate: &Option<(&str, u64)>| {
            waiting.iter().zip(&counts).any(|(changes, &count)| {
                let place = changes.iter().take(count).position(|(_, change)| key(change) == *candidate);
                place.is_some_and(|place| place > 0)
            })
        };
        // Time passes before messages arrive.
        let timer = candidates.iter().find(|candidate| candidate.is_none());
        let first = timer.or_else(|| candidates.iter().find(|candidate| !comes_later(candidate)));
        let first = first.or(candidates.first()).copied().flatten();
        let mut changes = Vec::new();
        for (monitor, waiting) in (0..).map(MonitorId).zip(&mut waiting) {
            let of_event = |&&(_, change): &&(usize, &EvidenceChange)| now(change) && key(change) == first;
            while let Some(&(at, _)) = waiting.front().filter(of_event) {
                changes.push((monitor, at));
                waiting.pop_front();
            }
        }
        events.push(Event { time, changes });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(time: f64, message: Option<(&str, u64)>) -> EvidenceChange {
        let cause = match message {
            Some((topic, index)) => ChangeCause::Message { topic: topic.to_owned(), index },
            None => ChangeCause::Stale,
        };
        EvidenceChange { time, evidence: 0, holds: Some(true), cause }
    }

    fn heard(changes: Vec<EvidenceChange>) -> MonitorObservation {
        MonitorObservation { evidence: changes, ..MonitorObservation::default() }
    }

    #[test]
    fn changes_of_one_message_are_one_event_in_the_order_in_which_monitors_heard_it() {
        let [a, b] = [Some(("a", 3)), Some(("b", 0))];
        let shown = [
            heard(vec![change(1.0, b), change(2.0, a)]),
            heard(vec![change(0.5, None), change(1.0, None), change(1.0, a), change(1.0, a), change(1.0, b)]),
        ];
        let found = events(&shown);
        let found: Vec<(f64, Vec<(u32, usize)>)> = found
            .iter()
            .map(|group| (group.time.seconds(), group.changes.iter().map(|(monitor, at)| (monitor.0, *at)).collect()))
            .collect();
        let expected = vec![
            (0.5, vec![(1, 0)]),
            (1.0, vec![(1, 1)]),
            (1.0, vec![(1, 2), (1, 3)]),
            (1.0, vec![(0, 0), (1, 4)]),
            (2.0, vec![(0, 1)]),
        ];
        assert_eq!(found, expected);
    }
}
