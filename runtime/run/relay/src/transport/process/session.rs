//! The runner's side of the protocol, over any pair of streams: the order of requests and answers, and the way of
//! messages through the relay.

use std::io::{BufRead, Write};

use serde_json::value::RawValue;

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Type};

use crate::json::{self, Shapes};
use crate::message::Mismatch;
use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::transport::TransportError;
use crate::transport::node_orders::NodeOrders;
use crate::transport::process::protocol::{LINE_LIMIT, Line, Lines, Message, Ready, SimulatorMessage, request};
use crate::transport::topics::{Format, Opened, Published, Refused, STEP_LIMIT, Topics};
use crate::value::Value;

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
    topics: Topics<Json>,
    orders: NodeOrders,
    resets: bool,
    ready: bool,
}

/// Payloads in JSON, and the messages for the next line to the simulator.
#[derive(Debug, Default)]
pub(super) struct Json {
    shapes: Shapes,
    pub(super) outbox: Vec<u8>,
}

impl Format for Json {
    type Payload<'a> = &'a RawValue;

    fn read(&mut self, plan: &CampaignPlan, ty: &Type, payload: &&RawValue) -> Result<Value, Mismatch> {
        json::decode(plan, &mut self.shapes, ty, payload)
    }

    fn pass_on(&mut self, path: &str, at: Option<SimTime>, payload: &&RawValue) {
        request::message(&mut self.outbox, path, at, |out| out.extend_from_slice(payload.get().as_bytes()));
    }

    fn deliver(&mut self, path: &str, at: Option<SimTime>, value: &Value) {
        request::message(&mut self.outbox, path, at, |out| json::encode(value, out));
    }

    fn clear(&mut self) {
        self.outbox.clear();
    }
}

/// Opens the topics that a simulator names in `ready`.
pub(super) fn open(
    topics: &mut Topics<Json>,
    plan: &CampaignPlan,
    ready: &Ready<'_>,
    relay: &mut dyn Exchange,
) -> Result<(), TransportError> {
    let Ready { publishes, subscribes, nodes, times, .. } = ready;
    topics.open(plan, Opened { publishes, subscribes, nodes, times: *times }, relay)
}

/// Passes the messages of a line through the relay.
pub(super) fn publish(
    topics: &mut Topics<Json>,
    plan: &CampaignPlan,
    now: SimTime,
    messages: &[Message<'_>],
    relay: &mut dyn Exchange,
    line: &Line,
) -> Result<(), TransportError> {
    let messages = messages.iter().map(|message| Published {
        path: message.topic.as_ref(),
        payload: message.value,
        delivered: message.delivered,
    });
    topics.publish(plan, now, messages, relay).map_err(|refused| match refused {
        Refused::TooMany => {
            let problem = format!("has more than {STEP_LIMIT} messages in the step to {now}");
            line.wrong(problem, "end a step with `done`")
        }
        Refused::NotPublished(path) => {
            let problem = format!("has a message on `{path}`, which the simulator did not say it publishes");
            line.wrong(problem, "list it in `publishes` of `ready`")
        }
        Refused::Intercepted(path) => {
            let problem = format!("says that a message on `{path}` was delivered, which an operation may change");
            line.wrong(problem, "deliver only messages on topics that are not in `intercepted` of `reset`")
        }
        Refused::WrongType(error) => error,
    })
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
        let paths = wires.iter().map(|wire| wires.path(wire));
        let intercepted = wires.iter().filter(|&wire| relay.intercepts(wire)).map(|wire| wires.path(wire));
        // A monitor may publish as soon as it hears a message.
        let intercepted = plan.monitors.is_empty().then_some(intercepted);
        self.topics.delivers = intercepted.is_some();
        request::reset(&mut self.line, seed, Some(step), relay.parameters(), intercepted, paths);
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
        open(&mut self.topics, plan, &ready, relay)?;
        publish(&mut self.topics, plan, SimTime::ZERO, &ready.messages, relay, self.lines.line())?;
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
        request::step(&mut self.line, now, &orders, &self.topics.format.outbox);
        self.topics.format.outbox.clear();
        self.send();
        let awaited = || format!("the end of its step to {now}");
        loop {
            if !self.lines.read()? {
                return Err(Fault::Disconnected(awaited()));
            }
            match self.lines.line().parse()? {
                SimulatorMessage::Publish(messages) => {
                    publish(&mut self.topics, plan, now, &messages, relay, self.lines.line())?;
                    request::deliver(&mut self.line, &self.topics.format.outbox);
                    self.topics.format.outbox.clear();
                    self.send();
                }
                SimulatorMessage::Done(done) => {
                    publish(&mut self.topics, plan, now, &done.messages, relay, self.lines.line())?;
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

#[cfg(test)]
mod tests;
