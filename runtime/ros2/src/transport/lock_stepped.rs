//! Runs in lock-step: the simulator takes a step when it is told to, and each step ends when everybody who had
//! something to answer has answered.
//!
//! The messages of a round are put into the order of their wires before they pass through the relay, so the run does
//! not depend on which of several nodes was faster.

use std::collections::BTreeMap;
use std::time::Instant;

use sesame_base::time::SimTime;
use sesame_plan::{NodeId, TopicId};
use sesame_relay::lifecycle::launch::Launched;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::TransportError;
use sesame_relay::wire::{Wire, WireTable};

use super::service::Answer;
use super::session::{Incoming, Message, Session, Stepper};
use super::{SILENCE, System, now, silent};
use crate::dds::Sample;

/// What has come in since the relay was last fed, and what is owed: answers to what was delivered in this step.
#[derive(Default)]
struct Round {
    messages: Vec<Message>,
    /// Per topic: how many more answers are expected than have come. A node that hears a message directly may answer it
    /// before the relay has seen it, so that less than none is expected for a while.
    owed: BTreeMap<TopicId, i64>,
}

impl Round {
    fn take(&mut self, message: Message) {
        *self.owed.entry(message.topic).or_default() -= 1;
        self.messages.push(message);
    }

    fn is_owed(&self) -> bool {
        self.owed.values().any(|&count| count > 0)
    }
}

impl System {
    /// Takes one step, unless it would lead beyond `until`.
    pub(super) fn take_step(
        &mut self,
        step: SimTime,
        until: SimTime,
        relay: &mut dyn Exchange,
    ) -> Result<Progress, TransportError> {
        if self.session.is_none() {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        }
        if self.now + step > until {
            return Ok(Progress::Ended);
        }
        self.now = self.now + step;
        let mut round = Round::default();
        // What was held back reaches its subscribers before the step begins.
        relay.advance(self.now, &mut self.deliveries);
        self.obey(relay)?;
        self.call_back(&mut round);
        self.settle(&mut round, relay)?;
        let Some(session) = &mut self.session else { return Ok(Progress::Ended) };
        for &topic in self.plan.nodes.iter().flat_map(|node| &node.every_step) {
            let paths = self.plan.topic(topic).paths.len();
            *round.owed.entry(topic).or_default() += i64::try_from(paths).unwrap_or(i64::MAX);
        }
        session.step(&mut round, &mut self.launched, now() + SILENCE)?;
        self.await_owed(&mut round)?;
        self.settle(&mut round, relay)?;
        Ok(Progress::Running)
    }

    /// Takes the messages of a round through the relay, delivers what comes out, and waits for the answers, until
    /// nobody has anything to answer.
    fn settle(&mut self, round: &mut Round, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        let wires = relay.wires().clone();
        loop {
            let Some(session) = &mut self.session else { return Ok(()) };
            // Whoever answers a message has heard everything else of the instant before.
            let answered = |topic| self.plan.nodes.iter().flat_map(|node| &node.answers).any(|it| it.to == topic);
            round.messages.sort_by_key(|message| (answered(message.topic), message.wire));
            for message in round.messages.drain(..) {
                session.relay(self.now, message, relay, &mut self.deliveries)?;
            }
            self.obey(relay)?;
            self.call_back(round);
            if self.deliveries.is_empty() {
                return Ok(());
            }
            let mut delivered = Vec::new();
            let Some(session) = &mut self.session else { return Ok(()) };
            session.deliver(&mut self.deliveries, &mut |wire| delivered.push(wire))?;
            for wire in delivered {
                self.owe(&wires, wire, round);
            }
            self.await_owed(round)?;
        }
    }

    /// Waits for all messages that are owed.
    fn await_owed(&mut self, round: &mut Round) -> Result<(), TransportError> {
        let Some(session) = &mut self.session else { return Ok(()) };
        let limit = now() + SILENCE;
        while round.is_owed() {
            session.collect(round, &mut self.launched, limit)?;
            if now() >= limit && round.is_owed() {
                let owed = round.owed.iter().filter(|(_, count)| **count > 0);
                let owed: Vec<String> =
                    owed.map(|(&topic, count)| format!("{count} on `{}`", self.plan.topic(topic).name)).collect();
                return Err(silent(format!("a message of the step ({})", owed.join(", "))));
            }
        }
        Ok(())
    }
}

impl System {
    /// Counts the answers to a message that is delivered on this wire.
    fn owe(&mut self, wires: &WireTable, wire: Wire, round: &mut Round) {
        let receiver = wires.link(wire).map(|link| link.to);
        for (node, declared) in (0u32..).map(NodeId).zip(&self.plan.nodes) {
            let reached = match receiver {
                Some(receiver) => receiver == node,
                None => !wires.links().iter().any(|link| link.of == wire && link.to == node),
            };
            for answer in declared.answers.iter().filter(|answer| reached && answer.to == wires.topic(wire)) {
                let [to, with] = [answer.to, answer.with].map(|topic| self.plan.topic(topic).paths.len());
                // Of groups of one size, one member answers another; else all members answer.
                let count = if to == with { 1 } else { i64::try_from(with).unwrap_or(i64::MAX) };
                let absent = self.is_absent(node);
                let owed = if absent { self.postponed.entry(node).or_default() } else { &mut round.owed };
                *owed.entry(answer.with).or_default() += count;
            }
        }
    }

    /// What nodes owe that were stopped and go on is owed now; one that was killed has forgotten it.
    fn call_back(&mut self, round: &mut Round) {
        let back: Vec<NodeId> = self.postponed.keys().copied().filter(|&node| !self.is_absent(node)).collect();
        for node in back {
            let owed = self.postponed.remove(&node).unwrap_or_default();
            if !self.restarted.remove(&node) {
                for (topic, count) in owed {
                    *round.owed.entry(topic).or_default() += count;
                }
            }
        }
    }
}

impl Session {
    /// Adds what comes in to the round; gives the answer to a step, or a tick of the clock that ends one.
    fn collect(
        &mut self,
        round: &mut Round,
        launched: &mut Launched,
        limit: Instant,
    ) -> Result<Option<Answer>, TransportError> {
        let by_clock = matches!(self.step, Stepper::Topic { .. });
        let mut stepped = None;
        let left = limit.saturating_duration_since(now());
        let mut incoming = self.wait_watching(left, launched)?;
        // Topics are read one after another: what was published before the answer may have come in since.
        incoming.extend(self.take());
        for incoming in incoming {
            match incoming {
                Incoming::Message(message) => round.take(message),
                Incoming::Stepped(answer) => stepped = Some(answer),
                Incoming::Clock(_) if by_clock => stepped = Some(Answer::Done),
                Incoming::Clock(_) | Incoming::Reset(_) => {}
            }
        }
        Ok(stepped)
    }

    /// Tells the simulator to take a step, and waits until it has; messages meanwhile belong to the round.
    fn step(&mut self, round: &mut Round, launched: &mut Launched, limit: Instant) -> Result<(), TransportError> {
        match &mut self.step {
            Stepper::Service(caller) => {
                let Some(client) = &mut caller.client else {
                    return Err(TransportError::Simulator("nobody serves its steps".to_owned()));
                };
                client.call(&self.dds, now())?;
            }
            Stepper::Topic { writer: Some(writer), .. } => {
                self.dds.write(*writer, Sample([0, 1, 0, 0, 0].into()), None)?;
            }
            Stepper::Topic { writer: None, .. } | Stepper::None => {
                return Err(TransportError::Simulator("nobody takes its steps".to_owned()));
            }
        }
        loop {
            match self.collect(round, launched, limit)? {
                Some(Answer::Done) => return Ok(()),
                Some(Answer::Refused(reason)) => {
                    return Err(TransportError::Simulator(format!("it refuses a step: {reason}")));
                }
                Some(Answer::Malformed) => {
                    return Err(TransportError::Simulator("its answer to a step cannot be read".to_owned()));
                }
                None if now() >= limit => return Err(silent("the end of a step".to_owned())),
                None => {}
            }
        }
    }

    /// Sets the simulator to time zero, if it has a service for that. Messages from before are passed on.
    pub(super) fn call_reset(&mut self, launched: &mut Launched, limit: Instant) -> Result<(), TransportError> {
        let Some(caller) = &mut self.reset else { return Ok(()) };
        let Some(client) = &mut caller.client else {
            return Err(TransportError::Simulator("nobody serves its reset".to_owned()));
        };
        client.call(&self.dds, now())?;
        loop {
            let mut done = None;
            for incoming in self.wait_watching(limit.saturating_duration_since(now()), launched)? {
                match incoming {
                    Incoming::Reset(answer) => done = Some(answer),
                    other => self.pass_on(other)?,
                }
            }
            match done {
                Some(Answer::Done) => return Ok(()),
                Some(Answer::Refused(reason)) => {
                    return Err(TransportError::Simulator(format!("it refuses to be reset: {reason}")));
                }
                Some(Answer::Malformed) => {
                    return Err(TransportError::Simulator("its answer to the reset cannot be read".to_owned()));
                }
                None if now() >= limit => return Err(silent("the answer to a reset".to_owned())),
                None => {}
            }
        }
    }
}
