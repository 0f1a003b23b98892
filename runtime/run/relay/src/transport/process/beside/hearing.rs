//! The monitors of one run, as they hear what is delivered.

use std::collections::BTreeSet;

use sesame_base::activation::TICK;
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Side};

use super::error::BesideError;
use super::request::Delivered;
use crate::json::{self, Shapes};
use crate::metric::Metrics;
use crate::monitor::{Decided, Monitors};
use crate::transport::process::protocol::{Message, Ready, request};
use crate::wire::{Wire, WireTable};

/// The monitors of one run.
pub(super) struct Hearing<'p, 't> {
    plan: &'p CampaignPlan,
    wires: &'p WireTable,
    monitors: Option<Monitors<'p>>,
    tell: &'t mut dyn FnMut(&Decided),
    shapes: Shapes,
    /// Per wire: messages heard so far.
    heard: Vec<u64>,
    /// What the simulator subscribes to, and whether it wants to know when each message was delivered.
    subscribed: BTreeSet<String>,
    times: bool,
    now: SimTime,
}

impl<'p, 't> Hearing<'p, 't> {
    pub(super) fn new(
        plan: &'p CampaignPlan,
        wires: &'p WireTable,
        metrics: &Metrics<'p>,
        tell: &'t mut dyn FnMut(&Decided),
    ) -> Self {
        let mut monitors = Monitors::new(metrics, wires);
        monitors.iter_mut().for_each(Monitors::tell);
        let mut hearing = Hearing {
            plan,
            wires,
            monitors,
            tell,
            shapes: Shapes::default(),
            heard: vec![0; wires.len()],
            subscribed: BTreeSet::new(),
            times: false,
            now: SimTime::ZERO,
        };
        hearing.tell();
        hearing
    }

    fn tell(&mut self) {
        let decided = self.monitors.as_mut().map(Monitors::take_decided).unwrap_or_default();
        decided.iter().for_each(&mut *self.tell);
    }

    /// The simulator is ready: its answer, with the topics of the monitors and what they are at time zero.
    pub(super) fn ready(&mut self, ready: &Ready<'_>) -> Vec<u8> {
        self.subscribed = ready.subscribes.iter().cloned().collect();
        self.times = ready.times;
        let mut messages = Vec::new();
        for Message { topic, value, .. } in &ready.messages {
            request::message(&mut messages, topic, None, |out| out.extend_from_slice(value.get().as_bytes()));
        }
        while let Some((path, value)) = self.publication() {
            request::message(&mut messages, path, None, |out| out.extend_from_slice(&value));
        }
        let names = |own: &[String], ours: &dyn Fn(Wire) -> bool| {
            let ours = self.wires.iter().filter(|&wire| ours(wire)).map(|wire| self.wires.path(wire).to_owned());
            let all: BTreeSet<String> = own.iter().cloned().chain(ours).collect();
            serde_json::to_string(&all).expect("texts are plain data")
        };
        let publishes = names(&ready.publishes, &|wire| self.plan.is_published_by_monitor(self.wires.topic(wire)));
        let subscribes = names(&ready.subscribes, &|wire| self.plan.is_read_by_monitor(self.wires.topic(wire)));
        let parameters = serde_json::to_string(&ready.parameters).expect("texts are plain data");
        let nodes = serde_json::to_string(&ready.nodes).expect("texts are plain data");
        let Ready { resets, clock, .. } = ready;
        let mut line = format!(
            "{{\"ready\":{{\"publishes\":{publishes},\"subscribes\":{subscribes},\"parameters\":{parameters},\
             \"nodes\":{nodes},\"resets\":{resets},\"clock\":{clock},\"times\":true,\"messages\":["
        )
        .into_bytes();
        line.append(&mut messages);
        line.extend_from_slice(b"]}}");
        line
    }

    /// Whether evidence hears the messages of a topic.
    pub(super) fn hears(&self, path: &str) -> bool {
        let hears = |wire| self.monitors.as_ref().is_some_and(|monitors| monitors.hears_delivered(wire));
        self.wires.find(path).is_some_and(hears)
    }

    /// Messages were delivered. Those to which the simulator subscribes are added to what it is sent.
    pub(super) fn delivered(
        &mut self,
        messages: &[Delivered<'_>],
        to_simulator: &mut Vec<u8>,
    ) -> Result<(), BesideError> {
        for Delivered { topic, time, value } in messages {
            let at = SimTime::from_seconds(*time);
            self.pass_to(at);
            if let Some(wire) = self.wires.find(topic) {
                let ty = &self.plan.topic(self.wires.topic(wire)).ty;
                let decoded = json::decode(self.plan, &mut self.shapes, ty, value).map_err(|mismatch| {
                    BesideError::WrongType { path: topic.clone().into_owned(), reason: mismatch.to_string() }
                })?;
                let index = self.heard[wire.index()];
                self.heard[wire.index()] += 1;
                if let Some(monitors) = &mut self.monitors {
                    monitors.hear(self.now, Side::Outbound, wire, index, &decoded);
                    monitors.decide(self.now);
                }
                self.tell();
            }
            if self.subscribed.contains(topic.as_ref()) {
                let time = self.times.then_some(at);
                request::message(to_simulator, topic, time, |out| out.extend_from_slice(value.get().as_bytes()));
            }
        }
        Ok(())
    }

    /// Time passes: what is due until this instant, and at it, happens. An earlier instant than before changes nothing.
    pub(super) fn pass_to(&mut self, now: SimTime) {
        let before = self.now;
        self.now = before.max(now);
        if let Some(monitors) = &mut self.monitors {
            if before < self.now {
                monitors.settle(before);
            }
            monitors.advance(self.now);
        }
        self.tell();
    }

    /// When something is due next without a message.
    pub(super) fn next_due(&self) -> Option<SimTime> {
        let monitors = self.monitors.as_ref()?;
        if monitors.wait() { Some(self.now + TICK) } else { monitors.next_due() }
    }

    /// The next message that is to be published: its topic, and its value as JSON.
    pub(super) fn publication(&mut self) -> Option<(&'p str, Vec<u8>)> {
        let (wire, value) = self.monitors.as_mut()?.publication()?;
        let mut written = Vec::new();
        json::encode(&value, &mut written);
        Some((self.wires.path(wire), written))
    }

    /// Nothing more is to be published in this event.
    pub(super) fn give_up(&mut self) {
        self.monitors.iter_mut().for_each(|monitors| {
            monitors.give_up();
        });
    }
}

/// A line that publishes one message.
pub(super) fn publish(path: &str, value: &[u8]) -> Vec<u8> {
    let mut line = b"{\"publish\":[".to_vec();
    let mut message = Vec::new();
    request::message(&mut message, path, None, |out| out.extend_from_slice(value));
    line.append(&mut message);
    line.extend_from_slice(b"]}");
    line
}
