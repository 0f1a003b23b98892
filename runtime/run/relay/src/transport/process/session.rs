//! The runner's side of the protocol, over any pair of streams: the order of requests and answers, and the way of
//! messages through the relay.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::mem;

use serde_json::value::RawValue;

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::json::{self, Shapes};
use crate::message::Mismatch;
use crate::relay::{Delivery, Exchange};
use crate::simulator::Progress;
use crate::transport::node_orders::NodeOrders;
use crate::transport::process::protocol::{LINE_LIMIT, Line, Lines, Message, Ready, SimulatorMessage, request};
use crate::transport::{TransportError, unknown_topic};
use crate::wire::Wire;

/// The most messages a simulator may publish in one step.
const STEP_LIMIT: u64 = 100_000;

/// The remedy for a surplus answer.
const TURNS: &str = "give one answer to each line; in this test there is one too many";

/// Why a session ended.
#[derive(Debug)]
pub(super) enum Fault {
    /// The simulator closed its output before it sent what was expected, given as a phrase.
    Disconnected(String),
    /// The simulator is running, but the session cannot continue.
    Wrong(TransportError),
}

impl From<TransportError> for Fault {
    fn from(error: TransportError) -> Self {
        Fault::Wrong(error)
    }
}

/// A session with a simulator.
pub(super) struct Session<R, W> {
    lines: Lines<R>,
    output: W,
    line: Vec<u8>,
    topics: Topics,
    orders: NodeOrders,
    resets: bool,
    ready: bool,
}

/// The topics of one run, and the messages that wait for delivery.
#[derive(Default)]
pub(super) struct Topics {
    by_path: BTreeMap<String, Topic>,
    /// Per wire of the relay: whether the simulator subscribes to it.
    subscribed: Vec<bool>,
    /// Whether the simulator is told when each message was delivered.
    timed: bool,
    shapes: Shapes,
    pub(super) deliveries: Vec<Delivery>,
    /// Messages to be delivered, as JSON for the next line to the simulator.
    pub(super) outbox: Vec<u8>,
    /// Messages since the last step began.
    pub(super) published: u64,
    /// The wires of messages that went to the outbox as soon as they came, each as often; `None` where that is not
    /// measured.
    pub(super) passed: Option<Vec<Wire>>,
}

/// One topic of the simulator.
struct Topic {
    wire: Option<Wire>,
    publishes: bool,
    subscribes: bool,
}

impl<R: BufRead, W: Write> Session<R, W> {
    pub(super) fn new(input: R, output: W) -> Self {
        Self::with_limit(input, output, LINE_LIMIT)
    }

    fn with_limit(input: R, output: W, limit: usize) -> Self {
        let lines = Lines::new(input, limit);
        Session {
            lines,
            output,
            line: Vec::new(),
            topics: Topics::default(),
            orders: NodeOrders::default(),
            resets: false,
            ready: false,
        }
    }

    /// The stream of the simulator's lines.
    pub(super) fn input(&self) -> &R {
        self.lines.reader()
    }

    /// Whether the simulator has answered the last reset with `ready`.
    pub(super) fn is_ready(&self) -> bool {
        self.ready
    }

    /// The error about a simulator that sends more after it has answered everything. Reads what it sends.
    pub(super) fn surplus_answer(&mut self) -> TransportError {
        match self.lines.read() {
            Ok(true) => {
                let problem = format!("comes after everything was answered: {}", self.lines.line().shown());
                self.lines.line().wrong(problem, TURNS)
            }
            Ok(false) => self.lines.line().wrong("begins after everything was answered".to_owned(), TURNS),
            Err(error) => error,
        }
    }

    /// Whether the simulator can be reset again.
    pub(super) fn resets(&self) -> bool {
        self.resets
    }

    /// Sets the simulator to time zero.
    pub(super) fn reset(
        &mut self,
        plan: &CampaignPlan,
        seed: u64,
        step: SimTime,
        relay: &mut dyn Exchange,
    ) -> Result<(), Fault> {
        self.lines.recount();
        self.ready = false;
        self.topics.clear();
        self.orders = NodeOrders::default();
        let wires = relay.wires();
        request::reset(&mut self.line, seed, Some(step), relay.parameters(), wires.iter().map(|wire| wires.path(wire)));
        self.send();
        let awaited = || "its answer to `reset`".to_owned();
        if !self.lines.read()? {
            return Err(Fault::Disconnected(awaited()));
        }
        let ready = match self.lines.line().parse()? {
            SimulatorMessage::Ready(ready) => ready,
            SimulatorMessage::Failed(reason) => return Err(TransportError::Simulator(reason).into()),
            other => {
                return Err(self.lines.line().out_of_turn(&other, &awaited(), "answer `reset` with `ready`").into());
            }
        };
        if ready.clock {
            let problem = "says `clock`, but the space steps this simulator".to_owned();
            return Err(self
                .lines
                .line()
                .wrong(problem, "leave `clock` out, or declare the simulator `free running`")
                .into());
        }
        ready.takes(relay.parameters())?;
        self.resets = ready.resets;
        self.ready = true;
        self.topics.open(plan, &ready, relay)?;
        self.topics.publish(plan, SimTime::ZERO, &ready.messages, relay, self.lines.line())?;
        Ok(())
    }

    /// Makes the simulator take its step to `now`.
    pub(super) fn step(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        relay: &mut dyn Exchange,
    ) -> Result<Progress, Fault> {
        self.topics.published = 0;
        relay.advance(now, &mut self.topics.deliveries);
        self.topics.deliver(relay, None);
        let orders = self.orders.take(plan, now, relay);
        request::step(&mut self.line, now, &orders, &self.topics.outbox);
        self.topics.outbox.clear();
        self.send();
        let awaited = || format!("the end of its step to {now}");
        loop {
            if !self.lines.read()? {
                return Err(Fault::Disconnected(awaited()));
            }
            match self.lines.line().parse()? {
                SimulatorMessage::Publish(messages) => {
                    self.topics.publish(plan, now, &messages, relay, self.lines.line())?;
                    request::deliver(&mut self.line, &self.topics.outbox);
                    self.topics.outbox.clear();
                    self.send();
                }
                SimulatorMessage::Done(done) => {
                    self.topics.publish(plan, now, &done.messages, relay, self.lines.line())?;
                    return Ok(if done.ended { Progress::Ended } else { Progress::Running });
                }
                SimulatorMessage::Failed(reason) => return Err(TransportError::Simulator(reason).into()),
                other @ (SimulatorMessage::Ready(_) | SimulatorMessage::Time(_)) => {
                    return Err(self.lines.line().out_of_turn(&other, &awaited(), "end a step with `done`").into());
                }
            }
        }
    }

    /// Sends the line. An error is ignored: a simulator that has closed its input may still have sent the reason, and
    /// the next read returns it.
    fn send(&mut self) {
        self.output.write_all(&self.line).and_then(|()| self.output.flush()).ok();
        self.line.clear();
    }
}

impl Topics {
    /// Forgets the topics of the last run.
    pub(super) fn clear(&mut self) {
        let passed = self.passed.as_ref().map(|_| Vec::new());
        *self = Topics { shapes: mem::take(&mut self.shapes), passed, ..Topics::default() };
    }

    /// Takes the simulator's topics; all topics of the space must be among them, but for states of monitors, and what
    /// operations do to nodes among what it offers. Tells the relay which topics have subscribers.
    pub(super) fn open(
        &mut self,
        plan: &CampaignPlan,
        ready: &Ready<'_>,
        relay: &mut dyn Exchange,
    ) -> Result<(), TransportError> {
        self.timed = ready.times;
        let wires = relay.wires();
        for path in ready.publishes.iter().chain(&ready.subscribes) {
            let topic = Topic { wire: wires.find(path), publishes: false, subscribes: false };
            self.by_path.entry(path.clone()).or_insert(topic);
        }
        self.subscribed = vec![false; wires.len()];
        for path in &ready.publishes {
            self.by_path.entry(path.clone()).and_modify(|topic| topic.publishes = true);
        }
        for path in &ready.subscribes {
            self.by_path.entry(path.clone()).and_modify(|topic| topic.subscribes = true);
            if let Some(wire) = wires.find(path) {
                self.subscribed[wire.index()] = true;
            }
        }
        let is_needed = |&wire: &Wire| !plan.is_state_of_monitor(wires.topic(wire));
        let mut needed = wires.iter().filter(is_needed);
        if let Some(missing) = needed.find(|&wire| !self.by_path.contains_key(wires.path(wire))) {
            return Err(unknown_topic(wires.path(missing), self.by_path.keys()));
        }
        NodeOrders::are_offered(plan, &ready.nodes)?;
        for wire in wires.iter().filter(|wire| self.subscribed[wire.index()]) {
            relay.subscribed(wire);
        }
        Ok(())
    }

    /// Passes messages through the relay; deliveries to subscribers go to the outbox.
    pub(super) fn publish(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        messages: &[Message<'_>],
        relay: &mut dyn Exchange,
        line: &Line,
    ) -> Result<(), TransportError> {
        self.published += messages.len() as u64;
        if self.published > STEP_LIMIT {
            let problem = format!("has more than {STEP_LIMIT} messages in the step to {now}");
            return Err(line.wrong(problem, "end a step with `done`"));
        }
        for Message { topic: path, value } in messages {
            let Some(topic) = self.by_path.get(path.as_ref()).filter(|topic| topic.publishes) else {
                let problem = format!("has a message on `{path}`, which the simulator did not say it publishes");
                return Err(line.wrong(problem, "list it in `publishes` of `ready`"));
            };
            let Some(wire) = topic.wire else {
                if topic.subscribes {
                    request::message(&mut self.outbox, path, self.timed.then_some(now), |out| {
                        out.extend_from_slice(value.get().as_bytes());
                    });
                }
                continue;
            };
            let declared = &plan.topic(relay.wires().topic(wire)).ty;
            let decoded = json::decode(plan, &mut self.shapes, declared, value).map_err(|mismatch: Mismatch| {
                TransportError::WrongType { path: path.as_ref().to_owned(), reason: mismatch.to_string() }
            })?;
            relay.message(now, wire, decoded, &mut self.deliveries);
            self.deliver(relay, Some((wire, value)));
        }
        Ok(())
    }

    /// Puts the relay's deliveries to subscribers into the outbox. A message that no operation intercepts is passed on
    /// byte for byte.
    pub(super) fn deliver(&mut self, relay: &dyn Exchange, published: Option<(Wire, &RawValue)>) {
        for Delivery { wire, at, by_monitor, value, .. } in self.deliveries.drain(..) {
            if !self.subscribed.get(wire.index()).copied().unwrap_or(false) {
                continue;
            }
            if let (Some(passed), Some((from, _))) = (&mut self.passed, published)
                && from == wire
                && !by_monitor
            {
                passed.push(wire);
            }
            let untouched = published.filter(|&(from, _)| from == wire && !by_monitor && !relay.intercepts(wire));
            let time = self.timed.then_some(at);
            request::message(&mut self.outbox, relay.wires().path(wire), time, |out| match untouched {
                Some((_, raw)) => out.extend_from_slice(raw.get().as_bytes()),
                None => json::encode(&value, out),
            });
        }
    }
}

#[cfg(test)]
mod tests;
