//! Calls of services that take nothing: steps and resets.
//!
//! Requests and replies are topics; a reply names its request in addition to the data, as the middlewares of ROS on
//! Fast DDS do it.

use std::time::Instant;

use rustdds::rpc::SampleIdentity;
use rustdds::{GUID, SequenceNumber};

use crate::dds::{DdsError, Endpoint, Participant, ReaderId, Received, Sample, WriterId, mirrored};
use crate::names;

/// A client of one service.
pub(super) struct Client {
    /// The service's name.
    pub(super) path: String,
    kind: Kind,
    writer: WriterId,
    reader: ReaderId,
    addresses: [GUID; 2],
    waiting: Option<SequenceNumber>,
    /// When the call at hand was made.
    pub(super) called: Option<Instant>,
}

/// The types of services that can be called: they take nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// `std_srvs/srv/Trigger`.
    Trigger,
    /// `std_srvs/srv/Empty`.
    Empty,
}

/// What a call came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    Done,
    /// It says that it failed, in its own words.
    Refused(String),
    /// Its reply cannot be read.
    Malformed,
}

impl Client {
    /// A client of this service, if a server has been announced; an error if the service is of another type.
    pub(super) fn connect(
        path: &str,
        subscribers: &[Endpoint],
        publishers: &[Endpoint],
        dds: &mut Participant,
    ) -> Result<Option<Self>, DdsError> {
        let (request, reply) = (names::request(path), names::reply(path));
        let Some(server) = subscribers.iter().find(|endpoint| endpoint.topic == request) else { return Ok(None) };
        if !publishers.iter().any(|endpoint| endpoint.topic == reply) {
            return Ok(None);
        }
        let kind = match names::interface(&server.type_name).as_deref() {
            Some("std_srvs/srv/Trigger_Request") => Kind::Trigger,
            Some("std_srvs/srv/Empty_Request") => Kind::Empty,
            other => {
                let other = other.map_or(server.type_name.clone(), |name| name.trim_end_matches("_Request").to_owned());
                return Err(DdsError(format!(
                    "service `{path}` is of type `{other}`; expected `std_srvs/srv/Trigger` or `std_srvs/srv/Empty`"
                )));
            }
        };
        let reply_type = server.type_name.replace("_Request_", "_Response_");
        let qos = mirrored([]);
        let reader = dds.read(&reply, &reply_type, &qos)?;
        let writer = dds.publish(&request, &server.type_name, &qos)?;
        let addresses =
            [dds.reader_guid(reader), dds.writer_guid(writer)].map(|guid| guid.unwrap_or(GUID::GUID_UNKNOWN));
        Ok(Some(Client { path: path.to_owned(), kind, writer, reader, addresses, waiting: None, called: None }))
    }

    /// Calls the service.
    pub(super) fn call(&mut self, dds: &Participant, now: Instant) -> Result<(), DdsError> {
        const NOTHING: [u8; 5] = [0, 1, 0, 0, 0];
        let related = SampleIdentity { writer_guid: self.addresses[0], sequence_number: SequenceNumber::UNKNOWN };
        let sent = dds.write(self.writer, Sample(NOTHING.into()), Some(related))?;
        let Some(sent) = sent else { return Err(DdsError(format!("service `{}` takes no calls", self.path))) };
        self.waiting = Some(sent.sequence_number);
        self.called = Some(now);
        Ok(())
    }

    /// What a sample answers, if it is the reply to the call at hand.
    pub(super) fn answer(&mut self, received: &Received) -> Option<Answer> {
        if received.reader != self.reader {
            return None;
        }
        let related = received.related?;
        if Some(related.sequence_number) != self.waiting || !self.addresses.contains(&related.writer_guid) {
            return None;
        }
        self.waiting = None;
        self.called = None;
        Some(match self.kind {
            Kind::Empty => Answer::Done,
            Kind::Trigger => trigger(&received.sample.0),
        })
    }
}

/// The reply of `std_srvs/srv/Trigger`: `bool success`, `string message`.
fn trigger(sample: &[u8]) -> Answer {
    match sample.get(4) {
        Some(0) => {
            let text = || {
                let length: [u8; 4] = sample.get(8..12)?.try_into().ok()?;
                let length = if sample[1] == 0 { u32::from_be_bytes(length) } else { u32::from_le_bytes(length) };
                let text = sample.get(12..)?.get(..length.checked_sub(1)? as usize)?;
                Some(String::from_utf8_lossy(text).into_owned())
            };
            text().map_or(Answer::Malformed, Answer::Refused)
        }
        Some(_) => Answer::Done,
        None => Answer::Malformed,
    }
}

/// The time of a `rosgraph_msgs/msg/Clock` in nanoseconds; `None` if the sample is none.
pub(super) fn clock(sample: &[u8]) -> Option<i64> {
    let bytes = |at: usize| sample.get(at..at + 4)?.try_into().ok();
    let (seconds, nanos): ([u8; 4], [u8; 4]) = (bytes(4)?, bytes(8)?);
    let (seconds, nanos) = match sample[1] {
        0 => (i32::from_be_bytes(seconds), u32::from_be_bytes(nanos)),
        1 => (i32::from_le_bytes(seconds), u32::from_le_bytes(nanos)),
        _ => return None,
    };
    (nanos < 1_000_000_000).then(|| i64::from(seconds) * 1_000_000_000 + i64::from(nanos))
}
