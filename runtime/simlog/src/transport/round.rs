//! The messages of one step: which are expected, and which have come.

use std::collections::BTreeMap;

use sesame_plan::CampaignPlan;
use sesame_relay::wire::{Wire, WireTable};

use super::lines::Lines;
use crate::client::{Heard, Stepped};

/// One step.
pub(super) struct Round {
    pub(super) heard: Vec<Heard>,
    pub(super) stepped: Option<Stepped>,
    /// Per wire: how many more messages are expected than have come. Only wires of which somebody says it are here.
    owed: BTreeMap<Wire, i64>,
    /// The stream of the marker.
    marker: Option<usize>,
    marked: bool,
    /// What is stamped before this is of a step before, and owed no longer.
    before: Option<i128>,
}

impl Round {
    pub(super) fn new(plan: &CampaignPlan, wires: &WireTable, marker: Option<usize>, before: Option<i128>) -> Self {
        let mut owed = BTreeMap::new();
        let answers = |topic| plan.nodes.iter().flat_map(|node| &node.answers).any(|answer| answer.with == topic);
        let every = |topic| plan.nodes.iter().flat_map(|node| &node.every_step).filter(|&&it| it == topic).count();
        for wire in wires.iter() {
            let topic = wires.topic(wire);
            let count = every(topic);
            if count > 0 || answers(topic) {
                owed.insert(wire, i64::try_from(count).unwrap_or(i64::MAX));
            }
        }
        Round { heard: Vec::new(), stepped: None, owed, marker, marked: false, before }
    }

    /// Counts the answers to a message that is delivered on this wire. Of groups of one size, one member answers
    /// another; else all members answer.
    pub(super) fn owe(&mut self, plan: &CampaignPlan, wires: &WireTable, wire: Wire) {
        let to = wires.topic(wire);
        let member = |wire: Wire| wires.iter().take_while(|&it| it != wire).filter(|&it| wires.topic(it) == to).count();
        for answer in plan.nodes.iter().flat_map(|node| &node.answers).filter(|answer| answer.to == to) {
            let with: Vec<Wire> = wires.iter().filter(|&it| wires.topic(it) == answer.with).collect();
            let alike = with.len() == plan.topic(to).paths.len();
            for (at, with) in with.into_iter().enumerate() {
                if !alike || at == member(wire) {
                    *self.owed.entry(with).or_default() += 1;
                }
            }
        }
    }

    pub(super) fn take(&mut self, lines: &Lines, heard: &mut Vec<Heard>) {
        for heard in heard.drain(..) {
            if Some(heard.stream) == self.marker {
                self.marked = true;
                continue;
            }
            let late = self.before.zip(heard.message.stamp()).is_some_and(|(before, at)| i128::from(at) < before);
            if late {
                self.heard.push(heard);
                continue;
            }
            if let Some(owed) = lines.of_stream(heard.stream).and_then(|line| self.owed.get_mut(&line.wire)) {
                *owed -= 1;
            }
            self.heard.push(heard);
        }
    }

    /// Whether all that is expected has come.
    pub(super) fn is_complete(&self) -> bool {
        if self.marker.is_some() { self.marked } else { self.owed.values().all(|&owed| owed <= 0) }
    }

    /// Whether nothing can come that is not expected.
    pub(super) fn is_certain(&self, lines: &Lines) -> bool {
        self.marker.is_some() || lines.iter().all(|line| self.owed.contains_key(&line.wire))
    }

    /// What has not come, as a phrase.
    pub(super) fn awaited(&self, plan: &CampaignPlan, lines: &Lines) -> String {
        if self.stepped.is_none() {
            return "the end of a step".to_owned();
        }
        if self.marker.is_some() {
            return "the marker of the end of a step".to_owned();
        }
        let owed = lines.iter().filter_map(|line| {
            let &count = self.owed.get(&line.wire).filter(|&&count| count > 0)?;
            Some(format!("{count} on `{}`", plan.topic(line.topic).name))
        });
        format!("a message of the step ({})", owed.collect::<Vec<_>>().join(", "))
    }
}
