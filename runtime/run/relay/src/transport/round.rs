//! What a step owes, the same over every middleware that is stepped.
//!
//! A middleware keeps the messages of one topic in order at most, so nobody can see from outside when all messages of a
//! step have come. Nodes say it: what they publish `every step`, and what they publish in answer to what (`answers`).
//! From that follows how many messages are owed on each wire, and a step is over when none is.
//!
//! - In each step, a node owes one message on each wire that it publishes on of a topic that it publishes `every step`.
//! - For each message that is delivered to a node which answers its topic, the node owes one: if both topics are groups
//!   of the same size, the member at the same place answers, otherwise all members of the answering topic that the node
//!   publishes do.
//! - A message pays for one that is owed on its own wire when it comes. If none is owed there, it pays for nothing,
//!   neither on another wire nor later. So a node that publishes twice never ends a step in which a message of another
//!   one is missing.

use std::collections::btree_map::{BTreeMap, Entry};

use sesame_plan::{CampaignPlan, Node, NodeId, TopicId};

use crate::wire::{Wire, WireTable};

/// What the nodes of a plan promise to publish, wire by wire.
#[derive(Debug, Clone)]
pub struct Promises {
    every_step: Vec<Wire>,
    /// By wire, with links: who answers a message that is delivered there, and on which wire.
    answers: Vec<Vec<(NodeId, Wire)>>,
    /// By wire without links: whether somebody answers its messages, and whether nodes say how many it has.
    answered: Vec<bool>,
    counted: Vec<bool>,
}

impl Promises {
    /// The promises of a plan's nodes, over the wires of its topics.
    pub fn new(plan: &CampaignPlan, wires: &WireTable) -> Self {
        let each_step = |node: &Node| node.every_step.iter().flat_map(|&topic| published(wires, node, topic)).collect();
        let every_step: Vec<Wire> = plan.nodes.iter().flat_map(|node| -> Vec<Wire> { each_step(node) }).collect();
        let answered = |wire: Wire| {
            let (topic, member) = (wires.topic(wire), wires.member(wire));
            plan.nodes
                .iter()
                .any(|node| node.subscribes_to(topic, member) && node.answers.iter().any(|answer| answer.to == topic))
        };
        let answers_on = |wire: Wire| {
            let (topic, member) = (wires.topic(wire), wires.member(wire));
            plan.nodes
                .iter()
                .any(|node| node.publishes_on(topic, member) && node.answers.iter().any(|answer| answer.with == topic))
        };
        let all = wires.iter().chain(wires.links().iter().map(|link| link.wire));
        Promises {
            answers: all.map(|wire| answers_to(plan, wires, wire)).collect(),
            answered: wires.iter().map(answered).collect(),
            counted: wires.iter().map(|wire| every_step.contains(&wire) || answers_on(wire)).collect(),
            every_step,
        }
    }

    /// What is owed in each step before anything is delivered: a wire comes once for each message.
    pub fn every_step(&self) -> &[Wire] {
        &self.every_step
    }

    /// Who answers a message that is delivered on this wire, which may be a link, and on which wire; once for each
    /// answer. A node that has a link of its own hears nothing on the wire from which the link branches off.
    pub fn answers(&self, delivered: Wire) -> &[(NodeId, Wire)] {
        &self.answers[delivered.index()]
    }

    /// Whether some node answers the messages of this wire, which is not a link.
    pub fn is_answered(&self, wire: Wire) -> bool {
        self.answered[wire.index()]
    }

    /// Whether nodes say how many messages this wire, which is not a link, has in a step.
    pub fn is_counted(&self, wire: Wire) -> bool {
        self.counted[wire.index()]
    }
}

fn answers_to(plan: &CampaignPlan, wires: &WireTable, delivered: Wire) -> Vec<(NodeId, Wire)> {
    let link = wires.link(delivered);
    let of = link.map_or(delivered, |link| link.of);
    let hears = |node: NodeId| match link {
        Some(link) => link.to == node,
        None => !wires.links().iter().any(|link| link.of == delivered && link.to == node),
    };
    let (topic, place) = (wires.topic(of), wires.member(of));
    let mut answers = Vec::new();
    for (id, node) in (0u32..).map(NodeId).zip(&plan.nodes).filter(|(id, _)| hears(*id)) {
        if !node.subscribes_to(topic, place) {
            continue;
        }
        for answer in node.answers.iter().filter(|answer| answer.to == topic) {
            let alike = plan.topic(answer.with).paths.len() == plan.topic(topic).paths.len();
            let owing = published(wires, node, answer.with).filter(|&with| !alike || wires.member(with) == place);
            answers.extend(owing.map(|with| (id, with)));
        }
    }
    answers
}

/// The wires of a topic that a node publishes on, in the order of its paths.
fn published(wires: &WireTable, node: &Node, topic: TopicId) -> impl Iterator<Item = Wire> {
    let of_topic = wires.iter().filter(move |&wire| wires.topic(wire) == topic);
    of_topic.filter(move |&wire| node.publishes_on(topic, wires.member(wire)))
}

/// How many messages are still owed in a step, by wire.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Owed(BTreeMap<Wire, u32>);

impl Owed {
    /// One more message is owed on this wire.
    pub fn add(&mut self, wire: Wire) {
        *self.0.entry(wire).or_default() += 1;
    }

    /// A message has come on this wire. It pays for one that is owed there, if there is one.
    pub fn pay(&mut self, wire: Wire) {
        if let Entry::Occupied(mut owed) = self.0.entry(wire) {
            *owed.get_mut() -= 1;
            if *owed.get() == 0 {
                owed.remove();
            }
        }
    }

    /// Whether nothing is owed, so that the step is over.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What is owed, as a phrase that names each wire by its path.
    pub fn awaited(&self, wires: &WireTable) -> String {
        let owed: Vec<String> =
            self.0.iter().map(|(&wire, count)| format!("{count} on `{}`", wires.path(wire))).collect();
        format!("a message of the step ({})", owed.join(", "))
    }
}

impl Extend<Wire> for Owed {
    /// One more message is owed on each of these wires, as often as it comes.
    fn extend<T: IntoIterator<Item = Wire>>(&mut self, wires: T) {
        wires.into_iter().for_each(|wire| self.add(wire));
    }
}

#[cfg(test)]
mod tests;
