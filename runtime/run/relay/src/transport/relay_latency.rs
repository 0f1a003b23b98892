//! What the relay adds to the way of messages: for each wire, how long its messages were kept from their arrival until
//! they were passed on.
//!
//! A message that an operation holds back is not measured. It is wall time, and never part of results. Where the
//! simulator is stepped, time stands still meanwhile, so there nothing is measured.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use sesame_base::latency::Latencies;
use sesame_plan::RelayBudget;

use crate::wire::{Wire, WireTable};

/// Below so many messages there is no one in a hundred.
pub const FEWEST: u64 = 100;

/// How long messages were kept on one wire since it was asked last.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AddedOnWire {
    /// The name on the wire.
    pub path: String,
    /// How long each message was kept.
    pub latencies: Latencies,
}

/// Measures how long messages are kept, wire by wire, in a memory of fixed size.
#[derive(Debug, Clone, Default)]
pub struct Added {
    by_wire: BTreeMap<Wire, Latencies>,
}

impl Added {
    /// A message of this wire was passed on so long after it had come.
    pub fn record(&mut self, wire: Wire, added: Duration) {
        self.by_wire.entry(wire).or_default().record(added);
    }

    /// What was measured on each wire that had messages, in the order of the wires, each name once: the two directions
    /// of a service have one. Then everything begins anew.
    pub fn take(&mut self, wires: &WireTable) -> Vec<AddedOnWire> {
        let mut taken = Vec::new();
        let named = |(wire, latencies)| AddedOnWire { path: wires.path(wire).to_owned(), latencies };
        join(&mut taken, std::mem::take(&mut self.by_wire).into_iter().map(named).collect());
        taken
    }
}

/// Takes what was measured together with what was measured before, each wire once.
pub fn join(all: &mut Vec<AddedOnWire>, new: Vec<AddedOnWire>) {
    for added in new {
        match all.iter_mut().find(|known| known.path == added.path) {
            Some(known) => known.latencies.add(&added.latencies),
            None => all.push(added),
        }
    }
}

/// Where a budget was exceeded over all wires together, each in a sentence; nothing below a hundred messages.
pub fn objections<'a>(budget: RelayBudget, added: impl IntoIterator<Item = &'a AddedOnWire>) -> Vec<String> {
    let mut all = Latencies::default();
    added.into_iter().for_each(|path| all.add(&path.latencies));
    let (Some(half), Some(most)) = (all.percentile(50), all.percentile(99)) else { return Vec::new() };
    if all.messages() < FEWEST {
        return Vec::new();
    }
    let mut notes = Vec::new();
    if let Some(latency) = budget.latency.filter(|&latency| most > latency) {
        notes.push(format!(
            "the relay added {} to one message in a hundred; the budget is {} latency",
            shown(most),
            shown(latency)
        ));
    }
    if let Some(jitter) = budget.jitter.filter(|&jitter| most - half > jitter) {
        notes.push(format!(
            "what the relay added varied by {}: it was {} for every second message and {} for one in a hundred; the \
             budget is {} jitter",
            shown(most - half),
            shown(half),
            shown(most),
            shown(jitter)
        ));
    }
    notes
}

/// A time in milliseconds, down to microseconds.
fn shown(seconds: f64) -> String {
    let text = format!("{:.3}", seconds * 1000.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    format!("{text} ms")
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::plan;

    use super::*;

    fn judged(budget: RelayBudget, added: impl IntoIterator<Item = f64>) -> Vec<String> {
        let (wires, mut measured) = (WireTable::new(&plan(Vec::new())), Added::default());
        let all: Vec<Wire> = wires.iter().collect();
        for (at, added) in added.into_iter().enumerate() {
            measured.record(all[at % all.len()], Duration::from_secs_f64(added / 1000.0));
        }
        let notes = objections(budget, &measured.take(&wires));
        assert!(measured.take(&wires).is_empty(), "it begins anew");
        notes
    }

    #[test]
    fn a_budget_that_is_exceeded_is_said_with_figures_and_one_that_is_kept_is_not() {
        let budget = RelayBudget { latency: Some(0.005), jitter: Some(0.002) };
        let slow = |share: usize| (0..1000).map(move |at| if at % 100 < share { 7.2 } else { 0.25 });
        assert_eq!(judged(budget, slow(0)), [""; 0]);
        assert_eq!(judged(budget, slow(1)), [""; 0], "less than one in a hundred is more than that");
        assert_eq!(
            judged(budget, slow(2)),
            [
                "the relay added 7.078 ms to one message in a hundred; the budget is 5 ms latency",
                "what the relay added varied by 6.828 ms: it was 0.25 ms for every second message and 7.078 ms for one in \
                 a hundred; the budget is 2 ms jitter",
            ]
        );
        let steady = judged(budget, [7.2; 200]);
        assert_eq!(steady, ["the relay added 7.078 ms to one message in a hundred; the budget is 5 ms latency"]);
        assert_eq!(judged(budget, [7.2; 99]), [""; 0], "too few to tell");
        assert_eq!(judged(RelayBudget { latency: None, jitter: Some(0.002) }, [7.2; 200]), [""; 0]);
    }

    #[test]
    fn each_wire_is_measured_by_itself() {
        let (wires, mut measured) = (WireTable::new(&plan(Vec::new())), Added::default());
        let (first, second) = (wires.iter().next().unwrap(), wires.iter().nth(1).unwrap());
        for (wire, milliseconds) in [(second, 20), (first, 1), (second, 30)] {
            measured.record(wire, Duration::from_millis(milliseconds));
        }
        let taken = measured.take(&wires);
        let seen: Vec<(&str, u64, Option<f64>)> = taken
            .iter()
            .map(|added| (added.path.as_str(), added.latencies.messages(), added.latencies.longest()))
            .collect();
        assert_eq!(seen, [(wires.path(first), 1, Some(0.001)), (wires.path(second), 2, Some(0.03))]);
    }

    #[test]
    fn times_are_shown_in_milliseconds_without_needless_digits() {
        let shown = [0.005, 0.000_001, 0.25, 0.012_345_6, 1.5].map(shown);
        assert_eq!(shown, ["5 ms", "0.001 ms", "250 ms", "12.346 ms", "1500 ms"]);
    }
}
