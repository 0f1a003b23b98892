//! The wires of a run: under which names their messages come and go, and as what they are read.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Simlog, SimlogVersion, TopicId, Type};
use sesame_relay::message::Mismatch;
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

use crate::client::{Client, ClientError};
use crate::expected_type::ExpectedType;
use crate::message::Message;

/// How many messages of a wire are remembered as they came. One that is held back while more than these go by keeps its
/// value, but what the space does not declare of it is that of a later one.
const REMEMBERED: usize = 128;

/// A wire with what it is on the simulator's side.
pub(super) struct Line {
    pub(super) wire: Wire,
    pub(super) topic: TopicId,
    /// The name of its type, and the version of the protocol in which it is written.
    kind: String,
    version: SimlogVersion,
    expected: ExpectedType,
    /// Under which name messages are published in place of those that come; `None` for a topic that is only heard.
    injected: Option<String>,
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
        let mut cut: BTreeSet<Wire> = plan.operations.iter().flat_map(|operation| wires.acted_on(operation)).collect();
        cut.extend(wires.iter().filter(|&wire| settings.cut.contains(&wires.topic(wire))));
        let mut lines = Vec::new();
        for wire in wires.iter() {
            let (topic, path) = (wires.topic(wire), wires.path(wire));
            let kind = kind(plan, topic);
            let injected = if cut.contains(&wire) {
                let injected = match settings.protocol {
                    SimlogVersion::V2 => settings.names.injected(path),
                    SimlogVersion::V3 => settings.names.injected.clone(),
                };
                Some(client.inject(&settings.names.cut(path), &injected, &kind)?.1)
            } else {
                client.listen(&settings.names.heard(path), &kind)?;
                None
            };
            let expected = ExpectedType::of_type(plan, &plan.topic(topic).ty);
            let (version, originals) = (settings.protocol, VecDeque::new());
            lines.push(Line { wire, topic, kind, version, expected, injected, originals });
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

    /// The line of a stream of the client; there is none of the marker's.
    pub(super) fn of_stream(&self, stream: usize) -> Option<&Line> {
        self.lines.get(stream)
    }

    /// As [`Lines::of_stream`], mutable.
    pub(super) fn of_stream_mut(&mut self, stream: usize) -> Option<&mut Line> {
        self.lines.get_mut(stream)
    }

    /// The line of a wire.
    pub(super) fn of_wire(&self, wire: Wire) -> Option<&Line> {
        self.by_wire.get(&wire).map(|&at| &self.lines[at])
    }
}

impl Line {
    /// Takes the message with this number: gives its value, and remembers it as it came.
    pub(super) fn take(&mut self, message: Message, index: u64) -> Result<Value, Mismatch> {
        let value = message.read(&self.expected)?;
        if self.injected.is_some() {
            if self.originals.len() == REMEMBERED {
                self.originals.pop_front();
            }
            self.originals.push_back((index, message));
        }
        Ok(value)
    }

    /// What a delivery is on the wire, and under which name; `None` where messages are only heard, and are where they
    /// belong already.
    pub(super) fn written(&self, delivery: &Delivery, now: SimTime) -> Result<Option<(String, Message)>, Mismatch> {
        let Some(name) = &self.injected else { return Ok(None) };
        let of_index = self.originals.iter().find(|(number, _)| *number == delivery.index);
        // Nothing is delivered that has not come, but for what monitors publish, which is written as the last message
        // is, if there is one.
        let message = if let Some((_, original)) = of_index.or(self.originals.back()) {
            original.with(&delivery.value)?
        } else {
            let now = u64::try_from(now.nanos()).unwrap_or_default();
            Message::of(self.version, &delivery.value, &self.kind, now)?
        };
        Ok(Some((name.clone(), message)))
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
