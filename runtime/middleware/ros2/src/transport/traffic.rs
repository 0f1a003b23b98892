//! Messages between the nodes and the relay: what comes in is sorted, and what is delivered is published.

use std::sync::Arc;
use std::time::Duration;

use sesame_base::time::SimTime;
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::wire::Wire;

use super::served::Direction;
use super::service;
use super::session::{Caller, ClockReader, Connected, Incoming, Message, Origin, Session, Stepper};
use super::wall_clock::now;
use crate::dds::{DdsError, Received, Sample};
use crate::names;
use crate::node_service::Ticket;

impl Session {
    /// Passes a message on that belongs to no run.
    pub(super) fn pass_on(&mut self, incoming: Incoming) -> Result<(), DdsError> {
        if let Incoming::Message(Message { origin, sample, .. }) = incoming {
            match origin {
                Origin::Line(line, _) if !self.lines[line].line.cut => {}
                Origin::Line(line, _) => {
                    for &writer in self.lines[line].writers.iter().flatten() {
                        self.dds.write(writer, sample.clone(), None)?;
                    }
                }
                Origin::Service(service, direction, client) => {
                    self.services[service].send(direction, client, sample, &self.dds)?;
                }
            }
        }
        Ok(())
    }

    /// What comes in, in the order of arrival, at most after this time.
    pub(super) fn wait(&mut self, timeout: Option<Duration>) -> Result<Vec<Incoming>, DdsError> {
        let mut incoming = self.take();
        if incoming.is_empty() {
            self.dds.wait(timeout).map_err(|error| DdsError(format!("cannot wait for messages: {error}")))?;
            incoming = self.take();
        }
        Ok(incoming)
    }

    /// What has come in.
    pub(super) fn take(&mut self) -> Vec<Incoming> {
        while self.dds.event().is_some() {}
        let mut received = std::mem::take(&mut self.received);
        self.dds.take(&mut received, &mut self.unreadable);
        for (_, problem) in std::mem::take(&mut self.unreadable) {
            self.note(problem);
        }
        let mut incoming = std::mem::take(&mut self.backlog);
        incoming.extend(received.drain(..).filter_map(|received| self.sort(received)));
        self.received = received;
        incoming
    }

    /// Waits for the reply to a call, at most this long; what else comes in meanwhile waits for its turn.
    pub(super) fn reply(&mut self, ticket: Ticket, within: Duration) -> Result<Option<Arc<[u8]>>, DdsError> {
        let limit = now() + within;
        loop {
            let mut received = Vec::new();
            self.dds.take(&mut received, &mut self.unreadable);
            let mut reply = None;
            for received in received {
                let number = received.related.map(|related| related.sequence_number);
                if received.reader == ticket.reader && number == Some(ticket.number) {
                    reply = Some(received.sample.0);
                } else if let Some(incoming) = self.sort(received) {
                    self.backlog.push(incoming);
                }
            }
            let left = limit.saturating_duration_since(now());
            if reply.is_some() || left.is_zero() {
                return Ok(reply);
            }
            self.dds.wait(Some(left)).map_err(|error| DdsError(format!("cannot wait for messages: {error}")))?;
        }
    }

    fn sort(&mut self, received: Received) -> Option<Incoming> {
        if received.reader == self.info_reader {
            if let Some((participant, nodes)) = self.info.read(received.sample.0) {
                self.nodes.learn(participant, nodes);
            }
            return None;
        }
        let arrived = self.added.as_ref().and_then(|_| now().checked_sub(received.age()));
        for (at, connected) in self.lines.iter().enumerate() {
            if let Some(source) = connected.readers.iter().position(|&reader| reader == Some(received.reader)) {
                let publisher = connected.line.sources[source].publisher;
                self.heard.insert(connected.line.topic);
                return Some(Incoming::Message(Message {
                    wire: connected.line.wire,
                    origin: Origin::Line(at, publisher),
                    sample: received.sample,
                    arrived,
                }));
            }
        }
        for (at, service) in self.services.iter_mut().enumerate() {
            if let Some((direction, client)) = service.recognise(&received) {
                return Some(Incoming::Message(Message {
                    wire: service.wire(direction),
                    origin: Origin::Service(at, direction, client),
                    sample: received.sample,
                    arrived,
                }));
            }
        }
        if let ClockReader::Topic { reader: Some(reader), path } = &self.clock
            && *reader == received.reader
        {
            let time = service::clock(&received.sample.0);
            if time.is_none() {
                let note = format!("a message on the clock `{path}` is none of a clock");
                self.note(note);
            }
            if let Some(time) = time {
                self.ticks = Some((self.ticks.map_or(time, |(first, _)| first), time));
            }
            return time.map(Incoming::Clock);
        }
        if let Stepper::Service(Caller { client: Some(client), .. }) = &mut self.step
            && let Some(answer) = client.answer(&received)
        {
            return Some(Incoming::Stepped(answer));
        }
        if let Some(Caller { client: Some(client), .. }) = &mut self.reset
            && let Some(answer) = client.answer(&received)
        {
            return Some(Incoming::Reset(answer));
        }
        None
    }

    /// Tells the relay which wires have subscribers, as far as DDS has announced them by now.
    pub(super) fn tell_subscribers(&self, relay: &mut dyn Exchange) {
        let subscribers = self.subscribers();
        for Connected { line, .. } in &self.lines {
            let heard = |path: &str| subscribers.iter().any(|endpoint| endpoint.topic == names::topic(path));
            for sink in line.sinks.iter().filter(|sink| heard(&sink.path)) {
                relay.found(sink.wire);
            }
            if line.sinks.is_empty() && heard(&line.path) {
                relay.found(line.wire);
            }
        }
        for service in &self.services {
            for direction in [Direction::Request, Direction::Reply] {
                if service.heard(direction, &subscribers) {
                    relay.found(service.wire(direction));
                }
            }
        }
    }

    /// Takes a message through the relay. One that cannot be decoded is passed on as it came.
    pub(super) fn relay(
        &mut self,
        now: SimTime,
        message: Message,
        relay: &mut dyn Exchange,
        deliveries: &mut Vec<Delivery>,
    ) -> Result<(), DdsError> {
        let codec = match message.origin {
            Origin::Line(line, _) => &self.lines[line].codec,
            Origin::Service(service, direction, _) => self.services[service].codec(direction),
        };
        match codec.read(message.sample.0.clone()) {
            Ok(value) => {
                let publisher = match message.origin {
                    Origin::Line(_, publisher) => publisher,
                    Origin::Service(service, direction, client) => {
                        self.services[service].given(direction, client);
                        None
                    }
                };
                relay.message_from(now, message.wire, publisher, value, deliveries);
                Ok(())
            }
            Err(error) => {
                if self.undecodable.insert(message.wire) {
                    let path = relay.wires().path(message.wire);
                    self.note(format!("a message on `{path}` cannot be decoded and is passed on as it came: {error}"));
                }
                self.pass_on(Incoming::Message(message))
            }
        }
    }

    /// Takes a message through the relay and publishes what comes out, and measures how long a message that goes on at
    /// once was kept.
    pub(super) fn relay_at_once(
        &mut self,
        at: SimTime,
        message: Message,
        relay: &mut dyn Exchange,
        deliveries: &mut Vec<Delivery>,
    ) -> Result<(), DdsError> {
        let (wire, arrived) = (message.wire, message.arrived);
        let cut = match message.origin {
            Origin::Line(line, _) => self.lines[line].line.cut,
            Origin::Service(service, ..) => self.services[service].cut,
        };
        self.relay(at, message, relay, deliveries)?;
        let of = |delivery: &Delivery| relay.wires().link(delivery.wire).map_or(delivery.wire, |link| link.of);
        let passes = cut && deliveries.iter().any(|delivery| of(delivery) == wire);
        self.deliver(deliveries, &mut |_| {})?;
        if let (true, Some(added), Some(arrived)) = (passes, &mut self.added, arrived) {
            added.record(wire, arrived.elapsed());
        }
        Ok(())
    }

    /// Publishes what is delivered; what was only listened to stays where it is. Calls `each` with the wire of each
    /// message that was published.
    pub(super) fn deliver(
        &mut self,
        deliveries: &mut Vec<Delivery>,
        each: &mut dyn FnMut(Wire),
    ) -> Result<(), DdsError> {
        for delivery in deliveries.drain(..) {
            if self.publish(&delivery)? {
                each(delivery.wire);
            }
        }
        Ok(())
    }

    /// Publishes a message where it is delivered; false if it is not published anew, or cannot be.
    fn publish(&mut self, delivery: &Delivery) -> Result<bool, DdsError> {
        let Delivery { wire, index, value, .. } = delivery;
        for connected in &self.lines {
            let Some(at) = connected.line.sinks.iter().position(|sink| sink.wire == *wire) else { continue };
            if !connected.line.takes(delivery) {
                return Ok(false);
            }
            let Some(writer) = connected.writers[at] else { return Ok(false) };
            let path = connected.line.sinks[at].path.clone();
            return match connected.codec.write(value) {
                Ok(bytes) => {
                    if self.dds.write(writer, Sample(bytes), None)?.is_none() {
                        self.note(format!("a subscriber of `{path}` does not keep up: messages to it were given up"));
                    }
                    Ok(true)
                }
                Err(error) => {
                    self.note(format!("a message on `{path}` cannot be encoded and is dropped: {error}"));
                    Ok(false)
                }
            };
        }
        for service in &mut self.services {
            let Some(direction) = service.direction(*wire) else { continue };
            let Some(client) = service.client(direction, *index) else { return Ok(false) };
            let (path, cut) = (service.path.clone(), service.cut);
            return match service.codec(direction).write(value) {
                Ok(bytes) => {
                    if !service.send(direction, client, Sample(bytes), &self.dds)? {
                        self.note(format!("calls of `{path}` are not taken: messages were given up"));
                    }
                    Ok(cut)
                }
                Err(error) => {
                    self.note(format!("a call of `{path}` cannot be encoded and is dropped: {error}"));
                    Ok(false)
                }
            };
        }
        Ok(false)
    }
}
