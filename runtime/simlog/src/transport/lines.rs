//! The wires of a run: under which names their messages come and go, and as what they are read.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Simlog, TopicId, Type};
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::transport::TransportError;
use sesame_relay::wire::{Wire, WireTable};

use super::round::Round;
use super::{Session, fault};
use crate::client::{Client, ClientError, Heard};
use crate::message::Message;
use crate::shape::Shape;

/// How many messages of a wire are remembered as they came. One that is held back while more than these go by keeps its
/// value, but what the space does not declare of it is that of a later one.
const REMEMBERED: usize = 128;

/// A wire with what it is on the simulator's side.
pub(super) struct Line {
    pub(super) wire: Wire,
    pub(super) topic: TopicId,
    shape: Shape,
    /// Under which name messages are published in place of those that come; `None` for a topic that is only heard.
    injected: Option<String>,
    /// How many messages have come.
    count: u64,
    /// The latest messages as they came, with their numbers.
    originals: VecDeque<(u64, Message)>,
}

/// All of them, in the order of wires, which is the order of streams.
pub(super) struct Lines {
    lines: Vec<Line>,
    by_wire: BTreeMap<Wire, usize>,
}

impl Lines {
    /// Listens to all topics of a plan, and cuts those on which operations may act.
    pub(super) fn open(
        plan: &CampaignPlan,
        settings: &Simlog,
        wires: &WireTable,
        client: &mut Client,
    ) -> Result<Self, ClientError> {
        let mut cut: BTreeSet<Wire> = plan.operations.iter().flat_map(|it| wires.acted_on(it)).collect();
        cut.extend(wires.iter().filter(|&wire| settings.cut.contains(&wires.topic(wire))));
        let mut lines = Vec::new();
        for wire in wires.iter() {
            let (topic, path) = (wires.topic(wire), wires.path(wire));
            let kind = kind(plan, topic);
            let injected = if cut.contains(&wire) {
                let injected = match settings.protocol {
                    sesame_plan::SimlogVersion::V2 => settings.names.injected(path),
                    sesame_plan::SimlogVersion::V3 => settings.names.injected.clone(),
                };
                Some(client.inject(&settings.names.cut(path), &injected, &kind)?.1)
            } else {
                client.listen(&settings.names.heard(path), &kind)?;
                None
            };
            let shape = Shape::of_type(plan, &plan.topic(topic).ty);
            lines.push(Line { wire, topic, shape, injected, count: 0, originals: VecDeque::new() });
        }
        let by_wire = lines.iter().enumerate().map(|(at, line)| (line.wire, at)).collect();
        Ok(Lines { lines, by_wire })
    }

    /// Tells the relay who is heard: whoever reads what is injected.
    pub(super) fn tell_subscribers(&self, relay: &mut dyn Exchange) {
        for line in self.lines.iter().filter(|line| line.injected.is_some()) {
            relay.subscribed(line.wire);
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter()
    }

    /// The wire of a stream of the client; none of the marker's.
    pub(super) fn of_stream(&self, stream: usize) -> Option<&Line> {
        self.lines.get(stream)
    }
}

/// The name of a topic's type on the wire.
fn kind(plan: &CampaignPlan, topic: TopicId) -> String {
    let topic = plan.topic(topic);
    match (&topic.interface, &topic.ty) {
        (Some(name), _) => name.clone(),
        (None, Type::Message { id }) => plan.message(*id).name.clone(),
        (None, Type::Point { .. }) => "Point".to_owned(),
        (None, Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Text | Type::List { .. }) => {
            "STRING".to_owned()
        }
    }
}

impl Session {
    /// Takes what was heard through the relay, in the order of wires.
    pub(super) fn relay(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        mut heard: Vec<Heard>,
        relay: &mut dyn Exchange,
        deliveries: &mut Vec<Delivery>,
    ) -> Result<(), TransportError> {
        heard.sort_by_key(|heard| heard.stream);
        for Heard { stream, message } in heard {
            let Some(line) = self.lines.lines.get_mut(stream) else { continue };
            let value = message.read(&line.shape).map_err(|mismatch| TransportError::WrongType {
                path: relay.wires().path(line.wire).to_owned(),
                reason: format!("{mismatch}; topic `{}` declares it", plan.topic(line.topic).name),
            })?;
            if line.injected.is_some() {
                if line.originals.len() == REMEMBERED {
                    line.originals.pop_front();
                }
                line.originals.push_back((line.count, message));
            }
            line.count += 1;
            relay.message(now, line.wire, value, deliveries);
        }
        Ok(())
    }

    /// Publishes what is delivered, and notes who will answer it. What was only listened to is where it belongs.
    pub(super) fn deliver(
        &mut self,
        plan: &CampaignPlan,
        deliveries: &mut Vec<Delivery>,
        relay: &dyn Exchange,
        round: &mut Round,
    ) -> Result<(), TransportError> {
        let mut published = Vec::new();
        for Delivery { wire, index, value } in deliveries.drain(..) {
            let Some(line) = self.lines.by_wire.get(&wire).map(|&at| &self.lines.lines[at]) else { continue };
            let Some(name) = &line.injected else { continue };
            let original = line.originals.iter().find(|(number, _)| *number == index).or(line.originals.back());
            // Nothing is delivered that has not come.
            let Some((_, original)) = original else { continue };
            match original.with(&value) {
                Ok(message) => {
                    round.owe(plan, relay.wires(), wire);
                    published.push((name.clone(), message));
                }
                Err(mismatch) => {
                    let path = relay.wires().path(wire);
                    let note = format!("a message on `{path}` cannot be written and is dropped: {mismatch}");
                    self.note(note);
                }
            }
        }
        if published.is_empty() { Ok(()) } else { self.client.publish(published).map_err(fault) }
    }

    pub(super) fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}
