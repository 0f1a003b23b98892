//! Services between their clients and their server: requests and replies pass through the relay as messages of two
//! topics.
//!
//! The runner offers a service that is cut to its clients once the server is there and has had time to see the runner:
//! a client that waits for its service calls it at once, and DDS loses a request that nobody takes yet.
//!
//! A reply belongs to a request, which its client has numbered. The relay numbers requests of its own towards the
//! server and remembers whose they are; so a reply finds its client even if operations have held it back.

use std::collections::BTreeMap;
use std::time::Instant;

use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};
use sesame_codec::cdr::Codec;
use sesame_plan::{CampaignPlan, Channel, Interface};
use sesame_relay::wire::{Wire, WireTable, wanted};

use crate::dds::{DdsError, Endpoint, Participant, ReaderId, Received, Sample, WriterId, mirrored};
use crate::names;
use crate::transport::wall_clock::{SETTLE, now};
use crate::transport::wires::absolute;

/// How many calls are remembered; the oldest are forgotten.
const CALLS: usize = 10_000;

/// One of the two directions of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Request,
    Reply,
}

/// A service of the plan.
pub(super) struct Served {
    /// Its name in ROS.
    pub(super) path: String,
    /// Whether its calls pass through the relay, or are only listened to.
    pub(super) cut: bool,
    request: Half,
    reply: Half,
    /// Whose request it was that went to the server under a number of ours.
    asked: BTreeMap<SequenceNumber, SampleIdentity>,
    /// Where replies of the server to our requests go.
    address: GUID,
    /// Since when its server has been there, while it is not yet offered to clients.
    there_since: Option<Instant>,
}

/// What is needed for one direction.
struct Half {
    wire: Wire,
    codec: Codec,
    type_name: String,
    /// `None` for requests of a service that is not yet offered to clients.
    reader: Option<ReaderId>,
    /// `None` where it is only listened to, and for replies of a service that is not yet offered to clients.
    writer: Option<WriterId>,
    /// Per message that the relay was given in this run: the client whose call it belongs to.
    clients: BTreeMap<u64, SampleIdentity>,
    count: u64,
}

impl Half {
    fn join(
        plan: &CampaignPlan,
        interfaces: &[Interface],
        wires: &WireTable,
        wire: Wire,
        [read, write]: [Option<&str>; 2],
        dds: &mut Participant,
    ) -> Result<Self, DdsError> {
        let topic = wires.topic(wire);
        let interface = plan.topic(topic).interface.clone().unwrap_or_default();
        let codec = Codec::new(interfaces, &interface, &wanted(plan, topic));
        let codec = codec.map_err(|error| DdsError(error.to_string()))?;
        let type_name = names::type_name(&interface);
        let mut half = Half { wire, codec, type_name, reader: None, writer: None, clients: BTreeMap::new(), count: 0 };
        if let Some(read) = read {
            half.read(read, dds)?;
        }
        if let Some(write) = write {
            half.write(write, dds)?;
        }
        Ok(half)
    }

    fn read(&mut self, topic: &str, dds: &mut Participant) -> Result<(), DdsError> {
        self.reader = Some(dds.read(topic, &self.type_name, &mirrored([]))?);
        Ok(())
    }

    fn write(&mut self, topic: &str, dds: &mut Participant) -> Result<(), DdsError> {
        self.writer = Some(dds.publish(topic, &self.type_name, &mirrored([]))?);
        Ok(())
    }
}

/// The services of a plan, joined at once towards their servers: what they are is known before anybody appears.
pub(super) fn services(
    plan: &CampaignPlan,
    interfaces: &[Interface],
    wires: &WireTable,
    dds: &mut Participant,
) -> Result<Vec<Served>, DdsError> {
    let of = |channel| wires.iter().filter(move |&wire| plan.topic(wires.topic(wire)).channel == channel);
    let mut services = Vec::new();
    for wire in of(Channel::Request) {
        let Some(reply) = of(Channel::Reply).find(|&reply| wires.path(reply) == wires.path(wire)) else { continue };
        let wiring = &plan.simulator.wiring;
        let cut =
            [wire, reply].iter().any(|&wire| wiring.get(wires.topic(wire).index()).is_some_and(|wiring| wiring.cut));
        let path = absolute(wires.path(wire));
        let server = if cut { format!("{path}/undisturbed") } else { path.clone() };
        let (asked, forwarded) = (names::request(&path), names::request(&server));
        let answered = names::reply(&server);
        let of_requests = if cut { [None, Some(forwarded.as_str())] } else { [Some(asked.as_str()), None] };
        let request = Half::join(plan, interfaces, wires, wire, of_requests, dds)?;
        let reply = Half::join(plan, interfaces, wires, reply, [Some(&answered), None], dds)?;
        let address = reply.reader.and_then(|reader| dds.reader_guid(reader)).unwrap_or(GUID::GUID_UNKNOWN);
        services.push(Served { path, cut, request, reply, asked: BTreeMap::new(), address, there_since: None });
    }
    Ok(services)
}

impl Served {
    fn half(&self, direction: Direction) -> &Half {
        match direction {
            Direction::Request => &self.request,
            Direction::Reply => &self.reply,
        }
    }

    fn half_mut(&mut self, direction: Direction) -> &mut Half {
        match direction {
            Direction::Request => &mut self.request,
            Direction::Reply => &mut self.reply,
        }
    }

    pub(super) fn wire(&self, direction: Direction) -> Wire {
        self.half(direction).wire
    }

    pub(super) fn codec(&self, direction: Direction) -> &Codec {
        &self.half(direction).codec
    }

    /// The direction of this wire, if it is of this service.
    pub(super) fn direction(&self, wire: Wire) -> Option<Direction> {
        [Direction::Request, Direction::Reply].into_iter().find(|&direction| self.wire(direction) == wire)
    }

    /// Offers the service to clients if it is cut and its server is there for long enough; true if it is new to them.
    pub(super) fn offer(
        &mut self,
        publishers: &[Endpoint],
        subscribers: &[Endpoint],
        dds: &mut Participant,
    ) -> Result<bool, DdsError> {
        if !self.cut || self.request.reader.is_some() {
            return Ok(false);
        }
        let answers = names::reply(&self.server());
        if !self.is_served(subscribers) || publishers.iter().all(|endpoint| endpoint.topic != answers) {
            self.there_since = None;
            return Ok(false);
        }
        if self.there_since.get_or_insert_with(now).elapsed() < SETTLE {
            return Ok(false);
        }
        self.request.read(&names::request(&self.path), dds)?;
        self.reply.write(&names::reply(&self.path), dds)?;
        Ok(true)
    }

    /// Forgets the messages of the run before. Calls that are under way stay known.
    pub(super) fn begin(&mut self) {
        for direction in [Direction::Request, Direction::Reply] {
            let half = self.half_mut(direction);
            half.clients.clear();
            half.count = 0;
        }
    }

    /// What a sample is of this service, and the client whose call it belongs to; `None` if it is nothing of it, or
    /// answers a call that nobody remembers.
    pub(super) fn recognise(&mut self, received: &Received) -> Option<(Direction, SampleIdentity)> {
        if Some(received.reader) == self.request.reader {
            // The client may want its reply at its reader.
            let address =
                received.related.map(|related| related.writer_guid).filter(|&guid| guid != GUID::GUID_UNKNOWN);
            let writer_guid = address.unwrap_or(received.identity.writer_guid);
            let client = SampleIdentity { writer_guid, sequence_number: received.identity.sequence_number };
            return Some((Direction::Request, client));
        }
        if Some(received.reader) != self.reply.reader {
            return None;
        }
        let related = received.related?;
        // A service that is not cut answers its clients itself.
        let client = if self.cut { self.asked.remove(&related.sequence_number)? } else { related };
        Some((Direction::Reply, client))
    }

    /// Remembers that the relay is given a message of this call.
    pub(super) fn given(&mut self, direction: Direction, client: SampleIdentity) {
        let half = self.half_mut(direction);
        half.clients.insert(half.count, client);
        half.count += 1;
        if half.clients.len() > CALLS {
            half.clients.pop_first();
        }
    }

    /// The client of a message that the relay delivers.
    pub(super) fn client(&self, direction: Direction, index: u64) -> Option<SampleIdentity> {
        self.half(direction).clients.get(&index).copied()
    }

    /// Sends a request to the server, or a reply to its client. False if nobody takes it.
    pub(super) fn send(
        &mut self,
        direction: Direction,
        client: SampleIdentity,
        sample: Sample,
        dds: &Participant,
    ) -> Result<bool, DdsError> {
        let Some(writer) = self.half(direction).writer else { return Ok(true) };
        let related = match direction {
            Direction::Request => {
                SampleIdentity { writer_guid: self.address, sequence_number: SequenceNumber::UNKNOWN }
            }
            Direction::Reply => client,
        };
        let Some(sent) = dds.write(writer, sample, Some(related))? else { return Ok(false) };
        if direction == Direction::Request {
            self.asked.insert(sent.sequence_number, client);
            if self.asked.len() > CALLS {
                self.asked.pop_first();
            }
        }
        Ok(true)
    }

    /// The name under which its server serves it.
    pub(super) fn server(&self) -> String {
        if self.cut { format!("{}/undisturbed", self.path) } else { self.path.clone() }
    }

    /// Whether its server is there.
    fn is_served(&self, subscribers: &[Endpoint]) -> bool {
        let topic = names::request(&self.server());
        subscribers.iter().any(|endpoint| endpoint.topic == topic)
    }

    /// What is missing before a run, in a phrase.
    pub(super) fn missing(&self, subscribers: &[Endpoint]) -> Option<String> {
        let offered = !self.cut || self.request.reader.is_some();
        (!offered || !self.is_served(subscribers)).then(|| format!("nobody serves `{}`", self.server()))
    }

    /// Who serves it directly although it is cut.
    pub(super) fn direct_server<'a>(&self, subscribers: &'a [Endpoint]) -> Option<&'a Endpoint> {
        let topic = names::request(&self.path);
        subscribers.iter().filter(|_| self.cut).find(|endpoint| endpoint.topic == topic)
    }

    /// Whether clients are there for replies, and a server for requests.
    pub(super) fn heard(&self, direction: Direction, subscribers: &[Endpoint]) -> bool {
        let topic = match direction {
            Direction::Request => return self.is_served(subscribers),
            Direction::Reply => names::reply(&self.path),
        };
        subscribers.iter().any(|endpoint| endpoint.topic == topic)
    }
}
