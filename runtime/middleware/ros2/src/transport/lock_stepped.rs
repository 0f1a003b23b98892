//! Runs in lock-step: the simulator takes a step when it is told to, and each step ends when everybody who had
//! something to answer has answered.
//!
//! The messages of a round are put into the order of their wires before they pass through the relay, so the run does
//! not depend on which of several nodes was faster.

use std::time::Instant;

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::Launched;
use sesame_plan::NodeId;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::TransportError;
use sesame_relay::transport::round::Owed;
use sesame_relay::wire::Wire;

use super::service::Answer;
use super::session::{Incoming, Message, Session, Stepper};
use super::wall_clock::now;
use super::{SILENCE, System, silent};
use crate::dds::Sample;

/// What has come in since the relay was last fed, and what is still to come in this step.
#[derive(Default)]
struct Round {
    messages: Vec<Message>,
    owed: Owed,
}

impl Round {
    fn take(&mut self, message: Message) {
        self.owed.pay(message.wire);
        self.messages.push(message);
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
        // What has come before the step is taken is none of its messages.
        for incoming in session.take() {
            if let Incoming::Message(message) = incoming {
                round.take(message);
            }
        }
        round.owed.extend(self.promises.every_step().iter().copied());
        session.step(&mut round, &mut self.launched, now() + SILENCE)?;
        self.await_owed(&mut round)?;
        self.settle(&mut round, relay)?;
        Ok(Progress::Running)
    }

    /// Takes the messages of a round through the relay, delivers what comes out, and waits for the answers, until
    /// nobody has anything to answer.
    fn settle(&mut self, round: &mut Round, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        loop {
            let Some(session) = &mut self.session else { return Ok(()) };
            // Whoever answers a message has heard everything else of the instant before.
            round.messages.sort_by_key(|message| (self.promises.is_answered(message.wire), message.wire));
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
                self.owe(wire, round);
            }
            self.await_owed(round)?;
        }
    }

    /// Waits for all messages that are owed.
    fn await_owed(&mut self, round: &mut Round) -> Result<(), TransportError> {
        let Some(session) = &mut self.session else { return Ok(()) };
        let limit = now() + SILENCE;
        while !round.owed.is_empty() {
            session.collect(round, &mut self.launched, limit)?;
            if now() >= limit && !round.owed.is_empty() {
                return Err(silent(round.owed.awaited(&self.wires)));
            }
        }
        Ok(())
    }
}

impl System {
    /// Counts the answers to a message that is delivered on this wire. Those of a node that is stopped or dead are owed
    /// when it goes on.
    fn owe(&mut self, delivered: Wire, round: &mut Round) {
        for &(node, with) in self.promises.answers(delivered) {
            if self.is_absent(node) {
                self.postponed.entry(node).or_default().push(with);
            } else {
                round.owed.add(with);
            }
        }
    }

    /// What nodes owe that were stopped and go on is owed now; one that was killed or not active has forgotten it.
    fn call_back(&mut self, round: &mut Round) {
        let back: Vec<NodeId> = self.postponed.keys().copied().filter(|&node| !self.is_absent(node)).collect();
        for node in back {
            let owed = self.postponed.remove(&node).unwrap_or_default();
            if !self.restarted.remove(&node) {
                round.owed.extend(owed);
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use sesame_plan::testing::{minimal, node, topic, topics};
    use sesame_plan::{Node, TopicId, Type};
    use sesame_relay::transport::round::Promises;
    use sesame_relay::wire::WireTable;

    use super::super::session::Origin;
    use super::*;

    #[test]
    fn a_node_that_publishes_twice_never_ends_a_step_early() {
        let mut plan = minimal();
        plan.topics = vec![topic("states", &["left/states", "right/states"], Type::Bool)];
        plan.nodes = vec![Node { every_step: vec![TopicId(0)], publishes: topics(&[0]), ..node("arms") }];
        let wires = WireTable::new(&plan);
        let mut round = Round::default();
        round.owed.extend(Promises::new(&plan, &wires).every_step().iter().copied());
        let sample = Sample(Arc::from([0, 1, 0, 0, 1]));
        let mut come = |path: &str| {
            let wire = wires.find(path).expect("it is a wire of the plan");
            round.take(Message { wire, origin: Origin::Line(0, None), sample: sample.clone(), arrived: None });
            silent(round.owed.awaited(&wires)).to_string()
        };
        come("left/states");
        let awaited = come("left/states");
        assert_eq!(awaited, "a message of the step (1 on `right/states`) was awaited for 10 s of wall time");
        come("right/states");
        assert!(round.owed.is_empty());
        assert_eq!(round.messages.len(), 3, "the surplus message goes through the relay as well");
    }
}
